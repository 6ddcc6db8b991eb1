#include "core/input/surface_sizes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_format.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/surface_curves.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/input/mesh_parameters.h"
#include "core/input/triangle_pieces.h"

namespace wellspace::core {
namespace {

// A sheet faces another one if its normal is no farther than this from the opposite of the other's. Unit: degrees.
constexpr double kFacingAngle = 30;

// Facets of a radius r take about 0.7 / r^2 vertices for each unit of area. A demand is refused where a quarter of
// these is more than is allowed: discs of that radius around so few vertices do not cover the area, on both sides of
// a thin solid.
constexpr double kVerticesPerRadiusSq = 0.7;
constexpr double kSurelyNeeded = 0.25;

// A way across a solid may go so far beyond the surface, relative to its diagonal: then it crosses the last triangle.
constexpr double kRoom = 0.01;

constexpr size_t kSamplesTogether = 4096;

// The vertices that facets of that circumradius take on an area, about.
double VerticesOn(double area, double radius) { return kVerticesPerRadiusSq * area / (radius * radius); }

bool IsMeshedOn(const SpatialDomain& domain, HalfFacet side) { return domain.IsMeshed(domain.solids().solid_of[side]); }
bool IsMeshedAt(const SpatialDomain& domain, uint32_t t) {
  return IsMeshedOn(domain, HalfFacetOf(t, false)) || IsMeshedOn(domain, HalfFacetOf(t, true));
}

double DiagonalOf(const Box<3>& box) { return Distance<3>(box.low, box.high); }

// The vertices that a demand takes on the surface.
struct Tally {
  double vertices = 0;
  double by_square = 0;  // were there no least size: by the square of the demand
};

class SizeFinder {
 public:
  SizeFinder(const SpatialDomain& domain, const SurfaceSizeDemands& demands, uint64_t held, const RunContext& context)
      : domain_(domain),
        demands_(demands),
        held_(held),
        context_(context),
        diagonal_(DiagonalOf(domain.index().hull())),
        box_(Widened<3>(domain.index().hull(), kRoom * diagonal_)),
        longest_(std::min(demands.most_edge, diagonal_)) {}

  absl::StatusOr<std::vector<SizedPlace<Point<3>>>> Find() {
    if (demands_.curvature_elements > 0) {
      WELLSPACE_RETURN_IF_ERROR(FindCurvatures());
    }
    WELLSPACE_RETURN_IF_ERROR(RefuseHopeless());
    for (uint32_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      if (IsMeshedAt(domain_, t)) {
        WELLSPACE_RETURN_IF_ERROR(SamplePieces(t));
      }
    }
    return std::move(samples_);
  }

 private:
  const SurfaceComplex& complex() const { return domain_.complex(); }

  // Finds the edges that each triangle asks for by its curvature.
  absl::Status FindCurvatures() {
    held_ += complex().triangles.size() * sizeof(double);
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held_));
    edge_of_triangle_.resize(complex().triangles.size());
    for (uint32_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      edge_of_triangle_[t] = 2 * std::numbers::pi / (CurvatureOf(t) * demands_.curvature_elements);
    }
    return absl::OkStatus();
  }

  // The larger of the two curvatures at a triangle, whatever its sign: each edge that is no crease curves the surface
  // across it, by the angle there over the mean height of both triangles. Infinite radii: 0.
  double CurvatureOf(uint32_t t) const {
    const Triangle triangle = complex().InOrderAt(t);
    const Point<3> normal = NormalOf(triangle);
    const Point<3> along = Difference<3>(triangle[1], triangle[0]);
    const Point<3> across = Cross(normal, along);
    std::array<TriangleSide, 3> sides = {SideOf(t, 0), SideOf(t, 1), SideOf(t, 2)};
    std::sort(sides.begin(), sides.end(),
              [&](TriangleSide a, TriangleSide b) { return complex().edge_of_side[a] < complex().edge_of_side[b]; });
    double xx = 0;  // the sum, as a tensor in the plane of the triangle
    double xy = 0;
    double yy = 0;
    for (const TriangleSide side : sides) {
      const uint32_t edge = complex().edge_of_side[side];
      const std::span<const TriangleSide> both = complex().SidesAt(edge);
      if (both.size() != 2) {
        continue;
      }
      const TriangleSide other = both[0] == side ? both[1] : both[0];
      const std::vector<uint32_t>& patch_of = domain_.curves().patch_of;
      if (patch_of[t] != patch_of[TriangleOf(other)]) {
        continue;  // a crease
      }
      const Point<3>& low = complex().points[complex().edges[edge][0]];
      const Point<3> way = Difference<3>(complex().points[complex().edges[edge][1]], low);
      const double length = std::sqrt(NormSq<3>(way));
      const double height = (AreaOf(triangle) + AreaOf(complex().InOrderAt(TriangleOf(other)))) / length;
      const double angle = CreaseAngle(complex(), edge) * (std::numbers::pi / 180);
      if (!(height >= demands_.min_size * angle)) {
        continue;
      }
      const bool is_above = Dot<3>(normal, Difference<3>(complex().points[complex().ApexOf(other)], low)) > 0;
      const double curvature = (is_above ? -angle : angle) / height;
      const double x = Dot<3>(way, along) / (length * std::sqrt(NormSq<3>(along)));
      const double y = Dot<3>(way, across) / (length * std::sqrt(NormSq<3>(across)));
      xx += curvature * x * x;
      xy += curvature * x * y;
      yy += curvature * y * y;
    }
    return 0.5 * std::abs(xx + yy) + std::hypot(0.5 * (xx - yy), xy);
  }

