#include "core/refine/speculation/rounds.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <thread>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "core/base/dimensions.h"
#include "core/base/memory/prefetch.h"
#include "core/refine/box_domain.h"
#include "core/refine/plane/plane_domain.h"
#include "core/refine/rounding.h"
#include "core/refine/space/space_domain.h"

namespace wellspace::core {
namespace {

// Fewer vertices of a bucket are refined as they come.
constexpr size_t kLeastInRounds = 64;
// A bucket is cut into so many strips, and so many vertices of each are a batch.
constexpr size_t kStrips = 8;
constexpr size_t kBatch = 128;
// The records of a batch are made in so many parts, in turn with other batches, so that threads come to the end of a
// round together; unless a thread would wait for the part before.
constexpr size_t kParts = 4;
// If less than this share of the records of a bucket were still valid, threads no longer speculate on it, nor on others
// unless they are so many times as large.
constexpr double kLeastShareValid = 2.0 / 3;
constexpr size_t kMoreThanDistrusted = 4;

// Cells of the vertices that were in the structure when speculation began, and of those that the batch expects to be
// inserted before. Notes in the record how far they reach.
template <typename Domain>
class SpeculatedCells {
 public:
  static constexpr int D = Domain::kDimension;

  SpeculatedCells(const QueryStructure<D>& structure, Batch<Domain>& batch, size_t at)
      : structure_(structure),
        inserted_(batch.records.inserted),
        record_(batch.records.by_vertex[at]),
        site_(structure.point(batch.vertices[at])) {}

  void ComputeOwn(VertexId v, const Box<D>& clip, Workspace<D>& workspace) {
    structure_.UnplacedClippedVoronoi(v, clip, workspace, inserted_);
    record_.reach_sq = workspace.cell.CutLimitSq();
  }

  const Polytope<D>* ComputeOther(VertexId u, const Box<D>& clip, Workspace<D>& workspace) {
    if (u >= inserted_.first()) {  // in no leaf
      is_known_ = false;
      return nullptr;
    }
    structure_.UnplacedClippedVoronoi(u, clip, workspace, inserted_);
    NoteBall(structure_.point(u), workspace.cell.CutLimitSq());
    is_known_ = is_known_ && !workspace.cell.IsTooLarge();
    workspace.cell.Place();
    return &workspace.cell;
  }

  // Notes that a vertex in this ball, given by its squared radius, would have changed the record.
  void NoteBall(const Point<D>& centre, double radius_sq) {
    const double reach = std::sqrt(radius_sq) + std::sqrt(DistanceSq<D>(centre, site_));
    record_.reach_sq = std::max(record_.reach_sq, reach * reach);
  }

  // Whether all cells of other vertices could be computed.
  bool IsKnown() const { return is_known_; }

