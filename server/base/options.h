// The limits of the service: its requests, and the work at once.
#ifndef WELLSPACE_SERVER_BASE_OPTIONS_H_
#define WELLSPACE_SERVER_BASE_OPTIONS_H_

#include <cstdint>
#include <functional>

#include "absl/time/time.h"
#include "core/meshers/mesher.h"

namespace wellspace::server {

// Most bytes of a serialized request message; what gRPC takes by default.
inline constexpr int kMaxRequestBytes = 4 * 1024 * 1024;

// The memory that a request takes while it comes: its bytes and the message made of them.
inline constexpr uint64_t kMessageBytes = 2 * kMaxRequestBytes;

// Most bytes of a serialized response message with a chunk.
inline constexpr int kMaxResponseBytes = 1024 * 1024;

// Most bytes of any response: what clients of gRPC take by default. Only a Voronoi cell that is larger than
// kMaxResponseBytes by itself comes near it.
inline constexpr int kMaxSentBytes = 4 * 1024 * 1024;

// The memory of the process without any work, and room for the allocator: no part of the budget of memory.
inline constexpr uint64_t kProcessMemoryBytes = uint64_t{64} << 20;

// Of messages that are coming gRPC may hold half of the limit of memory, and at least this.
inline constexpr uint64_t kLeastReceivedBytes = uint64_t{512} << 20;

// The smallest limit of memory with which work can be done.
inline constexpr uint64_t kMinMemoryBytes = uint64_t{128} << 20;

struct ServiceOptions {
  // Jobs.
  int workers = 1;                // that run at once, at least 1
  int small_workers = 0;          // that run small jobs besides; 0: these wait as others do
  int max_queued_jobs = 64;       // that wait for a worker
  int max_jobs_per_tenant = 32;   // that run or wait, at least 1
  int keep_queued = 0;            // refinements that wait here and are not offered to servers that share the store
  int max_threads = 1;            // of one job, at least 1
  uint64_t max_memory_bytes = 0;  // resident memory of the process, at least kMinMemoryBytes; 0: no limit

  // Clouds and meshes.
  uint64_t max_points = 10'000'000;  // of one call, and of one session
  uint64_t max_vertices = core::kDefaultMaxVertices;
  uint64_t max_points_per_tenant = 100'000'000;  // of all its sessions
  uint64_t max_stored_bytes_per_tenant = 0;      // of all its sessions: inputs and meshes; 0: no limit

  // Sessions.
  uint64_t max_sessions = 1000;
  uint64_t max_sessions_per_tenant = 100;
  absl::Duration default_ttl = absl::Hours(1);
  absl::Duration max_ttl = absl::Hours(7 * 24);

  // The time that a stream waits for a client that does not read.
  absl::Duration stall_limit = absl::Minutes(1);

  // The time that it waits for the next message of a client that sends.
  absl::Duration upload_stall_limit = absl::Minutes(5);

  // The end of the server, as AdminService.DrainServer asks for it.
  absl::Duration grace = absl::Seconds(10);  // that running work gets then
  std::function<void()> begin_drain{};       // has Server::Shutdown called soon by another thread; null: none can
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_OPTIONS_H_
