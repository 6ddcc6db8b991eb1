// What meshes: the core, or what a test puts in its place.
#ifndef WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_
#define WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_

#include <functional>
#include <memory>
#include <span>

#include "absl/status/statusor.h"
#include "core/mesher.h"

namespace wellspace::server {

// What meshes: core::MeshPoints, or what a test puts in its place.
using Mesher =
    std::function<absl::StatusOr<core::Mesh>(const core::MeshParameters&, std::span<const double>, core::RunContext&)>;
// What estimates: core::EstimateMesh, or what a test puts in its place.
using Estimator = std::function<absl::StatusOr<core::MeshEstimate>(const core::MeshParameters&, std::span<const double>,
                                                                   core::RunContext&)>;

// What begins the mesh of a session: CreateMesher, or what a test puts in its place.
using MesherFactory = std::function<absl::StatusOr<std::unique_ptr<core::Mesher>>(
    const core::MeshParameters&, std::span<const double>, const core::Features*, core::RunContext&)>;

// A mesher of the domain that `features` make of `points`; null: of a cloud.
inline absl::StatusOr<std::unique_ptr<core::Mesher>> CreateMesher(const core::MeshParameters& parameters,
                                                                  std::span<const double> points,
                                                                  const core::Features* features,
                                                                  core::RunContext& context) {
  return features == nullptr ? core::Mesher::Create(parameters, points, context)
                             : core::Mesher::CreateInDomain(parameters, points, *features, context);
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_MESH_FUNCTIONS_H_
