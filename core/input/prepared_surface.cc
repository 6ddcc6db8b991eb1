#include "core/input/prepared_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/boxed_surface.h"
#include "core/features/surface_shape.h"
#include "core/features/triangle_pairs.h"
#include "core/input/near_points.h"
#include "core/input/surface_wrap.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {
namespace {

// The frame is wider on every side than the surface by so many of its longest side, as it is where it is meshed.
constexpr double kRoom = 0.5;

// Points may be beyond a box by so many of its longest sides: grids of wider frames are too coarse for the box.
constexpr double kMostBeyond = 1024;

// The smallest patches that stay, as a share of the diagonal, unless a length is given.
constexpr double kMinPatchShare = 0.01;

// The crease angle of a wrap: creases of what is given are rounded off in it.
constexpr double kNoCreases = 180;

// The largest cell of a wrap, as a share of the diagonal: its room has to be in the frame.
constexpr double kLargestCell = 0.1;
// The smallest one, by the least separation: corners of a wrap are a tenth of it apart.
constexpr double kLeastCell = 64;

double DiagonalOf(const Box<3>& box) { return Distance<3>(box.low, box.high); }

class Preparer {
 public:
  Preparer(std::span<const double> points, const SurfaceFeatures& features, int threads, const RunContext& context)
      : points_(points), features_(features), threads_(threads), context_(context) {}

  absl::StatusOr<PreparedSurface> Prepare() {
    WELLSPACE_RETURN_IF_ERROR(CheckSurfaceFeatures(points_, features_));
    WELLSPACE_RETURN_IF_ERROR(MakeComplex());
    WELLSPACE_ASSIGN_OR_RETURN(const SurfaceShape shape, DescribeShape(complex_, context_));
    TakeShape(shape);
    AddConflicts();
    WELLSPACE_RETURN_IF_ERROR(AddContacts());
    AddOddEdges(shape);
    WELLSPACE_RETURN_IF_ERROR(TakeSolids(shape));
    WELLSPACE_RETURN_IF_ERROR(TakeCurves());
    return std::move(prepared_);
  }

 private:
  // Makes the complex, on the scale of the computation.
  absl::Status MakeComplex() {
    WELLSPACE_RETURN_IF_ERROR(MakeFrame());
    MergedPoints merged;
    if (features_.weld > 0) {
      WELLSPACE_ASSIGN_OR_RETURN(merged, MergeNear<3>(frame_, points_, features_.weld, context_));
      report_.welded_points = merged.merged;
      report_.equal_points = points_.size() / 3 - merged.points.size() / 3 - merged.merged;
    } else {
      merged.points.assign(points_.begin(), points_.end());
    }
    std::vector<double>& kept = merged.points;
    for (size_t i = 0; i < kept.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      kept[i] *= frame_.scale;
    }
    WELLSPACE_ASSIGN_OR_RETURN(complex_, MakeSurfaceComplex(kept, merged.place_of, features_, context_));
    if (complex_.triangles.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("triangles: none of the ", features_.triangle_count(),
                                                     " has an area; expected a surface with an area"));
    }
    WELLSPACE_RETURN_IF_ERROR(TakeCleaning());
    if (features_.solids == SolidRule::kWinding) {
      return TakeWrap(merged);
    }
    return features_.solids == SolidRule::kBox ? TakeBox() : absl::OkStatus();
  }

  // The frame has room for all points, and for the box.
  absl::Status MakeFrame() {
    WELLSPACE_ASSIGN_OR_RETURN(Box<3> around, BoxAround<3>(points_, 0, context_));
    if (features_.box.has_value()) {
      WELLSPACE_RETURN_IF_ERROR(CheckBoxOf(*features_.box, around));
      around.Include(*features_.box);
    }
    const double room = kRoom * around.LongestSide();
    if (!(room > 0)) {
      return absl::InvalidArgumentError("triangles: all corners are one point; expected a surface with an area");
    }
    for (int axis = 0; axis < 3; ++axis) {
      around.low[axis] -= room;
      around.high[axis] += room;
    }
    WELLSPACE_ASSIGN_OR_RETURN(frame_, Frame<3>::Of(around));
    WELLSPACE_RETURN_IF_ERROR(CheckPoints<3>(frame_, points_, context_));
    return features_.box.has_value() ? CheckSides() : absl::OkStatus();
  }

