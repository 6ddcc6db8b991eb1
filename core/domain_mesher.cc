#include "core/domain_mesher.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/estimate/estimate.h"
#include "core/feasibility.h"
#include "core/simplex/boundary.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// A vertex is in the diametral disc of a subsegment only if it is nearer to its centre by more than this, relatively: a
// foot makes a right angle, as far as doubles go.
constexpr double kDiscTolerance = 1e-9;

// Segments whose subsegments one thread looks at together.
constexpr uint32_t kSegmentsTogether = 1024;

// A ratio that exceeds rho by less, relatively, is what was rounded.
constexpr double kRatioTolerance = 1e-9;

// Refuses parameters that a domain in the plane does not have.
absl::Status CheckDomainParameters(const MeshParameters& parameters, const Features& features) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  if (parameters.dimension != 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("dimension: segments bound domains in 2-D alone, and it is ", parameters.dimension));
  }
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with segments has the radius-edge criterion alone");
  }
  if (parameters.merge_distance > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("merge_distance: near points of a domain with segments are not merged, and it is ",
                     parameters.merge_distance, "; leave it out"));
  }
  if (features.faces != FaceRule::kBox && !parameters.domain_low.empty()) {
    return absl::InvalidArgumentError(
        "domain: a box bounds a domain with segments by the face rule `box` alone; leave one of the two out");
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

std::string PartName(int64_t part) {
  if (part < std::numeric_limits<int32_t>::min()) {
    return FaceName(static_cast<int>(part - kFirstSide));
  }
  return part == 0 ? "unmarked" : absl::StrCat("marker_", part);
}

}  // namespace

absl::Status DomainMesher::Initialize(const MeshParameters& parameters, std::span<const double> points,
                                      const Features& features, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckDomainParameters(parameters, features));
  if (points.size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", points.size(), " coordinates are not a multiple of the dimension, 2"));
  }
  context.EnterPhase(Phase::kTree);
  Box<2> box{{0, 0}, {1, 1}};
  if (features.faces == FaceRule::kBox) {
    if (parameters.domain_low.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<2>(points, parameters.margin, context));
    } else {
      box = {PointAt<2>(parameters.domain_low, 0), PointAt<2>(parameters.domain_high, 0)};
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(DomainCloud made, MakeDomainCloud(points, features, box, parameters.threads, context));
  domain_ = made.domain;
  planar_ = std::move(made.planar);
  points_ = std::move(made.points);
  dropped_points_ = made.dropped_points;
  const uint64_t max_vertices = VertexBudget(parameters);
  if (planar_->point_count() > max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("the ", planar_->point_count(),
                                                     " points of the domain are more than ",
                                                     "max_vertices = ", max_vertices, " vertices; raise max_vertices"));
  }
  const HugeVector<uint32_t> sorted_of = made.cloud.SortedOfInputs();
  output_index_.resize(sorted_of.size());
  for (uint32_t i = 0; i < sorted_of.size(); ++i) {
    output_index_[sorted_of[i]] = i;
  }
  Box<2> around{{points_[0], points_[1]}, {points_[0], points_[1]}};
  for (size_t i = 0; i < points_.size(); i += 2) {
    around.Include({PointAt<2>(points_, i / 2), PointAt<2>(points_, i / 2)});
  }
  mesh_low_.assign(around.low.begin(), around.low.end());
  mesh_high_.assign(around.high.begin(), around.high.end());
  structure_.SetSegments(planar_->Ends());
  WELLSPACE_RETURN_IF_ERROR(structure_.Initialize(made.cloud.grid, std::move(made.cloud.points),
                                                  kLeavesPerVertex * max_vertices + 4, parameters.threads, context));
  WELLSPACE_RETURN_IF_ERROR(
      CheckSeparation<2>(domain_, structure_, 0, made.cloud.first_input, parameters.threads, context));
  refinement_.emplace(structure_, domain_.MinEdge(), planar_.get());
  context.SetVertices(structure_.vertex_count());
  tree_seconds_ = absl::ToDoubleSeconds(context.TimeIn(Phase::kTree));
  return absl::OkStatus();
}

