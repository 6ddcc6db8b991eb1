#include "core/validate/validate_fidelity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/union_find.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/simplex/part_numbers.h"
#include "core/validate/deviation.h"
#include "core/validate/facet_edges.h"
#include "core/validate/membership.h"
#include "core/validate/triangle_tree.h"
#include "core/validate/validate_boxed.h"
#include "core/validate/wanted_surface.h"

namespace wellspace::core {
namespace {

constexpr size_t kStepsBetweenLooks = 256;
// The rounding, as shares of the diagonal, and of the largest coordinate.
constexpr double kRounding = 1e-9;
constexpr double kRoundingOfCoordinates = 0x1p-44;
// The gap between the bound on a deviation and the largest found, relative to the tolerance.
constexpr double kResolution = 0.1;
constexpr size_t kTestedTriangles = 500;
constexpr size_t kTestedByChance = 2000;
// A curve is looked at in steps of this share of the diagonal, of which there are so many at most.
constexpr double kCurveStep = 0.004;
constexpr size_t kMostCurveSteps = size_t{1} << 18;
// An edge of facets that make an angle of this share of the crease angle may be where a curve runs.
constexpr double kCreaseShare = 0.5;

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

std::string TextOf(const Point<3>& p) { return absl::StrFormat("(%.9g, %.9g, %.9g)", p[0], p[1], p[2]); }

// A segment is a triangle of which two corners are one.
Triangle SegmentOf(const Point<3>& a, const Point<3>& b) { return {a, b, b}; }

class Comparison {
 public:
  Comparison(const MeshView& mesh, const SolidParts& parts, const SurfaceView& surface, const FidelityOptions& options,
             const RunContext& context)
      : mesh_(mesh), parts_(parts), surface_(surface), options_(options), context_(context) {}

  absl::StatusOr<FidelityReport> Compare() {
    if (!(options_.tolerance > 0) || !std::isfinite(options_.tolerance)) {
      return absl::InvalidArgumentError(absl::StrCat("tolerance: expected a length above 0, got ", options_.tolerance));
    }
    WELLSPACE_ASSIGN_OR_RETURN(wanted_, WantedSurface::Of(surface_, context_));
    report_.diagonal = wanted_.diagonal;
    const Box<3>& hull = wanted_.all.boxes().Hull();
    rounding_ = kRounding * wanted_.diagonal;
    for (int axis = 0; axis < 3; ++axis) {
      rounding_ = std::max({rounding_, kRoundingOfCoordinates * std::abs(hull.low[axis]),
                            kRoundingOfCoordinates * std::abs(hull.high[axis])});
    }
    report_.triangles = wanted_.bounding.size();
    report_.solids = static_cast<uint64_t>(std::count(wanted_.is_meshed.begin(), wanted_.is_meshed.end(), true));
    if (wanted_.bounding.empty() || facets().empty()) {
      return absl::InvalidArgumentError(wanted_.bounding.empty() ? "surface: nothing that it bounds is to be meshed"
                                                                 : "mesh: there are no facets, which bound it");
    }
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(TriangleTree::Bytes(facets().size()) * 2 +
                                                   TriangleTree::Bytes(wanted_.complex.triangles.size()) * 2 +
                                                   BoxTree<3>::Bytes(mesh_.simplices.size() / 4)));
    WELLSPACE_RETURN_IF_ERROR(tetrahedra_.Build(mesh_, context_));
    WELLSPACE_RETURN_IF_ERROR(MeasureDeviations());
    WELLSPACE_RETURN_IF_ERROR(TestPoints());
    WELLSPACE_RETURN_IF_ERROR(TestSeeds());
    TestDeviations();
    WELLSPACE_RETURN_IF_ERROR(TestVolumes());
    WELLSPACE_RETURN_IF_ERROR(TestTags());
    WELLSPACE_RETURN_IF_ERROR(TestEdges());
    WELLSPACE_RETURN_IF_ERROR(TestBox());
    return std::move(report_);
  }

