// The mesher's promise, checked on one cloud.
#ifndef WELLSPACE_TESTS_FUZZ_MESH_CHECK_H_
#define WELLSPACE_TESTS_FUZZ_MESH_CHECK_H_

#include <span>

#include "core/meshers/mesher.h"

namespace wellspace::fuzz {

// Meshes `points`. Requires a mesh that the validators accept and whose input points are where they were, or one of the
// errors that a caller can cause; and the same with one more thread.
//
// REQUIRES:   core::ValidateParameters(parameters) is OK.
void RequireMeshOrRefusal(const core::MeshParameters& parameters, std::span<const double> points);

// Meshes `points`, adds `added`, all at once or one by one, refines for `then` and brings the mesh up to date. Requires
// a mesh that the validators accept, with both kinds of points where they were, and that Extract gives the same; or one
// of the errors that a caller can cause, after which nothing has been added.
//
// REQUIRES:   core::ValidateParameters is OK for both; they have one dimension and box.
void RequireEditOrRefusal(const core::MeshParameters& parameters, std::span<const double> points,
                          const core::MeshParameters& then, std::span<const double> added, bool one_by_one);

}  // namespace wellspace::fuzz

#endif  // WELLSPACE_TESTS_FUZZ_MESH_CHECK_H_
