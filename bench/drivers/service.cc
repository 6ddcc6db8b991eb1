// Asks a server for small meshes, or edits a session of it, and reports one JSON object, whose fields bench/README.md
// has.
//
//   bench_service jobs ADDRESS [OPTION…]
//   bench_service edits ADDRESS [OPTION…]
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "CLI/App.hpp"
#include "CLI/Config.hpp"
#include "CLI/Formatter.hpp"
#include "bench/drivers/places.h"
#include "bench/drivers/results.h"
#include "client/client.h"
#include "core/base/processor_time.h"
#include "core/meshers/mesher.h"
#include "nlohmann/json.hpp"

namespace wellspace::bench {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Options {
  std::string address;
  int dimension = 2;
  uint64_t points = 1000;
  int clients = 2;
  double seconds = 3;
  int edits = 20;
};

std::vector<double> PointsOf(const Options& options) {
  Places places;
  std::vector<double> points(options.points * options.dimension);
  std::ranges::generate(points, [&] { return places.Next(); });
  return points;
}

client::MeshOptions MeshOptionsOf(const Options& options) {
  client::MeshOptions mesh;
  mesh.dimension = options.dimension;
  mesh.domain_low.assign(options.dimension, 0);
  mesh.domain_high.assign(options.dimension, 1);
  mesh.threads = 1;
  return mesh;
}

// The processor's time of the same mesh in the library: a median.
double SecondsInLibrary(const Options& options) {
  core::MeshParameters parameters{.dimension = options.dimension};
  parameters.domain_low.assign(options.dimension, 0);
  parameters.domain_high.assign(options.dimension, 1);
  parameters.threads = 1;
  const std::vector<double> points = PointsOf(options);
  std::vector<double> times;
  for (int turn = 0; turn < 21; ++turn) {
    core::RunContext context;
    const absl::Duration start = core::ProcessorTime();
    OrExit(core::MeshPoints(parameters, points, context));
    times.push_back(absl::ToDoubleSeconds(core::ProcessorTime() - start));
  }
  return Quantile(times, 0.5);
}

// Small meshes, `clients` calls at a time.
int Jobs(const Options& options) {
  const std::vector<double> points = PointsOf(options);
  const client::MeshOptions mesh = MeshOptionsOf(options);
  std::vector<std::vector<double>> times(options.clients);
  const Clock::time_point start = Clock::now();
  std::vector<std::thread> threads;
  for (std::vector<double>& mine : times) {
    threads.emplace_back([&] {
      client::Client client = OrExit(client::Connect(options.address));
      while (SecondsSince(start) < options.seconds) {
        const Clock::time_point begin = Clock::now();
        OrExit(client.MeshPoints(mesh, points));
        mine.push_back(SecondsSince(begin));
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  const double seconds = SecondsSince(start);
  std::vector<double> all;
  for (const std::vector<double>& mine : times) {
    all.insert(all.end(), mine.begin(), mine.end());
  }
  std::cout << nlohmann::json{{"jobs", all.size()},
                              {"seconds", seconds},
                              {"median_seconds", Quantile(all, 0.5)},
                              {"p99_seconds", Quantile(all, 0.99)},
                              {"library_seconds", SecondsInLibrary(options)}}
            << '\n';
  return 0;
}

// One point after the other is added to the mesh of a session, of which the client keeps a copy up to date.
int Edits(const Options& options) {
  client::Client client = OrExit(client::Connect(options.address));
  client::SessionOptions settings;
  settings.parameters = MeshOptionsOf(options);
  const std::string session = OrExit(client.CreateSession(settings)).name;
  const std::vector<double> points = PointsOf(options);
  client::SpanSource cloud(options.dimension, points);
  OrExit(client.UploadPoints(session, cloud));
  const auto refine = [&] {
    const client::Operation begun = OrExit(client.StartRefinement(session));
    ExitUnless(OrExit(client.WatchOperation(begun.name)).error);
  };
  Clock::time_point start = Clock::now();
  refine();
  const double make_seconds = SecondsSince(start);
  client::MeshCollector collector;
  ExitUnless(client.DownloadMesh(session, collector));
  client::Mesh& mesh = collector.mesh();
  const uint64_t vertices = mesh.points.size() / options.dimension;
  Places places(2);
  std::vector<double> uploads;
  std::vector<double> refinements;
  std::vector<double> updates;
  std::vector<double> all;
  std::vector<double> point(options.dimension);
  for (int edit = 0; edit < options.edits; ++edit) {
    std::ranges::generate(point, [&] { return places.Next(); });
    client::SpanSource source(options.dimension, point);
    const Clock::time_point begin = Clock::now();
    OrExit(client.UploadPoints(session, source));
    uploads.push_back(SecondsSince(begin));
    start = Clock::now();
    refine();
    refinements.push_back(SecondsSince(start));
    start = Clock::now();
    ExitUnless(client.UpdateMesh(session, mesh));
    updates.push_back(SecondsSince(start));
    all.push_back(SecondsSince(begin));
  }
  ExitUnless(client.DeleteSession(session));
  std::cout << nlohmann::json{{"vertices", vertices},
                              {"make_seconds", make_seconds},
                              {"first_seconds", all.front()},
                              {"edit_seconds", Quantile(all, 0.5)},
                              {"upload_seconds", Quantile(uploads, 0.5)},
                              {"refine_seconds", Quantile(refinements, 0.5)},
                              {"update_seconds", Quantile(updates, 0.5)}}
            << '\n';
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App app("Asks a server of Wellspace for small meshes, or edits a session of it");
  app.require_subcommand(1);
  Options options;
  CLI::App* const jobs = app.add_subcommand("jobs", "small meshes, each by a call");
  CLI::App* const edits = app.add_subcommand("edits", "points that are added to a session, one after the other");
  for (CLI::App* command : {jobs, edits}) {
    command->add_option("address", options.address, "HOST:PORT of the server")->required();
    command->add_option("--dimension", options.dimension)->capture_default_str();
    command->add_option("--points", options.points, "of each mesh")->capture_default_str();
  }
  jobs->add_option("--clients", options.clients, "calls at a time")->check(CLI::PositiveNumber)->capture_default_str();
  jobs->add_option("--seconds", options.seconds, "how long")->check(CLI::PositiveNumber)->capture_default_str();
  edits->add_option("--edits", options.edits, "how many")->check(CLI::PositiveNumber)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return jobs->parsed() ? Jobs(options) : Edits(options);
}

}  // namespace
}  // namespace wellspace::bench

int main(int argc, char** argv) { return wellspace::bench::Main(argc, argv); }
