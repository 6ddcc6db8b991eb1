#include "core/cell/polygon.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/simd/lane_bits.h"
#include "core/cell/cell_on_unit.h"
#include "core/cell/float_bisector.h"
#include "core/cell/float_errors.h"
#include "core/cell/float_nodes.h"
#include "core/cell/meeting_point.h"

namespace wellspace::core {

// Takes note of the largest squared distance of a node, in floats.
WELLSPACE_INLINE void Polygon::SetReach(float radius_sq) {
  radius_bound_ = std::min(radius_bound_, std::sqrt(radius_sq) * (1 + kDistanceError<2>));  // the cell only shrinks
}

void Polygon::Reset(const Point<2>& site, const Box<2>& bounds, const std::array<PlaneKind, 4>& kinds, TieRule rule) {
  BeginWalls(site, bounds, kinds, rule);
  // From the lower left corner on; the edge from there runs along the lower face of axis 1.
  static constexpr std::array<std::array<uint32_t, 2>, 4> kCorners = {{{0, 2}, {1, 2}, {1, 3}, {0, 3}}};
  static constexpr std::array<int32_t, 4> kEdges = {2, 1, 3, 0};
  Group& group = groups_.front();
  group = {};
  count_ = 4;
  for (size_t i = 0; i < 4; ++i) {
    group.x[0][i] = static_cast<float>(planes_[kCorners[i][0]].offset * scale_);
    group.x[1][i] = static_cast<float>(planes_[kCorners[i][1]].offset * scale_);
    group.plane[i] = kEdges[i];
  }
  SetReach(Largest<VectorUnit::kBaseline>(RadiiSq<2>(group)));
}

Point<2> Polygon::PositionOf(size_t node) const {
  const Group& group = groups_[node / kGroupSize];
  return {group.x[0][node % kGroupSize], group.x[1][node % kGroupSize]};
}

// Decides the nodes `first` + i for the bits i of `doubtful`, by their own errors if those tell, else exactly. Returns
// the bits of nodes that are cut off.
[[gnu::noinline]] uint32_t Polygon::DecideDoubtful(size_t first, uint32_t doubtful, const Point<2>& generator) {
  const Point<2> w = ScaledTo(generator);
  const double length_sq = NormSq<2>(w);
  uint32_t removed = 0;
  for (; doubtful != 0; doubtful &= doubtful - 1) {
    const size_t node = first + static_cast<size_t>(std::countr_zero(doubtful));
    const Point<2> x = PositionOf(node);
    const double excess = Dot<2>(x, w) - 0.5 * length_sq;
    bool is_cut_off = excess > 0;
    if (!(excess * excess > NodeDoubtSq<2>(x, length_sq))) {
      is_cut_off = IsCutOff<uint32_t>({PlaneFrom(Before(node)), PlaneFrom(node)}, generator);
    }
    removed |= is_cut_off ? doubtful & -doubtful : 0;
  }
  return removed;
}

// Computes where `plane` meets the two edges that the kept run ends at, in the order of the nodes, and the edges from
// there.
//
// As Meet does, by Cramer's rule in doubles: wrong by at most 64 * 2^-53 P (d + d' + |x|) / |det| with P = |n| |n'|,
// and the distances d and d' of the two planes are |x| at most. So |det| > 2^-19 P has x wrong by less than half a unit
// of floats, 2^-26 |x|.
WELLSPACE_INLINE void Polygon::PlaceEnds(const KeptRun& run, uint32_t plane, std::array<Node, 2>& ends) const {
  using Pair = Wide<2>::Lanes;
  size_t last = run.first + run.count - 1;
  last = last < count_ ? last : last - count_;
  const size_t before = Before(run.first);
  const std::array<uint32_t, 2> along = {PlaneFrom(last), PlaneFrom(before)};
  const Plane<2>& cut = planes_[plane];
  const Plane<2>& a = planes_[along[0]];
  const Plane<2>& b = planes_[along[1]];
  const Pair normal_x = {a.normal[0], b.normal[0]};
  const Pair normal_y = {a.normal[1], b.normal[1]};
  const Pair offset = {a.offset, b.offset};
  const Pair product = Pair{a.length, b.length} * cut.length;
  const Pair determinant = normal_x * cut.normal[1] - normal_y * cut.normal[0];
  const Pair inverse = scale_ / determinant;
  Pair x = (offset * cut.normal[1] - cut.offset * normal_y) * inverse;
  Pair y = (cut.offset * normal_x - offset * cut.normal[0]) * inverse;
  const Pair size = determinant < 0 ? -determinant : determinant;
  const auto is_good = size > 0x1p-19 * product;
  if (Bits<2>(is_good) != 3) [[unlikely]] {
    for (size_t k = 0; k < 2; ++k) {
      if (is_good[k] == 0) {
        const Point<2> exact = ExactMeetingPoint<2>(site_, {planes_[along[k]].source, cut.source});
        x[k] = exact[0] * scale_;
        y[k] = exact[1] * scale_;
      }
    }
  }
  ends[0].x = static_cast<float>(x[0]);
  ends[0].y = static_cast<float>(y[0]);
  ends[0].plane = static_cast<int32_t>(plane);
  ends[1].x = static_cast<float>(x[1]);
  ends[1].y = static_cast<float>(y[1]);
  ends[1].plane = static_cast<int32_t>(along[1]);
  ends[1].edge_sq = groups_[before / kGroupSize].edge_sq[before % kGroupSize];
}

// Makes the kept run and the two ends the nodes, where one vector holds them before and after. A lane takes its node
// from the lane `run.first` further on, around; the two lanes after the run take the ends.
template <VectorUnit kUnit>
WELLSPACE_INLINE void Polygon::Replace(const KeptRun& run, const std::array<Node, 2>& ends) {
  Group& group = groups_.front();
  const auto old_count = static_cast<int32_t>(count_);
  const auto kept = static_cast<int32_t>(run.count);
  FloatMask from = kEachLane + static_cast<int32_t>(run.first);
  from = from - (~IsLess<kUnit>(from, Splat(old_count)) & old_count);
  const FloatMask is_kept = IsLess<kUnit>(kEachLane, Splat(kept));
  const FloatMask is_second = ~IsLess<kUnit>(kEachLane, Splat(kept + 1));
  const FloatMask is_used = IsLess<kUnit>(kEachLane, Splat(kept + 2));
  const auto replaced = [&](auto* column, auto first, auto second) __attribute__((always_inline)) {
    return Choose<kUnit>(is_kept, WELLSPACE_SHUFFLE(VectorAt(column), from),
                         Choose<kUnit>(is_second, Splat(second), Splat(first)));
  };
  const auto used = [&](const Floats& items) __attribute__((always_inline)) {
    return reinterpret_cast<Floats>(reinterpret_cast<FloatMask>(items) & is_used);
  };
  VectorAt(group.x[0]) = used(replaced(group.x[0], ends[0].x, ends[1].x));
  VectorAt(group.x[1]) = used(replaced(group.x[1], ends[0].y, ends[1].y));
  VectorAt(group.edge_sq) = replaced(group.edge_sq, ends[0].edge_sq, ends[1].edge_sq);
  VectorAt(group.plane) = replaced(group.plane, ends[0].plane, ends[1].plane);
  count_ = run.count + 2;
  SetReach(Largest<kUnit>(RadiiSq<2>(group)));
}

// Replace for any number of nodes, one by one.
[[gnu::noinline]] void Polygon::ReplaceAmongMany(const KeptRun& run, const std::array<Node, 2>& ends) {
  reordered_.clear();
  for (size_t j = 0; j < run.count; ++j) {
    const size_t i = (run.first + j) % count_;
    const Group& group = groups_[i / kGroupSize];
    const size_t lane = i % kGroupSize;
    reordered_.push_back({group.x[0][lane], group.x[1][lane], group.edge_sq[lane], group.plane[lane]});
  }
  reordered_.insert(reordered_.end(), ends.begin(), ends.end());
  count_ = reordered_.size();
  const size_t groups = GroupsFor(count_);
  if (groups_.size() < groups) {
    groups_.resize(2 * groups);
  }
  reordered_.resize(groups * kGroupSize);
  float radius_sq = 0;
  for (size_t i = 0; i < reordered_.size(); ++i) {
    const Node& node = reordered_[i];
    Group& group = groups_[i / kGroupSize];
    const size_t lane = i % kGroupSize;
    group.x[0][lane] = node.x;
    group.x[1][lane] = node.y;
    group.edge_sq[lane] = node.edge_sq;
    group.plane[lane] = node.plane;
    radius_sq = std::max(radius_sq, node.x * node.x + node.y * node.y);
  }
  SetReach(radius_sq);
}

// Upper bounds on the excesses of the nodes, kGroupSize or fewer, over the bisector.
WELLSPACE_INLINE Floats Polygon::BoundExcesses(const FloatBisector<2>& bisector) const {
  const Group& group = groups_.front();
  return Load(group.x[0]) * bisector.w[0] + (Load(group.x[1]) * bisector.w[1] - bisector.least_offset);
}

// Finds the nodes that the bisector leaves, of kGroupSize or fewer. The nodes of the bits `maybe` may be beyond it.
// False if none is.
template <VectorUnit kUnit>
WELLSPACE_INLINE bool Polygon::FindKept(const FloatBisector<2>& bisector, const Floats& excess_bounds, uint32_t maybe,
                                        const Point<2>& position, KeptRun& run) {
  const auto count = static_cast<uint32_t>(count_);
  uint32_t removed =
      Bits<kUnit>(IsLess<kUnit>(Splat(2 * (bisector.offset - bisector.least_offset)), excess_bounds)) & maybe;
  if (removed != maybe) [[unlikely]] {
    removed |= DecideDoubtful(0, maybe & ~removed, position);
    if (removed == 0) {
      return false;
    }
  }
  const uint32_t is_before = removed << 1 | removed >> (count - 1);  // by node, whether the one before it goes
  const uint32_t first = is_before & ~removed & ((1u << count) - 1);
  // A line cuts one run of nodes off a convex polygon, and decisions are exact: so one node that stays comes
  // after one that goes, unless all go, which the site's side of the bisector forbids.
  AbortUnlessCellHolds(std::has_single_bit(first));
  run.first = static_cast<uint32_t>(std::countr_zero(first));
  run.count = count - static_cast<uint32_t>(std::popcount(removed));
  return true;
}

// FindKept for any number of nodes, one by one.
[[gnu::noinline]] bool Polygon::FindKeptOfMany(const FloatBisector<2>& bisector, const Point<2>& position,
                                               KeptRun& run) {
  is_removed_.assign(count_, 0);
  size_t removed_count = 0;
  for (size_t i = 0; i < count_; ++i) {
    const Group& group = groups_[i / kGroupSize];
    const size_t lane = i % kGroupSize;
    const float excess_bound =
        group.x[0][lane] * bisector.w[0] + (group.x[1][lane] * bisector.w[1] - bisector.least_offset);
    if (excess_bound >= 0 &&
        (excess_bound > 2 * (bisector.offset - bisector.least_offset) || DecideDoubtful(i, 1, position) != 0)) {
      is_removed_[i] = 1;
      ++removed_count;
    }
  }
  if (removed_count == 0) {
    return false;
  }
  size_t runs = 0;
  for (size_t i = 0; i < count_; ++i) {
    if (is_removed_[i] == 0 && is_removed_[Before(i)] != 0) {
      run.first = static_cast<uint32_t>(i);
      ++runs;
    }
  }
  AbortUnlessCellHolds(runs == 1);  // as in FindKept
  run.count = static_cast<uint32_t>(count_ - removed_count);
  return true;
}

// Cuts by the bisector of the site and `position`.
template <VectorUnit kUnit>
WELLSPACE_INLINE bool Polygon::CutOff(const FloatBisector<2>& bisector, VertexId u, const Point<2>& position) {
  KeptRun run;
  if (count_ <= kGroupSize) {
    const Floats excess_bounds = BoundExcesses(bisector);
    const uint32_t maybe = ~Bits<kUnit>(reinterpret_cast<const FloatMask&>(excess_bounds)) & ((1u << count_) - 1);
    if (maybe == 0 || !FindKept<kUnit>(bisector, excess_bounds, maybe, position, run)) {
      return false;
    }
  } else if (!FindKeptOfMany(bisector, position, run)) {
    return false;
  }
  const size_t index = AddBisector(u, position);
  std::array<Node, 2> ends;
  PlaceEnds(run, static_cast<uint32_t>(index), ends);
  ends[0].edge_sq = 2 * bisector.offset;
  if (count_ <= kGroupSize && run.count + 2 <= kGroupSize) {
    Replace<kUnit>(run, ends);
  } else {
    ReplaceAmongMany(run, ends);
  }
  return true;
}

size_t Polygon::CutByGathered(const GatheredVertices<2>& gathered, VertexId site) {
  return CellOnUnit<Polygon, 2>::CutByGathered(*this, gathered, site);
}

bool Polygon::CutBeforePlace(VertexId u, const Point<2>& position) {
  return CellOnUnit<Polygon, 2>::CutBeforePlace(*this, u, position);
}

size_t Polygon::CutByEach(std::span<const Point<2>> positions, const VertexNames& names, VertexId site) {
  return CellOnUnit<Polygon, 2>::CutByEach(*this, positions, names, site);
}

// Places all by their planes, in the order of PlaneOrderKey.
void Polygon::Place() {
  if (is_placed_) {
    return;
  }
  is_placed_ = true;
  nodes_.resize(count_);
  double reach = 0;
  for (size_t i = 0; i < count_; ++i) {
    CellNode<2>& node = nodes_[i];
    const size_t before = Before(i);
    const size_t after = i + 1 < count_ ? i + 1 : 0;
    const std::array<uint16_t, 2> planes = {static_cast<uint16_t>(PlaneFrom(before)),
                                            static_cast<uint16_t>(PlaneFrom(i))};
    const bool swaps = PlaneOrderKey<2>(planes_, planes[1]) < PlaneOrderKey<2>(planes_, planes[0]);
    node.planes = {planes[swaps ? 1 : 0], planes[swaps ? 0 : 1]};
    // The edge that leaves the plane of the edge before runs along the one after, and the other way round.
    node.neighbours = {static_cast<uint16_t>(swaps ? before : after), static_cast<uint16_t>(swaps ? after : before)};
    PlaceNode<2>(site_, planes_, node);
    reach = std::max(reach, node.reach);
  }
  placed_reach_ = reach;
}

bool Polygon::PlaceUnlessKeeps(double ratio) {
  if (KeepsRatio(ratio)) {
    return true;
  }
  Place();
  return false;
}

template <VectorUnit kUnit>
WELLSPACE_INLINE bool Polygon::KeepsRatioWith(double ratio) const {
  const float ratio_sq = SurelyKeptRatioSq(ratio);
  if (count_ <= kGroupSize) {
    const Group& group = groups_.front();
    const FloatMask before = Choose<kUnit>(kEachLane == 0, Splat(static_cast<int32_t>(count_ - 1)), kEachLane - 1);
    const Floats from = Load(group.edge_sq);
    const Floats to = WELLSPACE_SHUFFLE(from, before);
    const Floats nearest_sq = Min<kUnit>(from, to);
    const Floats radius_sq = RadiiSq<2>(group);
    const uint32_t all = (1u << count_) - 1;
    return (Bits<kUnit>(IsAtMost<kUnit>(radius_sq + kUnderflow, ratio_sq * nearest_sq)) & all) == all;
  }
  for (size_t i = 0; i < count_; ++i) {
    const size_t before = Before(i);
    const Group& group = groups_[i / kGroupSize];
    const size_t lane = i % kGroupSize;
    const float nearest_sq = std::min(group.edge_sq[lane], groups_[before / kGroupSize].edge_sq[before % kGroupSize]);
    const float radius_sq = group.x[0][lane] * group.x[0][lane] + group.x[1][lane] * group.x[1][lane];
    if (!(radius_sq + kUnderflow <= ratio_sq * nearest_sq)) {
      return false;
    }
  }
  return true;
}

bool Polygon::KeepsRatio(double ratio) const {
  return unit_ == VectorUnit::kAvx2 ? KeepsRatioAvx2(ratio) : KeepsRatioWith<VectorUnit::kBaseline>(ratio);
}

WELLSPACE_AVX2 bool Polygon::KeepsRatioAvx2(double ratio) const { return KeepsRatioWith<VectorUnit::kAvx2>(ratio); }

bool Polygon::Reaches(const Box<2>& cube) const { return CellOnUnit<Polygon, 2>::Reaches(*this, cube); }

bool Polygon::IsSurelyBefore(const Point<2>& foot) const {
  const auto line = FloatBisector<2>::Of({2 * foot[0], 2 * foot[1]}, scale_, radius_bound_);
  if (!(line.least_offset > 0)) {
    return false;
  }
  FloatMask are_before = ~FloatMask{};  // by the sign; of places beyond the last node, too
  for (const Group& group : groups()) {
    const Floats most = Load(group.x[0]) * line.w[0] + (Load(group.x[1]) * line.w[1] - line.least_offset);
    are_before &= reinterpret_cast<const FloatMask&>(most);
  }
  constexpr uint32_t kAll = (uint32_t{1} << kGroupSize) - 1;
  return Bits<VectorUnit::kBaseline>(are_before) == kAll;
}

void Polygon::FindStar(Star<2>& out) const {
  out.resize(count_);
  size_t count = 0;
  const Plane<2>* before = &planes_[PlaneFrom(Before(0))];
  for (size_t i = 0; i < count_; ++i) {
    // No branch, since it could not be predicted where there are walls.
    const Plane<2>* const after = &planes_[PlaneFrom(i)];
    out[count] = {before->vertex, after->vertex};
    count += before->kind == PlaneKind::kBisector && after->kind == PlaneKind::kBisector ? 1 : 0;
    before = after;
  }
  out.resize(count);
}

uint64_t Polygon::MemoryBytes() const {
  return groups_.capacity() * sizeof(Group) + planes_.capacity() * sizeof(Plane<2>) +
         nodes_.capacity() * sizeof(CellNode<2>) + reordered_.capacity() * sizeof(Node) + is_removed_.capacity();
}

}  // namespace wellspace::core
