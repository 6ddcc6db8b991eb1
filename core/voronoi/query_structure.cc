#include "core/voronoi/query_structure.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

namespace {

// Up to so many, items are sorted by comparing each with each.
constexpr size_t kMostRanked = 32;

// The first `count` of workspace.near, the nearest first, of those as near by slot, as they are in already.
template <int D>
std::span<const typename Workspace<D>::Near> SortByDistance(size_t count, Workspace<D>& workspace) {
  using Near = typename Workspace<D>::Near;
  auto& near = workspace.near;
  auto& sorted = workspace.sorted;
  if (count <= kMostRanked) {
    // The place of each is the number of those before it: comparisons without branches, of which half would be
    // mispredicted.
    std::array<uint32_t, kMostRanked> place{};
    for (size_t i = 1; i < count; ++i) {
      for (size_t j = 0; j < i; ++j) {
        const uint32_t is_later = near[j].distance_sq <= near[i].distance_sq ? 1 : 0;
        place[i] += is_later;
        place[j] += 1 - is_later;
      }
    }
    for (size_t i = 0; i < count; ++i) {
      sorted[place[i]] = near[i];
    }
  } else {
    std::copy_n(near.begin(), count, sorted.begin());
    std::sort(sorted.begin(), sorted.begin() + count, [](const Near& a, const Near& b) {
      return a.distance_sq != b.distance_sq ? a.distance_sq < b.distance_sq : a.slot < b.slot;
    });
  }
  return {sorted.data(), count};
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
absl::Status QueryStructure<D>::Initialize(const Box<D>& box, std::vector<Point<D>> points, uint64_t max_leaves,
                                           const RunContext& context) {
  box_ = box;
  points_ = std::move(points);
  WELLSPACE_RETURN_IF_ERROR(tree_.Build(box_, points_, max_leaves, context));
  faces_.clear();
  faces_.reserve(points_.size());
  std::array<bool, 1 << D> has_corner{};
  for (const Point<D>& p : points_) {
    const FaceMask faces = box_.FacesOf(p);
    faces_.push_back(faces);
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
  const VertexId v{vertex_count()};
  tree_.Insert(near, v, p);
  points_.push_back(p);
  faces_.push_back(box_.FacesOf(p));
  return v;
}

template <int D>
void QueryStructure<D>::MoveVertex(VertexId v, const Point<D>& p) {
  tree_.Move(v, p);
  points_[Index(v)] = p;
}

template <int D>
void QueryStructure<D>::BeginQuery(Workspace<D>& workspace) const {
  ++workspace.counters.queries;
  workspace.queue.clear();
  workspace.seen.resize(tree_.node_count(), 0);
  if (++workspace.query == 0) {
    std::fill(workspace.seen.begin(), workspace.seen.end(), 0);
    workspace.query = 1;
  }
}

template <int D>
bool QueryStructure<D>::MarkSeen(NodeId leaf, Workspace<D>& workspace) const {
  uint32_t& seen = workspace.seen[Index(leaf)];
  if (seen == workspace.query) {
    return false;
  }
  seen = workspace.query;
  return true;
}

template <int D>
template <typename ReachSq, typename Wants, typename Open>
void QueryStructure<D>::ScanOutward(const Point<D>& site, NodeId own, Workspace<D>& workspace, ReachSq reach_sq,
                                    Wants wants, Open open) const {
  using Candidate = typename Workspace<D>::Candidate;
  // A heap with the nearest leaf on top; of two as near, that of the lower number.
  const auto later = [](const Candidate& a, const Candidate& b) {
    return a.distance_sq != b.distance_sq ? a.distance_sq > b.distance_sq : Index(a.leaf) > Index(b.leaf);
  };
  BeginQuery(workspace);
  MarkSeen(own, workspace);
  workspace.queue.push_back({0, own});
  uint64_t leaves = 0;
  while (!workspace.queue.empty()) {
    std::pop_heap(workspace.queue.begin(), workspace.queue.end(), later);
    const Candidate nearest = workspace.queue.back();
    workspace.queue.pop_back();
    if (nearest.distance_sq > reach_sq()) {
      break;
    }
    if (nearest.leaf != own && !wants(nearest.leaf)) {
      continue;
    }
    ++leaves;
    open(nearest.leaf);
    const double limit_sq = reach_sq();
    tree_.ForEachFaceNeighbour(nearest.leaf, [&](NodeId beyond) {
      if (!MarkSeen(beyond, workspace)) {
        return;
      }
      const double distance_sq = DistanceSq<D>(site, tree_.BoxOf(beyond));
      if (distance_sq <= limit_sq) {
        workspace.queue.push_back({distance_sq, beyond});
        std::push_heap(workspace.queue.begin(), workspace.queue.end(), later);
      }
    });
  }
  workspace.counters.leaves += leaves;
  workspace.counters.max_leaves = std::max(workspace.counters.max_leaves, leaves);
}

template <int D>
Neighbor QueryStructure<D>::ApproximateNearestNeighbor(VertexId v, Workspace<D>& workspace) const {
  return Nearest(point(v), tree_.leaf_of(v), v, workspace);
}

template <int D>
Neighbor QueryStructure<D>::NearestTo(const Point<D>& p, VertexId near, Workspace<D>& workspace) const {
  return Nearest(p, tree_.LeafHolding(near, p), kNoVertex, workspace);
}

// The vertex other than `but` that is nearest to `p`, a point of `leaf`.
template <int D>
Neighbor QueryStructure<D>::Nearest(const Point<D>& p, NodeId leaf, VertexId but, Workspace<D>& workspace) const {
  Neighbor nearest{kNoVertex, std::numeric_limits<double>::infinity()};
  ScanOutward(
      p, leaf, workspace, [&] { return nearest.distance_sq; }, [](NodeId) { return true; },
      [&](NodeId opened) {
        const auto* bucket = tree_.BucketOf(opened);
        for (uint32_t i = 0; bucket != nullptr && i < bucket->count; ++i) {
          const double distance_sq = DistanceSq<D>(bucket->positions[i], p);
          if (distance_sq < nearest.distance_sq && bucket->ids[i] != but) {
            nearest = {bucket->ids[i], distance_sq};
          }
        }
      });
  return nearest;
}

template <int D>
void QueryStructure<D>::ClippedVoronoi(VertexId v, double radius, Workspace<D>& workspace) const {
  const Point<D>& site = point(v);
  std::array<PlaneKind, 2 * D> kinds;
  const Box<D> bounds = ClippedBox<D>(box_, site, radius, kinds);
  workspace.cell.Reset(site, bounds, kinds, TieRule::kKeep);
  Scan(v, workspace);
}

template <int D>
void QueryStructure<D>::Voronoi(VertexId v, Workspace<D>& workspace) const {
  const double side = box_.LongestSide();
  Box<D> bounds = box_;
  for (int i = 0; i < D; ++i) {
    bounds.low[i] -= side;
    bounds.high[i] += side;
  }
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kClip);
  workspace.cell.Reset(point(v), bounds, kinds, TieRule::kPerturb);
  Scan(v, workspace);
}

template <int D>
void QueryStructure<D>::Scan(VertexId v, Workspace<D>& workspace) const {
  ScanOutward(
      point(v), tree_.leaf_of(v), workspace, [&] { return workspace.cell.CutLimitSq(); },
      [&](NodeId leaf) { return workspace.cell.Reaches(tree_.BoxOf(leaf)); },
      [&](NodeId leaf) { CutByLeaf(v, leaf, workspace); });
  workspace.counters.cuts += workspace.cell.cuts();
  workspace.counters.decisions.exact += workspace.cell.counters().exact;
  workspace.counters.decisions.perturbed += workspace.cell.counters().perturbed;
}

// Cuts the cell by the vertices of a leaf, the nearest first: far ones then seldom cut.
template <int D>
void QueryStructure<D>::CutByLeaf(VertexId v, NodeId leaf, Workspace<D>& workspace) const {
  const auto* bucket = tree_.BucketOf(leaf);
  if (bucket == nullptr) {
    return;
  }
  workspace.counters.vertices += bucket->count;
  const Point<D> site = workspace.cell.site();
  const double limit_sq = workspace.cell.CutLimitSq();
  size_t count = 0;
  for (uint32_t i = 0; i < bucket->count; ++i) {
    const double distance_sq = DistanceSq<D>(bucket->positions[i], site);
    workspace.near[count] = {distance_sq, i};
    // No branch, since none could be foretold.
    count += static_cast<size_t>(distance_sq <= limit_sq) & static_cast<size_t>(bucket->ids[i] != v);
  }
  for (const auto& near : SortByDistance<D>(count, workspace)) {
    if (near.distance_sq > workspace.cell.CutLimitSq()) {
      break;
    }
    workspace.cell.Cut(bucket->ids[near.slot], bucket->positions[near.slot]);
  }
}

#define WELLSPACE_INSTANTIATE(D) template class QueryStructure<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
