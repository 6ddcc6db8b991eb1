// The part of Refinement that several threads do at once: ADR 23.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "core/base/dimensions.h"
#include "core/base/prefetch.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/refine/refine.h"

namespace wellspace::core {
namespace {

// Fewer vertices of a bucket are served as they come.
constexpr size_t kLeastInRounds = 64;
// A bucket is cut into so many stretches, of which each half is served by turns, so many vertices of each at a time.
constexpr size_t kStretches = 8;
constexpr size_t kPacket = 128;
// A packet is foreseen in so many parts, by turns with others, so that threads come to the end of a turn together; unless a thread would wait for
// the part before.
constexpr size_t kParts = 4;
// If less than this share of what was foreseen of a bucket held, no more is foreseen of it, nor of others but for those so many times as large.
constexpr double kLeastShareHeld = 2.0 / 3;
constexpr size_t kMoreThanDistrusted = 4;

}  // namespace

// Lifts those who wait in `bucket`, the lowest, to be served in rounds; false if there are too few.
template <int D>
bool Refinement<D>::BeginRounds(int bucket) {
  if (pending_.schedule().MostIn(bucket) < kLeastInRounds) {
    return false;
  }
  detached_ = pending_.schedule().Detach(bucket);
  if (detached_.size() < kLeastInRounds) {  // the others have moved on
    for (const VertexId v : detached_) {
      pending_.schedule().Reattach(v, bucket);
    }
    detached_ = {};
    return false;
  }
  round_bucket_ = bucket;
  turn_ = 0;
  foreseen_count_ = 0;
  held_count_ = 0;
  inserted_.clear();
  inserted_before_ = 0;
  packets_.resize(kStretches);
  for (size_t i = 0; i < kStretches; ++i) {
    packets_[i].stretch_begin = i * detached_.size() / kStretches;
    packets_[i].stretch_end = (i + 1) * detached_.size() / kStretches;
    TakeNext(packets_[i]);
  }
  return true;
}

// Makes the next of a stretch its packet.
template <int D>
void Refinement<D>::TakeNext(Packet<D>& packet) {
  const size_t size = std::min(kPacket, packet.stretch_end - packet.stretch_begin);
  packet.vertices.assign(detached_.rend() - static_cast<std::ptrdiff_t>(packet.stretch_end),
                         detached_.rend() - static_cast<std::ptrdiff_t>(packet.stretch_end - size));
  packet.stretch_end -= size;
  packet.served = 0;
  packet.is_foreseen = false;
}

// Has those who were detached, and have not been served, wait in their bucket alone.
template <int D>
void Refinement<D>::DropRounds() {
  const auto put_back = [this](VertexId v) {
    if (pending_.schedule().IsPendingIn(v, round_bucket_)) {
      pending_.schedule().Reattach(v, round_bucket_);
    }
  };
  for (const Packet<D>& packet : packets_) {
    const auto begin = detached_.begin();
    std::for_each(begin + static_cast<std::ptrdiff_t>(packet.stretch_begin),
                  begin + static_cast<std::ptrdiff_t>(packet.stretch_end), put_back);
    std::for_each(packet.vertices.rbegin(), packet.vertices.rend() - static_cast<std::ptrdiff_t>(packet.served),
                  put_back);
  }
  packets_.clear();
  detached_ = {};
}

template <int D>
uint64_t Refinement<D>::RoundBytes() const {
  uint64_t bytes = detached_.size() * sizeof(VertexId);
  for (const auto* packets : {&packets_, &packets_before_}) {
    for (const Packet<D>& packet : *packets) {
      bytes += packet.MemoryBytes();
    }
  }
  for (const OwnWorkspace& workspace : round_workspaces_) {
    bytes += (workspace.seen.size() + workspace.other.seen.size()) * sizeof(uint32_t);
  }
  return bytes;
}

// Serves those who were detached, and before the next of them whoever has come to wait in a lower bucket. Has the packets of one half of the stretches foreseen while it
// serves those of the other.
template <int D>
absl::Status Refinement<D>::ServeRounds() {
  for (Packet<D>& packet : packets_) {
    packet.is_foreseen = false;  // of a run that was stopped
  }
  while (!packets_.empty()) {
    if (team_->threads() > 1) {
      LookAhead();
    }
    const absl::Status status = ServeRound();
    EndRound();
    WELLSPACE_RETURN_IF_ERROR(status);
    for (Packet<D>& packet : HalfOf(turn_)) {
      TakeNext(packet);
    }
    turn_ = 1 - turn_;
    if (std::all_of(packets_.begin(), packets_.end(), [](const Packet<D>& packet) { return packet.IsServed(); })) {
      packets_before_ = std::exchange(packets_, {});
      detached_ = {};
    }
  }
  return absl::OkStatus();
}

// Serves the packets whose turn it is; then helps with what has been begun, and, while others are at the last of that, serves what is foreseen of
// the other half.
template <int D>
absl::Status Refinement<D>::ServeRound() {
  for (Packet<D>& packet : HalfOf(turn_)) {
    WELLSPACE_RETURN_IF_ERROR(ServePacket(packet));
  }
  for (Packet<D>& packet : HalfOf(1 - turn_)) {
    while (is_ahead_ && team_->Help()) {
    }
    if (!is_ahead_ || team_->HasEnded() || !std::atomic_ref(packet.is_foreseen).load(std::memory_order_acquire)) {
      break;
    }
    WELLSPACE_RETURN_IF_ERROR(ServePacket(packet));
  }
  return absl::OkStatus();
}

// Has the packets whose turn it is foreseen, unless they are, and other threads begin with those of the other half, if what they foresee is trusted: in small buckets, and where there are few blocks, packets that are served at
// about the same time may be near each other. What queries read does not change until AdmitWaiting.
template <int D>
void Refinement<D>::LookAhead() {
  const std::span<Packet<D>> now = HalfOf(turn_);
  const std::span<Packet<D>> then = HalfOf(1 - turn_);
  if (detached_.size() <= kMoreThanDistrusted * distrusted_size_) {
    is_foreseen_ = now.front().is_foreseen;
    stars_.SetCollecting(is_foreseen_);
    if (!is_foreseen_) {
      AwaitOthers();  // they may still list stars, which serving does then
    }
    return;
  }
  stars_.BeginCollecting();
  round_workspaces_.resize(team_->threads());
  const auto prepare = [this](std::span<Packet<D>> packets) {
    for (Packet<D>& packet : packets) {
      for (const VertexId v : packet.vertices) {
        pending_.schedule().Prefetch(v);
      }
      packet.Prepare(structure_.vertex_count(), inserted_before_ + inserted_.size());
      for (size_t i = packet.served; i < packet.vertices.size(); ++i) {
        packet.foreseen[i].is_wanted = pending_.schedule().IsPendingIn(packet.vertices[i], round_bucket_);
      }
    }
  };
  const auto foresee = [this](Packet<D>& packet, size_t part, size_t parts) {
    Foresee(packet, part, parts, round_workspaces_[ThreadTeam::CurrentThread()]);
  };
  if (!now.front().is_foreseen) {
    prepare(now);
    team_->ForEach(now.size(), [&](size_t i) { foresee(now[i], 0, 1); });
  }
  prepare(then);
  bytes_ahead_ = RoundBytes();
  is_ahead_ = true;
  is_foreseen_ = true;
  const size_t parts = 2 * static_cast<size_t>(team_->threads()) <= then.size() ? kParts : 1;
  team_->Begin(parts * then.size(), [=](size_t i) { foresee(then[i % then.size()], i / then.size(), parts); });
}

// Returns when other threads have done what was begun.
template <int D>
void Refinement<D>::AwaitOthers() {
  if (is_ahead_ || stars_.IsWriting()) {
    team_->End();
    is_ahead_ = false;
    stars_.EndWriting();
  }
}

// Has queries find all vertices that have been added, once other threads have done what was begun.
template <int D>
void Refinement<D>::AdmitWaiting() {
  AwaitOthers();
  structure_.AdmitWaiting();
}

// Ends what LookAhead has begun, and has another thread list stars.
template <int D>
void Refinement<D>::EndRound() {
  AwaitOthers();
  is_foreseen_ = false;
  if (foreseen_count_ >= kLeastInRounds && held_count_ < kLeastShareHeld * static_cast<double>(foreseen_count_)) {
    distrusted_size_ = detached_.size();
  }
  for (Packet<D>& packet : HalfOf(turn_)) {
    std::swap(packet.simplices, packet.listed);
  }
  stars_.BeginWriting(*team_);
  structure_.AdmitWaiting();
  // The next packets may not have been foreseen by what has been inserted meanwhile.
  const Packet<D>& next = HalfOf(1 - turn_).front();
  const size_t is_known = next.is_foreseen ? next.first_unforeseen - inserted_before_ : inserted_.size();
  inserted_.erase(inserted_.begin(), inserted_.begin() + static_cast<std::ptrdiff_t>(is_known));
  inserted_before_ += is_known;
}

// Asks the memory for what serving `v` reads besides its query.
template <int D>
void Refinement<D>::PrefetchServed(VertexId v) const {
  pending_.Prefetch(v);
  stars_.Prefetch(v);
}

// Foresees one of equal parts of those of a packet who have not been served, once the parts before it are. Nothing but the packet and the workspace is
// written.
template <int D>
void Refinement<D>::Foresee(Packet<D>& packet, size_t part, size_t parts, OwnWorkspace& workspace) const {
  const std::atomic_ref parts_foreseen(packet.parts_foreseen);
  while (parts_foreseen.load(std::memory_order_acquire) < part) {
    std::this_thread::yield();
  }
  const absl::Cleanup count = [&] { parts_foreseen.store(part + 1, std::memory_order_release); };  // whatever is thrown
  const size_t size = packet.vertices.size() - packet.served;
  const size_t end = packet.served + (part + 1) * size / parts;
  for (size_t i = packet.served + part * size / parts; i < end; ++i) {
    packet.BeginForeseen(i);
    PrefetchAhead(std::span(packet.vertices), i, [this](VertexId v, int step) { structure_.Prefetch(v, step); });
    if (packet.foreseen[i].is_wanted && !context_->IsCancelled()) {
      ForeseeOne(packet, i, workspace);
      if (!packet.foreseen[i].is_known) {
        packet.CutTo(packet.foreseen[i].begin);
      }
    }
  }
  if (part + 1 == parts) {
    packet.names.assign(packet.inserted.size(), kNoVertex);
    std::atomic_ref(packet.is_foreseen).store(true, std::memory_order_release);
  }
}

// As Improve, but what would be done is put down.
template <int D>
void Refinement<D>::ForeseeOne(Packet<D>& packet, size_t at, OwnWorkspace& workspace) const {
  const VertexId v = packet.vertices[at];
  const FaceMask faces = structure_.faces(v);
  const double edge_limit_sq = EdgeLimitSq(round_bucket_);
  Polytope<D>& cell = workspace.cell;
  structure_.UnplacedClippedVoronoi(v, ClipAround(v, round_bucket_), workspace, packet.inserted);
  packet.foreseen[at].reach_sq = cell.CutLimitSq();
  bool is_foreseeable = true;
  const auto cell_of = [&](VertexId u, const Box<D>& clip) -> const Polytope<D>* {
    is_foreseeable = u < packet.inserted.first();  // others are in no leaf
    if (!is_foreseeable) {
      return nullptr;
    }
    Workspace<D>& other = workspace.other;
    structure_.UnplacedClippedVoronoi(u, clip, other, packet.inserted);
    const double reach =
        std::sqrt(other.cell.CutLimitSq()) + std::sqrt(DistanceSq<D>(structure_.point(u), structure_.point(v)));
    packet.foreseen[at].reach_sq = std::max(packet.foreseen[at].reach_sq, reach * reach);
    is_foreseeable = !other.cell.IsTooLarge();
    other.cell.Place();
    return &other.cell;
  };
  while (!cell.IsTooLarge() && !context_->IsCancelled()) {
    const Assessment found = rules_->AssessCell(cell, faces, edge_limit_sq);
    const size_t first_notice = packet.notices.size();
    rules_->AppendNotices(cell, faces, found, packet.notices);
    const std::optional<InsertionRequest<D>> request = rules_->NextRequest(v, cell, found, edge_limit_sq, cell_of);
    packet.steps.push_back({found, static_cast<uint32_t>(packet.notices.size() - first_notice), request.has_value()});
    if (!request.has_value()) {
      rules_->AppendNodesToWatch(v, cell, found, packet.watched);
      if (found.IsGood()) {
        cell.FindStar(packet.star);
        packet.AppendStar(at);
      }
      packet.SetKnown(at, structure_.point(v));
      return;
    }
    if (!is_foreseeable || !IsLongEnough(request->point)) {
      return;
    }
    packet.requests.push_back(*request);
    cell.CutBeforePlace(packet.inserted.Append(request->point.position), request->point.position);
  }
}

// Serves those of a packet who have not been served.
template <int D>
absl::Status Refinement<D>::ServePacket(Packet<D>& packet) {
  if (packet.is_foreseen) {
    packet.NoteUnforeseen(std::span(inserted_).subspan(packet.first_unforeseen - inserted_before_));
  }
  for (; packet.served < packet.vertices.size(); ++packet.served) {
    PrefetchAhead(std::span(packet.vertices), packet.served, [&](VertexId v, int step) {
      if (step == 0) {
        PrefetchServed(v);
      }
      if (!packet.is_foreseen) {
        structure_.Prefetch(v, step);
      }
    });
    const size_t first = inserted_.size();
    VertexId below{};
    int bucket = 0;
    while (pending_.schedule().HasBelow(round_bucket_) && pending_.schedule().Pop(below, bucket, round_bucket_)) {
      WELLSPACE_RETURN_IF_ERROR(Serve(below, bucket));
    }
    packet.NoteUnforeseen(std::span(inserted_).subspan(first));
    if (pending_.schedule().IsPendingIn(packet.vertices[packet.served], round_bucket_)) {
      WELLSPACE_RETURN_IF_ERROR(ServeNext(packet));
    } else {
      packet.NoteUnforeseen(packet.InsertedFor(packet.served));
    }
  }
  return absl::OkStatus();
}

// Serves the next vertex of a packet, which waits.
template <int D>
absl::Status Refinement<D>::ServeNext(Packet<D>& packet) {
  const VertexId v = packet.vertices[packet.served];
  const size_t first = inserted_.size();
  const uint32_t first_new = structure_.vertex_count();
  pending_.schedule().Take(v);
  absl::Status status = context_->Check();
  if (status.ok()) {
    const bool holds = packet.HoldsFor(packet.served, structure_.point(v));
    foreseen_count_ += packet.is_foreseen ? 1 : 0;
    held_count_ += holds ? 1 : 0;
    status = holds ? Retrace(packet, packet.served) : Improve(v, round_bucket_);
  }
  if (!status.ok()) {
    pending_.schedule().DetachAgain(v, round_bucket_);
    return status;
  }
  // What was foreseen after all counts as foreseen.
  const std::span<const Point<D>> foreseen = packet.InsertedFor(packet.served);
  const std::span<const Point<D>> inserted = std::span(inserted_).subspan(first);
  const auto [foreseen_end, inserted_end] =
      std::mismatch(foreseen.begin(), foreseen.end(), inserted.begin(), inserted.end());
  for (auto p = inserted.begin(); p != inserted_end; ++p) {
    const auto i = static_cast<uint32_t>(p - inserted.begin());
    packet.names[packet.foreseen[packet.served].begin.requests + i] = VertexId{first_new + i};
  }
  packet.NoteUnforeseen({foreseen_end, foreseen.end()});
  packet.NoteUnforeseen({inserted_end, inserted.end()});
  return CountServed(round_bucket_);
}

// As Improve, by what is foreseen.
template <int D>
absl::Status Refinement<D>::Retrace(Packet<D>& packet, size_t at) {
  const VertexId v = packet.vertices[at];
  const auto& [is_wanted, is_known, reach_sq, new_simplices, begin] = packet.foreseen[at];
  const typename Packet<D>::Ends end = packet.EndOf(at);
  std::span<NeighborNotice> notices = std::span(packet.notices).subspan(begin.notices);
  auto request = packet.requests.begin() + begin.requests;
  auto name = packet.names.begin() + begin.requests;
  for (auto step = packet.steps.begin() + begin.steps;; ++step) {
    const std::span<NeighborNotice> own = notices.first(step->notices);
    notices = notices.subspan(step->notices);
    for (NeighborNotice& notice : own) {
      packet.Rename(notice.vertex);
    }
    if (pending_.IsNew(v)) {
      pending_.Notify(v, step->found, own);
    }
    if (pending_.HasShorterThan(round_bucket_)) {
      pending_.Postpone(v, step->found, round_bucket_);
      return absl::OkStatus();
    }
    if (!step->asks) {
      for (uint32_t i = new_simplices; i < end.simplices; ++i) {
        for (VertexId& u : packet.simplices[i]) {
          packet.Rename(u);
        }
      }
      Settle(v, step->found, round_bucket_, own,
             std::span(packet.watched).subspan(begin.watched, end.watched - begin.watched),
             std::span(packet.simplices).subspan(begin.simplices, end.simplices - begin.simplices));
      return absl::OkStatus();
    }
    packet.Rename(request->insertion.other);
    WELLSPACE_RETURN_IF_ERROR(context_->Check());
    WELLSPACE_ASSIGN_OR_RETURN(*name, Insert(*request));
    ++request;
    ++name;
  }
}

#define WELLSPACE_INSTANTIATE(D)                       \
  template bool Refinement<D>::BeginRounds(int);       \
  template void Refinement<D>::DropRounds();           \
  template uint64_t Refinement<D>::RoundBytes() const; \
  template void Refinement<D>::AwaitOthers();          \
  template void Refinement<D>::AdmitWaiting();         \
  template absl::Status Refinement<D>::ServeRounds();
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
