#include "core/refine/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/refine/checks.h"
#include "core/refine/rounding.h"
#include "core/tree/leaf_blocks.h"

namespace wellspace::core {
namespace {

// A cell is clipped at this times the longest edge of its bucket; for a large rho at that and a quarter more, so that a
// bad node is seen.
constexpr double kClipFactor = 4;
constexpr double kClipRatioFactor = 1.25;
// What counts for a new vertex at once is this times its empty radius away: no farther out than the region that bottom-up
// work has graded. Its cell is clipped so to announce it.
constexpr double kAround = 1.5;

// Room is made for at most so many times the vertices that there are, whatever is predicted.
constexpr uint64_t kMostReserved = 8;

// Vertices whose first edges one thread looks for at a time.
constexpr size_t kScheduledTogether = 1024;

// Vertices looked at between two reports of progress.
constexpr uint64_t kReportInterval = 256;

// The least float that is not less.
float RoundedUp(double x) {
  const auto nearest = static_cast<float>(x);
  return nearest < x ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
}

}  // namespace

template <int D>
Refinement<D>::Refinement(QueryStructure<D>& structure, double min_edge)
    : structure_(structure), min_edge_(min_edge), schedule_(min_edge) {}

template <int D>
absl::Status Refinement<D>::Run(const Demands<D>& demands, uint64_t max_vertices, int threads, RunContext& context,
                                const RefinementObserver<D>& observer, const VertexPredictor& predict) {
  ThreadTeam team(threads);
  plain_ratio_ = demands.criterion == Criterion::kRadiusEdge && demands.sizes.IsUnbounded() ? demands.rho : 0;
  off_center_factor_ = OffCenterFactor<D>(demands.rho, false);
  boundary_factor_ = OffCenterFactor<D>(demands.rho, demands.criterion == Criterion::kRadiusEdge);
  clip_factor_ = std::max(kClipFactor, kClipRatioFactor * demands.rho);
  max_vertices_ = max_vertices;
  context_ = &context;
  observer_ = &observer;
  distrusted_size_ = 0;
  if (demands_ != demands) {
    demands_.reset();
    WELLSPACE_RETURN_IF_ERROR(ScheduleAll(demands, predict, team));
    demands_ = demands;
  } else {
    WELLSPACE_RETURN_IF_ERROR(Predict(predict));
  }
  team_ = &team;
  const absl::Cleanup end = [this] {
    if (is_ahead_ || is_listing_) {  // something has been thrown
      team_->Drop();
      is_ahead_ = false;
      is_listing_ = false;
    }
    team_ = nullptr;
  };
  const absl::Status status = Loop();
  AwaitOthers();
  ListLast();
  packets_before_ = {};
  for (const OwnWorkspace& workspace : round_workspaces_) {
    own_.counters.Add(workspace.counters);
    own_.counters.Add(workspace.other.counters);
  }
  round_workspaces_.clear();
  return status;
}

// Improves the vertices that wait: in rounds where a bucket holds many.
template <int D>
absl::Status Refinement<D>::Loop() {
  WELLSPACE_RETURN_IF_ERROR(ServeRounds());  // those of a run that was stopped
  for (int lowest = schedule_.Lowest(); lowest >= 0; lowest = schedule_.Lowest()) {
    VertexId v{};
    int bucket = 0;
    if (BeginRounds(lowest)) {
      WELLSPACE_RETURN_IF_ERROR(ServeRounds());
    } else {
      AwaitOthers();  // they may still list stars, which Serve does, too
      if (schedule_.Pop(v, bucket)) {
        WELLSPACE_RETURN_IF_ERROR(Serve(v, bucket));
      }
    }
  }
  if constexpr (kChecks) {
    Require(schedule_.size() == 0, schedule_.size(), " vertices wait still");
  }
  return absl::OkStatus();
}

// Improves `v`, which was taken from `bucket`.
template <int D>
absl::Status Refinement<D>::Serve(VertexId v, int bucket) {
  absl::Status status = context_->Check();
  if (status.ok()) {
    status = Improve(v, bucket);
  }
  if (!status.ok()) {
    schedule_.AddToBucket(v, bucket);
    return status;
  }
  return CountServed(bucket);
}

// Tells now and then how far the run is.
template <int D>
absl::Status Refinement<D>::CountServed(int bucket) {
  return ++served_ % kReportInterval == 0 ? Report(bucket) : absl::OkStatus();
}

template <int D>
absl::Status Refinement<D>::Report(int bucket) {
  WELLSPACE_RETURN_IF_ERROR(context_->AllowMemory(structure_.MemoryBytes() + MemoryBytes()));
  context_->SetBucket(bucket);
  context_->SetPhaseFraction(1 - static_cast<double>(schedule_.size()) / structure_.vertex_count());
  return absl::OkStatus();
}

template <int D>
void Refinement<D>::VertexAdded(VertexId x) {
  if (!demands_.has_value()) {
    return;  // the first run looks at all
  }
  radius_sq_.resize(structure_.vertex_count(), Assessment::kNone);
  announced_.resize(structure_.vertex_count(), Announced::kToNone);
  const Neighbor nearest = structure_.ApproximateNearestNeighbor(x, own_);
  ScheduleNew(nearest.vertex, x, nearest.distance_sq);
}

template <int D>
uint64_t Refinement<D>::MemoryBytes() const {
  return schedule_.MemoryBytes() + (is_ahead_ ? bytes_ahead_ : stars_.MemoryBytes() + RoundBytes()) +
         (star_.capacity() + last_star_.capacity()) * sizeof(star_[0]) + watchers_.MemoryBytes() +
         radius_sq_.size() * sizeof(radius_sq_[0]) + announced_.size() * sizeof(Announced) +
         (own_.seen.size() + other_.seen.size()) * sizeof(uint32_t);
}

template <int D>
void Refinement<D>::CellChanged(VertexId v, double nearest_sq) {
  stars_.GiveUp();
  radius_sq_.resize(structure_.vertex_count(), Assessment::kNone);
  announced_.resize(structure_.vertex_count(), Announced::kToAll);
  const bool is_on_face = structure_.faces(v) != 0;
  Remember(v, is_on_face ? -nearest_sq : Assessment::kNone);
  if (is_on_face && demands_->criterion == Criterion::kWellSpaced) {
    schedule_.Add(v, nearest_sq);  // what is remembered for the faces leaves no room for the radius
  }
}

template <int D>
QueryCounters Refinement<D>::counters() const {
  QueryCounters counters = own_.counters;
  counters.Add(other_.counters);
  return counters;
}

// Tells the context how many vertices are predicted.
template <int D>
absl::Status Refinement<D>::Predict(const VertexPredictor& predict) {
  if (predict == nullptr) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t vertices, predict());
  if (vertices > 0) {
    context_->SetEstimatedVertices(vertices);
  }
  return absl::OkStatus();
}

