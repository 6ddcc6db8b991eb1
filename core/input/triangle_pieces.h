// A triangle in halves, halves of halves, and so on, as far as each piece asks for it.
#ifndef WELLSPACE_CORE_INPUT_TRIANGLE_PIECES_H_
#define WELLSPACE_CORE_INPUT_TRIANGLE_PIECES_H_

#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

inline constexpr size_t kPiecesBetweenChecks = 64;

// Calls visit(piece, its longest edge) for a triangle, and for the halves of each piece for which it returns true.
//
// Errors:     CANCELLED, DEADLINE_EXCEEDED; those of `visit`, which returns a StatusOr<bool>.
template <typename Visit>
absl::Status ForEachPiece(const Triangle& triangle, const RunContext& context, const Visit& visit) {
  std::vector<Triangle> pieces = {triangle};
  for (size_t step = 0; !pieces.empty(); ++step) {
    if (step % kPiecesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Triangle piece = pieces.back();
    pieces.pop_back();
    const LongestEdge longest = LongestEdgeOf(piece);
    WELLSPACE_ASSIGN_OR_RETURN(const bool is_halved, visit(piece, longest));
    if (is_halved) {
      Bisect(piece, longest.k, pieces);
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_TRIANGLE_PIECES_H_
