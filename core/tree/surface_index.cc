#include "core/tree/surface_index.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/memory/prefetch.h"
#include "core/base/status_macros.h"
#include "core/features/triangle_crossing.h"

namespace wellspace::core {
namespace {

// A triangle is looked at more closely than by its box where it is no smaller than this share of a cube.
constexpr double kLarge = 0.25;

// Tests of triangles against cubes, of some 100 ns, between two looks at the context.
constexpr size_t kTestsBetweenChecks = size_t{1} << 12;

// Nodes and entries are numbered by 32 bits, of which the last is kept for kInner.
constexpr uint64_t kMostNumbered = uint64_t{0xffff'fff0};

}  // namespace

// Walks along the Z curve: the segment from each middle to the one before lies in the cube that holds both.
class SurfaceIndex::MiddleWalk {
 public:
  // It starts from beyond the triangles.
  MiddleWalk(SurfaceIndex& index, const RunContext& context)
      : index_(index), context_(context), within_(index.Root()), known_(index.hull_.low) {
    known_[0] -= 1 + std::abs(known_[0]);
  }

  absl::Status Visit(const Cube& cube) {
    for (int axis = 0; axis < 3; ++axis) {
      if (cube.low[axis] >= index_.box_.high[axis]) {
        return absl::OkStatus();  // no point is looked for there
      }
    }
    if (index_.IsLeaf(cube.node)) {
      return VisitLeaf(cube);
    }
    for (uint32_t k = 0; k < 8; ++k) {
      if (k > 0) {
        within_ = cube;
      }
      WELLSPACE_RETURN_IF_ERROR(Visit(index_.ChildOf(cube, k)));
    }
    return absl::OkStatus();
  }

 private:
  absl::Status VisitLeaf(const Cube& leaf) {
    steps_ += 16 + index_.nodes_[leaf.node].count;
    if (steps_ >= kTestsBetweenChecks) {
      steps_ = 0;
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
    }
    const Point<3> middle = index_.MiddleOf(leaf);
    index_.FindCrossings(middle, known_, within_, /*first_alone=*/true, crossings_);
    solid_ = crossings_.empty() ? solid_ : index_.solids_->solid_of[crossings_[0].before];
    known_ = middle;
    Node& node = index_.nodes_[leaf.node];
    node.solid = solid_;
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      const uint32_t t = TriangleOf(index_.listed_[i]);
      index_.listed_[i] = EntryOf(t, MovedSide(index_.TriangleAt(t), middle));
    }
    return absl::OkStatus();
  }