// Schedules all vertices, while another thread predicts how many there will be.
template <int D>
absl::Status Refinement<D>::ScheduleAll(const Demands<D>& demands, const VertexPredictor& predict, ThreadTeam& team) {
  DropRounds();
  structure_.AdmitWaiting();  // where something was thrown
  const uint32_t count = structure_.vertex_count();
  absl::Status predicted;
  const absl::Cleanup end = [&team] { team.Drop(); };  // of what is begun, where something is thrown
  team.BeginCall([&] { predicted = Predict(predict); });
  std::vector<OwnWorkspace> workspaces(team.threads());
  HugeVector<int16_t> first_bucket(count);
  const LeafBlocks<D> blocks(structure_.tree(), kScheduledTogether);
  team.ForEach(blocks.count(), [&](size_t block) {
    Workspace<D>& workspace = workspaces[ThreadTeam::CurrentThread()];
    std::array<double, LeafTree<D>::kLeafCapacity> nearest_sq;
    blocks.ForEachBucketOf(block, [&](const typename LeafTree<D>::Bucket& bucket, NodeId leaf) {
      if (context_->IsCancelled()) {
        return;
      }
      structure_.NearestOfEach(leaf, workspace, std::span(nearest_sq).first(bucket.count));
      for (uint32_t i = 0; i < bucket.count; ++i) {
        const VertexId v = bucket.ids[i];
        // A node x farther from v than h(x) is farther than h(v) / 2, as h is 1-Lipschitz.
        first_bucket[Index(v)] = static_cast<int16_t>(
            schedule_.BucketOf(FirstEdgeSq(demands, structure_.point(v), structure_.faces(v), nearest_sq[i],
                                           demands.sizes.AtSq(structure_.point(v)) / 4)));
      }
    });
  });
  team.End();
  WELLSPACE_RETURN_IF_ERROR(predicted);
  WELLSPACE_RETURN_IF_ERROR(context_->Check());
  last_ = {};
  stars_.Clear();
  Reserve(static_cast<uint32_t>(std::min({context_->estimated_vertices(), max_vertices_, kMostReserved * count})));
  radius_sq_.assign(count, Assessment::kNone);
  watchers_.Clear();
  announced_.assign(count, Announced::kToAll);
  schedule_.Begin(count);
  for (uint32_t i = 0; i < count; ++i) {
    schedule_.AddToBucket(VertexId{i}, first_bucket[i]);
  }
  return absl::OkStatus();
}

