// The balanced orthtree (2^D-tree: quadtree, octree, …) whose leaves hold the vertices: the leaf of a vertex, and the
// leaves around it.
#ifndef WELLSPACE_CORE_TREE_LEAF_TREE_H_
#define WELLSPACE_CORE_TREE_LEAF_TREE_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/memory/prefetch.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_vertices.h"
#include "core/tree/morton.h"
#include "core/tree/segment_lists.h"

namespace wellspace::core {

// The leaves are cubes; they cover the box, do not overlap, and no two that touch, be it in a corner, differ by more
// than a factor of two in side.
//
// Thread safety: thread-compatible.
// Invariants:
//   (1) a vertex lies in the closed cube of its leaf;
//   (2) balance: the levels of touching leaves differ by at most one;
//   (3) property B of [HT08] §5 after Build: a leaf longer than the grid's cubes, of side s, has lfs >= s / (2
//       kCoarseness) everywhere; and a node of side S is split only if S exceeds the box's shortest side, or it holds
//       more than kLeafCapacity points, or two features are within S / kCoarseness of it and twice that of each other,
//       or, for balance, a node of side S / 2 that touches it is split. The features are the points and the faces of
//       the box, a face not to a point that lies on it;
//   (4) a leaf holds at most kLeafCapacity vertices;
//   (5) neighbour(node, face) is the node of the same level beyond the face, or the larger leaf there, or none beyond
//   the box.
template <int D>
class LeafTree {
 public:
  static constexpr int kChildren = 1 << D;
  static constexpr int kFaces = 2 * D;
  // A leaf beyond a face is one, or 2^(D - 1) half as large.
  static constexpr int kMostFaceNeighbours = D * kChildren;
  // In 5-D and 6-D a vertex has hundreds of neighbours and a node 32 or 64 children: fewer, larger leaves serve better.
  static constexpr int kLeafCapacity = D <= 3 ? 48 : D == 4 ? 64 : 16 << D;
  // A leaf may be this many times larger than lfs on it. At least 2, so that the neighbours of a leaf hold all that is
  // near it. docs/design/tree.md, "Capacity and coarseness by dimension", has the measurements with 128 and 1024.
  static constexpr double kCoarseness = D <= 4 ? 128 : 1024;

  using VertexPool = LeafVertexPool<D, kLeafCapacity>;
  // The vertices of one leaf, side by side.
  using LeafVertices = typename VertexPool::LeafVertices;

  // Builds the tree over the box of `grid` for `points`, sorted in the grid's Morton order and distinct as cubes of it;
  // vertex i is points[i]. In the plane it lists `segments` of the box, if there are any, at the leaves that they meet,
  // and splits leaves which too many of them meet.
  //
  // Complexity: O(D 2^D L) for L leaves.
  // Errors:     RESOURCE_EXHAUSTED when it would have more than `max_leaves` leaves, or of the context's memory;
  //             CANCELLED, DEADLINE_EXCEEDED.
  // Threads:    uses `threads`, at most as many as the machine has cores, to fill the leaves.
  // Source:     [HT08] §5; levels from the top down over sorted ranges instead of Bern, Eppstein and Teng's merging,
  //             which matters only when leaves are compressed; here every leaf is one that a mesh of optimal size
  //             needs.
  absl::Status Build(const MortonGrid<D>& grid, std::span<const Point<D>> points, uint64_t max_leaves, int threads,
                     const RunContext& context, std::vector<SegmentLists::Ends> segments = {});
  const SegmentLists& segments() const { return segments_; }

  // Makes room for so many vertices to be told where they are.
  void Reserve(uint32_t vertices) { leaf_of_.reserve(vertices); }

  // Adds vertex `v`, the one after the last, at `p`, walking from the leaf of `near`, or from the root for kNoVertex;
  // splits a leaf that is full.
  //
  // REQUIRES:   p in the box; v == vertex_count(); no more than kLeafCapacity vertices in one cube of the grid.
  // Complexity: O(1 + leaves between near and p).
  // Source:     [HT08] §5, AddVertex.
  void Insert(VertexId near, VertexId v, const Point<D>& p);