 private:
  std::span<const uint32_t> facets() const { return parts_.domain.boundary.facets; }
  std::span<const int32_t> tags() const { return parts_.domain.boundary.tags; }
  Point<3> At(uint32_t vertex) const { return PointAt<3>(mesh_.points, vertex); }
  Triangle FacetAt(size_t f) const { return {At(facets()[3 * f]), At(facets()[3 * f + 1]), At(facets()[3 * f + 2])}; }
  double Rounding() const { return rounding_; }
  absl::Status Look(size_t step) const { return step % kStepsBetweenLooks == 0 ? context_.Check() : absl::OkStatus(); }

  // The first violation is told.
  void Fault(const std::string& what) {
    if (report_.verdict.ok()) {
      report_.verdict = absl::FailedPreconditionError(what);
    }
  }

  absl::Status MeasureDeviations() {
    std::vector<Triangle> own;
    for (size_t f = 0; f < facets().size() / 3; ++f) {
      own.push_back(FacetAt(f));
    }
    WELLSPACE_RETURN_IF_ERROR(facet_tree_.Build(std::move(own), context_));
    const double resolution = kResolution * options_.tolerance;
    WELLSPACE_ASSIGN_OR_RETURN(report_.of_facets,
                               MeasureDeviation(facet_tree_.triangles(), wanted_.around, resolution, context_));
    WELLSPACE_ASSIGN_OR_RETURN(report_.of_surface,
                               MeasureDeviation(wanted_.around.triangles(), facet_tree_, resolution, context_));
    report_.of_surface.triangle = wanted_.complex.sources[wanted_.bounding[report_.of_surface.triangle]];
    return absl::OkStatus();
  }

  // Whether `p` is meshed where it should be; points are passed over that are no farther from the surface than facets.
  void TestPoint(const Point<3>& p) {
    const double reach = report_.of_facets.at_most + Rounding();
    if (!tetrahedra_.Find(p, found_)) {
      return;
    }
    if (found_.size() > 1) {
      Fault(absl::StrCat("tetrahedra ", found_[0], " and ", found_[1], " overlap at the point ", TextOf(p)));
    }
    if (wanted_.all.Nearest(p, kNone).distance_sq <= reach * reach) {
      return;
    }
    const std::optional<RayHits> hits = ShootRay(p, wanted_.all);
    const std::optional<uint32_t> solid = wanted_.SolidAt(p);
    if (!hits.has_value() || !solid.has_value()) {
      return;
    }
    ++report_.tested_points;
    const bool is_wanted = surface_.features.solids == SolidRule::kEvenOdd && surface_.features.seeds.empty()
                               ? hits->count % 2 != 0
                               : wanted_.is_meshed[*solid];
    if (is_wanted && found_.empty()) {
      Fault(absl::StrCat("the point ", TextOf(p), " lies in a solid that is meshed, but in no tetrahedron"));
    } else if (!is_wanted && !found_.empty()) {
      Fault(absl::StrCat("the point ", TextOf(p), " lies outside of what is meshed, but in tetrahedron ", found_[0]));
    }
  }

  absl::Status TestPoints() {
    const double off = std::max(2 * report_.of_facets.at_most, 1e-3 * wanted_.diagonal);
    const size_t step = std::max<size_t>(1, wanted_.bounding.size() / kTestedTriangles);
    for (size_t i = 0; i < wanted_.bounding.size(); i += step) {
      WELLSPACE_RETURN_IF_ERROR(Look(i / step));
      const Triangle& t = wanted_.around.triangles()[i];
      const Point<3> normal = NormalOf(t);
      const double share = off / std::sqrt(NormSq<3>(normal));
      for (const double side : {-share, share}) {
        Point<3> p = MiddleOf(t);
        for (int axis = 0; axis < 3; ++axis) {
          p[axis] += side * normal[axis];
        }
        TestPoint(p);
      }
    }
    const Box<3>& hull = wanted_.all.boxes().Hull();
    uint64_t state = 1;
    for (size_t i = 0; i < kTestedByChance; ++i) {
      WELLSPACE_RETURN_IF_ERROR(Look(i));
      Point<3> p;
      for (int axis = 0; axis < 3; ++axis) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        const double unit = static_cast<double>(state >> 11) * 0x1p-53;
        p[axis] = hull.low[axis] + (1.1 * unit - 0.05) * (hull.high[axis] - hull.low[axis]);
      }
      TestPoint(p);
    }
    return absl::OkStatus();
  }

