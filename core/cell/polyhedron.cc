#include "core/cell/polyhedron.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/cell/cell_on_unit.h"
#include "core/cell/float_bisector.h"
#include "core/cell/float_errors.h"
#include "core/cell/float_nodes.h"

namespace wellspace::core {
namespace {

using Four = Wide<4>::Lanes;
using FourFloats = float __attribute__((vector_size(16)));

}  // namespace

// Lowers the bound on the reach to the distance of the farthest node.
template <VectorUnit kUnit>
WELLSPACE_INLINE void Polyhedron::SetReach() {
  Floats most_sq{};
  ForEachGroup([&](const Group& group)
                   __attribute__((always_inline)) { most_sq = Max<kUnit>(most_sq, RadiiSq<3>(group)); });
  radius_bound_ =
      std::min(radius_bound_, std::sqrt(Largest<kUnit>(most_sq)) * (1 + kDistanceError<3>));  // the cell only shrinks
}

void Polyhedron::Reset(const Point<3>& site, const Box<3>& bounds, const std::array<PlaneKind, 6>& kinds,
                       TieRule rule) {
  BeginWalls(site, bounds, kinds, rule);
  if (plane_rows_.empty()) {
    plane_rows_.resize(kWordBits);
    plane_edge_sq_.resize(kWordBits);
    groups_.resize(kWordBits / kGroupSize);
    triangles_.resize(kWordBits);
    removed_words_.resize(1);
    removed_.resize(kWordBits);
    horizon_.resize(kWordBits + 4);
    for (auto& column : horizon_x_) {
      column.resize(horizon_.size());
    }
  }
  for (int face = 0; face < 6; ++face) {
    const Plane<3>& plane = planes_[face];
    plane_rows_[face] = {{plane.normal[0], plane.normal[1], plane.normal[2]}, plane.offset};
    plane_edge_sq_[face] = 0;
  }
  std::fill_n(groups_.begin(), GroupsFor(count_), Group{});
  count_ = 8;
  Group& group = groups_.front();
  for (uint32_t corner = 0; corner < 8; ++corner) {
    std::array<uint16_t, 3> faces;
    for (int axis = 0; axis < 3; ++axis) {
      faces[axis] = static_cast<uint16_t>(FaceIndex(axis, (corner >> axis & 1) != 0));
      group.x[axis][corner] = static_cast<float>(planes_[faces[axis]].offset * scale_);
    }
    if (std::popcount(corner) % 2 == 0) {  // seen from outside its faces follow each other the other way round
      std::swap(faces[1], faces[2]);
    }
    triangles_[corner] = {faces};
  }
  SetReach<VectorUnit::kBaseline>();
}

// Finds the nodes that are cut off; whether there are any.
template <VectorUnit kUnit>
WELLSPACE_INLINE bool Polyhedron::FindRemoved(const FloatBisector<3>& bisector, const Point<3>& position) {
  const Floats surely_from = Splat(2 * (bisector.offset - bisector.least_offset));
  uint64_t maybe = 0;
  uint64_t surely = 0;
  size_t node = 0;  // of a word
  const auto look_at = [&](const Group& group) __attribute__((always_inline)) {
    const Floats excess_bounds =
        Load(group.x[0]) * bisector.w[0] +
        (Load(group.x[1]) * bisector.w[1] + (Load(group.x[2]) * bisector.w[2] - bisector.least_offset));
    maybe |= uint64_t{Bits<kUnit>(reinterpret_cast<const FloatMask&>(excess_bounds)) ^ 0xff} << node;  // by sign
    surely |= uint64_t{Bits<kUnit>(IsLess<kUnit>(surely_from, excess_bounds))} << node;
    node += kGroupSize;
  };
  if (count_ <= kWordBits) [[likely]] {
    ForEachGroup(look_at);
    return SetRemovedWord(0, maybe, surely, position);
  }
  bool is_any = false;
  const Group* const end = groups_.data() + GroupsFor(count_);
  size_t word = 0;
  for (const Group* group = groups_.data(); group != end; ++word) {
    maybe = 0;
    surely = 0;
    for (node = 0; node < kWordBits && group != end; ++group) {
      look_at(*group);
    }
    is_any |= SetRemovedWord(word, maybe, surely, position);
  }
  return is_any;
}

// Sets a word of removed_words_, given which of its nodes the bisector to `generator` may cut off, and which it surely
// does; whether there are any.
WELLSPACE_INLINE bool Polyhedron::SetRemovedWord(size_t word, uint64_t maybe, uint64_t surely,
                                                 const Point<3>& generator) {
  const size_t nodes = std::min(count_ - word * kWordBits, kWordBits);
  maybe &= ~uint64_t{0} >> (kWordBits - nodes);
  surely &= maybe;
  if (maybe != surely) [[unlikely]] {
    surely |= DecideDoubtful(word, maybe & ~surely, generator);
  }
  removed_words_[word] = surely;
  return surely != 0;
}

// Decides the nodes that the bits of `doubtful`, of a word, stand for, by their own errors if those tell, else exactly.
// Returns the bits of nodes that are cut off.
[[gnu::noinline]] uint64_t Polyhedron::DecideDoubtful(size_t word, uint64_t doubtful, const Point<3>& generator) {
  const Point<3> w = ScaledTo(generator);
  const double length_sq = NormSq<3>(w);
  uint64_t removed = 0;
  for (; doubtful != 0; doubtful &= doubtful - 1) {
    const size_t node = word * kWordBits + static_cast<size_t>(std::countr_zero(doubtful));
    const Point<3> x = PositionOf(node);
    const double excess = Dot<3>(x, w) - 0.5 * length_sq;
    bool is_cut_off = excess > 0;
    if (!(excess * excess > NodeDoubtSq<3>(x, length_sq))) {
      is_cut_off = IsCutOff<uint16_t>(triangles_[node].planes, generator);
    }
    removed |= is_cut_off ? doubtful & -doubtful : 0;
  }
  return removed;
}

// Lists the nodes that are cut off, and the edges of the horizon around them: edges of their triangles that no other of
// them has the other way round.
WELLSPACE_INLINE void Polyhedron::FindHorizon() {
  removed_count_ = 0;
  horizon_count_ = 0;
  if (plane_count_ > kWordBits || count_ > kWordBits) {
    FindHorizonAmongMany();
  } else {
    ListHorizon(NoteEdgesOfRemoved());
  }
}

// Lists the nodes that are cut off, and notes their edges in leads_to_ and leads_from_; a bit for each plane that has
// any.
WELLSPACE_INLINE uint64_t Polyhedron::NoteEdgesOfRemoved() {
  const Triangle* const triangles = triangles_.data();
  uint32_t* removed_end = removed_.data();
  uint64_t touched = 0;
  for (uint64_t removed = removed_words_[0]; removed != 0; removed &= removed - 1) {
    const auto node = static_cast<uint32_t>(std::countr_zero(removed));
    *removed_end++ = node;
    const std::array<uint16_t, 3> planes = triangles[node].planes;
    const std::array<uint64_t, 3> bits = {uint64_t{1} << planes[0], uint64_t{1} << planes[1], uint64_t{1} << planes[2]};
    leads_to_[planes[0]] |= bits[1];
    leads_to_[planes[1]] |= bits[2];
    leads_to_[planes[2]] |= bits[0];
    leads_from_[planes[0]] |= bits[2];
    leads_from_[planes[1]] |= bits[0];
    leads_from_[planes[2]] |= bits[1];
    touched |= bits[0] | bits[1] | bits[2];
  }
  removed_count_ = static_cast<size_t>(removed_end - removed_.data());
  return touched;
}

// Lists the edges that lead one way only, and clears the notes. From each plane of the horizon one such edge leads.
//
// The removed triangles are a disk, since decisions are exact: the nodes beyond a plane are a connected part of a
// convex polyhedron, and so are the others. Let it have F triangles, h edges on its horizon, and so h planes there, and
// i planes inside, which the new one cuts off altogether. Its edges are (3 F + h) / 2, so Euler's formula for a disk, V
// - E + F = 1, says h + 2 i = F + 2. The check asks for that, and for one edge from each plane.
WELLSPACE_INLINE void Polyhedron::ListHorizon(uint64_t touched) {
  const auto touched_count = static_cast<size_t>(std::popcount(touched));
  HorizonEdge* const horizon = horizon_.data();
  size_t horizon_count = 0;
  uint64_t doubled = 0;  // not 0 if several such edges lead from one plane
  for (; touched != 0; touched &= touched - 1) {
    const auto from = static_cast<uint32_t>(std::countr_zero(touched));
    const uint64_t to = leads_to_[from] & ~leads_from_[from];
    leads_to_[from] = 0;
    leads_from_[from] = 0;
    // No branch, since it could not be predicted: the value written for a plane inside is written over.
    horizon[horizon_count] = {static_cast<uint16_t>(from),
                              static_cast<uint16_t>(std::countr_zero(to | uint64_t{1} << 63))};
    doubled |= to & (to - 1) & -static_cast<uint64_t>(to != 0);
    horizon_count += to != 0 ? 1 : 0;
  }
  horizon_count_ = horizon_count;
  const size_t inside = touched_count - horizon_count_;
  AbortUnlessCellHolds(doubled == 0 && horizon_count_ + 2 * inside == removed_count_ + 2);
}

// FindHorizon by sorting edges: the two that join the same planes, one in each direction, come one after the other.
[[gnu::noinline]] void Polyhedron::FindHorizonAmongMany() {
  sorted_edges_.clear();
  for (uint32_t node = 0; node < count_; ++node) {
    if (!IsRemoved(node)) {
      continue;
    }
    removed_[removed_count_++] = node;
    const std::array<uint16_t, 3>& planes = triangles_[node].planes;
    for (int k = 0; k < 3; ++k) {
      const uint32_t from = planes[k];
      const uint32_t to = planes[(k + 1) % 3];
      sorted_edges_.push_back({std::min(from, to), std::max(from, to), from});
    }
  }
  std::sort(sorted_edges_.begin(), sorted_edges_.end());
  if (horizon_.size() < sorted_edges_.size() + 4) {
    horizon_.resize(2 * sorted_edges_.size() + 4);
    for (auto& column : horizon_x_) {
      column.resize(horizon_.size());
    }
  }
  for (size_t i = 0; i < sorted_edges_.size(); ++i) {
    const auto& [low, high, from] = sorted_edges_[i];
    if (i + 1 < sorted_edges_.size() && sorted_edges_[i + 1][0] == low && sorted_edges_[i + 1][1] == high) {
      ++i;
      continue;
    }
    horizon_[horizon_count_++] = {static_cast<uint16_t>(from), static_cast<uint16_t>(from == low ? high : low)};
  }
  AbortUnlessCellHolds(horizon_count_ >= 3);  // a new facet has three corners at least
}

// Computes the nodes where `plane` meets the edges of the cell that lead out of the removed part: such an edge runs
// along the two planes of an edge of the horizon. Four at a time.
//
// As Meet does, by Cramer's rule in doubles: wrong by at most 64 * 2^-53 P (d + d' + d'' + |x|) / |det|, where P is the
// product of the lengths of the normals, and the distances of the planes are |x| at most. So |det| > 2^-19 P has x
// wrong by less than 2^-26 |x|.
WELLSPACE_INLINE void Polyhedron::PlaceOnHorizon(uint32_t plane) {
  const PlaneRow& own = plane_rows_[plane];
  const Point<3> n = {own.normal[0], own.normal[1], own.normal[2]};
  const double n_sq = NormSq<3>(n);
  std::fill_n(&horizon_[horizon_count_], 3, horizon_[0]);  // four are read at a time
  for (size_t first = 0; first < horizon_count_; first += 4) {
    // The normals of the planes p and q of each edge, by axis, then their offsets; n is the normal of the new plane.
    // x = (offset of p (q x n) + of q (n x p) + of n (p x q)) / det(p, q, n).
    const HorizonEdge* const edges = &horizon_[first];
    Four p[4];
    Four q[4];
    TakeColumns<uint16_t>({edges[0].from, edges[1].from, edges[2].from, edges[3].from}, p);
    TakeColumns<uint16_t>({edges[0].to, edges[1].to, edges[2].to, edges[3].to}, q);
    const Four q_n[3] = {q[1] * n[2] - q[2] * n[1], q[2] * n[0] - q[0] * n[2], q[0] * n[1] - q[1] * n[0]};
    const Four n_p[3] = {n[1] * p[2] - n[2] * p[1], n[2] * p[0] - n[0] * p[2], n[0] * p[1] - n[1] * p[0]};
    const Four p_q[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    const Four determinant = p[0] * q_n[0] + p[1] * q_n[1] + p[2] * q_n[2];
    const Four product_sq =
        (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) * n_sq;
    const auto is_good = determinant * determinant > 0x1p-38 * product_sq;  // |det| > 2^-19 P
    const Four inverse = scale_ / determinant;
    FourFloats x[3];
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] =
          __builtin_convertvector((p[3] * q_n[axis] + q[3] * n_p[axis] + own.offset * p_q[axis]) * inverse, FourFloats);
    }
    for (int axis = 0; axis < 3; ++axis) {
      std::memcpy(&horizon_x_[axis][first], &x[axis], sizeof(x[axis]));
    }
    const uint32_t good = Bits<2>(reinterpret_cast<const Wide<2>::Mask*>(&is_good)[0]) |
                          Bits<2>(reinterpret_cast<const Wide<2>::Mask*>(&is_good)[1]) << 2;
    if (good != 15) [[unlikely]] {
      for (size_t lane = 0; lane < 4; ++lane) {
        if ((good >> lane & 1) == 0) {
          PlaceOnShortEdge(first + lane, plane);
        }
      }
    }
  }
}

