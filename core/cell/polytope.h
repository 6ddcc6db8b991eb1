// The Voronoi cell of one vertex under construction: a bounded simple polytope, cut by one bisector after the other.
// Polytope<D> is its name in every dimension. In the plane it is a Polygon, in space a Polyhedron, which are several
// times as fast; the template here is for 4-D to 6-D. All three are a CellClass, as polytope.cc asserts, and
// cell_class.h has the promises of all three.
#ifndef WELLSPACE_CORE_CELL_POLYTOPE_H_
#define WELLSPACE_CORE_CELL_POLYTOPE_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"
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

// The cell in 4-D to 6-D: nodes in doubles, each with a bound on its error, and the edges between them. A cut finds the
// nodes beyond the bisector, and puts a new node on each edge that leads out of these. Then it joins the new nodes
// along the edges of the new facet.
//
// The promises of its functions are in cell_class.h, but for BoundExcesses. Cuts are in polytope.cc; the code that
// places nodes, and looks at them, in polytope_nodes.cc.
//
// Thread safety: thread-compatible. Reused from site to site: no allocation once warm.
// Invariants: (1) the graph of nodes is that of a simple polytope: every node has D planes and D neighbours, an edge
// joins two nodes that share D - 1 planes; (2) the node set is the one exact arithmetic and the tie rule give, whatever
// the rounding.
template <int D>
class Polytope {
 public:
  void Reset(const Point<D>& site, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds, TieRule rule);

  bool Cut(VertexId u, const Point<D>& position) {
    const bool is_cut = CutBeforePlace(u, position);
    Place();
    return is_cut;
  }
  bool CutBeforePlace(VertexId u, const Point<D>& position) {
    const Point<D> normal = Difference<D>(position, site_);
    return CutBeforePlace(u, position, normal, NormSq<D>(normal));
  }
  size_t CutByEach(std::span<const Point<D>> positions, const VertexNames& names, VertexId site);
  // Computes `excess_bound` of the candidates from `begin` on: candidates for which it is negative do not cut the cell,
  // now or later.
  //
  // Complexity: O(nodes) a candidate.
  // Errors:     none.
  void BoundExcesses(size_t begin, Candidates<D>& candidates);

  void Place();
  bool PlaceUnlessKeeps(double ratio);
  void Tighten();

  bool KeepsRatio(double ratio) const;
  bool Reaches(const Box<D>& cube) const {
    // |p x|^2 - |x|^2 = p (p - 2 x). Where that is near zero p is within 2 |x| of the site, so an error e of x moves it
    // by at most 4 |x| e.
    return columns_.Reaches(Difference<D>(cube.low, site_), Difference<D>(cube.high, site_),
                            4 * largest_slack_ * reach_);
  }
  bool IsTooLarge() const { return columns_.count() > kMostNodes<D> || plane_count_ > kMostPlanes; }
  void FindStar(Star<D>& out) const;
  FaceMask FacesOf(const CellNode<D>& node) const { return core::FacesOf<D>(planes_, node); }
  const Point<D>& site() const { return site_; }
  double reach_sq() const { return reach_ * reach_; }
  double CutLimitSq() const { return kCutLimit * reach_sq(); }
  std::span<const CellNode<D>> nodes() const { return nodes_; }
  const Plane<D>& plane(int index) const { return planes_[index]; }
  int plane_count() const { return static_cast<int>(plane_count_); }
  uint64_t cuts() const { return cuts_; }
  const DecisionCounters& counters() const { return counters_; }
  uint64_t MemoryBytes() const {
    return planes_.capacity() * sizeof(Plane<D>) + nodes_.capacity() * sizeof(CellNode<D>) +
           topologies_.capacity() * sizeof(NodeTopology) + opposite_.capacity() * sizeof(End) + columns_.MemoryBytes();
  }

 private:
  using Index = NodeIndex<D>;
  using Row = typename NodeColumns<D>::Row;

