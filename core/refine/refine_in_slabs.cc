// The part of Refinement that several threads do at once: ADR 21.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/refine/checks.h"
#include "core/refine/refine.h"
#include "core/voronoi/lanes.h"

namespace wellspace::core {
namespace {

// Fewer vertices of a bucket are improved one after the other.
constexpr size_t kLeastInSlabs = 1024;
constexpr double kMostSlabs = 4;

// Cells reach this times the longest edge of the bucket, or little less, and are not computed if that is beyond the slab.
constexpr double kReach = 2;
// A slab is at least so many times as wide, unless there are two.
constexpr double kLeastWidth = 18;

// Lines are laid through a sample of so many vertices, and leave at most that share of a slab's vertices to the next.
constexpr size_t kSampleSize = 4096;
constexpr double kSlack = 0.04;

// Vertices of a slab that are looked at between two times that all are told of what the others inserted.
constexpr size_t kPacket = 128;

}  // namespace

template <int D>
bool Refinement<D>::TakesSlabs(int bucket) const {
  const bool has_axis = bucket > slab_bucket_ || (bucket == slab_bucket_ && std::popcount(slab_axes_) < D);
  return HasSlabs() && has_axis && schedule_.MostIn(bucket) >= kLeastInSlabs;
}

// Puts those who wait in `bucket`, if there are enough, into slabs across the axis along which they are spread farthest of those that have not been taken.
template <int D>
void Refinement<D>::MakeSlabs(int bucket) {
  if (bucket != slab_bucket_) {
    slab_bucket_ = bucket;
    slab_axes_ = 0;
  }
  const HugeVector<VertexId> waiting = schedule_.Lift(bucket);
  if (waiting.size() < kLeastInSlabs) {  // the others have moved on
    for (const VertexId v : waiting) {
      schedule_.PutBack(v, bucket);
    }
    slab_axes_ = (1u << D) - 1;
    return;
  }
  int axis = -1;
  double widest = -1;
  for (int i = 0; i < D; ++i) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const VertexId v : waiting) {
      low = std::min(low, structure_.point(v)[i]);
      high = std::max(high, structure_.point(v)[i]);
    }
    if (((slab_axes_ >> i) & 1) == 0 && high - low > widest) {
      widest = high - low;
      axis = i;
    }
  }
  slab_axes_ |= 1u << axis;
  const double reach = kReach * std::sqrt(schedule_.UpperLengthSq(bucket));
  slabs_.resize(static_cast<size_t>(std::clamp(widest / (kLeastWidth * reach), 2.0, kMostSlabs)));
  LayLines(waiting, axis, reach);
  for (const VertexId v : waiting) {
    size_t i = 0;
    while (structure_.point(v)[axis] >= slabs_[i].high) {
      ++i;
    }
    slabs_[i].waiting.push_back(v);
  }
}

// Lays the lines between slabs: where few vertices are within reach, about as many between two lines as between any other two.
template <int D>
void Refinement<D>::LayLines(std::span<const VertexId> waiting, int axis, double reach) {
  std::vector<double> sample;
  for (size_t i = 0; i < waiting.size(); i += waiting.size() / kSampleSize + 1) {
    sample.push_back(structure_.point(waiting[i])[axis]);
  }
  std::sort(sample.begin(), sample.end());
  const size_t share = sample.size() / slabs_.size();
  const auto slack = static_cast<size_t>(kSlack * static_cast<double>(share));
  for (Slab& slab : slabs_) {
    slab.axis = axis;
  }
  for (size_t i = 1; i < slabs_.size(); ++i) {
    double line = 0;
    auto fewest = std::numeric_limits<std::ptrdiff_t>::max();
    for (size_t at = i * share - slack; at <= i * share + slack; ++at) {
      const std::ptrdiff_t near = std::upper_bound(sample.begin(), sample.end(), sample[at] + reach) -
                                  std::lower_bound(sample.begin(), sample.end(), sample[at] - reach);
      if (near < fewest) {
        fewest = near;
        line = sample[at];
      }
    }
    slabs_[i].low = slabs_[i - 1].high = line;
  }
}

// Has those who wait in slabs wait in their bucket alone.
template <int D>
void Refinement<D>::DropSlabs() {
  for (const Slab& slab : slabs_) {
    for (const VertexId v : slab.waiting) {
      if (schedule_.WaitsIn(v, slab_bucket_)) {
        schedule_.PutBack(v, slab_bucket_);
      }
    }
  }
  slabs_.clear();
  slab_bucket_ = -1;
  slabs_are_ahead_ = false;
}

