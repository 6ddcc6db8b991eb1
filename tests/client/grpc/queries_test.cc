// Queries of the client library, and vertices that it adds.
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/error_details.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;

constexpr char kSession[] = "sessions/one";

// A batch of cells of `vertices`, each a triangle with one neighbour.
v1::VoronoiCellBatch MakeCells(const std::vector<uint32_t>& vertices) {
  v1::VoronoiCellBatch cells;
  for (const uint32_t vertex : vertices) {
    cells.add_vertices(vertex);
    cells.add_clip_radii(std::numeric_limits<double>::infinity());
    cells.add_is_clipped(false);
    cells.add_node_counts(3);
    for (int i = 0; i < 6; ++i) {
      cells.add_nodes(vertex + i);
    }
    cells.add_neighbour_counts(1);
    cells.add_neighbours(vertex + 1);
  }
  return cells;
}

// Answers one vertex a message, and breaks off after so many messages.
template <typename Request, typename Writer>
grpc::Status AnswerSome(const Request& request, size_t count, Writer& writer) {
  v1::VoronoiCellsResponse response;
  for (size_t i = 0; i < std::min<size_t>(count, request.vertices_size()); ++i) {
    *response.mutable_cells() = MakeCells({request.vertices(static_cast<int>(i))});
    writer.Write(response);
  }
  return count < static_cast<size_t>(request.vertices_size()) ? Broken() : grpc::Status::OK;
}

TEST(Queries, GoOnAfterTheLastAnsweredVertex) {
  FakeServer server;
  int calls = 0;
  server.queries.cells = [&calls](grpc::ServerContext&, const v1::VoronoiCellsRequest& request, auto& writer) {
    ++calls;
    EXPECT_EQ(request.name(), kSession);
    return AnswerSome(request, 2, writer);
  };
  std::vector<uint32_t> answered;
  const std::vector<uint32_t> vertices = {9, 3, 7, 1, 5};
  const absl::Status status = server.Client().VoronoiCells(kSession, vertices, [&answered](const CellBatch& cells) {
    answered.insert(answered.end(), cells.vertices.begin(), cells.vertices.end());
    EXPECT_EQ(cells.dimension, 2);
    EXPECT_THAT(cells.node_counts, ElementsAre(3));
    EXPECT_FALSE(cells.is_clipped[0]);
    return absl::OkStatus();
  });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(answered, vertices);
  EXPECT_EQ(calls, 3);
}