uint64_t DomainMesher::memory_bytes() const {
  return structure_.MemoryBytes() + refinement_->MemoryBytes() + planar_->MemoryBytes() +
         points_.size() * sizeof(double) + output_index_.size() * sizeof(uint32_t) +
         (made_.has_value() ? (made_->simplices.indices.size() + made_->faces.size()) * sizeof(uint32_t) : 0);
}

absl::Status DomainMesher::Refine(const MeshParameters& parameters, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with segments has the radius-edge criterion alone");
  }
  made_.reset();
  context.EnterPhase(Phase::kRefinement);
  const absl::Status status = MakeConforming(parameters, context);
  if (!status.ok()) {
    made_.reset();
  }
  return status;
}

// Refines, and splits subsegments, until every one is an edge of the triangulation, with nothing in its diametral disc.
absl::Status DomainMesher::MakeConforming(const MeshParameters& parameters, RunContext& context) {
  const MeshCriteria<2> criteria = CriteriaIn<2>(domain_, parameters);
  rho_ = criteria.rho;
  made_seconds_ = 0;
  while (true) {
    WELLSPACE_RETURN_IF_ERROR(
        refinement_->Run(criteria, VertexBudget(parameters), parameters.threads, context, nullptr, nullptr));
    const PlanarDomain::Chains chains = planar_->FindChains();
    std::vector<Subsegment> to_split = EncroachedSubsegments(chains, parameters.threads);
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    // Triangles are made before it is known whether this phase ends: their time is not its own.
    const absl::Duration refined = context.TimeIn(Phase::kRefinement);
    refinement_seconds_ = absl::ToDoubleSeconds(refined) - made_seconds_;
    if (to_split.empty()) {
      HugeVector<uint32_t> output_index(structure_.vertex_count());
      for (uint32_t v = 0; v < structure_.vertex_count(); ++v) {
        output_index[v] = OutputIndex(VertexId{v});
      }
      WELLSPACE_ASSIGN_OR_RETURN(
          made_, ComputeDomainSimplices(structure_, *planar_, chains, output_index, parameters.threads, context));
      // Ties that doubles broke, at very small angles.
      for (const uint32_t at : made_->broken) {
        const auto segment = static_cast<uint32_t>(std::upper_bound(chains.first.begin(), chains.first.end(), at) -
                                                   chains.first.begin() - 1);
        to_split.push_back({segment, chains.vertices[at], chains.vertices[at + 1]});
      }
      made_seconds_ += absl::ToDoubleSeconds(context.TimeIn(Phase::kRefinement) - refined);
    }
    if (to_split.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_RETURN_IF_ERROR(Split(to_split, parameters));
  }
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
std::vector<DomainMesher::Subsegment> DomainMesher::EncroachedSubsegments(const PlanarDomain::Chains& chains,
                                                                          int threads) const {
  const uint32_t segments = planar_->segment_count();
  std::vector<std::vector<Subsegment>> found((segments + kSegmentsTogether - 1) / kSegmentsTogether);  // by block
  ThreadTeam team(threads);
  std::vector<Workspace<2>> workspaces(team.threads());
  team.ForEach(found.size(), [&](size_t block) {
    const auto begin = static_cast<uint32_t>(block) * kSegmentsTogether;
    for (uint32_t segment = begin; segment < std::min(segments, begin + kSegmentsTogether); ++segment) {
      const std::span<const VertexId> chain = chains.Of(segment);
      for (size_t i = 0; i + 1 < chain.size(); ++i) {
        const Subsegment subsegment{segment, chain[i], chain[i + 1]};
        if (IsEncroached(subsegment, workspaces[ThreadTeam::CurrentThread()])) {
          found[block].push_back(subsegment);
        }
      }
    }
  });
  std::vector<Subsegment> encroached;
  for (const std::vector<Subsegment>& of_block : found) {
    encroached.insert(encroached.end(), of_block.begin(), of_block.end());
  }
  return encroached;
}

// Splits each subsegment in its middle.
absl::Status DomainMesher::Split(std::span<const Subsegment> subsegments, const MeshParameters& parameters) {
  for (const Subsegment& subsegment : subsegments) {
    const SegmentPoint place = planar_->MiddleOf(subsegment.segment, subsegment.from, subsegment.to);
    const Point<2> position = planar_->PositionOf(place);
    const Neighbor nearest = structure_.NearestTo(position, subsegment.from, workspace_);
    if (structure_.vertex_count() >= VertexBudget(parameters)) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the mesh needs more than max_vertices = ", VertexBudget(parameters),
                       " vertices; raise max_vertices or rho"));
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

absl::StatusOr<std::vector<uint32_t>> DomainMesher::AddPointsNear(std::span<const double> /*points*/,
                                                                  std::span<const uint32_t> /*near*/,
                                                                  RunContext& /*context*/) {
  return absl::FailedPreconditionError("points: none can be added to the mesh of a domain with segments");
}

absl::StatusOr<uint32_t> DomainMesher::AddVertex(uint32_t /*near*/, std::span<const double> /*point*/) {
  return absl::FailedPreconditionError("point: none can be added to the mesh of a domain with segments");
}

absl::StatusOr<std::vector<double>> DomainMesher::NearestNeighborDistances(
    std::span<const uint32_t> /*vertices*/) const {
  return absl::FailedPreconditionError("vertices: the mesh of a domain with segments answers no queries");
}

absl::StatusOr<std::vector<Cell>> DomainMesher::ClippedCells(std::span<const uint32_t> /*vertices*/,
                                                             double /*beta*/) const {
  return absl::FailedPreconditionError("vertices: the mesh of a domain with segments answers no queries");
}

absl::StatusOr<Mesh> DomainMesher::Extract(int threads, RunContext& context) {
  if (!made_.has_value()) {
    return absl::FailedPreconditionError("the mesh has not been refined; refine it first");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckThreads(threads));
  context.EnterPhase(Phase::kSimplices);
  Mesh mesh;
  mesh.dimension = 2;
  mesh.domain_low = mesh_low_;
  mesh.domain_high = mesh_high_;
  SetPoints(mesh);
  mesh.simplices = made_->simplices.indices;
  mesh.statistics.max_radius_edge = made_->simplices.max_radius_edge;
  mesh.statistics.min_angle_deg = made_->simplices.min_angle_deg;
  SetBoundary(planar_->FindChains(), mesh);
  SetRegions(made_->faces, mesh);
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  context.EnterPhase(Phase::kDone);
  simplices_seconds_ = made_seconds_ + absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  SetStatistics(mesh);
  return mesh;
}

absl::Status DomainMesher::Update(Mesh& mesh, int threads, RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
  return absl::OkStatus();
}

// The vertices, and where they come from.
void DomainMesher::SetPoints(Mesh& mesh) const {
  const uint32_t vertices = structure_.vertex_count();
  mesh.points.assign(points_.begin(), points_.end());
  mesh.points.resize(size_t{2} * vertices);
  mesh.vertex_origins.assign(vertices, kSteinerOrigin);
  for (uint32_t v = 0; v < vertices; ++v) {
    const uint32_t output = OutputIndex(VertexId{v});
    if (v >= planar_->point_count()) {
      const Point<2> p = domain_.Unscaled(structure_.point(VertexId{v}));
      std::copy(p.begin(), p.end(), mesh.points.begin() + size_t{2} * output);
    } else if (const uint32_t input = planar_->graph().input_of_point[v]; input != PlanarGraph::kNoInput) {
      mesh.vertex_origins[output] = input;
    } else {
      const std::span<const HalfEdge> ways = planar_->WaysFrom(VertexId{v});
      const bool is_corner = std::count_if(ways.begin(), ways.end(), [&](HalfEdge h) {
                               return planar_->graph().segments[SegmentOf(h)].IsBoxSide();
                             }) == 2;
      mesh.vertex_origins[output] = is_corner ? kCornerOrigin : kSteinerOrigin;
    }
  }
  for (const uint32_t point : planar_->graph().point_of_input) {
    mesh.input_vertex.push_back(point == PlanarGraph::kNoInput ? kNoOutput : OutputIndex(VertexId{point}));
  }
}

// The subsegments, by what tells them apart; what is meshed is on the left of one that bounds it.
void DomainMesher::SetBoundary(const PlanarDomain::Chains& chains, Mesh& mesh) const {
  const std::vector<GraphSegment>& segments = planar_->graph().segments;
  std::set<int64_t> values;
  for (const GraphSegment& segment : segments) {
    values.insert(PartOf(segment));
  }
  const std::map<int64_t, int32_t> tags = NumberAboveZero(values);
  std::vector<std::pair<int32_t, uint32_t>> order;  // tags and segments
  for (uint32_t s = 0; s < segments.size(); ++s) {
    order.emplace_back(tags.at(PartOf(segments[s])), s);
  }
  std::sort(order.begin(), order.end());
  mesh.vertex_tags.assign(structure_.vertex_count(), kNoTag);
  for (const auto& [tag, s] : order) {
    if (mesh.boundary.empty() || mesh.boundary.back().tag != tag) {
      mesh.boundary.push_back({tag, PartName(PartOf(segments[s])), 0});
    }
    const bool is_left = planar_->faces().IsMeshed(planar_->faces().left_face[HalfEdgeOf(s, false)]);
    const std::span<const VertexId> chain = chains.Of(s);
    for (size_t i = 0; i + 1 < chain.size(); ++i) {
      const uint32_t from = OutputIndex(chain[i]);
      const uint32_t to = OutputIndex(chain[i + 1]);
      mesh.facets.push_back(is_left ? from : to);
      mesh.facets.push_back(is_left ? to : from);
      ++mesh.boundary.back().facets;
      for (const uint32_t v : {from, to}) {
        mesh.vertex_tags[v] = mesh.vertex_tags[v] == kNoTag ? tag : mesh.vertex_tags[v];
      }
    }
  }
}

// The region of each triangle: that of its face.
void DomainMesher::SetRegions(std::span<const uint32_t> faces, Mesh& mesh) const {
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
    mesh.simplex_regions.reserve(faces.size());
    for (const uint32_t face : faces) {
      mesh.simplex_regions.push_back(ids.at(planar_->faces().faces[face].region));
    }
  }
}

// How many triangles break rho.
uint64_t DomainMesher::CountExempt(const Mesh& mesh) const {
  uint64_t count = 0;
  if (mesh.statistics.max_radius_edge <= rho_) {
    return count;
  }
  for (size_t t = 0; t < mesh.simplices.size(); t += 3) {
    const Simplex<2> corners = {PointAt<2>(mesh.points, mesh.simplices[t]),
                                PointAt<2>(mesh.points, mesh.simplices[t + 1]),
                                PointAt<2>(mesh.points, mesh.simplices[t + 2])};
    count += RadiusEdgeRatio<2>(corners) > rho_ * (1 + kRatioTolerance) ? 1 : 0;
  }
  return count;
}

void DomainMesher::SetStatistics(Mesh& mesh) const {
  MeshStatistics& statistics = mesh.statistics;
  statistics.input_points = mesh.input_vertex.size();
  statistics.duplicates = planar_->graph().counts.equal_points;
  const CleaningCounts& counts = planar_->graph().counts;
  DomainStatistics& domain = statistics.domain.emplace();
  domain.unmeshed_points = dropped_points_;
  domain.segments = planar_->segment_count();
  domain.subsegments = mesh.facet_count();
  domain.dropped_segments = counts.empty_segments + counts.duplicate_segments;
  domain.touching_points = counts.touching_vertices;
  domain.crossings = counts.crossings;
  domain.near_points = counts.near_vertices;
  domain.exempt_simplices = CountExempt(mesh);
  domain.min_input_angle_deg = planar_->MinAngle() * 180 / std::numbers::pi;
  statistics.vertices = mesh.vertex_count();
  statistics.simplices = mesh.simplex_count();
  statistics.tree_seconds = tree_seconds_;
  statistics.refinement_seconds = refinement_seconds_;
  statistics.simplices_seconds = simplices_seconds_;
  statistics.tree_leaves = structure_.tree().leaf_count();
  SetQueryFigures(refinement_->counters(), made_->simplices.counters, statistics);
  SetTotals(statistics);
}

absl::StatusOr<MeshEstimate> DomainMesher::Estimate(const MeshParameters& parameters, const RunContext& context) const {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size,
                             EstimateSize<2>(structure_, CriteriaIn<2>(domain_, parameters), context));
  MeshEstimate estimate;
  estimate.vertices = SaturatedCount(size.vertices);
  estimate.simplices = SaturatedCount(size.simplices);
  estimate.memory_bytes = SaturatedCount(size.bytes);
  estimate.bytes_per_vertex = size.bytes / size.vertices;
  estimate.tree_leaves = structure_.tree().leaf_count();
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
