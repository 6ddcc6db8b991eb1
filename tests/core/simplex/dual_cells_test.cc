// Voronoi cells within the domain, by their volumes, neighbours and facets.
#include "core/simplex/dual_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/geometry/point.h"
#include "core/meshers/mesher.h"
#include "tests/core/domain_input.h"
#include "tests/support/clouds.h"
#include "tests/support/meshes.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

using ::testing::DoubleNear;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;

constexpr double kRounding = 1e-12;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

DelaunayMesh ViewOf(const Mesh& mesh) {
  return {mesh.dimension, mesh.points, mesh.simplices, mesh.facets, mesh.weights};
}

DualCells MustFind(const DelaunayMesh& mesh, int threads = 1) {
  absl::StatusOr<DualCells> cells = FindDualCells(mesh, threads, RunContext());
  EXPECT_TRUE(cells.ok()) << cells.status();
  return cells.ok() ? *std::move(cells) : DualCells();
}

Mesh MustMesh(const MeshParameters& parameters, const std::vector<double>& cloud) {
  RunContext context;
  absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : Mesh();
}

double Sum(std::span<const double> values) { return std::accumulate(values.begin(), values.end(), 0.0); }

// The ends of all edges of the simplices: an oracle.
std::set<std::pair<uint32_t, uint32_t>> EdgesOf(const DelaunayMesh& mesh) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  const size_t width = mesh.dimension + 1;
  for (size_t at = 0; at < mesh.simplices.size(); at += width) {
    for (size_t i = 0; i < width; ++i) {
      for (size_t j = 0; j < i; ++j) {
        edges.insert(std::minmax(mesh.simplices[at + i], mesh.simplices[at + j]));
      }
    }
  }
  return edges;
}

