// What the service accepts and how much it does at once.
#ifndef WELLSPACE_SERVER_OPTIONS_H_
#define WELLSPACE_SERVER_OPTIONS_H_

#include <cstdint>

#include "core/mesher.h"

namespace wellspace::server {

// Most bytes of a serialized request message; what gRPC takes by default.
inline constexpr int kMaxRequestBytes = 4 * 1024 * 1024;

// Most bytes of a serialized response message with a chunk.
inline constexpr int kMaxResponseBytes = 1024 * 1024;

struct ServiceOptions {
  int workers = 1;           // jobs that run at once, at least 1
  int max_queued_jobs = 16;  // jobs that wait for a worker
  int max_threads = 1;       // of one job, at least 1
  uint64_t max_points = 10'000'000;
  uint64_t max_vertices = core::kDefaultMaxVertices;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OPTIONS_H_
