// Slow, independent checks that a mesh is that of a box which sheets of triangles part.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_BOXED_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_BOXED_H_

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/validate/validate.h"
#include "core/validate/validate_fidelity.h"
#include "core/validate/validate_solid.h"

namespace wellspace::core {

// Holds a mesh to the triangles as they are given, which nothing cuts here, and to its box. In this order:
//
// 1. No vertex is outside of the box.
// 2. Facets in the plane of a side cover no more than the side, and all of it, unless there are holes. Without holes
//    the tetrahedra have the volume of the box.
// 3. A facet in a side has the name of the side, or another tag where a given triangle is near its middle. One in no
//    side has no side's name, and is no farther than the tolerance from a triangle, at its corners and its middle.
// 4. Places of triangles that are inside of the box, farther than the tolerance from its sides, are no farther than
//    that from a facet; unless there are holes.
//
// REQUIRES:   ValidateSolidMesh is OK; `surface` has a box.
// Complexity: O((n + m) log (n + m)) for most.
// Errors:     FAILED_PRECONDITION, naming the first violation; RESOURCE_EXHAUSTED of the context's memory; CANCELLED,
//             DEADLINE_EXCEEDED.
absl::Status ValidateBoxedMesh(const MeshView& mesh, const SolidParts& parts, const SurfaceView& surface,
                               const FidelityOptions& options, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_BOXED_H_