  double EdgeByCurvature(uint32_t t) const {
    return edge_of_triangle_.empty() ? longest_ : std::min(edge_of_triangle_[t], longest_);
  }
  double RadiusOf(double edge) const { return std::max(CircumradiusOf(edge, 3), demands_.min_size); }

  void Count(double area, double edge, double demand, Tally& tally) const {
    if (edge < longest_) {
      const double at_one = kRadiusPerEdge * edge * demand;
      tally.vertices += VerticesOn(area, std::max(kRadiusPerEdge * edge, demands_.min_size));
      tally.by_square += VerticesOn(area, at_one);
    }
  }

  // Refuses demands that surely take too many vertices, before there are samples.
  absl::Status RefuseHopeless() {
    Tally by_curvature;
    Tally by_thickness;
    for (uint32_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      if (!IsMeshedAt(domain_, t)) {
        continue;
      }
      const Triangle triangle = complex().InOrderAt(t);
      Count(AreaOf(triangle), EdgeByCurvature(t), demands_.curvature_elements, by_curvature);
      if (demands_.thickness_layers == 0) {
        continue;
      }
      const auto count = [&](const Triangle& piece, const LongestEdge& longest) -> absl::StatusOr<bool> {
        if (IsTooLong(longest)) {
          return true;
        }
        Count(AreaOf(piece), EdgeByThickness(t, piece, longest_), demands_.thickness_layers, by_thickness);
        return false;
      };
      WELLSPACE_RETURN_IF_ERROR(ForEachPiece(triangle, context_, count));
    }
    WELLSPACE_RETURN_IF_ERROR(CheckTally(by_curvature, "curvature_elements", demands_.curvature_elements));
    return CheckTally(by_thickness, "thickness_layers", demands_.thickness_layers);
  }

  absl::Status CheckTally(const Tally& tally, const char* field, double demand) const {
    const double least = kSurelyNeeded * tally.vertices;
    const auto most = static_cast<double>(demands_.max_vertices);
    if (least <= most) {
      return absl::OkStatus();
    }
    const double fits = std::sqrt(most / (kSurelyNeeded * tally.by_square));
    absl::Status status = absl::ResourceExhaustedError(absl::StrFormat(
        "surface.%s: %g takes at least %.3g vertices on the surface, and max_vertices is %d; expected %s", field,
        demand, least, demands_.max_vertices, fits > 0 ? absl::StrFormat("at most %.3g", fits) : "far less"));
    status.SetPayload(std::string(kDemandsTooFine), absl::Cord());
    return status;
  }

  bool IsTooLong(const LongestEdge& longest) const {
    return longest.length_sq > kLongestPiece * kLongestPiece * diagonal_ * diagonal_;
  }

  // Puts samples on the pieces of a triangle.
  absl::Status SamplePieces(uint32_t t) {
    const auto sample = [&](const Triangle& piece, const LongestEdge& longest) -> absl::StatusOr<bool> {
      double edge = EdgeByCurvature(t);
      if (demands_.thickness_layers > 0) {
        if (IsTooLong(longest)) {
          return true;
        }
        edge = std::min(edge, EdgeByThickness(t, piece, edge));
      }
      if (!(edge < longest_)) {
        return false;
      }
      const double radius = RadiusOf(edge);
      const double most = std::max(edge, radius);
      if (longest.length_sq > most * most) {
        return true;
      }
      WELLSPACE_RETURN_IF_ERROR(AddSample(piece, radius));
      return false;
    };
    return ForEachPiece(complex().InOrderAt(t), context_, sample);
  }

