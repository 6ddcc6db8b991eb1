// What meshes: the core, or what a test puts in its place.
#ifndef WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_
#define WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_

#include <functional>
#include <memory>

#include "absl/status/statusor.h"
#include "core/mesher.h"

namespace wellspace::server {

// What meshes: core::MeshPoints, or what a test puts in its place.
using Mesher =
    std::function<absl::StatusOr<core::Mesh>(const core::MeshParameters&, const core::Input&, core::RunContext&)>;
// What estimates: core::EstimateMesh, or what a test puts in its place.
using Estimator = std::function<absl::StatusOr<core::MeshEstimate>(const core::MeshParameters&, const core::Input&,
                                                                   core::RunContext&)>;

// What begins the mesh of a session: core::Mesher::Create, or what a test puts in its place.
using MesherFactory = std::function<absl::StatusOr<std::unique_ptr<core::Mesher>>(
    const core::MeshParameters&, const core::Input&, core::RunContext&)>;

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_