  SurfaceIndex& index_;
  const RunContext& context_;
  Cube within_;     // holds the next leaf and the last
  Point<3> known_;  // of solid_
  uint32_t solid_ = 0;
  size_t steps_ = kTestsBetweenChecks;  // since the last look at the context
  std::vector<SurfaceCrossing> crossings_;
};

absl::Status SurfaceIndex::Build(const SurfaceComplex& complex, const Solids& solids, const MortonGrid<3>& grid,
                                 const RunContext& context) {
  complex_ = &complex;
  solids_ = &solids;
  box_ = grid.box();
  root_low_ = grid.root_low();
  sides_ = grid.Sides();
  nodes_ = {};
  parents_ = {};
  listed_ = {};
  const auto triangles = static_cast<uint32_t>(complex.triangles.size());
  nodes_.push_back({.first = 0, .count = triangles});
  std::vector<Entry> lists;  // of the nodes of one level
  for (uint32_t t = 0; t < triangles; ++t) {
    if (t % kTestsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    lists.push_back(EntryOf(t, Sign::kPositive));
    const Box<3> box = BoxOfTriangle(TriangleAt(t));
    hull_ = t == 0 ? box : hull_;
    hull_.Include(box);
  }
  const uint64_t most_nodes = std::min(kNodesAnyway + kNodesPerTriangle * triangles, kMostNumbered);
  const uint64_t most_entries = std::min(kEntriesAnyway + kEntriesPerTriangle * triangles, kMostNumbered);
  uint64_t entries = triangles;  // in all lists
  std::vector<Pending> pending = {{.cube = Root()}};
  while (!pending.empty()) {
    std::vector<Pending> next;
    std::vector<Entry> next_lists;
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(MemoryBytes() + lists.capacity() * sizeof(Entry)));
    for (size_t i = 0; i < pending.size(); ++i) {
      if (i % kTestsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const Cube cube = pending[i].cube;
      Node& node = nodes_[cube.node];
      const std::span<const Entry> list(lists.data() + node.first, node.count);
      bool is_fan = false;
      if (!IsToBeSplit(pending[i], list, is_fan) || entries + 7 * list.size() > most_entries ||
          nodes_.size() + 8 > most_nodes) {
        node.first = static_cast<uint32_t>(listed_.size());
        listed_.insert(listed_.end(), list.begin(), list.end());
        continue;
      }
      const size_t before = next_lists.size();
      WELLSPACE_RETURN_IF_ERROR(Split(cube, list, next_lists, context));  // which `node` does not outlive
      entries += next_lists.size() - before - list.size();
      for (uint32_t k = 0; k < 8; ++k) {
        next.push_back({.cube = ChildOf(cube, k), .fans = pending[i].fans + (is_fan ? 1 : 0)});
      }
    }
    pending = std::move(next);
    lists = std::move(next_lists);
  }
  return MiddleWalk(*this, context).Visit(Root());
}

uint64_t SurfaceIndex::Bytes(uint64_t triangles) {
  const uint64_t nodes = kNodesAnyway + kNodesPerTriangle * triangles;
  const uint64_t entries = kEntriesAnyway + kEntriesPerTriangle * triangles;
  // Arrays grow by doubling: lists of two levels and of leaves, which have no more entries together; nodes, and those
  // of a level that may be split.
  return 4 * entries * sizeof(Entry) + 2 * (nodes * sizeof(Node) + nodes / 8 * sizeof(Parent)) +
         nodes / 2 * sizeof(Pending);
}

uint64_t SurfaceIndex::MemoryBytes() const {
  return nodes_.capacity() * sizeof(Node) + parents_.capacity() * sizeof(Parent) + listed_.capacity() * sizeof(Entry);
}

SurfaceIndex::Cube SurfaceIndex::CubeOf(IndexNode node) const {
  if (node == 0) {
    return Root();
  }
  const Parent& parent = parents_[(node - 1) / 8];
  Cube cube{.node = node, .level = parent.level + 1, .low = parent.low};
  for (int axis = 0; axis < 3; ++axis) {
    cube.low[axis] += (((node - 1) >> axis) & 1) != 0 ? sides_[cube.level] : 0;
  }
  return cube;
}

SurfaceIndex::Cube SurfaceIndex::ChildOf(const Cube& cube, uint32_t i) const {
  Cube child{.node = Child(cube.node, i), .level = cube.level + 1, .low = cube.low};
  for (int axis = 0; axis < 3; ++axis) {
    child.low[axis] += ((i >> axis) & 1) != 0 ? sides_[child.level] : 0;
  }
  return child;
}

Box<3> SurfaceIndex::BoxOf(const Cube& cube) const {
  Box<3> box{cube.low, cube.low};
  for (double& x : box.high) {
    x += sides_[cube.level];
  }
  return box;
}

Point<3> SurfaceIndex::MiddleOf(const Cube& cube) const {
  Point<3> middle = cube.low;
  for (double& x : middle) {
    x += 0.5 * sides_[cube.level];
  }
  return middle;
}

// Cubes are half open, but for the high faces of the box, as in the vertices' tree.
SurfaceIndex::Cube SurfaceIndex::LeafHolding(const Point<3>& p, IndexNode from) const {
  Cube cube = CubeOf(from);
  while (!IsLeaf(cube.node)) {
    ++cube.level;
    uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double middle = cube.low[axis] + sides_[cube.level];
      if (p[axis] >= middle && middle < box_.high[axis]) {
        child |= 1u << axis;
        cube.low[axis] = middle;
      }
    }
    cube.node = Child(cube.node, child);
  }
  return cube;
}

// `is_fan`: whether it is split for the sake of a small leaf at the corner of a large fan.
bool SurfaceIndex::IsToBeSplit(const Pending& pending, std::span<const Entry> list, bool& is_fan) const {
  if (list.size() <= kCapacity || pending.cube.level + 1 == static_cast<int>(sides_.size())) {
    return false;
  }
  is_fan = HaveCornerIn(list, BoxOf(pending.cube));
  return !is_fan || (list.size() > kLargeFan && pending.fans < kFanLevels);
}

// Whether all of these triangles have a corner in common that is in the box: splits part no such triangles there.
bool SurfaceIndex::HaveCornerIn(std::span<const Entry> list, const Box<3>& box) const {
  const auto corners_of = [this](Entry entry) -> const std::array<uint32_t, 3>& {
    return complex_->triangles[TriangleOf(entry)];
  };
  const std::array<uint32_t, 3>& corners = corners_of(list[0]);
  return std::any_of(corners.begin(), corners.end(), [&](uint32_t corner) {
    return box.Contains(complex_->points[corner]) && std::all_of(list.begin(), list.end(), [&](Entry entry) {
             const std::array<uint32_t, 3>& own = corners_of(entry);
             return own[0] == corner || own[1] == corner || own[2] == corner;
           });
  });
}

// Gives a node children, whose lists are put at the end of `lists`.
absl::Status SurfaceIndex::Split(const Cube& cube, std::span<const Entry> list, std::vector<Entry>& lists,
                                 const RunContext& context) {
  const auto first = static_cast<IndexNode>(nodes_.size());
  nodes_[cube.node] = {.first = first, .count = kInner};
  nodes_.resize(nodes_.size() + 8);
  parents_.push_back({cube.low, cube.level});
  size_t tests = 0;
  for (uint32_t k = 0; k < 8; ++k) {
    const Box<3> box = BoxOf(ChildOf(cube, k));
    Node& child = nodes_[first + k];
    child.first = static_cast<uint32_t>(lists.size());
    for (const Entry entry : list) {
      if (++tests % kTestsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const Triangle triangle = TriangleAt(TriangleOf(entry));
      const Box<3> own = BoxOfTriangle(triangle);
      if (!AreApart(own, box) && (own.LongestSide() < kLarge * sides_[cube.level] || !SurelyMisses(triangle, box))) {
        lists.push_back(entry);
      }
    }
    child.count = static_cast<uint32_t>(lists.size()) - child.first;
  }
  return absl::OkStatus();
}

template <typename Misses, typename Visit>
void SurfaceIndex::ForEachLeaf(const Cube& from, const Misses& misses, const Visit& visit) const {
  if (misses(BoxOf(from))) {
    return;
  }
  if (IsLeaf(from.node)) {
    visit(from);
    return;
  }
  for (uint32_t k = 0; k < 8; ++k) {
    ForEachLeaf(ChildOf(from, k), misses, visit);
  }
}

uint32_t SurfaceIndex::SolidAt(const Point<3>& p, IndexNode from) const {
  if (!hull_.Contains(p)) {
    return 0;
  }
  const Cube leaf = LeafHolding(p, from);
  const Node& node = nodes_[leaf.node];
  if (node.count == 0) {
    return node.solid;
  }
  // They lie anywhere in memory: all are asked for before the first is looked at.
  for (const Entry entry : EntriesOf(leaf.node)) {
    PrefetchLine(&complex_->triangles[TriangleOf(entry)]);
  }
  for (const Entry entry : EntriesOf(leaf.node)) {
    for (uint32_t k = 0; k < 3; ++k) {
      PrefetchLine(&complex_->Corner(TriangleOf(entry), k));
    }
  }
  const Point<3> middle = MiddleOf(leaf);
  std::optional<Triangle> first;
  uint32_t solid = node.solid;
  for (const Entry entry : EntriesOf(leaf.node)) {
    const Sign of_middle = (entry & 1) != 0 ? Sign::kNegative : Sign::kPositive;
    const Triangle triangle = TriangleAt(TriangleOf(entry));
    const Sign side = MovedSide(triangle, p);
    if (Crosses(triangle, p, side, middle, of_middle) &&
        (!first.has_value() || IsCrossedBefore(triangle, *first, p, middle))) {
      first = triangle;
      solid = solids_->solid_of[HalfFacetOf(TriangleOf(entry), side == Sign::kNegative)];
    }
  }
  return solid;
}

void SurfaceIndex::FindCrossings(const Point<3>& a, const Point<3>& b, std::vector<SurfaceCrossing>& crossings,
                                 IndexNode from) const {
  FindCrossings(a, b, CubeOf(from), /*first_alone=*/false, crossings);
}

// `first_alone`: none but the first is wanted.
void SurfaceIndex::FindCrossings(const Point<3>& a, const Point<3>& b, const Cube& from, bool first_alone,
                                 std::vector<SurfaceCrossing>& crossings) const {
  crossings.clear();
  ForEachLeaf(
      from, [&](const Box<3>& box) { return SurelyMisses(a, b, box); },
      [&](const Cube& leaf) {
        for (const Entry entry : EntriesOf(leaf.node)) {
          crossings.push_back({TriangleOf(entry), 0});
        }
      });
  const auto by_triangle = [](const SurfaceCrossing& s, const SurfaceCrossing& t) { return s.triangle < t.triangle; };
  std::sort(crossings.begin(), crossings.end(), by_triangle);
  crossings.erase(std::unique(crossings.begin(), crossings.end()), crossings.end());
  std::erase_if(crossings, [&](SurfaceCrossing& crossing) {
    const Triangle triangle = TriangleAt(crossing.triangle);
    const Sign side = MovedSide(triangle, a);
    crossing.before = HalfFacetOf(crossing.triangle, side == Sign::kNegative);
    return !Crosses(triangle, a, side, b, MovedSide(triangle, b));
  });
  const auto is_before = [&](const SurfaceCrossing& s, const SurfaceCrossing& t) {
    return s.triangle != t.triangle && IsCrossedBefore(TriangleAt(s.triangle), TriangleAt(t.triangle), a, b);
  };
  if (first_alone && !crossings.empty()) {
    crossings = {*std::min_element(crossings.begin(), crossings.end(), is_before)};
  } else {
    std::sort(crossings.begin(), crossings.end(), is_before);
  }
}

void SurfaceIndex::FindNear(const Box<3>& box, std::vector<uint32_t>& triangles, IndexNode from) const {
  triangles.clear();
  ForEachLeaf(
      CubeOf(from), [&](const Box<3>& cube) { return AreApart(cube, box); },
      [&](const Cube& leaf) {
        for (const Entry entry : EntriesOf(leaf.node)) {
          if (!SurelyMisses(TriangleAt(TriangleOf(entry)), box)) {
            triangles.push_back(TriangleOf(entry));
          }
        }
      });
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
}

std::optional<SurfacePoint> SurfaceIndex::Nearest(const Point<3>& p, double within_sq) const {
  std::optional<SurfacePoint> nearest;
  FindNearest(Root(), p, within_sq, nearest);
  return nearest;
}

// `reach_sq`: only what is nearer counts, or as near if its triangle is lower.
void SurfaceIndex::FindNearest(const Cube& from, const Point<3>& p, double& reach_sq,
                               std::optional<SurfacePoint>& nearest) const {
  if (IsLeaf(from.node)) {
    for (const Entry entry : EntriesOf(from.node)) {
      const uint32_t t = TriangleOf(entry);
      const Point<3> at = NearestPoint(TriangleAt(t), p);
      const double distance_sq = DistanceSq<3>(at, p);
      if (distance_sq < reach_sq || (distance_sq == reach_sq && nearest.has_value() && t < nearest->triangle)) {
        reach_sq = distance_sq;
        nearest = {.at = at, .triangle = t, .distance_sq = distance_sq};
      }
    }
    return;
  }
  std::array<std::pair<double, uint32_t>, 8> children;
  for (uint32_t k = 0; k < 8; ++k) {
    children[k] = {DistanceSq<3>(p, BoxOf(ChildOf(from, k))), k};
  }
  std::sort(children.begin(), children.end());
  for (const auto& [distance_sq, k] : children) {
    // Points of the surface are rounded, and may have become nearer than the cube that they are in.
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) {
      size = std::max({size, std::abs(box_.low[axis]), std::abs(box_.high[axis]), std::abs(p[axis])});
    }
    const double reach = std::sqrt(reach_sq) + 0x1p-46 * size;
    if (distance_sq > reach * reach) {
      return;
    }
    FindNearest(ChildOf(from, k), p, reach_sq, nearest);
  }
}

}  // namespace wellspace::core
