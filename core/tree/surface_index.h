// An index of the triangles of a complex, which finds those near a point, and the solid that it lies in.
#ifndef WELLSPACE_CORE_TREE_SURFACE_INDEX_H_
#define WELLSPACE_CORE_TREE_SURFACE_INDEX_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"
#include "core/geometry/triangle.h"
#include "core/tree/morton.h"

namespace wellspace::core {

// A node of a SurfaceIndex; number 0 is the root.
using IndexNode = uint32_t;

// Where a segment crosses a triangle.
struct SurfaceCrossing {
  uint32_t triangle = 0;
  HalfFacet before = 0;  // the side that the segment comes from

  bool operator==(const SurfaceCrossing&) const = default;
};

// A point of the surface.
struct SurfacePoint {
  Point<3> at{};
  uint32_t triangle = 0;
  double distance_sq = 0;  // from where it was asked for
};

// An octree of its own over the triangles of a complex: its nodes are cubes of the same grid as those of the vertices'
// tree. A leaf lists the triangles that may meet its closed cube, and knows a point and its solid: its mark.
//
// Points are taken as moved by less than any number, as core/features/triangle_crossing.h has it: each lies in one
// solid, and which one is exact. So it is for segments between two points.
//
// Thread safety: thread-compatible; const functions may run at once.
// Invariants:
//   (1) a leaf lists each triangle that has a point in its closed cube;
//   (2) a leaf lists more than kCapacity triangles only if nothing is gained by a split: where they have a corner in
//       common in the cube, on the finest level, or where kEntriesPerTriangle or kNodesPerTriangle is used up;
//   (3) leaves know the solids of their marks; of a leaf without triangles that is the solid of all its points;
//   (4) neither the order of triangles nor that of points changes a bit of it, since a complex has them in its own.
class SurfaceIndex {
 public:
  static constexpr size_t kCapacity = 8;
  // Nodes that a fan of triangles around a corner may have above its leaf, so that a large one has a small leaf.
  static constexpr int kFanLevels = 4;
  static constexpr size_t kLargeFan = 4 * kCapacity;
  // The most entries of lists, and the most nodes: for each triangle, and a few anyway.
  static constexpr uint64_t kEntriesPerTriangle = 9;
  static constexpr uint64_t kNodesPerTriangle = 4;
  static constexpr uint64_t kEntriesAnyway = uint64_t{1} << 12;
  static constexpr uint64_t kNodesAnyway = uint64_t{1} << 12;

  // Builds the index of `complex`, whose solids these are, under the grid of the vertices' tree.
  //
  // REQUIRES:   complex and solids outlive this; the complex is not empty and lies in the box of the grid; its
  //             triangles meet in common corners and sides alone.
  // Complexity: O(m log m) for triangles that are spread as a surface is; O(m (levels of the grid)) always.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED of the context's memory.
  // Source:     docs/design/surfaces.md.
  absl::Status Build(const SurfaceComplex& complex, const Solids& solids, const MortonGrid<3>& grid,
                     const RunContext& context);

  // The same without solids. Of what follows, Nearest, NearestOf, IsWithin, FindNear and FindFewNear alone may be asked
  // then.
  absl::Status BuildForDistances(const SurfaceComplex& complex, const MortonGrid<3>& grid, const RunContext& context);

  // The most peak memory of Build. Unit: bytes.
  static uint64_t Bytes(uint64_t triangles);
  // The memory that the index takes.
  uint64_t MemoryBytes() const;

  // The solid that `p` lies in; beyond the box that is the unbounded one. `from`: a node whose closed cube holds p.
  //
  // Guarantees: exact; ties as above.
  // Complexity: O(depth below `from` + triangles of a leaf).
  uint32_t SolidAt(const Point<3>& p, IndexNode from = 0) const;

