#include "core/surface_report.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/domain.h"
#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/features/surface_curves.h"
#include "core/features/surface_shape.h"
#include "core/features/triangle_pairs.h"
#include "core/near_points.h"

namespace wellspace::core {
namespace {

// The frame is wider on every side than the surface by so many of its longest side, as it is where it is meshed.
constexpr double kRoom = 0.5;

// The smallest patches that stay, as a share of the diagonal, unless a length is given.
constexpr double kMinPatchShare = 0.01;

// A look at the context in a loop that makes short steps, of which this is one.
absl::Status CheckAt(size_t step, const RunContext& context) {
  return step % kStepsBetweenChecks == 0 ? context.Check() : absl::OkStatus();
}

double DiagonalOf(const Box<3>& box) { return Distance<3>(box.low, box.high); }

class Inspector {
 public:
  Inspector(std::span<const double> points, const SurfaceFeatures& features, int threads, const RunContext& context)
      : points_(points), features_(features), threads_(threads), context_(context) {}

  absl::StatusOr<SurfaceReport> Inspect() {
    WELLSPACE_RETURN_IF_ERROR(CheckFeatures());
    WELLSPACE_RETURN_IF_ERROR(context_.ReserveMemory(
        InspectSurfaceBytes(points_.size() / 3, features_.triangle_count(), features_.weld > 0)));
    WELLSPACE_RETURN_IF_ERROR(MakeComplex());
    WELLSPACE_ASSIGN_OR_RETURN(const SurfaceShape shape, DescribeShape(complex_, context_));
    TakeShape(shape);
    AddConflicts();
    WELLSPACE_RETURN_IF_ERROR(AddContacts());
    AddOddEdges(shape);
    WELLSPACE_RETURN_IF_ERROR(TakeSolids(shape));
    return TakeCurves();
  }

 private:
  absl::Status CheckFeatures() const {
    WELLSPACE_RETURN_IF_ERROR(CheckShape(points_, 3));
    if (features_.corners.empty() || features_.corners.size() % 3 != 0) {
      return absl::InvalidArgumentError(absl::StrCat("triangles: there are ", features_.corners.size(),
                                                     " corners; expected three of each triangle, "
                                                     "and at least one triangle"));
    }
    if (!features_.markers.empty() && features_.markers.size() != features_.triangle_count()) {
      return absl::InvalidArgumentError(absl::StrCat("markers: there are ", features_.markers.size(), "; expected ",
                                                     features_.triangle_count(), ", one of each triangle, or none"));
    }
    if (!(features_.crease_angle >= 0 && features_.crease_angle <= 180)) {
      return absl::InvalidArgumentError(
          absl::StrCat("crease_angle: expected degrees from 0 to 180, got ", features_.crease_angle));
    }
    for (const auto& [name, length] :
         {std::pair("weld", features_.weld), std::pair("min_patch", features_.min_patch)}) {
      if (!(length >= 0 && std::isfinite(length))) {
        return absl::InvalidArgumentError(absl::StrCat(name, ": expected a length, 0 or more, got ", length));
      }
    }
    return absl::OkStatus();
  }

