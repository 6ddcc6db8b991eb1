// The Voronoi cell of one vertex in space under construction: Polytope<3>. What its functions promise is said in
// polytope.h.
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

// Polytope<3>, to which its functions that are not told about here belong: a simple polyhedron, kept as its dual, a
// triangulated sphere. A node is a triangle of three planes; a cut takes a disk of triangles out, and joins its rim to
// the new plane. Which triangle is beside which need not be known for that. What floats leave in doubt is decided
// exactly.
//
// What cuts is in polyhedron.cc; what places nodes, and looks at them, in polyhedron_nodes.cc.
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
  // As Polygon::CutByGathered.
  size_t CutByGathered(const GatheredVertices<3>& gathered, VertexId site);

  void Place();
  bool KeepsRatio(double ratio) const;
  // The nodes that may be asked for then do not tell their neighbours.
  bool PlaceUnlessKeeps(double ratio);
  bool Reaches(const Box<3>& cube) const;
  void FindStar(Star<3>& out) const;
  uint64_t MemoryBytes() const;

 private:
  friend struct CellOnUnit<Polyhedron, 3>;

  // Nodes; places beyond the last are at the site, which no bisector cuts off.
  struct alignas(kTogether * sizeof(float)) Group {
    float x[3][kTogether];
    float edge_sq[kTogether];  // the least square of the length of what its bisectors stand for; 0 on a wall
  };
  // The planes of a node, in the same sense around the node for all, seen from outside.
  struct Triangle {
    std::array<uint16_t, 3> planes;
    bool is_at_end = false;  // of an edge that was too short to tell the node from it
  };
  // Of a plane what nodes are computed from.
  struct alignas(4 * sizeof(double)) Row {
    double normal[3];
    double offset;
  };
  // An edge of the rim of what is cut off, as the triangle there that goes had it.
  struct RimEdge {
    uint16_t from;
    uint16_t to;
    bool is_at_end = false;  // as of the new triangle
  };
  static constexpr size_t kWordBits = 64;
  // So many nodes are placed together.
  static constexpr size_t kPlacedTogether = 4;

  template <VectorUnit kUnit>
  bool CutOff(const FloatBisector<3>& bisector, VertexId u, const Point<3>& position);
  template <VectorUnit kUnit>
  bool FindRemoved(const FloatBisector<3>& bisector, const Point<3>& position);
  bool SetRemoved(size_t word, uint64_t maybe, uint64_t surely, const Point<3>& generator);
  uint64_t DecideDoubtful(size_t word, uint64_t doubtful, const Point<3>& generator);
  void FindRim();
  void FindRimAmongMany();
  void PlaceOnRim(uint32_t plane);
  void PlaceOnShortEdge(size_t j, uint32_t plane);
  void Replace(uint32_t plane);
  template <typename Wants>
  void PlaceNodes(Wants wants);
  template <typename Wants>
  void PlaceThose(Wants wants);
  template <typename Wants>
  void PlaceThoseAvx2(Wants wants);
  void SortPlanes(size_t i);
  uint32_t PlaceTogether(const std::array<uint32_t, kPlacedTogether>& nodes);
  void TakeWhereItIs(size_t i);
  void FindNeighbours();
  void FindNeighboursAmongMany();
  static std::array<uint32_t, 2> PlanesBut(const std::array<uint16_t, 3>& planes, uint32_t k);
  void JoinNodes(uint32_t a, uint32_t b);
  template <VectorUnit kUnit>
  bool KeepsRatioWith(float ratio_sq) const;
  bool KeepsRatioAvx2(float ratio_sq) const;
  template <VectorUnit kUnit>
  void SetReach();
  bool IsRemoved(size_t node) const { return (removed_words_[node / kWordBits] >> node % kWordBits & 1) != 0; }
  // In the units of the nodes.
  Point<3> PositionOf(size_t node) const {
    const Group& group = groups_[node / kTogether];
    const size_t lane = node % kTogether;
    return {group.x[0][lane], group.x[1][lane], group.x[2][lane]};
  }
  // The normals of four planes and their offsets, in columns.
  template <typename PlaneIndex>
  WELLSPACE_INLINE void TakeColumns(const std::array<PlaneIndex, 4>& planes, Wide<4>::Lanes* columns) const {
    const auto row = [&](size_t k) __attribute__((always_inline))->const Wide<4>::Lanes& {
      return *reinterpret_cast<const Wide<4>::Lanes*>(&rows_[planes[k]]);
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

  std::vector<Group> groups_;        // and more, four at least
  std::vector<Triangle> triangles_;  // by node, and more
  std::vector<Row> rows_;            // by plane, and more
  std::vector<float> edge_sq_;       // by plane, and more: of a bisector the square of its vertex' distance, else 0

  // Scratch of cuts; arrays only grow.
  std::vector<uint64_t> removed_words_;  // by node a bit for whether it is cut off
  std::vector<uint32_t> removed_;        // ascending
  size_t removed_count_ = 0;
  std::vector<RimEdge> rim_;
  size_t rim_count_ = 0;
  std::array<std::vector<float>, 3> new_;  // by axis and edge of the rim: the node there
  // By plane, one of the first kWordBits, a bit for each to which, and from which, an edge of a triangle that goes
  // leads; all 0 between cuts.
  std::array<uint64_t, kWordBits> leads_to_{};
  std::array<uint64_t, kWordBits> leads_from_{};
  // Of FindNeighbours, by two of the first kWordBits planes: the node whose triangle leads from the one to the other.
  std::vector<uint16_t> having_;
  std::vector<std::array<uint32_t, 3>> edges_;  // where there are many
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_POLYHEDRON_H_
