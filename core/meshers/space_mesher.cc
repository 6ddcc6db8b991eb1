#include "core/meshers/space_mesher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/input/prepared_surface.h"
#include "core/input/space_parameters.h"
#include "core/mesh/mesh_statistics.h"
#include "core/simplex/part_numbers.h"
#include "core/simplex/quality.h"
#include "core/sliver/surface_carrier.h"
#include "core/validate/validate.h"

namespace wellspace::core {
namespace {

// Of samples of the surface too far from facets, one serves for all that are nearer to it than this many times its
// distance from the nearest vertex. So many are inserted at a time.
constexpr double kApart = 2;
constexpr size_t kMostAtOnce = 4096;

// A subsegment that is no edge is split at this share of its arc: in its middle, right angles at a corner would come
// back, whose circumcentres are on the edge of a membrane, so that only ties say on which side.
constexpr double kOffMiddle = 0.4375;

using EdgeKey = uint64_t;
EdgeKey KeyOf(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

// The least angle of a triangle. Unit: degrees.
double LeastAngleOf(const std::array<Point<3>, 3>& corners) {
  double least = 180;
  for (size_t k = 0; k < 3; ++k) {
    const Point<3>& a = corners[k];
    least =
        std::min(least, AngleBetween(Difference<3>(corners[(k + 1) % 3], a), Difference<3>(corners[(k + 2) % 3], a)));
  }
  return least;
}

// The circumcentre of a triangle; rounded.
Point<3> CircumcentreOf(const Triangle& triangle) {
  const Point<3> u = Difference<3>(triangle[1], triangle[0]);
  const Point<3> w = Difference<3>(triangle[2], triangle[0]);
  const Point<3> normal = Cross(u, w);
  const Point<3> across_u = Cross(normal, u);
  const Point<3> across_w = Cross(w, normal);
  const double half = 0.5 / NormSq<3>(normal);
  Point<3> centre;
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] = triangle[0][axis] + half * (NormSq<3>(w) * across_u[axis] + NormSq<3>(u) * across_w[axis]);
  }
  return centre;
}

}  // namespace

absl::Status SpaceMesher::CheckInput(const Input& input) const {
  return CheckSurfaceFeatures(input.points, *input.surface);
}

uint64_t SpaceMesher::BuildingBytes(const MeshParameters& /*parameters*/, const Input& input) const {
  return SpaceCloudBytes(input.points.size() / 3, input.surface->triangle_count(), input.surface->weld > 0);
}

absl::Status SpaceMesher::Build(const MeshParameters& parameters, const Input& input, RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(SpaceCloud made, MakeSpaceCloud(input.points, *input.surface, CurveEdgeOf(parameters),
                                                             parameters.surface.tolerance, VertexBudget(parameters),
                                                             parameters.threads, context));
  first_parameters_ = parameters;
  frame_ = made.frame;
  spatial_ = std::move(made.domain);
  meshed_box_ = made.meshed_box;
  const Box<3>& box = made.figures.report.box;
  keeps_points_ = input.surface->keeps_points;
  default_tolerance_ = DefaultToleranceOf(*input.surface, Distance<3>(box.low, box.high));
  numbering_.Begin(std::move(made.names), input.points, {});
  WELLSPACE_RETURN_IF_ERROR(
      BuildTree(parameters, "first vertices of the domain and the corners of its box", made.cloud, {}, context));
  figures_of_input_ = std::move(made.figures);
  std::vector<bool>& is_given = repairs_.is_given();
  is_given.assign(spatial_->vertex_count(), false);
  is_given.resize(structure_.vertex_count(), true);
  while (spatial_->vertex_count() < structure_.vertex_count()) {  // corners of the box
    const Point<3>& corner = structure_.point(VertexId{spatial_->vertex_count()});
    const double distance = std::sqrt(spatial_->index().Nearest(corner)->distance_sq);
    spatial_->AddVertex({SpacePlace::Kind::kSolid, 0, distance});
  }
  ExtendNumbers();
  for (const uint32_t number : numbering_.input_vertex()) {
    if (number != kNoOutput) {
      is_given[Index(numbering_.VertexOf(number))] = true;
    }
  }
  return samples_.Take(frame_, parameters, context);
}

