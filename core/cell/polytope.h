// The Voronoi cell of one vertex under construction: a bounded simple polytope, cut by one bisector after the other.
// In the plane it is a Polygon, in space a Polyhedron, which are several times as fast; the template here is for 4-D to
// 6-D. All three are a CellClass (cell_class.h), as polytope.cc asserts.
#ifndef WELLSPACE_CORE_CELL_POLYTOPE_H_
#define WELLSPACE_CORE_CELL_POLYTOPE_H_

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/candidates.h"
#include "core/cell/cell_parts.h"
#include "core/cell/node_columns.h"
#include "core/cell/polygon.h"
#include "core/cell/polyhedron.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// Thread safety: thread-compatible. Reused from site to site: no allocation once warm.
// Invariants: (1) the graph of nodes is that of a simple polytope: every node has D planes and D neighbours, an edge
// joins two nodes that share D - 1 planes; (2) the node set is the one exact arithmetic and the tie rule give, whatever
// the rounding.
template <int D>
class Polytope {
 public:
  // Begins with the box [low, high], which holds `site` and whose faces are of kind `kinds[FaceIndex]`. Its nodes are
  // still to be placed, by Place().
  void Reset(const Point<D>& site, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds, TieRule rule);

  // Cuts the cell by the bisector of its site and `u`, keeping the site's side. Returns whether anything was cut off.
  //
  // REQUIRES:   u != site, and not cut by before; !IsTooLarge().
  // Guarantees: (1) the result is a subset of the cell; (2) exact: the nodes are those of the exact cell under the tie
  //             rule.
  // Complexity: O(nodes); no allocation once warm.
  // Errors:     none.
  // Source:     the cell as a simple polytope is usual since Tanemura, Ogawa and Ogita 1983.
  bool Cut(VertexId u, const Point<D>& position) {
    const bool is_cut = CutBeforePlace(u, position);
    Place();
    return is_cut;
  }

  // The same, where more cuts may follow: until Place() is called nodes() may not be asked for.
  bool CutBeforePlace(VertexId u, const Point<D>& position) {
    const Point<D> normal = Difference<D>(position, site_);
    return CutBeforePlace(u, position, normal, NormSq<D>(normal));
  }

  // The same by vertices, as many as a leaf holds at most, the nearest first: far ones then seldom cut. The cell's own,
  // `site`, may be among them. Returns how many others are within reach.
  //
  // REQUIRES:   positions and listed names may be read so many together, beyond the last perhaps, as those of a leaf
  //             (VertexPool::kReadTogether).
  // Complexity: O(positions nodes), and the cuts; no allocation once warm.
  // Errors:     none.
  size_t CutByEach(std::span<const Point<D>> positions, const VertexNames& names, VertexId site);

  // Computes what nodes() is to tell of the nodes that have been made since: from their planes alone, so that it does
  // not depend on the order of the cuts.
  //
  // Complexity: O(nodes); no allocation.
  // Errors:     none.
  void Place();

  // Whether every node surely lies on bisectors alone, and nearer to the site than `ratio` times the nearest of their
  // vertices; then it does so as it will be placed, too. For this the nodes need not be placed.
  //
  // Complexity: O(nodes).
  // Errors:     none; false where it is not sure.
  bool KeepsRatio(double ratio) const;

  // Returns KeepsRatio(ratio). Unless that holds nodes() may be asked for: those of which it does not surely hold are
  // placed then, the others only roughly, though so that it holds of them. In 3-D they do not tell their neighbours.
  //
  // Complexity: O(nodes).
  // Errors:     none.
  bool PlaceUnlessKeeps(double ratio);

  // Computes `most` of the candidates from `begin` on, so that those for which it is negative do not cut the cell, now
  // or later.
  //
  // Complexity: O(nodes) a candidate.
  // Errors:     none.
  void BoundExcesses(size_t begin, Candidates<D>& candidates);

  // Whether some vertex in `cube` (absolute coordinates) could still cut the cell: whether some node x has dist(x,
  // cube) <= |x - site|, decided generously where rounding leaves a doubt.
  //
  // Complexity: O(nodes).
  // Errors:     none.
  // Source:     [HT08] §6 with the polytope in the place of the ball: |x p|^2 - |x site|^2 is affine in x for fixed p,
  //             so its least value over the cell is at a node.
  bool Reaches(const Box<D>& cube) const {
    // |p x|^2 - |x|^2 = p (p - 2 x). Where that is near zero p is within 2 |x| of the site, so an error e of x moves it
    // by at most 4 |x| e.
    return columns_.Reaches(Difference<D>(cube.low, site_), Difference<D>(cube.high, site_),
                            4 * largest_slack_ * reach_);
  }

  // Whether the last cut has made the cell larger than it may be.
  bool IsTooLarge() const { return columns_.count() > kMostNodes<D> || plane_count_ > kMostPlanes; }

  // Puts into `out` a simplex for each node that lies on bisectors alone. The nodes need not be placed.
  //
  // Complexity: O(nodes); no allocation once warm.
  // Errors:     none.
  void FindStar(Star<D>& out) const;

  // The faces of the box that a node of the cell lies on.
  FaceMask FacesOf(const CellNode<D>& node) const { return core::FacesOf<D>(planes_, node); }

