// Distances and cells of vertices of a domain in the plane, held against a look at all vertices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/meshers/mesher.h"
#include "tests/core/domain_input.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::At;
using Input = test::DomainInput;
using ::testing::HasSubstr;

using Polygon = std::vector<Point<2>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The part of a convex polygon where normal . x <= offset.
Polygon Clipped(const Polygon& polygon, const Point<2>& normal, double offset) {
  Polygon kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point<2>& p = polygon[i];
    const Point<2>& q = polygon[(i + 1) % polygon.size()];
    const double before = Dot<2>(normal, p) - offset;
    const double after = Dot<2>(normal, q) - offset;
    if (before <= 0) {
      kept.push_back(p);
    }
    if (before * after < 0) {
      const double t = before / (before - after);
      kept.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])});
    }
  }
  return kept;
}

double AreaOf(const Polygon& polygon) {
  double area = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point<2>& p = polygon[i];
    const Point<2>& q = polygon[(i + 1) % polygon.size()];
    area += 0.5 * (p[0] * q[1] - p[1] * q[0]);
  }
  return area;
}

Polygon NodesOf(const Cell& cell) {
  Polygon nodes;
  for (size_t i = 0; i < cell.nodes.size() / 2; ++i) {
    nodes.push_back(PointAt<2>(cell.nodes, i));
  }
  return nodes;
}

// The cell of vertex `v` among all, in the box of the mesh.
Polygon CellAmongAll(const Mesh& mesh, uint32_t v, double radius) {
  const Point<2> site = At(mesh, v);
  Point<2> low;
  Point<2> high;
  for (int k = 0; k < 2; ++k) {
    low[k] = std::max(mesh.domain_low[k], site[k] - radius);
    high[k] = std::min(mesh.domain_high[k], site[k] + radius);
  }
  Polygon cell = {low, {high[0], low[1]}, high, {low[0], high[1]}};
  for (uint32_t u = 0; u < mesh.vertex_count(); ++u) {
    if (u != v) {
      const Point<2> normal = Difference<2>(At(mesh, u), site);
      cell = Clipped(cell, normal, Dot<2>(normal, site) + 0.5 * NormSq<2>(normal));
    }
  }
  return cell;
}

double NearestAmongAll(const Mesh& mesh, uint32_t v) {
  double nearest = kInfinity;
  for (uint32_t u = 0; u < mesh.vertex_count(); ++u) {
    nearest = u == v ? nearest : std::min(nearest, Distance<2>(At(mesh, u), At(mesh, v)));
  }
  return nearest;
}

// Whether `p` and `q` lie on different sides of the line through `a` and `b`.
bool AreApart(const Point<2>& a, const Point<2>& b, const Point<2>& p, const Point<2>& q) {
  return Orientation<2>({a, b, p}).sign * Orientation<2>({a, b, q}).sign == Sign::kNegative;
}

class DomainQueriesTest : public test::SeededTest {
 protected:
  DomainQueriesTest() : SeededTest(0x9e) {
    // A ring with a notch, a hole, and a segment with free ends.
    input_ = Input().Ring({{0, 0}, {3, 0}, {3, 2}, {1.6, 2}, {1.5, 0.9}, {1.4, 2}, {0, 2}}).Circle({2.3, 1}, 0.4, 15);
    input_.points.insert(input_.points.end(), {0.2, 0.3, 1.1, 0.7});
    input_.ends.insert(input_.ends.end(), {22, 23});
    input_.markers.push_back(3);
    input_.seeds = {{.at = {2.3, 1}, .is_hole = true}};
    mesher_ = input_.Create();
  }

  Mesh Refined() {
    EXPECT_EQ(mesher_->Refine(input_.parameters, context_), absl::OkStatus());
    absl::StatusOr<Mesh> mesh = mesher_->Extract(1, context_);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return *std::move(mesh);
  }