absl::Status SpaceMesher::CheckAdding() const {
  return absl::UnimplementedError(
      "points: none can be added to a domain in space; give them beside the triangles that bound it");
}

uint64_t SpaceMesher::OtherBytes() const {
  uint64_t bytes = spatial_->MemoryBytes() + slivers_.MemoryBytes() + repairs_.MemoryBytes();
  bytes += has_own_sizes_ ? samples_.TakenBytes() : 0;
  if (made_.has_value()) {
    bytes += (made_->simplices.indices.size() + made_->solids.size() + made_->boundary.facets.size() +
              made_->ridges.size()) *
             sizeof(uint32_t);
  }
  return bytes;
}

absl::Status SpaceMesher::Explain(absl::Status status) const {
  if (status.code() != absl::StatusCode::kResourceExhausted) {
    return status;
  }
  const SpatialDomain::LastAsk& ask = spatial_->last_ask();
  const Point<3> at = frame_.Unscaled(ask.at);
  return absl::Status(status.code(),
                      absl::StrFormat("%s; the last vertex was asked for at (%.6g, %.6g, %.6g) by the %s",
                                      status.message(), at[0], at[1], at[2], ask.rule));
}

void SpaceMesher::TakeDemands(const MeshParameters& parameters) {
  SurfaceCriteria criteria = SurfaceCriteriaOf(parameters, default_tolerance_, frame_.scale);
  if (keeps_points_ && !parameters.surface.min_facet_angle.has_value()) {
    criteria.least_sine = 0;  // facets between given points have the angles that they have
  }
  if (!(criteria == spatial_->criteria())) {
    spatial_->criteria() = criteria;
    refinement_->ForgetRun();
  }
  has_own_sizes_ = parameters.surface.curvature_elements > 0 || parameters.surface.thickness_layers > 0;
  spatial_->MakeAllPending();
  rho_ = CriteriaOf(parameters).rho;
}

void SpaceMesher::ExtendNumbers() {
  std::vector<bool> is_left_out(structure_.vertex_count());
  for (uint32_t v = 0; v < is_left_out.size(); ++v) {
    is_left_out[v] = !spatial_->IsMeshedAt(spatial_->PlaceOf(VertexId{v}));
  }
  meshed_count_ = numbering_.ExtendBut(is_left_out);
}

std::vector<int32_t> SpaceMesher::Regions() const {
  std::set<int64_t> values;
  for (const SolidRole& role : spatial_->roles()) {
    if (role.is_meshed) {
      values.insert(role.region);
    }
  }
  const std::map<int64_t, int32_t> ids = NumberAboveZero(values);
  std::vector<int32_t> regions;
  for (const SolidRole& role : spatial_->roles()) {
    regions.push_back(role.is_meshed ? ids.at(role.region) : 0);
  }
  return regions;
}

// Adds vertices where a subsegment is no edge, facets do not meet in pairs, or a patch has none. Facets that no vertex
// can mend are counted, and let pass.
absl::StatusOr<bool> SpaceMesher::Conform(const MeshParameters& parameters, RunContext& context) {
  is_repaired_ = false;
  WELLSPACE_RETURN_IF_ERROR(MakeTetrahedra(parameters.threads, context));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Subsegment> lost, FindRidges(context));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Missing> missing, FindMissing(context));
  WELLSPACE_ASSIGN_OR_RETURN(uint64_t added, Insert(lost, missing, parameters, context));
  if (added > 0) {
    return false;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Missing> far, FindFar(context));
  WELLSPACE_ASSIGN_OR_RETURN(added, Insert({}, far, parameters, context));
  if (added == 0) {
    WELLSPACE_RETURN_IF_ERROR(CheckAllMeshed(context));
    WELLSPACE_RETURN_IF_ERROR(CheckAcuteCreases(lost, far));
  }
  return added == 0;
}

// Refuses demands under which a vertex is in no tetrahedron: the solid there is thinner than `min_size`.
absl::Status SpaceMesher::CheckAllMeshed(const RunContext& context) const {
  std::vector<bool> is_meshed(meshed_count_, false);
  const auto& corners = made_->simplices.indices;
  for (size_t i = 0; i < corners.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    is_meshed[corners[i]] = true;
  }
  const auto missing = std::find(is_meshed.begin(), is_meshed.end(), false);
  if (missing == is_meshed.end()) {
    return absl::OkStatus();
  }
  const auto index = static_cast<uint32_t>(missing - is_meshed.begin());
  const Point<3> at = frame_.Unscaled(structure_.point(numbering_.VertexOf(index)));
  return absl::InvalidArgumentError(absl::StrFormat(
      "surface.min_size: at (%.6g, %.6g, %.6g) the solid is thinner than %g, or half of the tolerance; expected less, "
      "or a smaller surface.tolerance",
      at[0], at[1], at[2], spatial_->criteria().min_size / frame_.scale));
}

