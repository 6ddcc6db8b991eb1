#include "core/domain_mesher.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/base/stopwatch.h"
#include "core/base/thread_team.h"
#include "core/domain_parameters.h"
#include "core/estimate/domain_shape.h"
#include "core/feasibility.h"
#include "core/mesh_estimate.h"
#include "core/mesher_checks.h"
#include "core/separation.h"
#include "core/simplex/boundary.h"
#include "core/simplex/quality.h"
#include "core/sorted_cloud.h"
#include "core/vertex_queries.h"

namespace wellspace::core {
namespace {

// A vertex is in the diametral disc of a subsegment only if it is nearer to its centre by more than this, relatively: a
// foot makes a right angle, as far as doubles go.
constexpr double kDiscTolerance = 1e-9;

// Segments whose subsegments one thread looks at together.
constexpr uint32_t kSegmentsTogether = 1024;

// A ratio that exceeds rho by less, relatively, is what was rounded.
constexpr double kRatioTolerance = 1e-9;

// Vertices that one thread looks at between two looks at the context.
constexpr uint32_t kVerticesBetweenChecks = 1 << 14;

// Refuses spans of other lengths than each other's.
absl::Status CheckShapes(std::span<const double> points, const Features& features) {
  if (points.size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", points.size(), " coordinates are not a multiple of the dimension, 2"));
  }
  if (features.ends.size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("segments: ", features.ends.size(), " ends are not a multiple of 2"));
  }
  if (!features.markers.empty() && features.markers.size() != features.segment_count()) {
    return absl::InvalidArgumentError(absl::StrCat("segments: ", features.markers.size(),
                                                   " markers are not one for each of ", features.segment_count(),
                                                   " segments, nor none"));
  }
  return absl::OkStatus();
}

// Gives numbers above 0: those above 0 keep theirs, the others get the lowest that are left, in their order.
std::map<int64_t, int32_t> NumberAboveZero(const std::set<int64_t>& values) {
  std::map<int64_t, int32_t> numbers;
  int32_t next = 1;
  for (const int64_t value : values) {
    if (value > 0 && value <= std::numeric_limits<int32_t>::max()) {
      numbers[value] = static_cast<int32_t>(value);
    }
  }
  for (const int64_t value : values) {
    if (!numbers.contains(value)) {
      while (values.contains(next)) {
        ++next;
      }
      numbers[value] = next++;
    }
  }
  return numbers;
}

// What tells the parts of a boundary apart: a marker, or a side of the box, which come below all markers.
constexpr int64_t kFirstSide = std::numeric_limits<int64_t>::min();

int64_t PartOf(const GraphSegment& segment) {
  return segment.IsBoxSide() && segment.marker == 0 ? kFirstSide + (segment.source - GraphSegment::kBoxSide)
                                                    : int64_t{segment.marker};
}

// The least of the largest areas in faces that are meshed.
LargestArea LeastAreaOf(const PlanarDomain& planar, std::span<const FaceSeed> seeds, double scale) {
  LargestArea least;
  for (const Face& face : planar.faces().faces) {
    least.area = face.is_meshed ? std::min(least.area, face.max_area) : least.area;
  }
  least.area /= scale * scale;  // powers of two: as it was given
  const auto asks = [&](const FaceSeed& seed) { return !seed.is_hole && seed.max_area == least.area; };
  least.seed = static_cast<size_t>(std::find_if(seeds.begin(), seeds.end(), asks) - seeds.begin());
  return least;
}

std::string PartName(int64_t part) {
  if (part < std::numeric_limits<int32_t>::min()) {
    return FaceName(static_cast<int>(part - kFirstSide));
  }
  return part == 0 ? "unmarked" : absl::StrCat("marker_", part);
}

}  // namespace

