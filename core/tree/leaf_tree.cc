#include "core/tree/leaf_tree.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"

namespace wellspace::core {
namespace {

// Leaves that one thread fills at a time.
constexpr size_t kFilledTogether = 4096;

// Whether a leaf is to be split for the sake of segments: if it is crowded, and the lists of all leaves have fewer
// entries than 16 for each segment and four million. Where segments are so near each other that this is not enough, a
// mesh has several times as many vertices as the lists have entries, from sixteen million on: that more segments meet a
// leaf is its least trouble, and the estimate, which refuses it, has a tree to look at.
bool HasTooMany(const SegmentLists& lists, NodeId leaf, uint64_t nodes) {
  constexpr uint64_t kBytesPerSegment = sizeof(SegmentLists::Ends) + 16 * sizeof(uint32_t);
  constexpr uint64_t kBytesPerNode = 2 * sizeof(uint32_t);
  constexpr uint64_t kBytesAnyway = uint64_t{16} << 20;
  return lists.IsCrowded(leaf) &&
         lists.MemoryBytes() <= lists.count() * kBytesPerSegment + nodes * kBytesPerNode + kBytesAnyway;
}

// The memory beside the tree while it is built: points, and of a domain its graph and faces.
template <int D>
uint64_t BytesBeside(std::span<const Point<D>> points, const SegmentLists& lists) {
  constexpr uint64_t kDomainBytesPerSegment = 80;
  constexpr uint64_t kDomainBytesPerPoint = 40;
  return points.size_bytes() +
         (lists.IsEmpty() ? 0 : lists.count() * kDomainBytesPerSegment + points.size() * kDomainBytesPerPoint);
}

// The next larger number with the same bits in `fixed`.
constexpr uint32_t NextAlong(uint32_t number, uint32_t fixed) {
  return (((number | fixed) + 1) & ~fixed) | (number & fixed);
}

// Tells which points of a cube may be near another: it is cut into columns along its first two axes, of which a bit
// each says whether a point has been there.
//
// Thread safety: thread-compatible.
class ColumnsWithPoints {
 public:
  // Columns are more than side / 64 wide. Points may lie beyond the cube by half as much.
  explicit ColumnsWithPoints(double side) : scale_(62 / side), before_(side / 128) {}

  // Notes a point; `x` and `y` are from the low faces of the cube.
  void Add(double x, double y) { rows_[RowOf(x)] |= BitOf(y); }

  // Whether a point may have been added that is within side / 64 of one there.
  bool MayHaveNear(double x, double y) const {
    const size_t row = RowOf(x);
    const uint64_t own = BitOf(y);
    const uint64_t near = own | own << 1 | own >> 1;
    return ((rows_[row - 1] | rows_[row] | rows_[row + 1]) & near) != 0;
  }

 private:
  size_t RowOf(double x) const { return static_cast<size_t>((x + before_) * scale_) + 1; }
  uint64_t BitOf(double y) const { return uint64_t{1} << static_cast<size_t>((y + before_) * scale_); }