// Repairs slivers if that is asked for, by steps that leave the surface as well met as it is; else drops the
// triangulation that is kept for it.
absl::Status SpaceMesher::Improve(const MeshParameters& parameters, RunContext& context) {
  const double min_dihedral = parameters.min_dihedral.value_or(DefaultMinDihedral(3));
  if (min_dihedral == 0) {
    slivers_.Forget();
    return MeasureFacets(context);
  }
  made_.reset();
  const MeshCriteria<3> criteria = CriteriaOf(parameters);
  const StepRules<3> step_rules(structure_, criteria, frame_.MinEdge());
  const SpaceRules rules(structure_, *spatial_, step_rules);
  SurfaceCarrier carrier(*spatial_, rules);
  const RepairCriteria wanted{criteria, min_dihedral, frame_.MinEdge(), VertexBudget(parameters)};
  WELLSPACE_RETURN_IF_ERROR(
      repairs_.Repair(slivers_, structure_, *refinement_, carrier, wanted, parameters, last_count_, context));
  is_repaired_ = true;
  WELLSPACE_RETURN_IF_ERROR(MakeTetrahedra(parameters.threads, context));
  WELLSPACE_RETURN_IF_ERROR(FindRidges(context).status());
  WELLSPACE_RETURN_IF_ERROR(MeasureSurface(std::numeric_limits<double>::infinity(), context).status());
  return MeasureFacets(context);
}

// Sets how far facets are from the surface.
absl::Status SpaceMesher::MeasureFacets(const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> points, ScaledPoints(context));
  WELLSPACE_ASSIGN_OR_RETURN(made_->deviation_of_facets,
                             DeviationOfFacets(*spatial_, points, made_->boundary.facets, context));
  return absl::OkStatus();
}

// Sets how far the surface is from facets, and returns where that is more than `limit`.
absl::StatusOr<std::vector<FarSample>> SpaceMesher::MeasureSurface(double limit, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> points, ScaledPoints(context));
  WELLSPACE_ASSIGN_OR_RETURN(
      SurfaceDeviation deviation,
      DeviationOfSurface(*spatial_, points, made_->boundary.facets, limit, MortonGrid<3>(frame_.scaled_box), context));
  made_->deviation_of_surface = deviation.largest;
  return std::move(deviation.far);
}

// Measures how far facets and surface are from each other. Returns samples of the surface that are too far from all
// facets, the farthest first, and of those that are near to each other the first.
absl::StatusOr<std::vector<SpaceMesher::Missing>> SpaceMesher::FindFar(const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<FarSample> far, MeasureSurface(spatial_->criteria().tolerance, context));
  std::sort(far.begin(), far.end(), [](const FarSample& a, const FarSample& b) {
    return std::tie(b.distance, a.at) < std::tie(a.distance, b.at);
  });
  std::vector<Missing> taken;
  std::vector<double> radius_sq;  // of the empty balls about these
  for (const FarSample& sample : far) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    bool is_near = false;
    for (size_t i = 0; i < taken.size() && !is_near; ++i) {
      is_near = DistanceSq<3>(taken[i].at, sample.at) < kApart * kApart * radius_sq[i];
    }
    if (!is_near && taken.size() < kMostAtOnce) {
      taken.push_back({sample.at, sample.patch, sample.distance});
      radius_sq.push_back(structure_.NearestTo(sample.at, kNoVertex, workspace_).distance_sq);
    }
  }
  return taken;
}