  // The triangles that the segment from `a` to `b` crosses, in that order, into `crossings`. `from`: a node whose
  // closed cube holds both.
  //
  // Guarantees: exact; a segment between two solids has crossings, and each goes on in the solid in which the one
  //             before has ended.
  // Complexity: O(nodes that the segment meets, and their triangles).
  void FindCrossings(const Point<3>& a, const Point<3>& b, std::vector<SurfaceCrossing>& crossings,
                     IndexNode from = 0) const;

  // FindCrossings of these triangles alone, ascending: others are known not to be crossed.
  //
  // Complexity: O(triangles).
  void FindCrossingsAmong(const Point<3>& a, const Point<3>& b, std::span<const uint32_t> triangles,
                          std::vector<SurfaceCrossing>& crossings) const;

  // The triangles that may meet a closed box, ascending, into `triangles`: all that do, and some that rounding leaves
  // in doubt. `from`: a node whose closed cube holds the box.
  //
  // Complexity: O(nodes that the box meets, and their triangles).
  void FindNear(const Box<3>& box, std::vector<uint32_t>& triangles, IndexNode from = 0) const;
  // FindNear if they are `most` at most; else false, as soon as there are more entries than a few times that.
  bool FindFewNear(const Box<3>& box, size_t most, std::vector<uint32_t>& triangles, IndexNode from = 0) const;

  // The point of the surface that is nearest to `p`, if one is nearer than the root of `within_sq`; rounded. Of equally
  // near ones that of the lowest triangle.
  //
  // Complexity: O(nodes that are no farther, and their triangles).
  std::optional<SurfacePoint> Nearest(const Point<3>& p,
                                      double within_sq = std::numeric_limits<double>::infinity()) const;
  // The same of the triangles for which counts(triangle) is true.
  //
  // Complexity: O(nodes that are no farther than what is found, and calls for their triangles).
  std::optional<SurfacePoint> NearestOf(absl::FunctionRef<bool(uint32_t)> counts, const Point<3>& p,
                                        double within_sq = std::numeric_limits<double>::infinity()) const;

  // Whether a point of the surface is no farther from `p` than the root of `within_sq`; rounded as Nearest is. The
  // triangle `near` is looked at first, and becomes one that is as near, if there is one.
  //
  // REQUIRES:   `near` is a triangle of the complex.
  // Complexity: O(1) where `near` is; else at most that of Nearest, mostly a few nodes.
  bool IsWithin(const Point<3>& p, double within_sq, uint32_t& near) const;

  // The smallest node whose closed cube holds a box in the box of the grid.
  //
  // Complexity: O(depth).
  IndexNode Holding(const Box<3>& box) const;

  uint32_t node_count() const { return static_cast<uint32_t>(nodes_.size()); }
  uint64_t entry_count() const { return listed_.size(); }  // for tests
  // 0 of the root; a node's cube is half as long as that of the level before.
  int level(IndexNode node) const { return node == 0 ? 0 : parents_[(node - 1) / 8].level + 1; }
  bool IsLeaf(IndexNode node) const { return nodes_[node].count != kInner; }
  // Child i of a node that is no leaf: bit k of i says high along axis k, as in the vertices' tree.
  IndexNode Child(IndexNode node, uint32_t i) const { return nodes_[node].first + i; }
  // Whether no triangle comes near a leaf.
  bool IsEmpty(IndexNode leaf) const { return nodes_[leaf].count == 0; }
  const SurfaceComplex& complex() const { return *complex_; }
  // The box of all triangles.
  const Box<3>& hull() const { return hull_; }
  const Solids& solids() const { return *solids_; }
  Triangle TriangleAt(uint32_t triangle) const { return complex_->TriangleAt(triangle); }
  // The triangle as InOrder has it.
  Triangle InOrderAt(uint32_t triangle) const { return complex_->InOrderAt(triangle); }

 private:
  static constexpr uint32_t kInner = std::numeric_limits<uint32_t>::max();

  struct Node {
    uint32_t first = 0;  // of a leaf in listed_, else the first child
    uint32_t count = 0;  // of a leaf, else kInner
    uint32_t solid = 0;  // of the mark of a leaf
  };

