// The metrics that every process gives Prometheus about itself.
#ifndef WELLSPACE_SERVER_OBSERVABILITY_PROCESS_METRICS_H_
#define WELLSPACE_SERVER_OBSERVABILITY_PROCESS_METRICS_H_

namespace wellspace::server {

class Metrics;

// Adds process_cpu_seconds_total, process_resident_memory_bytes, process_open_fds, process_max_fds and
// process_start_time_seconds, read from /proc/self; what cannot be read there is 0.
void AddProcessMetrics(Metrics& metrics);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OBSERVABILITY_PROCESS_METRICS_H_
