// Sessions, operations and answers of the query structure as the client library has them.
#ifndef WELLSPACE_CLIENT_SESSION_H_
#define WELLSPACE_CLIENT_SESSION_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client/mesh.h"

namespace wellspace::client {

using Labels = std::map<std::string, std::string>;

// What a session is created with. See the proto's CreateSessionRequest.
struct SessionOptions {
  MeshOptions parameters;
  Labels labels;
  std::optional<absl::Duration> ttl;  // absent: the server's default
};

// What is changed of a session.
struct SessionChange {
  std::optional<Labels> labels;
  std::optional<absl::Duration> ttl;
};

enum class SessionState { kUnknown, kOpen, kRefining, kReady };

// See the proto's Session.
struct Session {
  std::string name;
  SessionState state = SessionState::kUnknown;
  MeshOptions parameters;
  Labels labels;
  absl::Duration ttl;
  absl::Time create_time;
  absl::Time expire_time;
  uint64_t revision = 0;
  uint64_t committed_points = 0;
  uint64_t vertex_count = 0;
  uint64_t simplex_count = 0;
  std::string last_operation;  // empty before the first
};

// Which part of a list.
struct PageOptions {
  int page_size = 0;       // 0: as many as the server likes
  std::string page_token;  // `next_page_token` of the page before; empty: the first
};

struct SessionPage {
  std::vector<Session> sessions;
  std::string next_page_token;  // empty: this was the last
};

enum class OperationState { kUnknown, kQueued, kRunning, kSucceeded, kFailed, kCancelled };

// See the proto's Operation.
struct Operation {
  std::string name;
  OperationState state = OperationState::kUnknown;
  MeshOptions parameters;
  Progress progress;
  absl::Status error;  // OK unless kFailed or kCancelled
  absl::Time create_time;
  std::optional<absl::Time> start_time;
  std::optional<absl::Time> end_time;
  uint64_t mesh_revision = 0;
};

struct OperationPage {
  std::vector<Operation> operations;
  std::string next_page_token;  // empty: this was the last
};

// Points and revision of a session after an upload.
struct Uploaded {
  uint64_t committed_points = 0;
  uint64_t revision = 0;
};

struct AddedVertices {
  std::vector<uint32_t> vertices;  // that each point became, or was already
  uint64_t revision = 0;
};

// Voronoi cells of c vertices; see the proto's VoronoiCellBatch. The counts add up to the lengths of the arrays.
struct CellBatch {
  int dimension = 0;
  std::vector<uint32_t> vertices;          // c
  std::vector<double> clip_radii;          // c; infinity: not clipped
  std::vector<bool> is_clipped;            // c
  std::vector<uint32_t> node_counts;       // c
  std::vector<double> nodes;               // sum(node_counts) x dimension, row-major
  std::vector<uint32_t> neighbour_counts;  // c
  std::vector<uint32_t> neighbours;        // sum(neighbour_counts)
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_SESSION_H_
