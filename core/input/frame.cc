#include "core/input/frame.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/input/mesh_parameters.h"
#include "core/tree/morton.h"

namespace wellspace::core {
namespace {

// The longest side of a domain is scaled to about 1 when it is beyond these powers of two.
constexpr int kMaxScaleExponent = 60;

// Larger ones leave no room for sums and products.
constexpr double kMaxCoordinate = 0x1p1000;
// The steps of a grid over smaller ones, squared, would be no normal doubles.
constexpr double kMinExtent = 0x1p-900;

constexpr char kTooClosePayload[] = "wellspace.core/TOO_CLOSE";

std::string FormatCoordinates(std::span<const double> p) {
  return absl::StrCat(
      "(", absl::StrJoin(p, ", ", [](std::string* out, double x) { absl::StrAppendFormat(out, "%.17g", x); }), ")");
}

template <int D>
absl::Status CheckFinite(const Point<D>& p, size_t index) {
  for (int k = 0; k < D; ++k) {
    if (!std::isfinite(p[k])) {
      return absl::InvalidArgumentError(
          absl::StrCat("points[", index, "]: coordinate ", k, " is ", p[k], "; coordinates must be finite numbers"));
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::Status CheckBox(const Box<D>& box) {
  double magnitude = 0;
  for (int i = 0; i < D; ++i) {
    if (!(std::abs(box.low[i]) <= kMaxCoordinate && std::abs(box.high[i]) <= kMaxCoordinate)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "domain: along axis %d it goes from %g to %g; coordinates must be at most 2^1000; scale the points down", i,
          box.low[i], box.high[i]));
    }
    magnitude = std::max({magnitude, std::abs(box.low[i]), std::abs(box.high[i])});
  }
  for (int i = 0; i < D; ++i) {
    const double extent = box.high[i] - box.low[i];
    if (extent > 0 && extent < kMinExtent) {
      return absl::InvalidArgumentError(
          absl::StrFormat("domain: its extent along axis %d, from %g to %g, is so small that doubles have too few "
                          "digits there; it must be "
                          "at least 2^-900, %.2g; multiply the coordinates, by a power of 2 or 10",
                          i, box.low[i], box.high[i], kMinExtent));
    }
    // The negation also catches a margin of zero around points in a plane.
    if (!(extent > 0x1p-40 * magnitude)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "domain: its extent along axis %d, from %.17g to %.17g, is too small; it must be at least 2^-40 of the "
          "largest coordinate, %g; give a larger domain or margin, or move the points nearer to the origin",
          i, box.low[i], box.high[i], magnitude));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckShape(std::span<const double> points, int dimension) {
  if (points.size() % dimension != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", points.size(), " coordinates are not a multiple of the dimension, ", dimension));
  }
  if (points.size() / dimension > kMaxVertices) {
    return absl::InvalidArgumentError(absl::StrCat("points: ", points.size() / dimension,
                                                   " are more than vertices can be numbered; at most ", kMaxVertices,
                                                   " are accepted"));
  }
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<Frame<D>> Frame<D>::Of(const Box<D>& box) {
  WELLSPACE_RETURN_IF_ERROR(CheckBox<D>(box));
  Frame frame;
  frame.box = box;
  const int exponent = std::ilogb(box.LongestSide());
  frame.scale = std::abs(exponent) <= kMaxScaleExponent ? 1.0 : std::ldexp(1.0, -exponent);
  frame.scaled_box = Box<D>{frame.Scaled(box.low), frame.Scaled(box.high)};
  frame.grid_step = MortonGrid<D>(frame.scaled_box).step();
  return frame;
}

template <int D>
absl::StatusOr<Box<D>> BoxAround(std::span<const double> points, double margin, const RunContext& context) {
  Box<D> box;
  if (points.empty()) {
    return absl::InvalidArgumentError(
        "points: there are none and no domain is given; give a domain or at least one point");
  }
  box.low = box.high = PointAt<D>(points, 0);
  for (size_t i = 0; i < points.size() / D; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = PointAt<D>(points, i);
    WELLSPACE_RETURN_IF_ERROR(CheckFinite<D>(p, i));
    box.Include({p, p});
  }
  double side = box.LongestSide();
  if (side == 0) {
    side = 1;  // one point, once or more often: any size serves
  }
  if (!std::isfinite(side)) {
    return box;  // too large as it is, which a domain will be refused for
  }
  const double grow = margin * side;
  for (int i = 0; i < D; ++i) {
    box.low[i] -= grow;
    box.high[i] += grow;
  }
  return box;
}

template <int D>
absl::Status CheckPoints(const Frame<D>& frame, std::span<const double> points, const RunContext& context) {
  for (size_t i = 0; i < points.size() / D; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = PointAt<D>(points, i);
    if (!IsRepresentable<D>(frame.box, p, frame.Scaled(p), 1 / frame.scale)) {
      return PointError<D>(frame, p, i);
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::Status PointError(const Frame<D>& frame, const Point<D>& p, size_t index) {
  WELLSPACE_RETURN_IF_ERROR(CheckFinite<D>(p, index));
  if (!frame.box.Contains(p)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points[", index, "] = ", FormatCoordinates(p), " lies outside the domain ", FormatCoordinates(frame.box.low),
        " to ", FormatCoordinates(frame.box.high), "; enlarge the domain or drop the point"));
  }
  int k = 0;
  while (k + 1 < D && frame.Unscaled(frame.Scaled(p))[k] == p[k]) {
    ++k;
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("points[%d]: coordinate %d is %g, too small for the arithmetic of doubles beside a domain of "
                      "side %g; make it 0, or give a smaller domain",
                      index, k, p[k], frame.box.LongestSide()));
}

template <int D>
absl::Status FaceTooCloseError(const Frame<D>& frame, const Point<D>& p, size_t index, int face) {
  return absl::InvalidArgumentError(absl::StrFormat(
      "points[%d] = %s is only %g from the %s face of axis %d of the domain, too close for the arithmetic of "
      "doubles (on it, or at least %g away, is needed); move the domain's face",
      index, FormatCoordinates(frame.Unscaled(p)), frame.scaled_box.DistanceToFace(p, face) / frame.scale,
      face % 2 == 0 ? "low" : "high", face / 2, frame.MinSeparation() / frame.scale));
}

template <int D>
absl::Status TooCloseError(const Frame<D>& frame, const Point<D>& p, size_t index, double distance,
                           std::string_view other) {
  absl::Status status = absl::InvalidArgumentError(absl::StrFormat(
      "points[%d] = %s is only %g from %s, too close for the arithmetic of doubles in this domain (at least %g is "
      "needed); merge them, or give a smaller domain nearer to the origin",
      index, FormatCoordinates(frame.Unscaled(p)), distance / frame.scale, other, frame.MinSeparation() / frame.scale));
  status.SetPayload(kTooClosePayload, absl::Cord());
  return status;
}

bool IsTooClose(const absl::Status& status) { return status.GetPayload(kTooClosePayload).has_value(); }

#define WELLSPACE_INSTANTIATE(D)                                                                     \
  template struct Frame<D>;                                                                          \
  template absl::StatusOr<Box<D>> BoxAround<D>(std::span<const double>, double, const RunContext&);  \
  template absl::Status CheckPoints<D>(const Frame<D>&, std::span<const double>, const RunContext&); \
  template absl::Status PointError<D>(const Frame<D>&, const Point<D>&, size_t);                     \
  template absl::Status FaceTooCloseError<D>(const Frame<D>&, const Point<D>&, size_t, int);         \
  template absl::Status TooCloseError<D>(const Frame<D>&, const Point<D>&, size_t, double, std::string_view);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
