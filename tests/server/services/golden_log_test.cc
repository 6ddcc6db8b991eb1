// Folders of sessions that earlier builds have written (tests/data/sessions), and the states that this build finds.
//
//     WELLSPACE_WRITE_GOLDEN=tests/data/sessions/NAME …/server_golden_log_test --gtest_filter='*Write*'
// writes one anew; see the README there.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/meshers/meshing_version.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "server/store/durable_log.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/passing_log.h"
#include "tests/server/store/store_support.h"
#include "tests/server/subprocess.h"

namespace wellspace::server {
namespace {

namespace fs = std::filesystem;

constexpr absl::Duration kLong = absl::Minutes(1);
constexpr char kState[] = "state";  // the label that says which session is which

// The records of a build whose core makes other meshes than this one.
class OtherMeshesRecords final : public PassingRecords {
 public:
  using PassingRecords::PassingRecords;

  absl::StatusOr<StoredSessions> Load() override {
    absl::StatusOr<StoredSessions> stored = PassingRecords::Load();
    for (StoredSession& session : stored->sessions) {
      for (store::v1::StepRecord& step : session.steps) {
        if (step.has_refined() && step.refined().begins()) {
          step.mutable_refined()->set_meshing_version(core::kMeshingVersion + 1);
        }
      }
    }
    return stored;
  }
};

// A server over a folder, and the requests to it.
class GoldenServer {
 public:
  GoldenServer(const std::string& folder, MesherFactory create_mesher = core::Mesher::Create,
               bool makes_other_meshes = false) {
    std::unique_ptr<SessionLog> log = OpenDurableLog({.folder = folder}).value();
    if (makes_other_meshes) {
      log = LogAround<OtherMeshesRecords>(std::move(log));
    }
    service_.emplace(FakeMesher, ServiceOptions{.workers = 1}, Transport::kInProcess, FakeEstimator,
                     std::move(create_mesher), SecurityOptions(), std::move(log));
    calls_.emplace(service_->channel());
  }

  SessionCalls& calls() { return *calls_; }

  std::string Create(const std::string& state, v1::MeshParameters parameters, const std::string& request_id = "") {
    v1::CreateSessionRequest request;
    *request.mutable_parameters() = std::move(parameters);
    (*request.mutable_labels())[kState] = state;
    request.mutable_ttl()->set_seconds(86'400);
    request.set_request_id(request_id);
    return calls().Create(request).name();
  }

  void Refine(const std::string& name, const v1::MeshParameters* parameters = nullptr,
              const std::string& request_id = "") {
    EXPECT_EQ(WaitFor(calls().Start(StartRequest(name, parameters, request_id)).name()).state(),
              v1::Operation::STATE_SUCCEEDED);
  }

  static v1::StartRefinementRequest StartRequest(const std::string& name, const v1::MeshParameters* parameters,
                                                 const std::string& request_id) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    request.set_request_id(request_id);
    if (parameters != nullptr) {
      *request.mutable_parameters() = *parameters;
    }
    return request;
  }

  v1::Operation WaitFor(const std::string& operation) {
    Watch watch(calls().operations(), operation, std::nullopt, kLong);
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation());
  }

  grpc::Status Add(const std::string& name, const std::vector<double>& points, const std::string& request_id = "",
                   v1::AddVerticesResponse* response = nullptr) {
    grpc::ClientContext context;
    v1::AddVerticesRequest request;
    request.set_name(name);
    request.mutable_points()->Assign(points.begin(), points.end());
    request.set_request_id(request_id);
    v1::AddVerticesResponse unused;
    return calls().queries().AddVertices(&context, request, response == nullptr ? &unused : response);
  }

  // Of all chunks; "none" without a mesh.
  std::string MeshHash(const std::string& name) {
    const Download download = calls().DownloadMesh(name, 0, 0, std::nullopt, true);
    if (!download.status.ok()) {
      return DetailsOf(download.status).reason == "MESH_NOT_READY" ? "none" : download.status.error_message();
    }
    uint32_t crc32c = 0;
    for (const v1::MeshChunk& chunk : download.chunks) {
      const std::string bytes = chunk.SerializeAsString();
      crc32c = ExtendCrc32c(crc32c, bytes.data(), bytes.size());
    }
    return absl::StrCat(absl::Hex(crc32c, absl::kZeroPad8));
  }

  // Names by state. An operation that the process before has left is waited for.
  std::map<std::string, std::string> Sessions() {
    std::map<std::string, std::string> names;
    const v1::ListSessionsResponse listed = calls().List({});
    for (const v1::Session& session : listed.sessions()) {
      names[session.labels().at(kState)] = session.name();
      if (!session.last_operation().empty()) {
        WaitFor(session.last_operation());
      }
    }
    return names;
  }

