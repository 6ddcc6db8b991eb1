#include "core/refine/space/crossing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

// Where the line through two points meets the plane of a triangle, brought onto the triangle. The points are taken in
// the order of their coordinates.
Point<3> MeetingPoint(const Triangle& triangle, Point<3> a, Point<3> b) {
  if (b < a) {
    std::swap(a, b);
  }
  const Point<3> normal = NormalOf(triangle);
  const double of_a = Dot<3>(normal, Difference<3>(a, triangle[0]));
  const double of_b = Dot<3>(normal, Difference<3>(b, triangle[0]));
  // They have different signs, up to rounding; both are 0 where the edge lies in the plane.
  const double share = of_a == of_b ? 0.5 : std::clamp(of_a / (of_a - of_b), 0.0, 1.0);
  Point<3> at;
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = share < 0.5 ? a[axis] + share * (b[axis] - a[axis]) : b[axis] + (1 - share) * (a[axis] - b[axis]);
  }
  return NearestPoint(triangle, at);
}

}  // namespace

void EdgeCrossings::Find(const Point<3>& a, const Point<3>& b, IndexNode from) {
  index_.FindCrossings(a, b, found_, from);
  TakeFound(a, b);
}

void EdgeCrossings::FindAmong(const Point<3>& a, const Point<3>& b, std::span<const uint32_t> triangles) {
  if (triangles.empty()) {  // as of most edges
    all_.clear();
    return;
  }
  index_.FindCrossingsAmong(a, b, triangles, found_);
  TakeFound(a, b);
}

void EdgeCrossings::TakeFound(const Point<3>& a, const Point<3>& b) {
  all_.clear();
  for (const SurfaceCrossing& crossing : found_) {
    all_.push_back({.at = MeetingPoint(InOrder(index_.TriangleAt(crossing.triangle)), a, b),
                    .triangle = crossing.triangle,
                    .patch = patch_of_[crossing.triangle],
                    .before = index_.solids().solid_of[crossing.before],
                    .beyond = index_.solids().solid_of[crossing.before ^ 1]});
  }
}

bool EdgeCrossings::IsBoundary() const {
  if (all_.empty() || all_.front().before != all_.back().beyond) {
    return !all_.empty();
  }
  const auto membranes = std::count_if(all_.begin(), all_.end(),
                                       [](const Crossing& crossing) { return crossing.before == crossing.beyond; });
  return membranes % 2 != 0;
}

const Crossing* EdgeCrossings::NearestTo(const Point<3>& v) const {
  const Crossing* nearest = nullptr;
  double least_sq = 0;
  for (const Crossing& crossing : all_) {
    const double distance_sq = DistanceSq<3>(crossing.at, v);
    if (nearest == nullptr || distance_sq < least_sq ||
        (distance_sq == least_sq && crossing.triangle < nearest->triangle)) {
      nearest = &crossing;
      least_sq = distance_sq;
    }
  }
  return nearest;
}

}  // namespace wellspace::core