template <int D>
uint64_t Refinement<D>::SlabBytes() const {
  uint64_t bytes = 0;
  for (const OwnWorkspace& workspace : slab_workspaces_) {
    bytes += workspace.seen.size() * sizeof(uint32_t);
  }
  for (const Slab& slab : slabs_) {
    bytes += slab.requests.capacity() * sizeof(Request) + slab.stars.capacity() * sizeof(slab.stars[0]);
  }
  return bytes;
}

// Serves the slabs, a packet of each at a time, and before the next whoever has come to wait in a lower bucket.
template <int D>
absl::Status Refinement<D>::ServeSlabs(ThreadTeam& team) {
  slab_workspaces_.resize(team.threads());
  while (!slabs_.empty()) {
    VertexId v{};
    int bucket = 0;
    while (!slabs_are_ahead_ && schedule_.HasBelow(slab_bucket_) && schedule_.Pop(v, bucket, slab_bucket_)) {
      WELLSPACE_RETURN_IF_ERROR(Serve(v, bucket));
    }
    WELLSPACE_RETURN_IF_ERROR(context_->Check());
    if (!slabs_are_ahead_) {
      size_t most = 0;
      for (const Slab& slab : slabs_) {
        most = std::max(most, slab.waiting.size());
      }
      for (Slab& slab : slabs_) {
        slab.packet = (slab.waiting.size() * std::min(kPacket, most) + most - 1) / most;  // so that all end at once
      }
      slab_first_new_ = structure_.vertex_count();
      team.ForEach(slabs_.size(),
                   [this](size_t i) { LookInto(slabs_[i], slab_workspaces_[ThreadTeam::CurrentThread()]); });
      slabs_are_ahead_ = true;
    }
    if (!ReplaySlabs(team)) {
      return TooManyVertices();
    }
    slabs_are_ahead_ = false;
    size_t left = 0;
    for (Slab& slab : slabs_) {
      slab.waiting.resize(slab.waiting.size() - slab.packet);
      left += slab.waiting.size();
    }
    if (left == 0) {
      slabs_.clear();
    }
    WELLSPACE_RETURN_IF_ERROR(Report(slab_bucket_));
  }
  return absl::OkStatus();
}

// Looks at the next vertices of a slab. Nothing but the slab and the workspace is written.
template <int D>
void Refinement<D>::LookInto(Slab& slab, Workspace<D>& workspace) const {
  slab.events.clear();
  slab.requests.clear();
  slab.inserted.clear();
  slab.below.clear();
  slab.stars.clear();
  slab.replayed = slab.added = slab.listed = 0;
  for (size_t i = 1; i <= slab.packet; ++i) {
    const VertexId v = slab.waiting[slab.waiting.size() - i];
    if (schedule_.WaitsIn(v, slab_bucket_)) {
      LookAtIn(slab, v, workspace);
    }
  }
}

// As Improve, but what is done is put down in the slab; what concerns a face, an error, or may reach beyond the slab or whoever comes to
// wait in a lower bucket, is left.
template <int D>
void Refinement<D>::LookAtIn(Slab& slab, VertexId v, Workspace<D>& workspace) const {
  using Kind = typename Slab::Kind;
  const double edge_limit_sq = schedule_.UpperLengthSq(slab_bucket_);
  const double clip = clip_factor_ * std::sqrt(edge_limit_sq);
  const Point<D>& site = structure_.point(v);
  const uint32_t first_new = structure_.vertex_count();
  const auto is_within = [&](double reach_sq) {
    return slab.HoldsBall(site, reach_sq) && std::none_of(slab.below.begin(), slab.below.end(), [&](const Point<D>& p) {
             return DistanceSq<D>(p, site) <= reach_sq;
           });
  };
  const auto leave = [&] { slab.events.push_back({.vertex = v, .kind = Kind::kLeft}); };
  if (structure_.faces(v) != 0 || !is_within(kReach * kReach * edge_limit_sq)) {
    return leave();
  }
  Polytope<D>& cell = workspace.cell;
  structure_.UnplacedClippedVoronoi(v, clip, workspace, slab.inserted, VertexId{first_new});
  if (!is_within(cell.CutLimitSq())) {
    return leave();
  }
  if constexpr (kChecks) {
    cell.Place();
    CheckNeighbours(v, cell, slab_bucket_);
  }
  const size_t first_below = slab.below.size();
  while (!cell.IsTooLarge()) {
    const Assessment found = AssessCell(cell, 0, edge_limit_sq);
    if (found.encroached_face >= 0) {
      return leave();
    }
    typename Slab::Event event{.vertex = v, .kind = Kind::kWaits};
    event.announced = found.is_clipped ? Announced::kWithinClip : Announced::kToAll;
    if (slab.below.size() != first_below) {
      event.bucket = static_cast<int16_t>(OwnBucket(found, slab_bucket_));
      slab.events.push_back(event);
      slab.below.push_back(site);
      return;
    }
    const std::optional<Request> request = NextRequest(v, cell, found, edge_limit_sq);
    if (!request.has_value()) {
      if (found.IsGood()) {
        event.kind = Kind::kDone;
        event.radius_sq = found.radius_sq;
        cell.FindStar(slab.star);
        event.star_size = static_cast<uint32_t>(slab.star.size());
        slab.stars.insert(slab.stars.end(), slab.star.begin(), slab.star.end());
      } else {
        event.bucket = static_cast<int16_t>(NextBucket(found, clip, slab_bucket_ + 1));
      }
      slab.events.push_back(event);
      return;
    }
    const Point<D>& p = request->point.position;
    if (structure_.box().FacesOf(p) != 0 || !IsLongEnough(request->point)) {
      return leave();
    }
    slab.events.push_back({.vertex = v, .kind = Kind::kInserted});
    slab.requests.push_back(*request);
    slab.inserted.reserve(PaddedCount(slab.inserted.size() + 1));
    slab.inserted.push_back(p);
    cell.CutBeforePlace(VertexId{first_new + static_cast<uint32_t>(slab.inserted.size() - 1)}, p);
    if (schedule_.BucketOf(FirstEdgeSqOfNew(p, 0, request->point.empty_radius_sq)) < slab_bucket_) {
      slab.below.push_back(p);
    }
  }
  leave();
}