  // Makes the complex, on the scale of the computation.
  absl::Status MakeComplex() {
    WELLSPACE_ASSIGN_OR_RETURN(Box<3> around, BoxAround<3>(points_, 0, context_));
    const double room = kRoom * around.LongestSide();
    if (!(room > 0)) {
      return absl::InvalidArgumentError("triangles: all corners are one point; expected a surface with an area");
    }
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] -= room;
      around.high[axis] += room;
    }
    WELLSPACE_ASSIGN_OR_RETURN(domain_, Domain<3>::Of(around));
    WELLSPACE_RETURN_IF_ERROR(CheckPoints<3>(domain_, points_, context_));
    std::vector<double> kept(points_.begin(), points_.end());
    std::vector<uint32_t> place_of;
    if (features_.weld > 0) {
      WELLSPACE_ASSIGN_OR_RETURN(MergedPoints merged, MergeNear<3>(domain_, points_, features_.weld, context_));
      report_.welded_points = merged.merged;
      report_.equal_points = points_.size() / 3 - merged.points.size() / 3 - merged.merged;
      kept = std::move(merged.points);
      place_of.assign(merged.place_of.begin(), merged.place_of.end());
    }
    for (size_t i = 0; i < kept.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      kept[i] *= domain_.scale;
    }
    WELLSPACE_ASSIGN_OR_RETURN(complex_, MakeSurfaceComplex(kept, place_of, features_, context_));
    if (complex_.triangles.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("triangles: none of the ", features_.triangle_count(),
                                                     " has an area; expected a surface with an area"));
    }
    return TakeCleaning();
  }

  absl::Status TakeCleaning() {
    report_.equal_points += complex_.cleaning.equal_points;
    report_.flat_triangles = complex_.cleaning.flat_triangles;
    report_.equal_triangles = complex_.cleaning.equal_triangles;
    const SurfaceCleaning& cleaning = complex_.cleaning;
    if (cleaning.flat_triangles > 0) {
      report_.flat_at = {.at = domain_.Unscaled(cleaning.lowest_flat.at), .triangles = {cleaning.lowest_flat.source}};
    }
    if (cleaning.equal_triangles > 0) {
      report_.equal_at = {.at = domain_.Unscaled(cleaning.lowest_equal.at),
                          .triangles = {cleaning.lowest_equal.source}};
    }
    report_.triangles = complex_.triangles.size();
    std::vector<bool> is_used(complex_.points.size());
    const Point<3>& first = complex_.Corner(0, 0);
    scaled_box_ = {first, first};
    for (size_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * t, context_));
      for (const uint32_t corner : complex_.triangles[t]) {
        is_used[corner] = true;
        scaled_box_.Include({complex_.points[corner], complex_.points[corner]});
      }
    }
    report_.points = static_cast<uint64_t>(std::count(is_used.begin(), is_used.end(), true));
    report_.box = {domain_.Unscaled(scaled_box_.low), domain_.Unscaled(scaled_box_.high)};
    // Of the given ones, which a flat triangle may have.
    std::vector<bool> is_corner(complex_.points.size());
    for (size_t i = 0; i < features_.corners.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      is_corner[complex_.point_of_input[features_.corners[i]]] = true;
    }
    for (size_t i = 0; i < complex_.point_of_input.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      report_.loose_points += is_corner[complex_.point_of_input[i]] ? 0 : 1;
    }
    return absl::OkStatus();
  }

  Point<3> MiddleOf(uint32_t edge) const {
    const auto [a, b] = complex_.edges[edge];
    Point<3> middle;
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = complex_.points[a][axis] + 0.5 * (complex_.points[b][axis] - complex_.points[a][axis]);
    }
    return domain_.Unscaled(middle);
  }

  void TakeShape(const SurfaceShape& shape) {
    report_.components = shape.components;
    report_.area = shape.area / (domain_.scale * domain_.scale);
    report_.flipped_triangles = shape.flipped_triangles;
    if (shape.flipped_triangles > 0) {
      report_.flipped_at = {.at = domain_.Unscaled(complex_.Corner(shape.first_flipped, 0)),
                            .triangles = {complex_.sources[shape.first_flipped]}};
    }
    report_.one_sided = shape.one_sided;
    if (shape.open_edges < complex_.edges.size()) {
      report_.sharpest_angle_deg = shape.sharpest_angle;
      report_.sharpest_at = MiddleOf(shape.sharpest_edge);
    }
  }

  // The given triangles at an edge, the first of them.
  std::vector<uint32_t> TrianglesAt(uint32_t edge) const {
    constexpr size_t kFew = 5;
    std::vector<uint32_t> given;
    for (const TriangleSide side : complex_.SidesAt(edge)) {
      if (given.size() < kFew) {
        given.push_back(complex_.sources[TriangleOf(side)]);
      }
    }
    return given;
  }

  void AddConflicts() {
    if (complex_.conflict_count == 0) {
      return;
    }
    SurfaceFault fault{.kind = SurfaceFault::Kind::kMarkersDiffer,
                       .count = complex_.conflict_count,
                       .accepted = "one marker on triangles over the same corners; or leave one of them out"};
    for (const MarkerConflict& conflict : complex_.conflicts) {
      if (fault.places.size() < kNamedFaults) {
        Point<3> middle{};
        for (size_t k = 0; k < 3; ++k) {
          const Point<3>& corner =
              complex_.points[complex_.point_of_input[features_.corners[3 * size_t{conflict.one} + k]]];
          for (int axis = 0; axis < 3; ++axis) {
            middle[axis] += corner[axis] / 3;
          }
        }
        fault.places.push_back({.at = domain_.Unscaled(middle), .triangles = {conflict.one, conflict.other}});
      }
    }
    report_.faults.push_back(std::move(fault));
  }

  absl::Status AddContacts() {
    WELLSPACE_ASSIGN_OR_RETURN(const TrianglePairs found,
                               FindTrianglePairs(complex_, domain_.MinSeparation(), threads_, context_));
    SurfaceFault meet{.kind = SurfaceFault::Kind::kSelfIntersections,
                      .has_more = found.has_more,
                      .accepted =
                          "triangles that meet in common corners and edges alone; unite the parts that overlap, "
                          "or cut the triangles where they meet"};
    SurfaceFault near{.kind = SurfaceFault::Kind::kNearPoints,
                      .has_more = found.has_more,
                      .accepted = absl::StrFormat("corners at least %.3g from every triangle that they are not of; "
                                                  "move them away, or weld with a longer distance",
                                                  domain_.MinSeparation() / domain_.scale)};
    for (const TrianglePair& pair : found.pairs) {
      const bool is_near = pair.contact.kind == TriangleContact::Kind::kNear;
      SurfaceFault& fault = is_near ? near : meet;
      if (++fault.count <= kNamedFaults) {
        fault.places.push_back({.at = domain_.Unscaled(pair.contact.at),
                                .size = pair.contact.distance / domain_.scale,
                                .triangles = {complex_.sources[pair.one], complex_.sources[pair.other]}});
      }
    }
    are_apart_ = meet.count == 0;
    for (SurfaceFault* const fault : {&meet, &near}) {
      if (fault->count > 0) {
        report_.faults.push_back(std::move(*fault));
      }
    }
    return absl::OkStatus();
  }

  void AddOddEdges(const SurfaceShape& shape) {
    if (features_.solids != SolidRule::kEvenOdd || shape.odd_edges.empty()) {
      return;
    }
    SurfaceFault fault{.kind = SurfaceFault::Kind::kOddEdges,
                       .count = shape.odd_edges.size(),
                       .accepted =
                           "an even number of triangles at every edge; or solids by holes, where several "
                           "materials share facets"};
    for (size_t i = 0; i < std::min(shape.odd_edges.size(), kNamedFaults); ++i) {
      fault.places.push_back({.at = MiddleOf(shape.odd_edges[i]), .triangles = TrianglesAt(shape.odd_edges[i])});
    }
    report_.faults.push_back(std::move(fault));
  }

  void AddOpenEdges(const SurfaceShape& shape) {
    SurfaceFault fault{
        .kind = SurfaceFault::Kind::kOpenEdges,
        .count = shape.open_edges,
        .loops = shape.loops.size(),
        .accepted = features_.solids == SolidRule::kEvenOdd
                        ? "a closed surface; close the holes, weld with a longer distance if they are cracks, or take "
                          "solids by holes, where triangles that bound nothing are membranes"
                        : "a surface that bounds a solid: nothing is bounded; close the holes, or weld with a longer "
                          "distance if they are cracks"};
    for (size_t i = 0; i < std::min(shape.loops.size(), kNamedFaults); ++i) {
      const OpenLoop& loop = shape.loops[i];
      fault.places.push_back(
          {.at = domain_.Unscaled(loop.at), .size = loop.length / domain_.scale, .triangles = TrianglesAt(loop.first)});
    }
    report_.faults.push_back(std::move(fault));
  }

  // Finds the solids if what is there so far can bound them.
  absl::Status TakeSolids(const SurfaceShape& shape) {
    const bool is_even_odd = features_.solids == SolidRule::kEvenOdd;
    if (is_even_odd && shape.open_edges > 0) {
      AddOpenEdges(shape);
    }
    if (!are_apart_) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(const Solids solids, FindSolids(complex_, context_));
    if (solids.count == 1 && !is_even_odd) {
      AddOpenEdges(shape);
    }
    if (!report_.faults.empty()) {
      return absl::OkStatus();
    }
    const double scale = 1 / domain_.scale;
    double volume = 0;
    for (uint32_t solid = 1; solid < solids.count; ++solid) {
      report_.solids.push_back(solids.volumes[solid] * scale * scale * scale);
      volume += !is_even_odd || solids.is_odd[solid] ? report_.solids.back() : 0;
    }
    report_.volume = volume;
    report_.membranes = solids.membranes;
    uint64_t outward = 0;
    uint64_t inward = 0;
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      outward += solids.solid_of[HalfFacetOf(t, false)] == 0 ? 1 : 0;
      inward += solids.solid_of[HalfFacetOf(t, true)] == 0 ? 1 : 0;
    }
    report_.is_inside_out = inward > outward;
    return absl::OkStatus();
  }

  absl::StatusOr<SurfaceReport> TakeCurves() {
    const double min_patch =
        features_.min_patch > 0 ? features_.min_patch * domain_.scale : kMinPatchShare * DiagonalOf(scaled_box_);
    WELLSPACE_ASSIGN_OR_RETURN(const SurfaceCurves curves,
                               FindCurves(complex_, features_.crease_angle, min_patch, context_));
    report_.patches = curves.patch_count;
    report_.curves = curves.curve_count();
    report_.corners = curves.corners.size();
    return std::move(report_);
  }

  const std::span<const double> points_;
  const SurfaceFeatures& features_;
  const int threads_;
  const RunContext& context_;
  Domain<3> domain_;
  SurfaceComplex complex_;
  Box<3> scaled_box_{};
  bool are_apart_ = false;  // triangles: none meets another where they share nothing
  SurfaceReport report_;
};

}  // namespace

