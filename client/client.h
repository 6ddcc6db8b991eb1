// The C++ client library: a mesh from a wellspaced server, near or far.
#ifndef WELLSPACE_CLIENT_CLIENT_H_
#define WELLSPACE_CLIENT_CLIENT_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace wellspace::client {

class Connection;

// What `rho` bounds; see the proto's Criterion.
enum class Criterion { kRadiusEdge, kWellSpaced };

// A box in which simplices are small; see the proto's SizeBox.
struct SizeBox {
  std::vector<double> low;
  std::vector<double> high;
  double max_circumradius = 0;
};

// What to mesh and how. Zero or empty means the server's default, as the comments of the proto's MeshParameters say.
struct MeshOptions {
  int dimension = 3;
  double rho = 0;
  Criterion criterion = Criterion::kRadiusEdge;
  double max_circumradius = 0;
  std::vector<SizeBox> size_boxes;
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  double margin = 0.25;
  uint64_t max_vertices = 0;
  int threads = 0;
  absl::Duration timeout = absl::InfiniteDuration();  // of the whole call
};

struct Progress {
  std::string phase;
  uint64_t vertices = 0;
  uint64_t estimated_vertices = 0;  // 0 while unknown
  uint64_t simplices = 0;
  double fraction = 0;  // in [0, 1], never decreasing
};

struct MeshStatistics {
  uint64_t input_points = 0;
  uint64_t duplicates = 0;
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  double max_radius_edge = 0;
  double min_angle_deg = 0;               // above 2-D: smallest dihedral angle
  std::map<std::string, double> seconds;  // by phase, and "total"
  uint64_t peak_memory_bytes = 0;
  std::map<std::string, uint64_t> counters;
};

struct Mesh {
  int dimension = 0;
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  std::vector<double> points;          // vertex_count x dimension, row-major; the distinct input points first
  std::vector<uint32_t> simplices;     // simplex_count x (dimension + 1), row-major
  std::vector<uint32_t> input_vertex;  // per input point: the vertex it became
  MeshStatistics statistics;
};

// How large a mesh would be.
struct MeshEstimate {
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  uint64_t memory_bytes = 0;  // most that the server would take at once
  uint64_t tree_leaves = 0;
};

struct ServerInfo {
  std::string version;
  std::vector<int> dimensions;
  uint64_t max_points = 0;
  uint64_t max_vertices = 0;
  int workers = 0;
  int running_jobs = 0;
  int queued_jobs = 0;
};

// A thin face over a Connection.
//
// Thread safety: thread-safe.
class Client {
 public:
  explicit Client(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}

  // Meshes `points` (n x dimension, row-major), calling `on_progress` from the calling thread's call as events arrive.
  // Errors:     the server's, unchanged; CANCELLED when `stop` asks for it; UNAVAILABLE when the server cannot be
  //             reached.
  absl::StatusOr<Mesh> MeshPoints(const MeshOptions& options, std::span<const double> points,
                                  const std::function<void(const Progress&)>& on_progress = nullptr,
                                  std::stop_token stop = {});

  // Estimates the mesh that MeshPoints would make of the same arguments.
  // Errors:     as of MeshPoints.
  absl::StatusOr<MeshEstimate> EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                            std::stop_token stop = {});

  absl::StatusOr<ServerInfo> GetServerInfo();

 private:
  std::shared_ptr<Connection> connection_;
};

// The path of the field that the server blames for an error, from the request on, such as "parameters.rho"; empty when it
// blames none.
std::string BlamedField(const absl::Status& status);

// Connects to HOST:PORT in plain text. Lazy: errors show in the first call.
absl::StatusOr<Client> Connect(const std::string& address);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_CLIENT_H_
