#include "server/base/descriptor_limit.h"

#include <sys/resource.h>

#include <algorithm>

namespace wellspace::server {

void RaiseDescriptorLimit() {
  rlimit limit = {};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < limit.rlim_max) {
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
  }
}

uint64_t DescriptorLimit() {
  rlimit limit = {};
  getrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

uint64_t SpareDescriptors(uint64_t limit, bool keeps_files) {
  constexpr uint64_t kSpare = 24;
  constexpr uint64_t kSpareForFiles = 256;
  return keeps_files ? std::min(std::max(limit / 4, kSpareForFiles), limit / 2) : std::min(limit / 4, kSpare);
}

uint64_t MaxWrittenFiles(uint64_t limit) {
  return std::max<uint64_t>(SpareDescriptors(limit, /*keeps_files=*/true) / 2, 1);
}

}  // namespace wellspace::server