  // Refuses a box that doubles cannot serve, or that triangles go too far beyond.
  static absl::Status CheckBoxOf(const Box<3>& box, const Box<3>& of_points) {
    const double most = kMostBeyond * box.LongestSide();
    for (int axis = 0; axis < 3; ++axis) {
      const double beyond = std::max(box.low[axis] - of_points.low[axis], of_points.high[axis] - box.high[axis]);
      if (beyond > most) {
        return absl::InvalidArgumentError(absl::StrFormat(
            "box: points are up to %g beyond it along axis %d; expected at most %g times its longest side, %g; leave "
            "triangles out that are far from it",
            beyond, axis, kMostBeyond, box.LongestSide()));
      }
    }
    return Frame<3>::Of(box).status();
  }

  // Refuses points that are neither on the plane of a side nor far enough from it.
  absl::Status CheckSides() const {
    const double least = frame_.MinSeparation() / frame_.scale;
    for (size_t i = 0; i < points_.size() / 3; ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      const Point<3> p = PointAt<3>(points_, i);
      if (!(DistanceSq<3>(p, *features_.box) < least * least)) {
        continue;
      }
      for (int side = 0; side < 6; ++side) {
        const double distance = features_.box->DistanceToFace(p, side);
        if (distance > features_.weld && distance < least) {
          return absl::InvalidArgumentError(absl::StrFormat(
              "points[%d] = (%.17g, %.17g, %.17g) is only %g from the %s side of axis %d of the box, too close for the "
              "arithmetic of doubles; expected it on the side, or at least %g away; or weld with that distance",
              i, p[0], p[1], p[2], distance, side % 2 == 0 ? "low" : "high", side / 2, least));
        }
      }
    }
    return absl::OkStatus();
  }

