#include "core/refine/refine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/refine/checks.h"
#include "core/refine/plane/plane_domain.h"
#include "core/refine/space/space_domain.h"

namespace wellspace::core {
namespace {

// Room is made for at most so many times the vertices that there are, even if more are predicted.
constexpr uint64_t kMostReserved = 8;

// Vertices refined between two reports of progress.
constexpr uint64_t kReportInterval = 256;

}  // namespace

absl::Status TooManyVerticesError(uint64_t max_vertices) {
  return absl::ResourceExhaustedError(
      absl::StrCat("the mesh needs more than max_vertices = ", max_vertices,
                   " vertices; raise max_vertices, the sizes that are asked for, or rho"));
}

template <typename Domain>
Refinement<Domain>::Refinement(QueryStructure<D>& structure, double min_edge, Domain domain)
    : structure_(structure),
      min_edge_(min_edge),
      domain_(std::move(domain)),
      pending_(structure, min_edge),
      rounds_(structure, domain_, pending_, stars_),
      checks_(structure) {}

template <typename Domain>
absl::Status Refinement<Domain>::Run(const MeshCriteria<D>& criteria, uint64_t max_vertices, int threads,
                                     RunContext& context, const RefinementObserver<D>& observer,
                                     const VertexPredictor& predict) {
  ThreadTeam team(threads);
  step_rules_.emplace(structure_, criteria, min_edge_);
  rules_.emplace(domain_.RulesFor(structure_, *step_rules_, nullptr));
  max_vertices_ = max_vertices;
  context_ = &context;
  observer_ = &observer;
  if (pending_.HasBegunFor(criteria)) {
    WELLSPACE_RETURN_IF_ERROR(Predict(predict));
  } else {
    pending_.End();
    WELLSPACE_RETURN_IF_ERROR(ScheduleAll(criteria, predict, team));
  }
  rounds_.BeginRun(*step_rules_, team, context);
  const absl::Cleanup end = [this] { rounds_.DropRun(); };  // where something is thrown
  absl::Status status = Loop();
  rounds_.EndRun(workspace_.own.counters);
  return status;
}

// Lines 2 to 4 of Figure 4, while another thread predicts how many vertices there will be.
template <typename Domain>
absl::Status Refinement<Domain>::ScheduleAll(const MeshCriteria<D>& criteria, const VertexPredictor& predict,
                                             ThreadTeam& team) {
  rounds_.ReattachAll();
  structure_.CommitAll();  // vertices added before an exception
  absl::Status predicted;
  const absl::Cleanup end = [&team] { team.Drop(); };  // of calls that are begun, where something is thrown
  team.BeginCall([&] { predicted = Predict(predict); });
  FeatureDistance<D> feature_sq;
  if constexpr (Domain::kHasFeatures) {
    feature_sq = [this](VertexId v, double limit_sq, Workspace<D>& workspace) {
      return rules_->NearestFeatureSq(v, limit_sq, workspace);
    };
  }
  const HugeVector<int16_t> first_buckets = pending_.FirstBuckets(criteria, *context_, team, feature_sq);
  team.End();
  WELLSPACE_RETURN_IF_ERROR(predicted);
  WELLSPACE_RETURN_IF_ERROR(context_->Check());
  stars_.Clear();
  Reserve(static_cast<uint32_t>(
      std::min({context_->estimated_vertices(), max_vertices_, kMostReserved * structure_.vertex_count()})));
  pending_.Begin(criteria, first_buckets);
  return absl::OkStatus();
}

// Tells the context how many vertices are predicted.
template <typename Domain>
absl::Status Refinement<Domain>::Predict(const VertexPredictor& predict) {
  if (predict == nullptr) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t vertices, predict());
  if (vertices > 0) {
    context_->SetEstimatedVertices(vertices);
  }
  return absl::OkStatus();
}

