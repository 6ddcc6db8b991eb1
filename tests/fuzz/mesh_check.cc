#include "tests/fuzz/mesh_check.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/simplex/validate.h"
#include "tests/fuzz/fuzz.h"

namespace wellspace::fuzz {
namespace {

// The box is the bounding box of the vertices, that is what ValidateMesh takes it for.
void RequireBox(const core::Mesh& mesh) {
  for (int axis = 0; axis < mesh.dimension; ++axis) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (size_t i = axis; i < mesh.points.size(); i += mesh.dimension) {
      low = std::min(low, mesh.points[i]);
      high = std::max(high, mesh.points[i]);
    }
    Require(low == mesh.domain_low[axis] && high == mesh.domain_high[axis], "the mesh fills its domain");
  }
}

void RequireInputVertices(const core::Mesh& mesh, std::span<const double> points) {
  Require(mesh.input_vertex.size() * mesh.dimension == points.size(), "every input point has a vertex");
  for (size_t i = 0; i < points.size(); ++i) {
    const size_t vertex = mesh.input_vertex[i / mesh.dimension];
    Require(mesh.points[vertex * mesh.dimension + i % mesh.dimension] == points[i], "an input point is its vertex");
  }
}

}  // namespace

void RequireMeshOrRefusal(const core::MeshParameters& parameters, std::span<const double> points) {
  core::RunContext context;
  const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, points, context);
  core::MeshParameters more_threads = parameters;
  ++more_threads.threads;
  core::RunContext other_context;
  const absl::StatusOr<core::Mesh> other = core::MeshPoints(more_threads, points, other_context);
  Require(other.status() == mesh.status(), "the result does not depend on threads:", other.status().ToString());
  if (!mesh.ok()) {
    Require(mesh.status().code() == absl::StatusCode::kInvalidArgument ||
                mesh.status().code() == absl::StatusCode::kResourceExhausted,
            "a refusal is an INVALID_ARGUMENT or a RESOURCE_EXHAUSTED:", mesh.status().ToString());
    return;
  }
  Require(other->points == mesh->points && other->simplices == mesh->simplices,
          "the mesh does not depend on the number of threads");
  Require(parameters.max_vertices == 0 || mesh->vertex_count() <= parameters.max_vertices, "max_vertices is kept");
  RequireBox(*mesh);
  RequireInputVertices(*mesh, points);
  const core::ValidationOptions options = {
      .rho = parameters.rho == 0 ? core::DefaultRho(parameters.dimension) : parameters.rho, .cloud = points};
  const absl::Status valid =
      core::ValidateMesh({.dimension = mesh->dimension, .points = mesh->points, .simplices = mesh->simplices}, options);
  Require(valid.ok(), "a mesh is valid:", valid.ToString());
}

}  // namespace wellspace::fuzz
