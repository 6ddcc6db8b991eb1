#include "core/input/refused_points.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "absl/strings/str_cat.h"

namespace wellspace::core {
namespace {

// Points that an error names.
constexpr size_t kNamed = 10;

}  // namespace

absl::Status RefusedPoints::InAll(const char* so) {
  std::sort(refused_.begin(), refused_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string text(refused_.front().second.message());
  for (size_t i = 1; i < refused_.size() && i < kNamed; ++i) {
    absl::StrAppend(&text, i == 1 ? absl::StrCat("; ", so, " ") : ", ", "points[", refused_[i].first, "]");
  }
  if (refused_.size() > 1) {
    absl::StrAppend(&text, refused_.size() > kNamed ? ", …: " : ": ", refused_.size(), " points in all");
  }
  return absl::InvalidArgumentError(text);
}

}  // namespace wellspace::core
