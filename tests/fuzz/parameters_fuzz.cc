// Numbers of every exponent and size in MeshParameters, through the server's checks, into the estimate and the mesher:
// of a cloud, or of a domain in the plane or in space.
//
// Input: a byte for the dimension, the criterion, how many points there are, and, by its highest bit, whether a domain
//        is meshed, by the next one in space; of that a double, the largest area, or volume, in a part of it; in space
//        three more, the crease angle, the weld distance and the least patch; then fields, each a byte that says which
//        and the eight bytes of its double, low one first, or of its integer.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/saturate.h"
#include "core/features/features.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "core/validate/validate_periodic.h"
#include "server/inputs/space_features.h"
#include "server/wire/convert.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_check.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::fuzz {
namespace {

constexpr size_t kMaxFields = 12;
// Beside the corners of the box, by dimension: under the sanitizers cells of 5-D and 6-D take milliseconds.
constexpr std::array<uint64_t, 5> kMaxVertices = {400, 200, 40, 12, 8};

uint64_t ReadInteger(ByteReader& bytes) {
  uint64_t value = 0;
  for (int i = 0; i < 64; i += 8) {
    value |= uint64_t{bytes.Next()} << i;
  }
  return value;
}
double ReadDouble(ByteReader& bytes) { return std::bit_cast<double>(ReadInteger(bytes)); }

void ReadSurfaceField(int field, ByteReader& bytes, v1::MeshParameters& parameters) {
  switch (field) {
    case 1:
      return parameters.mutable_surface()->set_tolerance(ReadDouble(bytes));
    case 2:
      return parameters.mutable_surface()->set_min_facet_angle(ReadDouble(bytes));
    case 3:
      return parameters.mutable_surface()->set_edge_length(ReadDouble(bytes));
    case 4:
      return parameters.mutable_surface()->set_min_size(ReadDouble(bytes));
    case 5:
      return parameters.mutable_surface()->set_outside_rho(ReadDouble(bytes));
    case 6:
      return parameters.mutable_surface()->set_curvature_elements(ReadDouble(bytes));
    case 7:
      return parameters.mutable_surface()->set_thickness_layers(ReadDouble(bytes));
    default:
      return parameters.set_pump_weights(true);
  }
}

// Byte: the lowest four bits which field, the next three an axis, of a corner; the last one whether the box is periodic
// along it, too.
void ReadField(ByteReader& bytes, v1::MeshParameters& parameters) {
  const uint8_t byte = bytes.Next();
  const int axis = (byte >> 4 & 7) % parameters.dimension();
  if ((byte >> 7) != 0) {
    parameters.add_periodic_axes(axis);
  }
  const auto box = [&]() -> v1::SizeBox& {
    if (parameters.size_boxes().empty()) {
      v1::SizeBox* added = parameters.add_size_boxes();
      for (int i = 0; i < parameters.dimension(); ++i) {
        added->add_low(0);
        added->add_high(0.5);
      }
      added->set_max_circumradius(1);
    }
    return *parameters.mutable_size_boxes(0);
  };
  const auto domain = [&]() -> v1::Box& {
    while (parameters.domain().low_size() < parameters.dimension()) {
      parameters.mutable_domain()->add_low(0);
      parameters.mutable_domain()->add_high(1);
    }
    return *parameters.mutable_domain();
  };
  switch (byte & 15) {
    case 0:
      return parameters.set_rho(ReadDouble(bytes));
    case 1:
      return parameters.set_margin(ReadDouble(bytes));
    case 2:
      return parameters.set_max_circumradius(ReadDouble(bytes));
    case 3:
      return box().set_max_circumradius(ReadDouble(bytes));
    case 4:
      return box().set_low(axis, ReadDouble(bytes));
    case 5:
      return box().set_high(axis, ReadDouble(bytes));
    case 6:
      return domain().set_low(axis, ReadDouble(bytes));
    case 7:
      return domain().set_high(axis, ReadDouble(bytes));
    case 8:
      return parameters.set_merge_distance(ReadDouble(bytes));
    case 9:
      return parameters.set_min_dihedral(ReadDouble(bytes));
    case 10:
      return parameters.set_max_vertices(ReadInteger(bytes));
    case 11:
      return parameters.set_threads(static_cast<int32_t>(ReadInteger(bytes)));
    case 12:
      return parameters.set_dimension(static_cast<int32_t>(ReadInteger(bytes)));
    case 13:
      return parameters.set_edge_length(ReadDouble(bytes));
    case 14:
      return parameters.set_gradation(ReadDouble(bytes));
    default:
      return ReadSurfaceField(byte >> 4 & 7, bytes, parameters);
  }
}

void RequireCounts(const core::MeshEstimate& estimate, uint64_t least) {
  constexpr auto kMost = static_cast<uint64_t>(core::kMostCounted);
  Require(estimate.vertices >= least && estimate.vertices <= kMost, "an estimate counts the vertices that are given");
  Require(estimate.simplices >= 2 && estimate.simplices <= kMost, "a box has simplices");
  Require(estimate.memory_bytes > 0 && estimate.memory_bytes <= kMost, "a mesh takes memory");
  Require(std::isfinite(estimate.bytes_per_vertex) && estimate.bytes_per_vertex > 0, "a vertex takes memory");
}

// A square with a square hole, and a segment that cuts a part off, in which there is a largest area.
void RequireDomainOrRefusal(const core::MeshParameters& parameters, double max_area) {
  const std::vector<double> points = {0,   0,    1,   0,   1,    1,   0,    1, 0.25, 0.25,
                                      0.5, 0.25, 0.5, 0.5, 0.25, 0.5, 0.75, 0, 0.75, 1};
  const std::vector<uint32_t> ends = {0, 8, 8, 1, 1, 2, 2, 9, 9, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 8, 9};
  const std::vector<core::FaceSeed> seeds = {{.at = {0.3, 0.3}, .is_hole = true},
                                             {.at = {0.9, 0.5}, .region = 1, .max_area = max_area}};
  core::Features features;
  features.ends = ends;
  features.seeds = seeds;
  features.faces = parameters.domain_low.empty() ? core::FaceRule::kHoles : core::FaceRule::kBox;
  core::RunContext context;
  if (const auto estimate = core::EstimateMesh(parameters, {points, features}, context); estimate.ok()) {
    RequireCounts(*estimate, points.size() / 2);
  }
  const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, {points, features}, context);
  if (!mesh.ok()) {
    Require(mesh.status().code() == absl::StatusCode::kInvalidArgument ||
                mesh.status().code() == absl::StatusCode::kResourceExhausted,
            "a refusal is an INVALID_ARGUMENT or a RESOURCE_EXHAUSTED:", mesh.status().ToString());
    return;
  }
  const core::MeshView view = {.dimension = 2, .points = mesh->points, .simplices = mesh->simplices};
  for (const absl::Status& valid : {core::ValidateIndices(view), core::ValidateOrientation(view),
                                    core::ValidateSizing(view, {.max_circumradius = parameters.max_circumradius,
                                                               .boxes = parameters.size_boxes,
                                                               .samples = parameters.size_samples.get(),
                                                               .gradation = parameters.gradation}),
                                    core::ValidatePeriodic(view, parameters.periodic_axes)}) {
    Require(valid.ok(), "a mesh is valid:", valid.ToString());
  }
}

