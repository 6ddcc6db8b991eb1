#include "core/validate/validate_boxed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/simplex/boundary.h"
#include "core/validate/triangle_tree.h"

namespace wellspace::core {
namespace {

constexpr int kSides = 6;
constexpr size_t kStepsBetweenLooks = 256;
// The rounding of sums, as a share, and of places, as a share of the diagonal and of coordinates.
constexpr double kRoundingOfSums = 1e-9;
constexpr double kRounding = 1e-9;
constexpr double kRoundingOfCoordinates = 0x1p-44;
// A triangle is looked at in at most so many places along a side; all triangles in about so many.
constexpr size_t kMostPlaces = 64;
constexpr size_t kPlaces = 100'000;

constexpr uint32_t kNoHint = std::numeric_limits<uint32_t>::max();

std::string TextOf(const Point<3>& p) { return absl::StrFormat("(%.9g, %.9g, %.9g)", p[0], p[1], p[2]); }

double AreaOf(const Triangle& triangle) { return 0.5 * std::sqrt(NormSq<3>(NormalOf(triangle))); }

class BoxCheck {
 public:
  BoxCheck(const MeshView& mesh, const SolidParts& parts, const SurfaceView& surface, const FidelityOptions& options,
           const RunContext& context)
      : mesh_(mesh),
        parts_(parts),
        features_(surface.features),
        box_(*surface.features.box),
        surface_(surface),
        context_(context) {
    double rounding = kRounding * Distance<3>(box_.low, box_.high);
    for (int axis = 0; axis < 3; ++axis) {
      const double largest = std::max(std::abs(box_.low[axis]), std::abs(box_.high[axis]));
      rounding = std::max(rounding, kRoundingOfCoordinates * largest);
    }
    rounding_ = rounding;
    most_ = options.tolerance + rounding + features_.weld;
    are_some_holes_ =
        std::any_of(features_.seeds.begin(), features_.seeds.end(), [](const SolidSeed& seed) { return seed.is_hole; });
    checks_tags_ = options.checks_tags && !parts.domain.boundary.tags.empty();
  }

