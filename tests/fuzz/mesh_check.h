// The mesher's promise, checked on one cloud.
#ifndef WELLSPACE_TESTS_FUZZ_MESH_CHECK_H_
#define WELLSPACE_TESTS_FUZZ_MESH_CHECK_H_

#include <span>

#include "core/mesher.h"

namespace wellspace::fuzz {

// Meshes `points`. Requires a mesh that the validators accept and whose input points are where they were, or one of the errors that a
// caller can cause; and the same with one more thread.
//
// REQUIRES:   core::ValidateParameters(parameters) is OK.
void RequireMeshOrRefusal(const core::MeshParameters& parameters, std::span<const double> points);

}  // namespace wellspace::fuzz

#endif  // WELLSPACE_TESTS_FUZZ_MESH_CHECK_H_
