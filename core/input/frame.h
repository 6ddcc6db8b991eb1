// The box in which coordinates are integers of a grid: its scale, and which points it can have.
#ifndef WELLSPACE_CORE_INPUT_FRAME_H_
#define WELLSPACE_CORE_INPUT_FRAME_H_

#include <cstddef>
#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The box that is meshed, and the power of two that brings it to a scale on which no product of lengths overflows. A
// domain that segments bound has one, too: a box around it (DomainCloud); a PlanarDomain has segments and faces.
template <int D>
struct Frame {
  Box<D> box;         // as given
  Box<D> scaled_box;  // of the computation
  double scale = 1;
  double grid_step = 0;  // of every MortonGrid of the box, scaled

  // Vertices nearer than this, scaled, are refused as input: coordinates of Steiner points around them would be too
  // coarse to keep rho.
  double MinSeparation() const { return 64 * grid_step; }

  // The refinement gives up on shorter edges.
  double MinEdge() const { return 4 * grid_step; }

  // No negative zero: equal points have equal bits.
  Point<D> Scaled(const Point<D>& p) const {
    Point<D> scaled;
    for (int i = 0; i < D; ++i) {
      scaled[i] = p[i] * scale + 0.0;
    }
    return scaled;
  }
  Point<D> Unscaled(const Point<D>& p) const {
    Point<D> unscaled;
    for (int i = 0; i < D; ++i) {
      unscaled[i] = p[i] / scale;
    }
    return unscaled;
  }

  // Errors:     INVALID_ARGUMENT for a box that doubles cannot serve.
  static absl::StatusOr<Frame> Of(const Box<D>& box);
};

// Refuses coordinates that are no whole number of points, or more of them than vertices can be numbered.
//
// Errors:     INVALID_ARGUMENT with the figures.
absl::Status CheckShape(std::span<const double> points, int dimension);

// The bounding box of `points`, grown on every side by `margin` times its longest side.
//
// Errors:     INVALID_ARGUMENT when there are none, or one is not finite; CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::StatusOr<Box<D>> BoxAround(std::span<const double> points, double margin, const RunContext& context);

// Refuses points that `frame` cannot have.
//
// Errors:     INVALID_ARGUMENT, naming the point: not finite, outside the box, too small for its scale; CANCELLED,
//             DEADLINE_EXCEEDED.
template <int D>
absl::Status CheckPoints(const Frame<D>& frame, std::span<const double> points, const RunContext& context);

// Whether a frame can have point `p`: its `box` contains it, and its scale, of which `unscale` is the inverse, keeps
// it exactly. In a header, since it is asked of every point; PointError names the fault.
template <int D>
bool IsRepresentable(const Box<D>& box, const Point<D>& p, const Point<D>& scaled_p, double unscale) {
  bool is_exact = true;
  for (int k = 0; k < D; ++k) {
    is_exact = is_exact && scaled_p[k] * unscale == p[k];
  }
  return is_exact && box.Contains(p);
}

// The fault of point `index`, which is `p` as given, and not served: one of the errors of CheckPoints.
template <int D>
absl::Status PointError(const Frame<D>& frame, const Point<D>& p, size_t index);

// The error for point `index`, which is `p`, scaled, and too close to `face` of the box.
template <int D>
absl::Status FaceTooCloseError(const Frame<D>& frame, const Point<D>& p, size_t index, int face);

// Refuses point `index`, which is `p`, scaled, if it is nearer to a face of the box that it does not lie on than the
// arithmetic serves.
//
// Errors:     that of FaceTooCloseError.
template <int D>
absl::Status CheckFaces(const Frame<D>& frame, const Point<D>& p, size_t index) {
  for (int face = 0; face < 2 * D; ++face) {
    const double distance = frame.scaled_box.DistanceToFace(p, face);
    if (distance > 0 && distance < frame.MinSeparation()) {
      return FaceTooCloseError<D>(frame, p, index, face);
    }
  }
  return absl::OkStatus();
}

// The error for point `index`, which is `p`, and only `distance` from `other`, by its name; both scaled.
template <int D>
absl::Status TooCloseError(const Frame<D>& frame, const Point<D>& p, size_t index, double distance,
                           std::string_view other);

// Whether an error is a TooCloseError, and the cloud may have more such points.
bool IsTooClose(const absl::Status& status);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_FRAME_H_
