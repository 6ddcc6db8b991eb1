// The query structure of [HT08]: vertices in a balanced 2^D-tree that answers which part of a Voronoi cell matters.
#ifndef WELLSPACE_CORE_VORONOI_QUERY_STRUCTURE_H_
#define WELLSPACE_CORE_VORONOI_QUERY_STRUCTURE_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/cell/gathered_vertices.h"
#include "core/cell/polytope.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"
#include "core/voronoi/extra_vertices.h"
#include "core/voronoi/leaf_queue.h"

namespace wellspace::core {

// The cost of queries.
struct QueryCounters {
  uint64_t queries = 0;
  uint64_t leaves = 0;    // opened
  uint64_t vertices = 0;  // found in them, and others within reach
  uint64_t cuts = 0;      // bisectors that cut something off
  uint64_t max_leaves = 0;
  DecisionCounters decisions;

  void Add(const QueryCounters& other);
};

// The scratch space of queries, owned by the caller and reused, with the cell that the last one computed.
template <int D>
struct Workspace {
  Polytope<D> cell;
  QueryCounters counters;
  // The segments that meet the leaves which were opened for the cell, or, of SegmentsWithin, those that are in reach;
  // each once. Only where the tree lists segments.
  std::vector<uint32_t> segments;
  // Private to the queries.
  HugeVector<uint32_t> seen;           // by tree node: the query that last met it
  HugeVector<uint32_t> seen_segments;  // by segment, the same
  uint32_t query = 0;
  LeafQueue::Memory queued_leaves;
  GatheredVertices<D> gathered;        // while cells of several vertices are computed
  VectorUnit unit = BestVectorUnit();  // leaves are met with
};

struct Neighbor {
  VertexId vertex = kNoVertex;
  double distance_sq = 0;
};

// Vertices, the tree over them, and the queries: where a vertex is (points, faces), its nearest neighbour, and its
// cell, clipped or whole. A query writes nothing but its workspace. The functions come in the order of the paper's
// Figure 3.
//
// Thread safety: thread-compatible; queries with different workspaces may run at once, and AddUncommitted beside them;
// AddVertex and the rest alone.
// Invariants: (1) vertices are distinct and lie in the box; (2) faces(v) are exactly the faces of the box that v lies
// on.
template <int D>
class QueryStructure {
 public:
  static constexpr uint32_t kMostUncommitted = 2048;

  // Has the cells of ClippedVoronoi and ClippedVoronoiOfEach end at `box`, which is that of the structure at first.
  //
  // REQUIRES:   `box` holds all vertices, and lies in the box of the structure; there are segments.
  void SetBoxOfCells(const Box<D>& box) { box_of_cells_ = box; }
  const Box<D>& box_of_cells() const { return box_of_cells_; }

  // Builds the structure for `points`, then adds the corners of the box that are not among them; but not where the
  // points are bounded by `segments`, in the plane, which the structure lists then.
  //
  // REQUIRES:   points distinct as cubes of the grid, sorted in its Morton order, in its box.
  // Complexity: O(L) for L leaves; O(n log n) has been paid for sorting.
  // Errors:     RESOURCE_EXHAUSTED when more than `max_leaves` leaves would be needed, or of the context's memory;
  //             CANCELLED, DEADLINE_EXCEEDED.
  // Threads:    as LeafTree::Build.
  // Source:     [HT08] Figure 3, INITIALIZE.
  absl::Status Initialize(const MortonGrid<D>& grid, HugeVector<Point<D>> points, uint64_t max_leaves, int threads,
                          const RunContext& context, std::vector<SegmentLists::Ends> segments = {});

  // The vertex nearest to `v`, and its squared distance. Exact up to rounding, where the paper asks for a constant
  // factor: the scan stops as soon as it is known.
  //
  // REQUIRES:   there is another vertex.
  // Complexity: O(1) when bottom-up.
  // Errors:     none.
  // Source:     [HT08] Figure 3, APPROXIMATENN.
  Neighbor NearestNeighbor(VertexId v, Workspace<D>& workspace) const;

