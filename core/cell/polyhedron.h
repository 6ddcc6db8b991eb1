// The Voronoi cell of one vertex in space under construction: Polytope<3>. The promises of its functions are in
// cell_class.h.
#ifndef WELLSPACE_CORE_CELL_POLYHEDRON_H_
#define WELLSPACE_CORE_CELL_POLYHEDRON_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"
#include "core/cell/cell_parts.h"
#include "core/cell/float_cell.h"
#include "core/cell/gathered_vertices.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// The cell in space: a simple polyhedron, kept as its dual, a triangulated sphere. A plane is a vertex of the sphere, a
// node a triangle of three planes, an edge between two nodes one between two planes. A cut is dual to an insertion of a
// vertex into a convex hull. The nodes beyond the bisector are a disk of triangles, which are taken out. Each edge of
// the horizon around the disk makes a new triangle with the new plane. Which triangle is beside which need not be known
// for that. Doubts that floats leave are decided exactly.
//
//   FindRemoved      which nodes are beyond the bisector, in floats; in doubt by DecideDoubtful
//   AddBisector      the new plane (float_cell.h)
//   FindHorizon      the edges around the nodes that go
//   PlaceOnHorizon   where the new plane meets the edges of the cell that these stand for
//   Replace          new nodes into the places of those that go
//   SetReach         the distance of the farthest node
//
// Cuts are in polyhedron.cc; placing of nodes, and their neighbours, in polyhedron_nodes.cc. Cells of more than
// kWordBits nodes or planes, which are rare, go by the functions called AmongMany.
//
// Thread safety: thread-compatible. Reused from site to site: no allocation once warm.
// Invariants: the nodes are those that exact arithmetic and the tie rule give, whatever the rounding.
class Polyhedron : public FloatCell<3> {
 public:
  // Works with `unit`, which this processor has; the best there is unless told.
  explicit Polyhedron(VectorUnit unit = BestVectorUnit()) : FloatCell(unit) {}

  void Reset(const Point<3>& site, const Box<3>& bounds, const std::array<PlaneKind, 6>& kinds, TieRule rule);

  bool Cut(VertexId u, const Point<3>& position) {
    const bool is_cut = CutBeforePlace(u, position);
    Place();
    return is_cut;
  }
  bool CutBeforePlace(VertexId u, const Point<3>& position);
  size_t CutByEach(std::span<const Point<3>> positions, const VertexNames& names, VertexId site);
  // As Polygon::CutByGathered, which is no part of CellClass.
  size_t CutByGathered(const GatheredVertices<3>& gathered, VertexId site);

  void Place();
  bool KeepsRatio(double ratio) const;
  bool PlaceUnlessKeeps(double ratio);
  bool Reaches(const Box<3>& cube) const;
  void FindStar(Star<3>& out) const;
  uint64_t MemoryBytes() const;

 private:
  friend struct CellOnUnit<Polyhedron, 3>;

  // The values computed for kGroupSize nodes at a time, in the units of the nodes. Lanes beyond the last node are at
  // the site, which no bisector cuts off.
  struct alignas(kGroupSize * sizeof(float)) Group {
    float x[3][kGroupSize];
    float edge_sq[kGroupSize];  // the least plane_edge_sq_ of the three planes: of the shortest edge from the site
  };
  // The planes of a node, in the same sense around the node for all, seen from outside.
  struct Triangle {
    std::array<uint16_t, 3> planes;
    bool is_at_edge_end = false;  // it was put at the end of its edge, which was too short to tell them apart
  };
  // The part of a plane from which nodes are computed: one vector, where a Plane is too large to be read fast.
  struct alignas(4 * sizeof(double)) PlaneRow {
    double normal[3];
    double offset;
  };
  // An edge of the horizon, between two planes, as the triangle there that goes had it.
  struct HorizonEdge {
    uint16_t from;
    uint16_t to;
    bool is_at_edge_end = false;  // as of the new triangle
  };
  // Nodes and planes up to so many have a bit each in one word.
  static constexpr size_t kWordBits = 64;
  // The number of nodes that are placed together.
  static constexpr size_t kPlacedAtOnce = 4;

  // ---- Cuts
  template <VectorUnit kUnit>
  bool CutOff(const FloatBisector<3>& bisector, VertexId u, const Point<3>& position);
  template <VectorUnit kUnit>
  bool FindRemoved(const FloatBisector<3>& bisector, const Point<3>& position);
  bool SetRemovedWord(size_t word, uint64_t maybe, uint64_t surely, const Point<3>& generator);
  uint64_t DecideDoubtful(size_t word, uint64_t doubtful, const Point<3>& generator);
  void FindHorizon();
  uint64_t NoteEdgesOfRemoved();
  void ListHorizon(uint64_t touched);
  void FindHorizonAmongMany();
  void PlaceOnHorizon(uint32_t plane);
  void PlaceOnShortEdge(size_t j, uint32_t plane);
  size_t TriangleWith(uint32_t from, uint32_t to) const;
  void Replace(uint32_t plane);
  void FillHoles();
  void MakeRoomForNodes(size_t count);
  template <VectorUnit kUnit>
  void SetReach();
  template <VectorUnit kUnit>
  bool KeepsRatioWith(float ratio_sq) const;
  bool KeepsRatioAvx2(float ratio_sq) const;