// Makes room for so many vertices, and some more, so that arrays need not be moved as they grow; unused room takes
// no memory.
template <typename Domain>
void Refinement<Domain>::Reserve(uint32_t vertices) {
  vertices += std::min(vertices / 8, std::numeric_limits<uint32_t>::max() - vertices);
  structure_.Reserve(vertices);
  stars_.Reserve(vertices);
  pending_.Reserve(vertices);
}

// Line 5: while vertices are pending, those of the lowest bucket are refined, in rounds where there are many.
template <typename Domain>
absl::Status Refinement<Domain>::Loop() {
  WELLSPACE_RETURN_IF_ERROR(RefineInRounds());  // the bucket that a stopped run has detached
  Schedule& schedule = pending_.schedule();
  for (int lowest = schedule.Lowest(); lowest >= 0; lowest = schedule.Lowest()) {
    if (rounds_.Begin(lowest)) {
      WELLSPACE_RETURN_IF_ERROR(RefineInRounds());
      continue;
    }
    rounds_.AwaitOthers();  // they may still write stars, which is done by this thread now
    VertexId v{};
    int bucket = 0;
    if (schedule.Pop(v, bucket)) {
      WELLSPACE_RETURN_IF_ERROR(RefineTaken(v, bucket));
    }
  }
  if constexpr (kChecks) {
    Require(schedule.size() == 0, schedule.size(), " vertices are pending still");
  }
  return absl::OkStatus();
}

// Refines the vertices that are pending below `bucket`.
template <typename Domain>
absl::Status Refinement<Domain>::RefineShorterThan(int bucket) {
  Schedule& schedule = pending_.schedule();
  VertexId below{};
  int its_bucket = 0;
  while (schedule.HasBelow(bucket) && schedule.Pop(below, its_bucket, bucket)) {
    WELLSPACE_RETURN_IF_ERROR(RefineTaken(below, its_bucket));
  }
  return absl::OkStatus();
}

// Refines the vertices that rounds have detached, and before each the vertices that are pending in lower buckets.
template <typename Domain>
absl::Status Refinement<Domain>::RefineInRounds() {
  rounds_.ForgetRecords();
  while (!rounds_.AreDone()) {
    domain_.MakeRoom(QueryStructure<D>::kMostUncommitted);
    rounds_.BeginRound();
    absl::Status status;
    for (Batch<Domain>* batch = rounds_.NextBatch(); batch != nullptr;
         batch = status.ok() ? rounds_.NextBatch() : nullptr) {
      status = RefineBatch(*batch);
    }
    rounds_.EndRound();
    WELLSPACE_RETURN_IF_ERROR(status);
    rounds_.NextRound();
  }
  return absl::OkStatus();
}

template <typename Domain>
absl::Status Refinement<Domain>::RefineBatch(Batch<Domain>& batch) {
  rounds_.BeginBatch(batch);
  for (; !batch.IsRefined(); ++batch.refined) {
    rounds_.Prefetch(batch);
    const size_t first = rounds_.inserted_count();
    WELLSPACE_RETURN_IF_ERROR(RefineShorterThan(rounds_.bucket()));
    batch.NoteConflicts(rounds_.InsertedFrom(first));
    if (pending_.schedule().IsPendingIn(batch.next(), rounds_.bucket())) {
      WELLSPACE_RETURN_IF_ERROR(RefineNextOf(batch));
    } else {
      batch.NoteConflicts(batch.records.ExpectedOf(batch.refined));
    }
  }
  return absl::OkStatus();
}

// Refines the next vertex of a batch, which is pending: by its record, if that is still valid, or else by its cell.
template <typename Domain>
absl::Status Refinement<Domain>::RefineNextOf(Batch<Domain>& batch) {
  const VertexId v = batch.next();
  const int bucket = rounds_.bucket();
  const size_t first = rounds_.inserted_count();
  const VertexId first_new{structure_.vertex_count()};
  pending_.schedule().Take(v);
  absl::Status status = context_->Check();
  if (status.ok()) {
    const bool is_valid = IsNextStillValid(batch);
    rounds_.CountRecord(batch, is_valid);
    bool is_done = false;
    if (is_valid) {
      RecordedSteps<Domain> steps(batch);
      const absl::StatusOr<bool> refined = RefineVertex(v, bucket, steps);
      status = refined.status();
      is_done = refined.ok() && *refined;
    }
    if (status.ok() && !is_done) {
      status = RefineByCell(v, bucket);
    }
  }
  if (!status.ok()) {
    pending_.schedule().DetachAgain(v, bucket);
    return status;
  }
  batch.NoteInserted(rounds_.InsertedFrom(first), first_new);
  return CountRefined();
}