  // The same among the vertices whose squared distance is less than `limit_sq`; kNoVertex and the limit if there is
  // none.
  //
  // Complexity: that of looking into the leaves within the limit.
  // Errors:     none.
  Neighbor NearestWithin(VertexId v, double limit_sq, Workspace<D>& workspace) const;

  // The squared distance of each vertex of a leaf, in the order of `VerticesIn`, to the nearest other one.
  //
  // REQUIRES:   `nearest_sq` is as long as the leaf has vertices; no vertex is uncommitted.
  // Complexity: O(1) for each when bottom-up.
  // Errors:     none.
  void NearestOfEach(NodeId leaf, Workspace<D>& workspace, std::span<double> nearest_sq) const;

  // The distance of `v` from every other vertex, and from the faces of the box that it does not lie on, at least, as
  // far as the tree tells: 0 unless v was given to Initialize.
  //
  // REQUIRES:   no vertex has been added since.
  // Complexity: O(1).
  double LeastSeparation(VertexId v) const {
    return Index(v) < given_count_ ? tree_.SeparationIn(tree_.leaf_of(v)) : 0;
  }

  // The vertex nearest to the point `p`, which need not be one; looked for outward from `near` (kNoVertex if none is
  // known). If p is a vertex the distance is 0.
  //
  // REQUIRES:   there is a vertex; p in the box.
  // Complexity: O(1) when bottom-up and near; O(depth of the tree) more when no vertex is known.
  // Errors:     none.
  Neighbor NearestTo(const Point<D>& p, VertexId near, Workspace<D>& workspace) const;

  // Puts into workspace.segments all segments of the tree within `reach` of `p`, each once, and maybe others;
  // looked for outward from `near`.
  //
  // REQUIRES:   p in the box.
  // Complexity: that of looking into the leaves within reach.
  // Errors:     none.
  void SegmentsWithin(const Point<D>& p, double reach, VertexId near, Workspace<D>& workspace) const;

  // Computes in workspace.cell the Voronoi cell of `v` in the box, clipped by the cube of half side `radius` about v.
  // Ties are kept, or perturbed: then the cell is the same to the bit, but for the numbers of its nodes and planes,
  // whatever the order in which the vertices were added.
  //
  // Units:      radius in those of the coordinates; [HT08]'s beta NN(v).
  // REQUIRES:   radius > 0.
  // Guarantees: (1) exact: every node's ball through v is empty of vertices; (2) every node is on bisectors, faces of
  //             the box, or the clip cube; unless cell.IsTooLarge(), which ends the query: never in a bottom-up run.
  // Complexity: O(1) amortised over a bottom-up run; counted in workspace.counters.
  // Errors:     none.
  // Source:     [HT08] Figure 6; leaves as they are met, opened by Polytope::Reaches, through facets of leaves
  //             alone: a ball about a node through v is convex, so a generic path in it from v to any leaf it
  //             meets crosses only facets of leaves that it meets.
  void ClippedVoronoi(VertexId v, double radius, Workspace<D>& workspace, TieRule rule = TieRule::kKeep) const;

  // The same for one of `sites` after the other, each clipped at `beta` times the distance to its nearest neighbour; by
  // the box alone if that is infinite. Calls take(v, radius) with the cell in workspace.cell, as long as it returns
  // true.
  //
  // In 2-D and 3-D cells take less time than one by one where sites that follow each other are near each other, as in
  // the order of the Z curve or of leaves: the vertices around some of them are gathered once (GatheredVertices).
  //
  // Guarantees: (1) the cells are those of ClippedVoronoi, but for the numbers of their nodes and planes.
  // REQUIRES:   beta > 0; no site is uncommitted; there is another vertex. take() does not change the structure.
  template <typename Take>
  void ClippedVoronoiOfEach(std::span<const VertexId> sites, double beta, Workspace<D>& workspace, Take take,
                            TieRule rule = TieRule::kKeep) const {
    while (!sites.empty()) {
      const size_t count = GatherAround(sites, workspace);
      for (const VertexId v : sites.first(count)) {
        const double radius = std::isinf(beta) ? beta : beta * std::sqrt(NearestSqOfGathered(v, workspace));
        ClippedVoronoiByGathered(v, radius, rule, workspace);
        if (!take(v, radius)) {
          return;
        }
      }
      sites = sites.subspan(count);
    }
  }