  const double scale_;
  const double before_;
  std::array<uint64_t, 66> rows_{};
};

}  // namespace

template <int D>
absl::Status LeafTree<D>::Build(const MortonGrid<D>& grid, std::span<const Point<D>> points, uint64_t max_leaves,
                                int threads, const RunContext& context, std::vector<SegmentLists::Ends> segments) {
  box_ = grid.box();
  segments_.Begin(std::move(segments));
  max_level_ = static_cast<uint8_t>(grid.levels());
  sides_ = grid.Sides();
  points_ = points;
  leaf_count_ = 1;
  leaf_of_.assign(points.size(), kNoNode);
  pool_ = {};
  Node root;
  root.low = grid.root_low();
  root.neighbour.fill(kNoNode);
  if (points.size() > kFilledTogether) {
    // Most clouds need fewer; unused room of large arrays takes no memory.
    nodes_.reserve(points.size() / 8);
    ranges_.reserve(points.size() / 8);
  }
  nodes_.assign(1, root);
  ranges_.assign(1, Range{.end = static_cast<uint32_t>(points.size())});
  pending_.assign(grid.levels() + 1, {});
  pending_[0].push_back(NodeId{0});
  around_ = {};

  uint32_t looked_at = 0;
  for (int level = 0; level < max_level_; ++level) {
    // Crowded leaves first: then the neighbours of those that are looked at more closely hold few points each. Both
    // loops also meet the leaves that balance appends meanwhile.
    for (const bool only_crowded : {true, false}) {
      for (size_t i = 0; i < pending_[level].size(); ++i) {
        const NodeId leaf = pending_[level][i];
        if (At(leaf).first_child != kNoNode) {
          continue;
        }
        if (ranges_[Index(leaf)].size() > kLeafCapacity || HasTooMany(segments_, leaf, node_count()) ||
            (!only_crowded && IsTooCoarse(leaf))) {
          Split(leaf);
        }
        if (leaf_count_ > max_leaves) {
          return absl::ResourceExhaustedError(
              absl::StrCat("the tree over the points needs more than ", max_leaves,
                           " leaves, so the mesh would have too many vertices; raise max_vertices"));
        }
        if ((++looked_at & 1023) == 0) {
          WELLSPACE_RETURN_IF_ERROR(context.Check());
          WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(MemoryBytes() + BytesBeside<D>(points, segments_)));
        }
      }
    }
    pending_[level] = {};
  }

  WELLSPACE_RETURN_IF_ERROR(FillLeaves(threads, context));
  points_ = {};
  ranges_ = {};
  pending_ = {};
  near_ = {};
  around_ = {};
  return absl::OkStatus();
}

// Puts the points into their leaves.
template <int D>
absl::Status LeafTree<D>::FillLeaves(int threads, const RunContext& context) {
  const size_t blocks = (node_count() + kFilledTogether - 1) / kFilledTogether;
  const auto for_each_leaf_with_points = [this](size_t block, auto f) {
    const auto end = static_cast<uint32_t>(std::min<size_t>(node_count(), (block + 1) * kFilledTogether));
    for (auto i = static_cast<uint32_t>(block * kFilledTogether); i < end; ++i) {
      if (IsLeaf(NodeId{i}) && ranges_[i].size() != 0) {
        f(NodeId{i}, ranges_[i]);
      }
    }
  };
  for (size_t block = 0; block < blocks; ++block) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(MemoryBytes() + points_.size_bytes()));
    for_each_leaf_with_points(block,
                              [this](NodeId leaf, const Range& range) { At(leaf).vertices = pool_.Add(range.size()); });
  }
  const auto fill = [&](size_t block) {
    for_each_leaf_with_points(block, [this](NodeId leaf, const Range& range) {
      pool_.Fill(At(leaf).vertices, points_.subspan(range.begin, range.size()), range.begin);
      std::fill(leaf_of_.begin() + range.begin, leaf_of_.begin() + range.end, leaf);
    });
    return context.Check();
  };
  return ThreadTeam(threads).TryForEach(blocks, fill);
}

template <int D>
NodeId LeafTree<D>::LeafWithRoom(VertexId near, const Point<D>& p) {
  NodeId leaf = LeafHolding(near, p);
  while (At(leaf).vertices != kNoVertices && pool_[At(leaf).vertices].count == kLeafCapacity && CanSplit(leaf)) {
    Split(leaf);
    leaf = Child(At(leaf), ChildHolding(At(leaf), p));
  }
  return leaf;
}

template <int D>
void LeafTree<D>::Insert(VertexId near, VertexId v, const Point<D>& p) {
  const NodeId leaf = LeafWithRoom(near, p);
  leaf_of_.push_back(kNoNode);
  Append(leaf, v, p);
}

template <int D>
void LeafTree<D>::Move(VertexId v, const Point<D>& p) {
  LeafVertices& inside = pool_[At(leaf_of(v)).vertices];
  const auto slot = static_cast<size_t>(std::find(inside.ids, inside.ids + inside.count, v) - inside.ids);
  if (LeafHolding(v, p) == leaf_of(v)) {
    inside.positions[slot] = p;
    return;
  }
  --inside.count;
  inside.ids[slot] = inside.ids[inside.count];
  inside.positions[slot] = inside.positions[inside.count];
  Append(LeafWithRoom(v, p), v, p);
}

