// What every candidate for a cut is tested against: the positions of a cell's nodes, four side by side.
#ifndef WELLSPACE_CORE_VORONOI_NODE_COLUMNS_H_
#define WELLSPACE_CORE_VORONOI_NODE_COLUMNS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"
#include "core/voronoi/lanes.h"

namespace wellspace::core {

// Vertices of one leaf that may cut a cell, in columns: their vectors from its site.
template <int D>
struct alignas(kLanes * sizeof(double)) CandidateColumns {
  // In one more place a candidate may be written before it is decided whether it counts.
  static constexpr size_t kCapacity = PaddedCount(LeafTree<D>::kLeafCapacity + 1);

  double w[D][kCapacity];
  double length_sq[kCapacity];
  double most[kCapacity];  // of x . w - |w|^2 / 2 + error over the nodes x of the cell, once computed
  uint32_t slot[kCapacity];
  size_t count = 0;
};

// A copy of CellNode::x, slack and reach by index of the node, in groups that one vector instruction takes. Places of
// the last group beyond the last node hold a node at the site, which no bisector cuts off.
//
// Thread safety: thread-compatible.
template <int D>
class NodeColumns {
 public:
  struct alignas(kLanes * sizeof(double)) Group {
    double x[D][kLanes];
    double slack[kLanes];
    double reach[kLanes];
    double excess[kLanes];
    double most[kLanes];
  };

  // Works with `unit`, which this processor has; the best there is unless told.
  explicit NodeColumns(VectorUnit unit = BestVectorUnit()) : unit_(unit) {}

  // REQUIRES:   nodes that are new are Set before anything else is asked.
  void Resize(size_t count) {
    groups_.resize(PaddedCount(count) / kLanes);
    for (size_t i = count; i < groups_.size() * kLanes; ++i) {
      Set(i, Point<D>{}, 0, 0);
    }
  }

  void Set(size_t i, const Point<D>& x, double slack, double reach) {
    Group& group = groups_[i / kLanes];
    const size_t lane = i % kLanes;
    for (int axis = 0; axis < D; ++axis) {
      group.x[axis][lane] = x[axis];
    }
    group.slack[lane] = slack;
    group.reach[lane] = reach;
  }

  // Computes x . normal - offset for all nodes x, and the same plus the bound on its error, slack length + error. Returns
  // whether any of the latter is not negative.
  bool ComputeExcesses(const Point<D>& normal, double offset, double length, double error);
  double excess(size_t i) const { return groups_[i / kLanes].excess[i % kLanes]; }

  // Writes the indices of those nodes for which that sum is not negative, ascending, and returns their number. `out` has
  // room for kLanes for each group.
  template <typename Index>
  size_t FindExceeding(Index* out) const {
    size_t count = 0;
    Index i = 0;
    for (const Group& group : groups_) {
      for (size_t lane = 0; lane < kLanes; ++lane, ++i) {
        out[count] = i;  // no branch, since none could be foretold
        count += group.most[lane] >= 0 ? 1 : 0;
      }
    }
    return count;
  }
  uint64_t MemoryBytes() const { return groups_.capacity() * sizeof(Group); }
  size_t padded_count() const { return groups_.size() * kLanes; }

  // Computes `most` of all candidates; `slack` is at least those of the nodes, and a candidate w has the error `slack` |w|
  // + `relative_error` |w|^2 / 2.
  void ComputeMost(double slack, double relative_error, CandidateColumns<D>& candidates) const;

  // Whether some node x has dist(x, cube) <= |x|, decided generously where the errors of nodes leave a doubt; `low` and
  // `high` are the corners of the cube relative to the site.
  bool Reaches(const Point<D>& low, const Point<D>& high) const;

  // The largest reach, and the largest slack.
  struct Largest {
    double reach;
    double slack;
  };
  Largest FindLargest() const;

 private:
  VectorUnit unit_;
  std::vector<Group> groups_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_NODE_COLUMNS_H_
