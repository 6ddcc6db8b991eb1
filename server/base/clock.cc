#include "server/base/clock.h"

#include <time.h>

namespace wellspace::server {

absl::Duration SinceBoot() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return absl::DurationFromTimespec(now);
}

}  // namespace wellspace::server
