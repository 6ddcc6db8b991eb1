// Meshes points or segments in the unit box by Wellspace's core and reports one JSON object, whose fields
// bench/README.md has.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "CLI/App.hpp"
#include "CLI/Config.hpp"
#include "CLI/Formatter.hpp"
#include "absl/strings/str_cat.h"
#include "bench/drivers/floor.h"
#include "bench/drivers/meter.h"
#include "bench/drivers/results.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "core/validate/validate_domain.h"
#include "nlohmann/json.hpp"

namespace wellspace::bench {
namespace {

// Equal meshes have equal ones.
std::string FingerprintOf(const core::Mesh& mesh) {
  const uint64_t of_points = Hash(mesh.points, kFirstHash);
  return absl::StrCat(absl::Hex(Hash(mesh.simplices, of_points), absl::kZeroPad16));
}

absl::StatusOr<std::unique_ptr<core::Mesher>> Create(const core::MeshParameters& parameters,
                                                     std::span<const double> points, std::span<const uint32_t> segments,
                                                     core::RunContext& context) {
  if (segments.empty()) {
    return core::Mesher::Create(parameters, points, context);
  }
  core::Features features;
  features.ends = segments;
  return core::Mesher::Create(parameters, {points, features}, context);
}

// Checks every promise about `mesh`, of `segments` too.
absl::Status Validate(const core::Mesh& mesh, double rho, std::span<const double> points,
                      std::span<const uint32_t> segments) {
  const core::MeshView view{mesh.dimension, mesh.points, mesh.simplices, mesh.weights};
  if (segments.empty()) {
    return core::ValidateMesh(view, {.rho = rho, .cloud = points});
  }
  constexpr double kTolerance = 1e-12;  // of places; the box is 1
  const core::RunContext context;
  if (const absl::Status status = core::ValidateDomainMesh(view, mesh.facets, rho, context).status(); !status.ok()) {
    return status;
  }
  core::DomainView domain;
  domain.points = points;
  domain.features.ends = segments;
  const core::DomainParts parts = {.boundary = {.facets = mesh.facets, .tags = {}}};
  return core::ValidateConformity(view, parts, domain, kTolerance, context);
}

int Main(int argc, char** argv) {
  CLI::App app("Meshes points in the unit box by Wellspace's core");
  std::string path;
  core::MeshParameters parameters;
  double min_dihedral = 0;
  bool validate = false;
  bool has_segments = false;
  app.add_option("points", path, "file of doubles")->required();
  app.add_option("--dimension", parameters.dimension)->required();
  app.add_option("--rho", parameters.rho)->required();
  app.add_option("--threads", parameters.threads)->capture_default_str();
  app.add_option("--min-dihedral", min_dihedral)->capture_default_str();
  app.add_flag("--validate", validate, "check every promise about the mesh, after the measurement");
  app.add_flag("--segments", has_segments, "each two points in a row are the ends of a segment");
  CLI11_PARSE(app, argc, argv);
  const std::vector<double> points = ReadPoints(path);
  parameters.min_dihedral = min_dihedral;
  parameters.domain_low.assign(parameters.dimension, 0);
  parameters.domain_high.assign(parameters.dimension, 1);

  std::vector<uint32_t> segments(has_segments ? points.size() / 4 * 2 : 0);
  std::iota(segments.begin(), segments.end(), 0);

  core::RunContext context;
  const Meter meter(parameters.threads);
  const auto mesher = OrExit(Create(parameters, points, segments, context));
  const double created = meter.Seconds();
  if (const absl::Status status = mesher->Refine(parameters, context); !status.ok()) {
    std::cerr << "wellspace: " << status << '\n';
    return 1;
  }
  const double refined = meter.Seconds();
  const core::Mesh mesh = OrExit(mesher->Extract(parameters.threads, context));
  const double seconds = meter.Seconds();
  const double wall_seconds = meter.WallSeconds();
  const uint64_t memory = meter.PeakBytes();

  nlohmann::json report = {{"seconds", seconds},
                           {"wall_seconds", wall_seconds},
                           {"create_seconds", created},
                           {"refine_seconds", refined - created},
                           {"extract_seconds", seconds - refined},
                           {"memory_bytes", memory},
                           {"vertices", mesh.vertex_count()},
                           {"simplices", mesh.simplex_count()},
                           {"sort_seconds", SortSeconds(points, parameters.dimension)},
                           {"copy_seconds", CopySeconds(mesh.points, mesh.simplices)},
                           {"max_radius_edge", mesh.statistics.max_radius_edge},
                           {"min_angle_deg", mesh.statistics.min_angle_deg},
                           {"slivers_left", mesh.statistics.slivers_left},
                           {"fingerprint", FingerprintOf(mesh)}};
  if (validate) {
    if (const absl::Status status = Validate(mesh, parameters.rho, points, segments); !status.ok()) {
      std::cerr << "wellspace: " << status << '\n';
      return 1;
    }
    report["validated"] = true;
  }
  std::cout << report << '\n';
  return 0;
}

}  // namespace
}  // namespace wellspace::bench

int main(int argc, char** argv) { return wellspace::bench::Main(argc, argv); }
