// The parts of a mesh, each alone: tree construction against a radix sort, cells, stars, the stages of the predicate.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bench/drivers/floor.h"
#include "core/geometry/power_predicate.h"
#include "core/input/frame.h"
#include "core/input/mesh_parameters.h"
#include "core/input/sorted_cloud.h"
#include "core/mesh/mesh_locator.h"
#include "core/meshers/mesher.h"
#include "core/refine/refine.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::bench {
namespace {

using core::Point;
using core::VertexId;

constexpr uint64_t kMaxLeaves = uint64_t{1} << 32;
// Cells are clipped at this times the distance to the nearest neighbour.
constexpr double kBeta = 4;

void ExitUnless(const absl::Status& status) {
  if (!status.ok()) {
    std::cerr << "bench_micro: " << status << '\n';
    std::exit(1);
  }
}

// Uniform in the unit box, the same in every run.
std::vector<double> UniformPoints(int dimension, int64_t count) {
  std::mt19937_64 random(1);
  std::vector<double> points(static_cast<size_t>(count * dimension));
  for (double& x : points) {
    x = std::ldexp(static_cast<double>(random() >> 11), -53);
  }
  return points;
}

template <int D>
core::Frame<D> UnitDomain() {
  core::Box<D> box;
  box.low.fill(0);
  box.high.fill(1);
  auto domain = core::Frame<D>::Of(box);
  ExitUnless(domain.status());
  return *domain;
}

template <int D>
core::SortedCloud<D> Sorted(const std::vector<double>& points) {
  auto cloud = core::SortCloud<D>(UnitDomain<D>(), points, 1, core::RunContext());
  ExitUnless(cloud.status());
  return *std::move(cloud);
}

// The structure over uniform points, as it is before refinement or after.
template <int D>
core::QueryStructure<D> Structure(int64_t count, bool is_refined) {
  core::RunContext context;
  core::QueryStructure<D> structure;
  core::SortedCloud<D> cloud = Sorted<D>(UniformPoints(D, count));
  ExitUnless(structure.Initialize(cloud.grid, std::move(cloud.points), kMaxLeaves, 1, context));
  if (is_refined) {
    core::BoxRefinement<D> refinement(structure, UnitDomain<D>().grid_step);
    core::MeshCriteria<D> demands;
    demands.rho = core::DefaultRho(D);
    ExitUnless(refinement.Run(demands, core::kMaxVertices, 1, context));
  }
  return structure;
}

void SetItems(benchmark::State& state, int64_t each = 1) { state.SetItemsProcessed(state.iterations() * each); }

// The floor of Initialize. Items are points.
template <int D>
void BM_RadixSort(benchmark::State& state) {
  const std::vector<Keyed> keyed = MortonKeys(UniformPoints(D, state.range(0)), D);
  std::vector<Keyed> sorted(keyed.size());
  std::vector<Keyed> scratch(keyed.size());
  for (auto _ : state) {
    state.PauseTiming();
    sorted = keyed;
    state.ResumeTiming();
    RadixSort(sorted, scratch);
    benchmark::DoNotOptimize(sorted.data());
  }
  SetItems(state, state.range(0));
}

// Points in memory to the mesher: checks, sorting, the tree. Items are points.
template <int D>
void BM_Initialize(benchmark::State& state) {
  const std::vector<double> points = UniformPoints(D, state.range(0));
  core::MeshParameters parameters;
  parameters.dimension = D;
  parameters.domain_low.assign(D, 0);
  parameters.domain_high.assign(D, 1);
  for (auto _ : state) {
    core::RunContext context;
    auto mesher = core::Mesher::Create(parameters, points, context);
    ExitUnless(mesher.status());
    state.PauseTiming();
    mesher->reset();
    state.ResumeTiming();
  }
  SetItems(state, state.range(0));
}

// The sorting of it alone. Items are points.
template <int D>
void BM_SortCloud(benchmark::State& state) {
  const std::vector<double> points = UniformPoints(D, state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(Sorted<D>(points));
  }
  SetItems(state, state.range(0));
}

// The tree of it alone. Items are points.
template <int D>
void BM_Tree(benchmark::State& state) {
  const core::SortedCloud<D> cloud = Sorted<D>(UniformPoints(D, state.range(0)));
  for (auto _ : state) {
    core::QueryStructure<D> structure;
    ExitUnless(structure.Initialize(cloud.grid, cloud.points, kMaxLeaves, 1, core::RunContext()));
    benchmark::DoNotOptimize(structure.vertex_count());
  }
  SetItems(state, state.range(0));
}

// Calls query(v) for one vertex after the other; items are vertices.
template <int D, typename Query>
void RunQueries(benchmark::State& state, const core::QueryStructure<D>& structure, core::Workspace<D>& workspace,
                Query query) {
  uint32_t next = 0;
  for (auto _ : state) {
    query(VertexId{next});
    next = next + 1 == structure.vertex_count() ? 0 : next + 1;
  }
  SetItems(state);
  const auto queries = static_cast<double>(state.iterations());
  state.counters["cuts"] = static_cast<double>(workspace.counters.cuts) / queries;
  state.counters["vertices"] = static_cast<double>(workspace.counters.vertices) / queries;
  state.counters["leaves"] = static_cast<double>(workspace.counters.leaves) / queries;
}

// In a refined mesh of so many input points.
template <int D>
void BM_NearestNeighbor(benchmark::State& state) {
  const core::QueryStructure<D> structure = Structure<D>(state.range(0), true);
  core::Workspace<D> workspace;
  RunQueries<D>(state, structure, workspace,
                [&](VertexId v) { benchmark::DoNotOptimize(structure.NearestNeighbor(v, workspace).distance_sq); });
}

template <int D>
void ComputeClippedCells(benchmark::State& state, bool is_refined) {
  const core::QueryStructure<D> structure = Structure<D>(state.range(0), is_refined);
  core::Workspace<D> workspace;
  RunQueries<D>(state, structure, workspace, [&](VertexId v) {
    const double nearest = std::sqrt(structure.NearestNeighbor(v, workspace).distance_sq);
    structure.ClippedVoronoi(v, kBeta * nearest, workspace);
    benchmark::DoNotOptimize(workspace.cell.nodes().data());
  });
}

template <int D>
void BM_ClippedCell(benchmark::State& state) {
  ComputeClippedCells<D>(state, true);
}

// The same before refinement: random points.
template <int D>
void BM_ClippedCellOfInput(benchmark::State& state) {
  ComputeClippedCells<D>(state, false);
}

// The cells of all random points along the Z curve, by one call. Items are vertices.
template <int D>
void BM_ClippedCellsOfInput(benchmark::State& state) {
  const core::QueryStructure<D> structure = Structure<D>(state.range(0), false);
  std::vector<VertexId> sites(static_cast<size_t>(state.range(0)));
  for (uint32_t v = 0; v < sites.size(); ++v) {
    sites[v] = VertexId{v};
  }
  core::Workspace<D> workspace;
  for (auto _ : state) {
    structure.ClippedVoronoiOfEach(sites, kBeta, workspace, [&](VertexId, double) {
      benchmark::DoNotOptimize(workspace.cell.nodes().data());
      return true;
    });
  }
  SetItems(state, state.range(0));
}

// The whole cell, ties perturbed: the simplices at a vertex, in a refined mesh.
template <int D>
void BM_Star(benchmark::State& state) {
  const core::QueryStructure<D> structure = Structure<D>(state.range(0), true);
  core::Workspace<D> workspace;
  RunQueries<D>(state, structure, workspace, [&](VertexId v) {
    structure.Voronoi(v, workspace);
    benchmark::DoNotOptimize(workspace.cell.nodes().data());
  });
}

// A whole cell from its neighbours, which are known: the cuts alone, decided by the filter but for ties, which are
// counted. Items are cuts.
template <int D>
void BM_Cut(benchmark::State& state) {
  const core::QueryStructure<D> structure = Structure<D>(state.range(0), true);
  core::Workspace<D> workspace;
  std::array<core::PlaneKind, 2 * D> kinds;
  kinds.fill(core::PlaneKind::kFace);
  std::vector<std::vector<VertexId>> neighbours(structure.vertex_count());
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    structure.Voronoi(VertexId{v}, workspace);
    for (const core::CellNode<D>& node : workspace.cell.nodes()) {
      for (const uint16_t index : node.planes) {
        if (workspace.cell.plane(index).kind == core::PlaneKind::kBisector) {
          neighbours[v].push_back(workspace.cell.plane(index).vertex);
        }
      }
    }
    std::sort(neighbours[v].begin(), neighbours[v].end());
    neighbours[v].erase(std::unique(neighbours[v].begin(), neighbours[v].end()), neighbours[v].end());
  }
  core::Polytope<D> cell;
  int64_t cuts = 0;
  uint32_t v = 0;
  for (auto _ : state) {
    cell.Reset(structure.point(VertexId{v}), structure.box(), kinds, core::TieRule::kPerturb);
    for (const VertexId u : neighbours[v]) {
      benchmark::DoNotOptimize(cell.Cut(u, structure.point(u)));
    }
    cuts += static_cast<int64_t>(neighbours[v].size());
    v = v + 1 == structure.vertex_count() ? 0 : v + 1;
  }
  state.SetItemsProcessed(cuts);
  state.counters["exact"] = static_cast<double>(cell.counters().exact) / static_cast<double>(cuts);
}