  const Point<D>& site() const { return site_; }
  // Brings reach_sq() down to what it is since the last cut.
  //
  // Complexity: O(nodes).
  // Errors:     none.
  void Tighten();

  // At least the squared distance from the site to the farthest node: little more after Tighten() or Place().
  double reach_sq() const { return reach_ * reach_; }
  // A vertex whose computed squared distance from the site is larger than this cannot cut the cell.
  double CutLimitSq() const { return kCutLimit * reach_sq(); }
  // REQUIRES:   since Reset and the last CutBeforePlace, Cut or Place has been called, or PlaceUnlessKeeps, which
  //             returned false.
  std::span<const CellNode<D>> nodes() const { return nodes_; }
  const Plane<D>& plane(int index) const { return planes_[index]; }
  int plane_count() const { return static_cast<int>(plane_count_); }
  uint64_t cuts() const { return cuts_; }
  const DecisionCounters& counters() const { return counters_; }
  // What the cell takes in memory, roughly, but for itself.
  uint64_t MemoryBytes() const {
    return planes_.capacity() * sizeof(Plane<D>) + nodes_.capacity() * sizeof(CellNode<D>) +
           topologies_.capacity() * sizeof(NodeTopology) + opposite_.capacity() * sizeof(End) + columns_.MemoryBytes();
  }

 private:
  using Index = NodeIndex<D>;

  // One end of an edge: the edge leaves planes[slot] of the node. node << kSlotBits | slot.
  using End = uint32_t;
  static constexpr int kSlotBits = D <= 4 ? 2 : 3;
  static End EndAt(size_t node, uint32_t slot) { return static_cast<End>(node) << kSlotBits | slot; }
  static size_t NodeOf(End end) { return end >> kSlotBits; }
  static size_t SlotOf(End end) { return end & ((1u << kSlotBits) - 1); }

  // What a node is, but for its place and its neighbours: where its planes meet.
  struct NodeTopology {
    std::array<uint16_t, D> planes;  // by index, as in CellNode once placed
    bool is_placed = false;          // the position is the one that the planes alone give
  };
  // An edge between a node that stays and one that goes.
  struct CutEdge {
    End kept = 0;          // the end that stays
    uint32_t removed = 0;  // the other node
  };
  // An end that lacks the other one, with the D - 2 planes that its edge runs along beside the new one, ascending, 16
  // bits each.
  struct Ridge {
    uint64_t planes;
    End end;
  };

  bool CutBeforePlace(VertexId u, const Point<D>& position, const Point<D>& normal, double length_sq) {
    return length_sq <= CutLimitSq() && CutOff(u, position, normal, length_sq);
  }
  bool CutOff(VertexId u, const Point<D>& position, const Point<D>& normal, double length_sq);
  bool CutOffAvx2(VertexId u, const Point<D>& position, const Point<D>& normal, double length_sq);
  template <size_t kWidth>
  bool CutOffWith(VertexId u, const Point<D>& position, const Point<D>& normal, double length_sq);
  bool DecideDoubtful(const Point<D>& generator);
  void FindCutEdges();
  template <size_t kWidth>
  void PlaceCutEdges(uint16_t plane);
  std::array<uint16_t, D> PlanesOn(End kept, uint16_t plane) const;
  std::array<uint32_t, D> RanksOf(const std::array<uint16_t, D>& indices) const;
  bool SurelyKeeps(size_t node, double ratio) const;
  template <typename Wants>
  void PlaceThose(Wants wants);
  void PlaceNode(size_t node);
  double PlaceByPlanes(const std::array<uint16_t, D>& indices, Point<D>& x) const;
  void MakeNewNodes(uint16_t plane);
  void LinkNewNodes();
  void MakeRoomForNodes(size_t count);
  void Join(End a, End b);
  void FillHoles(size_t filled);
  void SetReach(const typename NodeColumns<D>::Largest& largest);

  Point<D> site_;
  TieRule rule_ = TieRule::kKeep;
  double reach_ = 0;              // at least the distance from the site to the farthest node
  double largest_slack_ = 0;      // at least
  bool is_tight_ = true;          // both are as small as they can be known to be
  bool is_placed_ = true;         // all nodes are
  std::vector<Plane<D>> planes_;  // and more
  size_t plane_count_ = 0;
  NodeColumns<D> columns_;                // by node
  std::vector<NodeTopology> topologies_;  // by node, and more
  std::vector<End> opposite_;             // by end, and more: the other end of its edge
  std::vector<CellNode<D>> nodes_;        // by node, as of the last that placed any
  uint64_t cuts_ = 0;
  DecisionCounters counters_;

  // Scratch of CutByEach.
  Candidates<D> near_;
  Candidates<D> sorted_;
  // Scratch of cuts; arrays only grow.
  std::vector<Index> removed_;  // ascending
  size_t removed_count_ = 0;
  std::vector<CutEdge> cut_edges_;
  std::vector<typename NodeColumns<D>::Row> placed_;  // by cut edge: the node that is to be on it
  size_t cut_count_ = 0;
  std::vector<Index> new_;  // the nodes on them
  std::vector<Ridge> ridges_;
};

template <>
class Polytope<2> : public Polygon {
 public:
  using Polygon::Polygon;
};

template <>
class Polytope<3> : public Polyhedron {
 public:
  using Polyhedron::Polyhedron;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_POLYTOPE_H_
