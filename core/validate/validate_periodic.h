// A slow, independent check that opposite faces of a mesh of a box match.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_PERIODIC_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_PERIODIC_H_

#include <span>

#include "absl/status/status.h"
#include "core/validate/validate.h"

namespace wellspace::core {

// Along each of `axes`, vertices on the low and on the high face of the box are pairs with equal other coordinates, and
// facets on the one are those on the other, vertex by vertex. The box is the bounding box of the mesh's points.
//
// REQUIRES:   ValidateIndices is OK.
// Complexity: O(simplices), and sorts of the vertices and facets on the faces.
// Errors:     FAILED_PRECONDITION, naming the first violation (axis, vertex with its coordinates, or vertices of the
//             facet, and the face); INVALID_ARGUMENT for an axis that is none or is there twice, and for a mesh that
//             ValidateIndices would refuse for its shape.
absl::Status ValidatePeriodic(const MeshView& mesh, std::span<const int> axes);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_PERIODIC_H_
