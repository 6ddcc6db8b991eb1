#include "core/input/space_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/input/mesh_parameters.h"
#include "core/input/prepared_surface.h"
#include "core/input/space_parameters.h"
#include "core/refine/space/crease_sampler.h"

namespace wellspace::core {
namespace {

// An angle that is smaller by no more than this has been rounded. Unit: degrees.
constexpr double kAngleTolerance = 1e-6;

// The first vertices of a patch that no curve bounds.
constexpr size_t kSeedsOfPatch = 8;

// The least number of parts that a loop begins with.
constexpr size_t kPartsOfLoop = 3;
// The least number of parts of a loop through a corner.
constexpr size_t kPartsOfCornerLoop = 4;

std::string PlaceText(const Point<3>& p) { return absl::StrFormat("(%.6g, %.6g, %.6g)", p[0], p[1], p[2]); }

// Puts the first vertices on a surface, and sorts them with the given points that are vertices.
class CloudMaker {
 public:
  CloudMaker(std::span<const double> points, const SurfaceFeatures& features, double curve_edge, double tolerance,
             uint64_t max_vertices, int threads, const RunContext& context)
      : points_(points),
        features_(features),
        curve_edge_(curve_edge),
        tolerance_(tolerance),
        max_vertices_(max_vertices),
        threads_(threads),
        context_(context) {}

  absl::StatusOr<SpaceCloud> Make() {
    WELLSPACE_ASSIGN_OR_RETURN(PreparedSurface prepared, PrepareSurface(points_, features_, threads_, context_));
    if (!prepared.report.faults.empty()) {
      return ErrorOf(prepared.report.faults.front());
    }
    frame_ = prepared.frame;
    figures_.report = std::move(prepared.report);
    curve_edge_ *= frame_.scale;
    domain_ = std::make_unique<SpatialDomain>(std::move(prepared.complex), std::move(prepared.solids),
                                              std::move(prepared.curves));
    WELLSPACE_ASSIGN_OR_RETURN(const CreaseAngles angles, MeasureCreases(*domain_, context_));
    WELLSPACE_RETURN_IF_ERROR(CheckAngles(angles));
    WELLSPACE_RETURN_IF_ERROR(domain_->BuildIndex(MortonGrid<3>(frame_.scaled_box), context_));
    WELLSPACE_RETURN_IF_ERROR(TakeCreases(angles));
    if (features_.keeps_points) {
      WELLSPACE_RETURN_IF_ERROR(CheckKeeping(angles));
    }
    WELLSPACE_RETURN_IF_ERROR(FindRoles());
    WELLSPACE_RETURN_IF_ERROR(TakePoints());
    WELLSPACE_RETURN_IF_ERROR(SampleCurves());
    WELLSPACE_RETURN_IF_ERROR(SeedPatches());
    return Sort();
  }

 private:
  // A first vertex: not scaled, and the given point that it is, or else is named by in errors.
  struct First {
    Point<3> at{};
    SpacePlace place;
    uint32_t input = 0;
    bool is_input = false;
  };

  const SurfaceComplex& complex() const { return domain_->complex(); }
  const SurfaceCurves& curves() const { return domain_->curves(); }

  absl::Status AcuteError(const char* what, double angle, const Point<3>& at) const {
    return absl::InvalidArgumentError(
        absl::StrFormat("triangles: two %s meet at %.4g degrees at %s; expected at least %g degrees: round the edge "
                        "off, or raise crease_angle where it is none",
                        what, angle, PlaceText(frame_.Unscaled(at)), kLeastAngle));
  }

  // Refuses curves at which two patches meet at too small an angle, and corners that two curves leave so.
  absl::Status CheckAngles(const CreaseAngles& angles) const {
    for (const PlacedAngle& of : angles.of_curves) {
      if (of.angle < kLeastAngle - kAngleTolerance) {
        return AcuteError("patches", of.angle, of.at);
      }
    }
    for (uint32_t corner = 0; corner < angles.of_corners.size(); ++corner) {
      const PlacedAngle& of = angles.of_corners[corner];
      if (of.angle < kLeastAngle - kAngleTolerance) {
        return AcuteError(domain_->EndsAt(corner).empty() ? "sides of a cone" : "curves", of.angle, of.at);
      }
    }
    return absl::OkStatus();
  }