  // ClippedVoronoi by a box, which holds v up to rounding, ties perturbed, for callers that may not need the nodes:
  // they are still to be placed, by cell.Place(). The cell is cut by `others`, too.
  void UnplacedClippedVoronoi(VertexId v, const Box<D>& clip, Workspace<D>& workspace,
                              const ExtraVertices<D>& others = {}) const;

  // Computes in workspace.cell the cell that a vertex at `p` would have in the box, ties perturbed; looked for outward
  // from `near`. Its nodes are still to be placed.
  //
  // REQUIRES:   p in the box and different from all vertices; no vertex is uncommitted.
  // Complexity: O(1) when bottom-up and near.
  // Errors:     none.
  void TrialVoronoi(const Point<D>& p, VertexId near, Workspace<D>& workspace) const;

  // Asks the memory for the data that a query about `v` begins with, which are found in three steps (PrefetchAhead).
  //
  // REQUIRES:   as queries.
  // Complexity: O(1).
  void Prefetch(VertexId v, int step) const;

  // Computes in workspace.cell the whole Voronoi cell of `v`, inside walls one side of the box beyond it, ties
  // perturbed.
  //
  // Guarantees: (1) cells of different sites agree: they are those of one regular triangulation, the Delaunay
  //             triangulation of infinitesimally weighted vertices; unless cell.IsTooLarge(): never once refined.
  // Complexity: O(1) once refined.
  // Errors:     none.
  // Source:     [HT08] §1, "the entire Voronoi cell of any vertex".
  void Voronoi(VertexId v, Workspace<D>& workspace) const;

  // Makes room for so many vertices.
  void Reserve(uint32_t vertices) {
    points_.reserve(vertices);
    faces_.reserve(vertices);
    tree_.Reserve(vertices);
  }

  // Adds a vertex at `p`, near `near`; kNoVertex if none is known. Which neighbours it may have spoiled is not looked
  // at: that follows from its cell, which the refinement computes when it comes to the vertex
  // (PendingVertices::Notify).
  //
  // REQUIRES:   p in the box and different from all vertices.
  // Complexity: O(1) when p is in the clipped cell of `near` in a bottom-up run.
  // Errors:     none.
  // Source:     [HT08] Figure 3, ADDVERTEX.
  VertexId AddVertex(VertexId near, const Point<D>& p);

  // The same, but the vertex is uncommitted: no query finds it before CommitAll, be it that of another uncommitted one,
  // and meanwhile queries of vertices that are committed may run.
  //
  // REQUIRES:   fewer than kMostUncommitted vertices are uncommitted.
  // Complexity: O(1).
  // Errors:     none.
  VertexId AddUncommitted(VertexId near, const Point<D>& p);

  // Commits the uncommitted vertices, in the order in which they were added.
  //
  // Complexity: that of AddVertex for each.
  // Errors:     none.
  void CommitAll();

  // Cuts the cell of `v` by the uncommitted vertices.
  //
  // Complexity: O(1) for each of these, and the cuts.
  // Errors:     none.
  void CutByUncommitted(VertexId v, Polytope<D>& cell) const;

  // The squared distance from `p` to the nearest uncommitted vertex, if it is less than `limit_sq`; else that.
  //
  // Complexity: O(1) for each of these.
  // Errors:     none.
  double NearestUncommittedSq(const Point<D>& p, double limit_sq) const {
    for (uint32_t u = tree_.vertex_count(); u < vertex_count_; ++u) {
      limit_sq = std::min(limit_sq, DistanceSq<D>(points_[u], p));
    }
    return limit_sq;
  }

  uint32_t uncommitted_count() const { return vertex_count_ - tree_.vertex_count(); }

