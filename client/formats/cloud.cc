#include "client/formats/cloud.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {

void LineIndex::Add(uint64_t line) {
  if (runs_.empty() || line != runs_.back().first_line + (size_ - runs_.back().first_point)) {
    runs_.push_back({size_, line});
  }
  ++size_;
}

uint64_t LineIndex::LineOf(uint64_t point) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), point,
                                      [](uint64_t wanted, const Run& run) { return wanted < run.first_point; });
  const Run& run = *std::prev(after);
  return run.first_line + (point - run.first_point);
}

std::string PointCloud::Origin(uint64_t point) const {
  if (lines.size() > 0) {
    return absl::StrCat(name, ":", lines.LineOf(point));
  }
  return absl::StrCat(name, "[", rows.size() > 0 ? rows.LineOf(point) : point, "]");
}

}  // namespace wellspace::formats
