#include "core/simplex/simplices.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <mutex>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/simplex/facet_walk.h"
#include "core/simplex/simplex_list.h"

namespace wellspace::core {
namespace {

// Vertices whose cells make a block.
constexpr size_t kCellsInBlock = 512;
// Vertices that a walk takes at once: so many that few simplices lie on the border of two blocks, which both find them.
template <int D>
constexpr size_t kWalkedInBlock = D == 2 ? 4096 : 16384;

// The simplices of `block_count` blocks, which threads share out: append(block, scratch, out) appends those of one, with a Scratch of its
// thread, which takes scratch_bytes(scratch) besides what is in `held_bytes`.
template <int D, typename Scratch, typename Append, typename Bytes, typename Counters>
absl::StatusOr<Simplices> JoinBlocks(size_t block_count, uint64_t held_bytes, int threads, RunContext& context,
                                     Append append, Bytes scratch_bytes, Counters counters_of) {
  struct OfThread {
    Scratch scratch;
    uint64_t bytes = 0;
  };
  std::vector<SimplexList<D>> blocks(block_count);
  std::atomic<uint64_t> index_bytes{0};
  std::mutex mutex;
  absl::Status memory;  // guarded by mutex: the first refusal
  std::atomic<bool> is_refused{false};
  std::atomic<uint64_t> thread_bytes{0};
  tbb::enumerable_thread_specific<OfThread> of_threads;
  std::atomic<size_t> blocks_done{0};
  ThreadTeam team(threads);
  team.ForEach(blocks.size(), [&](size_t block) {
    if (context.IsCancelled() || is_refused.load(std::memory_order_relaxed)) {
      return;
    }
    OfThread& own = of_threads.local();
    append(block, own.scratch, blocks[block]);
    const uint64_t before = std::exchange(own.bytes, scratch_bytes(own.scratch));
    const uint64_t bytes =
        (thread_bytes += own.bytes - before) + (index_bytes += blocks[block].indices().size() * sizeof(uint32_t));
    if (absl::Status status = context.AllowMemory(held_bytes + bytes); !status.ok()) {
      std::lock_guard lock(mutex);
      memory.Update(std::move(status));
      is_refused = true;
    }
    context.AddSimplices(blocks[block].size());
    context.SetPhaseFraction(static_cast<double>(++blocks_done) / static_cast<double>(blocks.size()));
  });
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  WELLSPACE_RETURN_IF_ERROR(memory);
  // Once more, beside the blocks.
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(held_bytes + thread_bytes + 2 * index_bytes));

  Simplices all;
  all.indices.reserve(index_bytes / sizeof(uint32_t));
  for (SimplexList<D>& block : blocks) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    all.indices.insert(all.indices.end(), block.indices().begin(), block.indices().end());
    all.max_radius_edge = std::max(all.max_radius_edge, block.max_radius_edge());
    all.min_angle_deg = std::min(all.min_angle_deg, block.min_angle_deg());
    block.FreeIndices();
  }
  for (const OfThread& own : of_threads) {
    all.counters.Add(counters_of(own.scratch));
  }
  return all;
}

// What is held besides the simplices; of the scratch space, what every thread has for each node.
template <int D>
uint64_t HeldBytes(const QueryStructure<D>& structure, uint64_t array_bytes, int threads) {
  return structure.MemoryBytes() + array_bytes +
         static_cast<uint64_t>(threads) * structure.tree().node_count() * 2 * sizeof(uint32_t);
}

// Appends the simplices of the cell in `workspace` whose lowest vertex is its site `v` and whose other vertices are
// wanted.
template <int D, typename IsWanted>
void AppendCell(const QueryStructure<D>& structure, VertexId v, std::span<const uint32_t> output_index,
                const Workspace<D>& workspace, IsWanted is_wanted, SimplexList<D>& out) {
  for (const CellNode<D>& node : workspace.cell.nodes()) {
    Simplex<D> simplex;
    std::array<uint32_t, D + 1> indices;
    simplex[0] = structure.point(v);
    indices[0] = output_index[Index(v)];
    bool is_ours = true;
    for (int k = 0; k < D && is_ours; ++k) {
      const Plane<D>& plane = workspace.cell.plane(node.planes[k]);
      is_ours = plane.kind == PlaneKind::kBisector;
      if (is_ours) {
        simplex[k + 1] = structure.point(plane.vertex);
        indices[k + 1] = output_index[Index(plane.vertex)];
        is_ours = indices[k + 1] > indices[0] && is_wanted(plane.vertex);
      }
    }
    if (is_ours) {
      if (Orientation<D>(simplex).sign == Sign::kNegative) {
        std::swap(simplex[D - 1], simplex[D]);
        std::swap(indices[D - 1], indices[D]);
      }
      out.Add(simplex, indices, std::numeric_limits<double>::infinity());
    }
  }
}