  // Finds which solids are meshed, and their regions.
  absl::Status FindRoles() {
    const Solids& solids = domain_->solids();
    std::vector<SolidRole>& roles = domain_->roles();
    for (uint32_t solid = 1; solid < solids.count; ++solid) {
      roles[solid].is_meshed = MeshesAllBounded(features_.solids) || solids.is_odd[solid];
    }
    bool has_regions = false;
    std::vector<uint32_t> solid_of_seed;
    for (size_t i = 0; i < features_.seeds.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      const SolidSeed& seed = features_.seeds[i];
      const uint32_t solid = domain_->index().SolidAt(frame_.Scaled(seed.at));
      solid_of_seed.push_back(solid);
      if (seed.is_hole) {
        NoteUnused(i, !roles[solid].is_meshed);
      }
      has_regions = has_regions || !seed.is_hole;
    }
    for (size_t i = 0; i < features_.seeds.size(); ++i) {
      roles[solid_of_seed[i]].is_meshed = roles[solid_of_seed[i]].is_meshed && !features_.seeds[i].is_hole;
    }
    for (size_t i = 0; i < features_.seeds.size(); ++i) {
      const SolidSeed& seed = features_.seeds[i];
      SolidRole& role = roles[solid_of_seed[i]];
      if (!seed.is_hole && role.is_meshed) {
        role.region = seed.region;
        const double scale = frame_.scale;
        role.max_volume = std::min(role.max_volume, seed.max_volume * scale * scale * scale);
      } else if (!seed.is_hole) {
        NoteUnused(i, true);
      }
    }
    figures_.report.volume = 0;
    for (uint32_t solid = 1; solid < solids.count; ++solid) {
      *figures_.report.volume += roles[solid].is_meshed ? figures_.report.solids[solid - 1] : 0;
    }
    for (SolidRole& role : roles) {
      figures_.solids += role.is_meshed ? 1 : 0;
      role.region = !has_regions && role.is_meshed ? static_cast<int32_t>(figures_.solids) : role.region;
    }
    for (SolidRole& role : roles) {
      role.region = !has_regions && figures_.solids == 1 ? 0 : role.region;
    }
    if (figures_.solids == 0) {
      return absl::InvalidArgumentError("triangles: no solid is meshed: each has a hole; expected a solid without one");
    }
    return FindMeshedBox();
  }

  void NoteUnused(size_t seed, bool is_unused) {
    if (is_unused) {
      figures_.first_unused_seed =
          figures_.unused_seeds == 0 ? seed : std::min<uint64_t>(figures_.first_unused_seed, seed);
      ++figures_.unused_seeds;
    }
  }

  absl::Status FindMeshedBox() {
    bool is_first = true;
    for (uint32_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const std::vector<uint32_t>& solid_of = domain_->solids().solid_of;
      if (domain_->IsMeshed(solid_of[HalfFacetOf(t, false)]) || domain_->IsMeshed(solid_of[HalfFacetOf(t, true)])) {
        const Box<3> box = BoxOfTriangle(complex().TriangleAt(t));
        meshed_box_ = is_first ? box : meshed_box_;
        meshed_box_.Include(box);
        is_first = false;
      }
    }
    meshed_box_ = {frame_.Unscaled(meshed_box_.low), frame_.Unscaled(meshed_box_.high)};
    return absl::OkStatus();
  }

  // Finds acute curves and corners, and puts collar points, strands and shields around them.
  absl::Status TakeCreases(const CreaseAngles& angles) {
    const double tolerance =
        tolerance_ > 0 ? tolerance_
                       : DefaultToleranceOf(features_, Distance<3>(figures_.report.box.low, figures_.report.box.high));
    CurveDemands demands;
    demands.edge = curve_edge_;
    demands.tolerance = tolerance * frame_.scale;
    demands.min_size = 0.5 * demands.tolerance;
    demands.max_vertices = max_vertices_;
    WELLSPACE_ASSIGN_OR_RETURN(AcuteCreases creases, SampleCreases(*domain_, angles, demands, context_));
    domain_->TakeCreases(std::move(creases));
    return absl::OkStatus();
  }

