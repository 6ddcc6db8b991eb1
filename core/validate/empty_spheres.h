// The check that circumspheres are empty, for meshes of domains, of which the lemma about neighbours is not enough.
#ifndef WELLSPACE_CORE_VALIDATE_EMPTY_SPHERES_H_
#define WELLSPACE_CORE_VALIDATE_EMPTY_SPHERES_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/validate/validate.h"

namespace wellspace::core {

// No vertex of the mesh lies strictly inside the circumsphere of a simplex, by exact signs. `simplex` and `sphere` are
// the words for these: "triangle", "circumcircle". is_rounding(depth, radius) may let one pass that is so deep inside.
//
// REQUIRES:   ValidateIndices and ValidateOrientation are OK.
// Complexity: O(m log m) for most meshes.
// Errors:     FAILED_PRECONDITION, naming simplex and vertex; CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::Status CheckEmptySpheres(const MeshView& mesh, const char* simplex, const char* sphere, const RunContext& context,
                               const std::function<bool(double depth, double radius)>& is_rounding = nullptr) {
  // The sphere that is searched is larger by so much, relatively, than the computed one.
  constexpr double kRoom = 1e-9;
  constexpr size_t kBetweenLooks = 256;
  std::vector<Box<D>> boxes;
  for (size_t v = 0; v < mesh.points.size() / D; ++v) {
    boxes.push_back({PointAt<D>(mesh.points, v), PointAt<D>(mesh.points, v)});
  }
  BoxTree<D> tree;
  WELLSPACE_RETURN_IF_ERROR(tree.Build(std::move(boxes), context));
  for (size_t s = 0; s < mesh.simplices.size() / (D + 1); ++s) {
    if (s % kBetweenLooks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const auto own = mesh.simplices.subspan(s * (D + 1), D + 1);
    Simplex<D> corners;
    for (size_t k = 0; k <= D; ++k) {
      corners[k] = PointAt<D>(mesh.points, own[k]);
    }
    const Point<D> offset = ExactCircumcentreOffset<D>(corners);
    Point<D> centre = corners[0];
    for (int axis = 0; axis < D; ++axis) {
      centre[axis] += offset[axis];
    }
    const double radius = std::sqrt(NormSq<D>(offset));
    std::optional<uint32_t> inside;
    tree.ForEach(WithinReachOf<D>(centre, radius * (1 + kRoom)), [&](uint32_t v) {
      const Point<D> p = PointAt<D>(mesh.points, v);
      if (std::find(own.begin(), own.end(), v) == own.end() && InSphere<D>(corners, p).sign == Sign::kPositive &&
          !(is_rounding != nullptr && is_rounding(radius - Distance<D>(p, centre), radius))) {
        inside = v;
      }
      return !inside.has_value();
    });
    if (inside.has_value()) {
      return absl::FailedPreconditionError(
          absl::StrCat(simplex, " ", s, ": vertex ", *inside, " lies inside its ", sphere));
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_EMPTY_SPHERES_H_
