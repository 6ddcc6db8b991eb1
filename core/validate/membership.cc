#include "core/validate/membership.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

// Directions of rays, along no plane that surfaces are made of.
constexpr std::array<Point<3>, 4> kDirections = {
    {{0.5773, 0.6131, 0.5393}, {-0.4111, 0.7219, 0.5569}, {0.6947, -0.3709, 0.6163}, {-0.5231, -0.4787, -0.7052}}};

enum class Meets : uint8_t { kNot, kInside, kOnEdge };

// Whether the segment from `p` to `q` goes through a triangle.
Meets HowMeets(const Point<3>& p, const Point<3>& q, const Triangle& t) {
  const Sign of_p = Orientation<3>({t[0], t[1], t[2], p}).sign;
  const Sign of_q = Orientation<3>({t[0], t[1], t[2], q}).sign;
  if (of_p == of_q && of_p != Sign::kZero) {
    return Meets::kNot;
  }
  std::array<Sign, 3> sides;
  for (size_t k = 0; k < 3; ++k) {
    sides[k] = Orientation<3>({p, q, t[k], t[(k + 1) % 3]}).sign;
  }
  const bool has_positive = std::find(sides.begin(), sides.end(), Sign::kPositive) != sides.end();
  const bool has_negative = std::find(sides.begin(), sides.end(), Sign::kNegative) != sides.end();
  if (has_positive && has_negative) {
    return Meets::kNot;
  }
  const bool has_zero = std::find(sides.begin(), sides.end(), Sign::kZero) != sides.end();
  return has_zero || of_p == Sign::kZero || of_q == Sign::kZero ? Meets::kOnEdge : Meets::kInside;
}

}  // namespace

std::optional<RayHits> ShootRay(const Point<3>& p, const TriangleTree& triangles) {
  if (triangles.boxes().IsEmpty() || !triangles.boxes().Hull().Contains(p)) {
    return RayHits{};
  }
  const double length = 4 * triangles.boxes().Hull().LongestSide();
  for (const Point<3>& direction : kDirections) {
    Point<3> far = p;
    for (int axis = 0; axis < 3; ++axis) {
      far[axis] += length * direction[axis];
    }
    RayHits hits;
    bool is_on_edge = false;
    double nearest = 0;
    triangles.boxes().ForEach([&](const Box<3>& box) { return !SurelyMisses(p, far, box); },
                              [&](uint32_t i) {
                                const Triangle& t = triangles.triangles()[i];
                                const Meets meets = HowMeets(p, far, t);
                                is_on_edge = meets == Meets::kOnEdge;
                                if (meets == Meets::kInside) {
                                  const Point<3> normal = NormalOf(t);
                                  const double share =
                                      Dot<3>(normal, Difference<3>(t[0], p)) / Dot<3>(normal, Difference<3>(far, p));
                                  if (hits.count == 0 || share < nearest) {
                                    nearest = share;
                                    hits.first = i;
                                    hits.first_in_front = Orientation<3>({t[0], t[1], t[2], p}).sign == Sign::kPositive;
                                  }
                                  ++hits.count;
                                }
                                return !is_on_edge;
                              });
    if (!is_on_edge) {
      return hits;
    }
  }
  return std::nullopt;
}

absl::Status TetrahedronTree::Build(const MeshView& mesh, const RunContext& context) {
  mesh_ = mesh;
  std::vector<Box<3>> boxes;
  boxes.reserve(mesh.simplices.size() / 4);
  for (uint32_t s = 0; s < mesh.simplices.size() / 4; ++s) {
    const Simplex<3> corners = At(s);
    Box<3> box{corners[0], corners[0]};
    for (const Point<3>& corner : corners) {
      box.Include({corner, corner});
    }
    boxes.push_back(box);
  }
  return tree_.Build(std::move(boxes), context);
}

Simplex<3> TetrahedronTree::At(uint32_t tetrahedron) const {
  Simplex<3> corners;
  for (size_t k = 0; k < 4; ++k) {
    corners[k] = PointAt<3>(mesh_.points, mesh_.simplices[4 * size_t{tetrahedron} + k]);
  }
  return corners;
}

bool TetrahedronTree::Find(const Point<3>& p, std::vector<uint32_t>& found) const {
  found.clear();
  bool is_on_face = false;
  tree_.ForEach([&](const Box<3>& box) { return box.Contains(p); },
                [&](uint32_t s) {
                  const Simplex<3> corners = At(s);
                  bool is_inside = true;
                  bool is_outside = false;
                  for (size_t k = 0; k < 4; ++k) {
                    Simplex<3> with_p = corners;
                    with_p[k] = p;
                    const Sign side = Orientation<3>(with_p).sign;
                    is_inside = is_inside && side == Sign::kPositive;
                    is_outside = is_outside || side == Sign::kNegative;
                  }
                  if (is_inside) {
                    found.push_back(s);
                  }
                  is_on_face = is_on_face || (!is_inside && !is_outside);
                });
  return !is_on_face;
}

}  // namespace wellspace::core
