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
  workspaces_.resize(team_.threads());
  team_.ForEach(count_, [&](size_t i) { ComputeOne(vertices[i], i, judge, context); });
}

template <int D>
void ForeseenCells<D>::ComputeOne(VertexId v, size_t i, const Judge& judge, const RunContext& context) {
  Workspace<D>& workspace = workspaces_[ThreadTeam::CurrentThread()];
  Foreseen& foreseen = cells_[i];
  foreseen.vertex = kNoVertex;
  if (context.IsCancelled()) {
    return;
  }
  structure_.UnplacedClippedVoronoi(v, clip_, workspace);
  foreseen.vertex = v;
  foreseen.found = judge(i, workspace.cell);
  std::swap(foreseen.cell, workspace.cell);
}

template <int D>
bool ForeseenCells<D>::Has(double clip) const {
  return left_ > 0 && clip == clip_ && structure_.vertex_count() - vertex_count_ <= kMostInsertions;
}

template <int D>
Polytope<D>* ForeseenCells<D>::Take(VertexId v, double clip, std::optional<Assessment>& found) {
  if (!Has(clip)) {
    return nullptr;
  }
  for (size_t i = 0; i < count_; ++i) {
    if (cells_[i].vertex == v) {
      Foreseen& taken = cells_[i];
      taken.vertex = kNoVertex;
      --left_;
      if (!CutByNew(taken.cell)) {
        found = taken.found;
      }
      return &taken.cell;
    }
  }
  return nullptr;
}

// Cuts a cell by the vertices that were added since it was computed; returns whether that changed it.
template <int D>
bool ForeseenCells<D>::CutByNew(Polytope<D>& cell) const {
  bool is_cut = false;
  const uint32_t end = structure_.vertex_count();
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
  for (const Workspace<D>& workspace : workspaces_) {
    bytes += workspace.seen.size() * sizeof(uint32_t) + workspace.cell.MemoryBytes();
  }
  return bytes;
}

template <int D>
QueryCounters ForeseenCells<D>::counters() const {
  QueryCounters counters;
  for (const Workspace<D>& workspace : workspaces_) {
    counters.Add(workspace.counters);
  }
  return counters;
}

#define WELLSPACE_INSTANTIATE(D) template class ForeseenCells<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