// Refines `v`, which was taken from `bucket`.
template <typename Domain>
absl::Status Refinement<Domain>::RefineTaken(VertexId v, int bucket) {
  absl::Status status = context_->Check();
  if (status.ok()) {
    status = RefineByCell(v, bucket);
  }
  if (!status.ok()) {
    pending_.schedule().AddToBucket(v, bucket);
    return status;
  }
  return CountRefined();
}

// Whether the record of the next vertex of a batch is still valid.
template <typename Domain>
bool Refinement<Domain>::IsNextStillValid(const Batch<Domain>& batch) const {
  return batch.IsStillValid(batch.refined, structure_.point(batch.next())) &&
         domain_.AreInOrder(batch.records.RequestsOf(batch.refined));
}

// Refines `v`, which was taken from `bucket`, by steps that are computed. The order that is checked is promised in a
// box; where images have just been inserted it is for RefineVertex to see to it.
template <typename Domain>
absl::Status Refinement<Domain>::RefineByCell(VertexId v, int bucket) {
  CurrentCells cells{*this};
  for (bool is_done = false; !is_done;) {
    typename Domain::template Steps<CurrentCells> steps(*rules_, v, EdgeLimitSq(bucket), cells, workspace_);
    if constexpr (kChecks && !Domain::kHasFeatures) {
      steps.cell().Place();
      if (images_.empty()) {
        checks_.CheckOrder(pending_.schedule(), v, steps.cell(), bucket);
      }
    }
    WELLSPACE_ASSIGN_OR_RETURN(is_done, RefineVertex(v, bucket, steps));
  }
  return absl::OkStatus();
}

// [HT08] Figure 4 for one vertex, `v`, which was taken from `bucket`: makes the insertions that its steps ask for,
// until its cell has no more faults that count in the bucket, or a shorter edge comes first. False if `steps` ended
// before: images were inserted, which they do not know, and may cut the cell; then v goes on with other steps.
template <typename Domain>
template <typename Steps>
absl::StatusOr<bool> Refinement<Domain>::RefineVertex(VertexId v, int bucket, Steps& steps) {
  while (true) {
    const Assessment* const found = steps.Assess();  // lines 7, 8 and 11
    if (found == nullptr) {
      return absl::ResourceExhaustedError(absl::StrCat("the cell of a vertex has more than ", kMostNodes<D>,
                                                       " nodes; lower rho = ", step_rules_->criteria().rho));
    }
    if (pending_.IsNew(v)) {
      pending_.Notify(v, *found, steps.Notices());  // line 14, put off until v is looked at
    }
    if (pending_.HasShorterThan(bucket)) {
      pending_.Postpone(v, *found, bucket);
      return true;
    }
    const typename Domain::Request* const request = steps.NextRequest();
    if (request == nullptr) {
      Finish(v, *found, bucket, steps);
      return true;
    }
    // In 5-D and 6-D a cell may ask for a dozen points, which take milliseconds each.
    WELLSPACE_RETURN_IF_ERROR(context_->Check());
    WELLSPACE_ASSIGN_OR_RETURN(const VertexId x, Insert(*request));  // lines 12 and 13
    if constexpr (Domain::kMayHaveImages) {
      if (!images_.empty()) {
        return false;
      }
    }
    steps.Inserted(x);
  }
}