absl::Status DomainMesher::Initialize(const MeshParameters& parameters, std::span<const double> points,
                                      const Features& features, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(ValidateDomainParameters(parameters, features));
  WELLSPACE_RETURN_IF_ERROR(CheckShapes(points, features));
  context.EnterPhase(Phase::kTree);
  const uint64_t count = points.size() / 2;
  WELLSPACE_RETURN_IF_ERROR(
      ReserveForBuilding<2>(parameters, count, kTreeBytes<2>,
                            DomainCloudBytes(count, features.segment_count(), features.seeds.size()), context));
  Box<2> box{{0, 0}, {1, 1}};
  if (features.faces == FaceRule::kBox) {
    if (parameters.domain_low.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<2>(points, parameters.margin, context));
    } else {
      box = {PointAt<2>(parameters.domain_low, 0), PointAt<2>(parameters.domain_high, 0)};
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(
      DomainCloud made, MakeDomainCloud(points, features, box, VertexBudget(parameters), parameters.threads, context));
  domain_ = made.domain;
  planar_ = std::move(made.planar);
  least_area_ = LeastAreaOf(*planar_, features.seeds, domain_.scale);
  dropped_points_ = made.dropped_points;
  const uint64_t max_vertices = VertexBudget(parameters);
  if (planar_->point_count() > max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("the ", planar_->point_count(),
                                                     " points of the domain are more than ",
                                                     "max_vertices = ", max_vertices, " vertices; raise max_vertices"));
  }
  WELLSPACE_RETURN_IF_ERROR(NumberPoints(made, points, context));
  WELLSPACE_RETURN_IF_ERROR(structure_.Initialize(made.cloud.grid, std::move(made.cloud.points),
                                                  kLeavesPerVertex * max_vertices + 4, parameters.threads, context,
                                                  planar_->Ends()));
  WELLSPACE_RETURN_IF_ERROR(
      CheckSeparation<2>(domain_, structure_, 0, made.cloud.first_input, parameters.threads, context));
  mesh_box_.low = mesh_box_.high = domain_.Unscaled(structure_.point(VertexId{0}));
  NoteAddedFrom(0);
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(domain_, mesh_box_, parameters, context));
  refinement_.emplace(structure_, domain_.MinEdge(), PlaneDomain(*planar_));
  placer_.emplace(domain_, structure_, *planar_);
  adder_.emplace(
      domain_, 0, structure_, [this](VertexId v) { refinement_->VertexAdded(v); }, numbering_, nullptr, &*placer_);
  context.SetVertices(structure_.vertex_count());
  figures_.tree_seconds = absl::ToDoubleSeconds(context.TimeIn(Phase::kTree));
  return absl::OkStatus();
}

// Numbers the points of the graph in the order that they have there.
absl::Status DomainMesher::NumberPoints(const DomainCloud& made, std::span<const double> points,
                                        const RunContext& context) {
  PointNames names;
  const HugeVector<uint32_t> sorted_of = made.cloud.SortedOfInputs();
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  names.of_sorted.resize(sorted_of.size());
  for (uint32_t i = 0; i < sorted_of.size(); ++i) {
    names.of_sorted[sorted_of[i]] = i;
  }
  for (const uint32_t point : planar_->graph().point_of_input) {
    names.of_input.push_back(point == PlanarGraph::kNoInput ? kNoOutput : names.of_sorted[point]);
  }
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  numbering_.Begin(std::move(names), points, {});
  return absl::OkStatus();
}

uint64_t DomainMesher::memory_bytes() const {
  uint64_t bytes = structure_.MemoryBytes() + refinement_->MemoryBytes() + planar_->MemoryBytes() +
                   numbering_.MemoryBytes() + samples_.MemoryBytes();
  if (made_.has_value()) {
    bytes += (made_->triangles.simplices.indices.size() + made_->triangles.faces.size() +
              made_->chains.vertices.size() + made_->chains.first.size()) *
             sizeof(uint32_t);
  }
  return bytes;
}

absl::Status DomainMesher::CheckFeasible(const MeshParameters& parameters) const {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, 2));
  return core::CheckFeasible(DomainShape(*planar_), domain_, parameters, samples_, planar_->point_count(), least_area_);
}

absl::Status DomainMesher::Refine(const MeshParameters& parameters, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, 2));
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with segments has the radius-edge criterion alone");
  }
  context.EnterPhase(Phase::kRefinement);
  WELLSPACE_RETURN_IF_ERROR(AllowSamples<2>(parameters, samples_, memory_bytes(), context));
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(domain_, mesh_box_, parameters, context));
  made_.reset();
  const Stopwatch stopwatch(figures_.refinement_seconds, figures_.simplices_seconds);
  return MakeConforming(parameters, context);
}

