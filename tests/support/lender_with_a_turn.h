// A lender that stops a run the n-th time it is asked.
#ifndef WELLSPACE_TESTS_SUPPORT_LENDER_WITH_A_TURN_H_
#define WELLSPACE_TESTS_SUPPORT_LENDER_WITH_A_TURN_H_

#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "core/base/run_context.h"

namespace wellspace::test {

// Lends memory, but at the n-th time it is asked, in one phase where that is given, it refuses, or cancels the run.
class LenderWithATurn final : public core::MemoryLender {
 public:
  LenderWithATurn(core::RunContext& context, int turn, bool cancels, std::optional<core::Phase> phase = std::nullopt)
      : context_(context), turn_(turn), cancels_(cancels), phase_(phase) {
    context.SetMemoryLender(this);
  }
  absl::Status Reserve(uint64_t /*bytes*/) override { return absl::OkStatus(); }
  absl::Status Allow(uint64_t /*bytes*/) override {
    if ((phase_.has_value() && context_.Snapshot().phase != *phase_) || asked_++ != turn_) {
      return absl::OkStatus();
    }
    if (cancels_) {
      context_.Cancel();
      return absl::OkStatus();
    }
    return absl::ResourceExhaustedError("no more");
  }
  int asked() const { return asked_; }

 private:
  core::RunContext& context_;
  const int turn_;
  const bool cancels_;
  const std::optional<core::Phase> phase_;
  int asked_ = 0;
};

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_LENDER_WITH_A_TURN_H_
