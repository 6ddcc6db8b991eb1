// Logs and counts of the work itself: refinements, meshes, points and queries.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_WORK_OBSERVER_H_
#define WELLSPACE_SERVER_OBSERVABILITY_WORK_OBSERVER_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/observability/work_counters.h"
#include "spdlog/logger.h"

namespace wellspace::server {

// A report on the end of a session's refinement.
struct RefinementReport {
  std::string operation;  // its name
  std::string tenant;
  absl::Status status;
  absl::Duration duration;
  uint64_t points = 0;          // of the session
  uint64_t replayed_steps = 0;  // before it, since the mesher had been given up
  uint64_t vertices = 0;        // of the new mesh; 0: there is none
  uint64_t simplices = 0;       // of the new mesh
};

// A session has given up its structure, for other work to have the memory.
struct StructureReport {
  std::string session;  // its name
  std::string tenant;
  uint64_t bytes = 0;   // that were freed
  absl::Duration idle;  // since the session was used last
};

// Logs the work that was done, and counts it. The code that does the work knows neither the log nor the metrics.
//
// Thread safety: thread-safe.
class WorkObserver {
 public:
  // REQUIRES:   both outlive this.
  WorkObserver(spdlog::logger& log, WorkCounters& counters) : log_(log), counters_(counters) {}

  // A client has sent points.
  void OnPoints(uint64_t points) { counters_.points_received += points; }
  // A query was answered for some vertices.
  void OnCells(uint64_t vertices) { counters_.cells_served += vertices; }
  // A mesh was finished.
  void OnMesh(uint64_t vertices, uint64_t simplices);
  // A refinement has ended. Its mesh is counted here.
  void OnRefinement(const RefinementReport& report);
  void OnStructureGivenUp(const StructureReport& report);

 private:
  spdlog::logger& log_;
  WorkCounters& counters_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_WORK_OBSERVER_H_