// The simplices of the cells of `order` whose vertices are all wanted.
template <int D, typename IsWanted>
absl::StatusOr<Simplices> JoinCells(const QueryStructure<D>& structure, std::span<const VertexId> order,
                                    std::span<const uint32_t> output_index, IsWanted is_wanted, int threads,
                                    RunContext& context) {
  const auto append = [&](size_t block, Workspace<D>& workspace, SimplexList<D>& out) {
    const size_t begin = block * kCellsInBlock;
    for (const VertexId v : order.subspan(begin, std::min(kCellsInBlock, order.size() - begin))) {
      if (context.IsCancelled()) {
        return;
      }
      structure.Voronoi(v, workspace);
      AppendCell<D>(structure, v, output_index, workspace, is_wanted, out);
    }
  };
  return JoinBlocks<D, Workspace<D>>((order.size() + kCellsInBlock - 1) / kCellsInBlock,
                                     HeldBytes(structure, output_index.size_bytes() + order.size_bytes(), threads),
                                     threads, context, append, [](const Workspace<D>&) { return uint64_t{0}; },
                                     [](const Workspace<D>& workspace) { return workspace.counters; });
}

// The simplices of all vertices by walks from facet to facet.
template <int D>
absl::StatusOr<Simplices> JoinWalks(const QueryStructure<D>& structure, std::span<const uint32_t> output_index,
                                    int threads, RunContext& context) {
  std::vector<NodeId> leaves;
  std::vector<size_t> block_begin{0};
  size_t in_block = 0;
  structure.tree().ForEachLeaf([&](NodeId leaf) {
    const auto* bucket = structure.tree().BucketOf(leaf);
    if (bucket == nullptr || bucket->count == 0 || context.IsCancelled()) {
      return;
    }
    if (in_block >= kWalkedInBlock<D>) {
      block_begin.push_back(leaves.size());
      in_block = 0;
    }
    leaves.push_back(leaf);
    in_block += bucket->count;
  });
  block_begin.push_back(leaves.size());
  const auto append = [&](size_t block, FacetWalk<D>& walk, SimplexList<D>& out) {
    walk.AppendStars(structure,
                     std::span(leaves).subspan(block_begin[block], block_begin[block + 1] - block_begin[block]),
                     output_index, context, out);
  };
  return JoinBlocks<D, FacetWalk<D>>(
      block_begin.size() - 1, HeldBytes(structure, output_index.size_bytes() + leaves.size() * sizeof(NodeId), threads),
      threads, context, append, [](const FacetWalk<D>& walk) { return walk.MemoryBytes(); },
      [](const FacetWalk<D>& walk) { return walk.counters(); });
}

}  // namespace

template <int D>
absl::StatusOr<Simplices> ComputeSimplices(const QueryStructure<D>& structure, std::span<const uint32_t> output_index,
                                           int threads, RunContext& context) {
  if constexpr (D == 2) {
    return JoinWalks<D>(structure, output_index, threads, context);
  } else {
    std::vector<VertexId> order;
    order.reserve(structure.vertex_count());
    structure.tree().ForEachLeaf([&](NodeId leaf) {
      const auto* bucket = structure.tree().BucketOf(leaf);
      for (uint32_t i = 0; bucket != nullptr && i < bucket->count && !context.IsCancelled(); ++i) {
        order.push_back(bucket->ids[i]);
      }
    });
    return JoinCells<D>(
        structure, order, output_index, [](VertexId) { return true; }, threads, context);
  }
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
  return JoinCells<D>(
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
