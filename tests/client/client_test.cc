// The Client over a connection that is not gRPC's.
#include "client/client.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/connection.h"
#include "client/overview.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace wellspace::client {
namespace {

using ::testing::_;
using ::testing::Field;
using ::testing::Optional;
using ::testing::Return;
using ::testing::SizeIs;

class MockConnection : public Connection {
 public:
  MOCK_METHOD(absl::Status, MeshPoints,
              (const MeshOptions&, std::span<const double>, MeshSink&, const OnProgress&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<MeshEstimate>, EstimateMesh,
              (const MeshOptions&, std::span<const double>, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<ServerInfo>, GetServerInfo, (const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Health>, CheckHealth, (const std::string&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<OwnedOperationPage>, ListAllOperations,
              (const OperationFilter&, const PageOptions&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Operation>, CancelAnyOperation, (const std::string&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<absl::Duration>, DrainServer, (const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<UsagePage>, GetUsage, (const UsageFilter&, const PageOptions&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<Session>, CreateSession, (const SessionOptions&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Session>, GetSession, (const std::string&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<SessionPage>, ListSessions, (const Labels&, const PageOptions&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<Session>, UpdateSession, (const std::string&, const SessionUpdate&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::Status, DeleteSession, (const std::string&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<PointsLeft>, RemovePoints,
              (const std::string&, std::span<const uint64_t>, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Uploaded>, UploadPoints,
              (const std::string&, PointSource&, std::optional<uint64_t>, const OnPoints&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<AddedSegments>, AddSegments,
              (const std::string&, const Features&, const std::optional<FeatureOffset>&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<AddedTriangles>, AddTriangles,
              (const std::string&, const SurfaceFeatures&, const std::optional<SurfaceOffset>&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<SizesSet>, SetSizes, (const std::string&, const SizeSamples&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::StatusOr<SizesSet>, SetVertexSizes, (const std::string&, const VertexSizes&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::Status, DownloadMesh,
              (const std::string&, MeshSink&, std::optional<uint64_t>, const OnChunks&, const CallOptions&),
              (override));
  MOCK_METHOD(absl::Status, DownloadPart,
              (const std::string&, const PartOptions&, MeshSink&, std::optional<uint64_t>, const OnChunks&,
               const CallOptions&),
              (override));
  MOCK_METHOD(absl::Status, UpdateMesh, (const std::string&, Mesh&, const OnChunks&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Operation>, StartRefinement,
              (const std::string&, const RefinementOptions&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Operation>, GetOperation, (const std::string&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<OperationPage>, ListOperations,
              (const std::string&, const PageOptions&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Operation>, CancelOperation, (const std::string&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Operation>, WatchOperation,
              (const std::string&, const OnProgress&, std::optional<uint64_t>, const CallOptions&), (override));
  MOCK_METHOD(absl::Status, ApproximateNearestNeighbors,
              (const std::string&, std::span<const uint32_t>, const OnDistances&, const CallOptions&), (override));
  MOCK_METHOD(absl::Status, ClippedVoronoiCells,
              (const std::string&, std::span<const uint32_t>, double, const OnCells&, const CallOptions&), (override));
  MOCK_METHOD(absl::Status, VoronoiCells,
              (const std::string&, std::span<const uint32_t>, const OnCells&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<Located>, Locate,
              (const std::string&, std::span<const double>, const LocateOptions&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<TransferredValues>, TransferValues,
              (const std::string&, std::span<const double>, const TransferOptions&, const CallOptions&), (override));
  MOCK_METHOD(absl::StatusOr<AddedVertices>, AddVertices,
              (const std::string&, std::span<const double>, std::span<const uint32_t>, const OnAdded&,
               const CallOptions&),
              (override));
};

absl::Status E(const char* what) { return absl::AbortedError(what); }

TEST(Client, PassesMeshingToItsConnection) {
  auto connection = std::make_shared<MockConnection>();
  Client client(connection);
  const std::vector<double> points = {1, 2};
  MeshOptions options;
  options.dimension = 2;
  // The options of a call reach each call of the connection.
  const CallOptions call = {.timeout = absl::Seconds(3), .stop = {}, .request_id = "", .expected_revision = {}};
  const auto is_call = Field(&CallOptions::timeout, absl::Seconds(3));
  EXPECT_CALL(*connection, MeshPoints(Field(&MeshOptions::dimension, 2), SizeIs(2), _, _, is_call))
      .WillOnce(Return(E("mesh")))
      .WillOnce([](const auto&, const auto&, MeshSink& sink, const auto&, const auto&) {
        EXPECT_TRUE(sink.AddInputVertices(std::vector<uint32_t>{7}).ok());
        return sink.Finish();
      });
  EXPECT_CALL(*connection, EstimateMesh(Field(&MeshOptions::dimension, 2), SizeIs(2), is_call))
      .WillOnce(Return(E("estimate")));
  EXPECT_CALL(*connection, GetServerInfo(is_call)).WillOnce(Return(E("info")));
  EXPECT_CALL(*connection, CheckHealth("a", is_call)).WillOnce(Return(E("health")));
  EXPECT_EQ(client.MeshPoints(options, points, nullptr, call).status(), E("mesh"));
  EXPECT_EQ(client.MeshPoints(options, points, nullptr, call)->input_vertex, std::vector<uint32_t>{7});
  EXPECT_EQ(client.EstimateMesh(options, points, call).status(), E("estimate"));
  EXPECT_EQ(client.GetServerInfo(call).status(), E("info"));
  EXPECT_EQ(client.CheckHealth("a", call).status(), E("health"));
}

TEST(Client, PassesAPartToItsConnection) {
  auto connection = std::make_shared<MockConnection>();
  Client client(connection);
  const PartOptions part{.parts = 8, .part = 7};
  MeshCollector sink;
  const CallOptions call = {.timeout = absl::Seconds(3), .stop = {}, .request_id = ""};
  EXPECT_CALL(*connection, DownloadPart("s", part, ::testing::Ref(sink), std::optional<uint64_t>(6), _,
                                        Field(&CallOptions::timeout, absl::Seconds(3))))
      .WillOnce(Return(E("part")));
  EXPECT_EQ(client.DownloadPart("s", part, sink, 6, nullptr, call), E("part"));
}

TEST(Client, PassesSessionsAndOperationsToItsConnection) {
  auto connection = std::make_shared<MockConnection>();
  Client client(connection);
  const CallOptions call = {.timeout = absl::Seconds(3), .stop = {}, .request_id = "r", .expected_revision = 4};
  const auto is_call =
      ::testing::AllOf(Field(&CallOptions::timeout, absl::Seconds(3)), Field(&CallOptions::request_id, "r"),
                       Field(&CallOptions::expected_revision, std::optional<uint64_t>(4)));
  const std::vector<double> points = {1, 2};
  SpanSource source(2, points);
  const SurfaceFeatures surface;
  const Features features;
  const SizeSamples samples;
  const VertexSizes vertex_sizes;
  MeshCollector sink;
  EXPECT_CALL(*connection, CreateSession(_, is_call)).WillOnce(Return(E("create")));
  EXPECT_CALL(*connection, GetSession("s", is_call)).WillOnce(Return(E("get")));
  EXPECT_CALL(*connection, ListSessions(SizeIs(1), Field(&PageOptions::page_token, "t"), is_call))
      .WillOnce(Return(E("list")));
  EXPECT_CALL(*connection, UpdateSession("s", _, is_call)).WillOnce(Return(E("update")));
  EXPECT_CALL(*connection, DeleteSession("s", is_call)).WillOnce(Return(E("delete")));
  EXPECT_CALL(*connection, RemovePoints("s", SizeIs(2), is_call)).WillOnce(Return(E("remove")));
  EXPECT_CALL(*connection, UploadPoints("s", ::testing::Ref(source), std::optional<uint64_t>(5), _, is_call))
      .WillOnce(Return(E("upload")));
  EXPECT_CALL(*connection, AddSegments("s", ::testing::Ref(features), Optional(FeatureOffset{7, 8}), is_call))
      .WillOnce(Return(E("segments")));
  EXPECT_CALL(*connection, AddTriangles("s", ::testing::Ref(surface), Optional(SurfaceOffset{9, 1}), is_call))
      .WillOnce(Return(E("triangles")));
  EXPECT_CALL(*connection, SetSizes("s", ::testing::Ref(samples), is_call)).WillOnce(Return(E("sizes")));
  EXPECT_CALL(*connection, SetVertexSizes("s", ::testing::Ref(vertex_sizes), is_call))
      .WillOnce(Return(E("vertex sizes")));
  EXPECT_CALL(*connection, DownloadMesh("s", ::testing::Ref(sink), std::optional<uint64_t>(6), _, is_call))
      .WillOnce(Return(E("download")));
  Mesh mesh;
  EXPECT_CALL(*connection, UpdateMesh("s", ::testing::Ref(mesh), _, is_call)).WillOnce(Return(E("update")));
  EXPECT_CALL(*connection, StartRefinement("s", Field(&RefinementOptions::restart, true), is_call))
      .WillOnce(Return(E("start")));
  EXPECT_CALL(*connection, GetOperation("o", is_call)).WillOnce(Return(E("operation")));
  EXPECT_CALL(*connection, ListOperations("s", Field(&PageOptions::page_size, std::optional<int>(2)), is_call))
      .WillOnce(Return(E("operations")));
  EXPECT_CALL(*connection, CancelOperation("o", is_call)).WillOnce(Return(E("cancel")));
  EXPECT_CALL(*connection, WatchOperation("o", _, std::optional<uint64_t>(8), is_call)).WillOnce(Return(E("watch")));
  EXPECT_EQ(client.CreateSession({}, call).status(), E("create"));
  EXPECT_EQ(client.GetSession("s", call).status(), E("get"));
  EXPECT_EQ(client.ListSessions({{"a", "b"}}, {.page_size = {}, .page_token = "t"}, call).status(), E("list"));
  EXPECT_EQ(client.UpdateSession("s", {}, call).status(), E("update"));
  EXPECT_EQ(client.DeleteSession("s", call), E("delete"));
  EXPECT_EQ(client.RemovePoints("s", std::vector<uint64_t>{1, 2}, call).status(), E("remove"));
  EXPECT_EQ(client.UploadPoints("s", source, 5, nullptr, call).status(), E("upload"));
  EXPECT_EQ(client.AddSegments("s", features, FeatureOffset{7, 8}, call).status(), E("segments"));
  EXPECT_EQ(client.AddTriangles("s", surface, SurfaceOffset{9, 1}, call).status(), E("triangles"));
  EXPECT_EQ(client.SetSizes("s", samples, call).status(), E("sizes"));
  EXPECT_EQ(client.SetVertexSizes("s", vertex_sizes, call).status(), E("vertex sizes"));
  EXPECT_EQ(client.DownloadMesh("s", sink, 6, nullptr, call), E("download"));
  EXPECT_EQ(client.UpdateMesh("s", mesh, nullptr, call), E("update"));
  EXPECT_EQ(client.StartRefinement("s", {.restart = true}, call).status(), E("start"));
  EXPECT_EQ(client.GetOperation("o", call).status(), E("operation"));
  EXPECT_EQ(client.ListOperations("s", {.page_size = 2, .page_token = ""}, call).status(), E("operations"));
  EXPECT_EQ(client.CancelOperation("o", call).status(), E("cancel"));
  EXPECT_EQ(client.WatchOperation("o", nullptr, 8, call).status(), E("watch"));
}

TEST(Client, PassesQueriesToItsConnection) {
  auto connection = std::make_shared<MockConnection>();
  Client client(connection);
  const std::vector<uint32_t> vertices = {1, 2, 3};
  const std::vector<double> points = {1, 2};
  EXPECT_CALL(*connection, ApproximateNearestNeighbors("s", SizeIs(3), _, _)).WillOnce(Return(E("nearest")));
  EXPECT_CALL(*connection, ClippedVoronoiCells("s", SizeIs(3), 4, _, _)).WillOnce(Return(E("clipped")));
  EXPECT_CALL(*connection, VoronoiCells("s", SizeIs(3), _, _)).WillOnce(Return(E("cells")));
  EXPECT_CALL(*connection, Locate("s", SizeIs(2), Field(&LocateOptions::revision, std::optional<uint64_t>(5)), _))
      .WillOnce(Return(E("locate")));
  EXPECT_CALL(*connection, TransferValues("s", SizeIs(2), Field(&TransferOptions::from_revision, 4), _))
      .WillOnce(Return(E("transfer")));
  EXPECT_CALL(*connection, AddVertices("s", SizeIs(2), SizeIs(3), _, _)).WillOnce(Return(E("add")));
  EXPECT_EQ(client.ApproximateNearestNeighbors("s", vertices, nullptr), E("nearest"));
  EXPECT_EQ(client.ClippedVoronoiCells("s", vertices, 4, nullptr), E("clipped"));
  EXPECT_EQ(client.VoronoiCells("s", vertices, nullptr), E("cells"));
  EXPECT_EQ(client.Locate("s", points, {.revision = 5}).status(), E("locate"));
  EXPECT_EQ(client.TransferValues("s", points, {.from_revision = 4}).status(), E("transfer"));
  EXPECT_EQ(client.AddVertices("s", points, vertices).status(), E("add"));
}

Session SessionNamed(const std::string& name, SessionState state, const std::string& operation) {
  Session session;
  session.name = name;
  session.state = state;
  session.last_operation = operation;
  return session;
}

absl::StatusOr<Operation> OperationInState(OperationState state) {
  Operation operation;
  operation.state = state;
  return operation;
}

// Two pages of sessions: one that never had an operation, one that is done, one that works, one that goes meanwhile.
std::shared_ptr<MockConnection> FourSessions() {
  auto connection = std::make_shared<testing::NiceMock<MockConnection>>();
  SessionPage first;
  first.sessions = {SessionNamed("new", SessionState::kOpen, ""), SessionNamed("done", SessionState::kReady, "done/1")};
  first.next_page_token = "next";
  SessionPage second;
  second.sessions = {SessionNamed("works", SessionState::kRefining, "works/1"),
                     SessionNamed("goes", SessionState::kRefining, "goes/1")};
  ON_CALL(*connection, ListSessions(_, Field(&PageOptions::page_token, ""), _)).WillByDefault(Return(first));
  ON_CALL(*connection, ListSessions(_, Field(&PageOptions::page_token, "next"), _)).WillByDefault(Return(second));
  ON_CALL(*connection, GetOperation("done/1", _)).WillByDefault(Return(OperationInState(OperationState::kSucceeded)));
  ON_CALL(*connection, GetOperation("works/1", _)).WillByDefault(Return(OperationInState(OperationState::kRunning)));
  ON_CALL(*connection, GetOperation("goes/1", _)).WillByDefault(Return(absl::NotFoundError("gone")));
  return connection;
}

std::vector<std::string> NamesOf(const absl::StatusOr<Overview>& overview) {
  std::vector<std::string> names;
  for (const SessionWithOperation& one : overview->sessions) {
    names.push_back(one.session.name);
  }
  return names;
}

TEST(GetOverview, HasAllSessionsWithTheirOperations) {
  Client client(FourSessions());
  const absl::StatusOr<Overview> all = GetOverview(client);
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_EQ(NamesOf(all), (std::vector<std::string>{"new", "done", "works"}));
  EXPECT_FALSE(all->sessions[0].operation.has_value());
  EXPECT_EQ(all->sessions[2].operation->state, OperationState::kRunning);
  EXPECT_FALSE(all->has_more);
  EXPECT_EQ(NamesOf(GetOverview(client, {.busy_alone = true})), std::vector<std::string>{"works"});
  const absl::StatusOr<Overview> some = GetOverview(client, {.most = 2});
  EXPECT_EQ(some->sessions.size(), 2u);
  EXPECT_TRUE(some->has_more);
}

TEST(GetOverview, ErrorsOfCallsAreItsOwn) {
  const auto connection = FourSessions();
  ON_CALL(*connection, GetOperation("done/1", _)).WillByDefault(Return(E("operation")));
  Client client(connection);
  EXPECT_EQ(GetOverview(client).status(), E("operation"));
  ON_CALL(*connection, ListSessions(_, _, _)).WillByDefault(Return(E("list")));
  EXPECT_EQ(GetOverview(client).status(), E("list"));
}

TEST(SpanSource, SeeksAndReadsWholeRows) {
  const std::vector<double> points = {1, 2, 3, 4, 5, 6};
  SpanSource source(2, points);
  std::vector<double> rows(4);
  ASSERT_TRUE(source.Seek(1).ok());
  EXPECT_EQ(*source.Read(rows), 2u);
  EXPECT_EQ(rows, (std::vector<double>{3, 4, 5, 6}));
  EXPECT_EQ(*source.Read(rows), 0u);
  ASSERT_TRUE(source.Seek(99).ok());
  EXPECT_EQ(*source.Read(rows), 0u);
  ASSERT_TRUE(source.Seek(0).ok());
  EXPECT_EQ(*source.Read(rows), 2u);
  EXPECT_EQ(*source.Read(rows), 1u);
  EXPECT_EQ(rows[0], 5);
}

}  // namespace
}  // namespace wellspace::client