  // The description of each session: a line each.
  std::vector<std::string> Describe() {
    std::vector<std::string> lines;
    for (const auto& [state, name] : Sessions()) {
      const v1::Session session = calls().Get(name);
      std::string operations;
      v1::ListOperationsRequest list;
      list.set_parent(name);
      const v1::ListOperationsResponse listed = calls().ListOperations(list);
      for (const v1::Operation& operation : listed.operations()) {
        absl::StrAppend(&operations, operations.empty() ? "" : ",", v1::Operation::State_Name(operation.state()));
      }
      lines.push_back(
          absl::StrCat(state, " revision ", session.revision(), " ", v1::Session::State_Name(session.state()),
                       " points ", session.committed_points(), " segments ", session.segment_count(),
                       session.triangle_count() == 0 ? "" : absl::StrCat(" triangles ", session.triangle_count()),
                       " vertices ", session.vertex_count(), " simplices ", session.simplex_count(), " operations ",
                       operations, " mesh ", MeshHash(name)));
    }
    return lines;
  }

  // Changes all sessions with a mesh further. Returns their next meshes.
  std::vector<std::string> GoOn() {
    std::vector<std::string> lines;
    for (const auto& [state, name] : Sessions()) {
      const v1::Session session = calls().Get(name);
      if (session.vertex_count() == 0) {
        continue;
      }
      const int dimension = session.parameters().dimension();
      std::vector<double> points(dimension, 0.125);
      points.insert(points.end(), dimension, 0.25);
      if (session.triangle_count() == 0) {
        const grpc::Status added = Add(name, points);
        EXPECT_TRUE(added.ok()) << state << ": " << added.error_message();
        Refine(name);
      } else {
        // No vertices can be added to a domain in space: it is begun anew with more points.
        calls().Upload(name, session.committed_points(), points);
        v1::StartRefinementRequest restart = StartRequest(name, nullptr, "");
        restart.set_restart(true);
        EXPECT_EQ(WaitFor(calls().Start(restart).name()).state(), v1::Operation::STATE_SUCCEEDED);
      }
      lines.push_back(absl::StrCat(state, " next ", calls().Get(name).vertex_count(), " vertices ", MeshHash(name)));
    }
    return lines;
  }

