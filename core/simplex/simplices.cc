#include "core/simplex/simplices.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "core/base/status_macros.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

constexpr size_t kBlockSize = 512;

// Appends the simplices of the cell in `workspace` whose lowest vertex is its site `v`.
template <int D>
void EmitStar(const QueryStructure<D>& structure, VertexId v, std::span<const uint32_t> output_index,
              const Workspace<D>& workspace, Simplices& out) {
  for (const CellNode<D>& node : workspace.cell.nodes()) {
    std::array<std::pair<uint32_t, VertexId>, D + 1> corners;
    corners[0] = {output_index[Index(v)], v};
    bool is_ours = true;
    for (int k = 0; k < D && is_ours; ++k) {
      const Plane<D>& plane = workspace.cell.plane(node.planes[k]);
      is_ours = plane.kind == PlaneKind::kBisector;
      if (is_ours) {
        corners[k + 1] = {output_index[Index(plane.vertex)], plane.vertex};
        is_ours = corners[k + 1].first > corners[0].first;
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

  std::vector<Simplices> blocks((order.size() + kBlockSize - 1) / kBlockSize);
  tbb::enumerable_thread_specific<Workspace<D>> workspaces;
  std::atomic<size_t> blocks_done{0};
  tbb::task_arena arena(std::min(threads, tbb::info::default_concurrency()));
  arena.execute([&] {
    tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t block) {
      Workspace<D>& workspace = workspaces.local();
      const size_t end = std::min(order.size(), (block + 1) * kBlockSize);
      for (size_t i = block * kBlockSize; i < end && !context.IsCancelled(); ++i) {
        structure.Voronoi(order[i], workspace);
        EmitStar<D>(structure, order[i], output_index, workspace, blocks[block]);
      }
      context.AddSimplices(blocks[block].indices.size() / (D + 1));
      context.SetPhaseFraction(static_cast<double>(++blocks_done) / static_cast<double>(blocks.size()));
    });
  });
  WELLSPACE_RETURN_IF_ERROR(context.Check());

  Simplices all;
  size_t size = 0;
  for (const Simplices& block : blocks) {
    size += block.indices.size();
  }
  all.indices.reserve(size);
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

template absl::StatusOr<Simplices> ComputeSimplices<2>(const QueryStructure<2>&, std::span<const uint32_t>, int,
                                                       RunContext&);
template absl::StatusOr<Simplices> ComputeSimplices<3>(const QueryStructure<3>&, std::span<const uint32_t>, int,
                                                       RunContext&);

}  // namespace wellspace::core
