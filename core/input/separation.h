// The check that the points of a cloud are as far from each other as the arithmetic wants (Frame::MinSeparation). It is
// made once the tree is built, which finds near points. SortCloud has refused points of one cube of its grid before.
#ifndef WELLSPACE_CORE_INPUT_SEPARATION_H_
#define WELLSPACE_CORE_INPUT_SEPARATION_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Refuses points nearer to each other, or to a corner of the box, than the arithmetic serves. The vertices of
// `structure` are a sorted cloud's, from number `first` on, whose `first_input` is given, and the corners. A point on a
// corner is no error.
//
// Errors:     INVALID_ARGUMENT, naming the point; CANCELLED, DEADLINE_EXCEEDED.
// Complexity: O(n) queries.
// Threads:    uses `threads`, at most as many as the machine has cores.
template <int D>
absl::Status CheckSeparation(const Frame<D>& frame, const QueryStructure<D>& structure, uint32_t first,
                             std::span<const uint32_t> first_input, int threads, const RunContext& context);

// CheckSeparation for a cloud that is in no structure: the points among themselves, and beside the corners and faces of
// the box.
template <int D>
absl::Status CheckApart(const Frame<D>& frame, const SortedCloud<D>& cloud, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SEPARATION_H_
