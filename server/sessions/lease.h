// The lease of a session: the time that it lives without being used.
#ifndef WELLSPACE_SERVER_SESSIONS_LEASE_H_
#define WELLSPACE_SERVER_SESSIONS_LEASE_H_

#include "absl/time/time.h"

namespace wellspace::server {

// A lease runs out `ttl` after its last use. Every time here is a time since boot (server/base/clock.h), which the
// caller has looked at: nothing here reads a clock.
//
// Thread safety: thread-compatible.
// Invariants: a lease with a use under way does not run out.
class Lease {
 public:
  // The lease begins at `now`, as if it had just been used.
  Lease(absl::Duration ttl, absl::Duration now) : ttl_(ttl), last_use_(now) {}

  absl::Duration ttl() const { return ttl_; }
  // Counted from the last use on, like the one before.
  void SetTtl(absl::Duration ttl) { ttl_ = ttl; }

  // The time when it runs out, unless it is used again before.
  absl::Duration ExpiresAt(absl::Duration now) const { return (uses_ > 0 ? now : last_use_) + ttl_; }
  bool HasExpired(absl::Duration now) const { return ExpiresAt(now) <= now; }

  // Counts as a use that ends at once; false, and nothing is changed, if the lease has run out already.
  [[nodiscard]] bool Renew(absl::Duration now);

  // A use begins, and lasts until EndUse. Any number may be under way at once.
  void BeginUse() { ++uses_; }
  // REQUIRES:   more calls of BeginUse than of EndUse before.
  void EndUse(absl::Duration now);

 private:
  absl::Duration ttl_;
  absl::Duration last_use_;
  int uses_ = 0;  // under way
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_LEASE_H_