// Refines, and splits subsegments, until every one is an edge of the triangulation, with nothing in its diametral disc.
absl::Status DomainMesher::MakeConforming(const MeshParameters& parameters, RunContext& context) {
  const MeshCriteria<2> criteria = CriteriaIn<2>(domain_, parameters, samples_);
  rho_ = criteria.rho;
  while (true) {
    WELLSPACE_RETURN_IF_ERROR(
        refinement_->Run(criteria, VertexBudget(parameters), parameters.threads, context, nullptr, nullptr));
    PlanarDomain::Chains chains = planar_->FindChains();
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<Subsegment> to_split,
                               EncroachedSubsegments(chains, parameters.threads, context));
    if (to_split.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(to_split, MakeTriangles(std::move(chains), parameters.threads, context));
    }
    if (to_split.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_RETURN_IF_ERROR(Split(to_split, parameters, context));
  }
}

// Makes the triangles, unless subsegments are no edges, and are to be split: ties that doubles broke, at very small
// angles.
absl::StatusOr<std::vector<DomainMesher::Subsegment>> DomainMesher::MakeTriangles(PlanarDomain::Chains chains,
                                                                                  int threads, RunContext& context) {
  const double no_time = 0;
  const Stopwatch stopwatch(figures_.simplices_seconds, no_time);
  numbering_.Extend(structure_.vertex_count());
  WELLSPACE_ASSIGN_OR_RETURN(DomainSimplices triangles,
                             ComputeDomainSimplices(
                                 structure_, *planar_, chains, refinement_->stars(),
                                 [this] { refinement_->DropStars(); }, numbering_.output_index(), threads, context));
  figures_.star_queries.Add(triangles.simplices.counters);
  std::vector<Subsegment> to_split;
  for (const uint32_t at : triangles.broken) {
    const auto segment = static_cast<uint32_t>(std::upper_bound(chains.first.begin(), chains.first.end(), at) -
                                               chains.first.begin() - 1);
    to_split.push_back({segment, chains.vertices[at], chains.vertices[at + 1]});
  }
  if (to_split.empty()) {
    made_ = {std::move(chains), std::move(triangles)};
  }
  return to_split;
}

// Whether a vertex lies in the diametral disc of a subsegment.
bool DomainMesher::IsEncroached(const Subsegment& subsegment, Workspace<2>& workspace) const {
  const auto [segment, from, to] = subsegment;
  const Point<2>& p = structure_.point(from);
  const Point<2>& q = structure_.point(to);
  const Neighbor nearest = structure_.NearestTo({0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])}, from, workspace);
  // What is rounded of the centre may make one of the ends the nearest.
  const double rounding = kPlaceRounding * (std::abs(p[0]) + std::abs(p[1]));
  const double radius = 0.5 * std::sqrt(DistanceSq<2>(p, q)) * (1 - kDiscTolerance) - rounding;
  return nearest.vertex != from && nearest.vertex != to && std::sqrt(nearest.distance_sq) < radius;
}

// The subsegments in whose diametral disc a vertex lies that no cell has seen, since it is clipped on a side that is
// not meshed.
absl::StatusOr<std::vector<DomainMesher::Subsegment>> DomainMesher::EncroachedSubsegments(
    const PlanarDomain::Chains& chains, int threads, const RunContext& context) const {
  const uint32_t segments = planar_->segment_count();
  std::vector<std::vector<Subsegment>> found((segments + kSegmentsTogether - 1) / kSegmentsTogether);  // by block
  ThreadTeam team(threads);
  std::vector<Workspace<2>> workspaces(team.threads());
  team.ForEach(found.size(), [&](size_t block) {
    const auto begin = static_cast<uint32_t>(block) * kSegmentsTogether;
    for (uint32_t segment = begin; segment < std::min(segments, begin + kSegmentsTogether); ++segment) {
      const std::span<const VertexId> chain = chains.Of(segment);
      for (size_t i = 0; i + 1 < chain.size() && !context.IsCancelled(); ++i) {
        const Subsegment subsegment{segment, chain[i], chain[i + 1]};
        if (IsEncroached(subsegment, workspaces[ThreadTeam::CurrentThread()])) {
          found[block].push_back(subsegment);
        }
      }
    }
  });
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  std::vector<Subsegment> encroached;
  for (const std::vector<Subsegment>& of_block : found) {
    encroached.insert(encroached.end(), of_block.begin(), of_block.end());
  }
  return encroached;
}

