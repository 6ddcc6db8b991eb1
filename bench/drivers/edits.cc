// Makes a mesh by Wellspace's core, adds points to it, one after the other and by batches, and reports one JSON object,
// whose fields bench/README.md has.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iostream>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "CLI/App.hpp"
#include "CLI/Config.hpp"
#include "CLI/Formatter.hpp"
#include "absl/strings/str_cat.h"
#include "bench/drivers/meter.h"
#include "bench/drivers/places.h"
#include "bench/drivers/results.h"
#include "core/meshers/mesher.h"
#include "nlohmann/json.hpp"

namespace wellspace::bench {
namespace {

// Meshes that are equal to the bit, in the order of their rows, have equal ones.
uint64_t FingerprintOf(const core::Mesh& mesh, uint64_t hash) {
  hash = Hash(mesh.points, hash);
  hash = Hash(mesh.simplices, hash);
  hash = Hash(mesh.input_vertex, hash);
  hash = Hash(mesh.moved_vertices, hash);
  hash = Hash(mesh.vertex_origins, hash);
  hash = Hash(mesh.vertex_tags, hash);
  hash = Hash(mesh.facets, hash);
  hash = Hash(mesh.simplex_regions, hash);
  hash = Hash(std::vector<double>{mesh.statistics.max_radius_edge, mesh.statistics.min_angle_deg}, hash);
  return Hash(std::vector<uint64_t>{mesh.statistics.sliver_operations, mesh.statistics.slivers_left}, hash);
}

// The processor's time, which says more on a busy machine than the wall clock's: all runs on one thread.
double Now() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The parts of edits that were measured, in seconds.
struct Parts {
  std::vector<double> add;
  std::vector<double> refine;
  std::vector<double> update;
  std::vector<double> all;
};

struct Options {
  int dimension = 3;
  bool has_segments = false;
  double min_dihedral = -1;  // below 0: the default
  int edits = 20;
  int batch = 1;
};

core::MeshParameters ParametersOf(const Options& options) {
  core::MeshParameters parameters{.dimension = options.dimension};
  parameters.domain_low.assign(options.dimension, 0);
  parameters.domain_high.assign(options.dimension, 1);
  if (options.min_dihedral >= 0) {
    parameters.min_dihedral = options.min_dihedral;
  }
  return parameters;
}

// Edits `mesh`, which `mesher` has made. Sets `fingerprint` to that of all meshes.
Parts Edit(const Options& options, core::Mesher& mesher, core::Mesh& mesh, uint64_t& fingerprint) {
  const core::MeshParameters parameters = ParametersOf(options);
  core::RunContext context;
  Places places;
  Parts parts;
  std::vector<double> added(static_cast<size_t>(options.batch) * options.dimension);
  fingerprint = FingerprintOf(mesh, kFirstHash);
  for (int edit = 0; edit < options.edits; ++edit) {
    std::ranges::generate(added, [&] { return places.Next(); });
    const double start = Now();
    OrExit(mesher.AddPoints(added, context));
    parts.add.push_back(Now() - start);
    const double refining = Now();
    ExitUnless(mesher.Refine(parameters, context));
    parts.refine.push_back(Now() - refining);
    const double updating = Now();
    ExitUnless(mesher.Update(mesh, 1, context));
    parts.update.push_back(Now() - updating);
    parts.all.push_back(Now() - start);
    fingerprint = FingerprintOf(mesh, fingerprint);
  }
  return parts;
}

int Main(int argc, char** argv) {
  CLI::App app("Adds points to a mesh in the unit box by Wellspace's core");
  std::string path;
  Options options;
  app.add_option("points", path, "file of doubles")->required();
  app.add_option("--dimension", options.dimension)->capture_default_str();
  app.add_flag("--segments", options.has_segments, "each two points in a row are the ends of a segment");
  app.add_option("--min-dihedral", options.min_dihedral, "in degrees; below 0: the default");
  app.add_option("--edits", options.edits, "how often points are added")->check(CLI::PositiveNumber);
  app.add_option("--batch", options.batch, "points of each edit")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  const std::vector<double> points = ReadPoints(path);
  std::vector<uint32_t> ends(options.has_segments ? points.size() / 4 * 2 : 0);
  std::iota(ends.begin(), ends.end(), 0);

  const core::MeshParameters parameters = ParametersOf(options);
  core::RunContext context;
  const double begin = Now();
  core::Features features;
  features.ends = ends;
  const std::unique_ptr<core::Mesher> mesher =
      OrExit(options.has_segments ? core::Mesher::Create(parameters, {points, features}, context)
                                  : core::Mesher::Create(parameters, points, context));
  ExitUnless(mesher->Refine(parameters, context));
  core::Mesh mesh = OrExit(mesher->Extract(1, context));
  const double make_seconds = Now() - begin;
  const uint64_t vertices = mesh.vertex_count();
  uint64_t fingerprint = 0;
  const Parts parts = Edit(options, *mesher, mesh, fingerprint);
  const double extracting = Now();
  OrExit(mesher->Extract(1, context));
  const nlohmann::json report = {{"vertices", vertices},
                                 {"make_seconds", make_seconds},
                                 {"extract_seconds", Now() - extracting},
                                 {"first_seconds", parts.all.front()},
                                 {"edit_seconds", Quantile(parts.all, 0.5)},
                                 {"longest_seconds", *std::ranges::max_element(parts.all)},
                                 {"add_seconds", Quantile(parts.add, 0.5)},
                                 {"refine_seconds", Quantile(parts.refine, 0.5)},
                                 {"update_seconds", Quantile(parts.update, 0.5)},
                                 {"fingerprint", absl::StrCat(absl::Hex(fingerprint, absl::kZeroPad16))}};
  std::cout << report << '\n';
  return 0;
}

}  // namespace
}  // namespace wellspace::bench

int main(int argc, char** argv) { return wellspace::bench::Main(argc, argv); }
