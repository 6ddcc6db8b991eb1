// The positions of a cell's nodes from 4-D on, four side by side, and the queries of all of them: excesses over a
// bisector, bounds on the excesses over many, the reach, the farthest node.
#ifndef WELLSPACE_CORE_CELL_NODE_COLUMNS_H_
#define WELLSPACE_CORE_CELL_NODE_COLUMNS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/simd/lanes.h"
#include "core/cell/candidates.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Positions of the nodes of a cell and bounds on their errors by index of the node: in groups of which one vector
// instruction takes a coordinate, to work on many nodes, and in rows, to work on one. Places of the last group beyond
// the last node hold a node at the site, which no bisector cuts off.
//
// Thread safety: thread-compatible.
template <int D>
class NodeColumns {
 public:
  struct alignas(kLanes * sizeof(double)) Group {
    double x[D][kLanes];
    double slack[kLanes];
  };
  // The coordinates of a node, then its slack, then padding.
  struct alignas(kLanes * sizeof(double)) Row {
    double values[PaddedCount(D + 1)];
  };
  // A bit for each node: so many in a word.
  static constexpr size_t kWordBits = 64;

  // Works with `unit`, which this processor has; the best there is unless told.
  explicit NodeColumns(VectorUnit unit = BestVectorUnit()) : unit_(unit) {}

  VectorUnit unit() const { return unit_; }
  size_t count() const { return count_; }

  // REQUIRES:   nodes that are new are Set before anything else is asked.
  void Resize(size_t count) {
    for (size_t i = count; i < count_; ++i) {
      Set(i, Point<D>{}, 0);
    }
    count_ = count;
    if (PaddedCount(count) > groups_.size() * kLanes) {
      MakeRoom();
    }
  }

  void Set(size_t i, const Point<D>& x, double slack) {
    std::copy(x.begin(), x.end(), rows_[i].values);
    rows_[i].values[D] = slack;
    SetColumns(i, x.data(), slack);
  }
  void Set(size_t i, const Row& row) {
    rows_[i] = row;
    SetColumns(i, row.values, row.values[D]);
  }

  std::span<const Row> rows() const { return {rows_.data(), count_}; }
  Point<D> x(size_t i) const {
    Point<D> x;
    std::copy_n(rows_[i].values, D, x.begin());
    return x;
  }
  double slack(size_t i) const { return rows_[i].values[D]; }

  // Computes for all nodes x the excess x . normal - offset, which may be wrong by e = slack length + error: finds
  // those of which excess + e is not negative (doubtful ones and more), and those of which excess - e is positive
  // (surely cut off). Returns whether there are any of the former.
  //
  // Defined in excesses.h.
  template <size_t kWidth>
  WELLSPACE_INLINE bool ComputeExcesses(const Point<D>& normal, double offset, double length, double error);
  std::span<const double> excesses() const { return {excesses_.front().values, count_}; }

  // The findings of the last ComputeExcesses: bit b of word w stands for node kWordBits w + b. Nodes of `maybe` that
  // are not of `surely` are in doubt.
  struct Found {
    uint64_t maybe = 0;
    uint64_t surely = 0;
  };
  std::span<Found> found() { return {found_.data(), (count_ + kWordBits - 1) / kWordBits}; }

  uint64_t MemoryBytes() const {
    return groups_.capacity() * sizeof(Group) + rows_.capacity() * sizeof(Row) + excesses_.capacity() * sizeof(Pack) +
           found_.capacity() * sizeof(Found);
  }

  // Computes `excess_bound` of the candidates from `begin` on; `slack` is at least those of the nodes, and a candidate
  // w has the error `slack` |w| + `relative_error` |w|^2 / 2.
  void BoundExcesses(double slack, double relative_error, size_t begin, Candidates<D>& candidates) const;

  // Whether some node x has |p x|^2 <= |x|^2 + doubt, for the point p of the cube [low, high] nearest to it; `low` and
  // `high` are relative to the site.
  bool Reaches(const Point<D>& low, const Point<D>& high, double doubt) const;

  // The largest squared distance of a node from the site, and the largest slack.
  struct Largest {
    double radius_sq;
    double slack;
  };
  Largest FindLargest() const;

 private:
  struct alignas(kLanes * sizeof(double)) Pack {
    double values[kLanes];
  };

  void SetColumns(size_t i, const double* x, double slack) {
    Group& group = groups_[i / kLanes];
    const size_t lane = i % kLanes;
    for (int axis = 0; axis < D; ++axis) {
      group.x[axis][lane] = x[axis];
    }
    group.slack[lane] = slack;
  }
  void MakeRoom();
  std::span<const Group> groups() const { return {groups_.data(), PaddedCount(count_) / kLanes}; }

  VectorUnit unit_;
  size_t count_ = 0;
  // Arrays only grow; places beyond the last node are as the class says.
  std::vector<Group> groups_;   // node n is lane n % 4 of group n / 4
  std::vector<Row> rows_;       // by node, the same again
  std::vector<Pack> excesses_;  // as groups_; valid from ComputeExcesses on, of the nodes of then
  std::vector<Found> found_;    // by node / 64, bit; the same
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_NODE_COLUMNS_H_
