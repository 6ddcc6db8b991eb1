#include "core/cell/polytope.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/base/dimensions.h"
#include "core/cell/cell_class.h"
#include "core/cell/excesses.h"
#include "core/cell/meeting_point.h"

namespace wellspace::core {
namespace {

// The excess x . w - c, c = |w|^2 / 2, of a node x over the bisector to a vertex at w, as computed, differs from the
// exact one by at most slack |w| + (D + 5) u c: the error of x is in its slack, w has one rounding a coordinate, the
// product D more, c D + 2, the difference one; 16 u |x| of the slack pays for those of the product.
template <int D>
constexpr double kOffsetError = (D + 5) * kUnit;

// After so many cuts by the vertices of one leaf, those that are left are looked at together.
constexpr int kCutsBetweenLooks = 4;

// A node between two others may be wrong by this share of the cell's reach: few cuts are left in doubt by it.
constexpr double kMostRoughSlack = 0x1p-20;

}  // namespace

template <int D>
void Polytope<D>::Reset(const Point<D>& site, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds,
                        TieRule rule) {
  site_ = site;
  rule_ = rule;
  cuts_ = 0;
  counters_ = {};
  planes_.resize(std::max<size_t>(planes_.size(), 2 * D));
  plane_count_ = 2 * D;
  for (int face = 0; face < 2 * D; ++face) {
    SetWall<D>(site, bounds, face, kinds[face], planes_[face]);
  }
  MakeRoomForNodes(1 << D);
  columns_.Resize(1 << D);
  for (int corner = 0; corner < (1 << D); ++corner) {
    NodeTopology& topology = topologies_[corner];
    Point<D> x;
    for (int axis = 0; axis < D; ++axis) {
      const int face = FaceIndex(axis, ((corner >> axis) & 1) != 0);
      x[axis] = planes_[face].offset;
      topology.planes[axis] = static_cast<uint16_t>(face);
      opposite_[EndAt(corner, axis)] = EndAt(corner ^ (1 << axis), axis);
    }
    topology.is_placed = true;
    columns_.Set(corner, x, 16 * kUnit * std::sqrt(NormSq<D>(x)));
  }
  is_placed_ = false;
  reach_ = std::numeric_limits<double>::infinity();
  SetReach(columns_.FindLargest());
}

template <int D>
WELLSPACE_INLINE void Polytope<D>::MakeRoomForNodes(size_t count) {
  if (topologies_.size() < count) {
    topologies_.resize(2 * count);
    opposite_.resize(EndAt(topologies_.size(), 0));
  }
}

template <int D>
bool Polytope<D>::CutOff(VertexId u, const Point<D>& position, const Point<D>& normal, double length_sq) {
  return columns_.unit() == VectorUnit::kAvx2 ? CutOffAvx2(u, position, normal, length_sq)
                                              : CutOffWith<2>(u, position, normal, length_sq);
}

template <int D>
WELLSPACE_AVX2 bool Polytope<D>::CutOffAvx2(VertexId u, const Point<D>& position, const Point<D>& normal,
                                            double length_sq) {
  return CutOffWith<4>(u, position, normal, length_sq);
}

// Cuts by the bisector of the site and `position` = site + normal: a step a line, as in docs/design/cell.md.
template <int D>
template <size_t kWidth>
WELLSPACE_INLINE bool Polytope<D>::CutOffWith(VertexId u, const Point<D>& position, const Point<D>& normal,
                                              double length_sq) {
  const double length = std::sqrt(length_sq);
  const double offset = 0.5 * length_sq;
  if (!columns_.template ComputeExcesses<kWidth>(normal, offset, length, kOffsetError<D> * offset)) {
    return false;
  }
  if (!DecideDoubtful(position)) {
    return false;
  }
  ++cuts_;
  is_placed_ = false;
  const auto index = static_cast<uint16_t>(plane_count_++);
  if (planes_.size() < plane_count_) {
    planes_.resize(2 * plane_count_);
  }
  SetBisector<D>(u, position, normal, length_sq, planes_[index]);
  FindCutEdges();
  PlaceCutEdges<kWidth>(index);
  MakeNewNodes(index);
  LinkNewNodes();
  if (cut_count_ < removed_count_) {
    FillHoles(cut_count_);
  }
  is_tight_ = false;
  return true;
}

// Far vertices are looked at in vain mostly once near ones have cut: so those that surely miss are dropped before they
// are sorted, and again after every few cuts.
template <int D>
size_t Polytope<D>::CutByEach(std::span<const Point<D>> positions, const VertexNames& names, VertexId) {
  near_.Pick(positions, site_, CutLimitSq());
  const size_t within_reach = near_.count;
  if (cuts_ != 0) {  // few of those within the limit miss a cell that is still a box
    BoundExcesses(0, near_);
    near_.DropThoseThatMiss(0);
  }
  if (near_.count > 1) {
    sorted_.Sort(near_);
  }
  Candidates<D>& left = near_.count > 1 ? sorted_ : near_;
  int cuts = 0;
  for (size_t j = 0; j < left.count; ++j) {
    if (IsTooLarge()) {
      break;
    }
    Point<D> w;
    for (int axis = 0; axis < D; ++axis) {
      w[axis] = left.w[axis][j];
    }
    const auto slot = left.slot[j];
    if (!CutBeforePlace(names[slot], positions[slot], w, left.length_sq[j])) {
      continue;
    }
    if (++cuts % kCutsBetweenLooks == 0 && left.count - j > kCutsBetweenLooks) {
      BoundExcesses(j + 1, left);
      left.DropThoseThatMiss(j + 1);
    }
  }
  Tighten();
  return within_reach;
}

template <int D>
void Polytope<D>::Tighten() {
  if (!is_tight_) {
    SetReach(columns_.FindLargest());
  }
}

// Decides the nodes that the excesses leave in doubt. Returns whether anything is cut off.
template <int D>
WELLSPACE_INLINE bool Polytope<D>::DecideDoubtful(const Point<D>& generator) {
  size_t first = 0;  // node of the word
  uint64_t any = 0;
  for (auto& found : columns_.found()) {
    for (uint64_t doubtful = found.maybe & ~found.surely; doubtful != 0; doubtful &= doubtful - 1) {
      const NodeTopology& node = topologies_[first + std::countr_zero(doubtful)];
      if (DecideNode<D>(site_, planes_, node.planes, generator, rule_, counters_)) {
        found.surely |= doubtful & -doubtful;
      }
    }
    any |= found.surely;
    first += NodeColumns<D>::kWordBits;
  }
  return any != 0;
}

// Lists the nodes that are cut off, and the edges from those to others.
template <int D>
WELLSPACE_INLINE void Polytope<D>::FindCutEdges() {
  const auto found = columns_.found();
  removed_count_ = 0;
  for (const auto& word : found) {
    removed_count_ += static_cast<size_t>(std::popcount(word.surely));
  }
  if (cut_edges_.size() < removed_count_ * D) {
    removed_.resize(2 * removed_count_ * D);
    cut_edges_.resize(2 * removed_count_ * D);
    new_rows_.resize(2 * removed_count_ * D);
  }
  constexpr size_t kWordBits = NodeColumns<D>::kWordBits;
  const End* const opposite = opposite_.data();
  Index* end = removed_.data();
  CutEdge* edge = cut_edges_.data();
  const auto list = [&](auto word_of) __attribute__((always_inline)) {
    for (size_t word = 0; word < found.size(); ++word) {
      for (uint64_t removed = found[word].surely; removed != 0; removed &= removed - 1) {
        const auto index = static_cast<Index>(word * kWordBits + std::countr_zero(removed));
        *end++ = index;
        for (int k = 0; k < D; ++k) {
          // No branch, since it could not be predicted: about half of the neighbours are kept.
          const End kept = opposite[EndAt(index, k)];
          *edge = {kept, index};
          const uint64_t is_removed = word_of(NodeOf(kept)) >> NodeOf(kept) % kWordBits & 1;
          edge += 1 - is_removed;
        }
      }
    }
  };
  if (found.size() == 1) {  // as mostly
    list([only = found[0].surely](size_t) { return only; });
  } else {
    list([found](size_t node) { return found[node / kWordBits].surely; });
  }
  cut_count_ = static_cast<size_t>(edge - cut_edges_.data());
}

// Computes where the new plane meets a cut edge, and returns the slack of that node: from the excesses of the ends, or,
// on an edge that is short enough, at an end, where that is good enough to decide on cuts; else from the planes.
//
// With k and r the ends as computed, s their larger slack, d = r - k, e_k and e_r their excesses as computed and eps
// the bound on the errors of those, t = e_k / (e_k - e_r) differs from that of the exact ends by |e_r a - e_k b| / (g
// (g + b - a)), where g = e_r - e_k and |a|, |b| <= eps are the errors: since e_k <= eps and e_r >= -eps, |e_r| + |e_k|
// is g + 2 eps at most, and this eps (g + 2 eps) / (g (g - 2 eps)), less than 1.02 eps / g from g = 256 eps on. The
// exact node lies between the exact ends, so k + t d is wrong by at most s + 1.02 eps / g (|d| + 2 s), k itself by s +
// |d| + 2 s, and the rounding: of each coordinate of k + t d, of t and of t d, less than 4 u (|k| + |d|) <= 12 u R
// where R >= |k|, |r|. The new slack has to hold 16 u |x| <= 16 u R of its own; 4 u R more pays for the roundings of
// the bound.
template <int D>
template <size_t kWidth>
WELLSPACE_INLINE double Polytope<D>::PlaceOnCutEdge(const CutEdge& edge, const NewPlane& plane, Row& placed) const {
  using Lanes = typename Wide<kWidth>::Lanes;
  constexpr size_t kVectors = PaddedCount(D + 1) / kWidth;
  const size_t node = NodeOf(edge.kept);
  const double below = plane.excesses[node];
  const double gap = plane.excesses[edge.removed] - below;
  const Row& kept = plane.rows[node];
  const Row& removed = plane.rows[edge.removed];
  const double slack = std::max(kept.values[D], removed.values[D]);
  const double doubt = slack * plane.length + plane.offset_error;
  const double inverse = 1 / gap;
  const double t = -below * inverse;
  Lanes along[kVectors];  // the difference of the slacks, too
  Lanes x[kVectors];
  for (size_t v = 0; v < kVectors; ++v) {
    along[v] = LanesAt<kWidth>(removed.values, v * kWidth) - LanesAt<kWidth>(kept.values, v * kWidth);
    x[v] = LanesAt<kWidth>(kept.values, v * kWidth) + t * along[v];
  }
  double distance = 2 * slack;
  for (int i = 0; i < D; ++i) {
    distance += std::abs(along[i / kWidth][i % kWidth]);
  }
  double new_slack = slack + plane.rounding + 1.02 * doubt * inverse * distance;
  if ((gap > 256 * doubt) & (new_slack < plane.largest_good_slack)) {
    x[D / kWidth][D % kWidth] = new_slack;
    for (size_t v = 0; v < kVectors; ++v) {
      LanesAt<kWidth>(placed.values, v * kWidth) = x[v];
    }
  } else if (const double at_end = slack + plane.rounding + distance;
             at_end < plane.largest_good_slack) {  // as between nodes that a tie leaves at one place
    new_slack = at_end;
    placed = kept;
    placed.values[D] = new_slack;
  } else {
    const std::array<uint16_t, D> indices = PlanesOn(edge.kept, plane.index);
    const std::array<uint32_t, D> ranks = RanksOf<D>(planes_, indices);
    std::array<uint16_t, D> planes;
    for (int k = 0; k < D; ++k) {
      planes[ranks[k]] = indices[k];
    }
    Point<D> exact;
    new_slack = PlaceByPlanes<D>(site_, planes_, planes, exact);
    std::copy(exact.begin(), exact.end(), placed.values);
    placed.values[D] = new_slack;
  }
  return new_slack;
}

// Fills new_rows_.
template <int D>
template <size_t kWidth>
WELLSPACE_INLINE void Polytope<D>::PlaceCutEdges(uint16_t plane) {
  const NewPlane new_plane = {.index = plane,
                              .length = planes_[plane].length,
                              .offset_error = kOffsetError<D> * planes_[plane].offset,
                              .rounding = 32 * kUnit * reach_,
                              .largest_good_slack = kMostRoughSlack * reach_,
                              .excesses = columns_.excesses(),
                              .rows = columns_.rows()};
  const CutEdge* const cut_edges = cut_edges_.data();
  Row* const new_rows = new_rows_.data();
  double largest_slack = largest_slack_;
  for (size_t j = 0; j < cut_count_; ++j) {
    largest_slack = std::max(largest_slack, PlaceOnCutEdge<kWidth>(cut_edges[j], new_plane, new_rows[j]));
  }
  largest_slack_ = largest_slack;
}

// The planes of a new node: the planes that the edge at an end runs along, then the new one.
template <int D>
WELLSPACE_INLINE std::array<uint16_t, D> Polytope<D>::PlanesOn(End kept, uint16_t plane) const {
  const NodeTopology& topology = topologies_[NodeOf(kept)];
  const size_t slot = SlotOf(kept);
  std::array<uint16_t, D> planes;
  for (size_t i = 0; i < D - 1; ++i) {
    const size_t is_beyond =
        (slot - 1 - i) >> (std::numeric_limits<size_t>::digits - 1);  // i >= slot, without a branch
    planes[i] = topology.planes[i + is_beyond];
  }
  planes[D - 1] = plane;
  return planes;
}

// Makes one new node on each cut edge. They take the places of removed nodes first; the rest goes to the end, so
// that the nodes stay without holes.
template <int D>
WELLSPACE_INLINE void Polytope<D>::MakeNewNodes(uint16_t plane) {
  if (new_nodes_.size() < cut_count_) {
    new_nodes_.resize(2 * cut_count_);
  }
  const size_t old = columns_.count();
  columns_.Resize(std::max(old, old + cut_count_ - removed_count_));
  MakeRoomForNodes(columns_.count());
  for (size_t j = 0; j < cut_count_; ++j) {
    const End kept = cut_edges_[j].kept;
    // No branch, since it could not be predicted.
    const size_t added = old + j - removed_count_;
    const size_t index = added ^ ((added ^ removed_[j]) & -static_cast<size_t>(j < removed_count_));
    NodeTopology& topology = topologies_[index];
    topology.planes = PlanesOn(kept, plane);
    topology.is_placed = false;
    Join(EndAt(index, D - 1), kept);
    columns_.Set(index, new_rows_[j]);
    new_nodes_[j] = static_cast<Index>(index);
  }
}

// Moves nodes from the end into the places of those removed nodes that have not been `filled` by new ones.
template <int D>
void Polytope<D>::FillHoles(size_t filled) {
  // The last hole first: the last node is never one then.
  size_t count = columns_.count();
  for (size_t i = removed_count_; i-- > filled;) {
    const Index hole = removed_[i];
    const size_t last = --count;
    if (hole != last) {
      topologies_[hole] = topologies_[last];
      columns_.Set(hole, columns_.rows()[last]);
      for (uint32_t k = 0; k < D; ++k) {
        Join(EndAt(hole, k), opposite_[EndAt(last, k)]);
      }
    }
  }
  columns_.Resize(count);
}

// Joins the new nodes along the edges of the new facet. Such an edge runs along the new plane, which is the last of
// each new node, and D - 2 others: so its two ends are those with the same others.
//
// The new facet is a simple polytope of D - 1 dimensions, bounded, so that each of its edges has two ends. Decisions
// that are exact never make another; the check is against errors of the program and of the machine, which would else
// become a mesh that is wrong unnoticed.
template <int D>
WELLSPACE_INLINE void Polytope<D>::LinkNewNodes() {
  static_assert(D <= 6);
  open_ends_.clear();
  for (size_t j = 0; j < cut_count_; ++j) {
    for (uint32_t slot = 0; slot < D - 1; ++slot) {
      std::array<uint16_t, D - 2> along;
      for (uint32_t k = 0; k < D - 2; ++k) {
        along[k] = topologies_[new_nodes_[j]].planes[k + (k >= slot ? 1 : 0)];
      }
      std::sort(along.begin(), along.end());
      OpenEnd open_end{0, EndAt(new_nodes_[j], slot)};
      for (const uint16_t plane : along) {
        open_end.planes = open_end.planes << 16 | plane;
      }
      open_ends_.push_back(open_end);
    }
  }
  std::sort(open_ends_.begin(), open_ends_.end(),
            [](const OpenEnd& a, const OpenEnd& b) { return a.planes < b.planes; });
  AbortUnlessCellHolds(open_ends_.size() % 2 == 0);
  for (size_t i = 0; i < open_ends_.size(); i += 2) {
    AbortUnlessCellHolds(open_ends_[i].planes == open_ends_[i + 1].planes);
    Join(open_ends_[i].end, open_ends_[i + 1].end);
  }
}

template <int D>
void Polytope<D>::SetReach(const typename NodeColumns<D>::Largest& largest) {
  reach_ = std::min(reach_, std::sqrt(largest.radius_sq) + largest.slack);  // the cell only shrinks
  largest_slack_ = largest.slack;
  is_tight_ = true;
}

// The error of an excess is that of CutOffWith, with the largest slack for that of each node.
template <int D>
void Polytope<D>::BoundExcesses(size_t begin, Candidates<D>& candidates) {
  Tighten();
  columns_.BoundExcesses(largest_slack_, kOffsetError<D>, begin, candidates);
}

#define WELLSPACE_INSTANTIATE(D) template class Polytope<D>;
WELLSPACE_FOR_EACH_DIMENSION_ABOVE_3(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

static_assert(CellClass<Polygon, 2>);
static_assert(CellClass<Polyhedron, 3>);
static_assert(CellClass<Polytope<4>, 4>);

}  // namespace wellspace::core