  // ---- Nodes
  template <typename IsWanted>
  void PlaceWanted(IsWanted is_wanted);
  template <typename IsWanted>
  void PlaceWantedWith(IsWanted is_wanted);
  template <typename IsWanted>
  void PlaceWantedAvx2(IsWanted is_wanted);
  void SortPlanes(size_t i);
  uint32_t PlaceTogether(const std::array<uint32_t, kPlacedAtOnce>& nodes);
  void KeepRoughPosition(size_t i);
  void FindNeighbours();
  void FindNeighboursAmongMany();
  static std::array<uint32_t, 2> PlanesBut(const std::array<uint16_t, 3>& planes, uint32_t k);
  void JoinNodes(uint32_t a, uint32_t b);

  bool IsRemoved(size_t node) const { return (removed_words_[node / kWordBits] >> node % kWordBits & 1) != 0; }
  // In the units of the nodes.
  Point<3> PositionOf(size_t node) const {
    const Group& group = groups_[node / kGroupSize];
    const size_t lane = node % kGroupSize;
    return {group.x[0][lane], group.x[1][lane], group.x[2][lane]};
  }
  // The normals of four planes and their offsets, in columns.
  template <typename PlaneIndex>
  WELLSPACE_INLINE void TakeColumns(const std::array<PlaneIndex, 4>& planes, Wide<4>::Lanes* columns) const {
    const auto row = [&](size_t k) __attribute__((always_inline))->const Wide<4>::Lanes& {
      return *reinterpret_cast<const Wide<4>::Lanes*>(&plane_rows_[planes[k]]);
    };
    Transpose(row(0), row(1), row(2), row(3), columns);
  }
  std::span<const Group> groups() const { return {groups_.data(), GroupsFor(count_)}; }
  // Calls f(group) for all groups, and for the first four even if they have no nodes: how many of those do cannot be
  // predicted.
  template <typename F>
  WELLSPACE_INLINE void ForEachGroup(F f) const {
    f(groups_[0]);
    f(groups_[1]);
    f(groups_[2]);
    f(groups_[3]);
    for (size_t i = 4; i < GroupsFor(count_); ++i) {
      f(groups_[i]);
    }
  }

  // Arrays only grow; values beyond their count mean nothing, but for groups_. Those of FloatCell are here
  // for completeness.
  //
  //   array            index                  count            holds                               valid
  //   of the cell
  //   planes_          plane                  plane_count_     walls, then bisectors as they cut   always
  //   plane_rows_      plane                  plane_count_     normal and offset of planes_        always
  //   plane_edge_sq_   plane                  plane_count_     squared length of the edge from     always
  //                                                            the site to its vertex; 0: wall
  //   groups_          node / 8, lane         count_           position, shortest edge             always
  //   triangles_       node                   count_           planes                              always
  //   nodes_           node                   count_           the result of nodes()               once placed or rough
  //   of one cut
  //   removed_words_   node / 64, bit         count_           whether the node is cut off         from FindRemoved on
  //   removed_         0, 1, ...              removed_count_   nodes cut off, ascending            from FindHorizon on
  //   horizon_         horizon edge           horizon_count_   edges around those                  from FindHorizon on
  //   horizon_x_       axis, horizon edge     horizon_count_   where the new node is               from PlaceOnHorizon
  //   leads_to_        plane < 64, bit        64               an edge of a removed triangle       in FindHorizon; else
  //                                                            leads from here to that plane       all 0
  //   leads_from_      plane < 64, bit        64               the same the other way round        as leads_to_
  //   of FindNeighbours
  //   node_from_to_    64 from + to, planes   64 * 64          the node whose triangle has that    in FindNeighbours
  //                                                            edge
  //   of both, with many planes or nodes
  //   sorted_edges_    0, 1, ...              its size()       edges by two planes, and whose      in ...AmongMany
  std::vector<PlaneRow> plane_rows_;
  std::vector<float> plane_edge_sq_;
  std::vector<Group> groups_;  // four at least (ForEachGroup)
  std::vector<Triangle> triangles_;

  std::vector<uint64_t> removed_words_;
  std::vector<uint32_t> removed_;
  size_t removed_count_ = 0;
  std::vector<HorizonEdge> horizon_;  // with room for three more: four are read at a time
  size_t horizon_count_ = 0;
  std::array<std::vector<float>, 3> horizon_x_;  // the same
  std::array<uint64_t, kWordBits> leads_to_{};
  std::array<uint64_t, kWordBits> leads_from_{};

  std::vector<uint16_t> node_from_to_;
  std::vector<std::array<uint32_t, 3>> sorted_edges_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_POLYHEDRON_H_