// Splits each subsegment in its middle.
absl::Status DomainMesher::Split(std::span<const Subsegment> subsegments, const MeshParameters& parameters,
                                 const RunContext& context) {
  for (const Subsegment& subsegment : subsegments) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const SegmentPoint place = planar_->MiddleOf(subsegment.segment, subsegment.from, subsegment.to);
    const Point<2> position = planar_->PositionOf(place);
    const Neighbor nearest = structure_.NearestTo(position, subsegment.from, workspace_);
    if (structure_.vertex_count() >= VertexBudget(parameters)) {
      return TooManyVerticesError(VertexBudget(parameters));
    }
    if (nearest.distance_sq < domain_.MinEdge() * domain_.MinEdge()) {
      const Point<2> at = domain_.Unscaled(position);
      return absl::ResourceExhaustedError(
          absl::StrCat("segments: a part of one at (", at[0], ", ", at[1], ") is only ",
                       2 * std::sqrt(nearest.distance_sq) / domain_.scale,
                       " long, and another vertex is still too near to it; raise the angles or distances there"));
    }
    const VertexId v = structure_.AddVertex(subsegment.from, position);
    planar_->AddVertex(place, 0);
    refinement_->VertexAdded(v);
  }
  return absl::OkStatus();
}

// Notes that vertex `first` and those after it, if there are any, have been added: they may be a little outside of the
// box, beside segments that they are on.
void DomainMesher::NoteAddedFrom(uint32_t first) {
  if (first == structure_.vertex_count()) {
    return;
  }
  made_.reset();
  for (uint32_t v = first; v < structure_.vertex_count(); ++v) {
    const Point<2> p = domain_.Unscaled(structure_.point(VertexId{v}));
    mesh_box_.Include({p, p});
  }
  structure_.SetBoxOfCells({domain_.Scaled(mesh_box_.low), domain_.Scaled(mesh_box_.high)});
}

absl::StatusOr<std::vector<uint32_t>> DomainMesher::AddPointsNear(std::span<const double> points,
                                                                  std::span<const uint32_t> near, RunContext& context) {
  const uint32_t count = structure_.vertex_count();
  absl::StatusOr<std::vector<uint32_t>> vertices = adder_->AddPoints(points, near, context);
  NoteAddedFrom(count);
  if (vertices.ok()) {
    context.SetVertices(structure_.vertex_count());
  }
  return vertices;
}

absl::StatusOr<uint32_t> DomainMesher::AddVertex(uint32_t near, std::span<const double> point) {
  const uint32_t count = structure_.vertex_count();
  absl::StatusOr<uint32_t> vertex = adder_->AddVertex(near, point);
  NoteAddedFrom(count);
  return vertex;
}

absl::StatusOr<std::vector<double>> DomainMesher::NearestNeighborDistances(std::span<const uint32_t> vertices) const {
  return VertexQueries<2>(domain_, structure_, numbering_).NearestNeighborDistances(vertices);
}

absl::StatusOr<std::vector<Cell>> DomainMesher::ClippedCells(std::span<const uint32_t> vertices, double beta) const {
  return VertexQueries<2>(domain_, structure_, numbering_).ClippedCells(vertices, beta);
}

