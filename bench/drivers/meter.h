// The common part of measured programs: points from a file, and the time and memory of the work on them.
#ifndef WELLSPACE_BENCH_DRIVERS_METER_H_
#define WELLSPACE_BENCH_DRIVERS_METER_H_

#include <chrono>
#include <cstdint>
#include <ctime>
#include <string>
#include <vector>

namespace wellspace::bench {

// The coordinates in `path`, doubles as the machine has them, row-major. Ends the process with a message if it cannot
// be read.
std::vector<double> ReadPoints(const std::string& path);

// Time and memory from its construction on.
class Meter {
 public:
  // For work on so many threads.
  explicit Meter(int threads = 1);

  // On one thread the time of the processor, which is the wall clock's unless others have the processor meanwhile; on
  // more, the wall clock's.
  double Seconds() const;
  double WallSeconds() const;
  // The most that was resident at once, less that when the meter was made: the input does not count, the output
  // does. From the process' own high-water mark; that of rusage also knows the process that forked this one.
  uint64_t PeakBytes() const;

 private:
  uint64_t resident_ = 0;
  std::chrono::steady_clock::time_point start_;
  std::clock_t cpu_start_ = 0;
  bool is_one_thread_ = true;
};

}  // namespace wellspace::bench

#endif  // WELLSPACE_BENCH_DRIVERS_METER_H_
