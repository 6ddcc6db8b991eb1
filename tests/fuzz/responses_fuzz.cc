// Every call of the client library, answered by a server that sends any bytes.
//
// Input: a letter that chooses the call ('a' MeshPoints, then as in kCalls); then the server's steps, in blocks of a
// letter, a length in two bytes, low one first, and that many bytes: 'e' ends the call with the status whose code is
// the first of the bytes, the others being a serialized google.rpc.Status; any other letter sends the bytes. A call
// that is repeated goes on with the rest; at the end of the input calls end with OK. A checksum of 0 in a chunk of a
// mesh is set right.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/connection.h"
#include "client/files/mesh_file.h"
#include "client/interpolate.h"
#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/grpcpp.h"
#include "proto/checksum.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"
#include "wellspace/v1/meshing.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::fuzz {
namespace {

// A server waits as long for its client, and that for a server that asks it to.
constexpr absl::Duration kTimeout = absl::Milliseconds(100);
constexpr client::RetryPolicy kPolicy = {.max_attempts = 3,
                                         .max_first_attempts = 3,
                                         .initial_backoff = absl::Microseconds(1),
                                         .max_backoff = absl::Microseconds(1)};
constexpr char kSession[] = "sessions/0123456789abcdef0123456789abcdef";

// One thing that the server does.
struct Step {
  bool ends = false;
  grpc::Status status;      // if it ends the call
  grpc::ByteBuffer answer;  // if it does not
};

// The steps of the server, call after call.
class Script {
 public:
  void Set(std::deque<Step> steps) {
    std::lock_guard lock(mutex_);
    steps_ = std::move(steps);
  }

  Step Next() {
    std::lock_guard lock(mutex_);
    if (steps_.empty()) {
      return {.ends = true, .status = grpc::Status::OK, .answer = {}};
    }
    Step step = std::move(steps_.front());
    steps_.pop_front();
    return step;
  }

 private:
  std::mutex mutex_;
  std::deque<Step> steps_;  // guarded by mutex_
};

// Takes all requests, and acts by the script.
class ScriptedCall final : public grpc::ServerGenericBidiReactor {
 public:
  explicit ScriptedCall(Script& script) : script_(script) {
    StartRead(&request_);
    GoOn();
  }

  void OnReadDone(bool ok) override {
    if (ok) {
      StartRead(&request_);
    }
  }
  void OnWriteDone(bool ok) override {
    if (ok) {
      GoOn();
    } else {
      Finish(grpc::Status::CANCELLED);
    }
  }
  void OnDone() override { delete this; }

 private:
  void GoOn() {
    Step step;
    {
      std::lock_guard lock(mutex_);
      step = script_.Next();
      answer_ = std::move(step.answer);
    }
    if (step.ends) {
      Finish(step.status);
    } else {
      StartWrite(&answer_);
    }
  }

  std::mutex mutex_;  // gRPC orders the reactions, but ThreadSanitizer does not see how
  Script& script_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer answer_;
};

class ScriptedServer final : public grpc::CallbackGenericService {
 public:
  ScriptedServer() {
    grpc::ServerBuilder builder;
    builder.RegisterCallbackGenericService(this);
    server_ = builder.BuildAndStart();
    // Whatever address it names is its own.
    connection_ =
        client::MakeConnection(server_->InProcessChannel({}), kPolicy, [this](const std::string& /*address*/) {
          return absl::StatusOr<std::shared_ptr<grpc::Channel>>(server_->InProcessChannel({}));
        });
  }

  Script& script() { return script_; }
  client::Connection& connection() { return *connection_; }

 private:
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* /*context*/) override {
    return new ScriptedCall(script_);
  }

  Script script_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<client::Connection> connection_;
};

// Requires of a mesh the guarantees of MeshSink, and writes it to disk besides.
class SinkCheck final : public client::MeshSink {
 public:
  explicit SinkCheck(const char* name) : file_(ScratchFolder::Get().Path(name)) {}

