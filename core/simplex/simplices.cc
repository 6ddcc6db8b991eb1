#include "core/simplex/simplices.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/memory/prefetch.h"
#include "core/base/sort_few.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/simplex/listed_stars.h"
#include "core/simplex/simplex_list.h"
#include "core/tree/leaf_blocks.h"

namespace wellspace::core {
namespace {

// Vertices that make a block, or a few more.
constexpr size_t kVerticesInBlock = 512;
// The array of all simplices has room for at most so many times those in it: the first blocks need not be like the
// others.
constexpr size_t kMostGrowth = 128;

// Joins the simplices of blocks, which come in any order, in that of the blocks, and sees to the memory that they take.
//
// Thread safety: thread-safe.
class BlockJoin {
 public:
  // `held_bytes`: the memory held besides.
  BlockJoin(size_t block_count, uint64_t held_bytes, RunContext& context)
      : block_count_(block_count), held_bytes_(held_bytes), context_(context) {}

  // The next block to be made: the block that the others wait for first.
  size_t NextBlock() { return next_block_++; }
  // Whether the blocks that are to come are of no use.
  bool HasEnded() const { return context_.IsCancelled() || is_refused_; }

  // Takes the indices of the simplices of a block. `more_bytes`: the growth of its thread's memory since its last
  // block.
  void Take(size_t block, const HugeVector<uint32_t>& indices, uint64_t more_bytes) {
    std::lock_guard lock(mutex_);
    if (is_refused_) {
      return;
    }
    held_bytes_ += more_bytes;
    if (block != joined_count_) {
      unjoined_size_ += indices.size();
      unjoined_.emplace(block, indices);
      Allow(0);
    } else {
      Append(indices);
      for (auto next = unjoined_.begin(); next != unjoined_.end() && next->first == joined_count_;
           next = unjoined_.erase(next)) {
        Append(next->second);
        unjoined_size_ -= next->second.size();
      }
    }
    context_.SetPhaseFraction(static_cast<double>(joined_count_ + unjoined_.size()) /
                              static_cast<double>(block_count_));
  }

  // All of them, when the last block has been taken. Errors: that of the context, or RESOURCE_EXHAUSTED.
  absl::StatusOr<HugeVector<uint32_t>> Finish() {
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    WELLSPACE_RETURN_IF_ERROR(memory_);
    return std::move(joined_);
  }

 private:
  void Append(const HugeVector<uint32_t>& indices) {
    ++joined_count_;
    const size_t size = joined_.size() + indices.size();
    if (size > joined_.capacity()) {
      // As many as there will be if the blocks to come are like these, and a quarter more: unused room takes no
      // memory.
      Allow(joined_.size());
      if (is_refused_) {
        return;
      }
      const size_t to_come = size / joined_count_ * (block_count_ - joined_count_);
      joined_.reserve(std::min(kMostGrowth * size, size + to_come + (size + to_come) / 4));
    }
    joined_.insert(joined_.end(), indices.begin(), indices.end());
    Allow(0);
  }

  // Asks for the memory that is held, and for `more` indices.
  void Allow(size_t more) {
    const uint64_t bytes = held_bytes_ + (joined_.size() + unjoined_size_ + more) * sizeof(uint32_t);
    if (absl::Status status = context_.AllowMemory(bytes); !status.ok()) {
      memory_.Update(std::move(status));
      is_refused_ = true;
    }
  }