  absl::Status Run() {
    WELLSPACE_RETURN_IF_ERROR(
        context_.AllowMemory(TriangleTree::Bytes(facet_count()) + TriangleTree::Bytes(features_.triangle_count())));
    WELLSPACE_RETURN_IF_ERROR(CheckVertices());
    WELLSPACE_RETURN_IF_ERROR(CheckVolume());
    std::vector<Triangle> triangles;
    for (size_t t = 0; t < features_.triangle_count(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(Look(t));
      triangles.push_back(Given(t));
    }
    WELLSPACE_RETURN_IF_ERROR(given_.Build(std::move(triangles), context_));
    WELLSPACE_RETURN_IF_ERROR(CheckFacets());
    return are_some_holes_ ? absl::OkStatus() : CheckPlaces();
  }

 private:
  size_t facet_count() const { return parts_.domain.boundary.facets.size() / 3; }
  absl::Status Look(size_t step) const { return step % kStepsBetweenLooks == 0 ? context_.Check() : absl::OkStatus(); }
  Point<3> At(uint32_t vertex) const { return PointAt<3>(mesh_.points, vertex); }
  Triangle Given(size_t t) const {
    const auto corner = [&](size_t k) { return PointAt<3>(surface_.points, features_.corners[3 * t + k]); };
    return {corner(0), corner(1), corner(2)};
  }
  Triangle FacetAt(size_t f) const {
    const std::span<const uint32_t> facets = parts_.domain.boundary.facets;
    return {At(facets[3 * f]), At(facets[3 * f + 1]), At(facets[3 * f + 2])};
  }

  absl::Status CheckVertices() const {
    for (uint32_t v = 0; v < mesh_.points.size() / 3; ++v) {
      WELLSPACE_RETURN_IF_ERROR(Look(v));
      if (DistanceSq<3>(At(v), box_) > rounding_ * rounding_) {
        return absl::FailedPreconditionError(
            absl::StrCat("vertex ", v, " at ", TextOf(At(v)), " is outside of the box"));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckVolume() const {
    double sum = 0;
    for (size_t s = 0; s < mesh_.simplices.size(); s += 4) {
      WELLSPACE_RETURN_IF_ERROR(Look(s / 4));
      const Point<3> from = At(mesh_.simplices[s]);
      const auto edge = [&](size_t k) { return Difference<3>(At(mesh_.simplices[s + k]), from); };
      sum += Dot<3>(edge(1), Cross(edge(2), edge(3))) / 6;
    }
    double wanted = 1;
    for (int axis = 0; axis < 3; ++axis) {
      wanted *= box_.high[axis] - box_.low[axis];
    }
    const double slack = kRoundingOfSums * wanted + rounding_ * wanted / box_.ShortestSide();
    if (sum > wanted + slack || (!are_some_holes_ && sum < wanted - slack)) {
      return absl::FailedPreconditionError(absl::StrFormat(
          "the tetrahedra have a volume of %.15g, and the box, all of which is meshed, has %.15g", sum, wanted));
    }
    return absl::OkStatus();
  }

  // The side that a facet is in, or kSides.
  int SideOf(const Triangle& facet) const {
    for (int side = 0; side < kSides; ++side) {
      if (std::all_of(facet.begin(), facet.end(),
                      [&](const Point<3>& p) { return box_.DistanceToFace(p, side) <= rounding_; })) {
        return side;
      }
    }
    return kSides;
  }

  std::string NameOf(size_t f) const {
    const auto name = parts_.domain.boundary.names.find(parts_.domain.boundary.tags[f]);
    return name == parts_.domain.boundary.names.end() ? "" : name->second;
  }

  absl::Status CheckFacets() {
    std::array<double, kSides> areas{};
    std::vector<Triangle> facets;
    uint32_t near = kNoHint;
    for (size_t f = 0; f < facet_count(); ++f) {
      WELLSPACE_RETURN_IF_ERROR(Look(f));
      const Triangle facet = FacetAt(f);
      facets.push_back(facet);
      const int side = SideOf(facet);
      if (side < kSides) {
        areas[static_cast<size_t>(side)] += AreaOf(facet);
      }
      WELLSPACE_RETURN_IF_ERROR(CheckName(f, side));
      if (side == kSides) {
        for (const Point<3>& p : {facet[0], facet[1], facet[2], MiddleOf(facet)}) {
          const NearTriangle found = given_.Nearest(p, near);
          near = found.triangle;
          if (found.distance_sq > most_ * most_) {
            return absl::FailedPreconditionError(
                absl::StrFormat("facet %d is in no side of the box, and %g away from all triangles at %s", f,
                                std::sqrt(found.distance_sq), TextOf(p)));
          }
        }
      }
    }
    for (int side = 0; side < kSides; ++side) {
      const int u = (side / 2 + 1) % 3;
      const int v = (side / 2 + 2) % 3;
      const double wanted = (box_.high[u] - box_.low[u]) * (box_.high[v] - box_.low[v]);
      const double found = areas[static_cast<size_t>(side)];
      const double slack = kRoundingOfSums * wanted + rounding_ * wanted / box_.ShortestSide();
      if (found > wanted + slack || (!are_some_holes_ && found < wanted - slack)) {
        return absl::FailedPreconditionError(absl::StrFormat(
            "facets in the side %s of the box have an area of %.15g; it has %.15g", FaceName(side), found, wanted));
      }
    }
    return facets_.Build(std::move(facets), context_);
  }

  // A facet in a side has its name, but where a triangle lies in it.
  absl::Status CheckName(size_t f, int side) const {
    if (!checks_tags_ || parts_.domain.boundary.names.empty()) {
      return absl::OkStatus();
    }
    const std::string name = NameOf(f);
    for (int other = 0; other < kSides; ++other) {
      if (other != side && name == FaceName(other)) {
        return absl::FailedPreconditionError(
            absl::StrCat("facet ", f, " has the name ", name, ", but is not in that side of the box"));
      }
    }
    const Point<3> middle = MiddleOf(FacetAt(f));
    if (side < kSides && name != FaceName(side) &&
        given_.Nearest(middle, kNoHint).distance_sq > (rounding_ + features_.weld) * (rounding_ + features_.weld)) {
      return absl::FailedPreconditionError(absl::StrCat("facet ", f, " in the side ", FaceName(side),
                                                        " of the box has the name \"", name,
                                                        "\", but no triangle is at its middle, ", TextOf(middle)));
    }
    return absl::OkStatus();
  }

  // Whether places of triangles have facets. They are on a lattice, as fine as all triangles have places for.
  absl::Status CheckPlaces() const {
    const size_t count = std::max<size_t>(1, features_.triangle_count());
    const auto parts =
        std::clamp<size_t>(static_cast<size_t>(std::sqrt(2.0 * kPlaces / static_cast<double>(count))), 2, kMostPlaces);
    const size_t step = std::max<size_t>(1, count / kPlaces);
    uint32_t near = kNoHint;
    for (size_t t = 0; t < count; t += step) {
      const Triangle triangle = Given(t);
      for (size_t i = 0; i <= parts; ++i) {
        WELLSPACE_RETURN_IF_ERROR(Look(t + i));
        for (size_t k = 0; i + k <= parts; ++k) {
          Point<3> p;
          for (int axis = 0; axis < 3; ++axis) {
            p[axis] = (static_cast<double>(i) * triangle[0][axis] + static_cast<double>(k) * triangle[1][axis] +
                       static_cast<double>(parts - i - k) * triangle[2][axis]) /
                      static_cast<double>(parts);
          }
          if (!IsInside(p)) {
            continue;
          }
          const NearTriangle found = facets_.Nearest(p, near);
          near = found.triangle;
          if (found.distance_sq > most_ * most_) {
            return absl::FailedPreconditionError(
                absl::StrFormat("triangle %d is %g away from all facets at %s, in the box", t,
                                std::sqrt(found.distance_sq), TextOf(p)));
          }
        }
      }
    }
    return absl::OkStatus();
  }

  // Farther from all sides than the tolerance.
  bool IsInside(const Point<3>& p) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(p[axis] > box_.low[axis] + most_ && p[axis] < box_.high[axis] - most_)) {
        return false;
      }
    }
    return true;
  }

  const MeshView& mesh_;
  const SolidParts& parts_;
  const SurfaceFeatures& features_;
  const Box<3>& box_;
  const SurfaceView& surface_;
  const RunContext& context_;
  double rounding_ = 0;
  double most_ = 0;  // the distance of facets from triangles, and of triangles from facets
  bool are_some_holes_ = false;
  bool checks_tags_ = false;
  TriangleTree given_;
  TriangleTree facets_;
};

}  // namespace

absl::Status ValidateBoxedMesh(const MeshView& mesh, const SolidParts& parts, const SurfaceView& surface,
                               const FidelityOptions& options, const RunContext& context) {
  return BoxCheck(mesh, parts, surface, options, context).Run();
}

}  // namespace wellspace::core
