// The check that rings of segments are closed. Private to core/features.
#ifndef WELLSPACE_CORE_FEATURES_CLOSED_RINGS_H_
#define WELLSPACE_CORE_FEATURES_CLOSED_RINGS_H_

#include <cstdint>
#include <span>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/features/features.h"

namespace wellspace::core {

// Whether an even number of `segments` ends at each point. Points that are equal have one number in `point_of_input`.
// `whose`() begins the error: "seeds[2]: its polygon is".
//
// REQUIRES:   all segments and their ends are there.
// Complexity: O(m log m).
// Errors:     INVALID_ARGUMENT, naming a segment and a point. CANCELLED, DEADLINE_EXCEEDED.
absl::Status CheckClosed(std::span<const uint32_t> segments, std::span<const uint32_t> point_of_input,
                         const Features& features, absl::FunctionRef<std::string()> whose, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_CLOSED_RINGS_H_
