// A slow, independent check that tagged facets are the boundary of a mesh of a box.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_BOUNDARY_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_BOUNDARY_H_

#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "core/validate/validate.h"

namespace wellspace::core {

// The boundary of a mesh from any source, perhaps wrong.
struct BoundaryView {
  std::span<const uint32_t> facets;        // facet_count x dimension indices of vertices, row-major
  std::span<const int32_t> tags;           // facet_count
  std::map<int32_t, std::string> names{};  // of tags; names of faces, as FaceName has them, are checked
};

// Every facet that belongs to one simplex, and lies on a face of the box, is there once, with a tag that is not 0, and
// there are no others; that they tile the faces follows from ValidateTopology. Where a tag has the name of a face, its
// facets are all those on that face, each counterclockwise seen from outside (in general: as FindBoxBoundary says). The
// box is the bounding box of the mesh's points.
//
// REQUIRES:   ValidateIndices, ValidateOrientation and ValidateTopology are OK.
// Complexity: O(simplices), and a sort of the facets.
// Errors:     FAILED_PRECONDITION, naming the first violation (facet, vertices, tag, face); INVALID_ARGUMENT for arrays
//             that do not hold whole rows.
absl::Status ValidateBoundary(const MeshView& mesh, const BoundaryView& boundary);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_BOUNDARY_H_