const char* NameOf(SurfaceFault::Kind kind) {
  switch (kind) {
    case SurfaceFault::Kind::kMarkersDiffer:
      return "markers_differ";
    case SurfaceFault::Kind::kSelfIntersections:
      return "self_intersections";
    case SurfaceFault::Kind::kNearPoints:
      return "near_points";
    case SurfaceFault::Kind::kOddEdges:
      return "odd_edges";
    case SurfaceFault::Kind::kOpenEdges:
      break;
  }
  return "open_edges";
}

std::string WordsOf(SurfaceFault::Kind kind) {
  std::string words = NameOf(kind);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

absl::StatusOr<SurfaceReport> InspectSurface(std::span<const double> points, const SurfaceFeatures& features,
                                             int threads, const RunContext& context) {
  return Inspector(points, features, threads, context).Inspect();
}

uint64_t InspectSurfaceBytes(uint64_t points, uint64_t triangles, bool welds) {
  // The complex, beside which one step after the other works. Welding comes before it.
  const uint64_t steps = std::max({SurfaceShapeBytes(points, triangles), TrianglePairsBytes(triangles),
                                   SolidsBytes(triangles), SurfaceCurvesBytes(points, triangles)});
  const uint64_t of_point = 3 * sizeof(double) + (welds ? kMergeBytes<3> : 0);
  return points * of_point + SurfaceComplexBytes(points, triangles) + steps;
}

}  // namespace wellspace::core