  // Puts vertex `v` at `p`, walking from its leaf.
  //
  // REQUIRES:   as Insert; v is a vertex.
  // Complexity: O(1 + leaves between its places).
  void Move(VertexId v, const Point<D>& p);

  // The leaf that `p` belongs to, walked to from the leaf of `near`, or from the root for kNoVertex.
  //
  // REQUIRES:   p in the box.
  // Complexity: O(1 + leaves between near and p), or O(depth).
  NodeId LeafHolding(VertexId near, const Point<D>& p) const;

  NodeId leaf_of(VertexId v) const { return leaf_of_[Index(v)]; }
  void PrefetchLeafOf(VertexId v) const { PrefetchLine(&leaf_of_[Index(v)]); }
  void PrefetchNode(NodeId node) const { PrefetchLine(&At(node)); }
  void PrefetchNeighbours(NodeId node) const {
    for (const NodeId beyond : At(node).neighbour) {
      if (beyond != kNoNode) {
        PrefetchNode(beyond);
      }
    }
  }
  uint32_t vertex_count() const { return static_cast<uint32_t>(leaf_of_.size()); }
  uint64_t leaf_count() const { return leaf_count_; }
  // Nodes are numbered from 0; not every one is a leaf.
  uint32_t node_count() const { return static_cast<uint32_t>(nodes_.size()); }
  // The memory of a node, but for the vertices in it.
  static constexpr size_t NodeBytes() { return sizeof(Node); }
  // The memory that the tree takes.
  uint64_t MemoryBytes() const {
    return nodes_.size() * sizeof(Node) + pool_.MemoryBytes() + ranges_.size() * sizeof(Range) +
           leaf_of_.size() * sizeof(NodeId) + around_.size() * sizeof(Around) + segments_.MemoryBytes();
  }
  // Whether `node` is a leaf that covers a part of the box.
  bool IsLeaf(NodeId node) const { return At(node).first_child == kNoNode && !At(node).outside; }
  Box<D> BoxOf(NodeId node) const {
    Box<D> cube{At(node).low, At(node).low};
    for (int i = 0; i < D; ++i) {
      cube.high[i] += SideOf(At(node));
    }
    return cube;
  }
  const Point<D>& LowOf(NodeId node) const { return At(node).low; }
  int level(NodeId node) const { return At(node).level; }
  double SideOf(NodeId node) const { return SideOf(At(node)); }
  // A lower bound on the distance of a point of Build in `leaf` from the others, and from faces of the box that it is
  // not on.
  double SeparationIn(NodeId leaf) const {
    return At(leaf).level == max_level_ ? 0 : SideOf(At(leaf)) / (2 * kCoarseness);
  }

  // The vertices in a leaf, or null for none.
  const LeafVertices* VerticesIn(NodeId leaf) const {
    const uint32_t number = At(leaf).vertices;
    return number == kNoVertices ? nullptr : &pool_[number];
  }

  // Calls f(NodeId) for every leaf, along the Z curve.
  //
  // Complexity: O(nodes).
  template <typename F>
  void ForEachLeaf(F&& f, NodeId from = NodeId{0}) const {
    const Node& node = At(from);
    if (node.outside) {
      return;
    }
    if (node.first_child == kNoNode) {
      f(from);
      return;
    }
    for (int child = 0; child < kChildren; ++child) {
      ForEachLeaf(f, Child(node, child));
    }
  }

  // Calls f(NodeId) for each leaf that shares a part of a facet with `leaf`.
  //
  // Complexity: O(D 2^D), for most leaves O(D).
  template <typename F>
  void ForEachFaceNeighbour(NodeId leaf, F&& f) const {
    ForEachBeyondFacets(leaf, (1u << kFaces) - 1, f);
  }

  // The same, but only for `facets` of it: a bit for each, by the face of the box that it faces.
  template <typename F>
  void ForEachBeyondFacets(NodeId leaf, uint32_t facets, F&& f) const {
    for (; facets != 0; facets &= facets - 1) {
      ForEachBeyond(leaf, std::countr_zero(facets), f);
    }
  }

 private:
  static constexpr uint32_t kNoVertices = ~uint32_t{0};

