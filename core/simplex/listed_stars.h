// The simplices of a mesh out of those that are listed at its vertices. ComputeSimplices and ComputeDomainSimplices
// read them so.
#ifndef WELLSPACE_CORE_SIMPLEX_LISTED_STARS_H_
#define WELLSPACE_CORE_SIMPLEX_LISTED_STARS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/power_predicate.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

// The simplices at one vertex after the other that are listed there and are in the mesh: the vertex
// is the last of them to have been looked at, and no vertex that came later spoils them.
//
// Thread safety: thread-compatible.
template <int D>
class ListedStars {
 public:
  using Row = std::array<VertexId, D>;  // the other vertices of a simplex

  // All arguments must outlive it.
  ListedStars(const QueryStructure<D>& structure, const StarLists<D>& stars, const StaleStars& stale)
      : structure_(structure), stars_(stars), stale_(stale) {}

  // The simplices of `v`, in the order in which they are listed. Valid until the next call; the caller may change them.
  //
  // Complexity: O(listed); with vertices that came later, as many exact signs each.
  // Errors:     none.
  std::vector<Row>& Find(VertexId v) {
    const auto listed = stars_.Of(v);
    ++counters_.queries;
    counters_.vertices += D * listed.size();
    rows_.resize(listed.size());
    size_t count = 0;
    for (const Row& row : listed) {
      // No branch, since it could not be predicted.
      rows_[count] = row;
      uint32_t is_last = 1;
      for (const VertexId u : row) {
        is_last &= stars_.WasLookedAtBefore(u, v) ? 1 : 0;
      }
      count += is_last;
    }
    rows_.resize(count);
    if (const auto stale = stale_.At(v); !stale.empty()) {
      std::erase_if(rows_, [&](const Row& row) { return IsSpoiled(v, row, stale); });
    }
    return rows_;
  }

  // The memory of its scratch.
  uint64_t MemoryBytes() const { return rows_.capacity() * sizeof(Row); }
  // Queries are stars.
  const QueryCounters& counters() const { return counters_; }

 private:
  // Whether the ball through `v` and `others` holds one of the vertices that make the list of v stale; ties as in
  // cells.
  bool IsSpoiled(VertexId v, const Row& others, std::span<const StalePair> stale) {
    Simplex<D> simplex;
    simplex[D] = structure_.point(v);
    for (int k = 0; k < D; ++k) {
      simplex[k] = structure_.point(others[k]);
    }
    const Sign orientation = Orientation<D>(simplex).sign;
    return std::any_of(stale.begin(), stale.end(), [&](const StalePair& pair) {
      const Point<D>& u = structure_.point(pair.second);
      ++counters_.cuts;
      const MeasuredSign inside = InSphere<D>(simplex, u);
      counters_.decisions.exact += inside.stage == Stage::kFilter ? 0 : 1;
      return (inside.sign == Sign::kZero ? IsInsideOnTie(simplex, u) : inside.sign * orientation) == Sign::kPositive;
    });
  }

  Sign IsInsideOnTie(const Simplex<D>& simplex, const Point<D>& u) {
    std::array<PlaneSource<D>, D> planes;
    for (int k = 0; k < D; ++k) {
      planes[k].generator = simplex[k];
    }
    ++counters_.decisions.perturbed;
    return DecideCut<D>(simplex[D], planes, u, TieRule::kPerturb).sign;
  }

  const QueryStructure<D>& structure_;
  const StarLists<D>& stars_;
  const StaleStars& stale_;
  std::vector<Row> rows_;
  QueryCounters counters_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_LISTED_STARS_H_
