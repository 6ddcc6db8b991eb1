// The vertices around some sites, side by side: their cells are cut by these without a walk from leaf to leaf.
#ifndef WELLSPACE_CORE_CELL_GATHERED_VERTICES_H_
#define WELLSPACE_CORE_CELL_GATHERED_VERTICES_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// All vertices within a distance of a box around the sites: as they are, and in columns of floats that tell which may
// be near.
//
// Thread safety: thread-compatible. Reused from one to the next: no allocation once warm.
template <int D>
class GatheredVertices {
 public:
  // Columns of more would not stay in the first cache.
  static constexpr size_t kMost = 1024;

  // Gathers the vertices around the first of `sites`, and returns how many sites these are: sites as near each other as
  // in a leaf, or in two side by side. None are gathered if it would not pay: for few sites, and for those amid more
  // than kMost. `points` are by vertex, in the leaves of `tree`; `seen`, by node of the tree, is set to `mark`, which
  // it has nowhere before, where a leaf has been met.
  //
  // REQUIRES:   there are sites.
  // Complexity: O(sites), and O(1) for each leaf and vertex around them.
  // Errors:     none.
  size_t Gather(const LeafTree<D>& tree, std::span<const Point<D>> points, std::span<const VertexId> sites,
                std::span<uint32_t> seen, uint32_t mark);

  // Forgets all.
  void Clear() {
    count_ = 0;
    leaves_.clear();
    is_whole_ = false;
  }

  // Whether all that is around `p`, which is among the sites then, has been gathered.
  bool Surrounds(const Point<D>& p) const { return is_whole_ && sites_.Contains(p); }
  // Whether a vertex at `p` has, if anything has been gathered.
  bool Holds(const Point<D>& p) const { return DistanceSq<D>(p, sites_) <= within_ * within_; }
  // Any vertex whose squared distance from `site`, which is surrounded, is at most this has been gathered.
  double ReachSq(const Point<D>& site) const {
    double depth = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < D; ++axis) {
      depth = std::min({depth, site[axis] - sites_.low[axis], sites_.high[axis] - site[axis]});
    }
    const double reach = (depth + within_) * (1 - 0x1p-40);
    return reach * reach;
  }

  // The squared distance of the nearest gathered vertex other than `v`, which is at `site` and surrounded; infinite if
  // there is no other.
  //
  // Complexity: O(count()), little for each.
  // Errors:     none.
  double NearestSq(VertexId v, const Point<D>& site, VectorUnit unit) const;

  size_t count() const { return count_; }
  size_t leaf_count() const { return leaves_.size(); }
  const Point<D>& position(size_t i) const { return positions_[i]; }
  VertexId name(size_t i) const { return names_[i]; }
  // May be read by eight; beyond the last are NaNs, which are no nearer than anything.
  const float* column(int axis) const { return columns_[axis].data(); }
  // The value for `p` in the column of an axis, in units of about the width of all.
  float InColumn(const Point<D>& p, int axis) const { return static_cast<float>((p[axis] - center_[axis]) * scale_); }
  // The largest square of a distance, as computed from columns, if this is that of the vertices.
  float MostSq(double distance_sq) const {
    const double most = std::sqrt(distance_sq) * scale_ + kColumnError;
    return static_cast<float>(most * most);
  }
  // The squared distance from a site of the vertices that are looked at before all others.
  double near_sq() const { return near_sq_; }

 private:
  // The error of a distance computed from columns: each of the coordinates, below 2, by 2^-24; their difference
  // by three times that; so the length, below 4, in up to three dimensions by (3 sqrt(3) + 7) 2^-24.
  static constexpr double kColumnError = 0x1p-20;

  // Sites that are gathered for together.
  struct SitesTogether {
    size_t count = 0;
    Box<D> box{};
    double spacing = 0;
  };
  static SitesTogether TakeSites(const LeafTree<D>& tree, std::span<const Point<D>> points,
                                 std::span<const VertexId> sites);
  void Begin(const Box<D>& sites, double spacing);
  bool Add(std::span<const Point<D>> positions, const VertexId* names);
  template <VectorUnit kUnit>
  double NearestSqWith(VertexId v, const Point<D>& site) const;
  double NearestSqAvx2(VertexId v, const Point<D>& site) const;

  Box<D> sites_;           // that holds the sites
  double within_ = 0;      // of `sites_` so far around all vertices are gathered
  double near_sq_ = 0;     // as near_sq() has it
  Point<D> center_;        // of the columns: that of `sites_`
  double scale_ = 1;       // of the columns; a power of two
  bool is_whole_ = false;  // all have been gathered, and not too many
  // By number, count_ of them, with room for one too many, and to be read by eight.
  size_t count_ = 0;
  std::vector<Point<D>> positions_;
  std::vector<VertexId> names_;
  std::array<std::vector<float>, D> columns_;  // by axis: as InColumn
  std::vector<NodeId> leaves_;                 // that have been walked through, or are still to be
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_GATHERED_VERTICES_H_