// The node whose triangle leads from one plane to the other; there is one, since the sphere is closed.
size_t Polyhedron::TriangleWith(uint32_t from, uint32_t to) const {
  const auto has = [&](const std::array<uint16_t, 3>& planes) {
    return (planes[0] == from && planes[1] == to) || (planes[1] == from && planes[2] == to) ||
           (planes[2] == from && planes[0] == to);
  };
  size_t node = 0;
  while (!has(triangles_[node].planes)) {
    ++node;
  }
  return node;
}

// Places a node whose planes are nearly dependent, as where slivers have nodes close to each other: at the end of its
// edge that stays, if that is short enough.
[[gnu::noinline]] void Polyhedron::PlaceOnShortEdge(size_t j, uint32_t plane) {
  const HorizonEdge edge = horizon_[j];
  const size_t kept = TriangleWith(edge.to, edge.from);
  const size_t removed = TriangleWith(edge.from, edge.to);
  const Point<3> x = PositionOf(kept);
  const double length = std::sqrt(DistanceSq<3>(x, PositionOf(removed)));
  // Each end is wrong by 1.5 u |x| at most, so the node by the length and 5 u |x|, in the place of 16.
  if (!triangles_[kept].is_at_edge_end && !triangles_[removed].is_at_edge_end &&
      length < 8 * 0x1p-24 * std::sqrt(NormSq<3>(x))) {
    for (int axis = 0; axis < 3; ++axis) {
      horizon_x_[axis][j] = static_cast<float>(x[axis]);
    }
    horizon_[j].is_at_edge_end = true;
    return;
  }
  const Point<3> exact =
      ExactMeetingPoint<3>(site_, {planes_[edge.from].source, planes_[edge.to].source, planes_[plane].source});
  for (int axis = 0; axis < 3; ++axis) {
    horizon_x_[axis][j] = static_cast<float>(exact[axis] * scale_);
  }
}

