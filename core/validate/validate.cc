#include "core/validate/validate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/simplex/quality.h"
#include "core/validate/merged_cloud.h"
#include "core/validate/validate_sizes.h"

namespace wellspace::core {
namespace {

constexpr double kRelativeTolerance = 1e-9;
// Beyond it differences and scaled edges could overflow.
constexpr double kLargestCoordinate = 0x1p1000;

template <typename... Args>
absl::Status Violation(const absl::FormatSpec<Args...>& format, const Args&... args) {
  return absl::FailedPreconditionError(absl::StrFormat(format, args...));
}

// The condition of every check before it may look at a vertex of a simplex.
absl::Status CheckShape(const MeshView& mesh) {
  if (mesh.dimension < kMinDimension || mesh.dimension > kMaxDimension) {
    return absl::InvalidArgumentError(
        absl::StrFormat("dimension is %d; %d to %d are supported", mesh.dimension, kMinDimension, kMaxDimension));
  }
  const size_t d = static_cast<size_t>(mesh.dimension);
  if (mesh.points.size() % d != 0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%d coordinates of points are no multiple of the dimension %d", mesh.points.size(), d));
  }
  if (mesh.simplices.size() % (d + 1) != 0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%d indices of simplices are no multiple of %d, dimension + 1", mesh.simplices.size(), d + 1));
  }
  if (!mesh.weights.empty() && mesh.weights.size() != mesh.points.size() / d) {
    return absl::InvalidArgumentError(absl::StrFormat("%d weights are not one for each of the %d vertices",
                                                      mesh.weights.size(), mesh.points.size() / d));
  }
  if (mesh.points.empty() || mesh.simplices.empty()) {
    return Violation("the mesh has %d vertices and %d simplices; at least one of each is needed",
                     mesh.points.size() / d, mesh.simplices.size() / (d + 1));
  }
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    if (!(std::abs(mesh.points[i]) <= kLargestCoordinate)) {
      return Violation("vertex %d: coordinate %d is %.17g; it has to be finite and of absolute value at most 2^1000",
                       i / d, i % d, mesh.points[i]);
    }
  }
  const size_t vertices = mesh.points.size() / d;
  for (size_t i = 0; i < mesh.simplices.size(); ++i) {
    if (mesh.simplices[i] >= vertices) {
      return Violation("simplex %d: index %d is %d, but there are %d vertices", i / (d + 1), i % (d + 1),
                       mesh.simplices[i], vertices);
    }
  }
  return absl::OkStatus();
}

// The checks of one mesh of sound shape; the facet table is shared between them.
//
// Thread safety: thread-compatible.
template <int D>
class Checker {
 public:
  explicit Checker(const MeshView& mesh) : points_(mesh.points), simplices_(mesh.simplices), weights_(mesh.weights) {
    box_.low = box_.high = Vertex(0);
    for (size_t v = 1; v < VertexCount(); ++v) {
      const Point<D> p = Vertex(v);
      box_.Include({p, p});
    }
  }