// Makes room for so many vertices, and some more, so that arrays need not be moved as they grow; what is not used takes no memory.
template <int D>
void Refinement<D>::Reserve(uint32_t vertices) {
  vertices += std::min(vertices / 8, std::numeric_limits<uint32_t>::max() - vertices);
  structure_.Reserve(vertices);
  stars_.Reserve(vertices);
  schedule_.Reserve(vertices);
  radius_sq_.reserve(vertices);
  announced_.reserve(vertices);
}

// Nothing shorter than this can ask for something at a vertex at `p`: an edge, if the nearest neighbour is as near as it says; a face of
// the box; or a size, if the least that counts is as it says.
template <int D>
double Refinement<D>::FirstEdgeSq(const Demands<D>& demands, const Point<D>& p, FaceMask faces, double nearest_sq,
                                  double size_sq) const {
  double first_sq = nearest_sq;
  for (int face = 0; face < 2 * D; ++face) {
    if (((faces >> face) & 1) == 0) {
      const double distance = structure_.box().DistanceToFace(p, face);
      first_sq = std::min(first_sq, distance * distance);
    }
  }
  return std::min(first_sq, size_sq / (demands.rho * demands.rho));
}

// Schedules the new vertex `x`, which is near `near` and whose nearest neighbour is as near as it says, and at once those on a face of x that remember
// a node there which x cuts off: they may have to look sooner than x. Where nodes are not known x is announced for that.
template <int D>
void Refinement<D>::ScheduleNew(VertexId near, VertexId x, double nearest_sq) {
  schedule_.PutBeside(near, x);
  const Point<D>& p = structure_.point(x);
  const double around = kAround * std::sqrt(nearest_sq);
  if (structure_.faces(x) != 0) {
    watchers_.ForEachCutOff(p, structure_.faces(x),
                            [&](VertexId u) { Wake(u, DistanceSq<D>(p, structure_.point(u))); });
    ScheduleWoken();
    if (watchers_.SomeWatchAll()) {
      ComputeCell(x, CubeAround<D>(p, around), other_);
      other_.cell.Place();
      if (!other_.cell.IsTooLarge()) {
        const Assessment found = Assess<D>(other_.cell, structure_.faces(x), *demands_, nearest_sq);
        Announce(x, found, Mentions(other_.cell, structure_.faces(x), found));
      }
    }
  }
  schedule_.Add(x,
                FirstEdgeSq(*demands_, p, structure_.faces(x), nearest_sq, demands_->sizes.LeastAroundSq(p, around)));
}

