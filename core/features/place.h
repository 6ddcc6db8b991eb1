// Places in messages.
#ifndef WELLSPACE_CORE_FEATURES_PLACE_H_
#define WELLSPACE_CORE_FEATURES_PLACE_H_

#include <string>

#include "absl/strings/str_format.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// "(0.5, 1)", to the bit.
inline std::string PlaceText(const Point<2>& p) { return absl::StrFormat("(%.17g, %.17g)", p[0], p[1]); }

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PLACE_H_
