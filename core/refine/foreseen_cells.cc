#include "core/refine/foreseen_cells.h"

#include <algorithm>
#include <utility>

#include "core/base/dimensions.h"

namespace wellspace::core {

template <int D>
void ForeseenCells<D>::Compute(std::span<const VertexId> vertices, double clip, const Judge& judge,
                               const RunContext& context) {
  clip_ = clip;
  vertex_count_ = structure_.vertex_count();
  vertices_.assign(vertices.begin(), vertices.end());
  foreseen_.resize(vertices.size());
  left_ = vertices.size();
  own_.resize(team_.threads());
  for (Own& own : own_) {
    own.count = 0;
  }
  team_.ForEach(vertices.size(), [&](size_t i) { foreseen_[i] = ComputeOne(vertices[i], i, judge, context); });
}

template <int D>
typename ForeseenCells<D>::Foreseen* ForeseenCells<D>::ComputeOne(VertexId v, size_t i, const Judge& judge,
                                                                  const RunContext& context) {
  if (context.IsCancelled()) {
    return nullptr;
  }
  Own& own = own_[ThreadTeam::CurrentThread()];
  Polytope<D>& cell = own.workspace.cell;
  structure_.UnplacedClippedVoronoi(v, clip_, own.workspace);
  if (cell.IsTooLarge()) {
    return nullptr;
  }
  if (own.count == own.cells.size()) {
    own.cells.push_back(std::make_unique<Foreseen>());
  }
  Foreseen& foreseen = *own.cells[own.count++];
  foreseen.found = judge(i, cell);
  foreseen.neighbours.clear();
  if (foreseen.found.IsGood()) {
    cell.Neighbours(foreseen.neighbours);
  }
  foreseen.cut_limit_sq = cell.CutLimitSq();
  std::swap(foreseen.cell, cell);
  return &foreseen;
}

template <int D>
bool ForeseenCells<D>::Has(double clip) const {
  return left_ > 0 && clip == clip_ && structure_.vertex_count() - vertex_count_ <= kMostInsertions;
}

template <int D>
Look<D> ForeseenCells<D>::Take(VertexId v, double clip) {
  if (!Has(clip)) {
    return {};
  }
  const auto at = std::find(vertices_.begin(), vertices_.end(), v);
  if (at == vertices_.end()) {
    return {};
  }
  *at = kNoVertex;
  --left_;
  Foreseen* const foreseen = foreseen_[at - vertices_.begin()];
  if (foreseen == nullptr) {
    return {};
  }
  if (CutByNew(v, *foreseen)) {
    return {&foreseen->cell};
  }
  return {&foreseen->cell, &foreseen->found, foreseen->neighbours};
}

// Cuts the cell of `v` by the vertices that were added since it was computed; returns whether that changed it.
template <int D>
bool ForeseenCells<D>::CutByNew(VertexId v, Foreseen& foreseen) const {
  bool is_cut = false;
  const Point<D> site = structure_.point(v);
  const uint32_t end = structure_.vertex_count();
  for (uint32_t u = vertex_count_; u < end; ++u) {
    const Point<D>& p = structure_.point(VertexId{u});
    if (NormSq<D>(Difference<D>(p, site)) <= foreseen.cut_limit_sq && !foreseen.cell.IsTooLarge()) {
      is_cut |= foreseen.cell.CutBeforePlace(VertexId{u}, p);
    }
  }
  return is_cut;
}

template <int D>
uint64_t ForeseenCells<D>::MemoryBytes() const {
  uint64_t bytes = 0;
  for (const Own& own : own_) {
    bytes += own.workspace.seen.size() * sizeof(uint32_t) + own.workspace.cell.MemoryBytes();
    for (const auto& foreseen : own.cells) {
      bytes += sizeof(Foreseen) + foreseen->cell.MemoryBytes();
    }
  }
  return bytes;
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