// Inserts Steiner points until nothing that bucket `bucket` may ask for is wrong with the cell of `v`.
template <int D>
absl::Status Refinement<D>::Improve(VertexId v, int bucket) {
  const double edge_limit_sq = schedule_.UpperLengthSq(bucket);
  Polytope<D>& cell = own_.cell;
  ComputeCell(v, ClipAround(v, bucket), own_);
  if constexpr (kChecks) {
    cell.Place();
    CheckOrder(v, cell, bucket);
  }
  while (true) {
    if (cell.IsTooLarge()) {
      return absl::ResourceExhaustedError(absl::StrCat("the cell of a vertex has more than ", Polytope<D>::kMostNodes,
                                                       " nodes; lower rho = ", demands_->rho));
    }
    const Assessment found = AssessCell(cell, structure_.faces(v), edge_limit_sq);
    if (announced_[Index(v)] == Announced::kToNone) {
      Announce(v, found, Mentions(cell, structure_.faces(v), found));
    }
    if (GivesWay(v, found, bucket)) {
      return absl::OkStatus();
    }
    const std::optional<Request> request =
        NextRequest(v, cell, found, edge_limit_sq, [this](VertexId u, const Box<D>& clip) -> const Polytope<D>* {
          ComputeCell(u, clip, other_);
          other_.cell.Place();
          return other_.cell.IsTooLarge() ? nullptr : &other_.cell;
        });
    if (!request.has_value()) {
      watched_.clear();
      AppendNodesToWatch(v, cell, found, watched_);
      Star<D>& star = is_foreseen_ ? later_own_stars_.emplace_back() : star_;
      if (found.IsGood() && (is_foreseen_ || stars_.IsComplete())) {
        cell.FindStar(star);
      }
      Settle(v, found, bucket, Mentions(cell, structure_.faces(v), found), watched_, star);
      return absl::OkStatus();
    }
    // In 5-D and 6-D a cell may ask for a dozen points, which take milliseconds each.
    WELLSPACE_RETURN_IF_ERROR(context_->Check());
    WELLSPACE_ASSIGN_OR_RETURN(const VertexId x, Insert(*request));
    cell.CutBeforePlace(x, request->point.position);
  }
}

// Whether `v` has to wait since what was just added, or told of it, may ask for something by a shorter edge than those of `bucket`: that comes
// first.
template <int D>
bool Refinement<D>::GivesWay(VertexId v, const Assessment& found, int bucket) {
  if (!schedule_.HasBelow(bucket)) {
    return false;
  }
  Remember(v, Assessment::kNone);
  schedule_.AddToBucket(v, OwnBucket(found, bucket));
  return true;
}

// Where a vertex from `bucket` waits for what was found, which asks for something by an edge up to that bucket's limit if at all.
template <int D>
int Refinement<D>::OwnBucket(const Assessment& found, int bucket) const {
  return found.bad_node >= 0 ? std::min(bucket, schedule_.BucketOf(found.bound_sq / (demands_->rho * demands_->rho)))
                             : bucket;
}

// Computes the cell of `v`, not yet placed, clipped by `clip`.
template <int D>
void Refinement<D>::ComputeCell(VertexId v, const Box<D>& clip, Workspace<D>& workspace) {
  structure_.UnplacedClippedVoronoi(v, clip, workspace);
  structure_.CutByWaiting(v, workspace.cell);
  if (workspace.cell.IsTooLarge() && structure_.waiting_count() > 0) {
    AdmitWaiting();  // with the nearest first it may not be
    structure_.UnplacedClippedVoronoi(v, clip, workspace);
  }
}

// What is wrong with a cell, whose nodes are placed unless it is plainly good.
template <int D>
Assessment Refinement<D>::AssessCell(Polytope<D>& cell, FaceMask site_faces, double edge_limit_sq) const {
  if (cell.PlaceUnlessKeeps(plain_ratio_)) {
    Assessment plain;
    plain.is_plain = true;
    return plain;
  }
  return Assess<D>(cell, site_faces, *demands_, edge_limit_sq);
}

// Sets radius_sq_; where that stands for an edge, the nodes that are too far for it are `watched`, or are not known.
template <int D>
void Refinement<D>::Remember(VertexId v, double radius_sq, std::span<const WatchedNode<D>> watched) {
  if (radius_sq_[Index(v)] < 0) {
    watchers_.Remove(v);
  }
  radius_sq_[Index(v)] = RoundedUp(radius_sq);
  if (radius_sq < 0) {
    watchers_.Add(v, watched);
  }
}

