#include "client/formats/periodic_pairs.h"

#include <algorithm>
#include <cstddef>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {

PeriodicPairs::PeriodicPairs(const MeshShape& shape) : dimension_(static_cast<size_t>(shape.dimension)) {
  for (const int axis : shape.periodic_axes) {
    sides_.push_back({.axis = axis, .low = shape.low[axis], .high = shape.high[axis], .vertices = {}});
  }
}

void PeriodicPairs::Add(std::span<const double> points) {
  for (; !sides_.empty() && !points.empty(); points = points.subspan(dimension_), ++next_) {
    for (Sides& sides : sides_) {
      const double x = points[sides.axis];
      if (x != sides.low && x != sides.high) {
        continue;
      }
      OnSide on{.at = {}, .vertex = next_};
      std::copy_n(points.begin(), dimension_, on.at.begin());
      on.at[sides.axis] = 0;
      sides.vertices[x == sides.low ? 0 : 1].push_back(on);
    }
  }
}

absl::StatusOr<std::vector<VertexPair>> PeriodicPairs::Across(int axis) {
  const auto sides =
      std::find_if(sides_.begin(), sides_.end(), [axis](const Sides& some) { return some.axis == axis; });
  auto& [low, high] = sides->vertices;
  std::sort(low.begin(), low.end());
  std::sort(high.begin(), high.end());
  std::vector<VertexPair> pairs;
  for (size_t i = 0; i < std::max(low.size(), high.size()); ++i) {
    const bool is_low_alone = i == high.size() || (i < low.size() && low[i] < high[i]);
    if (is_low_alone || i == low.size() || high[i] < low[i]) {
      return absl::InvalidArgumentError(absl::StrCat("periodic axes: vertex ", (is_low_alone ? low[i] : high[i]).vertex,
                                                     " on the ", is_low_alone ? "low" : "high", " side across axis ",
                                                     axis,
                                                     " has no partner on the other; expected a mesh that is "
                                                     "periodic along it"));
    }
    pairs.push_back({low[i].vertex, high[i].vertex});
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace wellspace::formats
