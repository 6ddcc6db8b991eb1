#include "core/refine/pending_vertices.h"

#include <array>
#include <cstddef>

#include "core/base/dimensions.h"
#include "core/base/memory/cache_lines.h"
#include "core/base/thread_team.h"
#include "core/tree/leaf_blocks.h"

namespace wellspace::core {
namespace {

// Vertices whose first edges one thread looks for at a time.
constexpr size_t kScheduledTogether = 1024;

template <int D>
struct alignas(kCacheLines) WorkspaceOfThread : Workspace<D> {};

}  // namespace

template <int D>
HugeVector<int16_t> PendingVertices<D>::FirstBuckets(const MeshCriteria<D>& criteria, const RunContext& context,
                                                     ThreadTeam& team, const FeatureDistance<D>& feature_sq) const {
  std::vector<WorkspaceOfThread<D>> workspaces(team.threads());
  HugeVector<int16_t> first_buckets(structure_.vertex_count());
  const LeafBlocks<D> blocks(structure_.tree(), kScheduledTogether);
  team.ForEach(blocks.count(), [&](size_t block) {
    Workspace<D>& workspace = workspaces[ThreadTeam::CurrentThread()];
    std::array<double, LeafTree<D>::kLeafCapacity> nearest_sq;
    blocks.ForEachLeafOf(block, [&](const typename LeafTree<D>::LeafVertices& inside, NodeId leaf) {
      if (context.IsCancelled()) {
        return;
      }
      structure_.NearestOfEach(leaf, workspace, std::span(nearest_sq).first(inside.count));
      for (uint32_t i = 0; i < inside.count; ++i) {
        const VertexId v = inside.ids[i];
        if (feature_sq) {
          nearest_sq[i] = feature_sq(v, nearest_sq[i], workspace);
        }
        // A node x farther from v than h(x) is farther than h(v) / 2, as h is 1-Lipschitz.
        first_buckets[Index(v)] = static_cast<int16_t>(
            schedule_.BucketOf(FirstEdgeSq(criteria, structure_.point(v), structure_.faces(v), nearest_sq[i],
                                           criteria.sizes.AtSq(structure_.point(v)) / 4)));
      }
    });
  });
  return first_buckets;
}

template <int D>
void PendingVertices<D>::Reserve(uint32_t vertices) {
  schedule_.Reserve(vertices);
  memos_.reserve(vertices);
  notified_.reserve(vertices);
}

template <int D>
void PendingVertices<D>::Begin(const MeshCriteria<D>& criteria, std::span<const int16_t> first_buckets) {
  const auto count = static_cast<uint32_t>(first_buckets.size());
  memos_.assign(count, {});
  watchers_.Clear();
  notified_.assign(count, Notified::kAll);
  schedule_.Begin(count);
  for (uint32_t i = 0; i < count; ++i) {
    schedule_.AddToBucket(VertexId{i}, first_buckets[i]);
  }
  criteria_ = criteria;
}

// No edge shorter than this can have a bad node in the cell of a vertex at `p`: the distance to the nearest neighbour,
// or to a face of the box that p is not on; or the edge that stands for a size, if the least size that counts is as it
// says.
template <int D>
double PendingVertices<D>::FirstEdgeSq(const MeshCriteria<D>& criteria, const Point<D>& p, FaceMask faces,
                                       double nearest_sq, double size_sq) const {
  double first_sq = nearest_sq;
  for (int face = 0; face < 2 * D; ++face) {
    if (((faces >> face) & 1) == 0) {
      const double distance = structure_.box().DistanceToFace(p, face);
      first_sq = std::min(first_sq, distance * distance);
    }
  }
  return std::min(first_sq, size_sq / (criteria.rho * criteria.rho));
}

template <int D>
void PendingVertices<D>::Notify(VertexId v, const Assessment& found, std::span<const NeighborNotice> notices) {
  const bool is_first = IsNew(v);
  notified_[Index(v)] = found.is_clipped ? Notified::kWithinClip : Notified::kAll;
  const double rho_sq = criteria_->rho * criteria_->rho;
  const bool is_well_spaced = criteria_->criterion == Criterion::kWellSpaced;
  for (const auto& [u, edge_sq, is_on_boundary] : notices) {
    if (!is_first && schedule_.IsPending(u)) {
      continue;
    }
    const CellMemo memo = memos_[Index(u)];
    const bool was_cut = memo.HasBoundaryEdge() && is_on_boundary;
    const bool is_too_far = is_well_spaced && memo.MayReachBeyond(rho_sq * edge_sq);
    if (was_cut || is_too_far) {
      Collect(u, edge_sq);
    }
  }
  ScheduleCollected();
}

template <int D>
void PendingVertices<D>::Postpone(VertexId v, const Assessment& found, int bucket) {
  SetMemo(v, {});
  schedule_.AddToBucket(v,
                        found.bad_node >= 0 ? std::min(bucket, schedule_.BucketOf(EdgeSqOf(found.bound_sq))) : bucket);
}

template <int D>
void PendingVertices<D>::Remember(VertexId v, const Assessment& found, std::span<const WatchedNode<D>> watched) {
  if (found.own_boundary_edge_sq != Assessment::kNone) {
    SetMemo(v, CellMemo::OfBoundaryEdge(found.own_boundary_edge_sq), watched);
  } else {
    SetMemo(v, found.IsGood() ? CellMemo::OfRadius(found.radius_sq) : CellMemo());
  }
}

template <int D>
void PendingVertices<D>::ScheduleLater(VertexId v, const Assessment& found, int bucket, double clip_radius) {
  double next_sq = found.next_edge_sq;
  if (found.is_clipped) {
    // Beyond the clip only edges longer than this can be bad, or ones that share a node with a shorter edge.
    next_sq = std::min(next_sq, EdgeSqOf(clip_radius * clip_radius));
  }
  schedule_.AddToBucket(v, std::max(schedule_.BucketOf(next_sq), bucket + 1));
}

template <int D>
void PendingVertices<D>::CellChanged(VertexId v, double nearest_sq) {
  memos_.resize(structure_.vertex_count());
  notified_.resize(structure_.vertex_count(), Notified::kAll);
  const bool is_on_face = structure_.faces(v) != 0;
  SetMemo(v, is_on_face ? CellMemo::OfBoundaryEdge(nearest_sq) : CellMemo());
  if (is_on_face && criteria_->criterion == Criterion::kWellSpaced) {
    schedule_.Add(v, nearest_sq);  // the memo for the faces leaves no room for the radius
  }
}

template <int D>
void PendingVertices<D>::SetMemo(VertexId v, CellMemo memo, std::span<const WatchedNode<D>> watched) {
  if (memos_[Index(v)].HasBoundaryEdge()) {
    watchers_.Remove(v);
  }
  memos_[Index(v)] = memo;
  if (memo.HasBoundaryEdge()) {
    watchers_.Add(v, watched);
  }
}

// Has ScheduleCollected schedule `u`, for the edge of that squared length, or for a shorter one of its memo.
template <int D>
void PendingVertices<D>::Collect(VertexId u, double edge_sq) {
  const CellMemo memo = memos_[Index(u)];
  collected_.emplace_back(u, memo.HasBoundaryEdge() ? std::min(memo.boundary_edge_sq(), edge_sq) : edge_sq);
}

template <int D>
void PendingVertices<D>::ScheduleCollected() {
  std::sort(collected_.begin(), collected_.end());  // later steps are to depend on nothing but the cell
  for (const auto& [u, edge_sq] : collected_) {
    SetMemo(u, {});
    schedule_.Add(u, edge_sq);
  }
  collected_.clear();
}

#define WELLSPACE_INSTANTIATE(D) template class PendingVertices<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