  absl::Status AddSample(const Triangle& piece, double radius) {
    const Point<3> middle = MiddleOf(piece);
    double reach_sq = 0;
    for (const Point<3>& corner : piece) {
      reach_sq = std::max(reach_sq, DistanceSq<3>(middle, corner));
    }
    if (samples_.size() % kSamplesTogether == 0) {
      constexpr uint64_t kBytesOfSample = 3 * sizeof(SizedPlace<Point<3>>);  // while the array grows
      WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held_ + (samples_.size() + kSamplesTogether) * kBytesOfSample));
    }
    const double grown = demands_.gradation * std::sqrt(reach_sq);
    samples_.push_back({middle, std::max(0.5 * radius, radius - 0.5 * grown)});
    return absl::OkStatus();
  }

  // The edge that a piece of triangle `t` asks for by the thickness of the solids there, if that is below `most`.
  double EdgeByThickness(uint32_t t, const Triangle& piece, double most) {
    const Triangle triangle = complex().TriangleAt(t);
    const Point<3> normal = NormalOf(triangle);
    const double length = std::sqrt(NormSq<3>(normal));
    const Point<3> from = MiddleOf(piece);
    double edge = most;
    if (!(length > 0)) {
      return edge;
    }
    for (const bool from_behind : {false, true}) {
      if (IsMeshedOn(domain_, HalfFacetOf(t, from_behind))) {
        const double reach = std::min(most * demands_.thickness_layers, diagonal_) * (from_behind ? -1 : 1) / length;
        const double way = WayToFacing(HalfFacetOf(t, from_behind), from, normal, EndInBox(from, normal, reach));
        edge = std::min(edge, way / demands_.thickness_layers);
      }
    }
    return edge;
  }

  // The last point on the way from `from` to from + reach * direction that is in the box around the surface.
  Point<3> EndInBox(const Point<3>& from, const Point<3>& direction, double reach) const {
    double share = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double way = reach * direction[axis];
      const double room = way > 0 ? box_.high[axis] - from[axis] : from[axis] - box_.low[axis];
      share = std::abs(way) > room ? std::min(share, std::max(room, 0.0) / std::abs(way)) : share;
    }
    Point<3> end;
    for (int axis = 0; axis < 3; ++axis) {
      end[axis] = std::clamp(from[axis] + share * reach * direction[axis], box_.low[axis], box_.high[axis]);
    }
    return end;
  }

  // The distance from `from`, on a half-facet, along its normal to the next triangle that bounds the same solid, if
  // that faces it; infinite if none does before `to`.
  double WayToFacing(HalfFacet side, const Point<3>& from, const Point<3>& direction, const Point<3>& to) {
    domain_.index().FindCrossings(from, to, crossings_);
    const std::vector<uint32_t>& solid_of = domain_.solids().solid_of;
    for (const SurfaceCrossing& crossing : crossings_) {
      if (crossing.triangle == side >> 1 || solid_of[crossing.before] != solid_of[side]) {
        continue;
      }
      const Triangle other = complex().InOrderAt(crossing.triangle);
      const Point<3> normal = NormalOf(other);
      const double along = std::abs(Dot<3>(normal, direction));
      const double way =
          std::abs(Dot<3>(normal, Difference<3>(other[0], from))) / along * std::sqrt(NormSq<3>(direction));
      if (!(way >= demands_.min_size)) {
        continue;
      }
      static const double kLeastCosine = std::cos(kFacingAngle * std::numbers::pi / 180);
      const double cosine = along / std::sqrt(NormSq<3>(normal) * NormSq<3>(direction));
      return cosine >= kLeastCosine ? way : std::numeric_limits<double>::infinity();
    }
    return std::numeric_limits<double>::infinity();
  }

  const SpatialDomain& domain_;
  const SurfaceSizeDemands& demands_;
  uint64_t held_;
  const RunContext& context_;
  const double diagonal_;                 // of the box of the triangles
  const Box<3> box_;                      // with room around it
  const double longest_;                  // longer edges need not be asked for
  std::vector<double> edge_of_triangle_;  // by curvature; empty where that asks for nothing
  std::vector<SurfaceCrossing> crossings_;
  std::vector<SizedPlace<Point<3>>> samples_;
};

}  // namespace

absl::StatusOr<std::vector<SizedPlace<Point<3>>>> FindSurfaceSizes(const SpatialDomain& domain,
                                                                   const SurfaceSizeDemands& demands, uint64_t held,
                                                                   const RunContext& context) {
  return SizeFinder(domain, demands, held, context).Find();
}

absl::StatusOr<double> FacetVertices(const SpatialDomain& domain, const SizeField<3>& sizes, double facet_radius,
                                     const RunContext& context) {
  const SurfaceComplex& complex = domain.complex();
  const double longest = kLongestPiece * DiagonalOf(domain.index().hull());
  double vertices = 0;
  SizeHint hint;
  const auto count = [&](const Triangle& piece, const LongestEdge& edge) -> absl::StatusOr<bool> {
    if (edge.length_sq > longest * longest) {
      return true;
    }
    vertices += VerticesOn(AreaOf(piece), std::sqrt(sizes.AtSq(MiddleOf(piece), facet_radius * facet_radius, &hint)));
    return false;
  };
  for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context));
    if (IsMeshedAt(domain, t)) {
      WELLSPACE_RETURN_IF_ERROR(ForEachPiece(complex.InOrderAt(t), context, count));
    }
  }
  return vertices;
}

}  // namespace wellspace::core
