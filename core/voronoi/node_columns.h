// What every candidate for a cut is tested against: the positions of a cell's nodes, two side by side.
#ifndef WELLSPACE_CORE_VORONOI_NODE_COLUMNS_H_
#define WELLSPACE_CORE_VORONOI_NODE_COLUMNS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/point.h"

namespace wellspace::core {

// A copy of CellNode::x, slack and reach by index of the node, in groups that one vector instruction takes. Places of
// the last group beyond the last node hold a node at the site, which no bisector cuts off.
//
// Thread safety: thread-compatible.
template <int D>
class NodeColumns {
 public:
  // REQUIRES:   nodes that are new are Set before anything else is asked.
  void Resize(size_t count) {
    groups_.resize((count + kLanes - 1) / kLanes);
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
  bool ComputeExcesses(const Point<D>& normal, double offset, double length, double error) {
    Mask any{};
    for (Group& group : groups_) {
      Lanes excess = group.x[0] * normal[0];
      for (int axis = 1; axis < D; ++axis) {
        excess += group.x[axis] * normal[axis];
      }
      group.excess = excess - offset;
      group.most = group.excess + (group.slack * length + error);
      any |= group.most >= 0;
    }
    return IsAny(any);
  }
  double excess(size_t i) const { return groups_[i / kLanes].excess[i % kLanes]; }
  double most(size_t i) const { return groups_[i / kLanes].most[i % kLanes]; }

  // Whether some node x has dist(x, cube) <= |x|, decided generously where the errors of nodes leave a doubt; `low` and
  // `high` are the corners of the cube relative to the site.
  bool Reaches(const Point<D>& low, const Point<D>& high) const {
    for (const Group& group : groups_) {
      Lanes power{};
      for (int axis = 0; axis < D; ++axis) {
        const Lanes x = group.x[axis];
        const Lanes least = low[axis] + Lanes{};
        const Lanes most = high[axis] + Lanes{};
        Lanes p = x > least ? x : least;
        p = p < most ? p : most;
        power += p * (p - 2 * x);
      }
      // Where the sum is near zero the p that attains it is within 2 |x| of the site, so an error e of x moves it by at
      // most 4 |x| e.
      if (IsAny(power <= 4 * group.slack * group.reach)) {
        return true;
      }
    }
    return false;
  }

  double LargestReach() const {
    Lanes largest{};
    for (const Group& group : groups_) {
      largest = largest > group.reach ? largest : group.reach;
    }
    return largest[0] > largest[1] ? largest[0] : largest[1];
  }

 private:
  static constexpr size_t kLanes = 2;
  using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
  using Mask = int64_t __attribute__((vector_size(kLanes * sizeof(double))));

  struct Group {
    Lanes x[D];
    Lanes slack;
    Lanes reach;
    Lanes excess;
    Lanes most;
  };

  static bool IsAny(const Mask& mask) { return (mask[0] | mask[1]) != 0; }

  std::vector<Group> groups_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_NODE_COLUMNS_H_