absl::StatusOr<Mesh> DomainMesher::Extract(int threads, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckRefined(made_.has_value(), threads));
  context.EnterPhase(Phase::kSimplices);
  Mesh mesh;
  mesh.dimension = 2;
  mesh.domain_low.assign(mesh_box_.low.begin(), mesh_box_.low.end());
  mesh.domain_high.assign(mesh_box_.high.begin(), mesh_box_.high.end());
  if (made_->AreTrianglesTaken()) {  // by an earlier mesh
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Subsegment> broken, MakeTriangles(made_->chains, threads, context));
    if (!broken.empty()) {
      return absl::InternalError("a subsegment is no longer an edge");
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(mesh.points, numbering_.PointsFrom(structure_, domain_, 0, context));
  mesh.input_vertex = numbering_.input_vertex();
  WELLSPACE_RETURN_IF_ERROR(SetOrigins(mesh, context));
  DomainSimplices triangles = std::exchange(made_->triangles, {});
  Simplices& simplices = triangles.simplices;
  mesh.simplices = std::move(simplices.indices);
  mesh.statistics.max_radius_edge = simplices.max_radius_edge;
  mesh.statistics.min_angle_deg = simplices.min_angle_deg;
  WELLSPACE_RETURN_IF_ERROR(SetBoundary(mesh, context));
  WELLSPACE_RETURN_IF_ERROR(SetRegions(mesh, triangles.faces, context));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t exempt, CountExempt(mesh, context));
  context.EnterPhase(Phase::kDone);
  figures_.simplices_seconds += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  figures_.NoteMesh(mesh);
  SetStatistics(mesh, exempt);
  return mesh;
}

absl::Status DomainMesher::Update(Mesh& mesh, int threads, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckRefined(made_.has_value(), threads));
  WELLSPACE_RETURN_IF_ERROR(CheckLastMesh(mesh, 2, figures_.extracted_vertices, figures_.extracted_simplices));
  WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
  return absl::OkStatus();
}