 private:
  std::optional<ServiceHarness> service_;
  std::optional<SessionCalls> calls_;
};

// Of a domain, which features bound.
v1::MeshParameters Plane() {
  v1::MeshParameters parameters;
  parameters.set_dimension(2);
  return parameters;
}

v1::MeshParameters Space() {
  v1::MeshParameters parameters;
  parameters.set_dimension(3);
  return parameters;
}

// Makes requests with ids, or repeats them; the answers.
std::vector<std::string> RepeatRequests(GoldenServer& server, const std::string& refined) {
  v1::AddVerticesResponse added;
  EXPECT_TRUE(server.Add(refined, {0.5, 0.25}, "add", &added).ok());
  return {absl::StrCat("add ", added.ShortDebugString()),
          absl::StrCat("start ", server.calls().Start(GoldenServer::StartRequest(refined, nullptr, "start")).name())};
}

// The insides of surfaces, before and after their refinement.
void WriteSolids(GoldenServer& server) {
  const std::string solid = server.Create("solid", Space());
  server.calls().Upload(solid, 0, BlockPoints());
  server.calls().AddTriangles({BlockRequest(solid)});
  server.Refine(solid);
  v1::MeshParameters finer = Space();
  finer.mutable_surface()->set_edge_length(0.5);
  server.Refine(solid, &finer);
  const std::string open_solid = server.Create("open-solid", Space());
  server.calls().Upload(open_solid, 0, BlockPoints());
  server.calls().AddTriangles({BlockRequest(open_solid)});
}

void WriteUndisturbed(GoldenServer& server) {
  v1::MeshParameters sized = UnitCubeParameters(2);
  v1::SizeBox& box = *sized.add_size_boxes();
  for (int axis = 0; axis < 2; ++axis) {
    box.add_low(0.25);
    box.add_high(0.5);
  }
  box.set_max_circumradius(0.1);
  server.Create("empty", sized);
  server.calls().Upload(server.Create("uploaded", UnitCubeParameters(2)), 0, UniformPoints(40, 2, 1));

  const std::string refined = server.Create("refined", UnitCubeParameters(2), "create");
  server.calls().Upload(refined, 0, UniformPoints(40, 2, 2));
  server.Refine(refined, nullptr, "start");
  RepeatRequests(server, refined);
  server.Refine(refined);

  const std::string added = server.Create("added", UnitCubeParameters(2));
  server.calls().Upload(added, 0, UniformPoints(30, 2, 3));
  server.Refine(added, &sized);
  server.calls().Upload(added, 30, UniformPoints(10, 2, 4));
  EXPECT_TRUE(server.Add(added, UniformPoints(5, 2, 5)).ok());
  server.calls().Upload(added, 45, UniformPoints(3, 2, 6));

  const std::string sizes = server.Create("sizes-at-points", UnitCubeParameters(2));
  server.calls().Upload(sizes, 0, UniformPoints(20, 2, 9));
  server.calls().SetSizes({SizesRequest(sizes, {0.25, 0.75}, {0.02})});
  server.Refine(sizes);
  server.calls().SetSizes({SizesRequest(sizes, {0.75, 0.25}, {0.04})});
  v1::StartRefinementRequest restart = GoldenServer::StartRequest(sizes, nullptr, "");
  restart.set_restart(true);
  server.WaitFor(server.calls().Start(restart).name());
  server.calls().SetSizes({SizesRequest(sizes, {0.5, 0.5}, {0.03})});
  server.Refine(sizes);
  server.calls().SetSizes({SizesRequest(sizes, {0.4, 0.5}, {0.03})});

  const std::string space = server.Create("space", UnitCubeParameters(3));
  server.calls().Upload(space, 0, UniformPoints(12, 3, 7));
  server.Refine(space);

  const std::string domain = server.Create("domain", Plane());
  server.calls().Upload(domain, 0, FramePoints());
  server.calls().AddSegments({FrameRequest(domain)});
  server.Refine(domain);
  for (const char* const state : {"cancelled", "parked"}) {
    const std::string name = server.Create(state, UnitCubeParameters(2));
    server.calls().Upload(name, 0, UniformPoints(30, 2, 8));
    server.Refine(name);
  }
  const std::string open_domain = server.Create("open-domain", Plane());
  server.calls().Upload(open_domain, 0, FramePoints());
  server.calls().AddSegments({FrameRequest(open_domain)});
  WriteSolids(server);
}

// An operation of one session is cancelled, one of another left to the next process.
void WriteInterrupted(const std::string& folder) {
  Event begun;
  GoldenServer server(folder, ScriptedMesher(EndlessIn(core::Phase::kTree, [&] { begun.Set(); })));
  std::map<std::string, std::string> names = server.Sessions();
  const std::string cancelled = server.calls().Start(names["cancelled"]).name();
  ASSERT_TRUE(begun.Wait());
  server.calls().Start(names["parked"]);
  server.calls().Cancel(cancelled);
  EXPECT_EQ(server.WaitFor(cancelled).state(), v1::Operation::STATE_CANCELLED);
}

// A copy of a golden folder, for a server or a program to work on.
std::string CopyOf(const fs::path& golden, const TestFolder& folder) {
  std::string path = folder.path() + "/data";
  fs::copy(golden / "data", path, fs::copy_options::recursive);
  fs::permissions(path, fs::perms::owner_all);
  return path;
}

std::string Join(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    absl::StrAppend(&text, line, "\n");
  }
  return text;
}

// The text of all that a server makes of a folder, which it changes. The first line names the version of meshes.
std::string WhatBecomesOf(const std::string& folder) {
  GoldenServer server(folder);
  std::string text = absl::StrCat("meshing version ", core::kMeshingVersion, "\n");
  absl::StrAppend(&text, Join(server.Describe()));
  absl::StrAppend(&text, Join(RepeatRequests(server, server.Sessions().at("refined"))));
  absl::StrAppend(&text, Join(server.GoOn()));
  return text;
}

// The text of what a server finds in a folder.
std::string WhatIsIn(const std::string& folder) {
  GoldenServer server(folder);
  return Join(server.Describe());
}

std::string ReadText(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Whether a golden folder was written by a build that makes the same meshes; see
// AnotherMeshingVersionKeepsMeshesAndBeginsAnew.
bool IsOfThisMeshing(const fs::path& golden) {
  const std::string expected = ReadText(golden / "expected.txt");
  return expected.substr(0, expected.find('\n')) == absl::StrCat("meshing version ", core::kMeshingVersion);
}

std::string DataFolder() {
  const char* const folder = std::getenv("WELLSPACE_DATA_DIR");
  return folder == nullptr ? "tests/data" : folder;
}

std::vector<fs::path> GoldenFolders() {
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(DataFolder()) / "sessions")) {
    if (entry.is_directory()) {
      folders.push_back(entry.path());
    }
  }
  return folders;
}