  absl::Status Begin(const client::MeshHeader& header) override {
    Require(header_.dimension == 0, "a mesh begins once");
    Require(header.dimension > 0 && header.domain_low.size() == static_cast<size_t>(header.dimension) &&
                header.domain_high.size() == static_cast<size_t>(header.dimension),
            "a mesh has a dimension and a box of it");
    header_ = header;
    return file_.Begin(header);
  }
  absl::Status AddPoints(std::span<const double> points) override {
    Require(!points.empty() && points.size() % header_.dimension == 0, "rows of points are whole");
    Require(simplices_ == 0 && input_vertices_ == 0, "points come first");
    Require(std::ranges::all_of(points, [](double x) { return std::isfinite(x); }), "coordinates are finite");
    points_ += points.size() / header_.dimension;
    return file_.AddPoints(points);
  }
  absl::Status AddWeights(std::span<const double> weights) override {
    Require(header_.has_weights && !weights.empty(), "weights come when they are announced");
    Require(points_ == header_.vertex_count && simplices_ == 0, "weights come between points and simplices");
    weights_ += weights.size();
    return file_.AddWeights(weights);
  }
  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    Require(!simplices.empty() && simplices.size() % (header_.dimension + 1) == 0, "rows of simplices are whole");
    Require(points_ == header_.vertex_count && input_vertices_ == 0, "simplices come after the points");
    Require(weights_ == (header_.has_weights ? points_ : 0), "every vertex has a weight, or none");
    RequireVertices(simplices);
    simplices_ += simplices.size() / (header_.dimension + 1);
    return file_.AddSimplices(simplices);
  }
  absl::Status AddInputVertices(std::span<const uint32_t> vertices) override {
    Require(simplices_ == header_.simplex_count, "input vertices come after the simplices");
    RequireVertices(vertices);
    input_vertices_ += vertices.size();
    return file_.AddInputVertices(vertices);
  }
  absl::Status Finish() override {
    Require(points_ == header_.vertex_count && simplices_ == header_.simplex_count &&
                input_vertices_ == header_.input_point_count,
            "a mesh is whole");
    return file_.Finish();
  }

 private:
  void RequireVertices(std::span<const uint32_t> vertices) const {
    Require(std::all_of(vertices.begin(), vertices.end(), [this](uint32_t v) { return v < header_.vertex_count; }),
            "vertices are of the mesh");
  }

  client::MeshFile file_;
  client::MeshHeader header_;
  uint64_t points_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplices_ = 0;
  uint64_t input_vertices_ = 0;
};

// A part has as many numbers as vertices and simplices, and owns what it says.
void RequirePart(const client::Mesh& mesh) {
  Require(mesh.part.has_value() && mesh.part->part == 1 && mesh.part->parts == 2, "it is the part that is wanted");
  const client::MeshPart& part = *mesh.part;
  const size_t vertices = mesh.points.size() / mesh.dimension;
  const size_t simplices = mesh.simplices.size() / (mesh.dimension + 1);
  Require(part.vertex_ids.size() == vertices && part.vertex_owners.size() == vertices &&
              part.vertex_rows.size() == vertices && part.simplex_ids.size() == simplices &&
              part.simplex_owners.size() == simplices && part.facet_ids.size() == mesh.facets.size() / mesh.dimension,
          "a part has all its numbers");
  Require(part.own_vertex_count <= vertices && part.own_simplex_count <= simplices, "it owns what it has");
  Require(std::count(part.vertex_owners.begin(), part.vertex_owners.end(), 1u) ==
              static_cast<ptrdiff_t>(part.own_vertex_count),
          "owners are as it says");
}

// Each point is in a simplex of vertices that there are, or in none.
absl::Status RequirePlaces(const absl::StatusOr<client::Located>& located) {
  if (!located.ok()) {
    return located.status();
  }
  const size_t count = located->simplices.size();
  Require(located->vertices.size() == 3 * count && located->coordinates.size() == 3 * count,
          "there is a place for each");
  for (size_t i = 0; i < 3 * count; ++i) {
    const bool is_in_none = located->simplices[i / 3] == client::kNoSimplex;
    Require(is_in_none || located->vertices[i] < located->vertex_count, "vertices are of the mesh");
    Require(located->coordinates[i] >= 0 && located->coordinates[i] < 2, "coordinates are barycentric");
  }
  const std::vector<double> values(std::min<uint64_t>(located->vertex_count, 1000), 1);
  if (const absl::StatusOr<std::vector<double>> carried = client::Interpolate(*located, values); carried.ok()) {
    Require(carried->size() == count && located->vertex_count == values.size(), "values are of the mesh");
  }
  return absl::OkStatus();
}

absl::Status RequireCells(const client::CellBatch& cells) {
  const size_t count = cells.vertices.size();
  uint64_t nodes = 0;
  uint64_t neighbours = 0;
  for (size_t i = 0; i < std::min(cells.node_counts.size(), cells.neighbour_counts.size()); ++i) {
    nodes += cells.node_counts[i];
    neighbours += cells.neighbour_counts[i];
  }
  Require(cells.clip_radii.size() == count && cells.is_clipped.size() == count && cells.node_counts.size() == count &&
              cells.neighbour_counts.size() == count && cells.nodes.size() == nodes * cells.dimension &&
              cells.neighbours.size() == neighbours,
          "arrays of cells are as long as their counts say");
  Require(std::ranges::none_of(cells.nodes, [](double x) { return std::isnan(x); }), "coordinates are numbers");
  return absl::OkStatus();
}

void RequirePhase(const client::Progress& progress) {
  Require(!progress.phase.empty(), "a phase has a name");
  Require(progress.fraction >= 0 && progress.fraction <= 1, "a fraction is from 0 to 1");
}

