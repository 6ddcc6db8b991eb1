#include "core/refine/foreseen_cells.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/base/dimensions.h"

namespace wellspace::core {

template <int D>
void ForeseenCells<D>::Begin(std::span<const VertexId> vertices, double clip, Judge judge, const RunContext& context) {
  judge_ = std::move(judge);
  context_ = &context;
  const size_t number = 1 - ready_;
  Batch& batch = batches_[number];
  batch.clip = clip;
  batch.vertex_count = structure_.vertex_count();
  batch.vertices.assign(vertices.begin(), vertices.end());
  batch.foreseen.resize(vertices.size());
  batch.left = vertices.size();
  own_.resize(team_.threads());
  for (Own& own : own_) {
    own.pools[number].count = 0;
  }
  is_running_ = true;
  team_.Begin(vertices.size(), [this, number, clip, &batch](size_t i) {
    batch.foreseen[i] = ComputeOne(batch.vertices[i], clip, number);
  });
}

template <int D>
void ForeseenCells<D>::Finish() {
  if (!is_running_) {
    return;
  }
  is_running_ = false;
  team_.End();
  if (batches_ended_++ % kBatchesBetweenCounts == 0) {
    CountMemory();
  }
}

template <int D>
void ForeseenCells<D>::Drop() noexcept {
  if (is_running_) {
    is_running_ = false;
    team_.Drop();
  }
  batches_[1 - ready_].Clear();
}

template <int D>
void ForeseenCells<D>::Advance() {
  batches_[ready_].Clear();
  ready_ = 1 - ready_;
}

template <int D>
typename ForeseenCells<D>::Foreseen* ForeseenCells<D>::ComputeOne(VertexId v, double clip, size_t batch) {
  if (context_->IsCancelled()) {
    return nullptr;
  }
  Own& own = own_[ThreadTeam::CurrentThread()];
  Polytope<D>& cell = own.workspace.cell;
  structure_.UnplacedClippedVoronoi(v, clip, own.workspace);
  if (cell.IsTooLarge()) {
    return nullptr;
  }
  auto& pool = own.pools[batch];
  if (pool.count == pool.cells.size()) {
    pool.cells.push_back(std::make_unique<Foreseen>());
  }
  Foreseen& foreseen = *pool.cells[pool.count++];
  foreseen.found = judge_(v, cell);
  if (foreseen.found.IsGood()) {
    cell.FindStar(foreseen.star);
  }
  foreseen.cut_limit_sq = cell.CutLimitSq();
  foreseen.cell.Swap(cell);
  return &foreseen;
}

template <int D>
bool ForeseenCells<D>::IsFresh(const Batch& batch, double clip) const {
  return batch.left > 0 && clip == batch.clip && structure_.vertex_count() - batch.vertex_count <= kMostInsertions;
}

template <int D>
Look<D> ForeseenCells<D>::Take(VertexId v, double clip) {
  Batch& batch = batches_[ready_];
  if (!IsFresh(batch, clip)) {
    return {};
  }
  const size_t at = PlaceAmong(batch.vertices, v);
  if (at == batch.vertices.size()) {
    return {};
  }
  batch.vertices[at] = kNoVertex;
  --batch.left;
  Foreseen* const foreseen = batch.foreseen[at];
  if (foreseen == nullptr) {
    return {};
  }
  const bool is_cut = CutByNew(v, batch.vertex_count, *foreseen);
  if (foreseen->cell.IsTooLarge()) {
    return {};
  }
  if (is_cut) {
    return {&foreseen->cell};
  }
  return {&foreseen->cell, &foreseen->found, foreseen->found.IsGood() ? &foreseen->star : nullptr};
}

// Cuts the cell of `v` by the vertices from `first_new` on; returns whether that changed it.
template <int D>
bool ForeseenCells<D>::CutByNew(VertexId v, uint32_t first_new, Foreseen& foreseen) const {
  constexpr uint32_t kTogether = 8;
  bool is_cut = false;
  const Point<D> site = structure_.point(v);
  const double limit_sq = foreseen.cut_limit_sq;
  const auto is_near = [&](uint32_t u) {
    return NormSq<D>(Difference<D>(structure_.point(VertexId{u}), site)) <= limit_sq;
  };
  const uint32_t end = structure_.vertex_count();
  for (uint32_t begin = first_new; begin < end; begin += kTogether) {
    const uint32_t count = std::min(kTogether, end - begin);
    uint32_t near = 0;  // by bits; few are, so none is jumped over
    for (uint32_t i = 0; i < count; ++i) {
      near |= (is_near(begin + i) ? 1u : 0u) << i;
    }
    for (; near != 0 && !foreseen.cell.IsTooLarge(); near &= near - 1) {
      const VertexId u{begin + static_cast<uint32_t>(std::countr_zero(near))};
      is_cut |= foreseen.cell.CutBeforePlace(u, structure_.point(u));
    }
  }
  return is_cut;
}

template <int D>
void ForeseenCells<D>::CountMemory() {
  memory_bytes_ = 0;
  for (const Own& own : own_) {
    memory_bytes_ += own.workspace.seen.size() * sizeof(uint32_t) + own.workspace.cell.MemoryBytes();
    for (const auto& pool : own.pools) {
      for (const auto& foreseen : pool.cells) {
        memory_bytes_ +=
            sizeof(Foreseen) + foreseen->cell.MemoryBytes() + foreseen->star.capacity() * sizeof(foreseen->star[0]);
      }
    }
  }
}

template <int D>
QueryCounters ForeseenCells<D>::counters() const {
  QueryCounters counters;
  for (const Own& own : own_) {
    counters.Add(own.workspace.counters);
  }
  return counters;
}

#define WELLSPACE_INSTANTIATE(D) template class ForeseenCells<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