// One decision by one of the stages after the filter: coordinates whose differences span as many bits as it serves.
template <int D>
void Decide(benchmark::State& state, core::Stage stage) {
  constexpr size_t kDecisions = 1024;
  struct Decision {
    Point<D> site;
    std::array<core::PlaneSource<D>, D> planes;
    Point<D> u;
  };
  const int least = stage == core::Stage::kWideInteger ? -80 : stage == core::Stage::kBigInteger ? -200 : 0;
  std::mt19937_64 random(1);
  const uint64_t most = stage == core::Stage::kWord ? 256 : 1'000'000'000'000;
  const auto draw = [&](Point<D>& p) {
    for (double& x : p) {
      x = static_cast<double>(random() % most);
    }
  };
  std::vector<Decision> decisions(kDecisions);
  for (Decision& decision : decisions) {
    // Dependent planes would be improbable; the seed is fixed.
    decision.site.fill(0);
    decision.site[0] = std::ldexp(1.0, least);
    draw(decision.u);
    for (core::PlaneSource<D>& plane : decision.planes) {
      draw(plane.generator);
    }
    if (core::DecideCut<D>(decision.site, decision.planes, decision.u, core::TieRule::kPerturb).stage != stage) {
      state.SkipWithError("another stage decides");
      return;
    }
  }
  size_t next = 0;
  for (auto _ : state) {
    const Decision& decision = decisions[next++ % kDecisions];
    benchmark::DoNotOptimize(
        core::DecideCut<D>(decision.site, decision.planes, decision.u, core::TieRule::kPerturb).sign);
  }
  SetItems(state);
}