// The direction out of the domain at a facet, of length 1.
template <int D>
Point<D> Outward(const DelaunayMesh& mesh, size_t facet) {
  std::array<Point<D>, D> p;
  for (int k = 0; k < D; ++k) {
    p[k] = PointAt<D>(mesh.points, mesh.facets[facet * D + k]);
  }
  const Point<D> a = Difference<D>(p[1], p[0]);
  Point<D> out;
  if constexpr (D == 2) {
    out = {a[1], -a[0]};
  } else {
    const Point<D> b = Difference<D>(p[2], p[0]);
    out = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  const double length = std::sqrt(NormSq<D>(out));
  for (double& x : out) x /= length;
  return out;
}

// For each cell the sum of its facets' areas times their directions, those on the boundary included.
template <int D>
std::vector<double> Gaps(const DelaunayMesh& mesh, const DualCells& cells) {
  std::vector<double> gaps(mesh.points.size());
  const auto add = [&](uint32_t vertex, const Point<D>& direction, double area) {
    for (int k = 0; k < D; ++k) gaps[size_t{vertex} * D + k] += direction[k] * area;
  };
  for (size_t e = 0; e < cells.areas.size(); ++e) {
    const uint32_t from = cells.edges[2 * e];
    const uint32_t to = cells.edges[2 * e + 1];
    const Point<D> along = Difference<D>(PointAt<D>(mesh.points, to), PointAt<D>(mesh.points, from));
    add(from, along, cells.areas[e] / cells.lengths[e]);
    add(to, along, -cells.areas[e] / cells.lengths[e]);
  }
  for (size_t at = 0; at < mesh.facets.size(); ++at) {
    add(mesh.facets[at], Outward<D>(mesh, at / D), cells.facet_areas[at]);
  }
  return gaps;
}

// Expects the laws that hold for every mesh of a domain with this volume and surface.
void ExpectDual(const DelaunayMesh& mesh, const DualCells& cells, double volume, double surface) {
  EXPECT_NEAR(Sum(cells.volumes), volume, kRounding * volume);
  EXPECT_NEAR(Sum(cells.facet_areas), surface, kRounding * surface);
  EXPECT_THAT(cells.volumes, Each(testing::Gt(0)));
  EXPECT_THAT(cells.areas, Each(testing::Gt(-kRounding)));
  std::vector<uint32_t> edges;
  for (const auto& [low, high] : EdgesOf(mesh)) edges.insert(edges.end(), {low, high});
  EXPECT_TRUE(std::equal(edges.begin(), edges.end(), cells.edges.begin(), cells.edges.end()));
  const auto gaps = mesh.dimension == 2 ? Gaps<2>(mesh, cells) : Gaps<3>(mesh, cells);
  EXPECT_THAT(gaps, Each(DoubleNear(0, kRounding)));
  std::vector<double> on_boundary(cells.volumes.size());
  for (size_t at = 0; at < mesh.facets.size(); ++at) on_boundary[mesh.facets[at]] += cells.facet_areas[at];
  for (const uint32_t vertex : mesh.facets) EXPECT_GT(on_boundary[vertex], 0);
}

class DualOfCloudTest : public testing::TestWithParam<std::string_view> {};

// By the results of the Python package's Mesh.dual_cells() for these meshes, in another way.
TEST(DualCellsTest, TwoTrianglesAreAsInPython) {
  const std::vector<double> points = {0, 0, 3, 0, 2, 1.5, -0.5, 2};
  const std::vector<uint32_t> simplices = {0, 1, 2, 0, 2, 3};
  const std::vector<uint32_t> facets = {0, 1, 1, 2, 2, 3, 3, 0};
  const DualCells cells = MustFind({2, points, simplices, facets});
  const std::vector<double> volumes = {1.4287280701754386, 0.6041666666666665, 1.7746710526315788, 0.8174342105263157};
  const std::vector<double> areas = {0.08333333333333333, 1.4254385964912282, 0.9222736267828977, 1.201850425154663,
                                     0.5367388961676616};
  const std::vector<double> lengths = {3, 2.5, 2.0615528128088303, 1.8027756377319946, 2.5495097567963922};
  const std::vector<double> facet_areas = {1.5,
                                           1.5,
                                           0.9013878188659973,
                                           0.9013878188659973,
                                           1.2747548783981961,
                                           1.2747548783981961,
                                           1.0307764064044151,
                                           1.0307764064044151};
  EXPECT_THAT(cells.edges, ElementsAre(0, 1, 0, 2, 0, 3, 1, 2, 2, 3));
  EXPECT_THAT(cells.volumes, Pointwise(DoubleNear(1e-15), volumes));
  EXPECT_THAT(cells.areas, Pointwise(DoubleNear(1e-15), areas));
  EXPECT_THAT(cells.lengths, Pointwise(DoubleNear(1e-15), lengths));
  EXPECT_THAT(cells.facet_areas, Pointwise(DoubleNear(1e-15), facet_areas));
}

TEST(DualCellsTest, TwoTetrahedraAreAsInPython) {
  const std::vector<double> points = {0, 0, 0, 1, 0, 0, 0.25, 1, 0, 0.5, 0.25, 1, 0.5, 0.5, -0.75};
  const std::vector<uint32_t> simplices = {0, 1, 2, 3, 0, 2, 1, 4};
  const std::vector<uint32_t> facets = {0, 1, 3, 1, 2, 3, 0, 3, 2, 0, 4, 1, 1, 4, 2, 0, 2, 4};
  const DualCells cells = MustFind({3, points, simplices, facets});
  const std::vector<double> volumes = {0.09095260118484538, 0.06582860771134193, 0.06103793380237087,
                                       0.03595085906003757, 0.03789666490807093};
  const std::vector<double> areas = {0.18987162548312597, 0.16977116012187798, 0.08612429566461635,
                                     0.0797264069679341,  0.0536376994933481,  0.06067806167781027,
                                     0.06649108703591072, 0.0372792655949926,  0.08195560255909129};
  const std::vector<double> facet_areas = {
      0.17811209963605704, 0.17811209963605704, 0.15916400393009353, 0.22358752933036946, 0.2027446240538096,
      0.2179031006185804,  0.21192089693935195, 0.16875182534059507, 0.1792170548190816,  0.1516758349053361,
      0.1473422396223265,  0.1516758349053361,  0.1352613072806512,  0.19772931560492138, 0.13990768806510104,
      0.13524962988584943, 0.1471834207581303,  0.1471834207581303};
  EXPECT_THAT(cells.edges, ElementsAre(0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 1, 3, 1, 4, 2, 3, 2, 4));
  EXPECT_THAT(cells.volumes, Pointwise(DoubleNear(1e-15), volumes));
  EXPECT_THAT(cells.areas, Pointwise(DoubleNear(1e-15), areas));
  EXPECT_THAT(cells.facet_areas, Pointwise(DoubleNear(1e-15), facet_areas));
}

TEST(DualCellsTest, ALatticeHasCubes) {
  for (const int d : {2, 3}) {
    const test::TestMesh mesh = test::KuhnGrid(d, 4);
    const DualCells cells = MustFind({d, mesh.points, mesh.simplices});
    EXPECT_TRUE(cells.facet_areas.empty());
    const auto width = [&](uint32_t vertex, int axis) {
      const double x = mesh.points[vertex * d + axis];
      return x == 0 || x == 4 ? 0.5 : 1;
    };
    for (uint32_t v = 0; v < mesh.VertexCount(); ++v) {
      double volume = 1;
      for (int k = 0; k < d; ++k) volume *= width(v, k);
      EXPECT_NEAR(cells.volumes[v], volume, 1e-14) << v;
    }
    for (size_t e = 0; e < cells.areas.size(); ++e) {
      const uint32_t v = cells.edges[2 * e];
      const uint32_t w = cells.edges[2 * e + 1];
      double area = cells.lengths[e] == 1 ? 1 : 0;  // diagonals of cubes have no facets
      for (int k = 0; k < d; ++k) area *= mesh.points[v * d + k] == mesh.points[w * d + k] ? width(v, k) : 1;
      EXPECT_NEAR(cells.areas[e], area, 1e-14) << v << " " << w;
    }
  }
}

// Guarantees 1 and 2.
TEST_P(DualOfCloudTest, CellsFillTheBoxAndAreClosed) {
  for (const auto& [d, min_dihedral] : {std::pair{2, 0.0}, {3, 0.0}, {3, 12.0}}) {
    SCOPED_TRACE(testing::Message() << d << "-D, min_dihedral " << min_dihedral);
    MeshParameters parameters = test::InUnitBox(d);
    parameters.min_dihedral = min_dihedral;
    const Mesh mesh = MustMesh(parameters, test::MakeCloud(GetParam(), d, 400));
    ExpectDual(ViewOf(mesh), MustFind(ViewOf(mesh)), 1, 2 * d);
  }
}

INSTANTIATE_TEST_SUITE_P(Clouds, DualOfCloudTest,
                         testing::Values("uniform", "sphere", "clusters", "moment", "grid", "slanted", "cospherical",
                                         "boundary"),
                         [](const auto& cloud) { return std::string(cloud.param); });

TEST(DualCellsTest, CellsAreThoseOfTheMesher) {
  for (const int d : {2, 3}) {
    RunContext context;
    const MeshParameters parameters = test::InUnitBox(d);
    const auto mesher = Mesher::Create(parameters, test::MakeCloud("uniform", d, 200), context);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
    const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    const DualCells dual = MustFind(ViewOf(*mesh));
    std::vector<uint32_t> vertices(mesh->vertex_count());
    std::iota(vertices.begin(), vertices.end(), 0);
    const absl::StatusOr<std::vector<Cell>> cells = (*mesher)->ClippedCells(vertices, kInfinity);
    ASSERT_TRUE(cells.ok()) << cells.status();
    std::vector<std::vector<uint32_t>> neighbours(vertices.size());
    for (size_t e = 0; e < dual.areas.size(); ++e) {
      if (dual.areas[e] < 1e-13) continue;
      neighbours[dual.edges[2 * e]].push_back(dual.edges[2 * e + 1]);
      neighbours[dual.edges[2 * e + 1]].push_back(dual.edges[2 * e]);
    }
    for (const Cell& cell : *cells) {
      std::sort(neighbours[cell.vertex].begin(), neighbours[cell.vertex].end());
      EXPECT_EQ(neighbours[cell.vertex], cell.neighbours) << cell.vertex;
      if (d == 3) continue;
      double area = 0;  // of the polygon
      for (size_t k = 0, n = cell.nodes.size(); k < n; k += 2) {
        area += 0.5 * (cell.nodes[k] * cell.nodes[(k + 3) % n] - cell.nodes[(k + 2) % n] * cell.nodes[k + 1]);
      }
      EXPECT_NEAR(dual.volumes[cell.vertex], area, 1e-14);
    }
  }
}

TEST(DualCellsTest, DomainsHaveHoles) {
  test::DomainInput input;
  input.Ring({{0, 0}, {4, 0}, {4, 4}, {0, 4}}).Ring({{1, 1}, {2, 1}, {2, 2}, {1, 2}});
  input.seeds = {{.at = {1.5, 1.5}, .is_hole = true}};
  const auto mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectDual(ViewOf(*mesh), MustFind(ViewOf(*mesh)), 15, 20);
}

TEST(DualCellsTest, ThreadsDoNotMatter) {
  MeshParameters parameters = test::InUnitBox(3);
  parameters.max_circumradius = 0.05;
  const Mesh mesh = MustMesh(parameters, test::MakeCloud("uniform", 3, 1000));
  ASSERT_GT(mesh.vertex_count(), size_t{1} << 12);  // several blocks
  const DualCells one = MustFind(ViewOf(mesh), 1);
  const DualCells two = MustFind(ViewOf(mesh), 2);
  EXPECT_EQ(one.volumes, two.volumes);
  EXPECT_EQ(one.edges, two.edges);
  EXPECT_EQ(one.areas, two.areas);
  EXPECT_EQ(one.lengths, two.lengths);
  EXPECT_EQ(one.facet_areas, two.facet_areas);
  ExpectDual(ViewOf(mesh), one, 1, 6);
}

TEST(DualCellsTest, WhatHasNoDualCellsIsRefused) {
  const std::vector<double> points = {0, 0, 3, 0, 0, 3, 3, 3, 1, 1};
  const std::vector<uint32_t> simplices = {0, 1, 2, 1, 3, 2};
  const auto error = [](const DelaunayMesh& mesh) {
    const absl::Status status = FindDualCells(mesh, 1, RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    return std::string(status.message());
  };
  EXPECT_THAT(error({4, points, simplices}), HasSubstr("4-D"));
  EXPECT_THAT(error({1, points, simplices}), HasSubstr("1-D"));
  EXPECT_THAT(error({2, points, simplices, {}, points}), HasSubstr("pump_weights"));
  EXPECT_THAT(error({3, points, simplices}), HasSubstr("there are 10, 6 and 0 numbers"));
  const std::vector<uint32_t> rows = {0, 1, 2, 1};
  EXPECT_THAT(error({2, points, rows}), HasSubstr("there are 10, 4 and 0 numbers"));
  const std::vector<uint32_t> beyond = {0, 1, 2, 1, 5, 2};
  EXPECT_THAT(error({2, points, beyond}), HasSubstr("simplex 1 has vertex 5; the mesh has 5"));
  const std::vector<uint32_t> facets = {0, 1, 1, 7};
  EXPECT_THAT(error({2, points, simplices, facets}), HasSubstr("facet 1 has vertex 7; the mesh has 5"));
  const std::vector<uint32_t> flat = {0, 1, 2, 0, 4, 3};
  EXPECT_THAT(error({2, points, flat}), HasSubstr("simplex 1 is flat"));
  RunContext context;
  context.Cancel();
  EXPECT_EQ(FindDualCells({2, points, simplices}, 1, context).status().code(), absl::StatusCode::kCancelled);
}

TEST(DualCellsTest, AFlatTetrahedronIsRefused) {
  const std::vector<double> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const std::vector<uint32_t> simplices = {0, 1, 2, 3};
  EXPECT_THAT(FindDualCells({3, points, simplices}, 1, RunContext()).status().message(),
              HasSubstr("simplex 0 is flat"));
}

}  // namespace
}  // namespace wellspace::core
