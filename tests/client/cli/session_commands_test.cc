// The commands about sessions from the outside, with a server of the test's making. Those about operations and queries,
// and uploads of domains, have files of their own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/formats/numpy/npy.h"
#include "client/formats/read_mesh.h"
#include "proto/checksum.h"
#include "tests/client/cli/closed_port.h"
#include "tests/client/cli/process.h"
#include "tests/client/cli/session_fixture.h"
#include "tests/client/grpc/replica.h"

namespace wellspace {
namespace {

using client::MakeError;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST(SessionCommandsWithoutServer, SayWhatTheyNeed) {
  TemporaryFolder folder;
  const std::string cloud = folder.Write("cloud.csv", "0,0\n");
  const std::vector<std::vector<std::string>> commands = {
      {"session", "create", "--dimension", "2"},
      {"session", "list"},
      {"session", "show", "a"},
      {"session", "update", "a", "--ttl", "9"},
      {"session", "delete", "a"},
      {"upload", "a", cloud},
      {"refine", "a"},
      {"watch", "a"},
      {"cancel", "a"},
      {"download", "a", "-o", folder.Path("a.vtu")},
      {"cells", "a"},
      {"add", "a", cloud},
  };
  for (const std::vector<std::string>& command : commands) {
    const RunResult result = RunWellspace(command);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(command);
    EXPECT_THAT(result.err, AllOf(HasSubstr(command[0]), HasSubstr("needs a server: give --server HOST:PORT, or set "
                                                                   "WELLSPACE_SERVER")));
  }
}

TEST_F(SessionCommandsTest, GoToTheServerThatHasTheSession) {
  client::FakeServer other;
  other.sessions.get = server_.sessions.get;
  server_.sessions.get = [&other](const v1::GetSessionRequest& /*request*/, v1::GetSessionResponse& /*response*/) {
    return client::Elsewhere(other.address());
  };
  const RunResult shown = Run({"session", "show", kSession});
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr(kSession));
  const RunResult stayed = Run({"session", "show", kSession, "--no-follow", "--timeout", "2"});
  EXPECT_NE(stayed.exit_code, 0);
  EXPECT_THAT(stayed.err, HasSubstr("the session is elsewhere"));
  const RunResult told =
      RunWellspace({"session", "show", kSession, "--timeout", "2"},
                   {.input = "", .environment = {"WELLSPACE_SERVER=" + server_.address(), "WELLSPACE_NO_FOLLOW=1"}});
  EXPECT_NE(told.exit_code, 0);
  EXPECT_THAT(told.err, HasSubstr("the session is elsewhere"));
}

TEST_F(SessionCommandsTest, CreatePrintsTheName) {
  v1::CreateSessionRequest seen;
  server_.sessions.create = [&seen](const v1::CreateSessionRequest& request, v1::CreateSessionResponse& response) {
    seen = request;
    *response.mutable_session() = MakeSession();
    return grpc::Status::OK;
  };
  const RunResult text = Run({"session", "create", "--domain", "0,0,1,2", "--size-box", "0,0,1,1,0.5", "--rho", "1.5",
                              "--label", "job=7", "--label", "note=a=b", "--ttl", "1.5"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out, "sessions/one\n");
  EXPECT_EQ(seen.parameters().dimension(), 2);
  EXPECT_THAT(seen.parameters().domain().high(), ElementsAre(1, 2));
  EXPECT_EQ(seen.parameters().size_boxes(0).max_circumradius(), 0.5);
  EXPECT_EQ(seen.labels().at("job"), "7");
  EXPECT_EQ(seen.labels().at("note"), "a=b");
  EXPECT_EQ(seen.ttl().seconds(), 1);
  const RunResult result = Run({"session", "create", "--dimension", "2", "--output", "json"});
  const json session = json::parse(result.out);
  EXPECT_EQ(session["name"], kSession);
  EXPECT_EQ(session["state"], "open");
  EXPECT_EQ(session["parameters"]["rho"], 1.5);
  EXPECT_EQ(session["labels"]["job"], "7");
  EXPECT_EQ(session["ttl_seconds"], 90);
  EXPECT_EQ(session["create_time"], "1970-01-01T00:00:00Z");
  EXPECT_EQ(Run({"session", "create"}).exit_code, 2);
  EXPECT_EQ(Run({"session", "create", "--dimension", "2", "--label", "x"}).exit_code, 2);
}

TEST_F(SessionCommandsTest, ErrorsOfTheServerNameTheOptionAndTheReason) {
  server_.sessions.create = [](const auto&, auto&) {
    google::rpc::BadRequest blame;
    blame.add_field_violations()->set_field("parameters.rho");
    google::rpc::ErrorInfo info;
    info.set_reason("ERROR_REASON_INVALID_PARAMETERS");
    google::rpc::Status details;
    details.add_details()->PackFrom(info);
    details.add_details()->PackFrom(blame);
    return grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "rho: too small", details.SerializeAsString());
  };
  const RunResult text = Run({"session", "create", "--dimension", "2", "--rho", "0.1"});
  EXPECT_EQ(text.exit_code, 2);
  EXPECT_EQ(text.err, "wellspace: --rho: rho: too small [INVALID_ARGUMENT]\n");
  const RunResult as_json = Run({"session", "create", "--dimension", "2", "--rho", "0.1", "--output", "json"});
  EXPECT_EQ(json::parse(as_json.err), json::parse(R"({"error": {"code": "INVALID_ARGUMENT",
      "reason": "ERROR_REASON_INVALID_PARAMETERS", "field": "parameters.rho", "message": "--rho: rho: too small"}})"));
  const RunResult missing = Run({"session", "show", "other", "--output", "json"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_EQ(json::parse(missing.err), json::parse(R"({"error": {"code": "NOT_FOUND",
      "reason": "ERROR_REASON_SESSION_NOT_FOUND", "message": "no session sessions/other"}})"));
  EXPECT_THAT(missing.out, IsEmpty());
}

TEST_F(SessionCommandsTest, ShowTakesEitherFormOfAName) {
  for (const char* name : {"one", "sessions/one"}) {
    const RunResult result = Run({"session", "show", name});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("sessions/one\n"), HasSubstr("1,234"), HasSubstr("job=7"),
                                  HasSubstr("radius-edge, rho 1.5\n")));
  }
}

