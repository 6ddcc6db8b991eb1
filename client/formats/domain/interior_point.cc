#include "client/formats/domain/interior_point.h"

#include <algorithm>
#include <utility>

namespace wellspace::formats {
namespace {

// How many horizontal lines are tried: in the highest gaps between the vertices.
constexpr size_t kLines = 16;

struct Gap {
  double height;
  double middle;
};

// The highest gaps between the heights of the vertices, the highest first.
std::vector<Gap> HighestGaps(std::span<const double> positions) {
  std::vector<double> heights;
  for (size_t i = 1; i < positions.size(); i += 2) {
    heights.push_back(positions[i]);
  }
  std::sort(heights.begin(), heights.end());
  std::vector<Gap> gaps;
  for (size_t i = 1; i < heights.size(); ++i) {
    const double low = heights[i - 1];
    const double high = heights[i];
    const double middle = low / 2 + high / 2;  // the sum may be too large
    if (low < middle && middle < high) {
      gaps.push_back({high / 2 - low / 2, middle});
    }
  }
  const size_t kept = std::min(gaps.size(), kLines);
  std::partial_sort(gaps.begin(), gaps.begin() + kept, gaps.end(),
                    [](const Gap& a, const Gap& b) { return a.height > b.height; });
  gaps.resize(kept);
  return gaps;
}

// Where the rings cross the horizontal line at `height`, ascending. REQUIRES: no vertex is on it.
std::vector<double> Crossings(std::span<const double> positions, const std::vector<size_t>& ring_starts,
                              double height) {
  std::vector<double> crossings;
  for (size_t ring = 0; ring < ring_starts.size(); ++ring) {
    const size_t begin = ring_starts[ring];
    const size_t end = ring + 1 < ring_starts.size() ? ring_starts[ring + 1] : positions.size() / 2;
    for (size_t i = begin, last = end - 1; i < end; last = i++) {
      const double y0 = positions[2 * last + 1];
      const double y1 = positions[2 * i + 1];
      if ((y0 < height) != (y1 < height)) {
        const double part = (height / 2 - y0 / 2) / (y1 / 2 - y0 / 2);
        crossings.push_back(positions[2 * last] * (1 - part) + positions[2 * i] * part);
      }
    }
  }
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

}  // namespace

std::optional<std::array<double, 2>> InteriorPoint(std::span<const double> positions,
                                                   const std::vector<size_t>& ring_starts) {
  std::optional<std::array<double, 2>> best;
  double best_room = 0;
  for (const Gap& gap : HighestGaps(positions)) {
    if (gap.height <= best_room) {
      break;
    }
    const std::vector<double> crossings = Crossings(positions, ring_starts, gap.middle);
    for (size_t i = 1; i < crossings.size(); i += 2) {
      const double left = crossings[i - 1];
      const double right = crossings[i];
      const double room = std::min(gap.height, right / 2 - left / 2);
      const double x = left / 2 + right / 2;
      if (room > best_room && left < x && x < right) {
        best = {x, gap.middle};
        best_room = room;
      }
    }
  }
  return best;
}

}  // namespace wellspace::formats
