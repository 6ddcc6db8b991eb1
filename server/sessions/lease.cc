#include "server/sessions/lease.h"

namespace wellspace::server {

bool Lease::Renew(absl::Duration now) {
  if (HasExpired(now)) {
    return false;
  }
  last_use_ = now;
  return true;
}

void Lease::EndUse(absl::Duration now) {
  --uses_;
  last_use_ = now;
}

}  // namespace wellspace::server