TEST_F(SessionCommandsTest, ListGoesThroughAllPages) {
  std::vector<v1::ListSessionsRequest> requests;
  server_.sessions.list = [&requests](const v1::ListSessionsRequest& request, v1::ListSessionsResponse& response) {
    requests.push_back(request);
    for (int i = 0; i < (request.page_size() == 0 ? 2 : std::min(2, request.page_size())); ++i) {
      *response.add_sessions() = MakeSession();
    }
    if (request.page_token().size() < 2) {
      response.set_next_page_token(request.page_token() + "x");
    }
    return grpc::Status::OK;
  };
  const RunResult all = Run({"session", "list", "--output", "json", "--label", "job=7"});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(json::parse(all.out).size(), 6u);
  ASSERT_EQ(requests.size(), 3u);
  EXPECT_EQ(requests[2].page_token(), "xx");
  EXPECT_EQ(requests[2].labels().at("job"), "7");
  const RunResult some = Run({"session", "list", "--limit", "3", "--quiet"});
  ASSERT_EQ(some.exit_code, 0) << some.err;
  EXPECT_EQ(std::count(some.out.begin(), some.out.end(), '\n'), 3);
  EXPECT_THAT(some.out, StartsWith("sessions/one"));
}

TEST_F(SessionCommandsTest, AListThatFailsPrintsNothingButTheErrorAndWhatWouldHelp) {
  server_.sessions.list = [](const v1::ListSessionsRequest&, v1::ListSessionsResponse&) {
    return MakeError(grpc::StatusCode::UNAUTHENTICATED, "a token is wanted", "ERROR_REASON_UNAUTHENTICATED");
  };
  const RunResult result = Run({"session", "list"});
  EXPECT_EQ(result.exit_code, 6);
  EXPECT_THAT(result.out, IsEmpty());
  EXPECT_THAT(result.err, HasSubstr("a token is wanted; give --token-file, or set WELLSPACE_TOKEN"));
  const RunResult as_json = Run({"session", "list", "--output", "json"});
  EXPECT_THAT(as_json.out, IsEmpty());
  EXPECT_EQ(json::parse(as_json.err).at("error").at("reason"), "ERROR_REASON_UNAUTHENTICATED");
}

