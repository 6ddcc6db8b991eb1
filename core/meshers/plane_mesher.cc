#include "core/meshers/plane_mesher.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/base/stopwatch.h"
#include "core/base/thread_team.h"
#include "core/estimate/domain_shape.h"
#include "core/input/near_points.h"
#include "core/input/sorted_cloud.h"
#include "core/meshers/feasibility.h"
#include "core/meshers/plane_labels.h"

namespace wellspace::core {
namespace {

// A vertex is in the diametral disc of a subsegment only if it is nearer to its centre by more than this, relatively: a
// foot makes a right angle, as far as doubles go.
constexpr double kDiscTolerance = 1e-9;

// Segments whose subsegments one thread looks at together.
constexpr uint32_t kSegmentsTogether = 1024;

// Refuses spans of other lengths than each other's.
absl::Status CheckShapes(const Features& features) {
  if (features.ends.size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("segments: ", features.ends.size(), " ends are not a multiple of 2"));
  }
  if (!features.markers.empty() && features.markers.size() != features.segment_count()) {
    return absl::InvalidArgumentError(absl::StrCat("segments: ", features.markers.size(),
                                                   " markers are not one for each of ", features.segment_count(),
                                                   " segments, nor none"));
  }
  if (!features.is_open.empty() && features.is_open.size() != features.segment_count()) {
    return absl::InvalidArgumentError(absl::StrCat("segments: ", features.is_open.size(),
                                                   " marks of open ones are not one for each of ",
                                                   features.segment_count(), " segments, nor none"));
  }
  if (!features.groups.empty() && features.groups.size() != features.segment_count()) {
    return absl::InvalidArgumentError(absl::StrCat("segments: ", features.groups.size(),
                                                   " groups are not one for each of ", features.segment_count(),
                                                   " segments, nor none"));
  }
  return absl::OkStatus();
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

}  // namespace

absl::Status PlaneMesher::CheckInput(const Input& input) const { return CheckShapes(*input.features); }

uint64_t PlaneMesher::BuildingBytes(const MeshParameters& parameters, const Input& input) const {
  return (parameters.merge_distance > 0 ? input.points.size() / 2 * kMergeBytes<2> : 0) +
         DomainCloudBytes(input.points.size() / 2, input.features->segment_count(), input.features->seeds.size()) +
         (parameters.periodic_axes.empty() ? 0 : PeriodicSides::BytesFor(input.features->segment_count()));
}

absl::Status PlaneMesher::Build(const MeshParameters& parameters, const Input& input, RunContext& context) {
  const Features& features = *input.features;
  Box<2> box{{0, 0}, {1, 1}};
  if (features.faces == FaceRule::kBox) {
    if (parameters.domain_low.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<2>(input.points, parameters.margin, context));
    } else {
      box = {PointAt<2>(parameters.domain_low, 0), PointAt<2>(parameters.domain_high, 0)};
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(DomainCloud made, MakeDomainCloud(input.points, features, box, parameters.merge_distance,
                                                               VertexBudget(parameters), parameters.threads, context,
                                                               parameters.periodic_axes));
  frame_ = made.frame;
  planar_ = std::move(made.planar);
  least_area_ = LeastAreaOf(*planar_, features.seeds, frame_.scale);
  dropped_points_ = made.dropped_points;
  WELLSPACE_RETURN_IF_ERROR(NumberPoints(made, input.points, context));
  WELLSPACE_RETURN_IF_ERROR(BuildTree(parameters, "points of the domain", made.cloud, planar_->Ends(), context));
  meshed_box_.low = meshed_box_.high = frame_.Unscaled(structure_.point(VertexId{0}));
  NoteAddedFrom(0);
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(frame_, parameters, context));
  merge_distance_ = parameters.merge_distance;
  placer_.emplace(frame_, structure_, *planar_, merge_distance_);
  return absl::OkStatus();
}

// Numbers the points of the graph in the order that they have there.
absl::Status PlaneMesher::NumberPoints(const DomainCloud& made, std::span<const double> points,
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
  std::vector<uint32_t> stayed;  // where points were merged, and are meshed
  if (planar_->graph().counts.merged_points > 0) {
    for (const uint32_t input : planar_->graph().input_of_point) {
      if (input != PlanarGraph::kNoInput) {
        stayed.push_back(input);
      }
    }
  }
  numbering_.Begin(std::move(names), points, stayed);
  return absl::OkStatus();
}

// They may be a little outside of the box, beside segments that they are on.
void PlaneMesher::NoteAddedFrom(uint32_t first) {
  for (uint32_t v = first; v < structure_.vertex_count(); ++v) {
    const Point<2> p = frame_.Unscaled(structure_.point(VertexId{v}));
    meshed_box_.Include({p, p});
  }
  structure_.SetBoxOfCells({frame_.Scaled(meshed_box_.low), frame_.Scaled(meshed_box_.high)});
}

uint64_t PlaneMesher::OtherBytes() const {
  uint64_t bytes = planar_->MemoryBytes();
  if (made_.has_value()) {
    bytes += (made_->triangles.simplices.indices.size() + made_->triangles.faces.size() +
              made_->chains.vertices.size() + made_->chains.first.size()) *
             sizeof(uint32_t);
  }
  return bytes;
}

absl::Status PlaneMesher::CheckDemands(const MeshParameters& parameters) const {
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with segments has the radius-edge criterion alone");
  }
  return absl::OkStatus();
}

