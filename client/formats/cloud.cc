#include "client/formats/cloud.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {

void LineIndex::Add(uint64_t line) {
  if (!runs_.empty() && size_ - runs_.back().first_point == 1) {
    runs_.back().step = line - runs_.back().first_line;
  } else if (runs_.empty() || line != runs_.back().LineOf(size_)) {
    runs_.push_back({.first_point = size_, .first_line = line});
  }
  ++size_;
}

uint64_t LineIndex::LineOf(uint64_t point) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), point,
                                      [](uint64_t wanted, const Run& run) { return wanted < run.first_point; });
  return std::prev(after)->LineOf(point);
}

std::string PointCloud::Origin(uint64_t point) const {
  if (lines.size() > 0) {
    return absl::StrCat(name, ":", lines.LineOf(point));
  }
  return absl::StrCat(name, "[", rows.size() > 0 ? rows.LineOf(point) : point, "]");
}

std::vector<double> BoxSides(std::span<const double> points, int dimension) {
  std::vector<double> sides;
  for (int axis = 0; axis < dimension; ++axis) {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    for (size_t i = axis; i < points.size(); i += dimension) {
      low = std::min(low, points[i]);
      high = std::max(high, points[i]);
    }
    sides.push_back(std::max(0.0, high - low));
  }
  return sides;
}

}  // namespace wellspace::formats
