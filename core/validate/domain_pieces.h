// The segments of a domain, cut into pieces by a mesh of it: facets that lie along them, and stretches without any.
#ifndef WELLSPACE_CORE_VALIDATE_DOMAIN_PIECES_H_
#define WELLSPACE_CORE_VALIDATE_DOMAIN_PIECES_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/geometry/box.h"
#include "core/validate/face_sweep.h"

namespace wellspace::core {

// The segments that bound a domain: from its file and, in a box, the sides of that.
struct BoundingSegments {
  std::vector<Point<2>> points;
  std::vector<std::array<uint32_t, 2>> ends;
  std::vector<uint8_t> is_ring;
  std::vector<uint32_t> groups;  // of each; none but of FaceRule::kUnion
  uint32_t given = 0;            // the number from the file; then the sides of the box follow

  // "segments[3]" or "a side of the box".
  std::string NameOf(uint32_t segment) const;
};
// `box`: of which the sides bound the domain, or null.
BoundingSegments SegmentsOf(std::span<const double> points, const Features& features, const Box<2>* box);

struct DomainPieces {
  std::vector<Point<2>> vertices;  // of the mesh, then others
  std::vector<Piece> pieces;       // the facets, in their order, then stretches
};

// Follows each segment from facet to facet. A stretch without facets is cut where vertices are within `tolerance` of
// it, and where it crosses another one.
//
// Complexity: O((n + m) log (n + m) + m sqrt(n)) for most domains, and O(1) for each violation.
// Errors:     FAILED_PRECONDITION, naming facet or segment: a facet along no segment; a stretch that crosses a facet;
//             stretches whose crossings do not end. CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<DomainPieces> CutSegments(std::span<const double> vertices, std::span<const uint32_t> facets,
                                         const BoundingSegments& segments, double tolerance, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_DOMAIN_PIECES_H_