// Does what packets have put down, slab after slab; false if max_vertices_ does not allow all.
template <int D>
bool Refinement<D>::ReplaySlabs(ThreadTeam& team) {
  uint64_t allowed = max_vertices_ - std::min<uint64_t>(max_vertices_, structure_.vertex_count());
  bool allows_all = true;
  for (Slab& slab : slabs_) {
    for (slab.end = slab.replayed; slab.end < slab.events.size() && allows_all; ++slab.end) {
      if (slab.events[slab.end].kind == Slab::Kind::kInserted && allowed-- == 0) {
        allows_all = false;
        break;
      }
    }
  }
  team.ForEach(2, [this](size_t half) {
    uint32_t shift = 0;
    for (Slab& slab : slabs_) {
      half == 0 ? Replay(slab, shift) : ListStars(slab, shift);
      shift += static_cast<uint32_t>(slab.inserted.size());
    }
  });
  for (Slab& slab : slabs_) {
    slab.replayed = slab.end;
  }
  return allows_all;
}

// Does what the packet of a slab has put down, but for the stars. `shift`: how many vertices slabs before this one have inserted.
template <int D>
void Refinement<D>::Replay(Slab& slab, uint32_t shift) {
  for (size_t i = slab.replayed; i < slab.end; ++i) {
    const auto& [v, kind, announced, bucket, star_size, radius_sq] = slab.events[i];
    if (kind == Slab::Kind::kInserted) {
      Request& request = slab.requests[slab.added++];
      if (VertexId& other = request.insertion.other; other != kNoVertex && Index(other) >= slab_first_new_) {
        other = VertexId{Index(other) + shift};
      }
      Add(request);
    } else if (kind == Slab::Kind::kLeft) {
      schedule_.PutBack(v, slab_bucket_);
    } else {
      schedule_.Take(v);
      announced_[Index(v)] = std::max(announced_[Index(v)], announced);
      Remember(v, kind == Slab::Kind::kDone ? radius_sq : Assessment::kNone);
      if (kind == Slab::Kind::kWaits) {
        schedule_.AddToBucket(v, bucket);
      }
    }
  }
}

// Lists the simplices that the packet of a slab has put down; none of those that have a vertex which it has inserted, which has not been looked at, so that
// their numbers do not matter. May run beside Replay.
template <int D>
void Refinement<D>::ListStars(Slab& slab, uint32_t shift) {
  uint32_t vertex_count = slab_first_new_ + shift;
  const std::span<const std::array<VertexId, D>> stars = slab.stars;
  for (size_t i = 0; i < slab.end; ++i) {
    const auto& event = slab.events[i];
    vertex_count += event.kind == Slab::Kind::kInserted ? 1 : 0;
    if (i < slab.replayed || event.kind != Slab::Kind::kDone) {
      continue;
    }
    stars_.Set(event.vertex, stars.subspan(slab.listed, event.star_size), vertex_count);
    slab.listed += event.star_size;
  }
}

#define WELLSPACE_INSTANTIATE(D)                      \
  template bool Refinement<D>::TakesSlabs(int) const; \
  template void Refinement<D>::MakeSlabs(int);        \
  template void Refinement<D>::DropSlabs();           \
  template uint64_t Refinement<D>::SlabBytes() const; \
  template absl::Status Refinement<D>::ServeSlabs(ThreadTeam&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