// Line 15: `v`, which was taken from `bucket` and asks for nothing there, is done, or pending in a later bucket.
template <typename Domain>
template <typename Steps>
void Refinement<Domain>::Finish(VertexId v, const Assessment& found, int bucket, Steps& steps) {
  pending_.Remember(v, found, steps.NodesToWatch());
  if (!found.IsGood()) {
    pending_.ScheduleLater(v, found, bucket, step_rules_->ClipRadius(EdgeLimitSq(bucket)));
    return;
  }
  stars_.Write(v, steps.FindStar(stars_), structure_.vertex_count());
  if (pending_.HasToNotify(v)) {
    pending_.Notify(v, found, steps.Notices());
  }
}

// Inserts the vertex that is asked for, and its images, and makes them pending: all or, on an error, none.
template <typename Domain>
absl::StatusOr<VertexId> Refinement<Domain>::Insert(const typename Domain::Request& request) {
  const SteinerPoint<D>& point = request.point;
  if constexpr (Domain::kMayHaveImages) {
    FindImages(request);
  }
  if (structure_.vertex_count() + images_.size() >= max_vertices_) {
    return TooManyVerticesError(max_vertices_);
  }
  WELLSPACE_RETURN_IF_ERROR(CheckPoint(point));
  for (const Image& image : images_) {
    WELLSPACE_RETURN_IF_ERROR(CheckPoint(image.point));
  }
  if constexpr (kChecks) {
    rounds_.CommitAdded();
    checks_.CheckInsertion(*step_rules_, request.insertion, request.candidate, request.point,
                           request.place.IsOnFeature());
  }
  Insertion insertion = request.insertion;
  insertion.vertex = AddVertex(insertion.near, insertion.near, point, request.place);
  for (const Image& image : images_) {
    AddVertex(image.near, insertion.vertex, image.point, image.place);
  }
  if (*observer_) {
    (*observer_)(structure_, insertion);
  }
  return insertion.vertex;
}

// Finds the images of a vertex, and how near to them vertices are or, by then, will be. All vertices of a periodic side
// have theirs: where there is none at a place there is none at its images. Which of the nearest vertices is found
// depends on what has been committed: it may say where the search begins, and nothing else.
template <typename Domain>
void Refinement<Domain>::FindImages(const typename Domain::Request& request) {
  images_.clear();
  if constexpr (Domain::kMayHaveImages) {
    if (!domain_.HasImages()) {
      return;
    }
    const Point<D>& p = request.point.position;
    domain_.ForEachImage(request, [&](const Point<D>& at, const typename Domain::Place& place) {
      const Neighbor nearest = structure_.NearestTo(at, kNoVertex, workspace_.other);
      double empty_sq = structure_.NearestUncommittedSq(at, nearest.distance_sq);
      empty_sq = std::min(empty_sq, DistanceSq<D>(at, p));
      for (const Image& other : images_) {
        empty_sq = std::min(empty_sq, DistanceSq<D>(at, other.point.position));
      }
      images_.push_back({{at, empty_sq}, nearest.vertex, place});
    });
  }
}

template <typename Domain>
absl::Status Refinement<Domain>::CheckPoint(const SteinerPoint<D>& point) const {
  return step_rules_->IsLongEnough(point)
             ? absl::OkStatus()
             : absl::ResourceExhaustedError(absl::StrCat("refinement came to an edge of length ",
                                                         std::sqrt(std::max(0.0, point.empty_radius_sq)),
                                                         ", below the smallest that double arithmetic serves here, ",
                                                         min_edge_, "; raise rho = ", step_rules_->criteria().rho));
}

// Adds a vertex near `near`, and makes it pending, in the order of the schedule beside `beside`.
template <typename Domain>
VertexId Refinement<Domain>::AddVertex(VertexId near, VertexId beside, const SteinerPoint<D>& point,
                                       const typename Domain::Place& place) {
  const VertexId x = structure_.AddUncommitted(near, point.position);
  if (!rounds_.IsRecording() || *observer_ || structure_.uncommitted_count() == QueryStructure<D>::kMostUncommitted) {
    rounds_.CommitAdded();
  }
  domain_.Added(place);
  rounds_.NoteInserted(point.position);
  context_->SetVertices(structure_.vertex_count());
  AddPending(beside, x, point.empty_radius_sq);
  return x;
}

