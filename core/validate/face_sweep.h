// The faces that pieces of segments cut the plane into, for the checks of a domain. The mesher finds them by code of
// its own, which this has nothing of: a line goes over the plane, and gaps between pieces on it are joined to faces.
#ifndef WELLSPACE_CORE_VALIDATE_FACE_SWEEP_H_
#define WELLSPACE_CORE_VALIDATE_FACE_SWEEP_H_

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A straight part of segments between two vertices.
struct Piece {
  static constexpr uint32_t kNotGiven = std::numeric_limits<uint32_t>::max();

  std::array<uint32_t, 2> ends{};  // the lower one first
  uint32_t rings = 0;              // the number of ring segments on it
  uint32_t source = kNotGiven;     // a segment that it is of
  std::vector<uint32_t> groups{};  // of these rings, some more than once, if BoundingSegments has any
};

struct SweptFaces {
  static constexpr uint32_t kOnPiece = std::numeric_limits<uint32_t>::max();

  uint32_t face_count = 0;                         // face 0 is the unbounded one
  std::vector<std::array<uint32_t, 2>> beside;     // of each piece: the faces below and above it
  std::vector<uint32_t> face_of;                   // of each place; kOnPiece if it is on a piece
  std::vector<std::array<uint32_t, 2>> crossings;  // pairs of pieces; if there are any, the rest says nothing
};

// Finds the faces, and which of them each of `places` is in.
//
// REQUIRES:   pieces have two ends that differ, and no two have the same; no vertex lies between the ends of a piece.
// Guarantees: (1) where pieces cross, some crossings are found.
// Complexity: O(n log n).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<SweptFaces> SweepFaces(std::span<const Point<2>> vertices, std::span<const Piece> pieces,
                                      std::span<const Point<2>> places, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_FACE_SWEEP_H_
