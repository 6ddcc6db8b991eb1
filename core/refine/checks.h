// The switch of the checking build, and its abort. Its assertions are in refinement_checks.h.
#ifndef WELLSPACE_CORE_REFINE_CHECKS_H_
#define WELLSPACE_CORE_REFINE_CHECKS_H_

#include <cstdio>
#include <cstdlib>

#include "absl/strings/str_cat.h"

namespace wellspace::core {

// Whether this is the checking build.
#ifdef WELLSPACE_CHECKS
inline constexpr bool kChecks = true;
#else
inline constexpr bool kChecks = false;
#endif

// Aborts unless `holds`. The text is put together only then.
template <typename... Text>
void Require(bool holds, const Text&... text) {
  if (!holds) {
    std::fprintf(stderr, "refinement breaks its guarantees: %s\n", absl::StrCat(text...).c_str());
    std::abort();
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_CHECKS_H_