// Appends the nodes of the cell of `v` on faces of v that are too far for the edge that is to be remembered, if one is, or for a longer one.
template <int D>
void Refinement<D>::AppendNodesToWatch(VertexId v, const Polytope<D>& cell, const Assessment& found,
                                       std::vector<WatchedNode<D>>& watched) const {
  if (found.own_face_edge_sq == Assessment::kNone) {
    return;
  }
  const double rounding = 4 * std::sqrt(D) * RoundingIn<D>(structure_.box());
  const double least_sq = demands_->rho * demands_->rho * found.own_face_edge_sq * (1 - kLengthRounding);
  for (const CellNode<D>& node : cell.nodes()) {
    const auto faces = static_cast<FaceMask>(cell.FacesOf(node) & structure_.faces(v));
    if (faces == 0 || node.radius_sq <= least_sq) {
      continue;
    }
    WatchedNode<D> one{cell.site(), (1 + kLengthRounding) * std::sqrt(node.radius_sq) + rounding, faces};
    for (int i = 0; i < D; ++i) {
      one.centre[i] += (faces >> (2 * i) & 3) == 0 ? node.x[i] : 0;
    }
    watched.push_back(one);
  }
}

// Declares a vertex from `bucket` that needs nothing now done, or puts it where it will be looked at again. Of its cell: the neighbours that Announce
// looks at, the nodes to watch, and the star, if it is good.
template <int D>
void Refinement<D>::Settle(VertexId v, const Assessment& found, int bucket, std::span<const Mention> mentions,
                           std::span<const WatchedNode<D>> watched, std::span<const std::array<VertexId, D>> star) {
  const double radius_sq = found.own_face_edge_sq != Assessment::kNone ? -found.own_face_edge_sq
                           : found.IsGood()                            ? found.radius_sq
                                                                       : Assessment::kNone;
  Remember(v, radius_sq, watched);
  if (!found.IsGood()) {
    schedule_.AddToBucket(v, NextBucket(found, bucket));
    return;
  }
  if (is_foreseen_) {
    later_listings_.push_back({v, star, structure_.vertex_count()});
  } else {
    PrefetchListing(star);
    ListLast();
    last_star_.assign(star.begin(), star.end());
    last_ = {v, last_star_, structure_.vertex_count()};
  }
  if (announced_[Index(v)] != Announced::kToAll) {
    Announce(v, found, mentions);
  }
}

// Where a vertex from `bucket` that needs nothing now, but is not done, is to be looked at again.
template <int D>
int Refinement<D>::NextBucket(const Assessment& found, int bucket) const {
  double next_sq = found.next_edge_sq;
  if (found.is_clipped) {
    // Beyond the clip only edges longer than this can be bad, or ones that share a node with a shorter edge.
    const double clip = ClipOf(bucket);
    next_sq = std::min(next_sq, clip * clip / (demands_->rho * demands_->rho));
  }
  return std::max(schedule_.BucketOf(next_sq), bucket + 1);
}

template <int D>
absl::StatusOr<VertexId> Refinement<D>::Insert(const Request& request) {
  const SteinerPoint<D>& point = request.point;
  if (structure_.vertex_count() >= max_vertices_) {
    return absl::ResourceExhaustedError(absl::StrCat("the mesh needs more than max_vertices = ", max_vertices_,
                                                     " vertices; raise max_vertices or rho"));
  }
  if (!IsLongEnough(point)) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "refinement came to an edge of length ", std::sqrt(std::max(0.0, point.empty_radius_sq)),
        ", below the smallest that double arithmetic serves here, ", min_edge_, "; raise rho = ", demands_->rho));
  }
  return Add(request);
}