 private:
  const QueryStructure<D>& structure_;
  const ExtraVertices<D>& inserted_;
  typename BatchRecords<Domain>::Record& record_;
  const Point<D> site_;
  bool is_known_ = true;
};

}  // namespace

template <typename Domain>
void Rounds<Domain>::BeginRun(const StepRules<D>& rules, ThreadTeam& team, const RunContext& context) {
  rules_ = &rules;
  team_ = &team;
  context_ = &context;
  distrusted_size_ = 0;
}

template <typename Domain>
void Rounds<Domain>::EndRun(QueryCounters& counters) {
  AwaitOthers();
  stars_.WriteLast();
  finished_ = {};
  for (const StepWorkspace<D>& workspace : workspaces_) {
    counters.Add(workspace.own.counters);
    counters.Add(workspace.other.counters);
  }
  workspaces_.clear();
  team_ = nullptr;
}

template <typename Domain>
void Rounds<Domain>::DropRun() {
  if (is_recording_ || stars_.IsWriting()) {
    team_->Drop();
    is_recording_ = false;
    stars_.EndWriting();
  }
  team_ = nullptr;
}

template <typename Domain>
bool Rounds<Domain>::Begin(int bucket) {
  Schedule& schedule = pending_.schedule();
  const size_t least = domain_.LeastInRounds(kLeastInRounds, structure_.vertex_count());
  if (schedule.MostIn(bucket) < least) {
    return false;
  }
  detached_ = schedule.Detach(bucket);
  if (detached_.size() < least) {  // the others have moved on
    for (const VertexId v : detached_) {
      schedule.Reattach(v, bucket);
    }
    detached_ = {};
    return false;
  }
  bucket_ = bucket;
  half_ = 0;
  speculated_count_ = 0;
  valid_count_ = 0;
  inserted_.clear();
  inserted_before_ = 0;
  batches_.resize(kStrips);
  for (size_t i = 0; i < kStrips; ++i) {
    batches_[i].strip_begin = i * detached_.size() / kStrips;
    batches_[i].strip_end = (i + 1) * detached_.size() / kStrips;
    TakeNext(batches_[i]);
  }
  return true;
}

// Makes the next vertices of a strip its batch.
template <typename Domain>
void Rounds<Domain>::TakeNext(Batch<Domain>& batch) {
  const size_t size = std::min(kBatch, batch.strip_end - batch.strip_begin);
  batch.vertices.assign(detached_.rend() - static_cast<std::ptrdiff_t>(batch.strip_end),
                        detached_.rend() - static_cast<std::ptrdiff_t>(batch.strip_end - size));
  batch.strip_end -= size;
  batch.refined = 0;
  batch.records.is_speculated = false;
}

template <typename Domain>
void Rounds<Domain>::ReattachAll() {
  Schedule& schedule = pending_.schedule();
  const auto reattach = [&](VertexId v) {
    if (schedule.IsPendingIn(v, bucket_)) {
      schedule.Reattach(v, bucket_);
    }
  };
  for (const Batch<Domain>& batch : batches_) {
    const auto begin = detached_.begin();
    std::for_each(begin + static_cast<std::ptrdiff_t>(batch.strip_begin),
                  begin + static_cast<std::ptrdiff_t>(batch.strip_end), reattach);
    std::for_each(batch.vertices.rbegin(), batch.vertices.rend() - static_cast<std::ptrdiff_t>(batch.refined),
                  reattach);
  }
  batches_.clear();
  detached_ = {};
}

template <typename Domain>
void Rounds<Domain>::ForgetRecords() {
  for (Batch<Domain>& batch : batches_) {
    batch.records.is_speculated = false;
  }
}

template <typename Domain>
void Rounds<Domain>::BeginRound() {
  next_batch_ = 0;
  if (team_->threads() > 1) {
    Speculate();
  }
}

template <typename Domain>
Batch<Domain>* Rounds<Domain>::NextBatch() {
  const std::span<Batch<Domain>> now = HalfOf(0);
  if (next_batch_ < now.size()) {
    return &now[next_batch_++];
  }
  const std::span<Batch<Domain>> then = HalfOf(1);
  if (next_batch_ == now.size() + then.size()) {
    return nullptr;
  }
  while (is_recording_ && team_->Help()) {
  }
  Batch<Domain>& batch = then[next_batch_ - now.size()];
  if (!is_recording_ || team_->HasEnded() ||
      !std::atomic_ref(batch.records.is_speculated).load(std::memory_order_acquire)) {
    return nullptr;
  }
  ++next_batch_;
  return &batch;
}

// In small buckets, and where there are few blocks, batches that are refined at about the same time may be near each
// other, so that many records conflict: there it is not worth while. The data of queries does not change until
// CommitAdded.
template <typename Domain>
void Rounds<Domain>::Speculate() {
  const std::span<Batch<Domain>> now = HalfOf(0);
  const std::span<Batch<Domain>> then = HalfOf(1);
  if (detached_.size() <= kMoreThanDistrusted * distrusted_size_) {
    notes_insertions_ = now.front().records.is_speculated;
    stars_.SetCollecting(notes_insertions_);
    if (!notes_insertions_) {
      AwaitOthers();  // they may still write stars, which is done by this thread then
    }
    return;
  }
  stars_.BeginCollecting();
  workspaces_.resize(team_->threads());
  const auto record = [this](Batch<Domain>& batch, size_t part, size_t parts) {
    RecordPart(batch, part, parts, workspaces_[ThreadTeam::CurrentThread()]);
  };
  if (!now.front().records.is_speculated) {
    Prepare(now);
    team_->ForEach(now.size(), [&](size_t i) { record(now[i], 0, 1); });
  }
  Prepare(then);
  bytes_before_ = CountBytes();
  is_recording_ = true;
  notes_insertions_ = true;
  const size_t parts = 2 * static_cast<size_t>(team_->threads()) <= then.size() ? kParts : 1;
  team_->Begin(parts * then.size(), [=](size_t i) { record(then[i % then.size()], i / then.size(), parts); });
}

template <typename Domain>
void Rounds<Domain>::Prepare(std::span<Batch<Domain>> batches) {
  const Schedule& schedule = pending_.schedule();
  for (Batch<Domain>& batch : batches) {
    for (const VertexId v : batch.vertices) {
      schedule.Prefetch(v);
    }
    batch.Prepare(structure_.vertex_count(), inserted_before_ + inserted_.size());
    for (size_t i = batch.refined; i < batch.vertices.size(); ++i) {
      batch.records.by_vertex[i].is_wanted = schedule.IsPendingIn(batch.vertices[i], bucket_);
      batch.records.by_vertex[i].has_to_notify = !Domain::kNotifiesAll || pending_.HasToNotify(batch.vertices[i]);
    }
  }
}

// Makes the records of one of equal parts of the vertices of a batch that have not been refined, once the parts before
// it are done. Nothing but the records and the workspace is written.
template <typename Domain>
void Rounds<Domain>::RecordPart(Batch<Domain>& batch, size_t part, size_t parts, StepWorkspace<D>& workspace) const {
  BatchRecords<Domain>& records = batch.records;
  const std::atomic_ref parts_done(records.parts_done);
  while (parts_done.load(std::memory_order_acquire) < part) {
    std::this_thread::yield();
  }
  // Also where something is thrown.
  const absl::Cleanup count = [&] { parts_done.store(part + 1, std::memory_order_release); };
  const size_t size = batch.vertices.size() - batch.refined;
  const size_t end = batch.refined + (part + 1) * size / parts;
  for (size_t i = batch.refined + part * size / parts; i < end; ++i) {
    records.Begin(i);
    PrefetchAhead(std::span(batch.vertices), i, [this](VertexId v, int step) { structure_.Prefetch(v, step); });
    if (records.by_vertex[i].is_wanted && !context_->IsCancelled()) {
      Record(batch, i, workspace);
      if (!records.by_vertex[i].is_known) {
        records.CutTo(records.by_vertex[i].begin);
      }
    }
  }
  if (part + 1 == parts) {
    std::atomic_ref(records.is_speculated).store(true, std::memory_order_release);
  }
}

// Records the steps of vertex `at`: the loop of Refinement::RefineVertex, but each step is recorded in the place of
// being done. Returns before the last step, and the record is not known, if that step is an error or depends on one.
template <typename Domain>
void Rounds<Domain>::Record(Batch<Domain>& batch, size_t at, StepWorkspace<D>& workspace) const {
  const VertexId v = batch.vertices[at];
  SpeculatedCells<Domain> cells(structure_, batch, at);
  const typename Domain::Expected expected(batch.records.inserted, batch.records.requests);
  const typename Domain::Rules rules = domain_.RulesFor(structure_, *rules_, &expected);
  typename Domain::template Steps<SpeculatedCells<Domain>> steps(rules, v, pending_.schedule().UpperLengthSq(bucket_),
                                                                 cells, workspace);
  BatchRecords<Domain>& records = batch.records;
  while (!context_->IsCancelled()) {
    const Assessment* const found = steps.Assess();
    if (found == nullptr) {
      return;
    }
    RecordedStep step{*found};
    const size_t first_notice = records.notices.size();
    if (records.by_vertex[at].has_to_notify) {
      steps.AppendNotices(records.notices);
    }
    step.notices = static_cast<uint32_t>(records.notices.size() - first_notice);
    const typename Domain::Request* const request = steps.NextRequest();
    if (!cells.IsKnown()) {
      return;
    }
    step.asks = request != nullptr;
    if (const Assessment* const reassessed = steps.Reassessed(); reassessed != nullptr) {
      step.is_reassessed = true;
      records.reassessed.push_back(*reassessed);
    }
    records.steps.push_back(step);
    if (request == nullptr) {
      steps.AppendNodesToWatch(records.watched);
      if (found->IsGood()) {
        steps.FindStar(records.star);
        records.AppendStar(at);
      }
      records.SetKnown(at, structure_.point(v));
      return;
    }
    if (!rules_->IsLongEnough(request->point)) {
      return;
    }
    if constexpr (Domain::kAsksForDistances) {
      cells.NoteBall(request->point.position, kBeyond * request->point.empty_radius_sq);
    }
    records.requests.push_back(*request);
    steps.Inserted(records.inserted.Append(request->point.position));
  }
}

template <typename Domain>
void Rounds<Domain>::EndRound() {
  AwaitOthers();
  notes_insertions_ = false;
  if (speculated_count_ >= kLeastInRounds && valid_count_ < kLeastShareValid * static_cast<double>(speculated_count_)) {
    distrusted_size_ = detached_.size();
  }
  for (Batch<Domain>& batch : HalfOf(0)) {
    std::swap(batch.records.simplices, batch.written);
  }
  stars_.BeginWriting(*team_);
  structure_.CommitAll();
  // The records of the next batches may have been made without the insertions meanwhile.
  const Batch<Domain>& next = HalfOf(1).front();
  const size_t is_known = next.records.is_speculated ? next.first_unknown - inserted_before_ : inserted_.size();
  inserted_.erase(inserted_.begin(), inserted_.begin() + static_cast<std::ptrdiff_t>(is_known));
  inserted_before_ += is_known;
}

template <typename Domain>
void Rounds<Domain>::NextRound() {
  for (Batch<Domain>& batch : HalfOf(0)) {
    TakeNext(batch);
  }
  half_ = 1 - half_;
  if (std::all_of(batches_.begin(), batches_.end(), [](const Batch<Domain>& batch) { return batch.IsLast(); })) {
    finished_ = std::exchange(batches_, {});
    detached_ = {};
  }
}

template <typename Domain>
void Rounds<Domain>::BeginBatch(Batch<Domain>& batch) {
  if (batch.records.is_speculated) {
    batch.BeginReplay(InsertedFrom(batch.first_unknown - inserted_before_));
  }
}

template <typename Domain>
void Rounds<Domain>::Prefetch(const Batch<Domain>& batch) const {
  PrefetchAhead(std::span(batch.vertices), batch.refined, [&](VertexId v, int step) {
    if (step == 0) {
      pending_.Prefetch(v);
      stars_.Prefetch(v);
    }
    if (!batch.records.is_speculated) {
      structure_.Prefetch(v, step);
    }
  });
}

template <typename Domain>
void Rounds<Domain>::AwaitOthers() {
  if (is_recording_ || stars_.IsWriting()) {
    team_->End();
    is_recording_ = false;
    stars_.EndWriting();
  }
}

template <typename Domain>
void Rounds<Domain>::CommitAdded() {
  AwaitOthers();
  structure_.CommitAll();
}

template <typename Domain>
uint64_t Rounds<Domain>::CountBytes() const {
  uint64_t bytes = detached_.size() * sizeof(VertexId);
  for (const auto* batches : {&batches_, &finished_}) {
    for (const Batch<Domain>& batch : *batches) {
      bytes += batch.MemoryBytes();
    }
  }
  for (const StepWorkspace<D>& workspace : workspaces_) {
    bytes += (workspace.own.seen.size() + workspace.other.seen.size()) * sizeof(uint32_t);
  }
  return bytes;
}

#define WELLSPACE_INSTANTIATE(D) template class Rounds<BoxDomain<D>>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE
template class Rounds<PlaneDomain>;
template class Rounds<SpaceDomain>;

}  // namespace wellspace::core
