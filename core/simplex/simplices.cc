#include "core/simplex/simplices.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

constexpr size_t kBlockSize = 512;

// Appends the simplices of the cell in `workspace` whose lowest vertex is its site `v` and whose other vertices are
// wanted.
template <int D, typename IsWanted>
void EmitStar(const QueryStructure<D>& structure, VertexId v, std::span<const uint32_t> output_index,
              const Workspace<D>& workspace, IsWanted is_wanted, Simplices& out) {
  for (const CellNode<D>& node : workspace.cell.nodes()) {
    std::array<std::pair<uint32_t, VertexId>, D + 1> corners;
    corners[0] = {output_index[Index(v)], v};
    bool is_ours = true;
    for (int k = 0; k < D && is_ours; ++k) {
      const Plane<D>& plane = workspace.cell.plane(node.planes[k]);
      is_ours = plane.kind == PlaneKind::kBisector;
      if (is_ours) {
        corners[k + 1] = {output_index[Index(plane.vertex)], plane.vertex};
        is_ours = corners[k + 1].first > corners[0].first && is_wanted(plane.vertex);
      }
    }
    if (!is_ours) {
      continue;
    }
    std::sort(corners.begin() + 1, corners.end());
    Simplex<D> simplex;
    for (int k = 0; k <= D; ++k) {
      simplex[k] = structure.point(corners[k].second);
    }
    if (Orientation<D>(simplex).sign == Sign::kNegative) {
      std::swap(corners[D - 1], corners[D]);
    }
    for (const auto& [index, vertex] : corners) {
      out.indices.push_back(index);
    }
    out.max_radius_edge = std::max(out.max_radius_edge, RadiusEdgeRatio<D>(simplex));
    out.min_angle_deg = std::min(out.min_angle_deg, Angles<D>(simplex).min_deg);
  }
}

// The simplices of the stars of `order` whose vertices are all wanted, in blocks that threads share out.
template <int D, typename IsWanted>
absl::StatusOr<Simplices> ComputeStars(const QueryStructure<D>& structure, std::span<const VertexId> order,
                                       std::span<const uint32_t> output_index, IsWanted is_wanted, int threads,
                                       RunContext& context) {
  std::vector<Simplices> blocks((order.size() + kBlockSize - 1) / kBlockSize);
  // What is held besides the indices; of the scratch space, the marks by node count.
  const uint64_t held_bytes = structure.MemoryBytes() + output_index.size_bytes() + order.size_bytes() +
                              static_cast<uint64_t>(threads) * structure.tree().node_count() * sizeof(uint32_t);
  std::atomic<uint64_t> index_bytes{0};
  std::mutex mutex;
  absl::Status memory;  // guarded by mutex: the first refusal
  std::atomic<bool> is_refused{false};
  tbb::enumerable_thread_specific<Workspace<D>> workspaces;
  std::atomic<size_t> blocks_done{0};
  ThreadTeam team(threads);
  team.ForEach(blocks.size(), [&](size_t block) {
    Workspace<D>& workspace = workspaces.local();
    const size_t end = std::min(order.size(), (block + 1) * kBlockSize);
    for (size_t i = block * kBlockSize;
         i < end && !context.IsCancelled() && !is_refused.load(std::memory_order_relaxed); ++i) {
      structure.Voronoi(order[i], workspace);
      EmitStar<D>(structure, order[i], output_index, workspace, is_wanted, blocks[block]);
    }
    const uint64_t bytes = blocks[block].indices.size() * sizeof(uint32_t);
    if (absl::Status status = context.AllowMemory(held_bytes + (index_bytes += bytes)); !status.ok()) {
      std::lock_guard lock(mutex);
      memory.Update(std::move(status));
      is_refused = true;
    }
    context.AddSimplices(blocks[block].indices.size() / (D + 1));
    context.SetPhaseFraction(static_cast<double>(++blocks_done) / static_cast<double>(blocks.size()));
  });
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  WELLSPACE_RETURN_IF_ERROR(memory);
  // Once more, beside the blocks.
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(held_bytes + 2 * index_bytes));

  Simplices all;
  all.indices.reserve(index_bytes / sizeof(uint32_t));
  for (Simplices& block : blocks) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    all.indices.insert(all.indices.end(), block.indices.begin(), block.indices.end());
    all.max_radius_edge = std::max(all.max_radius_edge, block.max_radius_edge);
    all.min_angle_deg = std::min(all.min_angle_deg, block.min_angle_deg);
    block.indices = {};
  }
  for (const Workspace<D>& workspace : workspaces) {
    all.counters.Add(workspace.counters);
  }
  return all;
}

}  // namespace

template <int D>
absl::StatusOr<Simplices> ComputeSimplices(const QueryStructure<D>& structure, std::span<const uint32_t> output_index,
                                           int threads, RunContext& context) {
  std::vector<VertexId> order;
  order.reserve(structure.vertex_count());
  structure.tree().ForEachLeaf([&](NodeId leaf) {
    const auto* bucket = structure.tree().BucketOf(leaf);
    for (uint32_t i = 0; bucket != nullptr && i < bucket->count && !context.IsCancelled(); ++i) {
      order.push_back(bucket->ids[i]);
    }
  });
  return ComputeStars<D>(
      structure, order, output_index, [](VertexId) { return true; }, threads, context);
}

template <int D>
absl::StatusOr<std::vector<VertexId>> ChangedVertices(const QueryStructure<D>& structure, VertexId first_new,
                                                      const RunContext& context) {
  std::vector<VertexId> changed;
  Workspace<D> workspace;
  for (uint32_t i = Index(first_new); i < structure.vertex_count(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    changed.push_back(VertexId{i});
    structure.Voronoi(VertexId{i}, workspace);
    for (const CellNode<D>& node : workspace.cell.nodes()) {
      for (const uint16_t index : node.planes) {
        if (workspace.cell.plane(index).kind == PlaneKind::kBisector) {
          changed.push_back(workspace.cell.plane(index).vertex);
        }
      }
    }
  }
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  return changed;
}

template <int D>
absl::StatusOr<Simplices> ComputeSimplicesAmong(const QueryStructure<D>& structure, std::span<const VertexId> vertices,
                                                std::span<const uint32_t> output_index, int threads,
                                                RunContext& context) {
  std::vector<bool> is_among(structure.vertex_count(), false);
  for (const VertexId v : vertices) {
    is_among[Index(v)] = true;
  }
  return ComputeStars<D>(
      structure, vertices, output_index, [&](VertexId v) { return is_among[Index(v)]; }, threads, context);
}

#define WELLSPACE_INSTANTIATE(D)                                                                                   \
  template absl::StatusOr<Simplices> ComputeSimplices<D>(const QueryStructure<D>&, std::span<const uint32_t>, int, \
                                                         RunContext&);                                             \
  template absl::StatusOr<std::vector<VertexId>> ChangedVertices<D>(const QueryStructure<D>&, VertexId,            \
                                                                    const RunContext&);                            \
  template absl::StatusOr<Simplices> ComputeSimplicesAmong<D>(const QueryStructure<D>&, std::span<const VertexId>, \
                                                              std::span<const uint32_t>, int, RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