// Makes the new vertex `x`, which is near `near` and whose nearest neighbour is as near as it says, pending. Its
// neighbours are not notified here but when x is first looked at, by RefineVertex; except where a vertex watches nodes
// of a face that are not known.
template <typename Domain>
void Refinement<Domain>::AddPending(VertexId near, VertexId x, double nearest_sq) {
  pending_.Add(near, x, nearest_sq, [&](double radius) {
    Polytope<D>& cell = workspace_.other.cell;
    ComputeCell(x, CubeAround<D>(structure_.point(x), radius), workspace_.other);
    cell.Place();
    if (cell.IsTooLarge()) {
      return;
    }
    const FaceMask faces = structure_.faces(x);
    const Assessment found = Assess<D>(cell, faces, step_rules_->criteria(), nearest_sq);
    workspace_.notices.clear();
    step_rules_->AppendNotices(cell, faces, found, workspace_.notices);
    pending_.Notify(x, found, workspace_.notices);
  });
}

// Computes the cell of `v` among all vertices that have been added, not yet placed, clipped by `clip`.
template <typename Domain>
void Refinement<Domain>::ComputeCell(VertexId v, const Box<D>& clip, Workspace<D>& workspace) {
  structure_.UnplacedClippedVoronoi(v, clip, workspace);
  structure_.CutByUncommitted(v, workspace.cell);
  if (workspace.cell.IsTooLarge() && structure_.uncommitted_count() > 0) {
    rounds_.CommitAdded();  // with the nearest first it may not be
    structure_.UnplacedClippedVoronoi(v, clip, workspace);
  }
}

// Tells now and then how far the run is, and asks for the memory that it has come to.
template <typename Domain>
absl::Status Refinement<Domain>::CountRefined() {
  if (++refined_ % kReportInterval == 0) {
    const uint64_t of_samples = SampleTree<D>::BytesFor(step_rules_->criteria().sizes.samples().size());
    WELLSPACE_RETURN_IF_ERROR(
        context_->AllowMemory(structure_.MemoryBytes() + MemoryBytes() + of_samples + domain_.MemoryBytes()));
    // Of the vertices that there will be, most are yet to come where a small size is asked for.
    const uint64_t vertices = structure_.vertex_count();
    const uint64_t refined = vertices - std::min<uint64_t>(vertices, pending_.schedule().size());
    context_->SetPhaseFraction(static_cast<double>(refined) / std::max(vertices, context_->estimated_vertices()));
  }
  return absl::OkStatus();
}

template <typename Domain>
void Refinement<Domain>::VertexAdded(VertexId x) {
  if (!pending_.HasBegun()) {
    return;  // the next run schedules all
  }
  Neighbor nearest = structure_.NearestNeighbor(x, workspace_.own);
  nearest.distance_sq = rules_->NearestFeatureSq(x, nearest.distance_sq, workspace_.own);
  AddPending(nearest.vertex, x, nearest.distance_sq);
}

template <typename Domain>
void Refinement<Domain>::CellChanged(VertexId v, double nearest_sq) {
  stars_.GiveUp();
  pending_.CellChanged(v, nearest_sq);
}

template <typename Domain>
QueryCounters Refinement<Domain>::counters() const {
  QueryCounters counters = workspace_.own.counters;
  counters.Add(workspace_.other.counters);
  return counters;
}

template <typename Domain>
uint64_t Refinement<Domain>::MemoryBytes() const {
  return pending_.MemoryBytes() + stars_.MemoryBytes() + rounds_.MemoryBytes() +
         (workspace_.own.seen.size() + workspace_.other.seen.size()) * sizeof(uint32_t);
}

#define WELLSPACE_INSTANTIATE(D) template class Refinement<BoxDomain<D>>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE
template class Refinement<PlaneDomain>;
template class Refinement<SpaceDomain>;

}  // namespace wellspace::core