  // Puts vertex `v` at `p`.
  //
  // REQUIRES:   p in the box, on the same of its faces as v, and different from all other vertices.
  // Complexity: O(1) when p is in the cell of v.
  // Errors:     none.
  void MoveVertex(VertexId v, const Point<D>& p);

  const Box<D>& box() const { return box_; }
  // Uncommitted ones, too.
  uint32_t vertex_count() const { return vertex_count_; }
  // How many Initialize has left: the points and the corners of the box.
  uint32_t built_count() const { return built_count_; }
  const Point<D>& point(VertexId v) const { return points_[Index(v)]; }
  // By vertex; valid until one is added or moved.
  std::span<const Point<D>> points() const { return {points_.data(), vertex_count_}; }
  FaceMask faces(VertexId v) const { return faces_[Index(v)]; }
  const LeafTree<D>& tree() const { return tree_; }
  // The memory that the structure takes.
  uint64_t MemoryBytes() const {
    return tree_.MemoryBytes() + vertex_count_ * (sizeof(Point<D>) + sizeof(StoredFaces));
  }

 private:
  using StoredFaces = std::conditional_t<(2 * D <= 8), uint8_t, FaceMask>;

  void MakeRoom();
  VertexId CommittedNear(VertexId near) const;
  NodeId LeafOf(VertexId v) const;
  void BeginWalk(Workspace<D>& workspace) const;
  void ListSegmentsOf(NodeId leaf, Workspace<D>& workspace) const;
  // Calls open(leaf) for leaves outward from `own`, which holds `site`: as long as reach_sq() says for those whose
  // distance allows it, and wants(leaf) agrees.
  template <typename ReachSq, typename Wants, typename Open>
  void ScanOutward(const Point<D>& site, NodeId own, Workspace<D>& workspace, ReachSq reach_sq, Wants wants,
                   Open open) const;
  template <size_t kWidth, typename ReachSq, typename Wants, typename Open>
  void ScanOutwardWith(const Point<D>& site, NodeId own, Workspace<D>& workspace, ReachSq& reach_sq, Wants& wants,
                       Open& open) const;
  template <typename ReachSq, typename Wants, typename Open>
  void ScanOutwardAvx2(const Point<D>& site, NodeId own, Workspace<D>& workspace, ReachSq& reach_sq, Wants& wants,
                       Open& open) const;
  Neighbor FindBeyond(const Point<D>& p, NodeId leaf, Neighbor nearest, Workspace<D>& workspace) const;
  Neighbor Nearest(const Point<D>& p, NodeId leaf, VertexId but, double limit_sq, Workspace<D>& workspace) const;
  size_t GatherAround(std::span<const VertexId> sites, Workspace<D>& workspace) const;
  double NearestSqOfGathered(VertexId v, Workspace<D>& workspace) const;
  void ClippedVoronoiByGathered(VertexId v, double radius, TieRule rule, Workspace<D>& workspace) const;
  void Clip(VertexId v, const Box<D>& box, const Box<D>& clip, TieRule rule, Workspace<D>& workspace) const;
  void Scan(VertexId v, Workspace<D>& workspace, const ExtraVertices<D>& others = {}) const;
  template <typename Cut>
  void ScanFor(NodeId own, Workspace<D>& workspace, Cut cut) const;
  void ScanBeyondGathered(VertexId v, Workspace<D>& workspace) const;
  void CutByLeaf(NodeId leaf, VertexId site, Workspace<D>& workspace) const;
  static void CutByOthers(const ExtraVertices<D>& others, VertexId site, Workspace<D>& workspace);
  static void CountCuts(Workspace<D>& workspace);

  Box<D> box_;
  Box<D> box_of_cells_;
  LeafTree<D> tree_;
  uint32_t vertex_count_ = 0;
  uint32_t given_count_ = 0;  // to Initialize
  uint32_t built_count_ = 0;
  // By vertex, with room for those that will be uncommitted, so that nothing moves when one is added.
  HugeVector<Point<D>> points_;
  HugeVector<StoredFaces> faces_;
  std::vector<VertexId> near_;  // of the uncommitted vertices: the vertices that they were added near to
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_QUERY_STRUCTURE_H_