  absl::Status TestSeeds() {
    for (size_t i = 0; i < surface_.features.seeds.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(Look(i));
      const SolidSeed& seed = surface_.features.seeds[i];
      if (!tetrahedra_.Find(seed.at, found_)) {
        continue;
      }
      if (seed.is_hole && !found_.empty()) {
        Fault(absl::StrCat("the hole at ", TextOf(seed.at), " is meshed: it lies in tetrahedron ", found_[0]));
      }
      if (seed.is_hole || found_.empty() || !options_.checks_regions || parts_.domain.regions.empty()) {
        continue;
      }
      const int32_t region = parts_.domain.regions[found_[0]];
      const auto name = parts_.domain.region_names.find(region);
      const std::string wanted = RegionName(seed.region);
      if (region != seed.region && (name == parts_.domain.region_names.end() || name->second != wanted)) {
        Fault(absl::StrCat("tetrahedron ", found_[0], " has the region ", region, ", but the point ", TextOf(seed.at),
                           " in it is of region ", seed.region));
      }
    }
    return absl::OkStatus();
  }

  void TestDeviations() {
    const double most = options_.tolerance + Rounding();
    if (report_.of_facets.found > most) {
      Fault(absl::StrFormat("facet %d is %g away from the surface at %s; at most %g is allowed",
                            report_.of_facets.triangle, report_.of_facets.found, TextOf(report_.of_facets.at),
                            options_.tolerance));
    }
    if (report_.of_surface.found > most) {
      const std::string what = report_.of_surface.triangle == SurfaceComplex::kNoSource
                                   ? "a side of the box"
                                   : absl::StrCat("triangle ", report_.of_surface.triangle, " of the surface");
      Fault(absl::StrFormat("%s is %g away from all facets at %s; at most %g is allowed", what,
                            report_.of_surface.found, TextOf(report_.of_surface.at), options_.tolerance));
    }
  }

  // The volume of the tetrahedra of each solid.
  absl::StatusOr<std::vector<double>> VolumesOfSolids() {
    UnionFind pieces(mesh_.simplices.size() / 4);
    WELLSPACE_RETURN_IF_ERROR(JoinPieces(pieces));
    const uint32_t count = static_cast<uint32_t>(pieces.size());
    std::vector<double> volume_of(count);
    std::vector<double> largest(count);
    std::vector<uint32_t> inside(count);  // the largest tetrahedron of a piece
    for (uint32_t s = 0; s < count; ++s) {
      const Simplex<3> c = tetrahedra_.At(s);
      const double volume =
          Dot<3>(Difference<3>(c[1], c[0]), Cross(Difference<3>(c[2], c[0]), Difference<3>(c[3], c[0]))) / 6;
      const uint32_t piece = pieces.Find(s);
      volume_of[piece] += volume;
      if (volume > largest[piece]) {
        largest[piece] = volume;
        inside[piece] = s;
      }
    }
    std::vector<double> volumes(wanted_.solids.count);
    for (uint32_t piece = 0; piece < count; ++piece) {
      if (pieces.Find(piece) != piece) {
        continue;
      }
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const Simplex<3> c = tetrahedra_.At(inside[piece]);
      Point<3> middle{};
      for (const Point<3>& corner : c) {
        for (int axis = 0; axis < 3; ++axis) {
          middle[axis] += 0.25 * corner[axis];
        }
      }
      volumes[wanted_.SolidAt(middle).value_or(0)] += volume_of[piece];
    }
    return volumes;
  }

