// Meshes points in the unit box by Wellspace's core and reports one JSON object: bench/README.md has its fields.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <span>
#include <string>
#include <vector>

#include "CLI/App.hpp"
#include "CLI/Config.hpp"
#include "CLI/Formatter.hpp"
#include "absl/strings/str_cat.h"
#include "bench/drivers/floor.h"
#include "bench/drivers/meter.h"
#include "core/mesher.h"
#include "core/simplex/validate.h"
#include "nlohmann/json.hpp"

namespace wellspace::bench {
namespace {

template <typename T>
T OrExit(absl::StatusOr<T> result) {
  if (!result.ok()) {
    std::cerr << "wellspace: " << result.status() << '\n';
    std::exit(1);
  }
  return *std::move(result);
}

// FNV-1a of the words of the mesh: equal meshes have equal ones.
class Fingerprint {
 public:
  template <typename T>
  void Add(std::span<const T> values) {
    for (const T value : values) {
      uint64_t word = 0;
      std::memcpy(&word, &value, sizeof(value));
      hash_ = (hash_ ^ word) * 0x100000001b3;
    }
  }
  std::string Text() const { return absl::StrCat(absl::Hex(hash_, absl::kZeroPad16)); }

 private:
  uint64_t hash_ = 0xcbf29ce484222325;
};

int Main(int argc, char** argv) {
  CLI::App app("Meshes points in the unit box by Wellspace's core");
  std::string path;
  core::MeshParameters parameters;
  double min_dihedral = 0;
  bool validate = false;
  app.add_option("points", path, "file of doubles")->required();
  app.add_option("--dimension", parameters.dimension)->required();
  app.add_option("--rho", parameters.rho)->required();
  app.add_option("--threads", parameters.threads)->capture_default_str();
  app.add_option("--min-dihedral", min_dihedral)->capture_default_str();
  app.add_flag("--validate", validate, "check every promise about the mesh, after the measurement");
  CLI11_PARSE(app, argc, argv);
  const std::vector<double> points = ReadPoints(path);
  parameters.min_dihedral = min_dihedral;
  parameters.domain_low.assign(parameters.dimension, 0);
  parameters.domain_high.assign(parameters.dimension, 1);

  core::RunContext context;
  const Meter meter(parameters.threads);
  const auto mesher = OrExit(core::Mesher::Create(parameters, points, context));
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

  Fingerprint fingerprint;
  fingerprint.Add<double>(mesh.points);
  fingerprint.Add<uint32_t>(mesh.simplices);
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
                           {"fingerprint", fingerprint.Text()}};
  if (validate) {
    const core::MeshView view{mesh.dimension, mesh.points, mesh.simplices, mesh.weights};
    if (const absl::Status status = core::ValidateMesh(view, {.rho = parameters.rho, .cloud = points}); !status.ok()) {
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