  // In 3-D one line of a cache.
  struct alignas(D == 3 ? 64 : alignof(double)) Node {
    Point<D> low;
    std::array<NodeId, kFaces> neighbour;
    NodeId first_child = kNoNode;
    uint32_t vertices = kNoVertices;  // a number in the pool
    uint8_t level = 0;
    bool outside = false;  // no part of the box in its interior
  };

  // Sides of a cube: a bit for each axis along which it is the low one, and so for high ones.
  using Sides = uint32_t;
  static constexpr Sides SidesOf(uint32_t low, uint32_t high) { return low | high << D; }

  // None in around_.
  static constexpr uint32_t kNone = ~uint32_t{0};

  // A node under construction: its points, and those around it.
  struct Range {
    uint32_t begin = 0;
    uint32_t end = 0;
    NodeId parent = kNoNode;
    uint32_t first_around = kNone;
    uint32_t size() const { return end - begin; }
  };

  // A point within reach of a node that it does not lie in.
  struct Around {
    Point<D> p;
    uint32_t next = kNone;  // of the same node
  };

  double SideOf(const Node& node) const { return sides_[node.level]; }
  const Node& At(NodeId id) const { return nodes_[Index(id)]; }
  Node& At(NodeId id) { return nodes_[Index(id)]; }
  static NodeId Child(const Node& node, uint32_t child) { return NodeId{Index(node.first_child) + child}; }

  // Calls f(NodeId) for each leaf that shares a part of that facet with `leaf`.
  template <typename F>
  void ForEachBeyond(NodeId leaf, int face, F&& f) const {
    const NodeId beyond = At(leaf).neighbour[face];
    if (beyond == kNoNode) {
      return;
    }
    const Node& other = At(beyond);
    if (other.first_child == kNoNode) {
      f(beyond);
      return;
    }
    const int axis = face / 2;
    const int facing = face % 2 == 0 ? 1 : 0;
    for (int i = 0; i < kChildren / 2; ++i) {
      // The bits of i with that of the axis put in.
      const int above = i >> axis;
      const NodeId id = Child(other, i + (above << axis) + (facing << axis));
      if (!At(id).outside) {
        f(id);
      }
    }
  }

  int ChildHolding(const Node& node, const Point<D>& p) const;
  bool CanSplit(NodeId leaf) const { return At(leaf).level < max_level_; }

  // Splits a leaf into its children, and before that, for balance, larger leaves that touch it.
  void Split(NodeId leaf);
  void SplitLargerNeighbours(NodeId leaf);
  void SplitLargerNeighboursFrom(NodeId leaf, NodeId at, int axis);
  void LinkChildren(NodeId parent);
  void DistributeRange(NodeId parent);
  uint32_t FirstFrom(uint32_t begin, uint32_t end, int axis, double x) const;
  void DistributeVertices(NodeId parent);
  void Append(NodeId leaf, VertexId v, const Point<D>& p);
  NodeId LeafWithRoom(VertexId near, const Point<D>& p);

  absl::Status FillLeaves(int threads, const RunContext& context);

  // The split rule of Build.
  bool IsTooCoarse(NodeId leaf);
  // A leaf is split if two features are within this distance of it, and twice that of each other.
  double ReachOf(NodeId leaf) const { return SideOf(leaf) / kCoarseness; }
  void HandDown(NodeId parent);
  void AddAround(NodeId node, const Point<D>& p);
  void TellAround(NodeId leaf, Sides sides);
  template <typename F>
  void ForEachTouching(NodeId leaf, Sides sides, F&& f) const;
  bool HasNearFeatures(std::span<const Point<D>> points, const Box<D>& cube, double reach) const;

  Box<D> box_;
  uint8_t max_level_ = 0;
  std::vector<double> sides_;  // of nodes, by level
  uint64_t leaf_count_ = 0;
  HugeVector<Node> nodes_;
  VertexPool pool_;
  HugeVector<NodeId> leaf_of_;
  SegmentLists segments_;  // none unless D is 2

  // During Build only.
  std::span<const Point<D>> points_;
  HugeVector<Range> ranges_;                  // by node
  std::vector<std::vector<NodeId>> pending_;  // leaves to be looked at, by level
  std::vector<Point<D>> near_;                // scratch
  HugeVector<Around> around_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_LEAF_TREE_H_