  // Vertices around acute creases have places of their own, where given points would be in their way.
  absl::Status CheckKeeping(const CreaseAngles& angles) const {
    if (domain_->creases().IsEmpty()) {
      return absl::OkStatus();
    }
    const PlacedAngle* sharpest = nullptr;
    for (const std::vector<PlacedAngle>* const some : {&angles.of_curves, &angles.of_corners}) {
      for (const PlacedAngle& of : *some) {
        sharpest = sharpest == nullptr || of.angle < sharpest->angle ? &of : sharpest;
      }
    }
    return absl::InvalidArgumentError(
        absl::StrFormat("keep_points: the surface is sharp, %.4g degrees at %s; expected at least %g degrees "
                        "everywhere, or leave it out",
                        sharpest->angle, PlaceText(frame_.Unscaled(sharpest->at)), kAcuteAngle));
  }

  // Finds the places of the points that triangles at meshed solids have for corners, but for corners of curves.
  absl::Status FindKept() {
    const uint64_t held = domain_->MemoryBytes() + complex().points.size() * sizeof(SpacePlace);
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held));
    place_of_kept_.resize(complex().points.size());
    uint64_t count = 0;
    const auto keep = [&](uint32_t point, const SpacePlace& place) {
      count += place_of_kept_[point].IsOnSurface() ? 0 : 1;
      place_of_kept_[point] = place;
    };
    for (uint32_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const SpacePlace place{SpacePlace::Kind::kPatch, curves().patch_of[t], 0};
      if (domain_->IsMeshedAt(place)) {
        for (const uint32_t point : complex().triangles[t]) {
          keep(point, place);
        }
      }
    }
    for (uint32_t curve = 0; curve < domain_->curve_count(); ++curve) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(curve, context_));
      const std::span<const uint32_t> points = curves().PointsOf(curve);
      for (size_t i = 0; i + 1 < points.size(); ++i) {
        const SpacePlace place{SpacePlace::Kind::kCurve, curve, domain_->ArcsOf(curve)[i]};
        if (domain_->IsMeshedAt(place)) {
          keep(points[i], place);
        }
      }
    }
    if (count > max_vertices_) {
      return absl::ResourceExhaustedError(absl::StrCat("keep_points: triangles at meshed solids have ", count,
                                                       " points for corners, more than max_vertices = ", max_vertices_,
                                                       "; raise it, or leave keep_points out"));
    }
    return context_.AllowMemory(held + count * kBytesOfFirst);
  }

  // Takes the given points that are vertices: corners, points on no triangle in a solid that is meshed, and those that
  // are kept.
  absl::Status TakePoints() {
    if (features_.keeps_points) {
      WELLSPACE_RETURN_IF_ERROR(FindKept());
    }
    std::vector<bool> is_used(complex().points.size());
    for (size_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      for (const uint32_t point : complex().triangles[t]) {
        is_used[point] = true;
      }
    }
    std::vector<bool> is_corner(complex().point_of_input.size());  // of all given triangles
    for (const uint32_t i : features_.corners) {
      is_corner[i] = true;
      if (const uint32_t point = complex().point_of_input[i]; point != SurfaceComplex::kNoPoint) {
        is_used[point] = true;  // also of triangles that were dropped
      }
    }
    first_of_point_.assign(complex().points.size(), kNoFirst);
    input_of_point_.assign(complex().points.size(), kNoFirst);
    for (size_t i = complex().point_of_input.size(); i > 0; --i) {
      if (const uint32_t point = complex().point_of_input[i - 1]; point != SurfaceComplex::kNoPoint) {
        input_of_point_[point] = static_cast<uint32_t>(i - 1);
      }
    }
    const double least = frame_.MinSeparation();
    for (uint32_t i = 0; i < complex().point_of_input.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      const uint32_t point = complex().point_of_input[i];
      if (point == SurfaceComplex::kNoPoint) {
        figures_.dropped_points += is_corner[i] ? 0 : 1;
        continue;
      }
      const auto corner = std::lower_bound(curves().corners.begin(), curves().corners.end(), point);
      if (corner != curves().corners.end() && *corner == point) {
        const auto number = static_cast<uint32_t>(corner - curves().corners.begin());
        TakePoint(i, point, {SpacePlace::Kind::kCorner, number, 0});
      } else if (features_.keeps_points && place_of_kept_[point].IsOnSurface()) {
        TakePoint(i, point, place_of_kept_[point]);
      } else if (!is_used[point]) {
        const uint32_t solid = domain_->index().SolidAt(complex().points[point]);
        if (!domain_->IsMeshed(solid)) {
          ++figures_.dropped_points;
          continue;
        }
        const SurfacePoint nearest = *domain_->index().Nearest(complex().points[point]);
        const double distance = std::sqrt(nearest.distance_sq);
        if (distance < least) {
          const uint32_t source = complex().sources[nearest.triangle];
          return TooCloseError<3>(frame_, complex().points[point], i, distance,
                                  features_.solids == SolidRule::kWinding ? "the surface"
                                  : source == SurfaceComplex::kNoSource   ? "a side of the box"
                                                                          : absl::StrCat("triangle ", source));
        }
        TakePoint(i, point, {SpacePlace::Kind::kSolid, solid, distance});
      }
    }
    place_of_kept_ = {};
    TakeOtherCorners();
    return absl::OkStatus();
  }

  // Takes the corners that are no given points: of a box, and where its edges are crossed.
  void TakeOtherCorners() {
    if (features_.solids != SolidRule::kBox) {
      return;
    }
    for (uint32_t number = 0; number < curves().corners.size(); ++number) {
      const uint32_t point = curves().corners[number];
      if (first_of_point_[point] == kNoFirst) {
        first_of_point_[point] = static_cast<uint32_t>(first_.size());
        first_.push_back({frame_.Unscaled(complex().points[point]), {SpacePlace::Kind::kCorner, number, 0}});
      }
    }
  }

  // Takes given point `input`, which is a point of the complex.
  void TakePoint(uint32_t input, uint32_t point, const SpacePlace& place) {
    if (first_of_point_[point] == kNoFirst) {
      first_of_point_[point] = static_cast<uint32_t>(first_.size());
      first_.push_back({frame_.Unscaled(complex().points[point]), place, input, true});
    }
  }

  absl::Status SampleCurves() {
    for (uint32_t curve = 0; curve < domain_->curve_count(); ++curve) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(curve, context_));
      const uint32_t begin = curves().PointsOf(curve).front();
      const bool has_corner = first_of_point_[begin] != kNoFirst;
      const AcuteCreases& creases = domain_->creases();
      if (!creases.IsEmpty() && !creases.first_arcs[curve].empty()) {
        for (const double arc : creases.first_arcs[curve]) {
          AddOnCurve(curve, arc);
        }
        continue;
      }
      if (features_.keeps_points && domain_->IsMeshedAt({SpacePlace::Kind::kCurve, curve, 0})) {
        WELLSPACE_RETURN_IF_ERROR(SampleBetweenKept(curve));
        continue;
      }
      const double length = domain_->LengthOf(curve);
      const size_t least = !domain_->IsLoop(curve) ? 1 : has_corner ? kPartsOfCornerLoop : kPartsOfLoop;
      const double most = std::min(length / curve_edge_, kMostParts);
      const size_t parts = std::max(least, static_cast<size_t>(std::ceil(most * (1 - 1e-12))));
      WELLSPACE_RETURN_IF_ERROR(AllowOnCurves(parts));
      for (size_t i = has_corner ? 1 : 0; i < parts; ++i) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
        const double arc = length * (static_cast<double>(i) / static_cast<double>(parts));
        AddOnCurve(curve, arc);
      }
    }
    first_collar_ = static_cast<uint32_t>(first_.size());
    for (const AcuteCreases::Collar& collar : domain_->creases().collars) {
      first_.push_back({frame_.Unscaled(collar.at), {SpacePlace::Kind::kCollar, collar.patch, 0}, 0});
    }
    return absl::OkStatus();
  }

  absl::Status AllowOnCurves(size_t more) const {
    if (first_.size() + more > max_vertices_) {
      return absl::ResourceExhaustedError(
          absl::StrCat("triangles: the curves of the surface take more than max_vertices = ", max_vertices_,
                       " vertices; raise max_vertices, or the edge length that is asked for"));
    }
    return context_.AllowMemory(domain_->MemoryBytes() + (first_.size() + more) * kBytesOfFirst);
  }

  // Divides the pieces of a curve between points that are kept.
  absl::Status SampleBetweenKept(uint32_t curve) {
    const std::span<const double> arcs = domain_->ArcsOf(curve);
    const bool is_divided = domain_->IsLoop(curve) && arcs.size() - 1 < kPartsOfCornerLoop;
    for (size_t i = 0; i + 1 < arcs.size(); ++i) {
      const double most = std::min((arcs[i + 1] - arcs[i]) / curve_edge_, kMostParts);
      const size_t parts = std::max<size_t>(is_divided ? 2 : 1, static_cast<size_t>(std::ceil(most * (1 - 1e-12))));
      WELLSPACE_RETURN_IF_ERROR(AllowOnCurves(parts));
      for (size_t part = 1; part < parts; ++part) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(part, context_));
        AddOnCurve(curve, arcs[i] + (arcs[i + 1] - arcs[i]) * (static_cast<double>(part) / static_cast<double>(parts)));
      }
    }
    return absl::OkStatus();
  }

  void AddOnCurve(uint32_t curve, double arc) {
    const uint32_t input = input_of_point_[curves().PointsOf(curve).front()];  // none: on a side of the box
    first_.push_back({frame_.Unscaled(domain_->PointAt(curve, arc)),
                      {SpacePlace::Kind::kCurve, curve, arc},
                      input == kNoFirst ? 0 : input});
  }

  // Puts vertices on patches that no curve bounds, each as far as can be from those before.
  absl::Status SeedPatches() {
    std::vector<std::vector<uint32_t>> points_of(curves().patch_count);
    for (uint32_t t = 0; t < complex().triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const uint32_t patch = curves().patch_of[t];
      if (!domain_->HasCurves(patch)) {
        points_of[patch].insert(points_of[patch].end(), complex().triangles[t].begin(), complex().triangles[t].end());
      }
    }
    for (uint32_t patch = 0; patch < points_of.size(); ++patch) {
      std::vector<uint32_t>& points = points_of[patch];
      std::sort(points.begin(), points.end());
      points.erase(std::unique(points.begin(), points.end()), points.end());
      std::erase_if(points, [this](uint32_t point) {  // tips of cones, and what is in their balls
        return first_of_point_[point] != kNoFirst || domain_->creases().Encloses(complex().points[point]);
      });
      std::vector<double> distance_sq(points.size(), std::numeric_limits<double>::infinity());
      for (size_t k = 0; k < std::min(kSeedsOfPatch, points.size()); ++k) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
        const auto farthest =
            static_cast<size_t>(std::max_element(distance_sq.begin(), distance_sq.end()) - distance_sq.begin());
        const Point<3>& at = complex().points[points[farthest]];
        const uint32_t input = input_of_point_[points[farthest]];  // none: a corner of a wrap
        const bool is_input = input != kNoFirst;
        first_.push_back({frame_.Unscaled(at), {SpacePlace::Kind::kPatch, patch, 0}, is_input ? input : 0, is_input});
        first_of_point_[points[farthest]] = static_cast<uint32_t>(first_.size() - 1);
        for (size_t i = 0; i < points.size(); ++i) {
          distance_sq[i] = std::min(distance_sq[i], DistanceSq<3>(at, complex().points[points[i]]));
        }
      }
    }
    return absl::OkStatus();
  }

  // Sorts the first vertices, and names them: those that are given points come first, in the order of the input.
  absl::StatusOr<SpaceCloud> Sort() {
    std::vector<double> coordinates;
    std::vector<uint32_t> inputs;
    for (const First& first : first_) {
      coordinates.insert(coordinates.end(), first.at.begin(), first.at.end());
      inputs.push_back(first.input);
    }
    WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<3> cloud, SortCloud<3>(frame_, coordinates, threads_, context_, inputs));
    const HugeVector<uint32_t> sorted_of = cloud.SortedOfInputs();
    std::vector<std::tuple<bool, bool, uint32_t, uint32_t>> order;  // of the first vertices; those left out come last
    std::vector<uint32_t> first_of_sorted(cloud.points.size());
    for (uint32_t i = 0; i < first_.size(); ++i) {
      first_of_sorted[sorted_of[i]] = i;
      const First& first = first_[i];
      order.emplace_back(!domain_->IsMeshedAt(first.place), !first.is_input, first.is_input ? first.input : i, i);
    }
    std::sort(order.begin(), order.end());
    PointNames names;
    names.of_sorted.resize(cloud.points.size());
    for (uint32_t k = 0; k < order.size(); ++k) {
      names.of_sorted[sorted_of[std::get<3>(order[k])]] = k;
    }
    for (const uint32_t point : complex().point_of_input) {
      const uint32_t first = point == SurfaceComplex::kNoPoint ? kNoFirst : first_of_point_[point];
      const bool is_vertex = first != kNoFirst && domain_->IsMeshedAt(first_[first].place);
      names.of_input.push_back(is_vertex ? names.of_sorted[sorted_of[first]] : kNoFirst);
    }
    for (uint32_t sorted = 0; sorted < first_of_sorted.size(); ++sorted) {
      domain_->AddVertex(first_[first_of_sorted[sorted]].place);
    }
    const std::vector<Strand>& strands = domain_->creases().strands;
    for (uint32_t i = 0; i < strands.size(); ++i) {
      for (int k = 0; k < 2; ++k) {
        const StrandEnd& end = strands[i].ends[k];
        domain_->SetEndOfStrand(i, k,
                                end.collar == StrandEnd::kNoCollar ? domain_->VertexOnCurve(end.curve, end.arc)
                                                                   : VertexId{sorted_of[first_collar_ + end.collar]});
      }
    }
    return SpaceCloud{frame_, std::move(cloud), std::move(names), std::move(domain_), meshed_box_, std::move(figures_)};
  }

  static constexpr uint32_t kNoFirst = std::numeric_limits<uint32_t>::max();  // also kNoOutput
  static constexpr uint64_t kBytesOfFirst = 2 * sizeof(First) + 128;          // with its place on a chain
  static constexpr double kMostParts = 4096;  // of a curve; refinement splits them further

  const std::span<const double> points_;
  const SurfaceFeatures& features_;
  double curve_edge_;
  const double tolerance_;  // 0: the default
  const uint64_t max_vertices_;
  const int threads_;
  const RunContext& context_;
  Frame<3> frame_;
  Box<3> meshed_box_{};
  SpaceFigures figures_;
  std::unique_ptr<SpatialDomain> domain_;
  std::vector<First> first_;
  uint32_t first_collar_ = 0;              // in first_
  std::vector<SpacePlace> place_of_kept_;  // by point of the complex: on the surface; kSolid: it is not kept
  std::vector<uint32_t> first_of_point_;   // by point of the complex: in first_, or kNoFirst
  std::vector<uint32_t> input_of_point_;   // by point of the complex: the first given one
};

}  // namespace

uint64_t SpaceCloudBytes(uint64_t points, uint64_t triangles, bool welds) {
  constexpr uint64_t kPointBytes = 48;
  return PrepareSurfaceBytes(points, triangles, welds) + SurfaceIndex::Bytes(triangles) + points * kPointBytes;
}

absl::StatusOr<SpaceCloud> MakeSpaceCloud(std::span<const double> points, const SurfaceFeatures& features,
                                          double curve_edge, double tolerance, uint64_t max_vertices, int threads,
                                          const RunContext& context) {
  return CloudMaker(points, features, curve_edge, tolerance, max_vertices, threads, context).Make();
}

}  // namespace wellspace::core