  absl::Status Indices() const {
    std::vector<bool> used(VertexCount(), false);
    for (size_t s = 0; s < SimplexCount(); ++s) {
      for (int i = 0; i <= D; ++i) {
        used[Index(s, i)] = true;
        for (int j = 0; j < i; ++j) {
          if (Index(s, i) == Index(s, j)) {
            return Violation("simplex %d has vertex %d twice", s, Index(s, i));
          }
        }
      }
    }
    const auto unused = std::find(used.begin(), used.end(), false);
    if (unused != used.end()) {
      return Violation("vertex %d belongs to no simplex", unused - used.begin());
    }
    const std::vector<size_t> order = LexicographicOrder(points_);
    for (size_t i = 1; i < order.size(); ++i) {
      if (Vertex(order[i - 1]) == Vertex(order[i])) {
        return Violation("vertices %d and %d are equal: %s", order[i - 1], order[i], Text(Vertex(order[i])));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Orientation() const {
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const Sign sign = core::Orientation<D>(Corners(s)).sign;
      if (sign != Sign::kPositive) {
        return Violation("simplex %d (%s) %s", s, IndexText(s),
                         sign == Sign::kZero ? "is flat" : "has negative orientation; exchange two of its vertices");
      }
    }
    return absl::OkStatus();
  }

  absl::Status Topology() {
    return ForEachFacet([this](const Facet* facets, size_t count) -> absl::Status {
      if (count > 2) {
        return Violation("facet (%s) belongs to %d simplices: %d, %d, %d%s", FacetText(facets[0]), count,
                         facets[0].simplex, facets[1].simplex, facets[2].simplex, count > 3 ? ", ..." : "");
      }
      if (count == 1) {
        if (!IsOnBox(facets[0])) {
          return Violation("facet (%s) belongs to simplex %d alone, but lies on no face of the box",
                           FacetText(facets[0]), facets[0].simplex);
        }
      } else if (SideOfApex(facets[0]) * SideOfApex(facets[1]) != Sign::kNegative) {
        return Violation("simplices %d and %d lie on the same side of their facet (%s)", facets[0].simplex,
                         facets[1].simplex, FacetText(facets[0]));
      }
      return absl::OkStatus();
    });
  }

  absl::Status Volume() const {
    ExactVolumeSum<D> excess;
    for (size_t s = 0; s < SimplexCount(); ++s) {
      excess.Add(Corners(s));
    }
    excess.Subtract(box_);
    if (excess.sign() != Sign::kZero) {
      return Violation("the volumes of the simplices exceed that of the box %s to %s by %.17g; they have to be equal",
                       Text(box_.low), Text(box_.high), excess.value());
    }
    return absl::OkStatus();
  }

  absl::Status Delaunay() {
    const auto wrong =
        std::find_if(weights_.begin(), weights_.end(), [](double w) { return !(w >= 0 && std::isfinite(w)); });
    if (wrong != weights_.end()) {
      return Violation("vertex %d has weight %g; it has to be finite and not negative", wrong - weights_.begin(),
                       *wrong);
    }
    return ForEachFacet([this](const Facet* facets, size_t count) -> absl::Status {
      if (count == 2) {
        const uint32_t apex = Index(facets[1].simplex, facets[1].apex);
        const Simplex<D> corners = Corners(facets[0].simplex);
        const Sign sign =
            weights_.empty() ? InSphere<D>(corners, Vertex(apex)).sign
                             : InPowerSphere<D>(corners, Weights(facets[0].simplex), Vertex(apex), weights_[apex]).sign;
        if (sign == Sign::kPositive) {
          return Violation(
              "vertex %d %s simplex %d (%s)", apex,
              weights_.empty() ? "lies inside the circumsphere of" : "has negative power to the orthosphere of",
              facets[0].simplex, IndexText(facets[0].simplex));
        }
      }
      return absl::OkStatus();
    });
  }

  absl::Status RadiusEdge(double rho) const {
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const double ratio = RadiusEdgeRatio<D>(Corners(s));
      if (!(ratio <= rho * (1 + kRelativeTolerance))) {
        return Violation("simplex %d (%s) has circumradius / shortest edge = %.17g, above %.17g", s, IndexText(s),
                         ratio, rho);
      }
    }
    return absl::OkStatus();
  }

  absl::Status MinAngle(double min_angle_deg) const {
    if (!(min_angle_deg >= 0 && min_angle_deg <= LargestSmallestAngle(D))) {
      return absl::InvalidArgumentError(
          absl::StrFormat("min_angle_deg is %g; 0 to %g are possible", min_angle_deg, LargestSmallestAngle(D)));
    }
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const double angle = core::Angles<D>(Corners(s)).min_deg;
      if (!(angle >= min_angle_deg * (1 - kRelativeTolerance))) {
        return Violation("simplex %d (%s) has an angle of %.17g degrees, below %.17g", s, IndexText(s), angle,
                         min_angle_deg);
      }
    }
    return absl::OkStatus();
  }

