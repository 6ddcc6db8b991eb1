#include "core/validate/wanted_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/boxed_surface.h"
#include "core/validate/membership.h"

namespace wellspace::core {
namespace {

// A place where a side of a box is crossed is put onto another side that is as near, as a share of coordinates.
constexpr double kRoundingOfCut = 0x1p-44;

constexpr double kSmallPatch = 0.01;  // of the diagonal, where no length is given

// The point that each point becomes where points within `weld` are one: along the first axis, the first that is near. A
// mesher's own welding may choose another of those, which is no farther away.
absl::StatusOr<std::vector<uint32_t>> Welded(std::span<const double> points, double weld, const RunContext& context) {
  std::vector<uint32_t> order(points.size() / 3);
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&](uint32_t i, uint32_t k) { return PointAt<3>(points, i) < PointAt<3>(points, k); };
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(order, before, context));
  std::vector<uint32_t> place_of(order.size(), std::numeric_limits<uint32_t>::max());
  for (size_t i = 0; i < order.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    if (place_of[order[i]] != std::numeric_limits<uint32_t>::max()) {
      continue;
    }
    const Point<3> p = PointAt<3>(points, order[i]);
    place_of[order[i]] = order[i];
    for (size_t k = i + 1; k < order.size() && points[3 * size_t{order[k]}] - p[0] <= weld; ++k) {
      if (place_of[order[k]] == std::numeric_limits<uint32_t>::max() &&
          DistanceSq<3>(p, PointAt<3>(points, order[k])) <= weld * weld) {
        place_of[order[k]] = order[i];
      }
    }
  }
  return place_of;
}

// Tags as the proto's BoundaryPart has them: markers above 0 are tags, others have the lowest numbers that are left.
std::map<int32_t, int32_t> MarkersByTag(const std::set<int32_t>& markers) {
  std::map<int32_t, int32_t> marker_of;
  for (const int32_t marker : markers) {
    if (marker > 0) {
      marker_of[marker] = marker;
    }
  }
  int32_t next = 1;
  for (const int32_t marker : markers) {
    while (marker <= 0 && marker_of.contains(next)) {
      ++next;
    }
    if (marker <= 0) {
      marker_of[next] = marker;
    }
  }
  return marker_of;
}

class WantedFinder {
 public:
  WantedFinder(const SurfaceView& surface, const RunContext& context) : surface_(surface), context_(context) {}

