#include "core/voronoi/query_structure.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/voronoi/lanes.h"

namespace wellspace::core {

namespace {

// Asks for the vertices in a leaf that will soon be looked at: the first lines of a cache hold most of them.
template <int D>
void Prefetch(const LeafTree<D>& tree, NodeId leaf) {
  constexpr size_t kLine = 64;
  constexpr size_t kLines = 4;
  if (const auto* bucket = tree.BucketOf(leaf); bucket != nullptr) {
    const char* const positions = reinterpret_cast<const char*>(bucket->positions);
    for (size_t line = 0; line < kLines; ++line) {
      __builtin_prefetch(positions + line * kLine);
    }
    __builtin_prefetch(bucket->ids);
  }
}

// DistanceSq of `p` and the cube of a node, two axes at a time.
template <int D>
WELLSPACE_INLINE double DistanceSqTo(const LeafTree<D>& tree, NodeId node, const Point<D>& p) {
  using Pair = Wide<2>::Lanes;
  const double side = tree.SideOf(node);
  const Point<D>& low = tree.LowOf(node);
  double distance_sq = 0;
  for (int axis = 0; axis < D; axis += 2) {
    const bool is_pair = axis + 1 < D;
    const Pair at = {p[axis], is_pair ? p[axis + 1] : 0};
    const Pair least = {low[axis], is_pair ? low[axis + 1] : 0};
    const Pair most = least + (is_pair ? Pair{side, side} : Pair{side, 0});
    const Pair below = least - at;
    const Pair above = at - most;
    Pair away = below > above ? below : above;
    away = away > 0 ? away : Pair{};
    const Pair away_sq = away * away;
    distance_sq += away_sq[0];
    if (is_pair) {
      distance_sq += away_sq[1];
    }
  }
  return distance_sq;
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
                                           const RunContext& context) {
  box_ = grid.box();
  points_ = std::move(points);
  WELLSPACE_RETURN_IF_ERROR(tree_.Build(grid, points_, max_leaves, context));
  vertex_count_ = static_cast<uint32_t>(points_.size());
  faces_.clear();
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
  for (int corner = 0; corner < (1 << D); ++corner) {
    if (!has_corner[corner]) {
      Point<D> p;
      for (int i = 0; i < D; ++i) {
        p[i] = box_.FaceCoordinate(FaceIndex(i, ((corner >> i) & 1) != 0));
      }
      AddVertex(kNoVertex, p);
    }
  }
  return absl::OkStatus();
}

template <int D>
VertexId QueryStructure<D>::AddVertex(VertexId near, const Point<D>& p) {
  const VertexId v = AddWaiting(near, p);
  AdmitWaiting();
  return v;
}

template <int D>
VertexId QueryStructure<D>::AddWaiting(VertexId near, const Point<D>& p) {
  const VertexId v{vertex_count_};
  points_[vertex_count_] = p;
  faces_[vertex_count_] = static_cast<StoredFaces>(box_.FacesOf(p));
  ++vertex_count_;
  near_.push_back(near);
  return v;
}

template <int D>
void QueryStructure<D>::AdmitWaiting() {
  for (const VertexId near : near_) {
    const VertexId v{tree_.vertex_count()};
    tree_.Insert(near, v, point(v));
  }
  near_.clear();
  MakeRoom();
}

template <int D>
void QueryStructure<D>::MakeRoom() {
  const size_t needed = vertex_count_ + kMostWaiting;
  if (points_.size() < needed) {
    points_.resize(needed + kMostWaiting);
    faces_.resize(needed + kMostWaiting);
  }
}

template <int D>
void QueryStructure<D>::CutByWaiting(VertexId v, Polytope<D>& cell) const {
  for (uint32_t u = tree_.vertex_count(); u < vertex_count_ && !cell.IsTooLarge(); ++u) {
    if (VertexId{u} != v) {
      cell.CutBeforePlace(VertexId{u}, points_[u]);
    }
  }
}

// `near`, or what it was added near to if it waits.
template <int D>
VertexId QueryStructure<D>::Admitted(VertexId near) const {
  while (near != kNoVertex && Index(near) >= tree_.vertex_count()) {
    near = near_[Index(near) - tree_.vertex_count()];
  }
  return near;
}

// The leaf that `v` lies in; of one that waits, walked to.
template <int D>
NodeId QueryStructure<D>::LeafOf(VertexId v) const {
  const VertexId admitted = Admitted(v);
  return admitted == v ? tree_.leaf_of(v) : tree_.LeafHolding(admitted, point(v));
}

template <int D>
void QueryStructure<D>::MoveVertex(VertexId v, const Point<D>& p) {
  tree_.Move(v, p);
  points_[Index(v)] = p;
}

template <int D>
void QueryStructure<D>::BeginQuery(Workspace<D>& workspace) const {
  ++workspace.counters.queries;
  workspace.seen.resize(tree_.node_count(), 0);
  if (++workspace.query == 0) {
    std::fill(workspace.seen.begin(), workspace.seen.end(), 0);
    workspace.query = 1;
  }
}

template <int D>
template <typename ReachSq, typename Wants, typename Open>
void QueryStructure<D>::ScanOutward(const Point<D>& site, NodeId own, Workspace<D>& workspace, ReachSq reach_sq,
                                    Wants wants, Open open) const {
  Prefetch<D>(tree_, own);
  BeginQuery(workspace);
  uint32_t* const seen = workspace.seen.data();
  seen[Index(own)] = workspace.query;
  LeafQueue& queue = workspace.queue;
  queue.Begin(tree_.SideOf(own));
  queue.Reserve(1);
  queue.PushIf(true, 0, own);
  uint64_t leaves = 0;
  while (!queue.IsEmpty()) {
    const LeafQueue::Entry next = queue.Pop();
    if (next.distance_sq > reach_sq() || (next.leaf != own && !wants(next.leaf))) {
      continue;
    }
    ++leaves;
    open(next.leaf);
    const double limit_sq = reach_sq();
    queue.Reserve(LeafTree<D>::kMostFaceNeighbours + 1);
    const uint32_t old_end = queue.end();
    const auto meet = [&](NodeId beyond) __attribute__((always_inline)) {
      // No branch, since none could be foretold.
      const bool is_new = seen[Index(beyond)] != workspace.query;
      seen[Index(beyond)] = workspace.query;
      const double distance_sq = DistanceSqTo<D>(tree_, beyond, site);
      queue.PushIf(is_new & (distance_sq <= limit_sq), distance_sq, beyond);
    };
    if constexpr (D == 2) {
      tree_.ForEachFaceNeighbour(next.leaf, meet);  // few more
    } else {
      // Whoever is within reach is so by leaves that are, too: those on the straight line from the site.
      tree_.ForEachFaceNeighbourAwayFrom(site, next.leaf, meet);
    }
    for (uint32_t i = old_end; i < queue.end(); ++i) {
      Prefetch<D>(tree_, queue.leaf(i));
    }
  }
  workspace.counters.leaves += leaves;
  workspace.counters.max_leaves = std::max(workspace.counters.max_leaves, leaves);
}

template <int D>
Neighbor QueryStructure<D>::ApproximateNearestNeighbor(VertexId v, Workspace<D>& workspace) const {
  return NearestWithin(v, std::numeric_limits<double>::infinity(), workspace);
}

template <int D>
Neighbor QueryStructure<D>::NearestWithin(VertexId v, double limit_sq, Workspace<D>& workspace) const {
  return Nearest(point(v), LeafOf(v), v, limit_sq, workspace);
}

template <int D>
Neighbor QueryStructure<D>::NearestTo(const Point<D>& p, VertexId near, Workspace<D>& workspace) const {
  return Nearest(p, tree_.LeafHolding(Admitted(near), p), kNoVertex, std::numeric_limits<double>::infinity(),
                 workspace);
}

// The vertex other than `but` that is nearest to `p`, a point of `leaf`, and nearer than the limit.
template <int D>
Neighbor QueryStructure<D>::Nearest(const Point<D>& p, NodeId leaf, VertexId but, double limit_sq,
                                    Workspace<D>& workspace) const {
  Neighbor nearest{kNoVertex, limit_sq};
  const auto look_into = [&](NodeId opened) {
    const auto* bucket = tree_.BucketOf(opened);
    for (uint32_t i = 0; bucket != nullptr && i < bucket->count; ++i) {
      const double distance_sq = DistanceSq<D>(bucket->positions[i], p);
      if (distance_sq < nearest.distance_sq && bucket->ids[i] != but) {
        nearest = {bucket->ids[i], distance_sq};
      }
    }
  };
  look_into(leaf);
  if (!LiesDeeperThan<D>(p, nearest.distance_sq, tree_.BoxOf(leaf))) {
    ScanOutward(
        p, leaf, workspace, [&] { return nearest.distance_sq; }, [](NodeId) { return true; },
        [&](NodeId opened) {
          if (opened != leaf) {
            look_into(opened);
          }
        });
  }
  return nearest;
}

template <int D>
void QueryStructure<D>::ClippedVoronoi(VertexId v, double radius, Workspace<D>& workspace, TieRule rule) const {
  ClipAndScan(v, radius, rule, workspace);
  workspace.cell.Place();
}

template <int D>
void QueryStructure<D>::UnplacedClippedVoronoi(VertexId v, double radius, Workspace<D>& workspace,
                                               std::span<const Point<D>> others, VertexId first_other) const {
  ClipAndScan(v, radius, TieRule::kPerturb, workspace, others, first_other);
}

// Computes the clipped cell of vertex `v`.
template <int D>
void QueryStructure<D>::ClipAndScan(VertexId v, double radius, TieRule rule, Workspace<D>& workspace,
                                    std::span<const Point<D>> others, VertexId first_other) const {
  std::array<PlaneKind, 2 * D> kinds;
  const Box<D> bounds = ClippedBox<D>(box_, point(v), radius, kinds);
  workspace.cell.Reset(point(v), bounds, kinds, rule);
  Scan(v, workspace, others, first_other);
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

// Cuts workspace.cell, that of `v`, by the vertices in the leaves from that of v outward, and by others once by those in that one.
template <int D>
void QueryStructure<D>::Scan(VertexId v, Workspace<D>& workspace, std::span<const Point<D>> others,
                             VertexId first_other) const {
  const NodeId own = LeafOf(v);
  ScanOutward(
      workspace.cell.site(), own, workspace,
      [&] { return workspace.cell.IsTooLarge() ? -1 : workspace.cell.CutLimitSq(); },
      [&](NodeId leaf) { return workspace.cell.Reaches(tree_.BoxOf(leaf)); },
      [&](NodeId leaf) {
        CutByLeaf(leaf, v, workspace);
        if (leaf == own) {
          CutByOthers(others, first_other, v, workspace);
        }
      });
  CountCuts(workspace);
}

template <int D>
void QueryStructure<D>::CountCuts(Workspace<D>& workspace) {
  workspace.counters.cuts += workspace.cell.cuts();
  workspace.counters.decisions.exact += workspace.cell.counters().exact;
  workspace.counters.decisions.perturbed += workspace.cell.counters().perturbed;
}

template <int D>
void QueryStructure<D>::CutByLeaf(NodeId leaf, VertexId site, Workspace<D>& workspace) const {
  if (const auto* bucket = tree_.BucketOf(leaf); bucket != nullptr) {
    static_assert(D > 3 || (LeafTree<D>::kLeafCapacity <= kMostCutTogether &&
                            LeafTree<D>::Buckets::kReadTogether >= kFloatLanes));
    workspace.counters.vertices += bucket->count;
    workspace.cell.CutByEach({bucket->positions, bucket->count}, {.listed = bucket->ids}, site);
  }
}

template <int D>
void QueryStructure<D>::CutByOthers(std::span<const Point<D>> others, VertexId first_other, VertexId site,
                                    Workspace<D>& workspace) {
  constexpr size_t kTogether = LeafTree<D>::kLeafCapacity;
  for (size_t begin = 0; begin < others.size() && !workspace.cell.IsTooLarge(); begin += kTogether) {
    const VertexNames names{.first = VertexId{static_cast<uint32_t>(Index(first_other) + begin)}};
    workspace.counters.vertices +=
        workspace.cell.CutByEach(others.subspan(begin, std::min(kTogether, others.size() - begin)), names, site);
  }
}

#define WELLSPACE_INSTANTIATE(D) template class QueryStructure<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
