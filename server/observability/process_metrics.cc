#include "server/observability/process_metrics.h"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/observability/metrics.h"

namespace wellspace::server {
namespace {

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * time.tv_usec; };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  uint64_t total = 0;
  uint64_t resident = 0;
  statm >> total >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double OpenFiles() {
  double count = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator entry("/proc/self/fd", error), end; !error && entry != end;
       entry.increment(error)) {
    ++count;
  }
  return count == 0 ? 0 : count - 1;  // without the one that reads the folder
}

double MaxFiles() {
  rlimit limit{};
  return getrlimit(RLIMIT_NOFILE, &limit) == 0 ? static_cast<double>(limit.rlim_cur) : 0;
}

// When the process started. /proc/self/stat has it as its 22nd field, in ticks since the machine booted.
double StartSeconds() {
  std::ifstream stat("/proc/self/stat");
  std::string text;
  std::getline(stat, text);
  const size_t name_end = text.rfind(')');  // the name may have blanks
  timespec since_boot{};
  if (name_end == std::string::npos || clock_gettime(CLOCK_BOOTTIME, &since_boot) != 0) {
    return 0;
  }
  constexpr int kFieldsFromStateToStart = 20;
  size_t begin = name_end + 1;
  for (int field = 0; field < kFieldsFromStateToStart - 1 && begin != std::string::npos; ++field) {
    begin = text.find(' ', begin + 1);
  }
  if (begin == std::string::npos) {
    return 0;
  }
  const double started = std::strtod(text.c_str() + begin, nullptr) / static_cast<double>(sysconf(_SC_CLK_TCK));
  return absl::ToDoubleSeconds(absl::Now() - absl::UnixEpoch()) -
         absl::ToDoubleSeconds(absl::DurationFromTimespec(since_boot)) + started;
}

}  // namespace

void AddProcessMetrics(Metrics& metrics) {
  metrics.AddCounter("process_cpu_seconds_total", "Processor time spent, of the user and the system, in seconds.",
                     CpuSeconds);
  metrics.AddGauge("process_resident_memory_bytes", "Resident memory.", ResidentBytes);
  metrics.AddGauge("process_open_fds", "Open file descriptors.", OpenFiles);
  metrics.AddGauge("process_max_fds", "Most open file descriptors.", MaxFiles);
  metrics.AddGauge("process_start_time_seconds", "When the process started, in seconds since 1970.",
                   [start = StartSeconds()] { return start; });
}

}  // namespace wellspace::server