  absl::Status WellSpaced(double rho) const {
    std::vector<double> nearest(VertexCount(), std::numeric_limits<double>::infinity());
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const Simplex<D> corners = Corners(s);
      for (int i = 0; i <= D; ++i) {
        for (int j = 0; j < i; ++j) {
          const double length = Distance<D>(corners[i], corners[j]);
          nearest[Index(s, i)] = std::min(nearest[Index(s, i)], length);
          nearest[Index(s, j)] = std::min(nearest[Index(s, j)], length);
        }
      }
    }
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const double radius = Distance<D>(CircumcentreOffset<D>(Corners(s)), Point<D>{});
      for (int i = 0; i <= D; ++i) {
        const double bound = rho * nearest[Index(s, i)];
        if (!(radius <= bound * (1 + kRelativeTolerance))) {
          return Violation(
              "vertex %d: simplex %d (%s) has circumradius %.17g, more than rho * shortest edge = %.17g * %.17g = "
              "%.17g",
              Index(s, i), s, IndexText(s), radius, rho, nearest[Index(s, i)], bound);
        }
      }
    }
    return absl::OkStatus();
  }

  absl::Status Sizing(const SizeBounds& bounds) const {
    WELLSPACE_RETURN_IF_ERROR(CheckSizeBounds(bounds, D));
    if (bounds.IsEmpty()) {
      return absl::OkStatus();
    }
    for (size_t s = 0; s < SimplexCount(); ++s) {
      if (const std::string excess = SizeExcess<D>(Corners(s), bounds); !excess.empty()) {
        return Violation("simplex %d (%s) has %s", s, IndexText(s), excess);
      }
    }
    return absl::OkStatus();
  }

  absl::Status Circumcentres() const {
    const double tolerance = kRelativeTolerance * box_.LongestSide();
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const Simplex<D> corners = Corners(s);
      const Point<D> offset = CircumcentreOffset<D>(corners);
      for (int k = 0; k < D; ++k) {
        // Relative to the corner, so that a large distance of the box from the origin does no harm.
        const double below = box_.low[k] - corners[0][k] - offset[k];
        const double above = offset[k] - (box_.high[k] - corners[0][k]);
        if (!(std::max(below, above) <= tolerance)) {
          return Violation(
              "simplex %d (%s): coordinate %d of its circumcentre is %.17g, outside the box from %.17g to %.17g", s,
              IndexText(s), k, corners[0][k] + offset[k], box_.low[k], box_.high[k]);
        }
      }
    }
    return absl::OkStatus();
  }

  absl::Status Cloud(std::span<const double> cloud, double merge_distance) const {
    if (!(merge_distance >= 0) || !std::isfinite(merge_distance)) {
      return absl::InvalidArgumentError(
          absl::StrFormat("merge_distance is %g; a finite number of at least 0 is expected", merge_distance));
    }
    if (cloud.size() % D != 0) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%d coordinates of the cloud are no multiple of the dimension %d", cloud.size(), D));
    }
    for (size_t i = 0; i < cloud.size(); ++i) {
      if (!std::isfinite(cloud[i])) {
        return absl::InvalidArgumentError(
            absl::StrFormat("point %d of the cloud: coordinate %d is %g; it has to be finite", i / D, i % D, cloud[i]));
      }
    }
    if (merge_distance > 0) {
      const std::optional<size_t> missing = FirstMissingOfMerged<D>(cloud, points_, merge_distance);
      return missing.has_value() ? Violation("point %d of the cloud, %s, is no vertex, and none is within %g of it",
                                             *missing, Text(PointAt<D>(cloud, *missing)), merge_distance)
                                 : absl::OkStatus();
    }
    const std::vector<size_t> order = LexicographicOrder(cloud);
    std::vector<bool> is_first(order.size(), true);
    for (size_t i = 1; i < order.size(); ++i) {
      is_first[order[i]] = PointAt<D>(cloud, order[i - 1]) != PointAt<D>(cloud, order[i]);
    }
    size_t vertex = 0;
    for (size_t i = 0; i < is_first.size(); ++i) {
      if (!is_first[i]) {
        continue;
      }
      const Point<D> p = PointAt<D>(cloud, i);
      if (vertex >= VertexCount() || !IsSameToTheBit(p, Vertex(vertex))) {
        return Violation("point %d of the cloud, %s, should be vertex %d, but that is %s", i, Text(p), vertex,
                         vertex < VertexCount() ? Text(Vertex(vertex)) : "missing");
      }
      ++vertex;
    }
    return absl::OkStatus();
  }

  QualityReport Quality() const {
    const double bin_width = LargestSmallestAngle(D) / kHistogramBins;
    QualityReport report;
    report.vertices = VertexCount();
    report.simplices = SimplexCount();
    report.min_angle_deg = 180;
    for (size_t s = 0; s < SimplexCount(); ++s) {
      const Simplex<D> corners = Corners(s);
      const double ratio = RadiusEdgeRatio<D>(corners);
      report.max_radius_edge = std::max(report.max_radius_edge, ratio);
      ++report.radius_edge_ratios[static_cast<size_t>(std::min<double>(kRatioBins - 1, ratio / kRatioWidth))];
      const AngleRange angles = Angles<D>(corners);
      report.min_angle_deg = std::min(report.min_angle_deg, angles.min_deg);
      report.max_angle_deg = std::max(report.max_angle_deg, angles.max_deg);
      ++report.min_angles[std::min(kDegrees - 1, static_cast<int>(angles.min_deg))];
      ++report.max_angles[std::min(kDegrees - 1, static_cast<int>(angles.max_deg))];
      ++report.angle_histogram[std::min(kHistogramBins - 1, static_cast<int>(angles.min_deg / bin_width))];
    }
    return report;
  }

 private:
  // A facet by its ascending vertices, as seen from one of its simplices.
  struct Facet {
    std::array<uint32_t, D> vertices;
    uint32_t apex;  // position in the simplex of the vertex opposite to the facet
    size_t simplex;

    bool operator<(const Facet& other) const {
      return vertices != other.vertices ? vertices < other.vertices : simplex < other.simplex;
    }
  };

  size_t VertexCount() const { return points_.size() / D; }
  size_t SimplexCount() const { return simplices_.size() / (D + 1); }
  Point<D> Vertex(size_t v) const { return PointAt<D>(points_, v); }
  uint32_t Index(size_t simplex, size_t corner) const { return simplices_[simplex * (D + 1) + corner]; }

  Simplex<D> Corners(size_t simplex) const {
    Simplex<D> out;
    for (int i = 0; i <= D; ++i) {
      out[i] = Vertex(Index(simplex, i));
    }
    return out;
  }

  std::array<double, D + 1> Weights(size_t simplex) const {
    std::array<double, D + 1> out;
    for (int i = 0; i <= D; ++i) {
      out[i] = weights_[Index(simplex, i)];
    }
    return out;
  }

  static std::string Text(const Point<D>& p) {
    return absl::StrFormat(
        "(%s)", absl::StrJoin(p, ", ", [](std::string* out, double x) { absl::StrAppendFormat(out, "%.17g", x); }));
  }
  static std::string FacetText(const Facet& facet) { return absl::StrJoin(facet.vertices, ", "); }
  std::string IndexText(size_t simplex) const {
    return absl::StrJoin(simplices_.subspan(simplex * (D + 1), D + 1), ", ");
  }

  // Equal points come by index.
  static std::vector<size_t> LexicographicOrder(std::span<const double> points) {
    std::vector<size_t> order(points.size() / D);
    std::iota(order.begin(), order.end(), size_t{0});
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      const Point<D> p = PointAt<D>(points, a);
      const Point<D> q = PointAt<D>(points, b);
      return p != q ? p < q : a < b;
    });
    return order;
  }

  static bool IsSameToTheBit(const Point<D>& p, const Point<D>& q) {
    return std::equal(p.begin(), p.end(), q.begin(),
                      [](double a, double b) { return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b); });
  }

  // Calls visit(facets, count) with the `count` simplices of each facet, in the order of the facets' vertices, until it
  // fails.
  template <typename Visit>
  absl::Status ForEachFacet(Visit visit) {
    if (facets_.empty()) {
      facets_.reserve(simplices_.size());
      for (size_t s = 0; s < SimplexCount(); ++s) {
        for (uint32_t apex = 0; apex <= D; ++apex) {
          Facet facet{.vertices = {}, .apex = apex, .simplex = s};
          for (uint32_t i = 0, to = 0; i <= D; ++i) {
            if (i != apex) {
              facet.vertices[to++] = Index(s, i);
            }
          }
          std::sort(facet.vertices.begin(), facet.vertices.end());
          facets_.push_back(facet);
        }
      }
      std::sort(facets_.begin(), facets_.end());
    }
    for (size_t begin = 0, end = 0; begin < facets_.size(); begin = end) {
      while (end < facets_.size() && facets_[end].vertices == facets_[begin].vertices) {
        ++end;
      }
      WELLSPACE_RETURN_IF_ERROR(visit(&facets_[begin], end - begin));
    }
    return absl::OkStatus();
  }

  bool IsOnBox(const Facet& facet) const {
    unsigned faces = ~0u;
    for (const uint32_t v : facet.vertices) {
      faces &= box_.FacesOf(Vertex(v));
    }
    return faces != 0;
  }

  // The side of the facet's plane that its simplex lies on, the same sign for the same side.
  Sign SideOfApex(const Facet& facet) const {
    Simplex<D> corners;
    for (int i = 0; i < D; ++i) {
      corners[i] = Vertex(facet.vertices[i]);
    }
    corners[D] = Vertex(Index(facet.simplex, facet.apex));
    return core::Orientation<D>(corners).sign;
  }

  std::span<const double> points_;
  std::span<const uint32_t> simplices_;
  std::span<const double> weights_;
  Box<D> box_;
  std::vector<Facet> facets_;  // ascending; made when first needed
};

