#include "core/refine/foreseen_cells.h"

#include <utility>

#include "core/base/dimensions.h"

namespace wellspace::core {

template <int D>
void ForeseenCells<D>::Compute(std::span<const VertexId> vertices, double clip, const Judge& judge,
                               const RunContext& context) {
  clip_ = clip;
  vertex_count_ = structure_.vertex_count();
  count_ = left_ = vertices.size();
  if (cells_.size() < count_) {
    cells_.resize(count_);
  }
  of_threads_.resize(team_.threads());
  for (OfThread& own : of_threads_) {
    own.added_count = 0;
  }
  team_.ForEach(count_, [&](size_t i) { ComputeOne(vertices[i], i, judge, context); });
}

template <int D>
void ForeseenCells<D>::ComputeOne(VertexId v, size_t i, const Judge& judge, const RunContext& context) {
  const int thread = ThreadTeam::CurrentThread();
  OfThread& own = of_threads_[thread];
  Foreseen& foreseen = cells_[i];
  foreseen.vertex = kNoVertex;
  if (context.IsCancelled()) {
    return;
  }
  structure_.UnplacedClippedVoronoi(v, clip_, own.workspace);
  foreseen.vertex = v;
  foreseen.thread = thread;
  foreseen.first_added = own.added_count;
  std::swap(own.cell, own.workspace.cell);
  for (uint32_t k = 0; k < kMostAdded; ++k) {
    const Prospect prospect = judge(i, own.cell);
    if (k == 0) {
      foreseen.found = prospect.found;
      foreseen.cell.CopyFrom(own.cell);
    }
    if (!prospect.point.has_value() || context.IsCancelled()) {
      break;
    }
    const ForeseenPoint<D>& point = *prospect.point;
    if (own.added_count == own.added.size()) {
      own.added.emplace_back();
    }
    Added& added = own.added[own.added_count++];
    added.point = point;
    structure_.UnplacedClippedVoronoiAt(point.position, v, point.clip, own.workspace);
    own.workspace.cell.PlaceUnlessKeeps(ratio_);
    added.cell.CopyFrom(own.workspace.cell);
    if (k + 1 < kMostAdded) {
      own.cell.CutBeforePlace(VertexId{vertex_count_ + k}, point.position);
    }
  }
  foreseen.added_count = own.added_count - foreseen.first_added;
}

template <int D>
bool ForeseenCells<D>::Has(double clip) const {
  return left_ > 0 && clip == clip_ && structure_.vertex_count() - vertex_count_ <= kMostInsertions;
}

template <int D>
Polytope<D>* ForeseenCells<D>::Take(VertexId v, double clip, std::optional<Assessment>& found) {
  taken_ = nullptr;
  if (!Has(clip)) {
    return nullptr;
  }
  for (size_t i = 0; i < count_; ++i) {
    if (cells_[i].vertex == v) {
      taken_ = &cells_[i];
      taken_->vertex = kNoVertex;
      --left_;
      if (!CutByNew(structure_.vertex_count(), taken_->cell)) {
        found = taken_->found;
      }
      return &taken_->cell;
    }
  }
  return nullptr;
}

template <int D>
Polytope<D>* ForeseenCells<D>::TakeAdded(double clip) {
  const uint32_t last = structure_.vertex_count() - 1;
  for (size_t k = 0; taken_ != nullptr && k < taken_->added_count; ++k) {
    Added& added = of_threads_[taken_->thread].added[taken_->first_added + k];
    if (added.point.position == structure_.point(VertexId{last}) && added.point.clip == clip) {
      CutByNew(last, added.cell);
      return &added.cell;
    }
  }
  return nullptr;
}

// Cuts a cell by the vertices up to `end` that were added since it was computed; returns whether that changed it.
template <int D>
bool ForeseenCells<D>::CutByNew(uint32_t end, Polytope<D>& cell) const {
  bool is_cut = false;
  for (uint32_t u = vertex_count_; u < end && !cell.IsTooLarge(); ++u) {
    is_cut |= cell.CutBeforePlace(VertexId{u}, structure_.point(VertexId{u}));
  }
  return is_cut;
}

template <int D>
uint64_t ForeseenCells<D>::MemoryBytes() const {
  uint64_t bytes = 0;
  for (const Foreseen& foreseen : cells_) {
    bytes += foreseen.cell.MemoryBytes();
  }
  for (const OfThread& own : of_threads_) {
    bytes += own.workspace.seen.size() * sizeof(uint32_t) + own.workspace.cell.MemoryBytes() + own.cell.MemoryBytes();
    for (const Added& added : own.added) {
      bytes += added.cell.MemoryBytes();
    }
  }
  return bytes;
}

template <int D>
QueryCounters ForeseenCells<D>::counters() const {
  QueryCounters counters;
  for (const OfThread& own : of_threads_) {
    counters.Add(own.workspace.counters);
  }
  return counters;
}

#define WELLSPACE_INSTANTIATE(D) template class ForeseenCells<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