// Adds the vertex that is asked for, and has it wait.
template <int D>
VertexId Refinement<D>::Add(const Request& request) {
  if constexpr (kChecks) {
    AdmitWaiting();
    CheckInsertion(request);
  }
  Insertion insertion = request.insertion;
  insertion.vertex = structure_.AddWaiting(insertion.near, request.point.position);
  if (!is_ahead_ || *observer_ || structure_.waiting_count() == QueryStructure<D>::kMostWaiting) {
    AdmitWaiting();
  }
  if (is_foreseen_) {
    inserted_.push_back(request.point.position);
  }
  radius_sq_.push_back(Assessment::kNone);
  announced_.push_back(Announced::kToNone);
  context_->SetVertices(structure_.vertex_count());
  ScheduleNew(insertion.near, insertion.vertex, request.point.empty_radius_sq);
  if (*observer_) {
    (*observer_)(structure_, insertion);
  }
  return insertion.vertex;
}

// Schedules those neighbours of `v` that it may have spoiled by being added: all, or, once it has been announced to some,
// those who do not wait. A simplex that breaks rho has v for a corner; its shortest edge is one of v's, and then v sees to it, or has belonged
// to a cell that kept rho, and still does. What is left:
// - well-spaced: v may be the nearest neighbour now, so that other nodes are too far;
// - a node on one of the neighbour's own faces was too far and asked for nothing: it may have become a circumcentre if
//   this cell touches the face beside it.
// An inner cell under radius-edge has neither.
template <int D>
void Refinement<D>::Announce(VertexId v, const Assessment& found, std::span<const Mention> mentions) {
  const bool is_first = announced_[Index(v)] == Announced::kToNone;
  announced_[Index(v)] = found.is_clipped ? Announced::kWithinClip : Announced::kToAll;
  const double rho_sq = demands_->rho * demands_->rho;
  const bool is_well_spaced = demands_->criterion == Criterion::kWellSpaced;
  for (const auto& [u, edge_sq, is_on_face] : mentions) {
    if (!is_first && schedule_.Waits(u)) {
      continue;
    }
    const double radius_sq = radius_sq_[Index(u)];
    const bool was_cut = radius_sq < 0 && is_on_face;
    const bool is_too_far = is_well_spaced && radius_sq > rho_sq * edge_sq;
    if (was_cut || is_too_far) {
      Wake(u, edge_sq);
    }
  }
  ScheduleWoken();
}

// Appends the neighbours that Announce may have to look at.
template <int D>
void Refinement<D>::AppendMentions(const Polytope<D>& cell, FaceMask site_faces, const Assessment& found,
                                   std::vector<Mention>& mentions) const {
  const bool is_well_spaced = demands_->criterion == Criterion::kWellSpaced;
  if (!is_well_spaced && site_faces == 0 && found.encroached_face < 0) {
    return;
  }
  for (const CellNode<D>& node : cell.nodes()) {
    const bool is_on_face = cell.FacesOf(node) != 0;
    if (!is_on_face && !is_well_spaced) {
      continue;
    }
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      if (plane.kind == PlaneKind::kBisector) {
        mentions.push_back({plane.vertex, 2 * plane.offset, is_on_face});
      }
    }
  }
}

template <int D>
std::span<const Mention> Refinement<D>::Mentions(const Polytope<D>& cell, FaceMask site_faces,
                                                 const Assessment& found) {
  mentions_.clear();
  AppendMentions(cell, site_faces, found, mentions_);
  return mentions_;
}

// Has ScheduleWoken schedule `u`, for the edge of that squared length that it has got, or for the one that it remembers.
template <int D>
void Refinement<D>::Wake(VertexId u, double edge_sq) {
  const double radius_sq = radius_sq_[Index(u)];
  woken_.emplace_back(u, radius_sq < 0 ? std::min(-radius_sq, edge_sq) : edge_sq);
}

template <int D>
void Refinement<D>::ScheduleWoken() {
  std::sort(woken_.begin(), woken_.end());  // what comes next is to depend on nothing but the cell
  for (const auto& [u, edge_sq] : woken_) {
    Remember(u, Assessment::kNone);
    schedule_.Add(u, edge_sq);
  }
  woken_.clear();
}

#define WELLSPACE_INSTANTIATE(D) template class Refinement<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
