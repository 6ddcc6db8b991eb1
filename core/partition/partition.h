// The partition of a mesh: the part of each of its simplices, for solvers that run on many ranks.
#ifndef WELLSPACE_CORE_PARTITION_PARTITION_H_
#define WELLSPACE_CORE_PARTITION_PARTITION_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// More parts than any solver has ranks for, and few enough that an array of them is nothing.
inline constexpr uint32_t kMaxParts = uint32_t{1} << 20;

struct PartitionOptions {
  uint32_t parts = 1;
  // Each part hangs together by facets, if the mesh does. Then parts may be less even.
  bool contiguous = false;
};

// The graph of a mesh: its simplices, of which two are neighbours where they have a facet in common.
//
// Invariants: (1) the neighbours of each simplex ascend; (2) they are each other's.
struct DualGraph {
  HugeVector<int32_t> first;       // by simplex, and one more: where its neighbours begin
  HugeVector<int32_t> neighbours;  // simplices

  uint64_t simplex_count() const { return first.empty() ? 0 : first.size() - 1; }
};

// Finds the dual graph of m simplices.
//
// Shapes:     simplices: m x (dimension + 1), row-major.
// REQUIRES:   a facet belongs to at most two simplices.
// Complexity: O(m log m) time; memory of at most DualGraphBytes.
// Errors:     INVALID_ARGUMENT: more simplices than 32 bits number, a facet of three simplices; CANCELLED,
//             DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED of the context's memory, which is asked for before the work.
absl::StatusOr<DualGraph> FindDualGraph(int dimension, std::span<const uint32_t> simplices, const RunContext& context);

// Cuts a graph into parts: the part of each simplex, from 0 on, so that few facets lie between two parts.
//
// Guarantees: (1) no part is empty; (2) no part has more simplices than the mean and kMostImbalance of it, or one more
//             than the mean, unless parts are to be contiguous; (3) the same graph and options give the same parts.
// Complexity: O(m) time, and O(m) memory, PartitionBytes; asked for before the work.
// Errors:     INVALID_ARGUMENT: no part, more than kMaxParts, or more parts than simplices; CANCELLED,
//             DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED: of memory.
// Source:     G. Karypis, V. Kumar, *Multilevel k-way Partitioning Scheme for Irregular Graphs*, 1998: METIS, in a
//             process of its own, since it takes over signals of the process that it runs in, and cannot be cancelled.
absl::StatusOr<HugeVector<uint32_t>> Partition(const DualGraph& graph, const PartitionOptions& options,
                                               const RunContext& context);

inline constexpr double kMostImbalance = 0.03;

// The peak memory of the two, their results included; of a partition the most that a mesh of so many simplices can
// take beside its graph. Unit: bytes.
uint64_t DualGraphBytes(int dimension, uint64_t simplices);
uint64_t PartitionBytes(int dimension, uint64_t simplices);

// How many facets lie between two parts.
//
// Shapes:     part_of: by simplex.
uint64_t CountCut(const DualGraph& graph, std::span<const uint32_t> part_of);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_PARTITION_PARTITION_H_