WELLSPACE_INLINE void Polyhedron::MakeRoomForNodes(size_t count) {
  if (groups_.size() * kGroupSize < count) {
    const size_t groups = 2 * GroupsFor(count);
    groups_.resize(groups);
    triangles_.resize(groups * kGroupSize);
    removed_.resize(groups * kGroupSize);
    removed_words_.resize((groups * kGroupSize + kWordBits - 1) / kWordBits);
  }
}

// Puts the new nodes in the place of those cut off. They take their places first; the rest goes to the end,
// and of places that are left those at the end are filled.
WELLSPACE_INLINE void Polyhedron::Replace(uint32_t plane) {
  const size_t old = count_;
  count_ = std::max(old, old + horizon_count_ - removed_count_);
  MakeRoomForNodes(count_);
  Group* const groups = groups_.data();
  Triangle* const triangles = triangles_.data();
  const HorizonEdge* const horizon = horizon_.data();
  const uint32_t* const removed = removed_.data();
  const float* const edge_sq = plane_edge_sq_.data();
  const std::array<const float*, 3> x = {horizon_x_[0].data(), horizon_x_[1].data(), horizon_x_[2].data()};
  const size_t horizon_count = horizon_count_;
  const size_t removed_count = removed_count_;
  const float own_sq = edge_sq[plane];
  for (size_t j = 0; j < horizon_count; ++j) {
    // removed[j] if there is one, else the next place at the end. No branch, since it could not be predicted.
    const size_t added = old + j - removed_count;
    const size_t index = added ^ ((added ^ removed[j]) & -static_cast<size_t>(j < removed_count));
    const HorizonEdge edge = horizon[j];
    Group& group = groups[index / kGroupSize];
    const size_t lane = index % kGroupSize;
    group.x[0][lane] = x[0][j];
    group.x[1][lane] = x[1][j];
    group.x[2][lane] = x[2][j];
    group.edge_sq[lane] = std::min(std::min(edge_sq[edge.from], edge_sq[edge.to]), own_sq);
    triangles[index] = {{edge.from, edge.to, static_cast<uint16_t>(plane)}, edge.is_at_edge_end};
  }
  FillHoles();
}