constexpr std::array<double, 6> kPoints = {0.25, 0.25, 0.75, 0.25, 0.5, 0.75};
constexpr std::array<uint32_t, 3> kVertices = {2, 0, 1};

client::MeshOptions PlaneOptions() {
  client::MeshOptions options;
  options.dimension = 2;
  return options;
}

// The mesh that a client has of revision 1.
client::Mesh Triangle() {
  client::Mesh mesh;
  mesh.dimension = 2;
  mesh.domain_low = {0, 0};
  mesh.domain_high = {1, 1};
  mesh.points.assign(kPoints.begin(), kPoints.end());
  mesh.simplices = {0, 1, 2};
  mesh.input_vertex = {0, 1, 2};
  mesh.revision = 1;
  return mesh;
}

// Whatever has come, a mesh has whole rows, and numbers of vertices that there are.
void RequireWhole(const client::Mesh& mesh) {
  const size_t dimension = mesh.dimension;
  const size_t vertices = mesh.points.size() / dimension;
  const auto is_vertex = [&](uint32_t vertex) { return vertex < vertices; };
  Require(mesh.points.size() == vertices * dimension && mesh.simplices.size() % (dimension + 1) == 0 &&
              mesh.facets.size() % dimension == 0 && mesh.ridges.size() % 2 == 0,
          "rows are whole");
  Require(std::ranges::all_of(mesh.simplices, is_vertex) && std::ranges::all_of(mesh.facets, is_vertex) &&
              std::ranges::all_of(mesh.ridges, is_vertex) && std::ranges::all_of(mesh.moved_vertices, is_vertex),
          "vertices are of the mesh");
}

client::CallOptions Patience() {
  client::CallOptions call;
  call.timeout = kTimeout;
  call.request_id = "fuzz";
  return call;
}

