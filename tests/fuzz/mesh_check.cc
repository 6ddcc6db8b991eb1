#include "tests/fuzz/mesh_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "core/validate/validate.h"
#include "core/validate/validate_periodic.h"
#include "tests/fuzz/fuzz.h"

namespace wellspace::fuzz {
namespace {

// The box is the bounding box of the vertices, as ValidateMesh takes it.
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

void RequireInputVertices(const core::Mesh& mesh, double merge_distance, std::span<const double> points) {
  Require(mesh.input_vertex.size() * mesh.dimension == points.size(), "every input point has a vertex");
  if (merge_distance > 0) {
    for (size_t i = 0; i < points.size(); ++i) {
      const size_t vertex = mesh.input_vertex[i / mesh.dimension];
      Require(std::abs(mesh.points[vertex * mesh.dimension + i % mesh.dimension] - points[i]) <= merge_distance,
              "an input point is near its vertex");
    }
    return;
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const size_t vertex = mesh.input_vertex[i / mesh.dimension];
    Require(mesh.points[vertex * mesh.dimension + i % mesh.dimension] == points[i], "an input point is its vertex");
  }
}

void RequireValid(const core::Mesh& mesh, const core::MeshParameters& parameters, std::span<const double> points) {
  RequireBox(mesh);
  RequireInputVertices(mesh, parameters.merge_distance, points);
  const core::ValidationOptions options = {
      .rho = parameters.rho == 0 ? core::DefaultRho(parameters.dimension) : parameters.rho,
      .criterion = parameters.criterion,
      .max_circumradius = parameters.max_circumradius,
      .size_boxes = parameters.size_boxes,
      .size_samples = parameters.size_samples.get(),
      .gradation = parameters.gradation,
      .cloud = points,
      .merge_distance = parameters.merge_distance};
  const absl::Status valid = core::ValidateMesh(
      {.dimension = mesh.dimension, .points = mesh.points, .simplices = mesh.simplices, .weights = mesh.weights},
      options);
  Require(valid.ok(), "a mesh is valid:", valid.ToString());
  const absl::Status matches = core::ValidatePeriodic(
      {.dimension = mesh.dimension, .points = mesh.points, .simplices = mesh.simplices}, parameters.periodic_axes);
  Require(matches.ok(), "opposite sides of a periodic box match:", matches.ToString());
}

void RequireRefusal(const absl::Status& status) {
  Require(status.code() == absl::StatusCode::kInvalidArgument || status.code() == absl::StatusCode::kResourceExhausted,
          "a refusal is an INVALID_ARGUMENT or a RESOURCE_EXHAUSTED:", status.ToString());
}

// The simplices as sets, in order.
std::vector<std::vector<uint32_t>> SimplexSets(const core::Mesh& mesh) {
  std::vector<std::vector<uint32_t>> sets;
  const size_t corners = mesh.dimension + 1;
  for (size_t i = 0; i < mesh.simplices.size(); i += corners) {
    sets.emplace_back(mesh.simplices.begin() + i, mesh.simplices.begin() + i + corners);
    std::sort(sets.back().begin(), sets.back().end());
  }
  std::sort(sets.begin(), sets.end());
  return sets;
}

// Adds `added`; on an error, as many as were not refused.
absl::Status Add(core::Mesher& mesher, std::span<const double> added, bool one_by_one,
                 std::vector<uint32_t>& vertices) {
  if (!one_by_one) {
    core::RunContext context;
    absl::StatusOr<std::vector<uint32_t>> all = mesher.AddPoints(added, context);
    vertices = all.ok() ? *std::move(all) : std::vector<uint32_t>{};
    return all.status();
  }
  for (size_t i = 0; i < added.size(); i += mesher.dimension()) {
    const auto near = static_cast<uint32_t>(i * 7 % mesher.vertex_count());
    const absl::StatusOr<uint32_t> vertex = mesher.AddVertex(near, added.subspan(i, mesher.dimension()));
    if (!vertex.ok()) {
      return vertex.status();
    }
    vertices.push_back(*vertex);
  }
  return absl::OkStatus();
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
    RequireRefusal(mesh.status());
    return;
  }
  Require(other->points == mesh->points && other->simplices == mesh->simplices && other->weights == mesh->weights,
          "the mesh does not depend on the number of threads");
  Require(parameters.max_vertices == 0 || mesh->vertex_count() <= parameters.max_vertices, "max_vertices is kept");
  RequireValid(*mesh, parameters, points);
}

void RequireEditOrRefusal(const core::MeshParameters& parameters, std::span<const double> points,
                          const core::MeshParameters& then, std::span<const double> added, bool one_by_one) {
  core::RunContext context;
  const absl::StatusOr<std::unique_ptr<core::Mesher>> created = core::Mesher::Create(parameters, points, context);
  if (!created.ok()) {
    RequireRefusal(created.status());
    return;
  }
  core::Mesher& mesher = **created;
  if (const absl::Status refined = mesher.Refine(parameters, context); !refined.ok()) {
    RequireRefusal(refined);
    return;
  }
  absl::StatusOr<core::Mesh> mesh = mesher.Extract(1, context);
  Require(mesh.ok(), "a refined mesh can be extracted:", mesh.status().ToString());
  const uint64_t before = mesher.vertex_count();
  std::vector<uint32_t> vertices;
  const absl::Status added_status = Add(mesher, added, one_by_one, vertices);
  if (!added_status.ok()) {
    RequireRefusal(added_status);
    Require(one_by_one || mesher.vertex_count() == before, "all points are added or none");
    added = added.first(vertices.size() * mesher.dimension());
  }
  Require(vertices.size() * mesher.dimension() == added.size(), "every added point has a vertex");
  Require(mesher.Extract(1, context).ok() == (mesher.vertex_count() == before),
          "a mesh with new vertices wants to be refined first");
  if (const absl::Status refined = mesher.Refine(then, context); !refined.ok()) {
    RequireRefusal(refined);
    return;
  }
  const absl::Status updated = mesher.Update(*mesh, 1, context);
  Require(updated.ok(), "a refined mesh can be brought up to date:", updated.ToString());
  const absl::StatusOr<core::Mesh> extracted = mesher.Extract(2, context);
  Require(extracted.ok(), "a refined mesh can be extracted again:", extracted.status().ToString());
  Require(mesh->points == extracted->points, "the vertices of a mesh brought up to date are those of a new one");
  Require(SimplexSets(*mesh) == SimplexSets(*extracted), "so are its simplices");
  Require(mesh->weights == extracted->weights, "and its weights");
  std::vector<double> all(points.begin(), points.end());
  all.insert(all.end(), added.begin(), added.end());
  Require(std::equal(vertices.begin(), vertices.end(), mesh->input_vertex.end() - vertices.size()),
          "the vertices of added points come last in the list");
  RequireInputVertices(*mesh, parameters.merge_distance, all);
  // Of the first points alone it is said that they are the first vertices.
  core::Mesh of_first = *std::move(mesh);
  of_first.input_vertex.resize(points.size() / of_first.dimension);
  RequireValid(of_first, then, points);
}

}  // namespace wellspace::fuzz