// Moves nodes from the end into the places of removed nodes that no new one has taken.
WELLSPACE_INLINE void Polyhedron::FillHoles() {
  // The last hole first: the last node is never one then, unless it is that hole.
  for (size_t i = removed_count_; i-- > horizon_count_;) {
    const size_t hole = removed_[i];
    const size_t last = --count_;
    Group& from = groups_[last / kGroupSize];
    Group& to = groups_[hole / kGroupSize];
    for (int axis = 0; axis < 3; ++axis) {
      to.x[axis][hole % kGroupSize] = from.x[axis][last % kGroupSize];
      from.x[axis][last % kGroupSize] = 0;
    }
    to.edge_sq[hole % kGroupSize] = from.edge_sq[last % kGroupSize];
    triangles_[hole] = triangles_[last];
  }
}

// Cuts by the bisector of the site and `position`.
template <VectorUnit kUnit>
WELLSPACE_INLINE bool Polyhedron::CutOff(const FloatBisector<3>& bisector, VertexId u, const Point<3>& position) {
  if (!FindRemoved<kUnit>(bisector, position)) {
    return false;
  }
  const size_t index = AddBisector(u, position);
  if (plane_rows_.size() < plane_count_) {
    plane_rows_.resize(2 * plane_count_);
    plane_edge_sq_.resize(2 * plane_count_);
  }
  const Plane<3>& plane = planes_[index];
  plane_rows_[index] = {{plane.normal[0], plane.normal[1], plane.normal[2]}, plane.offset};
  plane_edge_sq_[index] = 2 * bisector.offset;
  FindHorizon();
  PlaceOnHorizon(static_cast<uint32_t>(index));
  Replace(static_cast<uint32_t>(index));
  SetReach<kUnit>();
  return true;
}