// A mesh of the unit box by so many sizes at random points, which vary smoothly; the time for each vertex.
template <int D>
void BM_MeshBySamples(benchmark::State& state) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit;
  const double mean = D == 2 ? 0.003 : 0.03;
  auto samples = std::make_shared<core::SizeSamples>();
  for (int64_t i = 0; i < state.range(0); ++i) {
    double sum = 0;
    for (int k = 0; k < D; ++k) {
      samples->points.push_back(unit(random));
      sum += std::sin(2 * std::numbers::pi * samples->points.back());
    }
    samples->sizes.push_back(mean * (1 + 0.2 * sum / D));
  }
  core::MeshParameters parameters{.dimension = D, .max_circumradius = mean};
  parameters.size_samples = samples;
  parameters.domain_low.assign(D, 0);
  parameters.domain_high.assign(D, 1);
  double vertices = 0;
  for (auto _ : state) {
    core::RunContext context;
    const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, {}, context);
    ExitUnless(mesh.status());
    vertices += static_cast<double>(mesh->vertex_count());
  }
  state.counters["per_vertex"] =
      benchmark::Counter(vertices, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Points anywhere in a mesh of 10^5 points, by one thread, all at once. Items are points.
template <int D>
void BM_Locate(benchmark::State& state) {
  core::MeshParameters parameters{.dimension = D};
  parameters.domain_low.assign(D, 0);
  parameters.domain_high.assign(D, 1);
  core::RunContext context;
  absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, UniformPoints(D, 100'000), context);
  ExitUnless(mesh.status());
  const auto locator = core::MeshLocator::Create(*std::move(mesh), context);
  ExitUnless(locator.status());
  std::vector<double> points(static_cast<size_t>(D * state.range(0)));
  std::mt19937_64 random(2);
  std::ranges::generate(points, [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); });
  for (auto _ : state) {
    const auto located = (*locator)->Locate(points, context);
    ExitUnless(located.status());
    benchmark::DoNotOptimize(located->simplices.data());
  }
  SetItems(state, state.range(0));
}

template <int D>
void RegisterAll() {
  const std::string suffix = "/" + std::to_string(D) + "-D";
  const auto add = [&](const char* name, auto function) {
    return benchmark::RegisterBenchmark((name + suffix).c_str(), function)->ArgName("points");
  };
  const auto add_with_sizes = [&](const char* name, auto function) {
    add(name, function)->RangeMultiplier(10)->Range(10'000, 1'000'000)->Unit(benchmark::kMillisecond);
  };
  add_with_sizes("RadixSort", BM_RadixSort<D>);
  add_with_sizes("Initialize", BM_Initialize<D>);
  add_with_sizes("SortCloud", BM_SortCloud<D>);
  add_with_sizes("Tree", BM_Tree<D>);
  const auto add_queries = [&](const char* name, auto function) {
    add(name, function)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMicrosecond);
  };
  add_queries("NearestNeighbor", BM_NearestNeighbor<D>);
  add_queries("ClippedCell", BM_ClippedCell<D>);
  add_queries("ClippedCellOfInput", BM_ClippedCellOfInput<D>);
  add("ClippedCellsOfInput", BM_ClippedCellsOfInput<D>)->Arg(100'000)->Unit(benchmark::kMillisecond);
  add_queries("Star", BM_Star<D>);
  add("Locate", BM_Locate<D>)->Arg(1'000'000)->Unit(benchmark::kMillisecond);
  add("MeshBySamples", BM_MeshBySamples<D>)
      ->Arg(10)
      ->Arg(1'000)
      ->Arg(40'000)
      ->Arg(1'000'000)
      ->Unit(benchmark::kMillisecond);
  add("Cut", BM_Cut<D>)->Arg(10'000)->Unit(benchmark::kMicrosecond);
  for (const auto& [name, stage] :
       {std::pair("DecideCut/Word", core::Stage::kWord), std::pair("DecideCut/Integer", core::Stage::kInteger),
        std::pair("DecideCut/WideInteger", core::Stage::kWideInteger),
        std::pair("DecideCut/BigInteger", core::Stage::kBigInteger)}) {
    benchmark::RegisterBenchmark((name + suffix).c_str(), [stage = stage](benchmark::State& state) {
      Decide<D>(state, stage);
    })->Unit(benchmark::kMicrosecond);
  }
}

}  // namespace
}  // namespace wellspace::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) {
    return 1;
  }
  wellspace::bench::RegisterAll<2>();
  wellspace::bench::RegisterAll<3>();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