  const size_t block_count_;
  uint64_t held_bytes_;  // this and all below but for the atomic ones: guarded by mutex_
  RunContext& context_;
  std::mutex mutex_;
  HugeVector<uint32_t> joined_;
  size_t joined_count_ = 0;
  std::map<size_t, HugeVector<uint32_t>> unjoined_;  // by block
  size_t unjoined_size_ = 0;
  absl::Status memory_;  // the first refusal
  std::atomic<bool> is_refused_{false};
  std::atomic<size_t> next_block_{0};
};

// The simplices of `block_count` blocks, which threads share out: append(block, scratch, out) appends those of one,
// with a Scratch of its thread, which takes scratch_bytes(scratch) beside `held_bytes`.
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

// Calls f(VertexId) for one after the other of a block, and before that prefetch(VertexId, step); stops early when the
// context is cancelled.
template <int D, typename Prefetch, typename F>
void ForEachVertexOf(const LeafBlocks<D>& blocks, size_t block, const RunContext& context, Prefetch prefetch, F f) {
  std::array<VertexId, kVerticesInBlock + LeafTree<D>::kLeafCapacity> vertices;
  size_t count = 0;
  blocks.ForEachLeafOf(block, [&](const typename LeafTree<D>::LeafVertices& inside, NodeId) {
    std::copy_n(inside.ids, inside.count, vertices.begin() + count);
    count += inside.count;
  });
  for (size_t k = 0; k < count && !context.IsCancelled(); ++k) {
    PrefetchAhead(std::span(vertices).first(count), k, prefetch);
    f(vertices[k]);
  }
}

// Appends the simplex of `v` and `others`.
template <int D>
void AppendSimplex(const QueryStructure<D>& structure, VertexId v, const std::array<VertexId, D>& others,
                   std::span<const uint32_t> output_index, SimplexList<D>& out) {
  Simplex<D> simplex;
  std::array<uint32_t, D + 1> indices;
  simplex[0] = structure.point(v);
  indices[0] = output_index[Index(v)];
  for (int k = 0; k < D; ++k) {
    simplex[k + 1] = structure.point(others[k]);
    indices[k + 1] = output_index[Index(others[k])];
  }
  out.Add(simplex, indices);
}

// Appends the simplices of the cell in `workspace` whose lowest vertex is its site `v` and whose other vertices are
// wanted.
template <int D, typename IsWanted>
void AppendCell(const QueryStructure<D>& structure, VertexId v, std::span<const uint32_t> output_index,
                const Workspace<D>& workspace, IsWanted is_wanted, SimplexList<D>& out) {
  for (const CellNode<D>& node : workspace.cell.nodes()) {
    std::array<VertexId, D> others;
    bool is_ours = true;
    for (int k = 0; k < D && is_ours; ++k) {
      const Plane<D>& plane = workspace.cell.plane(node.planes[k]);
      others[k] = plane.vertex;
      is_ours = plane.kind == PlaneKind::kBisector && output_index[Index(plane.vertex)] > output_index[Index(v)] &&
                is_wanted(plane.vertex);
    }
    if (is_ours) {
      AppendSimplex<D>(structure, v, others, output_index, out);
    }
  }
}

// The simplices of the cells of all vertices in `block_count` blocks whose other vertices are wanted:
// for_each_vertex_of(block, f) calls f(VertexId). `more_bytes`: the memory held besides the structure and
// `output_index`.
template <int D, typename ForEachVertexOf, typename IsWanted>
absl::StatusOr<Simplices> JoinCells(const QueryStructure<D>& structure, std::span<const uint32_t> output_index,
                                    size_t block_count, uint64_t more_bytes, int threads, RunContext& context,
                                    ForEachVertexOf for_each_vertex_of, IsWanted is_wanted) {
  const auto append = [&](size_t block, Workspace<D>& workspace, SimplexList<D>& out) {
    for_each_vertex_of(block, [&](VertexId v) {
      structure.Voronoi(v, workspace);
      AppendCell<D>(structure, v, output_index, workspace, is_wanted, out);
    });
  };
  // The part of the scratch space that every thread has for each node of the tree.
  const uint64_t seen_bytes =
      static_cast<uint64_t>(ThreadTeam(threads).threads()) * structure.tree().node_count() * sizeof(uint32_t);
  return JoinBlocks<D, Workspace<D>>(
      block_count, structure.MemoryBytes() + output_index.size_bytes() + seen_bytes + more_bytes, threads, context,
      append, [](const Workspace<D>&) { return uint64_t{0}; },
      [](const Workspace<D>& workspace) { return workspace.counters; });
}

// The simplices of one vertex after the other that are in the mesh, of those that are listed there.
//
// Thread safety: thread-compatible.
template <int D>
class ListedSimplices {
 public:
  // All arguments must outlive it.
  ListedSimplices(const QueryStructure<D>& structure, const StarLists<D>& stars, const StaleStars& stale,
                  std::span<const uint32_t> output_index)
      : structure_(structure), stars_(structure, stars, stale), output_index_(output_index) {}

  // Appends those of `v`, in an order that does not depend on how cells were computed.
  void Append(VertexId v, SimplexList<D>& out) {
    auto& rows = stars_.Find(v);
    for (auto& row : rows) {
      SortFew(row);
    }
    std::sort(rows.begin(), rows.end());
    for (const auto& row : rows) {
      AppendSimplex<D>(structure_, v, row, output_index_, out);
    }
  }