// Where vertices come from.
absl::Status DomainMesher::SetOrigins(Mesh& mesh, const RunContext& context) const {
  mesh.vertex_origins.assign(mesh.vertex_count(), kSteinerOrigin);
  for (uint32_t p = 0; p < planar_->point_count(); ++p) {
    if (p % kVerticesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const std::span<const HalfEdge> ways = planar_->WaysFrom(VertexId{p});
    const auto sides = std::count_if(ways.begin(), ways.end(),
                                     [&](HalfEdge h) { return planar_->graph().segments[SegmentOf(h)].IsBoxSide(); });
    if (sides == 2) {
      mesh.vertex_origins[numbering_.OutputIndex(VertexId{p})] = kCornerOrigin;
    }
  }
  for (size_t i = mesh.input_vertex.size(); i > 0; --i) {
    if (const uint32_t v = mesh.input_vertex[i - 1]; v != kNoOutput) {
      mesh.vertex_origins[v] = static_cast<uint32_t>(i - 1);
    }
  }
  return context.Check();
}

// The subsegments, by what tells them apart; what is meshed is on the left of one that bounds it.
absl::Status DomainMesher::SetBoundary(Mesh& mesh, const RunContext& context) const {
  const std::vector<GraphSegment>& segments = planar_->graph().segments;
  std::set<int64_t> values;
  for (uint32_t s = 0; s < segments.size(); ++s) {
    if (s % kVerticesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    values.insert(PartOf(segments[s]));
  }
  const std::map<int64_t, int32_t> tags = NumberAboveZero(values);
  std::vector<std::pair<int32_t, uint32_t>> order;  // tags and segments
  order.reserve(segments.size());
  for (uint32_t s = 0; s < segments.size(); ++s) {
    order.emplace_back(tags.at(PartOf(segments[s])), s);
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(order, std::less<>(), context));
  mesh.vertex_tags.assign(structure_.vertex_count(), kNoTag);
  for (const auto& [tag, s] : order) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    if (mesh.boundary.empty() || mesh.boundary.back().tag != tag) {
      mesh.boundary.push_back({tag, PartName(PartOf(segments[s])), 0});
    }
    const bool is_left = planar_->faces().IsMeshed(planar_->faces().left_face[HalfEdgeOf(s, false)]);
    const std::span<const VertexId> chain = made_->chains.Of(s);
    for (size_t i = 0; i + 1 < chain.size(); ++i) {
      const uint32_t from = numbering_.OutputIndex(chain[i]);
      const uint32_t to = numbering_.OutputIndex(chain[i + 1]);
      mesh.facets.push_back(is_left ? from : to);
      mesh.facets.push_back(is_left ? to : from);
      ++mesh.boundary.back().facets;
      for (const uint32_t v : {from, to}) {
        mesh.vertex_tags[v] = mesh.vertex_tags[v] == kNoTag ? tag : mesh.vertex_tags[v];
      }
    }
  }
  return absl::OkStatus();
}

// The region of each triangle: that of its face, which `faces_of` has.
absl::Status DomainMesher::SetRegions(Mesh& mesh, std::span<const uint32_t> faces_of, const RunContext& context) const {
  std::set<int64_t> values;
  for (const Face& face : planar_->faces().faces) {
    if (face.is_meshed) {
      values.insert(face.region);
    }
  }
  const std::map<int64_t, int32_t> ids = NumberAboveZero(values);
  std::map<int32_t, int64_t> regions;
  for (const auto& [value, id] : ids) {
    regions[id] = value;
  }
  for (const auto& [id, value] : regions) {
    mesh.regions.push_back({id, value == 0 ? "domain" : absl::StrCat("region_", value)});
  }
  if (regions.size() > 1) {
    mesh.simplex_regions.reserve(mesh.simplex_count());
    for (const uint32_t face : faces_of) {
      if (mesh.simplex_regions.size() % kVerticesBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      mesh.simplex_regions.push_back(ids.at(planar_->faces().faces[face].region));
    }
  }
  return absl::OkStatus();
}

// How many triangles break rho.
absl::StatusOr<uint64_t> DomainMesher::CountExempt(const Mesh& mesh, const RunContext& context) const {
  uint64_t count = 0;
  if (mesh.statistics.max_radius_edge <= rho_) {
    return count;
  }
  for (size_t t = 0; t < mesh.simplices.size(); t += 3) {
    if (t % (3 * kVerticesBetweenChecks) == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Simplex<2> corners = {PointAt<2>(mesh.points, mesh.simplices[t]),
                                PointAt<2>(mesh.points, mesh.simplices[t + 1]),
                                PointAt<2>(mesh.points, mesh.simplices[t + 2])};
    count += RadiusEdgeRatio<2>(corners) > rho_ * (1 + kRatioTolerance) ? 1 : 0;
  }
  return count;
}

void DomainMesher::SetStatistics(Mesh& mesh, uint64_t exempt) const {
  MeshStatistics& statistics = mesh.statistics;
  statistics.input_points = mesh.input_vertex.size();
  const uint64_t added = mesh.input_vertex.size() - planar_->graph().point_of_input.size();
  const uint64_t new_vertices = numbering_.distinct_inputs() - planar_->point_count();
  statistics.duplicates = planar_->graph().counts.equal_points + added - new_vertices;
  const CleaningCounts& counts = planar_->graph().counts;
  DomainStatistics& domain = statistics.domain.emplace();
  domain.unmeshed_points = dropped_points_;
  domain.segments = planar_->segment_count();
  domain.subsegments = mesh.facet_count();
  domain.dropped_segments = counts.empty_segments + counts.duplicate_segments;
  domain.touching_points = counts.touching_vertices;
  domain.crossings = counts.crossings;
  domain.near_points = counts.near_vertices;
  domain.exempt_simplices = exempt;
  domain.min_input_angle_deg = planar_->MinAngle() * 180 / std::numbers::pi;
  statistics.vertices = mesh.vertex_count();
  statistics.simplices = mesh.simplex_count();
  figures_.SetSeconds(statistics);
  statistics.tree_leaves = structure_.tree().leaf_count();
  SetQueryFigures(refinement_->counters(), figures_.star_queries, statistics);
  SetTotals(statistics);
}

absl::StatusOr<MeshEstimate> DomainMesher::Estimate(const MeshParameters& parameters, const RunContext& context) const {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, 2));
  WELLSPACE_ASSIGN_OR_RETURN(
      MeshEstimate estimate,
      EstimateMeshOf<2>(structure_, CriteriaIn<2>(domain_, parameters, samples_), context, planar_.get()));
  estimate.memory_bytes += samples_.MemoryBytes();
  return estimate;
}

absl::StatusOr<std::unique_ptr<Mesher>> Mesher::CreateInDomain(const MeshParameters& parameters,
                                                               std::span<const double> points, const Features& features,
                                                               RunContext& context) {
  auto mesher = std::make_unique<DomainMesher>();
  WELLSPACE_RETURN_IF_ERROR(mesher->Initialize(parameters, points, features, context));
  return mesher;
}

}  // namespace wellspace::core
