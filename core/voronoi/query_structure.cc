#include "core/voronoi/query_structure.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/memory/prefetch.h"
#include "core/base/simd/lanes.h"
#include "core/base/status_macros.h"
#include "core/voronoi/cube_from.h"

namespace wellspace::core {

namespace {

// Asks for the vertices in a leaf that will soon be looked at: the first lines of a cache hold most of them.
template <int D>
void Prefetch(const LeafTree<D>& tree, NodeId leaf) {
  constexpr size_t kLine = 64;
  constexpr size_t kLines = 4;
  if (const auto* inside = tree.VerticesIn(leaf); inside != nullptr) {
    const char* const positions = reinterpret_cast<const char*>(inside->positions);
    for (size_t line = 0; line < kLines; ++line) {
      PrefetchLine(positions + line * kLine);
    }
    PrefetchLine(inside->ids);
  }
}

// Looks in a leaf for a vertex other than `but` that is nearer to `p`.
template <int D>
void LookInto(const LeafTree<D>& tree, NodeId leaf, const Point<D>& p, VertexId but, Neighbor& nearest) {
  const auto* inside = tree.VerticesIn(leaf);
  for (uint32_t i = 0; inside != nullptr && i < inside->count; ++i) {
    const double distance_sq = DistanceSq<D>(inside->positions[i], p);
    if (distance_sq < nearest.distance_sq && inside->ids[i] != but) {
      nearest = {inside->ids[i], distance_sq};
    }
  }
}

// The squared distance of each of different points to the nearest other one.
template <int D, size_t kWidth>
WELLSPACE_INLINE void NearestAmongWith(std::span<const Point<D>> points, std::span<double> nearest_sq) {
  using Lanes = typename Wide<kWidth>::Lanes;
  constexpr size_t kMost = PaddedCount(LeafTree<D>::kLeafCapacity);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  alignas(sizeof(Lanes)) double columns[D][kMost];
  const size_t padded = PaddedCount(points.size());
  for (int axis = 0; axis < D; ++axis) {
    for (size_t i = 0; i < padded; ++i) {
      columns[axis][i] = i < points.size() ? points[i][axis] : kInfinity;
    }
  }
  for (size_t i = 0; i < points.size(); ++i) {
    Lanes least = Lanes{} + kInfinity;
    for (size_t from = 0; from < padded; from += kWidth) {
      Lanes distance_sq{};
      for (int axis = 0; axis < D; ++axis) {
        const Lanes apart = LanesAt<kWidth>(columns[axis], from) - points[i][axis];
        distance_sq += apart * apart;
      }
      distance_sq = distance_sq > 0 ? distance_sq : Lanes{} + kInfinity;  // but for the point itself
      least = distance_sq < least ? distance_sq : least;
    }
    nearest_sq[i] = least[0];
    for (size_t lane = 1; lane < kWidth; ++lane) {
      nearest_sq[i] = std::min(nearest_sq[i], least[lane]);
    }
  }
}

template <int D>
WELLSPACE_AVX2 void NearestAmongAvx2(std::span<const Point<D>> points, std::span<double> nearest_sq) {
  NearestAmongWith<D, 4>(points, nearest_sq);
}

template <int D>
void NearestAmong(std::span<const Point<D>> points, VectorUnit unit, std::span<double> nearest_sq) {
  if (unit == VectorUnit::kAvx2) {
    NearestAmongAvx2<D>(points, nearest_sq);
  } else {
    NearestAmongWith<D, 2>(points, nearest_sq);
  }
}

// Whether `p` is farther from the faces of `cube` than a distance, by its square.
template <int D>
bool LiesDeeperThan(const Point<D>& p, double distance_sq, const Box<D>& cube) {
  bool is_deeper = true;
  for (int i = 0; i < D; ++i) {
    const double depth = std::min(p[i] - cube.low[i], cube.high[i] - p[i]);
    is_deeper &= (depth > 0) & (depth * depth > distance_sq);
  }
  return is_deeper;
}

}  // namespace

void QueryCounters::Add(const QueryCounters& other) {
  queries += other.queries;
  leaves += other.leaves;
  vertices += other.vertices;
  cuts += other.cuts;
  max_leaves = std::max(max_leaves, other.max_leaves);
  decisions.exact += other.decisions.exact;
  decisions.perturbed += other.decisions.perturbed;
}

template <int D>
absl::Status QueryStructure<D>::Initialize(const MortonGrid<D>& grid, HugeVector<Point<D>> points, uint64_t max_leaves,
                                           int threads, const RunContext& context,
                                           std::vector<SegmentLists::Ends> segments) {
  box_ = grid.box();
  box_of_cells_ = box_;
  points_ = std::move(points);
  faces_.clear();
  if (points_.capacity() > 2 * points_.size()) {  // room for many more vertices
    const auto room = static_cast<uint32_t>(points_.capacity());
    tree_.Reserve(room);
    faces_.reserve(room);
  }
  WELLSPACE_RETURN_IF_ERROR(tree_.Build(grid, points_, max_leaves, threads, context, std::move(segments)));
  vertex_count_ = static_cast<uint32_t>(points_.size());
  near_.clear();
  MakeRoom();
  std::array<bool, 1 << D> has_corner{};
  given_count_ = vertex_count_;
  for (uint32_t i = 0; i < given_count_; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const FaceMask faces = box_.FacesOf(points_[i]);
    faces_[i] = static_cast<StoredFaces>(faces);
    if (faces == 0) {
      continue;
    }
    for (int corner = 0; corner < (1 << D); ++corner) {
      has_corner[corner] = has_corner[corner] || faces == CornerFaces<D>(corner);
    }
  }
  for (int corner = 0; corner < (1 << D) && tree_.segments().IsEmpty(); ++corner) {
    if (!has_corner[corner]) {
      Point<D> p;
      for (int i = 0; i < D; ++i) {
        p[i] = box_.FaceCoordinate(FaceIndex(i, ((corner >> i) & 1) != 0));
      }
      AddVertex(kNoVertex, p);
    }
  }
  built_count_ = vertex_count_;
  return absl::OkStatus();
}

template <int D>
VertexId QueryStructure<D>::AddVertex(VertexId near, const Point<D>& p) {
  const VertexId v = AddUncommitted(near, p);
  CommitAll();
  return v;
}

template <int D>
VertexId QueryStructure<D>::AddUncommitted(VertexId near, const Point<D>& p) {
  const VertexId v{vertex_count_};
  points_[vertex_count_] = p;
  faces_[vertex_count_] = static_cast<StoredFaces>(box_.FacesOf(p));
  ++vertex_count_;
  near_.push_back(near);
  return v;
}

template <int D>
void QueryStructure<D>::CommitAll() {
  for (size_t i = 0; i < near_.size(); ++i) {
    PrefetchAhead(std::span(near_), i, [this](VertexId near, int step) { Prefetch(near, step); });
    const VertexId v{tree_.vertex_count()};
    tree_.Insert(near_[i], v, point(v));
  }
  near_.clear();
  MakeRoom();
}

template <int D>
void QueryStructure<D>::MakeRoom() {
  const size_t needed = vertex_count_ + kMostUncommitted;
  if (points_.size() < needed) {
    points_.resize(needed + kMostUncommitted);
    faces_.resize(needed + kMostUncommitted);
  }
}

template <int D>
void QueryStructure<D>::CutByUncommitted(VertexId v, Polytope<D>& cell) const {
  for (uint32_t u = tree_.vertex_count(); u < vertex_count_ && !cell.IsTooLarge(); ++u) {
    if (VertexId{u} != v) {
      cell.CutBeforePlace(VertexId{u}, points_[u]);
    }
  }
}

// `near`, or, if that is uncommitted, the vertex that it was added near to.
template <int D>
VertexId QueryStructure<D>::CommittedNear(VertexId near) const {
  while (near != kNoVertex && Index(near) >= tree_.vertex_count()) {
    near = near_[Index(near) - tree_.vertex_count()];
  }
  return near;
}

// The leaf that `v` lies in; of an uncommitted one, walked to.
template <int D>
NodeId QueryStructure<D>::LeafOf(VertexId v) const {
  const VertexId committed = CommittedNear(v);
  return committed == v ? tree_.leaf_of(v) : tree_.LeafHolding(committed, point(v));
}

template <int D>
void QueryStructure<D>::Prefetch(VertexId v, int step) const {
  if (Index(v) >= tree_.vertex_count()) {
    return;  // new, and thus at hand
  }
  switch (step) {
    case 0:
      PrefetchLine(&points_[Index(v)]);
      PrefetchLine(&faces_[Index(v)]);
      tree_.PrefetchLeafOf(v);
      break;
    case 1:
      tree_.PrefetchNode(tree_.leaf_of(v));
      break;
    default:
      core::Prefetch<D>(tree_, tree_.leaf_of(v));
      tree_.PrefetchNeighbours(tree_.leaf_of(v));
  }
}

template <int D>
void QueryStructure<D>::MoveVertex(VertexId v, const Point<D>& p) {
  tree_.Move(v, p);
  points_[Index(v)] = p;
}

template <int D>
void QueryStructure<D>::BeginWalk(Workspace<D>& workspace) const {
  workspace.seen.resize(tree_.node_count(), 0);
  if (++workspace.query == 0) {
    std::fill(workspace.seen.begin(), workspace.seen.end(), 0);
    std::fill(workspace.seen_segments.begin(), workspace.seen_segments.end(), 0);
    workspace.query = 1;
  }
}

// Appends the segments that meet `leaf` to those of the workspace, but for those which this query has met.
template <int D>
void QueryStructure<D>::ListSegmentsOf(NodeId leaf, Workspace<D>& workspace) const {
  for (const uint32_t segment : tree_.segments().Of(leaf)) {
    if (std::exchange(workspace.seen_segments[segment], workspace.query) != workspace.query) {
      workspace.segments.push_back(segment);
    }
  }
}

template <int D>
template <size_t kWidth, typename ReachSq, typename Wants, typename Open>
WELLSPACE_INLINE void QueryStructure<D>::ScanOutwardWith(const Point<D>& site, NodeId own, Workspace<D>& workspace,
                                                         ReachSq& reach_sq, Wants& wants, Open& open) const {
  using Cube = CubeFrom<D, kWidth>;
  core::Prefetch<D>(tree_, own);
  ++workspace.counters.queries;
  BeginWalk(workspace);
  typename Cube::Axes from;
  Cube::Load(site, from);
  uint32_t* const seen = workspace.seen.data();
  const uint32_t query = workspace.query;
  seen[Index(own)] = query;
  LeafQueue queue(workspace.queued_leaves, tree_.SideOf(own));
  queue.Reserve(1);
  queue.PushIf(true, 0, own);
  uint64_t leaves = 0;
  double limit_sq = reach_sq();
  while (!queue.IsEmpty()) {
    const LeafQueue::Entry next = queue.Pop();
    if (next.distance_sq > limit_sq || (next.leaf != own && !wants(next.leaf))) {
      continue;
    }
    ++leaves;
    open(next.leaf);
    limit_sq = reach_sq();
    queue.Reserve(LeafTree<D>::kMostFaceNeighbours + 1);
    // A leaf within reach is reached by leaves that are, too: the leaves on the straight line from the site.
    const uint32_t facets = Cube(from, tree_, next.leaf).FacetsWithin(limit_sq);
    tree_.ForEachBeyondFacets(
        next.leaf, facets, [&](NodeId beyond) __attribute__((always_inline)) {
          // No branch, since it could not be predicted.
          const bool is_new = seen[Index(beyond)] != query;
          seen[Index(beyond)] = query;
          const double distance_sq = Cube(from, tree_, beyond).DistanceSq();
          queue.PushIf(is_new & (distance_sq <= limit_sq), distance_sq, beyond);
          core::Prefetch<D>(tree_, beyond);
        });
  }
  workspace.counters.leaves += leaves;
  workspace.counters.max_leaves = std::max(workspace.counters.max_leaves, leaves);
}

template <int D>
template <typename ReachSq, typename Wants, typename Open>
WELLSPACE_AVX2 void QueryStructure<D>::ScanOutwardAvx2(const Point<D>& site, NodeId own, Workspace<D>& workspace,
                                                       ReachSq& reach_sq, Wants& wants, Open& open) const {
  ScanOutwardWith<D == 3 || D == 4 ? 4 : 2>(site, own, workspace, reach_sq, wants, open);
}

template <int D>
template <typename ReachSq, typename Wants, typename Open>
void QueryStructure<D>::ScanOutward(const Point<D>& site, NodeId own, Workspace<D>& workspace, ReachSq reach_sq,
                                    Wants wants, Open open) const {
  if (workspace.unit == VectorUnit::kAvx2) {
    ScanOutwardAvx2(site, own, workspace, reach_sq, wants, open);
  } else {
    ScanOutwardWith<2>(site, own, workspace, reach_sq, wants, open);
  }
}

template <int D>
Neighbor QueryStructure<D>::NearestNeighbor(VertexId v, Workspace<D>& workspace) const {
  return NearestWithin(v, std::numeric_limits<double>::infinity(), workspace);
}

template <int D>
Neighbor QueryStructure<D>::NearestWithin(VertexId v, double limit_sq, Workspace<D>& workspace) const {
  return Nearest(point(v), LeafOf(v), v, limit_sq, workspace);
}

template <int D>
Neighbor QueryStructure<D>::NearestTo(const Point<D>& p, VertexId near, Workspace<D>& workspace) const {
  return Nearest(p, tree_.LeafHolding(CommittedNear(near), p), kNoVertex, std::numeric_limits<double>::infinity(),
                 workspace);
}

template <int D>
void QueryStructure<D>::NearestOfEach(NodeId leaf, Workspace<D>& workspace, std::span<double> nearest_sq) const {
  const auto* inside = tree_.VerticesIn(leaf);
  NearestAmong<D>({inside->positions, inside->count}, workspace.unit, nearest_sq);
  const Box<D> cube = tree_.BoxOf(leaf);
  const double half = 0.5 * tree_.SideOf(leaf);
  for (uint32_t i = 0; i < inside->count; ++i) {
    const Point<D>& p = inside->positions[i];
    Neighbor nearest{kNoVertex, nearest_sq[i]};
    uint32_t facets = 0;  // facets of the box within that distance, and the depth of p below the last of them
    double depth = 0;
    for (int face = 0; face < 2 * D; ++face) {
      const double below = cube.DistanceToFace(p, face);
      if (below * below <= nearest.distance_sq) {
        facets |= 1u << face;
        depth = below;
      }
    }
    if (facets == 0) {
      continue;
    }
    if (std::has_single_bit(facets) && nearest.distance_sq <= (depth + half) * (depth + half)) {
      // A vertex that is as near lies in the leaves beyond, which are half as large at least.
      tree_.ForEachBeyondFacets(leaf, facets, [&](NodeId other) { LookInto<D>(tree_, other, p, kNoVertex, nearest); });
    } else {
      nearest = FindBeyond(p, leaf, nearest, workspace);
    }
    nearest_sq[i] = nearest.distance_sq;
  }
}

// The vertex other than `but` that is nearest to `p`, a point of `leaf`, and nearer than the limit.
template <int D>
Neighbor QueryStructure<D>::Nearest(const Point<D>& p, NodeId leaf, VertexId but, double limit_sq,
                                    Workspace<D>& workspace) const {
  Neighbor nearest{kNoVertex, limit_sq};
  LookInto<D>(tree_, leaf, p, but, nearest);
  return LiesDeeperThan<D>(p, nearest.distance_sq, tree_.BoxOf(leaf)) ? nearest
                                                                      : FindBeyond(p, leaf, nearest, workspace);
}

// The vertex that is nearest to `p`, a point of `leaf`: `nearest`, or one in another leaf that is nearer.
template <int D>
Neighbor QueryStructure<D>::FindBeyond(const Point<D>& p, NodeId leaf, Neighbor nearest,
                                       Workspace<D>& workspace) const {
  ScanOutward(
      p, leaf, workspace, [&] { return nearest.distance_sq; }, [](NodeId) { return true; },
      [&](NodeId opened) {
        if (opened != leaf) {
          LookInto<D>(tree_, opened, p, kNoVertex, nearest);
        }
      });
  return nearest;
}

template <int D>
void QueryStructure<D>::SegmentsWithin(const Point<D>& p, double reach, VertexId near, Workspace<D>& workspace) const {
  workspace.segments.clear();
  workspace.seen_segments.resize(tree_.segments().count());
  ScanOutward(
      p, tree_.LeafHolding(CommittedNear(near), p), workspace, [&] { return reach * reach; },
      [](NodeId) { return true; }, [&](NodeId leaf) { ListSegmentsOf(leaf, workspace); });
}

template <int D>
void QueryStructure<D>::ClippedVoronoi(VertexId v, double radius, Workspace<D>& workspace, TieRule rule) const {
  Clip(v, box_of_cells_, CubeAround<D>(point(v), radius), rule, workspace);
  Scan(v, workspace);
  workspace.cell.Place();
}

template <int D>
void QueryStructure<D>::UnplacedClippedVoronoi(VertexId v, const Box<D>& clip, Workspace<D>& workspace,
                                               const ExtraVertices<D>& others) const {
  Clip(v, box_, clip, TieRule::kPerturb, workspace);
  Scan(v, workspace, others);
}

template <int D>
void QueryStructure<D>::TrialVoronoi(const Point<D>& p, VertexId near, Workspace<D>& workspace) const {
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  workspace.cell.Reset(p, box_, kinds, TieRule::kPerturb);
  ScanFor(tree_.LeafHolding(CommittedNear(near), p), workspace,
          [&](NodeId leaf) { CutByLeaf(leaf, kNoVertex, workspace); });
  CountCuts(workspace);
}

// Begins the clipped cell of vertex `v` in `box`.
template <int D>
void QueryStructure<D>::Clip(VertexId v, const Box<D>& box, const Box<D>& clip, TieRule rule,
                             Workspace<D>& workspace) const {
  std::array<PlaneKind, 2 * D> kinds;
  const Box<D> bounds = ClippedBox<D>(box, clip, kinds);
  workspace.cell.Reset(point(v), bounds, kinds, rule);
}

// Gathers the vertices around the first of `sites`, in 2-D and 3-D: above, the walk is a small part of a cell. Returns
// how many sites these are.
template <int D>
size_t QueryStructure<D>::GatherAround(std::span<const VertexId> sites, Workspace<D>& workspace) const {
  if constexpr (D <= 3) {
    BeginWalk(workspace);
    const size_t count = workspace.gathered.Gather(tree_, points(), sites, workspace.seen, workspace.query);
    workspace.counters.leaves += workspace.gathered.leaf_count();
    return count;
  }
  return sites.size();
}

// The squared distance of `v`, around which vertices may have been gathered, from the nearest other one.
template <int D>
double QueryStructure<D>::NearestSqOfGathered(VertexId v, Workspace<D>& workspace) const {
  if constexpr (D <= 3) {
    const GatheredVertices<D>& gathered = workspace.gathered;
    if (gathered.Surrounds(point(v))) {
      const double nearest_sq = gathered.NearestSq(v, point(v), workspace.unit);
      if (nearest_sq <= gathered.ReachSq(point(v))) {
        return nearest_sq;
      }
    }
  }
  return NearestNeighbor(v, workspace).distance_sq;
}

// As ClippedVoronoi, where vertices may have been gathered around `v`.
template <int D>
void QueryStructure<D>::ClippedVoronoiByGathered(VertexId v, double radius, TieRule rule,
                                                 Workspace<D>& workspace) const {
  if constexpr (D <= 3) {
    const GatheredVertices<D>& gathered = workspace.gathered;
    Polytope<D>& cell = workspace.cell;
    if (gathered.Surrounds(point(v))) {
      Clip(v, box_of_cells_, CubeAround<D>(point(v), radius), rule, workspace);
      workspace.counters.vertices += cell.CutByGathered(gathered, v);
      if (!cell.IsTooLarge() && cell.CutLimitSq() > gathered.ReachSq(point(v))) {
        ScanBeyondGathered(v, workspace);
      } else {
        ++workspace.counters.queries;
      }
      CountCuts(workspace);
      // With ties that are kept it could depend on the order of the cuts, and thus on other queries.
      if (rule == TieRule::kPerturb || cell.counters().exact == 0) {
        cell.Place();
        return;
      }
    }
  }
  ClippedVoronoi(v, radius, workspace, rule);
}

template <int D>
void QueryStructure<D>::Voronoi(VertexId v, Workspace<D>& workspace) const {
  const double side = box_.LongestSide();
  Box<D> walls = box_;
  for (int i = 0; i < D; ++i) {
    walls.low[i] -= side;
    walls.high[i] += side;
  }
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kClip);
  workspace.cell.Reset(point(v), walls, kinds, TieRule::kPerturb);
  Scan(v, workspace);
  workspace.cell.Place();
}