  const ListedStars<D>& stars() const { return stars_; }

 private:
  const QueryStructure<D>& structure_;
  ListedStars<D> stars_;
  const std::span<const uint32_t> output_index_;
};

}  // namespace

template <int D>
absl::StatusOr<Simplices> ComputeSimplices(const QueryStructure<D>& structure, const StarLists<D>& stars,
                                           std::span<const uint32_t> output_index, int threads, RunContext& context) {
  const LeafBlocks<D> blocks(structure.tree(), kVerticesInBlock);
  if (!stars.IsComplete()) {
    const auto for_each_vertex_of = [&](size_t block, auto f) {
      ForEachVertexOf(
          blocks, block, context, [&](VertexId v, int step) { structure.Prefetch(v, step); }, f);
    };
    return JoinCells<D>(structure, output_index, blocks.count(), blocks.MemoryBytes(), threads, context,
                        for_each_vertex_of, [](VertexId) { return true; });
  }
  const uint64_t held_bytes =
      structure.MemoryBytes() + output_index.size_bytes() + stars.MemoryBytes() + blocks.MemoryBytes();
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(held_bytes));
  WELLSPACE_ASSIGN_OR_RETURN(const StaleStars stale, StaleStars::Of(stars, structure.vertex_count(), context));
  using Listed = std::optional<ListedSimplices<D>>;
  const auto append = [&](size_t block, Listed& listed, SimplexList<D>& out) {
    if (!listed.has_value()) {
      listed.emplace(structure, stars, stale, output_index);
    }
    ForEachVertexOf(
        blocks, block, context,
        [&](VertexId v, int step) {
          stars.Prefetch(v, step);
          if (step == 2) {
            for (const auto& simplex : stars.Of(v)) {
              stars.Prefetch(simplex[0], 0);
              PrefetchLine(&structure.point(simplex[0]));
              PrefetchLine(&output_index[Index(simplex[0])]);
            }
          }
        },
        [&](VertexId v) { listed->Append(v, out); });
  };
  return JoinBlocks<D, Listed>(
      blocks.count(), held_bytes + stale.MemoryBytes(), threads, context, append,
      [](const Listed& listed) { return listed->stars().MemoryBytes(); },
      [](const Listed& listed) { return listed->stars().counters(); });
}

template <int D>
absl::StatusOr<std::vector<VertexId>> ChangedVertices(const QueryStructure<D>& structure, VertexId first_new,
                                                      const RunContext& context) {
  std::vector<bool> has_changed(structure.vertex_count());
  Star<D> star;
  Workspace<D> workspace;
  for (uint32_t i = Index(first_new); i < structure.vertex_count(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    has_changed[i] = true;
    structure.Voronoi(VertexId{i}, workspace);
    workspace.cell.FindStar(star);
    for (const std::array<VertexId, D>& simplex : star) {
      for (const VertexId u : simplex) {
        has_changed[Index(u)] = true;
      }
    }
  }
  std::vector<VertexId> changed;
  for (uint32_t i = 0; i < structure.vertex_count(); ++i) {
    if (has_changed[i]) {
      changed.push_back(VertexId{i});
    }
  }
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
  const auto for_each_vertex_of = [&](size_t block, auto f) {
    const size_t begin = block * kVerticesInBlock;
    for (const VertexId v : vertices.subspan(begin, std::min(kVerticesInBlock, vertices.size() - begin))) {
      if (context.IsCancelled()) {
        return;
      }
      f(v);
    }
  };
  return JoinCells<D>(structure, output_index, (vertices.size() + kVerticesInBlock - 1) / kVerticesInBlock,
                      vertices.size_bytes(), threads, context, for_each_vertex_of,
                      [&](VertexId u) { return is_among[Index(u)]; });
}

#define WELLSPACE_INSTANTIATE(D)                                                                                   \
  template absl::StatusOr<Simplices> ComputeSimplices<D>(const QueryStructure<D>&, const StarLists<D>&,            \
                                                         std::span<const uint32_t>, int, RunContext&);             \
  template absl::StatusOr<std::vector<VertexId>> ChangedVertices<D>(const QueryStructure<D>&, VertexId,            \
                                                                    const RunContext&);                            \
  template absl::StatusOr<Simplices> ComputeSimplicesAmong<D>(const QueryStructure<D>&, std::span<const VertexId>, \
                                                              std::span<const uint32_t>, int, RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