v1::SurfaceOptions ReadSurfaceOptions(ByteReader& bytes, double max_volume) {
  v1::SurfaceOptions options;
  options.set_crease_angle(ReadDouble(bytes));
  options.set_weld(ReadDouble(bytes));
  options.set_min_patch(ReadDouble(bytes));
  if (bytes.Next() % 2 == 1) {
    options.set_solids(v1::SOLID_RULE_WINDING);
    options.set_resolution(ReadDouble(bytes));
  }
  v1::SolidSeed& seed = *options.add_seeds();
  seed.set_x(0.3);
  seed.set_y(0.4);
  seed.set_z(0.5);
  seed.set_region(1);
  seed.set_max_volume(max_volume);
  return options;
}

// A cube, with these options.
void RequireSurfaceOrRefusal(const core::MeshParameters& parameters, const v1::SurfaceOptions& options) {
  const std::vector<double> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
  v1::TriangleChunk triangles;
  for (const uint32_t corner :
       {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6}) {
    triangles.add_corners(corner);
  }
  if (!server::CheckSurface(options, 0).ok()) {
    return;
  }
  server::SpaceFeatures features;
  features.Append(triangles);
  features.Append(options);
  const core::Input input(points, features.View());
  if (!server::ValidateFor(input, parameters).ok()) {
    return;
  }
  core::RunContext context;
  if (const auto estimate = core::EstimateMesh(parameters, input, context); estimate.ok()) {
    RequireCounts(*estimate, 1);
  }
  const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, input, context);
  if (!mesh.ok()) {
    Require(mesh.status().code() == absl::StatusCode::kInvalidArgument ||
                mesh.status().code() == absl::StatusCode::kResourceExhausted,
            "a refusal is an INVALID_ARGUMENT or a RESOURCE_EXHAUSTED:", mesh.status().ToString());
    return;
  }
  const core::MeshView view = {.dimension = 3, .points = mesh->points, .simplices = mesh->simplices};
  for (const absl::Status& valid : {core::ValidateIndices(view), core::ValidateOrientation(view)}) {
    Require(valid.ok(), "a mesh is valid:", valid.ToString());
  }
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  const uint8_t shape = bytes.Next();
  const bool is_domain = shape >> 7 != 0;
  const bool is_in_space = is_domain && (shape >> 6 & 1) != 0;
  const double largest = is_domain ? fuzz::ReadDouble(bytes) : 0;
  const v1::SurfaceOptions surface = is_in_space ? fuzz::ReadSurfaceOptions(bytes, largest) : v1::SurfaceOptions();
  v1::MeshParameters message;
  message.set_dimension(is_in_space ? 3 : is_domain ? 2 : 2 + shape % 5);
  message.set_criterion((shape >> 3 & 1) != 0 ? v1::CRITERION_WELL_SPACED : v1::CRITERION_RADIUS_EDGE);
  for (size_t i = 0; i < fuzz::kMaxFields && !bytes.empty() && message.dimension() >= 2 && message.dimension() <= 6;
       ++i) {
    fuzz::ReadField(bytes, message);
  }
  const server::ServiceOptions options = {.max_threads = 2};
  absl::StatusOr<core::MeshParameters> accepted = server::ParametersFromProto(message, options);
  if (!accepted.ok()) {
    return 0;
  }
  core::MeshParameters parameters = *std::move(accepted);
  parameters.max_vertices = std::min(
      parameters.max_vertices, (uint64_t{1} << parameters.dimension) + fuzz::kMaxVertices[parameters.dimension - 2]);
  if (is_in_space) {
    fuzz::RequireSurfaceOrRefusal(parameters, surface);
    return 0;
  }
  if (is_domain) {
    fuzz::RequireDomainOrRefusal(parameters, largest > 0 ? largest : std::numeric_limits<double>::infinity());
    return 0;
  }
  // In the unit box, or none: of another domain they would be outside.
  const size_t count = parameters.domain_low.empty() ? 1 + (shape >> 4 & 3) : 0;
  std::vector<double> points;
  for (size_t i = 0; i < count * parameters.dimension; ++i) {
    points.push_back(static_cast<double>((i * i + 3 * i) % 8) / 8);
  }
  core::RunContext context;
  if (const auto estimate = core::EstimateMesh(parameters, points, context); estimate.ok()) {
    fuzz::RequireCounts(*estimate, uint64_t{1} << parameters.dimension);
  }
  fuzz::RequireMeshOrRefusal(parameters, points);
  return 0;
}