  // Has the parts of triangles in the box and its sides be the complex.
  absl::Status TakeBox() {
    if (features_.weld > 0 && !(2 * features_.weld < features_.box->ShortestSide())) {
      return absl::InvalidArgumentError(absl::StrFormat("weld: %g is as wide as the box, %g; expected a shorter length",
                                                        features_.weld, features_.box->ShortestSide()));
    }
    const Box<3> box{frame_.Scaled(features_.box->low), frame_.Scaled(features_.box->high)};
    const double weld = features_.weld * frame_.scale;
    const uint64_t held = PrepareSurfaceBytes(points_.size() / 3, features_.triangle_count(), features_.weld > 0);
    WELLSPACE_ASSIGN_OR_RETURN(BoxedSurface boxed,
                               CutAtBox(complex_, box, weld, std::max(weld, frame_.MinSeparation()), held, context_));
    if (boxed.complex.triangles.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("triangles: none of the ", features_.triangle_count(),
                                                     " has a part with an area in the box; expected one, or a cloud"));
    }
    complex_ = std::move(boxed.complex);
    do_meet_in_side_ = boxed.do_meet;
    report_.moved_points = boxed.moved_points;
    report_.cut_triangles = boxed.cut_triangles;
    report_.outside_triangles = boxed.outside_triangles;
    WELLSPACE_RETURN_IF_ERROR(MeasureComplex());
    scaled_box_ = box;
    report_.box = *features_.box;
    return context_.AllowMemory(2 * held +
                                PrepareSurfaceBytes(complex_.points.size(), complex_.triangles.size(), false) +
                                SurfaceIndex::Bytes(complex_.triangles.size()));
  }

  // Has a wrap be the complex; given points stay points of it. `given`: on the scale of the computation.
  absl::Status TakeWrap(MergedPoints& given) {
    const uint64_t held = PrepareSurfaceBytes(points_.size() / 3, features_.triangle_count(), features_.weld > 0);
    const double cell =
        features_.resolution > 0 ? features_.resolution * frame_.scale : kWrapResolution * DiagonalOf(scaled_box_);
    const double least = kLeastCell * frame_.MinSeparation();
    if (cell < least) {
      return absl::InvalidArgumentError(
          absl::StrFormat("resolution: %g is too fine for coordinates of that size; expected at least %.3g",
                          cell / frame_.scale, least / frame_.scale));
    }
    if (cell > kLargestCell * DiagonalOf(scaled_box_)) {
      return absl::InvalidArgumentError(absl::StrFormat("resolution: %g is too coarse; expected at most %g",
                                                        cell / frame_.scale,
                                                        kLargestCell * DiagonalOf(scaled_box_) / frame_.scale));
    }
    WELLSPACE_ASSIGN_OR_RETURN(const SurfaceWrap wrap,
                               WrapSurface(complex_, scaled_box_, cell, 1 / frame_.scale, held, context_));
    const uint64_t count = points_.size() / 3 + wrap.points.size();
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(2 * held + PrepareSurfaceBytes(count, wrap.triangles.size(), false) +
                                                   SurfaceIndex::Bytes(wrap.triangles.size())));
    const auto first = static_cast<uint32_t>(given.points.size() / 3);
    std::vector<uint32_t> place_of(given.place_of.begin(), given.place_of.end());
    for (uint32_t i = static_cast<uint32_t>(place_of.size()); i < points_.size() / 3; ++i) {
      place_of.push_back(i);
    }
    const auto first_row = static_cast<uint32_t>(place_of.size());
    for (uint32_t i = 0; i < wrap.points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      given.points.insert(given.points.end(), wrap.points[i].begin(), wrap.points[i].end());
      place_of.push_back(first + i);
    }
    std::vector<uint32_t> corners;
    for (size_t t = 0; t < wrap.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      for (const uint32_t corner : wrap.triangles[t]) {
        corners.push_back(first_row + corner);
      }
    }
    SurfaceFeatures wrapped;
    wrapped.corners = corners;
    WELLSPACE_ASSIGN_OR_RETURN(complex_, MakeSurfaceComplex(given.points, place_of, wrapped, context_));
    complex_.point_of_input.resize(points_.size() / 3);
    complex_.sources.assign(complex_.sources.size(), 0);  // no triangle of the wrap is a given one
    report_.lost_area = wrap.lost_area / (frame_.scale * frame_.scale);
    return absl::OkStatus();
  }

  absl::Status TakeCleaning() {
    report_.equal_points += complex_.cleaning.equal_points;
    report_.flat_triangles = complex_.cleaning.flat_triangles;
    report_.equal_triangles = complex_.cleaning.equal_triangles;
    const SurfaceCleaning& cleaning = complex_.cleaning;
    if (cleaning.flat_triangles > 0) {
      report_.flat_at = {.at = frame_.Unscaled(cleaning.lowest_flat.at), .triangles = {cleaning.lowest_flat.source}};
    }
    if (cleaning.equal_triangles > 0) {
      report_.equal_at = {.at = frame_.Unscaled(cleaning.lowest_equal.at), .triangles = {cleaning.lowest_equal.source}};
    }
    WELLSPACE_RETURN_IF_ERROR(MeasureComplex());
    // The corners of all given triangles, also of those that cleaning has dropped.
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

  // Counts the points and triangles of the complex, and finds the box of their corners.
  absl::Status MeasureComplex() {
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
    report_.box = {frame_.Unscaled(scaled_box_.low), frame_.Unscaled(scaled_box_.high)};
    return absl::OkStatus();
  }

  Point<3> MiddleOf(uint32_t edge) const {
    const auto [a, b] = complex_.edges[edge];
    Point<3> middle;
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = complex_.points[a][axis] + 0.5 * (complex_.points[b][axis] - complex_.points[a][axis]);
    }
    return frame_.Unscaled(middle);
  }

  void TakeShape(const SurfaceShape& shape) {
    report_.components = shape.components;
    report_.area = shape.area / (frame_.scale * frame_.scale);
    report_.flipped_triangles = shape.flipped_triangles;
    if (shape.flipped_triangles > 0) {
      report_.flipped_at = {.at = frame_.Unscaled(complex_.Corner(shape.first_flipped, 0)),
                            .triangles = {complex_.sources[shape.first_flipped]}};
      std::erase(report_.flipped_at.triangles, SurfaceComplex::kNoSource);  // it may be of a side of the box
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
      const uint32_t source = complex_.sources[TriangleOf(side)];
      if (given.size() < kFew && source != SurfaceComplex::kNoSource) {
        given.push_back(source);
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
          const uint32_t input = features_.corners[3 * size_t{conflict.one} + k];
          const uint32_t point = complex_.point_of_input[input];
          const Point<3> corner =
              point == SurfaceComplex::kNoPoint ? frame_.Scaled(PointAt<3>(points_, input)) : complex_.points[point];
          for (int axis = 0; axis < 3; ++axis) {
            middle[axis] += corner[axis] / 3;
          }
        }
        fault.places.push_back({.at = frame_.Unscaled(middle), .triangles = {conflict.one, conflict.other}});
      }
    }
    report_.faults.push_back(std::move(fault));
  }

  absl::Status AddContacts() {
    WELLSPACE_ASSIGN_OR_RETURN(const TrianglePairs found,
                               FindTrianglePairs(complex_, frame_.MinSeparation(), threads_, context_));
    SurfaceFault meet{.kind = SurfaceFault::Kind::kSelfIntersections,
                      .has_more = found.has_more,
                      .accepted =
                          "triangles that meet in common corners and edges alone; unite the parts that overlap, cut "
                          "the triangles where they meet, or take solids by winding, which rounds creases off"};
    SurfaceFault near{.kind = SurfaceFault::Kind::kNearPoints,
                      .has_more = found.has_more,
                      .accepted = absl::StrFormat("corners at least %.3g from every triangle that they are not of; "
                                                  "move them away, or weld with a longer distance",
                                                  frame_.MinSeparation() / frame_.scale)};
    for (const TrianglePair& pair : found.pairs) {
      const bool is_near = pair.contact.kind == TriangleContact::Kind::kNear;
      SurfaceFault& fault = is_near ? near : meet;
      if (++fault.count <= kNamedFaults) {
        fault.places.push_back({.at = frame_.Unscaled(pair.contact.at),
                                .size = pair.contact.distance / frame_.scale,
                                .triangles = {complex_.sources[pair.one], complex_.sources[pair.other]}});
        std::erase(fault.places.back().triangles, SurfaceComplex::kNoSource);
      }
    }
    are_apart_ = meet.count == 0;
    if (are_apart_ && do_meet_in_side_) {
      return absl::InternalError("triangles meet in a side of the box, but nowhere else");
    }
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
                        ? "a closed surface; close the holes, weld with a longer distance if they are cracks, take "
                          "solids by winding, which closes them, or solids by holes, where triangles that bound "
                          "nothing are membranes"
                        : "a surface that bounds a solid: nothing is bounded; close the holes, or weld with a longer "
                          "distance if they are cracks"};
    for (size_t i = 0; i < std::min(shape.loops.size(), kNamedFaults); ++i) {
      const OpenLoop& loop = shape.loops[i];
      fault.places.push_back(
          {.at = frame_.Unscaled(loop.at), .size = loop.length / frame_.scale, .triangles = TrianglesAt(loop.first)});
    }
    report_.faults.push_back(std::move(fault));
  }

  // Finds the solids, unless faults that have been found keep the surface from bounding them.
  absl::Status TakeSolids(const SurfaceShape& shape) {
    const bool is_even_odd = !MeshesAllBounded(features_.solids);
    if (is_even_odd && shape.open_edges > 0) {
      AddOpenEdges(shape);
    }
    if (!are_apart_) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(prepared_.solids, FindSolids(complex_, context_));
    const Solids& solids = prepared_.solids;
    if (solids.count == 1 && !is_even_odd) {
      AddOpenEdges(shape);
    }
    if (!report_.faults.empty()) {
      return absl::OkStatus();
    }
    const double scale = 1 / frame_.scale;
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

  absl::Status TakeCurves() {
    const double min_patch =
        features_.min_patch > 0 ? features_.min_patch * frame_.scale : kMinPatchShare * DiagonalOf(scaled_box_);
    const double crease_angle = features_.solids == SolidRule::kWinding ? kNoCreases : features_.crease_angle;
    WELLSPACE_ASSIGN_OR_RETURN(prepared_.curves, FindCurves(complex_, crease_angle, min_patch, context_));
    report_.patches = prepared_.curves.patch_count;
    report_.curves = prepared_.curves.curve_count();
    report_.corners = prepared_.curves.corners.size();
    return absl::OkStatus();
  }

  const std::span<const double> points_;
  const SurfaceFeatures& features_;
  const int threads_;
  const RunContext& context_;
  PreparedSurface prepared_;
  Frame<3>& frame_ = prepared_.frame;
  SurfaceComplex& complex_ = prepared_.complex;
  Box<3>& scaled_box_ = prepared_.box;
  SurfaceReport& report_ = prepared_.report;
  bool are_apart_ = false;        // triangles: none meets another where they share nothing
  bool do_meet_in_side_ = false;  // triangles, in a side of the box; so it has no sides
};

}  // namespace