  // A triangle at a leaf, and on which side of it the mark of the leaf is.
  using Entry = uint32_t;
  static constexpr Entry EntryOf(uint32_t triangle, Sign side) {
    return triangle << 1 | (side == Sign::kNegative ? 1 : 0);
  }

  // A node with its cube, which follows from that of its parent.
  struct Cube {
    IndexNode node = 0;
    int level = 0;
    Point<3> low{};
  };

  // A node that may be split yet.
  struct Pending {
    Cube cube;
    int fans = 0;  // nodes above it in which triangles had a common corner
  };

  // The node whose children are nodes 8 i + 1 to 8 i + 8.
  struct Parent {
    Point<3> low{};
    int level = 0;
  };

  Cube Root() const { return {.node = 0, .level = 0, .low = root_low_}; }
  Cube CubeOf(IndexNode node) const;
  Cube ChildOf(const Cube& cube, uint32_t i) const;
  Box<3> BoxOf(const Cube& cube) const;
  Point<3> MarkOf(const Cube& leaf) const;
  Cube LeafHolding(const Point<3>& p, IndexNode from) const;
  static uint32_t TriangleOf(Entry entry) { return entry >> 1; }
  std::span<const Entry> EntriesOf(IndexNode leaf) const {
    return {listed_.data() + nodes_[leaf].first, nodes_[leaf].count};
  }

  bool IsToBeSplit(const Pending& pending, std::span<const Entry> list, bool& is_fan) const;
  bool HaveCornerIn(std::span<const Entry> list, const Box<3>& box) const;
  uint8_t ChildrenMetBy(const Triangle& triangle, const Cube& cube) const;
  absl::Status Split(const Cube& cube, std::span<const Entry> list, std::vector<Entry>& lists,
                     const RunContext& context);
  class MarkWalk;
  absl::Status BuildNodes(const SurfaceComplex& complex, const MortonGrid<3>& grid, const RunContext& context);

  void FindCrossings(const Point<3>& a, const Point<3>& b, const Cube& from, bool first_alone,
                     std::vector<SurfaceCrossing>& crossings) const;

  void KeepCrossed(const Point<3>& a, const Point<3>& b, bool first_alone,
                   std::vector<SurfaceCrossing>& crossings) const;

  // Calls visit(cube) for every leaf, along the Z curve, that lies in cubes for which misses(box) is false alone.
  template <typename Misses, typename Visit>
  void ForEachLeaf(const Cube& from, const Misses& misses, const Visit& visit) const;
  double RoundingAt(const Point<3>& p) const;
  Cube HoldingAll(const Point<3>& p, double reach) const;
  std::array<double, 8> DistancesSqOfChildren(const Cube& cube, const Point<3>& p) const;
  bool IsWithin(const Cube& from, const Point<3>& p, double within_sq, double reach_sq, uint32_t& near) const;
  bool IsWithinIn(IndexNode leaf, const Point<3>& p, double within_sq, double reach_sq, uint32_t& near) const;
  template <typename Counts>
  std::optional<SurfacePoint> FindNearest(const Counts& counts, const Point<3>& p, double within_sq) const;
  template <typename Counts>
  void FindNearestIn(IndexNode leaf, const Counts& counts, const Point<3>& p, double& reach_sq,
                     std::optional<SurfacePoint>& nearest) const;
  template <typename Counts>
  void FindNearestBelow(const Cube& from, const Counts& counts, const Point<3>& p, double rounding, double& reach_sq,
                        std::optional<SurfacePoint>& nearest) const;

  const SurfaceComplex* complex_ = nullptr;
  const Solids* solids_ = nullptr;
  Box<3> box_{};   // of the grid
  Box<3> hull_{};  // of the triangles
  Point<3> root_low_{};
  std::vector<double> sides_;    // of cubes, by level
  std::vector<Node> nodes_;      // children side by side
  std::vector<Parent> parents_;  // in the order of their children
  std::vector<Entry> listed_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_SURFACE_INDEX_H_