template <int D>
void LeafTree<D>::Append(NodeId leaf, VertexId v, const Point<D>& p) {
  Node& node = At(leaf);
  if (node.vertices == kNoVertices) {
    node.vertices = pool_.Add(1);
  }
  pool_.Append(node.vertices, v, p);
  leaf_of_[Index(v)] = leaf;
}

// The child of `node` that a point of its cube belongs to; for a point outside, the nearest child. A point on the
// high face of the box stays on the low side of a cut there, since nothing of the box lies on the other.
template <int D>
int LeafTree<D>::ChildHolding(const Node& node, const Point<D>& p) const {
  int child = 0;
  for (int i = 0; i < D; ++i) {
    const double middle = node.low[i] + 0.5 * SideOf(node);
    if (p[i] >= middle && middle < box_.high[i]) {
      child |= 1 << i;
    }
  }
  return child;
}

template <int D>
NodeId LeafTree<D>::LeafHolding(VertexId near, const Point<D>& p) const {
  NodeId at = near == kNoVertex ? NodeId{0} : leaf_of(near);
  while (true) {
    const Node& node = At(at);
    if (node.first_child != kNoNode) {
      at = Child(node, ChildHolding(node, p));
      continue;
    }
    // Step through the face that p is farthest beyond. Cubes are half open, but for the high faces of the box.
    int face = -1;
    double farthest = -1;
    for (int i = 0; i < D; ++i) {
      const double high = node.low[i] + SideOf(node);
      if (p[i] < node.low[i] && node.low[i] - p[i] > farthest) {
        farthest = node.low[i] - p[i];
        face = FaceIndex(i, false);
      } else if (p[i] >= high && high < box_.high[i] && p[i] - high > farthest) {
        farthest = p[i] - high;
        face = FaceIndex(i, true);
      }
    }
    if (face < 0) {
      return at;
    }
    at = node.neighbour[face];
  }
}

template <int D>
void LeafTree<D>::Split(NodeId leaf) {
  SplitLargerNeighbours(leaf);
  const NodeId first{node_count()};
  nodes_.resize(nodes_.size() + kChildren);
  Node& parent = At(leaf);
  parent.first_child = first;
  uint32_t inside = 0;
  for (int child = 0; child < kChildren; ++child) {
    Node& node = At(Child(parent, child));
    node.level = static_cast<uint8_t>(parent.level + 1);
    for (int i = 0; i < D; ++i) {
      node.low[i] = parent.low[i] + ((child >> i) & 1) * SideOf(node);
      node.outside = node.outside || node.low[i] >= box_.high[i];
    }
    inside += node.outside ? 0 : 1;
  }
  leaf_count_ += inside - 1;
  LinkChildren(leaf);
  if constexpr (D == 2) {
    if (!segments_.IsEmpty()) {
      const std::array<Box<2>, 4> cubes = {BoxOf(Child(At(leaf), 0)), BoxOf(Child(At(leaf), 1)),
                                           BoxOf(Child(At(leaf), 2)), BoxOf(Child(At(leaf), 3))};
      segments_.HandDown(leaf, first, cubes);
    }
  }
  if (!pending_.empty()) {
    DistributeRange(leaf);
  } else {
    DistributeVertices(leaf);
  }
}

// Splits every leaf that touches `leaf` and is larger: reached through faces, one axis after the other.
template <int D>
void LeafTree<D>::SplitLargerNeighbours(NodeId leaf) {
  SplitLargerNeighboursFrom(leaf, leaf, 0);
}

template <int D>
void LeafTree<D>::SplitLargerNeighboursFrom(NodeId leaf, NodeId at, int axis) {
  if (axis == D) {
    return;
  }
  SplitLargerNeighboursFrom(leaf, at, axis + 1);
  for (const bool high : {false, true}) {
    const int face = FaceIndex(axis, high);
    NodeId beyond = At(at).neighbour[face];
    if (beyond == kNoNode) {
      continue;
    }
    if (At(beyond).level < At(leaf).level) {
      Split(beyond);
      beyond = At(at).neighbour[face];
    }
    SplitLargerNeighboursFrom(leaf, beyond, axis + 1);
  }
}