// Inserts vertices for lost subsegments and missing facets, if they are not too near to others; returns how many.
absl::StatusOr<uint64_t> SpaceMesher::Insert(std::span<const Subsegment> lost, std::span<const Missing> missing,
                                             const MeshParameters& parameters, const RunContext& context) {
  const StepRules<3> step_rules(structure_, CriteriaOf(parameters), frame_.MinEdge());
  const SpaceRules rules(structure_, *spatial_, step_rules);
  const uint64_t most = VertexBudget(parameters);
  uint64_t added = 0;
  for (const Subsegment& subsegment : lost) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    added += !spatial_->IsFrozen(subsegment) && structure_.vertex_count() < most &&
                     Add(rules.RequestOnCurve(subsegment, 0, kOffMiddle))
                 ? 1
                 : 0;
  }
  for (const Missing& one : missing) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    if (structure_.vertex_count() >= most) {
      return TooManyVerticesError(most);
    }
    const Neighbor nearest = structure_.NearestTo(one.at, kNoVertex, workspace_);
    const std::optional<SpaceRequest> request =
        rules.RequestOnPatch(nearest.vertex, one.at, one.patch, nearest.distance_sq, 0);
    added += request.has_value() && Add(*request) ? 1 : 0;
  }
  return added;
}

// Adds the vertex that is asked for, unless it is too near to another one.
bool SpaceMesher::Add(const SpaceRequest& request) {
  const double least = std::max(spatial_->criteria().min_size, frame_.MinEdge());
  if (request.point.empty_radius_sq < least * least) {
    return false;
  }
  const VertexId v = structure_.AddVertex(request.insertion.near, request.point.position);
  spatial_->AddVertex(request.place);
  refinement_->VertexAdded(v);
  return true;
}

// Where facets are missing.
absl::StatusOr<std::vector<SpaceMesher::Missing>> SpaceMesher::FindMissing(const RunContext& context) const {
  std::vector<Missing> missing;
  WELLSPACE_RETURN_IF_ERROR(FindUnpaired(missing, context));
  WELLSPACE_RETURN_IF_ERROR(FindLostPatches(missing, context));
  return missing;
}

// Finds edges on no curve that have not two facets: of the facets there the largest one asks for a vertex.
absl::Status SpaceMesher::FindUnpaired(std::vector<Missing>& missing, const RunContext& context) const {
  struct AtEdge {
    uint32_t facets = 0;
    size_t largest = 0;
    double radius_sq = 0;
  };
  absl::flat_hash_map<EdgeKey, AtEdge> at_edge;
  const HugeVector<uint32_t>& facets = made_->boundary.facets;
  const auto corner = [&](size_t at) -> const Point<3>& { return structure_.point(numbering_.VertexOf(facets[at])); };
  const auto centre_of = [&](size_t f) { return CircumcentreOf({corner(f), corner(f + 1), corner(f + 2)}); };
  for (size_t f = 0; f < facets.size(); f += 3) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(f / 3, context));
    const double radius_sq = DistanceSq<3>(centre_of(f), corner(f));
    for (size_t k = 0; k < 3; ++k) {
      AtEdge& edge = at_edge[KeyOf(facets[f + k], facets[f + (k + 1) % 3])];
      ++edge.facets;
      if (radius_sq > edge.radius_sq) {
        edge.largest = f;
        edge.radius_sq = radius_sq;
      }
    }
  }
  for (size_t r = 0; r < made_->ridges.size(); r += 2) {
    at_edge.erase(KeyOf(made_->ridges[r], made_->ridges[r + 1]));
  }
  std::set<size_t> to_split;  // facets, in their order
  for (const auto& [key, edge] : at_edge) {
    if (edge.facets != 2) {
      to_split.insert(edge.largest);
    }
  }
  for (const size_t f : to_split) {
    const SurfacePoint nearest = *spatial_->index().Nearest(centre_of(f));
    missing.push_back({nearest.at, spatial_->curves().patch_of[nearest.triangle]});
  }
  return absl::OkStatus();
}

