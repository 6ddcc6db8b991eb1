// A look at the context in a loop of short steps.
#ifndef WELLSPACE_CORE_BASE_CHECK_AT_H_
#define WELLSPACE_CORE_BASE_CHECK_AT_H_

#include <cstddef>

#include "absl/status/status.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// Ok while the run may go on, which is looked at every kStepsBetweenChecks steps, of which this is one.
inline absl::Status CheckAt(size_t step, const RunContext& context) {
  return step % kStepsBetweenChecks == 0 ? context.Check() : absl::OkStatus();
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_CHECK_AT_H_