  // One end of an edge: the edge leaves planes[slot] of the node. node << kSlotBits | slot.
  using End = uint32_t;
  static constexpr int kSlotBits = D <= 4 ? 2 : 3;
  static End EndAt(size_t node, uint32_t slot) { return static_cast<End>(node) << kSlotBits | slot; }
  static size_t NodeOf(End end) { return end >> kSlotBits; }
  static size_t SlotOf(End end) { return end & ((1u << kSlotBits) - 1); }

  // A node without its position and its neighbours: the planes that meet there.
  struct NodeTopology {
    std::array<uint16_t, D> planes;  // by index, as in CellNode once placed
    bool is_placed = false;          // the position follows from the planes alone
  };
  // An edge between a node that stays and one that goes.
  struct CutEdge {
    End kept = 0;          // the end that stays
    uint32_t removed = 0;  // the other node
  };
  // An end that lacks the other one, with the D - 2 planes that its edge runs along beside the new one, ascending, 16
  // bits each.
  struct OpenEnd {
    uint64_t planes;
    End end;
  };

  // The plane that cuts, as PlaceOnCutEdge needs it, and the nodes before the cut.
  struct NewPlane {
    uint16_t index;
    double length;              // of the normal
    double offset_error;        // of an excess, without the part for the slack of the node
    double rounding;            // the part of a new slack beside the errors of the ends
    double largest_good_slack;  // a node with more is placed by its planes
    std::span<const double> excesses;
    std::span<const Row> rows;
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
  template <size_t kWidth>
  double PlaceOnCutEdge(const CutEdge& edge, const NewPlane& plane, Row& placed) const;
  std::array<uint16_t, D> PlanesOn(End kept, uint16_t plane) const;
  void MakeNewNodes(uint16_t plane);
  void LinkNewNodes();
  void FillHoles(size_t filled);
  void MakeRoomForNodes(size_t count);
  WELLSPACE_INLINE void Join(End a, End b) {
    opposite_[a] = b;
    opposite_[b] = a;
  }
  void SetReach(const typename NodeColumns<D>::Largest& largest);

  template <typename IsWanted>
  void PlaceWanted(IsWanted is_wanted);
  void PlaceNode(size_t node);
  bool SurelyKeeps(size_t node, double ratio) const;

  Point<D> site_;
  TieRule rule_ = TieRule::kKeep;
  double reach_ = 0;          // at least the distance from the site to the farthest node
  double largest_slack_ = 0;  // at least
  bool is_tight_ = true;      // both are as small as they can be known to be
  bool is_placed_ = true;     // all nodes are
  uint64_t cuts_ = 0;
  DecisionCounters counters_;

  // Arrays of the cell and of one cut. Arrays only grow; values beyond their count mean nothing.
  //
  //   array          index              count             holds                              valid
  //   planes_        plane              plane_count_      walls, then bisectors as they cut   always
  //   columns_       node               its count()       position and slack                 always
  //   topologies_    node               columns_.count()  planes                             always
  //   opposite_      End: node, slot    as topologies_    the other end of the edge          always
  //   nodes_         node               its size()        the result of nodes()              once placed, or rough
  //   removed_       0, 1, ...          removed_count_    nodes cut off, ascending           from FindCutEdges on
  //   cut_edges_     cut edge 0, 1, ... cut_count_        edges from a node kept to one not  from FindCutEdges on
  //   new_rows_      cut edge           cut_count_        where the new node is to be        from PlaceCutEdges on
  //   new_nodes_     cut edge           cut_count_        the new node                       from MakeNewNodes on
  //   open_ends_     0, 1, ...          its size()        ends of edges of the new facet     in LinkNewNodes
  std::vector<Plane<D>> planes_;
  size_t plane_count_ = 0;
  NodeColumns<D> columns_;
  std::vector<NodeTopology> topologies_;
  std::vector<End> opposite_;
  std::vector<CellNode<D>> nodes_;

  std::vector<Index> removed_;
  size_t removed_count_ = 0;
  std::vector<CutEdge> cut_edges_;
  size_t cut_count_ = 0;
  std::vector<Row> new_rows_;
  std::vector<Index> new_nodes_;
  std::vector<OpenEnd> open_ends_;

  // Scratch of CutByEach: the vertices that may cut, as picked, and in order.
  Candidates<D> near_;
  Candidates<D> sorted_;
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