// Calls check(checker) with the checker of the mesh's dimension.
template <typename Check>
absl::Status RunCheck(const MeshView& mesh, Check check) {
  WELLSPACE_RETURN_IF_ERROR(CheckShape(mesh));
#define WELLSPACE_RUN(D)      \
  if (mesh.dimension == D) {  \
    Checker<D> checker(mesh); \
    return check(checker);    \
  }
  WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_RUN)
#undef WELLSPACE_RUN
  return absl::InternalError("a dimension without a checker");
}

absl::Status CheckRho(double rho) {
  if (!(rho > 0 && std::isfinite(rho))) {
    return absl::InvalidArgumentError(absl::StrFormat("rho is %g; a positive, finite number is needed", rho));
  }
  return absl::OkStatus();
}

}  // namespace

double LargestSmallestAngle(int dimension) {
  return dimension == 2 ? 60 : dimension == 3 ? 70.53 : std::acos(1.0 / dimension) * 180 / std::numbers::pi;
}

QualityReport MeasureQuality(const MeshView& mesh) {
  QualityReport report;
  const absl::Status shape = RunCheck(mesh, [&](const auto& checker) {
    report = checker.Quality();
    return absl::OkStatus();
  });
  if (!shape.ok() && mesh.dimension > 0) {
    report.vertices = mesh.points.size() / static_cast<size_t>(mesh.dimension);
    report.simplices = mesh.simplices.size() / (static_cast<size_t>(mesh.dimension) + 1);
  }
  return report;
}

