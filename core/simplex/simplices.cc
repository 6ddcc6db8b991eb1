#include "core/simplex/simplices.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <map>
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
constexpr size_t kWalkedInBlock = D == 2 ? 4096 : 65536;
// About as many blocks, or more, are walked through, for as many threads.
constexpr size_t kLeastBlocks = 8;
// The array of all simplices has room for at most so many times those in it: the first blocks need not be like the others.
constexpr size_t kMostGrowth = 8;

// Joins the simplices of blocks, which come in any order, in that of the blocks, and sees to the memory that they take.
//
// Thread safety: thread-safe.
class BlockJoin {
 public:
  // `held_bytes`: what is held besides.
  BlockJoin(size_t block_count, uint64_t held_bytes, RunContext& context)
      : block_count_(block_count), held_bytes_(held_bytes), context_(context) {}

  // The next block to be made: the one that the others wait for first.
  size_t NextBlock() { return next_block_++; }
  // Whether the blocks that are to come are of no use.
  bool HasEnded() const { return context_.IsCancelled() || is_refused_; }

  // Takes the indices of the simplices of a block. `more_bytes`: what its thread holds more than at its last block.
  void Take(size_t block, const std::vector<uint32_t>& indices, uint64_t more_bytes) {
    std::lock_guard lock(mutex_);
    if (is_refused_) {
      return;
    }
    held_bytes_ += more_bytes;
    if (block != joined_count_) {
      waiting_size_ += indices.size();
      waiting_.emplace(block, indices);
      Allow(0);
    } else {
      Append(indices);
      for (auto next = waiting_.begin(); next != waiting_.end() && next->first == joined_count_;
           next = waiting_.erase(next)) {
        Append(next->second);
        waiting_size_ -= next->second.size();
      }
    }
    context_.SetPhaseFraction(static_cast<double>(joined_count_ + waiting_.size()) / static_cast<double>(block_count_));
  }

  // All of them, when the last block has been taken. Errors: that of the context, or RESOURCE_EXHAUSTED.
  absl::StatusOr<std::vector<uint32_t>> Finish() {
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    WELLSPACE_RETURN_IF_ERROR(memory_);
    return std::move(joined_);
  }

 private:
  void Append(const std::vector<uint32_t>& indices) {
    ++joined_count_;
    const size_t size = joined_.size() + indices.size();
    if (size > joined_.capacity()) {
      // As many as there will be if the blocks to come are like these, and a few more: what is not used takes no memory.
      Allow(joined_.size());
      if (is_refused_) {
        return;
      }
      const size_t to_come = size / joined_count_ * (block_count_ - joined_count_);
      joined_.reserve(std::min(kMostGrowth * size, size + to_come + (size + to_come) / 16));
    }
    joined_.insert(joined_.end(), indices.begin(), indices.end());
    Allow(0);
  }

  // Asks for what is held, and `more` indices.
  void Allow(size_t more) {
    const uint64_t bytes = held_bytes_ + (joined_.size() + waiting_size_ + more) * sizeof(uint32_t);
    if (absl::Status status = context_.AllowMemory(bytes); !status.ok()) {
      memory_.Update(std::move(status));
      is_refused_ = true;
    }
  }

  const size_t block_count_;
  uint64_t held_bytes_;  // this and all below but for the atomic ones: guarded by mutex_
  RunContext& context_;
  std::mutex mutex_;
  std::vector<uint32_t> joined_;
  size_t joined_count_ = 0;
  std::map<size_t, std::vector<uint32_t>> waiting_;  // by block
  size_t waiting_size_ = 0;
  absl::Status memory_;  // the first refusal
  std::atomic<bool> is_refused_{false};
  std::atomic<size_t> next_block_{0};
};

// The simplices of `block_count` blocks, which threads share out: append(block, scratch, out) appends those of one, with a Scratch of its
// thread, which takes scratch_bytes(scratch) besides what is in `held_bytes`.
template <int D, typename Scratch, typename Append, typename Bytes, typename Counters>
absl::StatusOr<Simplices> JoinBlocks(size_t block_count, uint64_t held_bytes, int threads, RunContext& context,
                                     Append append, Bytes scratch_bytes, Counters counters_of) {
  struct OfThread {
    Scratch scratch;
    SimplexList<D> list;
    uint64_t bytes = 0;
  };
  BlockJoin join(block_count, held_bytes, context);
  tbb::enumerable_thread_specific<OfThread> of_threads;
  ThreadTeam team(threads);
  team.ForEach(block_count, [&](size_t) {
    if (join.HasEnded()) {
      return;
    }
    const size_t block = join.NextBlock();
    OfThread& own = of_threads.local();
    own.list.Clear();
    append(block, own.scratch, own.list);
    const uint64_t before = std::exchange(own.bytes, scratch_bytes(own.scratch) + own.list.MemoryBytes());
    join.Take(block, own.list.indices(), own.bytes - before);
    context.AddSimplices(own.list.size());
  });

  Simplices all;
  WELLSPACE_ASSIGN_OR_RETURN(all.indices, join.Finish());
  for (const OfThread& own : of_threads) {
    all.max_radius_edge = std::max(all.max_radius_edge, own.list.max_radius_edge());
    all.min_angle_deg = std::min(all.min_angle_deg, own.list.min_angle_deg());
    all.counters.Add(counters_of(own.scratch));
  }
  return all;
}