TEST(Queries, ManyVerticesGoInSeveralRequests) {
  FakeServer server;
  size_t largest = 0;
  server.queries.nearest = [&largest](grpc::ServerContext&, const v1::ApproximateNearestNeighborsRequest& request,
                                      auto& writer) {
    largest = std::max(largest, request.ByteSizeLong());
    v1::ApproximateNearestNeighborsResponse response;
    for (const uint32_t vertex : request.vertices()) {
      response.add_distances(vertex);
    }
    writer.Write(response);
    return grpc::Status::OK;
  };
  std::vector<uint32_t> vertices(300'000);
  std::iota(vertices.begin(), vertices.end(), 0);
  std::vector<double> distances;
  const absl::Status status =
      server.Client().ApproximateNearestNeighbors(kSession, vertices, [&distances](std::span<const double> batch) {
        distances.insert(distances.end(), batch.begin(), batch.end());
        return absl::OkStatus();
      });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(distances, std::vector<double>(vertices.begin(), vertices.end()));
  EXPECT_LT(largest, 1u << 20);
}

TEST(Queries, OfAllVerticesAreRepeatedOnlyFromTheStart) {
  FakeServer server;
  int calls = 0;
  bool answers_first = false;
  server.queries.clipped = [&](grpc::ServerContext&, const v1::ClippedVoronoiCellsRequest& request, auto& writer) {
    ++calls;
    EXPECT_EQ(request.beta(), 4);
    EXPECT_TRUE(request.vertices().empty());
    if (calls == 1 && !answers_first) {
      return Broken();
    }
    v1::ClippedVoronoiCellsResponse response;
    *response.mutable_cells() = MakeCells({0, 1});
    writer.Write(response);
    return calls == 1 ? Broken() : grpc::Status::OK;
  };
  size_t cells = 0;
  const auto count = [&cells](const CellBatch& batch) {
    cells += batch.vertices.size();
    return absl::OkStatus();
  };
  EXPECT_TRUE(server.Client().ClippedVoronoiCells(kSession, {}, 4, count).ok());
  EXPECT_EQ(calls, 2);
  EXPECT_EQ(cells, 2u);
  calls = 0;
  answers_first = true;
  EXPECT_EQ(server.Client().ClippedVoronoiCells(kSession, {}, 4, count), absl::UnavailableError("Socket closed"));
  EXPECT_EQ(calls, 1);
}

TEST(Queries, DamagedAnswersAreDataLoss) {
  using Spoil = void (*)(v1::VoronoiCellBatch&);
  const std::vector<Spoil> damages = {
      [](v1::VoronoiCellBatch& cells) { cells.mutable_clip_radii()->RemoveLast(); },
      [](v1::VoronoiCellBatch& cells) { cells.add_is_clipped(true); },
      [](v1::VoronoiCellBatch& cells) { cells.mutable_nodes()->RemoveLast(); },
      [](v1::VoronoiCellBatch& cells) { cells.clear_nodes(); },
      [](v1::VoronoiCellBatch& cells) { cells.set_node_counts(0, 0xFFFFFFFF); },
      [](v1::VoronoiCellBatch& cells) { cells.add_neighbours(1); },
      [](v1::VoronoiCellBatch& cells) { cells.set_neighbour_counts(0, 0xFFFFFFFF); },
      [](v1::VoronoiCellBatch& cells) { cells.Clear(); },  // too few
      [](v1::VoronoiCellBatch& cells) {
        cells = MakeCells({0, 1, 2, 3, 4});
      },  // too many
  };
  const std::vector<uint32_t> vertices = {0, 1};
  for (size_t i = 0; i < damages.size(); ++i) {
    FakeServer server;
    server.queries.cells = [&](grpc::ServerContext&, const auto&, auto& writer) {
      v1::VoronoiCellsResponse response;
      *response.mutable_cells() = MakeCells({0, 1});
      damages[i](*response.mutable_cells());
      writer.Write(response);
      return grpc::Status::OK;
    };
    EXPECT_EQ(
        server.Client().VoronoiCells(kSession, vertices, [](const CellBatch&) { return absl::OkStatus(); }).code(),
        absl::StatusCode::kDataLoss)
        << i;
  }
}

TEST(Queries, ACallbackThatFailsEndsTheCall) {
  FakeServer server;
  server.queries.cells = [](grpc::ServerContext&, const v1::VoronoiCellsRequest& request, auto& writer) {
    return AnswerSome(request, 2, writer);
  };
  const std::vector<uint32_t> vertices = {0, 1};
  EXPECT_EQ(
      server.Client().VoronoiCells(kSession, vertices, [](const CellBatch&) { return absl::UnavailableError("full"); }),
      absl::UnavailableError("full"));
}

TEST(Queries, AddVertices) {
  FakeServer server;
  server.queries.add = [](const v1::AddVerticesRequest& request, v1::AddVerticesResponse& response) {
    EXPECT_THAT(request.points(), ElementsAre(0.5, -0.0));
    EXPECT_TRUE(std::signbit(request.points(1)));
    EXPECT_THAT(request.near(), ElementsAre(3));
    EXPECT_EQ(request.expected_revision(), 6u);
    EXPECT_FALSE(request.request_id().empty());
    response.add_vertices(11);
    response.set_revision(7);
    return grpc::Status::OK;
  };
  CallOptions call;
  call.expected_revision = 6;
  const absl::StatusOr<AddedVertices> added =
      server.Client().AddVertices(kSession, std::vector<double>{0.5, -0.0}, std::vector<uint32_t>{3}, nullptr, call);
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_THAT(added->vertices, ElementsAre(11));
  EXPECT_EQ(added->revision, 7u);
}

// 300 000 points in 2-D, and a server that adds those of the first `accepted` requests.
class ManyPoints {
 public:
  static constexpr size_t kCount = 300'000;

  explicit ManyPoints(size_t accepted = 100) {
    server.sessions.get = [](const auto&, v1::GetSessionResponse& response) {
      response.mutable_session()->mutable_parameters()->set_dimension(2);
      return grpc::Status::OK;
    };
    server.queries.add = [this, accepted](const v1::AddVerticesRequest& request, v1::AddVerticesResponse& response) {
      if (requests.size() == accepted) {
        return MakeError(grpc::StatusCode::INVALID_ARGUMENT, "near[2] of points[1] is 9; points[x]",
                         "ERROR_REASON_INVALID_POINTS");
      }
      for (int i = 0; i < request.points_size() / 2; ++i) {
        response.add_vertices(static_cast<uint32_t>(request.points(2 * i)) + 4);
      }
      response.set_revision(10 + requests.size());
      requests.push_back(request);
      return grpc::Status::OK;
    };
    for (size_t i = 0; i < kCount; ++i) {
      points.insert(points.end(), {static_cast<double>(i), 0.5});
      near.push_back(static_cast<uint32_t>(i));
    }
  }

  FakeServer server;
  std::vector<double> points;
  std::vector<uint32_t> near;
  std::vector<v1::AddVerticesRequest> requests;
};

TEST(Queries, AddVerticesTakesSeveralRequestsForManyPoints) {
  ManyPoints many;
  CallOptions call;
  call.expected_revision = 6;
  call.request_id = "mine";
  std::vector<uint32_t> told;
  const OnAdded on_added = [&](const AddedVertices& some) {
    EXPECT_EQ(some.revision, 9 + many.requests.size());
    told.insert(told.end(), some.vertices.begin(), some.vertices.end());
  };
  const absl::StatusOr<AddedVertices> added =
      many.server.Client().AddVertices(kSession, many.points, many.near, on_added, call);
  ASSERT_TRUE(added.ok()) << added.status();
  ASSERT_EQ(many.requests.size(), 2u);
  EXPECT_EQ(added->revision, 11u);
  ASSERT_EQ(added->vertices.size(), ManyPoints::kCount);
  EXPECT_EQ(told, added->vertices);
  for (size_t i = 0; i < ManyPoints::kCount; ++i) {
    ASSERT_EQ(added->vertices[i], i + 4);
  }
  uint32_t next = 0;
  for (const v1::AddVerticesRequest& request : many.requests) {
    EXPECT_LE(request.ByteSizeLong(), size_t{4} << 20);
    EXPECT_EQ(request.near_size(), request.points_size() / 2);
    EXPECT_EQ(request.near(0), next);
    next += request.near_size();
  }
  EXPECT_EQ(many.requests[0].request_id(), "mine");
  EXPECT_EQ(many.requests[1].request_id(), absl::StrCat("mine/", many.requests[0].near_size()));
  EXPECT_EQ(many.requests[0].expected_revision(), 6u);
  EXPECT_EQ(many.requests[1].expected_revision(), 10u);
  // Whether another client has changed the session in between is not asked unless the caller does.
  many.requests.clear();
  EXPECT_TRUE(many.server.Client().AddVertices(kSession, many.points).ok());
  ASSERT_EQ(many.requests.size(), 2u);
  EXPECT_FALSE(many.requests[1].has_expected_revision());
  EXPECT_NE(many.requests[0].request_id(), many.requests[1].request_id());
}

TEST(Queries, AnErrorOfALaterRequestSaysHowManyPointsWereAdded) {
  ManyPoints many(1);
  size_t told = 0;
  const absl::StatusOr<AddedVertices> added = many.server.Client().AddVertices(
      kSession, many.points, {}, [&](const AddedVertices& some) { told += some.vertices.size(); });
  ASSERT_EQ(many.requests.size(), 1u);
  EXPECT_EQ(told, static_cast<size_t>(many.requests[0].points_size() / 2));
  EXPECT_EQ(ReasonOf(added.status()), "ERROR_REASON_INVALID_POINTS");
  EXPECT_EQ(added.status().message(),
            absl::StrCat("near[", told + 2, "] of points[", told + 1, "] is 9; points[x]; the first ", told,
                         " of 300000 points were added before"));
}

TEST(Queries, ManyPointsThatDoNotFitTheSessionAreRefusedBeforeAnyIsAdded) {
  ManyPoints many;
  many.points.push_back(1);
  EXPECT_EQ(many.server.Client().AddVertices(kSession, many.points).status().code(),
            absl::StatusCode::kInvalidArgument);
  many.points.pop_back();
  many.near.pop_back();
  EXPECT_EQ(many.server.Client().AddVertices(kSession, many.points, many.near).status().code(),
            absl::StatusCode::kInvalidArgument);
  CallOptions call;
  call.request_id = std::string(109, 'x');
  EXPECT_EQ(many.server.Client().AddVertices(kSession, many.points, {}, nullptr, call).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(many.requests.empty());
}

}  // namespace
}  // namespace wellspace::client