// Sets the neighbours of the new children of `parent`, and those of nodes around that had `parent` for a neighbour.
//
// REQUIRES:   the nodes around `parent` are at its level.
template <int D>
void LeafTree<D>::LinkChildren(NodeId parent) {
  for (int child = 0; child < kChildren; ++child) {
    const NodeId id = Child(At(parent), child);
    for (int face = 0; face < kFaces; ++face) {
      const int axis = face / 2;
      const bool high = face % 2 == 1;
      const int mirrored = child ^ (1 << axis);
      NodeId beyond = kNoNode;
      if (((child >> axis) & 1) != (high ? 1 : 0)) {
        beyond = Child(At(parent), mirrored);
      } else if (const NodeId around = At(parent).neighbour[face]; around != kNoNode) {
        beyond = At(around).first_child == kNoNode ? around : Child(At(around), mirrored);
      }
      if (beyond != kNoNode && At(beyond).outside) {
        beyond = kNoNode;
      }
      At(id).neighbour[face] = beyond;
      if (beyond != kNoNode && At(beyond).level == At(id).level && !At(id).outside) {
        At(beyond).neighbour[FaceIndex(axis, !high)] = id;
      }
    }
  }
}

// Shares out the points of `parent` among its children, which lie along the Z curve as they do.
template <int D>
void LeafTree<D>::DistributeRange(NodeId parent) {
  const Node& node = At(parent);
  ranges_.resize(nodes_.size());
  // Where the points of each child begin: halved along the most significant axis first.
  std::array<uint32_t, kChildren + 1> begins;
  begins[0] = ranges_[Index(parent)].begin;
  begins[kChildren] = ranges_[Index(parent)].end;
  for (int axis = D - 1; axis >= 0; --axis) {
    const double middle = node.low[axis] + 0.5 * SideOf(node);
    const uint32_t half = uint32_t{1} << axis;
    for (uint32_t child = half; child < kChildren; child += 2 * half) {
      begins[child] = middle < box_.high[axis] ? FirstFrom(begins[child - half], begins[child + half], axis, middle)
                                               : begins[child + half];
    }
  }
  for (uint32_t child = 0; child < kChildren; ++child) {
    const NodeId id = Child(node, child);
    ranges_[Index(id)] = Range{.begin = begins[child], .end = begins[child + 1], .parent = parent};
    if (!At(id).outside) {
      pending_[At(id).level].push_back(id);
    }
  }
  HandDown(parent);
  const bool is_crowded = ranges_[Index(parent)].size() > kLeafCapacity;
  for (uint32_t child = 0; child < kChildren; ++child) {
    const NodeId id = Child(At(parent), child);
    if (ranges_[Index(id)].size() != 0 && ranges_[Index(id)].size() <= kLeafCapacity) {
      // Leaves beyond the parent have been told by that, unless it was crowded.
      TellAround(id, is_crowded ? SidesOf(kChildren - 1, kChildren - 1) : SidesOf(child, kChildren - 1 - child));
    }
  }
}

// The first of the points from `begin` to `end`, or the end, whose coordinate is at least x, as are those of all after
// it.
template <int D>
uint32_t LeafTree<D>::FirstFrom(uint32_t begin, uint32_t end, int axis, double x) const {
  const auto is_before = [axis, x](const Point<D>& p) { return p[axis] < x; };
  return static_cast<uint32_t>(std::partition_point(points_.begin() + begin, points_.begin() + end, is_before) -
                               points_.begin());
}

template <int D>
void LeafTree<D>::DistributeVertices(NodeId parent) {
  const uint32_t old = At(parent).vertices;
  if (old == kNoVertices) {
    return;
  }
  At(parent).vertices = kNoVertices;
  pool_.Dissolve(old,
                 [&](VertexId v, const Point<D>& p) { Append(Child(At(parent), ChildHolding(At(parent), p)), v, p); });
}

