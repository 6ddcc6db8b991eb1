// Meshes three points in a box by the installed core, adds a fourth, and checks the mesh.
#include <wellspace/core/meshers/mesher.h>
#include <wellspace/core/validate/validate.h>

#include <iostream>
#include <memory>
#include <vector>

namespace {

using namespace wellspace;

absl::StatusOr<core::Mesh> MeshInTwoSteps(const std::vector<double>& cloud, const std::vector<double>& more) {
  core::MeshParameters parameters;
  parameters.max_circumradius = 0.5;
  core::RunContext context;
  absl::StatusOr<std::unique_ptr<core::Mesher>> mesher = core::Mesher::Create(parameters, cloud, context);
  if (!mesher.ok()) return mesher.status();
  if (absl::Status status = (*mesher)->Refine(parameters, context); !status.ok()) return status;
  if (auto added = (*mesher)->AddPoints(more, context); !added.ok()) return added.status();
  if (absl::Status status = (*mesher)->Refine(parameters, context); !status.ok()) return status;
  return (*mesher)->Extract(/*threads=*/2, context);
}

}  // namespace

int main() {
  const std::vector<double> cloud = {0, 0, 0, 1, 0, 0, 0, 1, 1};
  const absl::StatusOr<core::Mesh> mesh = MeshInTwoSteps(cloud, {0.5, 0.5, 0.5});
  if (!mesh.ok()) {
    std::cerr << mesh.status() << "\n";
    return 1;
  }
  const core::MeshView view{.dimension = 3, .points = mesh->points, .simplices = mesh->simplices};
  const absl::Status valid = core::ValidateMesh(view, {.rho = 2, .max_circumradius = 0.5, .cloud = cloud});
  std::cout << mesh->vertex_count() << " vertices, " << mesh->simplex_count() << " simplices: " << valid << "\n";
  return valid.ok() ? 0 : 1;
}