  // Joins tetrahedra at faces that are no facets.
  absl::Status JoinPieces(UnionFind& pieces) const {
    struct Face {
      std::array<uint32_t, 3> vertices;
      uint32_t tetrahedron;
    };
    std::vector<Face> faces;
    const auto add = [&](std::array<uint32_t, 3> vertices, uint32_t tetrahedron) {
      std::sort(vertices.begin(), vertices.end());
      faces.push_back({vertices, tetrahedron});
    };
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(2 * sizeof(Face) * mesh_.simplices.size()));
    for (uint32_t s = 0; s < mesh_.simplices.size() / 4; ++s) {
      const auto c = mesh_.simplices.subspan(4 * size_t{s}, 4);
      add({c[1], c[2], c[3]}, s);
      add({c[0], c[2], c[3]}, s);
      add({c[0], c[1], c[3]}, s);
      add({c[0], c[1], c[2]}, s);
    }
    for (size_t f = 0; f < facets().size(); f += 3) {
      add({facets()[f], facets()[f + 1], facets()[f + 2]}, kNone);
    }
    const auto before = [](const Face& a, const Face& b) {
      return a.vertices != b.vertices ? a.vertices < b.vertices : a.tetrahedron < b.tetrahedron;
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(faces, before, context_));
    for (size_t i = 0; i + 1 < faces.size(); ++i) {
      const bool is_pair = faces[i].vertices == faces[i + 1].vertices && faces[i + 1].tetrahedron != kNone;
      const bool is_facet = i + 2 < faces.size() && faces[i + 2].vertices == faces[i].vertices;
      if (is_pair && !is_facet) {
        pieces.Join(faces[i].tetrahedron, faces[i + 1].tetrahedron);
      }
    }
    return absl::OkStatus();
  }

  absl::Status TestVolumes() {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> volumes, VolumesOfSolids());
    std::vector<double> areas(wanted_.solids.count);
    for (const uint32_t t : wanted_.bounding) {
      const Triangle corners = wanted_.complex.TriangleAt(t);
      const double area = AreaOf(corners);
      areas[wanted_.solids.solid_of[HalfFacetOf(t, false)]] += area;
      areas[wanted_.solids.solid_of[HalfFacetOf(t, true)]] += area;
    }
    const double deviation = std::max(report_.of_facets.at_most, report_.of_surface.at_most) + Rounding();
    for (uint32_t solid = 1; solid < volumes.size(); ++solid) {
      const double wanted = wanted_.is_meshed[solid] ? wanted_.solids.volumes[solid] : 0;
      const double off = std::abs(volumes[solid] - wanted);
      report_.worst_volume = std::max(report_.worst_volume, off);
      // Facets bend in and out by no more than that; twice, since they may be longer than the surface.
      if (off > 2 * areas[solid] * deviation + 1e-12 * wanted_.solids.volumes[solid]) {
        Fault(absl::StrFormat("solid %d has the volume %g, but its tetrahedra have %g", solid, wanted, volumes[solid]));
      }
    }
    if (volumes[0] > 2 * areas[0] * deviation) {
      Fault(absl::StrFormat("tetrahedra with a volume of %g lie outside of all solids", volumes[0]));
    }
    return absl::OkStatus();
  }

  absl::Status TestTags() {
    if (tags().empty() || !options_.checks_tags) {
      return absl::OkStatus();
    }
    const double reach = report_.of_facets.at_most + Rounding();
    uint32_t near = 0;
    for (size_t f = 0; f < tags().size(); ++f) {
      WELLSPACE_RETURN_IF_ERROR(Look(f));
      const auto marker = wanted_.marker_of.find(tags()[f]);
      if (marker == wanted_.marker_of.end()) {
        Fault(absl::StrCat("facet ", f, " has the tag ", tags()[f], ", which no triangle of the surface has"));
        return absl::OkStatus();
      }
      const auto is_of_tag = [&](uint32_t i) { return wanted_.complex.markers[wanted_.bounding[i]] == marker->second; };
      const Triangle corners = FacetAt(f);
      for (const Point<3>& p : {MiddleOf(corners), corners[0], corners[1], corners[2]}) {
        const NearTriangle found = wanted_.around.Nearest(p, near, is_of_tag);
        near = found.triangle;
        if (found.distance_sq > reach * reach) {
          Fault(
              absl::StrFormat("facet %d has the tag %d, but the nearest triangle with it is %g away at %s; facets are "
                              "at most %g from the surface",
                              f, tags()[f], std::sqrt(found.distance_sq), TextOf(p), reach));
          return absl::OkStatus();
        }
      }
    }
    return absl::OkStatus();
  }

  // Whether an edge of facets may be one of a curve.
  bool MayBeRidge(std::span<const FacetSide> sides) const {
    if (sides.size() != 2 || (!tags().empty() && tags()[sides[0].facet] != tags()[sides[1].facet])) {
      return true;
    }
    const Point<3> from = At(sides[0].ends[0]);
    const Point<3> along = Difference<3>(At(sides[0].ends[1]), from);
    const double angle = AngleBetween(Cross(along, Difference<3>(At(sides[0].apex), from)),
                                      Cross(along, Difference<3>(At(sides[1].apex), from)));
    return 180 - angle >= kCreaseShare * surface_.features.crease_angle;
  }

  // Holds the mesh to its box, and to the triangles before they are cut.
  absl::Status TestBox() {
    if (!surface_.features.box.has_value()) {
      return absl::OkStatus();
    }
    const absl::Status boxed = ValidateBoxedMesh(mesh_, parts_, surface_, options_, context_);
    if (boxed.code() != absl::StatusCode::kFailedPrecondition) {
      return boxed;
    }
    Fault(std::string(boxed.message()));
    return absl::OkStatus();
  }

  absl::Status TestEdges() {
    WELLSPACE_ASSIGN_OR_RETURN(const FacetEdges edges, FacetEdges::Of(facets(), context_));
    std::vector<Triangle> ridges;
    std::vector<std::array<uint32_t, 2>> odd;
    edges.ForEach([&](std::span<const FacetSide> sides) {
      if (sides.size() != 2) {
        odd.push_back(sides[0].ends);
      }
      if (parts_.ridges.empty() && MayBeRidge(sides)) {
        ridges.push_back(SegmentOf(At(sides[0].ends[0]), At(sides[0].ends[1])));
      }
    });
    for (size_t r = 0; r < parts_.ridges.size(); r += 2) {
      ridges.push_back(SegmentOf(At(parts_.ridges[r]), At(parts_.ridges[r + 1])));
    }
    WELLSPACE_RETURN_IF_ERROR(TestOddEdges(odd));
    TriangleTree tree;
    WELLSPACE_RETURN_IF_ERROR(tree.Build(std::move(ridges), context_));
    WELLSPACE_RETURN_IF_ERROR(TestCurves(tree));
    return TestCorners();
  }

  absl::Status TestOddEdges(const std::vector<std::array<uint32_t, 2>>& odd) {
    std::vector<Triangle> wanted;
    for (const auto& [a, b] : wanted_.odd_edges) {
      wanted.push_back(SegmentOf(wanted_.complex.points[a], wanted_.complex.points[b]));
    }
    TriangleTree tree;
    WELLSPACE_RETURN_IF_ERROR(tree.Build(std::move(wanted), context_));
    const double most = options_.tolerance + Rounding();
    for (size_t i = 0; i < odd.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(Look(i));
      const Point<3> middle = Between(At(odd[i][0]), At(odd[i][1]), 0.5);
      if (tree.Nearest(middle, kNone).distance_sq > most * most) {
        Fault(absl::StrCat("the edge of vertices ", odd[i][0], " and ", odd[i][1],
                           " has one facet or more than two, but the surface is closed and without branches at ",
                           TextOf(middle)));
        return absl::OkStatus();
      }
    }
    return absl::OkStatus();
  }

  absl::Status TestCurves(const TriangleTree& ridges) {
    const double most = options_.tolerance + Rounding();
    const double step = kCurveStep * wanted_.diagonal;
    uint32_t near = kNone;
    size_t steps = 0;
    for (const auto& [a, b] : wanted_.curve_edges) {
      const Point<3>& p = wanted_.complex.points[a];
      const Point<3>& q = wanted_.complex.points[b];
      const double length = Distance<3>(p, q);
      const auto parts = static_cast<size_t>(std::max(1.0, std::ceil(length / step)));
      report_.curves += length;
      for (size_t i = 0; i < parts && steps < kMostCurveSteps; ++i) {
        WELLSPACE_RETURN_IF_ERROR(Look(++steps));
        const Point<3> at = Between(p, q, (static_cast<double>(i) + 0.5) / static_cast<double>(parts));
        const NearTriangle found = ridges.Nearest(at, near);
        near = found.triangle;
        if (found.distance_sq > most * most) {
          report_.lost_curves += length / static_cast<double>(parts);
          report_.lost_at = at;
        }
      }
    }
    if (report_.lost_curves > 0) {
      Fault(absl::StrFormat("no ridge runs along curves of the surface for a length of %g of %g, as at %s",
                            report_.lost_curves, report_.curves, TextOf(report_.lost_at)));
    }
    return absl::OkStatus();
  }

  // Whether points of the complex are among the vertices of facets, as far as welding may have moved them.
  absl::Status TestVertices(const TriangleTree& vertices, std::span<const uint32_t> points, const char* what) {
    const double most = surface_.features.weld + Rounding();
    for (size_t i = 0; i < points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(Look(i));
      const Point<3>& p = wanted_.complex.points[points[i]];
      if (const double distance_sq = vertices.Nearest(p, kNone).distance_sq; distance_sq > most * most) {
        Fault(absl::StrFormat("%s %s of the surface is no vertex; the nearest is %g away", what, TextOf(p),
                              std::sqrt(distance_sq)));
        return absl::OkStatus();
      }
    }
    return absl::OkStatus();
  }

  absl::Status TestCorners() {
    std::vector<Triangle> vertices;
    for (const uint32_t v : facets()) {
      vertices.push_back(SegmentOf(At(v), At(v)));
    }
    TriangleTree tree;
    WELLSPACE_RETURN_IF_ERROR(tree.Build(std::move(vertices), context_));
    WELLSPACE_RETURN_IF_ERROR(TestVertices(tree, wanted_.corners, "the corner"));
    if (!surface_.features.keeps_points) {
      return absl::OkStatus();
    }
    std::vector<bool> is_given(wanted_.complex.points.size());  // not where a side of a box cuts an edge
    for (const uint32_t point : wanted_.complex.point_of_input) {
      if (point != SurfaceComplex::kNoPoint) {
        is_given[point] = true;
      }
    }
    std::vector<uint32_t> kept;
    for (const uint32_t t : wanted_.bounding) {
      for (const uint32_t point : wanted_.complex.triangles[t]) {
        if (is_given[point]) {
          kept.push_back(point);
        }
      }
    }
    return TestVertices(tree, kept, "the point");
  }

  const MeshView& mesh_;
  const SolidParts& parts_;
  const SurfaceView& surface_;
  const FidelityOptions& options_;
  const RunContext& context_;
  WantedSurface wanted_;
  TetrahedronTree tetrahedra_;
  TriangleTree facet_tree_;
  std::vector<uint32_t> found_;  // tetrahedra
  FidelityReport report_;
  double rounding_ = 0;  // a bound on the rounding error of a place
};

}  // namespace

absl::StatusOr<FidelityReport> CompareWithSurface(const MeshView& mesh, const SolidParts& parts,
                                                  const SurfaceView& surface, const FidelityOptions& options,
                                                  const RunContext& context) {
  return Comparison(mesh, parts, surface, options, context).Compare();
}

}  // namespace wellspace::core
