// When a lease runs out, by a clock of the test.
#include "server/sessions/lease.h"

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

constexpr absl::Duration kBegin = absl::Hours(5);  // since boot
constexpr absl::Duration kTtl = absl::Seconds(10);
constexpr absl::Duration kMoment = absl::Nanoseconds(1);

TEST(Lease, RunsOutATtlAfterItsBegin) {
  const Lease lease(kTtl, kBegin);
  EXPECT_EQ(lease.ttl(), kTtl);
  EXPECT_EQ(lease.ExpiresAt(kBegin + absl::Seconds(3)), kBegin + kTtl);
  EXPECT_FALSE(lease.HasExpired(kBegin + kTtl - kMoment));
  EXPECT_TRUE(lease.HasExpired(kBegin + kTtl));
}

TEST(Lease, IsRenewedUntilItHasRunOut) {
  Lease lease(kTtl, kBegin);
  EXPECT_TRUE(lease.Renew(kBegin + kTtl - kMoment));
  EXPECT_EQ(lease.ExpiresAt(kBegin + kTtl), kBegin + 2 * kTtl - kMoment);
  EXPECT_FALSE(lease.Renew(kBegin + 2 * kTtl - kMoment));
  EXPECT_EQ(lease.ExpiresAt(kBegin + 3 * kTtl), kBegin + 2 * kTtl - kMoment) << "a refused renewal changes nothing";
}

TEST(Lease, DoesNotRunOutBeforeItsLastUseHasEnded) {
  Lease lease(kTtl, kBegin);
  lease.BeginUse();
  lease.BeginUse();
  const absl::Duration later = kBegin + 100 * kTtl;
  EXPECT_FALSE(lease.HasExpired(later));
  EXPECT_EQ(lease.ExpiresAt(later), later + kTtl);
  lease.EndUse(later);
  EXPECT_FALSE(lease.HasExpired(later + 2 * kTtl)) << "the other use is under way";
  lease.EndUse(later + 2 * kTtl);
  EXPECT_FALSE(lease.HasExpired(later + 3 * kTtl - kMoment)) << "the end of a use renews the lease";
  EXPECT_TRUE(lease.HasExpired(later + 3 * kTtl));
}

TEST(Lease, ANewTtlCountsFromTheLastUse) {
  Lease lease(kTtl, kBegin);
  lease.SetTtl(absl::Seconds(3));
  EXPECT_FALSE(lease.HasExpired(kBegin + absl::Seconds(3) - kMoment));
  EXPECT_TRUE(lease.HasExpired(kBegin + absl::Seconds(3)));
  lease.SetTtl(absl::Seconds(20));
  EXPECT_FALSE(lease.HasExpired(kBegin + absl::Seconds(19)));
}

}  // namespace
}  // namespace wellspace::server