// Whether lfs somewhere on the leaf is below side / kCoarseness, up to a factor of two; see HasNearFeatures.
template <int D>
bool LeafTree<D>::IsTooCoarse(NodeId leaf) {
  const double side = SideOf(leaf);
  if (side > box_.ShortestSide()) {
    return true;
  }
  const Range& range = ranges_[Index(leaf)];
  const std::span<const Point<D>> own = points_.subspan(range.begin, range.size());
  if (range.first_around == kNone) {
    return HasNearFeatures(own, BoxOf(leaf), ReachOf(leaf));
  }
  near_.assign(own.begin(), own.end());
  for (uint32_t i = range.first_around; i != kNone; i = around_[i].next) {
    near_.push_back(around_[i].p);
  }
  return HasNearFeatures(near_, BoxOf(leaf), ReachOf(leaf));
}

// Hands those points around `parent` that are within reach of a child down to it.
template <int D>
void LeafTree<D>::HandDown(NodeId parent) {
  for (uint32_t i = ranges_[Index(parent)].first_around; i != kNone; i = around_[i].next) {
    const Point<D> p = around_[i].p;
    for (int child = 0; child < kChildren; ++child) {
      AddAround(Child(At(parent), child), p);
    }
  }
}

// Puts down that `p`, a point outside the node, is around it, if it is within reach.
template <int D>
void LeafTree<D>::AddAround(NodeId node, const Point<D>& p) {
  const double reach = ReachOf(node);
  if (!At(node).outside && DistanceSq<D>(p, BoxOf(node)) <= reach * reach) {
    uint32_t& first = ranges_[Index(node)].first_around;
    around_.push_back({p, first});
    first = static_cast<uint32_t>(around_.size() - 1);
  }
}

// Tells the leaves that touch `leaf` of its points that are within their reach: of those, only the leaves beyond
// `sides`.
template <int D>
void LeafTree<D>::TellAround(NodeId leaf, Sides sides) {
  const double side = SideOf(leaf);
  // A leaf that touches it is twice as large at most.
  const double inner = 0.5 * side - 2 * (1 + 0x1p-20) * ReachOf(leaf);
  Point<D> centre = At(leaf).low;
  for (double& x : centre) {
    x += 0.5 * side;
  }
  const Range& range = ranges_[Index(leaf)];
  near_.resize(range.size());
  size_t count = 0;
  Sides near_sides = 0;
  for (const Point<D>& p : points_.subspan(range.begin, range.size())) {
    uint32_t low = 0;
    uint32_t high = 0;
    for (int i = 0; i < D; ++i) {
      const double x = p[i] - centre[i];
      low |= (x <= -inner ? 1u : 0u) << i;
      high |= (x >= inner ? 1u : 0u) << i;
    }
    // No branch, since it could not be predicted.
    near_[count] = p;
    count += (low | high) != 0 ? 1 : 0;
    near_sides |= SidesOf(low, high);
  }
  if ((near_sides & sides) != 0) {
    ForEachTouching(leaf, near_sides & sides, [&](NodeId other) {
      for (size_t i = 0; i < count; ++i) {
        AddAround(other, near_[i]);
      }
    });
  }
}

