// Triangles of a complex that meet where they share nothing, or come too near to each other: found by a tree.
#ifndef WELLSPACE_CORE_FEATURES_TRIANGLE_PAIRS_H_
#define WELLSPACE_CORE_FEATURES_TRIANGLE_PAIRS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_complex.h"
#include "core/features/triangle_contact.h"

namespace wellspace::core {

struct TrianglePair {
  uint32_t one = 0;  // triangles, the lower first
  uint32_t other = 0;
  TriangleContact contact;

  bool operator==(const TrianglePair&) const = default;
};

struct TrianglePairs {
  std::vector<TrianglePair> pairs;  // ascending by the triangles; not all, if there are more
  bool has_more = false;            // than are found: the search has stopped
  uint64_t compared_pairs = 0;
};

// Finds the pairs of triangles that FindContact tells of.
//
// A box around the triangles is halved, where that parts them best, until it holds few of them, or triangles with a
// common corner alone whose sides across from that are elsewhere: if two of those met, they would do so there, too.
// Where halving would not part them, as it does not for sheets and strips that lie slanting side by side, a plane along
// one of them does. Fans, which nothing parts at their common corner, are compared with the triangles beside them, and
// the box is cut towards that corner.
//
// Guarantees: neither threads, nor the order in which triangles and points were given, change the result.
// Complexity: O(m log m + k) for most complexes, k pairs whose boxes meet; fans, sheets and strips side by side are
//             such. The memory is bounded.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores.
absl::StatusOr<TrianglePairs> FindTrianglePairs(const SurfaceComplex& complex, double least_separation, int threads,
                                                const RunContext& context);

// The memory of FindTrianglePairs. Unit: bytes.
uint64_t TrianglePairsBytes(uint64_t triangles);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_TRIANGLE_PAIRS_H_
