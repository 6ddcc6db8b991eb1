#include "bench/drivers/meter.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string_view>

namespace wellspace::bench {
namespace {

// A line of /proc/self/status, "NAME:  NUMBER kB".
uint64_t StatusBytes(std::string_view name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name)) {
      return std::strtoull(line.c_str() + name.size(), nullptr, 10) * 1024;
    }
  }
  return 0;
}

}  // namespace

std::vector<double> ReadPoints(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  std::vector<double> points(size > 0 ? static_cast<size_t>(size) / sizeof(double) : 0);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(points.data()), static_cast<std::streamsize>(points.size() * sizeof(double)));
  if (!file) {
    std::cerr << path << ": cannot be read\n";
    std::exit(2);
  }
  return points;
}

Meter::Meter(int threads) : is_one_thread_(threads == 1) {
  // Sets the high-water mark to the memory resident now.
  std::ofstream("/proc/self/clear_refs") << "5";
  resident_ = StatusBytes("VmRSS:");
  start_ = std::chrono::steady_clock::now();
  cpu_start_ = std::clock();
}

double Meter::Seconds() const {
  return is_one_thread_ ? static_cast<double>(std::clock() - cpu_start_) / CLOCKS_PER_SEC : WallSeconds();
}

double Meter::WallSeconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

uint64_t Meter::PeakBytes() const {
  const uint64_t peak = StatusBytes("VmHWM:");
  return peak - std::min(peak, resident_);
}

}  // namespace wellspace::bench