TEST_F(SessionCommandsTest, UpdateAndDelete) {
  v1::UpdateSessionRequest update;
  server_.sessions.update = [&update](const v1::UpdateSessionRequest& request, v1::UpdateSessionResponse& response) {
    update = request;
    *response.mutable_session() = MakeSession();
    return grpc::Status::OK;
  };
  std::vector<std::string> deleted;
  server_.sessions.remove = [&deleted](const v1::DeleteSessionRequest& request, v1::DeleteSessionResponse&) {
    deleted.push_back(request.name());
    return request.name() == "sessions/busy"
               ? MakeError(grpc::StatusCode::ABORTED, "at revision 9", "ERROR_REASON_REVISION_MISMATCH")
               : grpc::Status::OK;
  };
  ASSERT_EQ(Run({"session", "update", "one", "--ttl", "5", "--expected-revision", "2"}).exit_code, 0);
  EXPECT_THAT(update.update_mask().paths(), ElementsAre("ttl"));
  EXPECT_EQ(update.expected_revision(), 2u);
  ASSERT_EQ(Run({"session", "update", "one", "--clear-labels"}).exit_code, 0);
  EXPECT_THAT(update.update_mask().paths(), ElementsAre("labels"));
  EXPECT_TRUE(update.session().labels().empty());
  EXPECT_EQ(Run({"session", "update", "one"}).exit_code, 2);
  const RunResult two = Run({"session", "delete", "one", "sessions/two", "--output", "json"});
  EXPECT_EQ(two.exit_code, 0) << two.err;
  EXPECT_EQ(json::parse(two.out), json::parse(R"({"deleted": ["sessions/one", "sessions/two"]})"));
  const RunResult busy = Run({"session", "delete", "busy"});
  EXPECT_EQ(busy.exit_code, 7);
  EXPECT_THAT(busy.err, HasSubstr("sessions/busy: at revision 9"));
  EXPECT_THAT(deleted, ElementsAre("sessions/one", "sessions/two", "sessions/busy"));
}

TEST_F(SessionCommandsTest, UploadSendsTheFileAndNamesLinesInErrors) {
  std::vector<double> points;
  uint64_t offset = 0;
  bool refuses = false;
  server_.sessions.upload = [&](grpc::ServerContext&, auto& reader, v1::UploadPointsResponse& response) {
    v1::UploadPointsRequest request;
    points.clear();
    while (reader.Read(&request)) {
      offset = points.empty() ? request.point_offset() : offset;
      points.insert(points.end(), request.points().coordinates().begin(), request.points().coordinates().end());
    }
    response.set_committed_points(offset + points.size() / 2);
    response.set_revision(5);
    return refuses ? MakeError(grpc::StatusCode::INVALID_ARGUMENT, "points[1235] is outside the domain",
                               "ERROR_REASON_INVALID_POINTS")
                   : grpc::Status::OK;
  };
  const std::string cloud = folder_.Write("cloud.csv", "x,y\n1,2\n\n3,4\n");
  const RunResult text = Run({"upload", "one", cloud});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out, "sessions/one: 1,236 points, revision 5\n");
  EXPECT_THAT(points, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(offset, 1234u);
  const RunResult piped = Run({"upload", "one", "-", "--offset", "1233", "--output", "json"}, "1,2\n3,4\n");
  ASSERT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(json::parse(piped.out),
            json::parse(R"({"session": "sessions/one", "committed_points": 1235, "revision": 5})"));
  EXPECT_THAT(points, ElementsAre(3, 4));
  refuses = true;
  const RunResult outside = Run({"upload", "one", cloud});
  EXPECT_EQ(outside.exit_code, 2);
  EXPECT_THAT(outside.err, HasSubstr("cloud.csv:4: points[1235] is outside"));
  // Read while it is sent.
  const double numbers[] = {5, 6, 7, 8};
  std::string array = formats::NpyPreamble("<f8", 2, 2);
  array.append(reinterpret_cast<const char*>(numbers), sizeof(numbers));
  const RunResult numpy = Run({"upload", "one", folder_.Write("cloud.npy", array)});
  EXPECT_THAT(points, ElementsAre(5, 6, 7, 8));
  EXPECT_THAT(numpy.err, HasSubstr("cloud.npy[1]: points[1235] is outside"));
  const RunResult solid = Run({"upload", "one", "-"}, "1,2,3\n");
  EXPECT_EQ(solid.exit_code, 2);
  EXPECT_THAT(solid.err, HasSubstr("<stdin>:1: expected 2 coordinates, got 3"));
}