using Call = absl::Status (*)(client::Connection& connection);
constexpr std::array kCalls = {
    Call{[](client::Connection& c) {
      SinkCheck sink("mesh.vtu");
      return c.MeshPoints(PlaneOptions(), kPoints, sink, RequirePhase, Patience());
    }},
    Call{[](client::Connection& c) { return c.EstimateMesh(PlaneOptions(), kPoints, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.GetServerInfo(Patience()).status(); }},
    Call{[](client::Connection& c) { return c.CheckHealth("", Patience()).status(); }},
    Call{[](client::Connection& c) {
      return c.CreateSession({.parameters = PlaneOptions(), .labels = {}, .ttl = {}}, Patience()).status();
    }},
    Call{[](client::Connection& c) { return c.GetSession(kSession, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.ListSessions({}, {}, Patience()).status(); }},
    Call{[](client::Connection& c) {
      return c.UpdateSession(kSession, {.labels = client::Labels(), .ttl = {}}, Patience()).status();
    }},
    Call{[](client::Connection& c) { return c.DeleteSession(kSession, Patience()); }},
    Call{[](client::Connection& c) {
      client::SpanSource source(2, kPoints);
      return c.UploadPoints(kSession, source, std::nullopt, nullptr, Patience()).status();
    }},
    Call{[](client::Connection& c) {
      SinkCheck sink("mesh.npz");
      const auto count = [](uint64_t done, uint64_t total) { Require(done <= total, "chunks are counted"); };
      return c.DownloadMesh(kSession, sink, 0, count, Patience());
    }},
    Call{[](client::Connection& c) { return c.StartRefinement(kSession, {}, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.GetOperation(kSession, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.ListOperations(kSession, {}, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.CancelOperation(kSession, Patience()).status(); }},
    Call{[](client::Connection& c) {
      return c.WatchOperation(kSession, RequirePhase, std::nullopt, Patience()).status();
    }},
    Call{[](client::Connection& c) {
      const auto take = [](std::span<const double> distances) {
        Require(std::ranges::all_of(distances, [](double distance) { return distance >= 0; }), "distances are numbers");
        return absl::OkStatus();
      };
      return c.ApproximateNearestNeighbors(kSession, kVertices, take, Patience());
    }},
    Call{[](client::Connection& c) { return c.ClippedVoronoiCells(kSession, kVertices, 2, RequireCells, Patience()); }},
    Call{[](client::Connection& c) { return c.VoronoiCells(kSession, {}, RequireCells, Patience()); }},
    Call{[](client::Connection& c) {
      return c.AddVertices(kSession, kPoints, kVertices, nullptr, Patience()).status();
    }},
    Call{[](client::Connection& c) {
      client::Features features;
      features.ends = {0, 1};
      features.seeds = {{.x = 1, .y = 2, .is_hole = true, .region = 0, .max_area = {}}};
      return c.AddSegments(kSession, features, std::nullopt, Patience()).status();
    }},
    Call{[](client::Connection& c) {
      client::Mesh mesh = Triangle();
      const auto count = [](uint64_t done, uint64_t total) { Require(done <= total, "parts are counted"); };
      const absl::Status status = c.UpdateMesh(kSession, mesh, count, Patience());
      RequireWhole(mesh);
      return status;
    }},
    Call{[](client::Connection& c) {
      return RequirePlaces(c.Locate(kSession, kPoints, {.allow_outside = true}, Patience()));
    }},
    Call{[](client::Connection& c) {
      client::SurfaceFeatures surface;
      surface.corners = {0, 1, 2};
      surface.seeds = {{.x = 1, .y = 2, .z = 3, .is_hole = true, .region = 0, .max_volume = {}}};
      return c.AddTriangles(kSession, surface, std::nullopt, Patience()).status();
    }},
    Call{[](client::Connection& c) {
      client::MeshCollector collector;
      absl::Status status = c.DownloadPart(kSession, {.parts = 2, .part = 1}, collector, 0, nullptr, Patience());
      if (status.ok()) {
        RequirePart(collector.mesh());
      }
      return status;
    }},
    Call{[](client::Connection& c) -> absl::Status {
      const auto carried = c.TransferValues(kSession, kPoints, {.from_revision = 1, .components = 2}, Patience());
      if (carried.ok()) {
        Require(carried->values.size() % 2 == 0 && carried->revision > 0, "rows are whole");
        Require(std::ranges::all_of(carried->values, [](double x) { return std::isfinite(x); }), "values are finite");
      }
      return carried.status();
    }},
    Call{[](client::Connection& c) { return c.ListAllOperations({}, {}, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.CancelAnyOperation(kSession, Patience()).status(); }},
    Call{[](client::Connection& c) { return c.DrainServer(Patience()).status(); }},
    Call{[](client::Connection& c) { return c.GetUsage({}, {}, Patience()).status(); }},
};

constexpr size_t kMeshPoints = 0;
constexpr size_t kDownloadMesh = 10;
constexpr size_t kDownloadPart = 24;

template <typename Response>
std::string WithChecksum(std::string bytes) {
  Response response;
  if (!response.ParseFromString(bytes) || !response.has_chunk() || response.chunk().crc32c() != 0) {
    return bytes;
  }
  v1::MeshChunk& chunk = *response.mutable_chunk();
  const auto checksum = [](const auto& values) {
    return Crc32c(values.data(), values.size() * sizeof(*values.data()));
  };
  chunk.set_crc32c(!chunk.points().empty()           ? checksum(chunk.points())
                   : !chunk.simplices().empty()      ? checksum(chunk.simplices())
                   : !chunk.vertex_ids().empty()     ? checksum(chunk.vertex_ids())
                   : !chunk.vertex_owners().empty()  ? checksum(chunk.vertex_owners())
                   : !chunk.vertex_rows().empty()    ? checksum(chunk.vertex_rows())
                   : !chunk.simplex_ids().empty()    ? checksum(chunk.simplex_ids())
                   : !chunk.simplex_owners().empty() ? checksum(chunk.simplex_owners())
                                                     : checksum(chunk.input_vertices()));
  return response.SerializeAsString();
}

std::deque<Step> ReadSteps(ByteReader& bytes, size_t call) {
  std::deque<Step> steps;
  while (!bytes.empty()) {
    Step step;
    step.ends = bytes.Next() == 'e';
    std::string block(bytes.TakeBlock());
    if (step.ends) {
      const int code = block.empty() ? 0 : static_cast<uint8_t>(block[0]) % (grpc::StatusCode::UNAUTHENTICATED + 1);
      step.status =
          grpc::Status(static_cast<grpc::StatusCode>(code), "as the script says", block.empty() ? "" : block.substr(1));
    } else {
      if (call == kMeshPoints) {
        block = WithChecksum<v1::MeshPointsResponse>(std::move(block));
      } else if (call == kDownloadMesh || call == kDownloadPart) {
        block = WithChecksum<v1::DownloadMeshResponse>(std::move(block));
      }
      const grpc::Slice slice(block);
      step.answer = grpc::ByteBuffer(&slice, 1);
    }
    steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  static auto& server = *new fuzz::ScriptedServer();  // gRPC outlives the end of main
  fuzz::ByteReader bytes(data, size);
  const size_t call = static_cast<uint8_t>(bytes.Next() - 'a') % fuzz::kCalls.size();
  server.script().Set(fuzz::ReadSteps(bytes, call));
  const absl::Status status = fuzz::kCalls[call](server.connection());
  // The functions that take an error's details apart.
  if (!status.ok()) {
    client::BlamedField(status);
    client::ReasonOf(status);
    client::RetryDelayOf(status);
  }
  return 0;
}
