#include "core/tree/surface_index.h"

#include <algorithm>
#include <bit>
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

// A triangle is listed about so often at the leaves that a box near it meets.
constexpr size_t kListedEach = 4;

// The octants that a closed box meets of a cube from `low` on, a bit each; `side` is that of an octant.
uint32_t OctantsMet(const Box<3>& box, const Point<3>& low, double side) {
  constexpr std::array<uint32_t, 3> kLowOnes = {0b0101'0101, 0b0011'0011, 0b0000'1111};  // low along each axis
  uint32_t met = 0xff;
  for (int axis = 0; axis < 3; ++axis) {
    const double middle = low[axis] + side;
    met &= box.low[axis] > middle || box.high[axis] < low[axis] ? ~kLowOnes[axis] : ~0u;
    met &= box.low[axis] > middle + side || box.high[axis] < middle ? kLowOnes[axis] : ~0u;
  }
  return met;
}

// Nodes and entries are numbered by 32 bits, of which the last is kept for kInner.
constexpr uint64_t kMostNumbered = uint64_t{0xffff'fff0};

}  // namespace

// Walks along the Z curve: the segment from each mark to the one before lies in the cube that holds both.
class SurfaceIndex::MarkWalk {
 public:
  // It starts from beyond the triangles.
  MarkWalk(SurfaceIndex& index, const RunContext& context)
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
    const Point<3> mark = index_.MarkOf(leaf);
    index_.FindCrossings(mark, known_, within_, /*first_alone=*/true, crossings_);
    solid_ = crossings_.empty() ? solid_ : index_.solids_->solid_of[crossings_[0].before];
    known_ = mark;
    Node& node = index_.nodes_[leaf.node];
    node.solid = solid_;
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      const uint32_t t = TriangleOf(index_.listed_[i]);
      index_.listed_[i] = EntryOf(t, MovedSide(index_.TriangleAt(t), mark));
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
  solids_ = &solids;
  WELLSPACE_RETURN_IF_ERROR(BuildNodes(complex, grid, context));
  return MarkWalk(*this, context).Visit(Root());
}

absl::Status SurfaceIndex::BuildForDistances(const SurfaceComplex& complex, const MortonGrid<3>& grid,
                                             const RunContext& context) {
  solids_ = nullptr;
  return BuildNodes(complex, grid, context);
}

// Builds the nodes. The side of a triangle that the mark of its leaf is on is not known yet.
absl::Status SurfaceIndex::BuildNodes(const SurfaceComplex& complex, const MortonGrid<3>& grid,
                                      const RunContext& context) {
  complex_ = &complex;
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
  return absl::OkStatus();
}

uint64_t SurfaceIndex::Bytes(uint64_t triangles) {
  const uint64_t nodes = kNodesAnyway + kNodesPerTriangle * triangles;
  const uint64_t entries = kEntriesAnyway + kEntriesPerTriangle * triangles;
  // Arrays grow by doubling: lists of two levels and of leaves, which have no more entries together, and a byte for
  // each of a node; nodes, and those of a level that may be split.
  return entries * (4 * sizeof(Entry) + 1) + 2 * (nodes * sizeof(Node) + nodes / 8 * sizeof(Parent)) +
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

// The point of a leaf whose solid it knows. It is not the middle, for planes and sides of triangles are where middles
// are, as those of a cube in the middle of the grid, and exact signs would take long numbers each time.
Point<3> SurfaceIndex::MarkOf(const Cube& leaf) const {
  constexpr Point<3> kShares = {0.4830127018922193, 0.5171572875253810, 0.4944271909999159};
  Point<3> mark = leaf.low;
  for (int axis = 0; axis < 3; ++axis) {
    mark[axis] += kShares[axis] * sides_[leaf.level];
  }
  return mark;
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

IndexNode SurfaceIndex::Holding(const Box<3>& box) const {
  Cube cube = Root();
  while (!IsLeaf(cube.node)) {
    ++cube.level;
    uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double middle = cube.low[axis] + sides_[cube.level];
      if (box.low[axis] >= middle) {
        child |= 1u << axis;
        cube.low[axis] = middle;
      } else if (box.high[axis] > middle) {
        return cube.node;
      }
    }
    cube.node = Child(cube.node, child);
  }
  return cube.node;
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
  std::vector<uint8_t> met;  // by triangle, a bit for each child
  met.reserve(list.size());
  for (size_t i = 0; i < list.size(); ++i) {
    if (i % (kTestsBetweenChecks / 8) == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    met.push_back(ChildrenMetBy(TriangleAt(TriangleOf(list[i])), cube));
  }
  for (uint32_t k = 0; k < 8; ++k) {
    Node& child = nodes_[first + k];
    child.first = static_cast<uint32_t>(lists.size());
    for (size_t i = 0; i < list.size(); ++i) {
      if ((met[i] >> k & 1) != 0) {
        lists.push_back(list[i]);
      }
    }
    child.count = static_cast<uint32_t>(lists.size()) - child.first;
  }
  return absl::OkStatus();
}

// The children of a cube that a triangle may meet, a bit each.
uint8_t SurfaceIndex::ChildrenMetBy(const Triangle& triangle, const Cube& cube) const {
  const Box<3> own = BoxOfTriangle(triangle);
  uint32_t met = OctantsMet(own, cube.low, sides_[cube.level + 1]);
  // Distances need no short lists: a box is looked at before its triangle.
  const bool is_large = solids_ != nullptr && own.LongestSide() >= kLarge * sides_[cube.level];
  for (uint32_t k = 0; k < 8 && is_large; ++k) {
    if ((met >> k & 1) != 0 && SurelyMisses(triangle, BoxOf(ChildOf(cube, k)))) {
      met &= ~(1u << k);
    }
  }
  return static_cast<uint8_t>(met);
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
  const Point<3> mark = MarkOf(leaf);
  Box<3> own{p, p};
  own.Include({mark, mark});
  std::optional<Triangle> first;
  uint32_t solid = node.solid;
  for (const Entry entry : EntriesOf(leaf.node)) {
    const Sign of_mark = (entry & 1) != 0 ? Sign::kNegative : Sign::kPositive;
    const Triangle triangle = TriangleAt(TriangleOf(entry));
    if (AreApart(BoxOfTriangle(triangle), own)) {
      continue;
    }
    const Sign side = MovedSide(triangle, p);
    if (Crosses(triangle, p, side, mark, of_mark) &&
        (!first.has_value() || IsCrossedBefore(triangle, *first, p, mark))) {
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
  KeepCrossed(a, b, first_alone, crossings);
}

void SurfaceIndex::FindCrossingsAmong(const Point<3>& a, const Point<3>& b, std::span<const uint32_t> triangles,
                                      std::vector<SurfaceCrossing>& crossings) const {
  crossings.clear();
  for (const uint32_t t : triangles) {
    crossings.push_back({t, 0});
  }
  KeepCrossed(a, b, /*first_alone=*/false, crossings);
}

// Keeps of these triangles, ascending, those that are crossed, in the order in which they are.
void SurfaceIndex::KeepCrossed(const Point<3>& a, const Point<3>& b, bool first_alone,
                               std::vector<SurfaceCrossing>& crossings) const {
  Box<3> own{a, a};
  own.Include({b, b});
  std::erase_if(crossings, [&](SurfaceCrossing& crossing) {
    const Triangle triangle = TriangleAt(crossing.triangle);
    if (AreApart(BoxOfTriangle(triangle), own)) {
      return true;
    }
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
  FindFewNear(box, std::numeric_limits<size_t>::max() / kListedEach, triangles, from);
}

bool SurfaceIndex::FindFewNear(const Box<3>& box, size_t most, std::vector<uint32_t>& triangles, IndexNode from) const {
  triangles.clear();
  const size_t most_listed = kListedEach * most;
  const auto list = [&](const Cube& cube, const auto& list_children) {
    if (IsLeaf(cube.node)) {
      for (const Entry entry : EntriesOf(cube.node)) {
        triangles.push_back(TriangleOf(entry));
      }
      return;
    }
    for (uint32_t met = OctantsMet(box, cube.low, sides_[cube.level + 1]); met != 0; met &= met - 1) {
      if (triangles.size() <= most_listed) {
        list_children(ChildOf(cube, std::countr_zero(met)), list_children);
      }
    }
  };
  if (const Cube cube = CubeOf(from); !AreApart(BoxOf(cube), box)) {
    list(cube, list);
  }
  if (triangles.size() > most_listed) {
    return false;
  }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  std::erase_if(triangles, [&](uint32_t t) { return SurelyMisses(TriangleAt(t), box); });
  return triangles.size() <= most;
}

std::optional<SurfacePoint> SurfaceIndex::Nearest(const Point<3>& p, double within_sq) const {
  return FindNearest([](uint32_t /*triangle*/) { return true; }, p, within_sq);
}

std::optional<SurfacePoint> SurfaceIndex::NearestOf(absl::FunctionRef<bool(uint32_t)> counts, const Point<3>& p,
                                                    double within_sq) const {
  return FindNearest(counts, p, within_sq);
}

// What is nearest in the leaf of p, which is found at once, says how far to look.
template <typename Counts>
std::optional<SurfacePoint> SurfaceIndex::FindNearest(const Counts& counts, const Point<3>& p, double within_sq) const {
  std::optional<SurfacePoint> nearest;
  double reach_sq = within_sq;
  FindNearestIn(LeafHolding(p, 0).node, counts, p, reach_sq, nearest);
  const double rounding = RoundingAt(p);
  FindNearestBelow(HoldingAll(p, std::sqrt(reach_sq) + rounding), counts, p, rounding, reach_sq, nearest);
  return nearest;
}

// The smallest node that holds all of the grid that is no farther from `p` than that.
SurfaceIndex::Cube SurfaceIndex::HoldingAll(const Point<3>& p, double reach) const {
  return CubeOf(Holding(CubeAround<3>(p, reach)));
}

// Points of the surface are rounded, and may have become nearer than the cube that they are in, by no more than this.
double SurfaceIndex::RoundingAt(const Point<3>& p) const {
  double size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    size = std::max({size, std::abs(box_.low[axis]), std::abs(box_.high[axis]), std::abs(p[axis])});
  }
  return 0x1p-46 * size;
}

bool SurfaceIndex::IsWithin(const Point<3>& p, double within_sq, uint32_t& near) const {
  if (DistanceSq<3>(NearestPoint(InOrderAt(near), p), p) <= within_sq) {
    return true;
  }
  const double reach = std::sqrt(within_sq) + RoundingAt(p);
  const Cube own = LeafHolding(p, 0);
  if (IsWithinIn(own.node, p, within_sq, reach * reach, near)) {
    return true;
  }
  const Cube from = HoldingAll(p, reach);
  return from.node != own.node && IsWithin(from, p, within_sq, reach * reach, near);
}

bool SurfaceIndex::IsWithinIn(IndexNode leaf, const Point<3>& p, double within_sq, double reach_sq,
                              uint32_t& near) const {
  const std::span<const Entry> entries = EntriesOf(leaf);
  return std::any_of(entries.begin(), entries.end(), [&](Entry entry) {
    const uint32_t t = TriangleOf(entry);
    const Triangle triangle = InOrderAt(t);
    const bool is_within = DistanceSq<3>(p, BoxOfTriangle(triangle)) <= reach_sq &&
                           DistanceSq<3>(NearestPoint(triangle, p), p) <= within_sq;
    near = is_within ? t : near;
    return is_within;
  });
}

bool SurfaceIndex::IsWithin(const Cube& from, const Point<3>& p, double within_sq, double reach_sq,
                            uint32_t& near) const {
  if (IsLeaf(from.node)) {
    return IsWithinIn(from.node, p, within_sq, reach_sq, near);
  }
  const std::array<double, 8> distances_sq = DistancesSqOfChildren(from, p);
  for (uint32_t k = 0; k < 8; ++k) {
    if (distances_sq[k] <= reach_sq && IsWithin(ChildOf(from, k), p, within_sq, reach_sq, near)) {
      return true;
    }
  }
  return false;
}

// The squared distances of `p` from the children of a cube.
std::array<double, 8> SurfaceIndex::DistancesSqOfChildren(const Cube& cube, const Point<3>& p) const {
  const double side = sides_[cube.level + 1];
  std::array<std::array<double, 2>, 3> along;  // by axis: from the low half and from the high one
  for (int axis = 0; axis < 3; ++axis) {
    const double middle = cube.low[axis] + side;
    along[axis] = {PositivePartSq(std::max(cube.low[axis] - p[axis], p[axis] - middle)),
                   PositivePartSq(std::max(middle - p[axis], p[axis] - (middle + side)))};
  }
  std::array<double, 8> distances_sq;
  for (uint32_t k = 0; k < 8; ++k) {
    distances_sq[k] = along[0][k & 1] + along[1][k >> 1 & 1] + along[2][k >> 2];
  }
  return distances_sq;
}

// `reach_sq`: only what is nearer counts, or as near if its triangle is lower.
template <typename Counts>
void SurfaceIndex::FindNearestIn(IndexNode leaf, const Counts& counts, const Point<3>& p, double& reach_sq,
                                 std::optional<SurfacePoint>& nearest) const {
  for (const Entry entry : EntriesOf(leaf)) {
    const uint32_t t = TriangleOf(entry);
    if (!counts(t)) {
      continue;
    }
    const Point<3> at = NearestPoint(InOrderAt(t), p);
    const double distance_sq = DistanceSq<3>(at, p);
    if (distance_sq < reach_sq || (distance_sq == reach_sq && nearest.has_value() && t < nearest->triangle)) {
      reach_sq = distance_sq;
      nearest = {.at = at, .triangle = t, .distance_sq = distance_sq};
    }
  }
}

// Cubes are looked into that are farther away by `rounding` than what counts.
template <typename Counts>
void SurfaceIndex::FindNearestBelow(const Cube& from, const Counts& counts, const Point<3>& p, double rounding,
                                    double& reach_sq, std::optional<SurfacePoint>& nearest) const {
  if (IsLeaf(from.node)) {
    FindNearestIn(from.node, counts, p, reach_sq, nearest);
    return;
  }
  const std::array<double, 8> distances_sq = DistancesSqOfChildren(from, p);
  std::array<std::pair<double, uint32_t>, 8> children;
  for (uint32_t k = 0; k < 8; ++k) {
    children[k] = {distances_sq[k], k};
  }
  std::sort(children.begin(), children.end());
  for (const auto& [distance_sq, k] : children) {
    const double reach = std::sqrt(reach_sq) + rounding;
    if (distance_sq > reach * reach) {
      return;
    }
    FindNearestBelow(ChildOf(from, k), counts, p, rounding, reach_sq, nearest);
  }
}

}  // namespace wellspace::core