// Calls cut(leaf) for the leaves from `own`, that of workspace.cell, outward, as far as any vertex in them may cut it.
template <int D>
template <typename Cut>
void QueryStructure<D>::ScanFor(NodeId own, Workspace<D>& workspace, Cut cut) const {
  const Polytope<D>& cell = workspace.cell;
  ScanOutward(
      cell.site(), own, workspace, [&] { return cell.IsTooLarge() ? -1 : cell.CutLimitSq(); },
      [&](NodeId leaf) { return cell.Reaches(tree_.BoxOf(leaf)); }, cut);
}

// Cuts workspace.cell, that of `v`, by the vertices in the leaves from that of v outward, and by others once by those
// in that one.
template <int D>
void QueryStructure<D>::Scan(VertexId v, Workspace<D>& workspace, const ExtraVertices<D>& others) const {
  const NodeId own = LeafOf(v);
  [[maybe_unused]] const bool has_segments = !tree_.segments().IsEmpty();
  workspace.segments.clear();
  if (has_segments) {
    workspace.seen_segments.resize(tree_.segments().count());
  }
  ScanFor(own, workspace, [&](NodeId leaf) {
    CutByLeaf(leaf, v, workspace);
    if constexpr (D == 2) {
      if (has_segments) {
        ListSegmentsOf(leaf, workspace);
      }
    }
    if (leaf == own) {
      CutByOthers(others, v, workspace);
    }
  });
  CountCuts(workspace);
}

