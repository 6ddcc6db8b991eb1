#include "tests/core/growth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/core/domain_input.h"
#include "tests/support/clouds.h"

namespace wellspace::test {
namespace {

// Measured from 10^3 to 10^6: at most 1.15 (visits of uniform points in 3-D). Work that grew like log n would double.
constexpr double kMostGrowth = 1.25;

// Averages over the queries of one run. Visits and cuts are divided by simplices per vertex, a measure of the cells
// themselves: a cell at the box has fewer nodes, and the share of vertices there falls slowly. (In 3-D, uniform points
// have 4.6 simplices a vertex for n = 10^3 and 6.1 for 10^6; unbounded meshes have 6.5. The plain visits a query rise
// likewise, from 88 to 125, and end there.)
struct Work {
  double queries_per_vertex;
  double visits_per_query;  // leaves and vertices, since the size of leaves shifts one to the other
  double cuts_per_query;
  double visits_per_star;
  double cuts_per_star;
  double star_share;  // of all visits, those for stars
};

double Ratio(uint64_t a, uint64_t b) { return static_cast<double>(a) / static_cast<double>(b); }

Work WorkOf(const core::MeshStatistics& s) {
  const double cell_size = Ratio(s.simplices, s.vertices);
  return {.queries_per_vertex = Ratio(s.cells_computed, s.vertices),
          .visits_per_query = Ratio(s.leaves_visited + s.vertices_visited, s.cells_computed) / cell_size,
          .cuts_per_query = Ratio(s.cuts, s.cells_computed) / cell_size,
          .visits_per_star = Ratio(s.star_leaves_visited + s.star_vertices_visited, s.stars_computed) / cell_size,
          .cuts_per_star = Ratio(s.star_cuts, s.stars_computed) / cell_size,
          .star_share = Ratio(s.star_leaves_visited + s.star_vertices_visited, s.leaves_visited + s.vertices_visited)};
}

// The work for meshes of these sizes, of which that of the queries is expected to be constant.
std::vector<Work> ExpectConstantQueries(std::span<const size_t> sizes,
                                        const std::function<absl::StatusOr<core::Mesh>(size_t size)>& make_mesh) {
  std::vector<Work> work;
  for (const size_t n : sizes) {
    SCOPED_TRACE(n);
    const absl::StatusOr<core::Mesh> mesh = make_mesh(n);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    work.push_back(WorkOf(mesh.ok() ? mesh->statistics : core::MeshStatistics()));
    EXPECT_LE(work.back().queries_per_vertex, kMostGrowth * work.front().queries_per_vertex);
    EXPECT_LE(work.back().visits_per_query, kMostGrowth * work.front().visits_per_query);
    EXPECT_LE(work.back().cuts_per_query, kMostGrowth * work.front().cuts_per_query);
  }
  return work;
}

DomainInput RandomSegments(size_t count) {
  DomainInput input;
  input.faces = core::FaceRule::kBox;
  input.parameters.domain_low = {0, 0};
  input.parameters.domain_high = {1, 1};
  SplitMix64 random(count);
  const auto side = static_cast<size_t>(std::sqrt(static_cast<double>(count)));
  const double cell = 1.0 / static_cast<double>(side);
  for (size_t i = 0; i < side * side; ++i) {
    const auto place = [&]() -> core::Point<2> {
      return {(static_cast<double>(i % side) + 0.05 + 0.9 * random.Unit()) * cell,
              (static_cast<double>(i / side) + 0.05 + 0.9 * random.Unit()) * cell};
    };
    const core::Point<2> a = place();
    input.Segment(a, place());
  }
  return input;
}

// As many steps as make `count` segments, or a few more.
DomainInput Snowflake(size_t count) {
  std::vector<core::Point<2>> ring = {{0, 0}, {0.5, std::sqrt(0.75)}, {1, 0}};
  while (ring.size() < count) {
    std::vector<core::Point<2>> finer;
    for (size_t i = 0; i < ring.size(); ++i) {
      const auto [ax, ay] = ring[i];
      const auto [bx, by] = ring[(i + 1) % ring.size()];
      const double x = (bx - ax) / 3;
      const double y = (by - ay) / 3;
      finer.insert(finer.end(), {{ax, ay},
                                 {ax + x, ay + y},
                                 {ax + 1.5 * x - std::sqrt(0.75) * y, ay + 1.5 * y + std::sqrt(0.75) * x},
                                 {ax + 2 * x, ay + 2 * y}});
    }
    ring = std::move(finer);
  }
  return DomainInput().Ring(ring);
}

DomainInput HoleInABox(size_t count) {
  DomainInput input;
  input.Circle({0.5, 0.5}, 0.25, static_cast<int>(count));
  input.faces = core::FaceRule::kBox;
  input.seeds.push_back({.at = {0.5, 0.5}, .is_hole = true});
  input.parameters.domain_low = {0, 0};
  input.parameters.domain_high = {1, 1};
  return input;
}

}  // namespace

void ExpectConstantWork(std::string_view kind, int dimension, std::span<const size_t> sizes) {
  const std::vector<Work> work = ExpectConstantQueries(sizes, [&](size_t size) {
    core::MeshParameters parameters;
    parameters.dimension = dimension;
    parameters.min_dihedral = 0;  // of the query structure's work none is there
    parameters.domain_low = UnitLow(dimension);
    parameters.domain_high = UnitHigh(dimension);
    core::RunContext context;
    return core::MeshPoints(parameters, MakeCloud(kind, dimension, size), context);
  });
  for (const Work& of_size : work) {
    EXPECT_GT(of_size.visits_per_star, 0);
    EXPECT_LE(of_size.visits_per_star, kMostGrowth * work.front().visits_per_star);
    EXPECT_LE(of_size.cuts_per_star, kMostGrowth * work.front().cuts_per_star);
  }
}

void ExpectConstantWorkInDomains(std::string_view kind, std::span<const size_t> sizes) {
  const std::vector<Work> work = ExpectConstantQueries(sizes, [&](size_t size) {
    return (kind == "random" ? RandomSegments(size) : kind == "coast" ? Snowflake(size) : HoleInABox(size)).Make();
  });
  // Triangles are listed by the refinement. Stars are computed where a list is stale: 0.07 to 0.13 of the visits.
  for (const Work& of_size : work) {
    EXPECT_LE(of_size.star_share, 0.2);
  }
}

}  // namespace wellspace::test