// What is held besides the simplices; of the scratch space, what every thread has for each node.
template <int D>
uint64_t HeldBytes(const QueryStructure<D>& structure, std::span<const uint32_t> output_index, int threads) {
  return structure.MemoryBytes() + output_index.size_bytes() +
         static_cast<uint64_t>(ThreadTeam(threads).threads()) * structure.tree().node_count() * sizeof(uint32_t);
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

// The simplices of the cells of `order`, each of which compute(VertexId, Workspace&) computes, whose vertices are all wanted.
template <int D, typename Compute, typename IsWanted>
absl::StatusOr<Simplices> JoinCells(const QueryStructure<D>& structure, std::span<const VertexId> order,
                                    std::span<const uint32_t> output_index, Compute compute, IsWanted is_wanted,
                                    uint64_t held_bytes, int threads, RunContext& context) {
  const auto append = [&](size_t block, Workspace<D>& workspace, SimplexList<D>& out) {
    const size_t begin = block * kCellsInBlock;
    for (const VertexId v : order.subspan(begin, std::min(kCellsInBlock, order.size() - begin))) {
      if (context.IsCancelled()) {
        return;
      }
      compute(v, workspace);
      AppendCell<D>(structure, v, output_index, workspace, is_wanted, out);
    }
  };
  return JoinBlocks<D, Workspace<D>>((order.size() + kCellsInBlock - 1) / kCellsInBlock,
                                     held_bytes + order.size_bytes(), threads, context, append,
                                     [](const Workspace<D>&) { return uint64_t{0}; },
                                     [](const Workspace<D>& workspace) { return workspace.counters; });
}

// The simplices of all vertices by walks from facet to facet.
template <int D>
absl::StatusOr<Simplices> JoinWalks(const QueryStructure<D>& structure, const NeighbourTable& neighbours,
                                    std::span<const uint32_t> output_index, int threads, RunContext& context) {
  std::vector<NodeId> leaves;
  std::vector<size_t> block_begin{0};
  const size_t most = std::min(kWalkedInBlock<D>, structure.vertex_count() / kLeastBlocks);
  size_t in_block = 0;
  std::vector<uint32_t> rank(structure.vertex_count());
  uint32_t ranked = 0;
  structure.tree().ForEachLeaf([&](NodeId leaf) {
    const auto* bucket = structure.tree().BucketOf(leaf);
    if (bucket == nullptr || bucket->count == 0 || context.IsCancelled()) {
      return;
    }
    if (in_block >= most && in_block > 0) {
      block_begin.push_back(leaves.size());
      in_block = 0;
    }
    leaves.push_back(leaf);
    in_block += bucket->count;
    for (uint32_t i = 0; i < bucket->count; ++i) {
      rank[Index(bucket->ids[i])] = ranked++;
    }
  });
  block_begin.push_back(leaves.size());
  const auto append = [&](size_t block, FacetWalk<D>& walk, SimplexList<D>& out) {
    walk.AppendStars(structure, neighbours,
                     std::span(leaves).subspan(block_begin[block], block_begin[block + 1] - block_begin[block]), rank,
                     output_index, context, out);
  };
  return JoinBlocks<D, FacetWalk<D>>(
      block_begin.size() - 1,
      HeldBytes<D>(structure, output_index, threads) + neighbours.MemoryBytes() + leaves.size() * sizeof(NodeId) +
          rank.size() * sizeof(uint32_t),
      threads, context, append, [](const FacetWalk<D>& walk) { return walk.MemoryBytes(); },
      [](const FacetWalk<D>& walk) { return walk.counters(); });
}

}  // namespace

template <int D>
absl::StatusOr<Simplices> ComputeSimplices(const QueryStructure<D>& structure, const NeighbourLists& neighbours,
                                           std::span<const uint32_t> output_index, int threads, RunContext& context) {
  // The table takes less than the lists.
  WELLSPACE_RETURN_IF_ERROR(
      context.AllowMemory(HeldBytes<D>(structure, output_index, threads) + 2 * neighbours.MemoryBytes()));
  WELLSPACE_ASSIGN_OR_RETURN(const NeighbourTable table,
                             NeighbourTable::Of(neighbours, structure.vertex_count(), context));
  if constexpr (D <= 3) {
    return JoinWalks<D>(structure, table, output_index, threads, context);
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
        structure, order, output_index,
        [&](VertexId v, Workspace<D>& workspace) { structure.VoronoiAmong(v, table, workspace); },
        [](VertexId) { return true; }, HeldBytes<D>(structure, output_index, threads) + table.MemoryBytes(), threads,
        context);
  }
}

template <int D>
absl::StatusOr<std::vector<VertexId>> ChangedVertices(const QueryStructure<D>& structure, VertexId first_new,
                                                      const RunContext& context) {
  std::vector<VertexId> changed;
  std::vector<VertexId> neighbours;
  Workspace<D> workspace;
  for (uint32_t i = Index(first_new); i < structure.vertex_count(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    changed.push_back(VertexId{i});
    structure.Voronoi(VertexId{i}, workspace);
    workspace.cell.Neighbours(neighbours);
    changed.insert(changed.end(), neighbours.begin(), neighbours.end());
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
      structure, vertices, output_index, [&](VertexId v, Workspace<D>& workspace) { structure.Voronoi(v, workspace); },
      [&](VertexId v) { return is_among[Index(v)]; }, HeldBytes<D>(structure, output_index, threads), threads, context);
}

#define WELLSPACE_INSTANTIATE(D)                                                                                   \
  template absl::StatusOr<Simplices> ComputeSimplices<D>(const QueryStructure<D>&, const NeighbourLists&,          \
                                                         std::span<const uint32_t>, int, RunContext&);             \
  template absl::StatusOr<std::vector<VertexId>> ChangedVertices<D>(const QueryStructure<D>&, VertexId,            \
                                                                    const RunContext&);                            \
  template absl::StatusOr<Simplices> ComputeSimplicesAmong<D>(const QueryStructure<D>&, std::span<const VertexId>, \
                                                              std::span<const uint32_t>, int, RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