// Cuts workspace.cell by the vertices in the leaves around that of `v` which have not been gathered.
template <int D>
void QueryStructure<D>::ScanBeyondGathered(VertexId v, Workspace<D>& workspace) const {
  Polytope<D>& cell = workspace.cell;
  ScanFor(LeafOf(v), workspace, [&](NodeId leaf) {
    const auto* inside = tree_.VerticesIn(leaf);
    for (uint32_t i = 0; inside != nullptr && i < inside->count && !cell.IsTooLarge(); ++i) {
      if (!workspace.gathered.Holds(inside->positions[i])) {
        ++workspace.counters.vertices;
        cell.CutBeforePlace(inside->ids[i], inside->positions[i]);
      }
    }
  });
}

template <int D>
void QueryStructure<D>::CountCuts(Workspace<D>& workspace) {
  workspace.counters.cuts += workspace.cell.cuts();
  workspace.counters.decisions.exact += workspace.cell.counters().exact;
  workspace.counters.decisions.perturbed += workspace.cell.counters().perturbed;
}

template <int D>
void QueryStructure<D>::CutByLeaf(NodeId leaf, VertexId site, Workspace<D>& workspace) const {
  if (const auto* inside = tree_.VerticesIn(leaf); inside != nullptr) {
    static_assert(D > 3 || (LeafTree<D>::kLeafCapacity <= kMostCutTogether &&
                            LeafTree<D>::VertexPool::kReadTogether >= kFloatLanes));
    workspace.counters.vertices += inside->count;
    workspace.cell.CutByEach({inside->positions, inside->count}, {.listed = inside->ids}, site);
  }
}

template <int D>
void QueryStructure<D>::CutByOthers(const ExtraVertices<D>& others, VertexId site, Workspace<D>& workspace) {
  Polytope<D>& cell = workspace.cell;
  others.ForEachRunNear(cell.site(), cell.CutLimitSq(), [&](std::span<const Point<D>> positions, VertexId first) {
    if (!cell.IsTooLarge()) {
      workspace.counters.vertices += cell.CutByEach(positions, {.first = first}, site);
    }
  });
}

#define WELLSPACE_INSTANTIATE(D) template class QueryStructure<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
