// The functions that mesh: the core's, or a test's in their place.
#ifndef WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_
#define WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "core/meshers/mesher.h"

namespace wellspace::server {

// Makes a mesh: core::MeshPoints, or a test's function in its place.
using Mesher =
    std::function<absl::StatusOr<core::Mesh>(const core::MeshParameters&, const core::Input&, core::RunContext&)>;
// Estimates a mesh: core::EstimateMesh, or a test's function in its place.
using Estimator = std::function<absl::StatusOr<core::MeshEstimate>(const core::MeshParameters&, const core::Input&,
                                                                   core::RunContext&)>;

// Begins the mesh of a session: core::Mesher::Create, or a test's function in its place.
using MesherFactory = std::function<absl::StatusOr<std::unique_ptr<core::Mesher>>(
    const core::MeshParameters&, const core::Input&, core::RunContext&)>;

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_