absl::Status CheckSurfaceFeatures(std::span<const double> points, const SurfaceFeatures& features) {
  WELLSPACE_RETURN_IF_ERROR(CheckShape(points, 3));
  if (features.corners.empty() || features.corners.size() % 3 != 0) {
    return absl::InvalidArgumentError(absl::StrCat("triangles: there are ", features.corners.size(),
                                                   " corners; expected three of each triangle, "
                                                   "and at least one triangle"));
  }
  if (!features.markers.empty() && features.markers.size() != features.triangle_count()) {
    return absl::InvalidArgumentError(absl::StrCat("markers: there are ", features.markers.size(), "; expected ",
                                                   features.triangle_count(), ", one of each triangle, or none"));
  }
  if (!(features.crease_angle >= 0 && features.crease_angle <= 180)) {
    return absl::InvalidArgumentError(
        absl::StrCat("crease_angle: expected degrees from 0 to 180, got ", features.crease_angle));
  }
  for (const auto& [name, length] :
       {std::pair("weld", features.weld), {"min_patch", features.min_patch}, {"resolution", features.resolution}}) {
    if (!(length >= 0 && std::isfinite(length))) {
      return absl::InvalidArgumentError(absl::StrCat(name, ": expected a length, 0 or more, got ", length));
    }
  }
  if (features.resolution > 0 && features.solids != SolidRule::kWinding) {
    return absl::InvalidArgumentError(absl::StrCat("resolution: it is of solids by winding alone, and it is ",
                                                   features.resolution, "; leave it out"));
  }
  if (features.box.has_value() != (features.solids == SolidRule::kBox)) {
    return absl::InvalidArgumentError(features.box.has_value()
                                          ? "box: it is of solids by box alone; leave it out, or take these"
                                          : "box: solids by box need one; expected its low corner and its high one");
  }
  for (size_t i = 0; i < features.markers.size(); ++i) {
    if (IsSideMarker(features.markers[i])) {
      return absl::InvalidArgumentError(absl::StrCat("markers[", i, "]: ", features.markers[i],
                                                     " is that of a side of a box; expected at least ",
                                                     int64_t{kFirstSideMarker} + 6));
    }
  }
  if (features.keeps_points && features.solids == SolidRule::kWinding) {
    return absl::InvalidArgumentError(
        "keep_points: what is made of triangles by winding has none of their points; leave it out, or give solids by "
        "even-odd or holes");
  }
  return absl::OkStatus();
}

absl::StatusOr<PreparedSurface> PrepareSurface(std::span<const double> points, const SurfaceFeatures& features,
                                               int threads, const RunContext& context) {
  return Preparer(points, features, threads, context).Prepare();
}

uint64_t PrepareSurfaceBytes(uint64_t points, uint64_t triangles, bool welds) {
  // The complex, beside which one step after the other works. Welding comes before it.
  const uint64_t steps = std::max({SurfaceShapeBytes(points, triangles), TrianglePairsBytes(triangles),
                                   SolidsBytes(triangles), SurfaceCurvesBytes(points, triangles)});
  const uint64_t of_point = 3 * sizeof(double) + (welds ? kMergeBytes<3> : 0);
  return points * of_point + SurfaceComplexBytes(points, triangles) + steps;
}

}  // namespace wellspace::core