// A triangle, with a hole of no segments.
class RefineWithSizesTest : public SessionCommandsTest {
 protected:
  RefineWithSizesTest() {
    server_.sessions.get = [](const v1::GetSessionRequest&, v1::GetSessionResponse& response) {
      *response.mutable_session() = MakeSession();
      return grpc::Status::OK;
    };
    server_.sessions.set_sizes = [this](grpc::ServerContext&, auto& reader, v1::SetSizesResponse& response) {
      v1::SetSizesRequest request;
      while (reader.Read(&request)) {
        sizes_.push_back(request);
      }
      response.set_revision(8);
      return error_;
    };
    server_.operations.start = [this](const v1::StartRefinementRequest& request,
                                      v1::StartRefinementResponse& response) {
      start_ = request;
      response.mutable_operation()->set_name("sessions/one/operations/1");
      return grpc::Status::OK;
    };
  }

  std::vector<v1::SetSizesRequest> sizes_;
  v1::StartRefinementRequest start_;
  grpc::Status error_;
};

TEST_F(RefineWithSizesTest, SizesComeBeforeTheRefinement) {
  const std::string field = folder_.Write("sizes.csv", "x,y,h\n1,2,0.5\n4,5,0.25\n");
  const RunResult result = Run({"refine", "one", "--detach", "--size-field", field, "--size-unit", "edge", "--restart",
                                "--expected-revision", "7"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  ASSERT_EQ(sizes_.size(), 1u);
  EXPECT_EQ(sizes_[0].name(), kSession);
  EXPECT_EQ(sizes_[0].expected_revision(), 7u);
  EXPECT_THAT(sizes_[0].samples().points(), ElementsAre(1, 2, 4, 5));
  EXPECT_THAT(sizes_[0].samples().sizes(), ElementsAre(0.5, 0.25));
  EXPECT_EQ(sizes_[0].samples().measure(), v1::SIZE_MEASURE_EDGE_LENGTH);
  EXPECT_EQ(start_.expected_revision(), 8u) << "that after the sizes";
  EXPECT_TRUE(start_.restart());
}

TEST_F(RefineWithSizesTest, SizesAreTakenBack) {
  ASSERT_EQ(Run({"refine", "one", "--detach"}).exit_code, 0);
  EXPECT_TRUE(sizes_.empty());
  EXPECT_FALSE(start_.restart());
  ASSERT_EQ(Run({"refine", "one", "--detach", "--no-size-field"}).exit_code, 0);
  ASSERT_EQ(sizes_.size(), 1u);
  EXPECT_EQ(sizes_[0].samples().sizes_size(), 0);
}

TEST_F(RefineWithSizesTest, ErrorsNameTheLineOfTheFile) {
  error_ = MakeError(grpc::StatusCode::INVALID_ARGUMENT, "samples.points[1]: coordinate 0 is 4; in the domain …",
                     "ERROR_REASON_INVALID_SIZES");
  const std::string field = folder_.Write("sizes.csv", "x,y,h\n1,2,0.5\n4,5,0.25\n");
  const RunResult result = Run({"refine", "one", "--detach", "--size-field", field});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("sizes.csv:3"));
  EXPECT_TRUE(start_.name().empty());
}

TEST_F(SessionCommandsTest, DownloadWritesTheMesh) {
  server_.sessions.download = [](grpc::ServerContext&, const v1::DownloadMeshRequest& request, auto& writer) {
    if (request.revision() > 5) {
      return MakeError(grpc::StatusCode::FAILED_PRECONDITION, "at revision 5", "ERROR_REASON_REVISION_MISMATCH");
    }
    const std::vector<double> points = {0, 0, 1, 0, 0, 1, 1, 1};
    const std::vector<uint32_t> simplices = {0, 1, 2, 1, 3, 2};
    v1::DownloadMeshResponse response;
    v1::MeshMetadata& metadata = *response.mutable_metadata();
    metadata.set_dimension(2);
    for (int axis = 0; axis < 2; ++axis) {
      metadata.mutable_domain()->add_low(0);
      metadata.mutable_domain()->add_high(1);
    }
    metadata.set_vertex_count(4);
    metadata.set_simplex_count(2);
    metadata.set_chunk_count(2);
    metadata.set_revision(5);
    writer.Write(response);
    response.mutable_chunk()->mutable_points()->Add(points.begin(), points.end());
    response.mutable_chunk()->set_crc32c(Crc32c(points.data(), points.size() * sizeof(double)));
    writer.Write(response);
    response.mutable_chunk()->Clear();
    response.mutable_chunk()->set_index(1);
    response.mutable_chunk()->mutable_simplices()->Add(simplices.begin(), simplices.end());
    response.mutable_chunk()->set_crc32c(Crc32c(simplices.data(), simplices.size() * sizeof(uint32_t)));
    writer.Write(response);
    return grpc::Status::OK;
  };
  for (const char* name : {"a.vtu", "a.npz", "a.node"}) {
    const RunResult result = Run({"download", "one", "-o", folder_.Path(name)});
    EXPECT_THAT(result.err, HasSubstr("warning: the server is too old to tell the boundary")) << "this one does not";
    EXPECT_EQ(Run({"download", "one", "-o", folder_.Path("bare.vtu"), "--no-boundary"}).err.find("warning"),
              std::string::npos);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(folder_.Path(name));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_THAT(mesh->simplices, ElementsAre(0, 1, 2, 1, 3, 2));
    EXPECT_THAT(mesh->points, ElementsAre(0, 0, 1, 0, 0, 1, 1, 1));
  }
  const RunResult piped = Run({"download", "one", "-o", "-", "--quiet"});
  EXPECT_EQ(piped.exit_code, 0);
  EXPECT_EQ(piped.out, folder_.Read("a.vtu"));
  EXPECT_THAT(piped.err, IsEmpty());
  ASSERT_EQ(Run({"download", "one", "-o", folder_.Path("a.inp"), "--order", "2"}).exit_code, 0);
  EXPECT_THAT(folder_.Read("a.inp"), HasSubstr("9, 0.5, 1\n*ELEMENT, TYPE=CPS6, ELSET=domain\n1, 1, 2, 3, 5, 7, 6\n"));
  const int files = folder_.FileCount();
  const RunResult figures = Run({"download", "one", "-o", folder_.Path("a.npz"), "--output", "json"});
  EXPECT_EQ(json::parse(figures.out)["dimension"], 2);
  EXPECT_EQ(Run({"download", "one", "-o", folder_.Path("b.vtu"), "--revision", "6"}).exit_code, 7);
  EXPECT_EQ(Run({"download", "one", "-o", "-", "--output", "json"}).exit_code, 2);
  EXPECT_EQ(Run({"download", "one", "-o", folder_.Path("b.stl")}).exit_code, 2);
  EXPECT_EQ(folder_.FileCount(), files);
}

TEST_F(SessionCommandsTest, TimeoutIsExitCode5AndLeavesTheOperationAlone) {
  OperationsEndAs({});
  server_.operations.watch = [](grpc::ServerContext& context, const auto&, auto& writer) {
    while (!context.IsCancelled()) {
      writer.Write({});
    }
    return grpc::Status::CANCELLED;
  };
  EXPECT_EQ(Run({"watch", kOperation, "--timeout", "0.2"}).exit_code, 5);
}

TEST_F(SessionCommandsTest, ResultsThatCannotBePrintedAreExitCode4) {
  OperationsEndAs(MakeOperation(v1::Operation::STATE_SUCCEEDED));
  server_.sessions.list = [](const v1::ListSessionsRequest&, v1::ListSessionsResponse& response) {
    *response.add_sessions() = MakeSession();
    return grpc::Status::OK;
  };
  server_.queries.add = [](const v1::AddVerticesRequest&, v1::AddVerticesResponse& response) {
    response.add_vertices(8);
    return grpc::Status::OK;
  };
  server_.queries.nearest = [](grpc::ServerContext&, const auto&, auto& writer) {
    v1::ApproximateNearestNeighborsResponse response;
    response.add_distances(0.5);
    writer.Write(response);
    return grpc::Status::OK;
  };
  const std::vector<std::vector<std::string>> printing = {
      {"session", "list"},
      {"session", "list", "--output", "json"},
      {"session", "show", "one"},
      {"session", "show", "one", "--output", "json"},
      {"refine", "one"},
      {"refine", "one", "--output", "json"},
      {"refine", "one", "--detach"},
      {"watch", kOperation},
      {"watch", kOperation, "--output", "json"},
      {"add", "one", folder_.Write("points.csv", "1,2\n")},
      {"cells", "one", "--nearest", "0"},
  };
  for (const std::vector<std::string>& arguments : printing) {
    EXPECT_EQ(Run(arguments).exit_code, 0) << testing::PrintToString(arguments);
    const RunResult full = RunWellspace(arguments, {.input = "",
                                                    .environment = {"WELLSPACE_SERVER=" + server_.address()},
                                                    .error_descriptor = -1,
                                                    .shell = "exec >/dev/full"});
    EXPECT_EQ(full.exit_code, 4) << testing::PrintToString(arguments);
    EXPECT_THAT(full.err, HasSubstr("cannot write <stdout>: No space left")) << testing::PrintToString(arguments);
  }
}

// It would go on as long as the operation does.
TEST_F(SessionCommandsTest, AWatchWhoseEventsCannotBePrintedEnds) {
  OperationsEndAs({});
  server_.operations.watch = [](grpc::ServerContext& context, const auto&, auto& writer) {
    v1::WatchOperationResponse response;
    response.mutable_progress()->set_phase(v1::PHASE_REFINEMENT);
    while (!context.IsCancelled() && writer.Write(response)) {
    }
    return grpc::Status::CANCELLED;
  };
  const RunResult result =
      RunWellspace({"watch", kOperation, "--output", "json"}, {.input = "",
                                                               .environment = {"WELLSPACE_SERVER=" + server_.address()},
                                                               .error_descriptor = -1,
                                                               .shell = "exec >/dev/full"});
  EXPECT_EQ(result.exit_code, 4) << result.err;
}

// Nothing is behind the proxy: a call that goes there gets nowhere.
TEST_F(SessionCommandsTest, AProxyOfTheEnvironmentIsNotForTheLoopbackAndIsNamed) {
  const ClosedPort closed;
  const std::string proxy = closed.address();
  for (const char* variable : {"http_proxy", "https_proxy", "grpc_proxy"}) {
    const std::vector<std::string> environment = {std::string(variable) + "=http://me:secret@" + proxy,
                                                  "no_proxy=none"};
    const RunResult near = RunWellspace({"session", "show", "one", "--server", server_.address()},
                                        {.input = "", .environment = environment, .error_descriptor = -1});
    EXPECT_EQ(near.exit_code, 0) << variable << near.err;
    const RunResult far = RunWellspace({"server", "health", "--server", "mesher.invalid:7233"},
                                       {.input = "", .environment = environment, .error_descriptor = -1});
    EXPECT_EQ(far.exit_code, 3) << variable << far.err;
    EXPECT_THAT(far.err, AllOf(HasSubstr("server mesher.invalid:7233: "), HasSubstr("by the proxy http://" + proxy),
                               HasSubstr(variable), HasSubstr("no_proxy=mesher.invalid"), Not(HasSubstr("secret"))));
  }
}

TEST_F(SessionCommandsTest, AUrlIsNoAddress) {
  const RunResult result = RunWellspace({"server", "health", "--server", "http://" + server_.address()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("expected HOST:PORT without http://, " + server_.address()));
}

}  // namespace
}  // namespace wellspace
