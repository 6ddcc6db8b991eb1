// A lender of memory with a limit, for tests.
#ifndef WELLSPACE_TESTS_SUPPORT_LIMITED_LENDER_H_
#define WELLSPACE_TESTS_SUPPORT_LIMITED_LENDER_H_

#include <algorithm>
#include <cstdint>

#include "absl/status/status.h"
#include "core/base/run_context.h"

namespace wellspace::test {

// Reserves all that is asked for; allows no more than `limit`, and notes the most that was asked for.
class LimitedLender final : public core::MemoryLender {
 public:
  explicit LimitedLender(uint64_t at_most) : limit(at_most) {}

  absl::Status Reserve(uint64_t /*bytes*/) override { return absl::OkStatus(); }
  absl::Status Allow(uint64_t bytes) override {
    most = std::max(most, bytes);
    return bytes > limit ? absl::ResourceExhaustedError("no more") : absl::OkStatus();
  }

  uint64_t limit;
  uint64_t most = 0;
};

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_LIMITED_LENDER_H_