absl::Status PlaneMesher::CheckFeasibleHere(const MeshParameters& parameters) const {
  return core::CheckFeasible(DomainShape(*planar_), frame_, parameters, samples_, planar_->point_count(), least_area_);
}

// Splits subsegments that are no edges of the triangulation, or have something in their diametral disc; if there are
// none, the triangles are made.
absl::StatusOr<bool> PlaneMesher::Conform(const MeshParameters& parameters, RunContext& context) {
  PlanarDomain::Chains chains = planar_->FindChains();
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<Subsegment> to_split,
                             EncroachedSubsegments(chains, parameters.threads, context));
  if (to_split.empty()) {
    const double no_time = 0;
    const Stopwatch stopwatch(figures_.simplices_seconds, no_time);
    WELLSPACE_ASSIGN_OR_RETURN(to_split, MakeTriangles(std::move(chains), parameters.threads, context));
  }
  WELLSPACE_RETURN_IF_ERROR(Split(to_split, parameters, context));
  rho_ = CriteriaOf(parameters).rho;
  return to_split.empty();
}

// Makes the triangles, unless subsegments are no edges, and are to be split: ties that doubles broke, at very small
// angles.
absl::StatusOr<std::vector<PlaneMesher::Subsegment>> PlaneMesher::MakeTriangles(PlanarDomain::Chains chains,
                                                                                int threads, RunContext& context) {
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
bool PlaneMesher::IsEncroached(const Subsegment& subsegment, Workspace<2>& workspace) const {
  const auto [segment, from, to] = subsegment;
  const Point<2>& p = structure_.point(from);
  const Point<2>& q = structure_.point(to);
  const Neighbor nearest = structure_.NearestTo({0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])}, from, workspace);
  // Rounding of the centre may make one of the ends the nearest.
  const double rounding = kPlaceRounding * (std::abs(p[0]) + std::abs(p[1]));
  const double radius = 0.5 * std::sqrt(DistanceSq<2>(p, q)) * (1 - kDiscTolerance) - rounding;
  return nearest.vertex != from && nearest.vertex != to && std::sqrt(nearest.distance_sq) < radius;
}

// The subsegments in whose diametral disc a vertex lies that no cell has seen, since it is clipped on a side that is
// not meshed.
absl::StatusOr<std::vector<PlaneMesher::Subsegment>> PlaneMesher::EncroachedSubsegments(
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

// Splits each subsegment in its middle, and its image with it.
absl::Status PlaneMesher::Split(std::span<const Subsegment> subsegments, const MeshParameters& parameters,
                                const RunContext& context) {
  std::map<uint32_t, std::vector<double>> split_by_image;  // by segment: distances from its end a
  for (const Subsegment& subsegment : subsegments) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const auto [segment, from, to] = subsegment;
    const auto is_between = [&, s = segment, u = from, w = to](double distance) {
      return planar_->DistanceFromEnd(u, s, false) < distance && distance < planar_->DistanceFromEnd(w, s, false);
    };
    const auto by_image = split_by_image.find(segment);
    if (by_image != split_by_image.end() && std::any_of(by_image->second.begin(), by_image->second.end(), is_between)) {
      continue;
    }
    const SegmentPoint place = planar_->MiddleOf(segment, from, to);
    const SegmentPoint image = planar_->ImageOf(place);
    WELLSPACE_ASSIGN_OR_RETURN(const NewOnSegment added, CheckOnSegment(place, from, 0, parameters));
    std::optional<NewOnSegment> added_image;  // with its image, or not at all
    if (image.IsOnSegment()) {
      WELLSPACE_ASSIGN_OR_RETURN(added_image, CheckOnSegment(image, kNoVertex, 1, parameters));
    }
    AddOnSegment(added);
    if (added_image.has_value()) {
      AddOnSegment(*added_image);
      split_by_image[image.segment].push_back(planar_->DistanceFromEnd(image, false));
    }
  }
  return absl::OkStatus();
}