size_t Polyhedron::CutByGathered(const GatheredVertices<3>& gathered, VertexId site) {
  return CellOnUnit<Polyhedron, 3>::CutByGathered(*this, gathered, site);
}

bool Polyhedron::CutBeforePlace(VertexId u, const Point<3>& position) {
  return CellOnUnit<Polyhedron, 3>::CutBeforePlace(*this, u, position);
}

size_t Polyhedron::CutByEach(std::span<const Point<3>> positions, const VertexNames& names, VertexId site) {
  return CellOnUnit<Polyhedron, 3>::CutByEach(*this, positions, names, site);
}

template <VectorUnit kUnit>
WELLSPACE_INLINE bool Polyhedron::KeepsRatioWith(float ratio_sq) const {
  size_t left = count_;
  for (const Group& group : groups()) {
    const Floats radius_sq = RadiiSq<3>(group);
    const uint32_t all = left < kGroupSize ? (1u << left) - 1 : 0xff;
    left -= std::min(left, kGroupSize);
    if ((Bits<kUnit>(IsAtMost<kUnit>(radius_sq + kUnderflow, ratio_sq * Load(group.edge_sq))) & all) != all) {
      return false;
    }
  }
  return true;
}

WELLSPACE_AVX2 bool Polyhedron::KeepsRatioAvx2(float ratio_sq) const {
  return KeepsRatioWith<VectorUnit::kAvx2>(ratio_sq);
}

bool Polyhedron::KeepsRatio(double ratio) const {
  const float ratio_sq = SurelyKeptRatioSq(ratio);
  return unit_ == VectorUnit::kAvx2 ? KeepsRatioAvx2(ratio_sq) : KeepsRatioWith<VectorUnit::kBaseline>(ratio_sq);
}

bool Polyhedron::Reaches(const Box<3>& cube) const { return CellOnUnit<Polyhedron, 3>::Reaches(*this, cube); }

void Polyhedron::FindStar(Star<3>& out) const {
  out.resize(count_);
  size_t count = 0;
  for (size_t i = 0; i < count_; ++i) {
    // No branch, since it could not be predicted where there are walls.
    uint32_t is_simplex = 1;
    for (int k = 0; k < 3; ++k) {
      const Plane<3>& plane = planes_[triangles_[i].planes[k]];
      out[count][k] = plane.vertex;
      is_simplex &= plane.kind == PlaneKind::kBisector ? 1 : 0;
    }
    count += is_simplex;
  }
  out.resize(count);
}

uint64_t Polyhedron::MemoryBytes() const {
  return groups_.capacity() * sizeof(Group) + triangles_.capacity() * sizeof(Triangle) +
         planes_.capacity() * (sizeof(Plane<3>) + sizeof(PlaneRow) + sizeof(float)) +
         nodes_.capacity() * sizeof(CellNode<3>) + horizon_.capacity() * (sizeof(HorizonEdge) + 3 * sizeof(float)) +
         removed_.capacity() * sizeof(uint32_t) + node_from_to_.capacity() * sizeof(uint16_t) +
         sorted_edges_.capacity() * sizeof(sorted_edges_[0]);
}

}  // namespace wellspace::core