absl::Status ValidateIndices(const MeshView& mesh) {
  return RunCheck(mesh, [](const auto& checker) { return checker.Indices(); });
}

absl::Status ValidateOrientation(const MeshView& mesh) {
  return RunCheck(mesh, [](const auto& checker) { return checker.Orientation(); });
}

absl::Status ValidateTopology(const MeshView& mesh) {
  return RunCheck(mesh, [](auto& checker) { return checker.Topology(); });
}

absl::Status ValidateVolume(const MeshView& mesh) {
  return RunCheck(mesh, [](const auto& checker) { return checker.Volume(); });
}

absl::Status ValidateDelaunay(const MeshView& mesh) {
  return RunCheck(mesh, [](auto& checker) { return checker.Delaunay(); });
}

absl::Status ValidateRadiusEdge(const MeshView& mesh, double rho) {
  WELLSPACE_RETURN_IF_ERROR(CheckRho(rho));
  return RunCheck(mesh, [rho](const auto& checker) { return checker.RadiusEdge(rho); });
}

absl::Status ValidateWellSpaced(const MeshView& mesh, double rho) {
  WELLSPACE_RETURN_IF_ERROR(CheckRho(rho));
  return RunCheck(mesh, [rho](const auto& checker) { return checker.WellSpaced(rho); });
}

absl::Status ValidateSizing(const MeshView& mesh, const SizeBounds& bounds) {
  return RunCheck(mesh, [&](const auto& checker) { return checker.Sizing(bounds); });
}

absl::Status ValidateCircumcentres(const MeshView& mesh) {
  return RunCheck(mesh, [](const auto& checker) { return checker.Circumcentres(); });
}

absl::Status ValidateCloud(const MeshView& mesh, std::span<const double> cloud, double merge_distance) {
  return RunCheck(mesh, [=](const auto& checker) { return checker.Cloud(cloud, merge_distance); });
}

absl::Status ValidateMesh(const MeshView& mesh, const ValidationOptions& options) {
  if (options.rho != 0) {
    WELLSPACE_RETURN_IF_ERROR(CheckRho(options.rho));
  }
  return RunCheck(mesh, [&mesh, &options](auto& checker) -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(checker.Indices());
    WELLSPACE_RETURN_IF_ERROR(checker.Orientation());
    WELLSPACE_RETURN_IF_ERROR(checker.Topology());
    WELLSPACE_RETURN_IF_ERROR(checker.Volume());
    WELLSPACE_RETURN_IF_ERROR(checker.Delaunay());
    if (mesh.weights.empty()) {
      if (options.rho != 0) {
        WELLSPACE_RETURN_IF_ERROR(options.criterion == Criterion::kWellSpaced ? checker.WellSpaced(options.rho)
                                                                              : checker.RadiusEdge(options.rho));
      }
      WELLSPACE_RETURN_IF_ERROR(checker.Circumcentres());
      WELLSPACE_RETURN_IF_ERROR(
          checker.Sizing({options.max_circumradius, options.size_boxes, options.size_samples, options.gradation}));
    }
    if (options.min_angle_deg != 0) {
      WELLSPACE_RETURN_IF_ERROR(checker.MinAngle(options.min_angle_deg));
    }
    if (!options.cloud.empty()) {
      WELLSPACE_RETURN_IF_ERROR(checker.Cloud(options.cloud, options.merge_distance));
    }
    return absl::OkStatus();
  });
}

}  // namespace wellspace::core