// Finds patches around the domain on which no facet has all three vertices; takes the middle of a triangle of each that
// is farthest from all vertices.
absl::Status SpaceMesher::FindLostPatches(std::vector<Missing>& missing, const RunContext& context) const {
  std::vector<bool> is_lost(spatial_->curves().patch_count);
  for (uint32_t patch = 0; patch < is_lost.size(); ++patch) {
    is_lost[patch] = spatial_->IsMeshedAt({SpacePlace::Kind::kPatch, patch, 0});
  }
  const HugeVector<uint32_t>& facets = made_->boundary.facets;
  for (size_t f = 0; f < facets.size(); f += 3) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(f / 3, context));
    const auto place = [&](size_t k) -> const SpacePlace& {
      return spatial_->PlaceOf(numbering_.VertexOf(facets[f + k]));
    };
    for (const uint32_t patch : spatial_->PatchesAt(place(0))) {
      is_lost[patch] =
          is_lost[patch] && !(spatial_->IsOnPatch(place(1), patch) && spatial_->IsOnPatch(place(2), patch));
    }
  }
  if (std::find(is_lost.begin(), is_lost.end(), true) == is_lost.end()) {
    return absl::OkStatus();
  }
  std::map<uint32_t, std::pair<double, Point<3>>> farthest;  // by patch
  Workspace<3> workspace;
  for (uint32_t t = 0; t < spatial_->complex().triangles.size(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(16 * size_t{t}, context));
    if (const uint32_t patch = spatial_->curves().patch_of[t]; is_lost[patch]) {
      const Triangle triangle = InOrder(spatial_->complex().TriangleAt(t));
      const Point<3> middle = NearestPoint(triangle, MiddleOf(triangle));
      const double distance_sq = structure_.NearestTo(middle, kNoVertex, workspace).distance_sq;
      const auto [at, is_new] = farthest.try_emplace(patch, distance_sq, middle);
      if (!is_new && distance_sq > at->second.first) {
        at->second = {distance_sq, middle};
      }
    }
  }
  for (const auto& [patch, sample] : farthest) {
    missing.push_back({sample.second, patch});
  }
  return absl::OkStatus();
}

// The coordinates of all vertices, by output index.
absl::StatusOr<std::vector<double>> SpaceMesher::ScaledPoints(const RunContext& context) const {
  std::vector<double> points(3 * size_t{structure_.vertex_count()});
  for (uint32_t v = 0; v < structure_.vertex_count(); ++v) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(v, context));
    const Point<3>& p = structure_.point(VertexId{v});
    std::copy(p.begin(), p.end(), points.begin() + 3 * std::ptrdiff_t{numbering_.OutputIndex(VertexId{v})});
  }
  return points;
}

// Finds which subsegments are edges of facets, and returns those that are not.
absl::StatusOr<std::vector<Subsegment>> SpaceMesher::FindRidges(RunContext& context) {
  std::vector<Subsegment> lost;
  absl::flat_hash_set<EdgeKey> edges;  // of facets
  const HugeVector<uint32_t>& facets = made_->boundary.facets;
  for (size_t f = 0; f < facets.size(); f += 3) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(f / 3, context));
    for (size_t k = 0; k < 3; ++k) {
      edges.insert(KeyOf(facets[f + k], facets[f + (k + 1) % 3]));
    }
  }
  spatial_->ForEachSubsegment([&](const Subsegment& subsegment) {
    if (!spatial_->IsMeshedAt({SpacePlace::Kind::kCurve, subsegment.curve, 0})) {
      return;
    }
    const uint32_t from = numbering_.OutputIndex(subsegment.from);
    const uint32_t to = numbering_.OutputIndex(subsegment.to);
    if (edges.contains(KeyOf(from, to))) {
      made_->ridges.push_back(from);
      made_->ridges.push_back(to);
    } else {
      lost.push_back(subsegment);
    }
  });
  made_->lost_ridges = lost.size();
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  return lost;
}

absl::StatusOr<SpaceMesher::Made> SpaceMesher::MakeSimplices(int threads, RunContext& context) {
  if (made_->solids.empty()) {  // taken by an earlier mesh, which was the same
    const double of_facets = made_->deviation_of_facets;
    const double of_surface = made_->deviation_of_surface;
    WELLSPACE_RETURN_IF_ERROR(MakeTetrahedra(threads, context));
    WELLSPACE_RETURN_IF_ERROR(FindRidges(context).status());
    made_->deviation_of_facets = of_facets;
    made_->deviation_of_surface = of_surface;
  }
  return Made{.simplices = std::exchange(made_->simplices, {}), .faces = std::exchange(made_->solids, {})};
}

