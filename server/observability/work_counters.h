// Counters of the service's work since its start.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_WORK_COUNTERS_H_
#define WELLSPACE_SERVER_OBSERVABILITY_WORK_COUNTERS_H_

#include <atomic>
#include <cstdint>

namespace wellspace::server {

// Thread safety: thread-safe.
struct WorkCounters {
  std::atomic<uint64_t> points_received{0};
  std::atomic<uint64_t> vertices_made{0};        // of meshes that were finished
  std::atomic<uint64_t> simplices_made{0};       // of meshes that were finished
  std::atomic<uint64_t> cells_served{0};         // vertices that queries were answered for
  std::atomic<uint64_t> structures_given_up{0};  // by idle sessions, for other work
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_WORK_COUNTERS_H_