int RunProgram(std::vector<std::string> arguments) {
  return Subprocess("wellspaced", std::move(arguments), "/dev/null").Wait();
}

TEST(GoldenLog, WriteAnew) {
  const char* const path = std::getenv("WELLSPACE_WRITE_GOLDEN");
  if (path == nullptr) {
    GTEST_SKIP() << "WELLSPACE_WRITE_GOLDEN says where to";
  }
  const TestFolder folder;
  {
    GoldenServer server(folder.path());
    WriteUndisturbed(server);
  }
  WriteInterrupted(folder.path());
  fs::remove(folder.path() + "/lock");
  fs::remove(folder.path() + "/back-up.lock");
  fs::create_directories(path);
  fs::copy(folder.path(), fs::path(path) / "data", fs::copy_options::recursive);
  const TestFolder copy;
  std::ofstream(fs::path(path) / "expected.txt") << WhatBecomesOf(CopyOf(path, copy));
}

TEST(GoldenLog, ThereIsOneOfThisMeshing) {
  const std::vector<fs::path> folders = GoldenFolders();
  EXPECT_TRUE(std::any_of(folders.begin(), folders.end(), IsOfThisMeshing));
}

TEST(GoldenLog, SessionsOfEarlierBuildsAreThereAndGoOnToTheSameMeshes) {
  for (const fs::path& golden : GoldenFolders()) {
    SCOPED_TRACE(golden);
    if (!IsOfThisMeshing(golden)) {
      continue;
    }
    const TestFolder folder;
    EXPECT_EQ(WhatBecomesOf(CopyOf(golden, folder)), ReadText(golden / "expected.txt"))
        << "if other meshes are meant to be made, core/meshers/meshing_version.h has to be raised";
  }
}

TEST(GoldenLog, AnotherMeshingVersionKeepsMeshesAndBeginsAnew) {
  for (const fs::path& golden : GoldenFolders()) {
    SCOPED_TRACE(golden);
    const std::string expected = ReadText(golden / "expected.txt");
    const TestFolder folder;
    GoldenServer server(CopyOf(golden, folder), core::Mesher::Create, /*makes_other_meshes=*/true);
    for (const std::string& line : server.Describe()) {
      if (line.find("parked") == std::string::npos) {  // whose operation has gone on, to a mesh of this build
        EXPECT_NE(expected.find(line), std::string::npos) << line;
      }
    }
    const std::map<std::string, std::string> names = server.Sessions();
    EXPECT_EQ(DetailsOf(server.Add(names.at("refined"), {0.5, 0.5})).reason, "MESH_NOT_READY");
    server.Refine(names.at("refined"));
    EXPECT_TRUE(server.Add(names.at("refined"), {0.5, 0.5}).ok());
    // All of its points came at once now.
    const std::string fresh = server.Create("fresh", UnitCubeParameters(2));
    std::vector<double> points = UniformPoints(40, 2, 2);
    points.insert(points.end(), {0.5, 0.25, 0.5, 0.5});
    server.calls().Upload(fresh, 0, {points.begin(), points.end() - 2});
    server.Refine(fresh);
    EXPECT_TRUE(server.Add(fresh, {0.5, 0.5}).ok());
    EXPECT_EQ(server.calls().Get(fresh).vertex_count(), server.calls().Get(names.at("refined")).vertex_count());
    EXPECT_EQ(server.MeshHash(fresh), server.MeshHash(names.at("refined")));
  }
}

TEST(GoldenLog, FoldersOfEarlierBuildsAreCheckedAndBackedUp) {
  for (const fs::path& golden : GoldenFolders()) {
    SCOPED_TRACE(golden);
    const TestFolder folder;
    const std::string data = CopyOf(golden, folder);
    const std::string copy = folder.path() + "/copy";
    { GoldenServer brings_the_schema_up(data); }
    EXPECT_EQ(RunProgram({"check-data", data}), 0);
    EXPECT_EQ(RunProgram({"back-up", data, copy}), 0);
    EXPECT_EQ(RunProgram({"check-data", copy}), 0);
    if (IsOfThisMeshing(golden)) {
      EXPECT_EQ(WhatBecomesOf(copy), WhatBecomesOf(data));
    } else {
      EXPECT_EQ(WhatIsIn(copy), WhatIsIn(data));
    }
    std::string mesh;
    for (const fs::directory_entry& file : fs::directory_iterator(copy + "/files")) {
      if (file.path().extension() != ".points") {
        mesh = file.path();
      }
    }
    FlipBit(mesh, 20, 3);
    EXPECT_EQ(RunProgram({"check-data", copy}), 1);
  }
}

}  // namespace
}  // namespace wellspace::server