  absl::StatusOr<WantedSurface> Find() {
    const size_t triangles = surface_.features.triangle_count();
    if (surface_.points.size() < 9 || triangles == 0) {
      return absl::InvalidArgumentError("surface: there are no triangles");
    }
    if (surface_.features.solids == SolidRule::kWinding) {
      return absl::InvalidArgumentError(
          "solids: meshes are held to triangles that bound solids, by even-odd or holes; those of winding bound none");
    }
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(
        SurfaceComplexBytes(surface_.points.size() / 3, triangles) + SolidsBytes(triangles) +
        SurfaceCurvesBytes(surface_.points.size() / 3, triangles) + 2 * TriangleTree::Bytes(triangles)));
    std::vector<uint32_t> place_of;
    if (surface_.features.weld > 0) {
      WELLSPACE_ASSIGN_OR_RETURN(place_of, Welded(surface_.points, surface_.features.weld, context_));
    }
    WELLSPACE_ASSIGN_OR_RETURN(out_.complex,
                               MakeSurfaceComplex(surface_.points, place_of, surface_.features, context_));
    if (out_.complex.triangles.empty()) {
      return absl::InvalidArgumentError("surface: no triangle has an area");
    }
    if (surface_.features.box.has_value()) {
      WELLSPACE_RETURN_IF_ERROR(Cut());
    }
    WELLSPACE_ASSIGN_OR_RETURN(out_.solids, FindSolids(out_.complex, context_));
    std::vector<Triangle> all;
    for (uint32_t t = 0; t < out_.complex.triangles.size(); ++t) {
      all.push_back(out_.complex.TriangleAt(t));
    }
    WELLSPACE_RETURN_IF_ERROR(out_.all.Build(std::move(all), context_));
    const Box<3>& hull = out_.all.boxes().Hull();
    out_.diagonal = Distance<3>(hull.low, hull.high);
    WELLSPACE_RETURN_IF_ERROR(FindMeshed());
    WELLSPACE_RETURN_IF_ERROR(FindBounding());
    WELLSPACE_RETURN_IF_ERROR(FindLines());
    return std::move(out_);
  }

 private:
  // Has the parts of triangles in the box and its sides be the complex.
  absl::Status Cut() {
    const Box<3>& box = *surface_.features.box;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      largest = std::max({largest, std::abs(box.low[axis]), std::abs(box.high[axis])});
    }
    const double weld = surface_.features.weld;
    WELLSPACE_ASSIGN_OR_RETURN(
        BoxedSurface boxed, CutAtBox(out_.complex, box, weld, std::max(weld, kRoundingOfCut * largest), 0, context_));
    if (boxed.do_meet || boxed.complex.triangles.empty()) {
      return absl::InvalidArgumentError(boxed.do_meet ? "surface: triangles meet in a side of the box"
                                                      : "surface: no triangle has a part with an area in the box");
    }
    out_.complex = std::move(boxed.complex);
    return absl::OkStatus();
  }

  absl::Status FindMeshed() {
    out_.is_meshed.assign(out_.solids.count, true);
    out_.is_meshed[0] = false;
    if (surface_.features.solids == SolidRule::kEvenOdd) {
      out_.is_meshed = out_.solids.is_odd;
    }
    for (const SolidSeed& seed : surface_.features.seeds) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const std::optional<uint32_t> solid = seed.is_hole ? out_.SolidAt(seed.at) : std::nullopt;
      if (solid.has_value()) {
        out_.is_meshed[*solid] = false;
      }
    }
    return absl::OkStatus();
  }

  bool Bounds(uint32_t t) const {
    return out_.is_meshed[out_.solids.solid_of[HalfFacetOf(t, false)]] ||
           out_.is_meshed[out_.solids.solid_of[HalfFacetOf(t, true)]];
  }

  absl::Status FindBounding() {
    std::vector<Triangle> around;
    std::set<int32_t> markers;
    for (uint32_t t = 0; t < out_.complex.triangles.size(); ++t) {
      if (Bounds(t)) {
        out_.bounding.push_back(t);
        around.push_back(out_.complex.TriangleAt(t));
        markers.insert(out_.complex.markers[t]);
      }
    }
    out_.marker_of = MarkersByTag(markers);
    return out_.around.Build(std::move(around), context_);
  }

  absl::Status FindLines() {
    const SurfaceFeatures& features = surface_.features;
    WELLSPACE_ASSIGN_OR_RETURN(
        const SurfaceCurves curves,
        FindCurves(out_.complex, features.crease_angle,
                   features.min_patch > 0 ? features.min_patch : kSmallPatch * out_.diagonal, context_));
    std::set<std::array<uint32_t, 2>> on_curves;
    for (size_t c = 0; c < curves.curve_count(); ++c) {
      const std::span<const uint32_t> points = curves.PointsOf(c);
      for (size_t i = 0; i + 1 < points.size(); ++i) {
        on_curves.insert({std::min(points[i], points[i + 1]), std::max(points[i], points[i + 1])});
      }
    }
    std::vector<bool> is_around(out_.complex.points.size());
    for (uint32_t edge = 0; edge < out_.complex.edges.size(); ++edge) {
      const std::span<const TriangleSide> sides = out_.complex.SidesAt(edge);
      const auto bounding =
          std::count_if(sides.begin(), sides.end(), [&](TriangleSide side) { return Bounds(TriangleOf(side)); });
      if (bounding == 0) {
        continue;
      }
      const std::array<uint32_t, 2>& ends = out_.complex.edges[edge];
      is_around[ends[0]] = is_around[ends[1]] = true;
      if (bounding != 2) {
        out_.odd_edges.push_back(ends);
      }
      if (on_curves.contains(ends)) {
        out_.curve_edges.push_back(ends);
      }
    }
    for (const uint32_t corner : curves.corners) {
      if (is_around[corner]) {
        out_.corners.push_back(corner);
      }
    }
    return context_.Check();
  }

  const SurfaceView& surface_;
  const RunContext& context_;
  WantedSurface out_;
};

}  // namespace

std::optional<uint32_t> WantedSurface::SolidAt(const Point<3>& p) const {
  const std::optional<RayHits> hits = ShootRay(p, all);
  if (!hits.has_value()) {
    return std::nullopt;
  }
  return hits->count == 0 ? 0 : solids.solid_of[HalfFacetOf(hits->first, !hits->first_in_front)];
}

absl::StatusOr<WantedSurface> WantedSurface::Of(const SurfaceView& surface, const RunContext& context) {
  return WantedFinder(surface, context).Find();
}

}  // namespace wellspace::core