// Calls f(NodeId) for each leaf under construction that touches `leaf` by no other of its sides than `sides`, once.
//
// Complexity: O(6^D), for most leaves O(4^D).
template <int D>
template <typename F>
void LeafTree<D>::ForEachTouching(NodeId leaf, Sides sides, F&& f) const {
  const NodeId parent = ranges_[Index(leaf)].parent;
  const uint32_t own = Index(leaf) - Index(At(parent).first_child);
  const Sides low = sides & (kChildren - 1);
  const Sides high = sides >> D;
  // The axes along which the leaf is looked beyond on the parent's side, and on that of its siblings.
  const uint32_t outward = (low & ~own) | (high & own);
  const uint32_t inward = (low & own) | (high & ~own);
  // The nodes of the parent's size that touch the leaf, by the axes along which one goes there from the parent. None is
  // larger, since the parent has been split.
  std::array<NodeId, kChildren> around;
  around[0] = parent;
  for (uint32_t axes = 0; axes < kChildren; axes = NextAlong(axes, kChildren - 1 - outward)) {
    if (axes != 0) {
      const int axis = std::countr_zero(axes);
      const NodeId before = around[axes & (axes - 1)];
      around[axes] = before == kNoNode ? kNoNode : At(before).neighbour[FaceIndex(axis, ((own >> axis) & 1) != 0)];
    }
    if (around[axes] == kNoNode) {
      continue;
    }
    const Node& node = At(around[axes]);
    if (node.first_child == kNoNode) {
      f(around[axes]);
      continue;
    }
    // Children that face the leaf along `axes` touch it; of the children of one, the ones that face it along all
    // axes that tell the two apart.
    const uint32_t facing = own ^ axes;
    const uint32_t fixed = kChildren - 1 - (inward & ~axes);
    for (uint32_t child = facing & fixed; child < kChildren; child = NextAlong(child, fixed)) {
      const NodeId id = Child(node, child);
      if (id == leaf || At(id).outside) {
        continue;
      }
      if (At(id).first_child == kNoNode) {
        f(id);
        continue;
      }
      const uint32_t apart = child ^ own;
      for (uint32_t grandchild = facing & apart; grandchild < kChildren; grandchild = NextAlong(grandchild, apart)) {
        const NodeId smaller = Child(At(id), grandchild);
        if (!At(smaller).outside) {
          f(smaller);
        }
      }
    }
  }
}

// Whether two features (`points`, faces of the box that a point does not lie on) are both within `reach` of one
// point of `cube`, looked for where it is best for the pair: at the projection of the points' midpoint on the cube, or
// of the point itself. A pair within reach / 2 of a common point of the cube is always found, as projecting does not
// expand.
template <int D>
bool LeafTree<D>::HasNearFeatures(std::span<const Point<D>> points, const Box<D>& cube, double reach) const {
  const double reach_sq = reach * reach;
  const auto project = [&](Point<D> p) {
    for (int i = 0; i < D; ++i) {
      p[i] = std::clamp(p[i], std::max(cube.low[i], box_.low[i]), std::min(cube.high[i], box_.high[i]));
    }
    return p;
  };
  FaceMask near_faces = 0;
  for (int face = 0; face < kFaces; ++face) {
    if (box_.DistanceToFace(project(face % 2 == 0 ? cube.low : cube.high), face) <= reach) {
      near_faces |= static_cast<FaceMask>(1u << face);
    }
  }
  // Two points that are farther from each other are not both within reach of a third.
  const double far_sq = 4 * (1 + 0x1p-20) * reach_sq;
  // The columns rely on this: it is at most side / 64, and points lie at most side / 128 beyond the cube.
  static_assert(kCoarseness >= 128);
  ColumnsWithPoints columns(cube.high[0] - cube.low[0]);
  for (size_t i = 0; i < points.size(); ++i) {
    const Point<D>& a = points[i];
    if (near_faces != 0) {
      const Point<D> own = project(a);
      const int others = near_faces & ~box_.FacesOf(a);
      for (int face = 0; face < kFaces; ++face) {
        if (((others >> face) & 1) != 0 && box_.DistanceToFace(own, face) <= reach) {
          return true;
        }
      }
    }
    const double from_low[] = {a[0] - cube.low[0], a[1] - cube.low[1]};
    const bool may_be_near = columns.MayHaveNear(from_low[0], from_low[1]);
    columns.Add(from_low[0], from_low[1]);
    if (!may_be_near) {
      continue;
    }
    for (size_t j = 0; j < i; ++j) {
      const Point<D>& b = points[j];
      if (DistanceSq<D>(a, b) > far_sq) {
        continue;
      }
      Point<D> middle;
      for (int k = 0; k < D; ++k) {
        middle[k] = 0.5 * (a[k] + b[k]);
      }
      const Point<D> x = project(middle);
      if (DistanceSq<D>(a, x) <= reach_sq && DistanceSq<D>(b, x) <= reach_sq) {
        return true;
      }
    }
  }
  return false;
}

#define WELLSPACE_INSTANTIATE(D) template class LeafTree<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