  static std::vector<uint32_t> AllOf(const Mesh& mesh) {
    std::vector<uint32_t> all(mesh.vertex_count());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  void ExpectThoseAmongAll(const Mesh& mesh) {
    const std::vector<uint32_t> all = AllOf(mesh);
    const auto distances = mesher_->NearestNeighborDistances(all);
    ASSERT_TRUE(distances.ok()) << distances.status();
    for (const double beta : {1.0, 1.7, kInfinity}) {
      const auto cells = mesher_->ClippedCells(all, beta);
      ASSERT_TRUE(cells.ok()) << cells.status();
      double area = 0;
      for (const uint32_t v : all) {
        const Cell& cell = (*cells)[v];
        EXPECT_NEAR((*distances)[v], NearestAmongAll(mesh, v), 1e-14);
        EXPECT_EQ(cell.vertex, v);
        EXPECT_DOUBLE_EQ(cell.clip_radius, beta * (*distances)[v]);
        const Polygon expected = CellAmongAll(mesh, v, cell.clip_radius);
        const Polygon nodes = NodesOf(cell);
        EXPECT_NEAR(AreaOf(nodes), AreaOf(expected), 1e-12) << v;
        // A cell is clipped by the cube if it has a node on it, and not on the box.
        const bool is_clipped = std::any_of(nodes.begin(), nodes.end(), [&](const Point<2>& x) {
          const Point<2> from = Difference<2>(x, At(mesh, v));
          return std::max(std::abs(from[0]), std::abs(from[1])) > cell.clip_radius * (1 - 1e-9);
        });
        EXPECT_EQ(cell.is_clipped, is_clipped) << v;
        area += AreaOf(nodes);
      }
      if (beta == kInfinity) {
        EXPECT_NEAR(area, 6, 1e-12) << "cells fill the box, be it meshed or not";
      }
    }
  }

  Input input_;
  RunContext context_;
  std::unique_ptr<Mesher> mesher_;
};

TEST_F(DomainQueriesTest, AreThoseAmongAllVertices) {
  ExpectThoseAmongAll(Refined());
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 10; ++i) {  // inside, on the lowest side, and on the segment with free ends
      const double t = random_.Unit();
      ASSERT_TRUE(mesher_->AddVertex(0, std::vector<double>{0.1 + t, 0.05 + 0.1 * random_.Unit()}).ok());
      ASSERT_TRUE(mesher_->AddVertex(0, std::vector<double>{3 * t, 0}).ok());
      ASSERT_TRUE(mesher_->AddVertex(0, std::vector<double>{0.2 + 0.9 * t, 0.3 + 0.4 * t}).ok());
    }
    ExpectThoseAmongAll(Refined());
  }
}

// Names of vertices are those of the mesh before there is any.
TEST_F(DomainQueriesTest, AreAnsweredBeforeTheFirstRefinement) {
  Mesh graph;
  graph.dimension = 2;
  graph.points.assign(input_.points.begin(), input_.points.end());
  graph.domain_low = {0, 0};
  graph.domain_high = {3, 2};
  ASSERT_EQ(mesher_->vertex_count(), graph.vertex_count());
  ExpectThoseAmongAll(graph);
}

// No cell reaches over a segment that its vertex is not on, and so the cell of a vertex on no segment is in its face.
TEST_F(DomainQueriesTest, CellsOfVerticesInFacesStayThere) {
  input_.parameters.max_circumradius = 0.2;
  const Mesh mesh = Refined();
  const auto cells = mesher_->ClippedCells(AllOf(mesh), kInfinity);
  ASSERT_TRUE(cells.ok()) << cells.status();
  int inside = 0;
  for (const Cell& cell : *cells) {
    if (mesh.vertex_tags[cell.vertex] != kNoTag) {
      continue;
    }
    ++inside;
    const Point<2> site = At(mesh, cell.vertex);
    for (const Point<2>& node : NodesOf(cell)) {
      const Point<2> nearly = {node[0] + 1e-9 * (site[0] - node[0]), node[1] + 1e-9 * (site[1] - node[1])};
      for (size_t f = 0; f < mesh.facet_count(); ++f) {
        const Point<2> a = At(mesh, mesh.facets[2 * f]);
        const Point<2> b = At(mesh, mesh.facets[2 * f + 1]);
        EXPECT_FALSE(AreApart(a, b, site, nearly) && AreApart(site, nearly, a, b)) << cell.vertex << " " << f;
      }
    }
  }
  EXPECT_GT(inside, 50);
}

TEST_F(DomainQueriesTest, WhatIsWrongIsNamed) {
  const auto count = static_cast<uint32_t>(Refined().vertex_count());
  const std::vector<uint32_t> vertices = {0, count};
  EXPECT_EQ(mesher_->NearestNeighborDistances(vertices).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(mesher_->ClippedCells(vertices, 2).status().message()), HasSubstr("vertices[1]"));
  EXPECT_EQ(mesher_->ClippedCells({}, 0.5).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace wellspace::core