absl::Status SpaceMesher::Describe(Mesh& mesh, std::span<const uint32_t> faces, int /*threads*/,
                                   const RunContext& context) {
  mesh.points.resize(3 * size_t{meshed_count_});
  const QualityReport quality = MeasureQuality({3, mesh.points, mesh.simplices});
  mesh.statistics.max_radius_edge = quality.max_radius_edge;
  mesh.statistics.min_angle_deg = quality.min_angle_deg;
  mesh.facets = made_->boundary.facets;
  mesh.boundary = made_->boundary.parts;
  mesh.ridges = made_->ridges;
  mesh.vertex_tags.assign(made_->boundary.vertex_tags.begin(), made_->boundary.vertex_tags.begin() + meshed_count_);
  mesh.vertex_origins.assign(meshed_count_, kSteinerOrigin);
  repairs_.ForEachAdded(0, [&](VertexId v) {
    if (const uint32_t number = numbering_.OutputIndex(v); number < meshed_count_) {
      mesh.vertex_origins[number] = kRepairOrigin;
    }
  });
  for (size_t i = mesh.input_vertex.size(); i > 0; --i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    if (const uint32_t v = mesh.input_vertex[i - 1]; v != kNoOutput) {
      mesh.vertex_origins[v] = static_cast<uint32_t>(i - 1);
    }
  }
  const std::vector<int32_t> regions = Regions();
  std::map<int32_t, size_t> places;  // of regions in the mesh
  for (uint32_t solid = 0; solid < regions.size(); ++solid) {
    if (regions[solid] > 0) {
      places.emplace(regions[solid], solid);
    }
  }
  for (auto& [id, place] : places) {
    mesh.regions.push_back({id, RegionName(spatial_->roles()[place].region)});
    place = mesh.regions.size() - 1;
  }
  SurfaceStatistics& surface = mesh.statistics.surface.emplace();
  WELLSPACE_RETURN_IF_ERROR(DescribeSimplices(mesh, faces, regions, places, context));
  surface.min_facet_angle_deg = 180;
  for (size_t f = 0; f < mesh.facets.size(); f += 3) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(f, context));
    surface.min_facet_angle_deg =
        std::min(surface.min_facet_angle_deg,
                 LeastAngleOf({PointAt<3>(mesh.points, mesh.facets[f]), PointAt<3>(mesh.points, mesh.facets[f + 1]),
                               PointAt<3>(mesh.points, mesh.facets[f + 2])}));
  }
  return absl::OkStatus();
}

void SpaceMesher::NoteMade(Mesh& mesh) {
  for (const VertexId v : repairs_.TakeMoved()) {
    if (const uint32_t number = numbering_.OutputIndex(v); number < meshed_count_) {
      mesh.moved_vertices.push_back(number);
    }
  }
  std::sort(mesh.moved_vertices.begin(), mesh.moved_vertices.end());
  last_count_ = structure_.vertex_count();
}

void SpaceMesher::AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const {
  stars.Add(slivers_.statistics().star_queries);
  SetSliverFigures(slivers_.statistics(), statistics);
  for (LeftSliver& sliver : statistics.flattest_left) {
    for (uint32_t& v : sliver.vertices) {
      v = numbering_.OutputIndex(VertexId{v});
    }
  }
  const SurfaceReport& report = figures_of_input_.report;
  statistics.duplicates = report.equal_points;
  statistics.merged_points = report.welded_points;
  SurfaceStatistics& surface = *statistics.surface;  // since Describe
  surface.triangles = report.triangles;
  surface.welded_points = report.welded_points;
  surface.dropped_triangles = report.flat_triangles + report.equal_triangles;
  surface.flipped_triangles = report.flipped_triangles;
  surface.unmeshed_points = figures_of_input_.dropped_points;
  surface.patches = report.patches;
  surface.curves = report.curves;
  surface.corners = report.corners;
  surface.solids = figures_of_input_.solids;
  surface.facets = mesh.facet_count();
  surface.ridges = mesh.ridges.size() / 2;
  surface.lost_ridges = made_->lost_ridges;
  surface.deviation_of_facets = made_->deviation_of_facets / frame_.scale;
  surface.deviation_of_surface = made_->deviation_of_surface / frame_.scale;
  surface.lost_area = report.lost_area;
  surface.cut_triangles = report.cut_triangles;
  surface.outside_triangles = report.outside_triangles;
  surface.unused_seeds = figures_of_input_.unused_seeds;
  surface.first_unused_seed = figures_of_input_.first_unused_seed;
}

}  // namespace wellspace::core
