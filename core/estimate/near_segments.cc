#include "core/estimate/near_segments.h"

#include <numeric>

#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

// A place in a leaf is no farther from a segment that meets it than the leaf is across: within this many of its sides.
constexpr double kReach = 1.5;

}  // namespace

SegmentDistance DistanceTo(const PlanarDomain& domain, const Point<2>& x, uint32_t segment) {
  const auto [foot, away] = domain.FootOf(x, segment);
  const double beyond = foot - std::clamp(foot, 0.0, domain.LengthOf(segment));  // an end
  return {std::hypot(away, beyond), away, foot};
}

NearSegments::NearSegments(const PlanarDomain& domain, std::span<const uint32_t> segments, const Box<2>& leaf)
    : domain_(domain),
      segments_(segments.begin(), segments.end()),
      visited_(segments.size(), 0),
      found_(segments.size()) {
  Cell& root = cells_.emplace_back();
  root.box = leaf;
  const double room = kReach * leaf.LongestSide();
  for (int axis = 0; axis < 2; ++axis) {
    root.box.low[axis] -= room;
    root.box.high[axis] += room;
  }
  root.segments.resize(segments_.size());
  std::iota(root.segments.begin(), root.segments.end(), 0);
  root.common = CommonEnd(root.segments);
}

void NearSegments::Open(const Point<2>& x, uint32_t cell) {
  if (cells_[cell].first_child == kUncut && cells_[cell].segments.size() > kTogether &&
      cells_[cell].depth < kMostDepth) {
    Cut(cell);
  }
  const uint32_t first = cells_[cell].first_child;
  if (first != kUncut) {
    for (uint32_t child = first; child < first + 4; ++child) {
      if (cells_[child].first_child != kUncut || !cells_[child].segments.empty()) {
        queue_.push_back({std::sqrt(DistanceSq<2>(x, cells_[child].box)), false, child});
        std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
      }
    }
    return;
  }
  for (const uint32_t segment : cells_[cell].segments) {
    if (visited_[segment] != visits_) {
      visited_[segment] = visits_;
      ++compared_;
      found_[segment] = DistanceTo(domain_, x, segments_[segment]);
      queue_.push_back({found_[segment].distance, true, segment});
      std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
    }
  }
}

void NearSegments::Cut(uint32_t cell) {
  const auto first = static_cast<uint32_t>(cells_.size());
  cells_.resize(cells_.size() + 4);
  Cell& parent = cells_[cell];
  const std::vector<uint32_t> segments = std::exchange(parent.segments, {});
  compared_ += 4 * segments.size();
  for (uint32_t quarter = 0; quarter < 4; ++quarter) {
    Cell& child = cells_[first + quarter];
    child.box = parent.box;
    child.depth = parent.depth + 1;
    for (int axis = 0; axis < 2; ++axis) {
      const double middle = 0.5 * (parent.box.low[axis] + parent.box.high[axis]);
      (((quarter >> axis) & 1) != 0 ? child.box.low : child.box.high)[axis] = middle;
    }
    for (const uint32_t s : segments) {
      if (!SurelyMisses(domain_.EndOf(segments_[s], false), domain_.EndOf(segments_[s], true), child.box)) {
        child.segments.push_back(s);
      }
    }
    child.common = CommonEnd(child.segments);
  }
  parent.first_child = first;
}

VertexId NearSegments::CommonEnd(std::span<const uint32_t> segments) const {
  for (const bool is_b : {false, true}) {
    const VertexId end = segments.empty() ? kNoVertex : domain_.EndVertex(segments_[segments[0]], is_b);
    const auto ends_there = [&](uint32_t s) {
      return domain_.EndVertex(segments_[s], false) == end || domain_.EndVertex(segments_[s], true) == end;
    };
    if (end != kNoVertex && std::all_of(segments.begin(), segments.end(), ends_there)) {
      return end;
    }
  }
  return kNoVertex;
}

}  // namespace wellspace::core