// Refuses a vertex on a segment that may not be there; near the vertex `near` if that is one, and after `before` others
// that are to be added.
absl::StatusOr<PlaneMesher::NewOnSegment> PlaneMesher::CheckOnSegment(const SegmentPoint& place, VertexId near,
                                                                      uint64_t before,
                                                                      const MeshParameters& parameters) {
  const Point<2> position = planar_->PositionOf(place);
  const Neighbor nearest = structure_.NearestTo(position, near, workspace_);
  if (structure_.vertex_count() + before >= VertexBudget(parameters)) {
    return TooManyVerticesError(VertexBudget(parameters));
  }
  if (nearest.distance_sq < frame_.MinEdge() * frame_.MinEdge()) {
    const Point<2> at = frame_.Unscaled(position);
    return absl::ResourceExhaustedError(
        absl::StrCat("segments: a part of one at (", at[0], ", ", at[1], ") is only ",
                     2 * std::sqrt(nearest.distance_sq) / frame_.scale,
                     " long, and another vertex is still too near to it; raise the angles or distances there"));
  }
  return NewOnSegment{.place = place, .position = position, .near = near == kNoVertex ? nearest.vertex : near};
}

void PlaneMesher::AddOnSegment(const NewOnSegment& added) {
  const VertexId v = structure_.AddVertex(added.near, added.position);
  planar_->AddVertex(added.place, 0);
  refinement_->VertexAdded(v);
}

absl::StatusOr<PlaneMesher::Made> PlaneMesher::MakeSimplices(int threads, RunContext& context) {
  if (made_->AreTrianglesTaken()) {  // by an earlier mesh
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Subsegment> broken, MakeTriangles(made_->chains, threads, context));
    if (!broken.empty()) {
      return absl::InternalError("a subsegment is no longer an edge");
    }
  }
  DomainSimplices triangles = std::exchange(made_->triangles, {});
  triangles.simplices.counters = {};  // they have been counted when the triangles were made
  return Made{.simplices = std::move(triangles.simplices), .faces = std::move(triangles.faces)};
}

absl::Status PlaneMesher::Describe(Mesh& mesh, std::span<const uint32_t> faces, int /*threads*/,
                                   const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(SetOrigins(*planar_, numbering_, mesh, context));
  WELLSPACE_RETURN_IF_ERROR(SetBoundary(*planar_, made_->chains, numbering_, mesh, context));
  WELLSPACE_RETURN_IF_ERROR(SetRegions(*planar_, faces, mesh, context));
  WELLSPACE_ASSIGN_OR_RETURN(mesh.statistics.domain.emplace().exempt_simplices, CountExempt(mesh, rho_, context));
  return absl::OkStatus();
}

void PlaneMesher::AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& /*stars*/) const {
  const CleaningCounts& counts = planar_->graph().counts;
  const uint64_t added = statistics.input_points - planar_->graph().point_of_input.size();
  const uint64_t new_vertices = numbering_.distinct_inputs() - planar_->point_count();
  statistics.merged_points = counts.merged_points + numbering_.merged_inputs();
  statistics.duplicates = counts.equal_points + added - new_vertices - numbering_.merged_inputs();
  DomainStatistics& domain = *statistics.domain;  // since Describe
  domain.unmeshed_points = dropped_points_;
  domain.segments = planar_->segment_count();
  domain.subsegments = mesh.facet_count();
  domain.dropped_segments = counts.empty_segments + counts.duplicate_segments;
  domain.touching_points = counts.touching_vertices;
  domain.crossings = counts.crossings;
  domain.near_points = counts.near_vertices;
  domain.unused_seeds = planar_->faces().unused_seeds;
  domain.first_unused_seed = planar_->faces().first_unused_seed;
  domain.min_input_angle_deg = planar_->MinAngle() * 180 / std::numbers::pi;
}

}  // namespace wellspace::core
