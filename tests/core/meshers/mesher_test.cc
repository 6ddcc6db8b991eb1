// core::Mesher: changes of a mesh once it is made.
#include "core/meshers/mesher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/validate/validate.h"
#include "tests/support/canonical.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

using test::Canonical;
using test::InUnitBox;
using test::MakeCloud;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<double> PointsOf(const Mesh& mesh, std::span<const uint32_t> vertices) {
  std::vector<double> points;
  for (const uint32_t v : vertices) {
    const auto begin = mesh.points.begin() + static_cast<std::ptrdiff_t>(size_t{v} * mesh.dimension);
    points.insert(points.end(), begin, begin + mesh.dimension);
  }
  return points;
}

// As many uniform points as make a mesh in little time, at most n.
size_t Few(int dimension, size_t n) { return std::min<size_t>(n, dimension <= 3 ? n : dimension == 4 ? 8 : 2); }

// The nodes of `cell`, in whichever order the cell has them.
std::multiset<std::vector<double>> NodesOf(const Cell& cell, int dimension) {
  std::multiset<std::vector<double>> nodes;
  for (auto node = cell.nodes.begin(); node != cell.nodes.end(); node += dimension) {
    nodes.emplace(node, node + dimension);
  }
  return nodes;
}

class MesherTest : public ::testing::TestWithParam<int> {
 protected:
  std::unique_ptr<Mesher> Create(std::span<const double> cloud) {
    absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters_, cloud, context_);
    EXPECT_TRUE(mesher.ok()) << mesher.status();
    return *std::move(mesher);
  }

  Mesh Extract(Mesher& mesher) {
    absl::StatusOr<Mesh> mesh = mesher.Extract(1, context_);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return *std::move(mesh);
  }

  void ExpectValid(const Mesh& mesh) {
    ValidationOptions options;
    options.rho = parameters_.rho == 0 ? DefaultRho(mesh.dimension) : parameters_.rho;
    EXPECT_EQ(ValidateMesh({mesh.dimension, mesh.points, mesh.simplices}, options), absl::OkStatus());
  }

  size_t Cells(const Mesh& mesh) { return mesh.statistics.cells_computed; }

  const int d_ = GetParam();
  MeshParameters parameters_ = InUnitBox(d_);
  RunContext context_;
};

// A mesh in 6-D takes seconds, and nothing here depends on the dimension but through the core's templates.
INSTANTIATE_TEST_SUITE_P(Dimensions, MesherTest, ::testing::Values(2, 3, 4, 5));

TEST_P(MesherTest, PointsAddedToARefinedMeshBecomeVerticesOfAValidOne) {
  for (const char* kind : {"uniform", "boundary", "rounded"}) {
    if (d_ == 5 && kind != std::string("boundary")) {
      continue;  // the worst will do
    }
    SCOPED_TRACE(kind);
    const size_t n = Few(d_, 300);
    const std::vector<double> cloud = MakeCloud(kind, d_, n);
    const auto mesher = Create(cloud);
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    Mesh mesh = Extract(*mesher);
    const Mesh before = mesh;
    std::vector<double> given = cloud;
    for (const size_t count : {size_t{1}, n}) {
      const std::vector<double> added = MakeCloud("uniform", d_, count);
      absl::StatusOr<std::vector<uint32_t>> vertices = mesher->AddPoints(added, context_);
      ASSERT_TRUE(vertices.ok()) << vertices.status();
      ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
      ASSERT_EQ(mesher->Update(mesh, 1, context_), absl::OkStatus());
      given.insert(given.end(), added.begin(), added.end());
      EXPECT_EQ(PointsOf(mesh, *vertices), added);
      EXPECT_EQ(PointsOf(mesh, mesh.input_vertex), given);
      ExpectValid(mesh);
      EXPECT_TRUE(Canonical(mesh) == Canonical(Extract(*mesher))) << "an update is what a new extraction gives";
    }
    // In 3-D others than those that were given, and the corners, may move against slivers.
    const uint32_t given_count = 1 + *std::max_element(before.input_vertex.begin(), before.input_vertex.end());
    const auto stay = static_cast<ptrdiff_t>(d_ == 3 ? given_count * size_t{3} : before.points.size());
    EXPECT_TRUE(std::equal(before.points.begin(), before.points.begin() + stay, mesh.points.begin()))
        << "vertices stay";
    EXPECT_EQ(mesh.statistics.vertices, mesh.vertex_count());
    EXPECT_EQ(mesh.statistics.input_points, given.size() / d_);
    const QualityReport quality = MeasureQuality({d_, mesh.points, mesh.simplices});
    // Up to rounding: the corners of a simplex come in another order.
    EXPECT_NEAR(mesh.statistics.max_radius_edge, quality.max_radius_edge, 1e-12);
    EXPECT_NEAR(mesh.statistics.min_angle_deg, quality.min_angle_deg, 1e-9);
  }
}

// The bound is on operations: the cells that an edit computes do not grow with the mesh.
TEST_P(MesherTest, EditsAreLocal) {
  if (d_ > 3) {
    GTEST_SKIP() << "no mesh here is large enough to tell";
  }
  for (const size_t n : {500, 20000}) {
    const auto mesher = Create(MakeCloud("uniform", d_, n));
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    Mesh mesh = Extract(*mesher);
    const uint64_t cells = mesh.statistics.cells_computed;
    const uint64_t stars = mesh.statistics.stars_computed;
    ASSERT_TRUE(mesher->AddPoints(MakeCloud("uniform", d_, 20), context_).ok());
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    ASSERT_EQ(mesher->Update(mesh, 1, context_), absl::OkStatus());
    EXPECT_LT(mesh.statistics.cells_computed - cells, 20u * 20) << n;
    EXPECT_LT(mesh.statistics.stars_computed - stars, 20u * (d_ == 2 ? 30 : 100)) << n;
  }
}

TEST_P(MesherTest, OrderInABatchDoesNotMatter) {
  const size_t n = Few(d_, 200);
  const std::vector<double> cloud = MakeCloud("uniform", d_, n);
  const std::vector<double> added = MakeCloud("uniform", d_, (n + 1) / 2);
  std::vector<test::CanonicalMesh> meshes;
  for (const uint64_t seed : {1, 2}) {
    const auto mesher = Create(test::Shuffled(cloud, d_, seed));
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    ASSERT_TRUE(mesher->AddPoints(test::Shuffled(added, d_, seed), context_).ok());
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    meshes.push_back(Canonical(Extract(*mesher)));
  }
  EXPECT_TRUE(meshes[0] == meshes[1]);
}

TEST_P(MesherTest, AVertexAddedNearAnotherIsTheSameAsInABatch) {
  const size_t n = Few(d_, 200);
  const std::vector<double> cloud = MakeCloud("uniform", d_, n);
  std::vector<double> point(d_, 0.4375);
  std::vector<test::CanonicalMesh> meshes;
  for (const bool near : {false, true}) {
    const auto mesher = Create(cloud);
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    if (near) {
      const absl::StatusOr<uint32_t> vertex = mesher->AddVertex(3, point);
      ASSERT_TRUE(vertex.ok()) << vertex.status();
      EXPECT_EQ(*vertex, mesher->vertex_count() - 1);
      EXPECT_EQ(*mesher->AddVertex(*vertex, point), *vertex) << "it is there already";
    } else {
      ASSERT_TRUE(mesher->AddPoints(point, context_).ok());
    }
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    meshes.push_back(Canonical(Extract(*mesher)));
  }
  EXPECT_TRUE(meshes[0] == meshes[1]);
}

TEST_P(MesherTest, PointsAddedNearVerticesAreTheSameAsInABatch) {
  const std::vector<double> cloud = MakeCloud("uniform", d_, Few(d_, 200));
  const std::vector<double> points = MakeCloud("inner", d_, 5);
  // `near` is a hint: any vertex will do, of the cloud, of the box or of Steiner.
  const auto near = [&](uint32_t first, uint32_t step) {
    std::vector<uint32_t> vertices(points.size() / d_);
    for (uint32_t i = 0; i < vertices.size(); ++i) {
      vertices[i] = first + i * step;
    }
    return vertices;
  };
  const auto together = Create(cloud);
  ASSERT_EQ(together->Refine(parameters_, context_), absl::OkStatus());
  const absl::StatusOr<std::vector<uint32_t>> expected = together->AddPoints(points, context_);
  ASSERT_TRUE(expected.ok()) << expected.status();
  ASSERT_EQ(together->Refine(parameters_, context_), absl::OkStatus());
  const test::CanonicalMesh mesh = Canonical(Extract(*together));
  for (const std::vector<uint32_t>& hints : {near(0, 0), near(1, 1)}) {
    const auto mesher = Create(cloud);
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    const absl::StatusOr<std::vector<uint32_t>> vertices = mesher->AddPointsNear(points, hints, context_);
    ASSERT_TRUE(vertices.ok()) << vertices.status();
    EXPECT_EQ(*vertices, *expected);
    const absl::StatusOr<std::vector<uint32_t>> again = mesher->AddPointsNear(points, *vertices, context_);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(*again, *vertices) << "they are there already";
    ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
    EXPECT_TRUE(Canonical(Extract(*mesher)) == mesh);
  }
}

TEST_P(MesherTest, PointsNearWhatIsNoVertexAreNotAdded) {
  const auto mesher = Create(MakeCloud("uniform", d_, Few(d_, 8)));
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  const auto count = static_cast<uint32_t>(mesher->vertex_count());
  const std::vector<double> points = MakeCloud("inner", d_, 3);
  const auto out_of_range = mesher->AddPointsNear(points, std::vector<uint32_t>{0, count, count + 1}, context_);
  EXPECT_EQ(out_of_range.status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(out_of_range.status().message()), AllOf(HasSubstr("[1]"), HasSubstr(std::to_string(count))));
  const auto too_few = mesher->AddPointsNear(points, std::vector<uint32_t>{0, 1}, context_);
  EXPECT_EQ(too_few.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(too_few.status().message()), HasSubstr("2 vertices for 3 points"));
  RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(mesher->AddPointsNear(points, std::vector<uint32_t>{0, 1, 2}, cancelled).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(mesher->vertex_count(), count);
  EXPECT_TRUE(mesher->Extract(1, context_).ok()) << "nothing has changed";
}

TEST_P(MesherTest, APointThatIsAVertexIsNotAddedAgain) {
  const std::vector<double> cloud = MakeCloud("uniform", d_, Few(d_, 8));
  const auto mesher = Create(cloud);
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  Mesh mesh = Extract(*mesher);
  const uint32_t steiner = static_cast<uint32_t>(mesh.vertex_count() - 1);
  const auto corner = static_cast<uint32_t>(cloud.size() / d_);
  std::vector<double> again = PointsOf(mesh, std::vector<uint32_t>{steiner, 1, corner});
  absl::StatusOr<std::vector<uint32_t>> vertices = mesher->AddPoints(again, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_THAT(*vertices, ElementsAre(steiner, 1, corner));
  ASSERT_EQ(mesher->Update(mesh, 1, context_), absl::OkStatus()) << "nothing has changed, so it is still refined";
  EXPECT_EQ(mesh.vertex_count(), mesher->vertex_count());
}

TEST_P(MesherTest, ABatchWithABadPointAddsNothing) {
  const auto mesher = Create(MakeCloud("uniform", d_, Few(d_, 8)));
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  const uint64_t count = mesher->vertex_count();
  const std::vector<double> good(d_, 0.3);
  std::vector<double> too_close = good;
  too_close[0] += 1e-15;
  std::vector<double> outside = good;
  outside[d_ - 1] = 1.5;
  std::vector<double> no_number = good;
  no_number[0] = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> by_a_face = good;
  by_a_face[0] = 1e-15;
  struct Case {
    std::vector<double> bad;
    std::string message;
  };
  for (const Case& c : {Case{too_close, "points[0]"}, Case{outside, "points[1]"}, Case{no_number, "points[1]"},
                        Case{by_a_face, "points[1]"}}) {
    std::vector<double> batch = good;
    batch.insert(batch.end(), c.bad.begin(), c.bad.end());
    const auto added = mesher->AddPoints(batch, context_);
    EXPECT_EQ(added.status().code(), absl::StatusCode::kInvalidArgument) << added.status();
    EXPECT_THAT(std::string(added.status().message()), HasSubstr(c.message));
    EXPECT_EQ(mesher->vertex_count(), count);
  }
  Mesh mesh = Extract(*mesher);
  std::vector<double> by_a_vertex = PointsOf(mesh, std::vector<uint32_t>{0});
  by_a_vertex[0] += 2e-15;
  const auto added = mesher->AddPoints(by_a_vertex, context_);
  EXPECT_EQ(added.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(added.status().message()), AllOf(HasSubstr("points[0]"), HasSubstr("vertex 0")));
  EXPECT_EQ(mesher->AddPoints(std::vector<double>(d_ + 1, 0.5), context_).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(mesher->AddVertex(static_cast<uint32_t>(count), good).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(mesher->AddVertex(0, by_a_face).status().message()), HasSubstr("face of axis 0"));
  EXPECT_EQ(mesher->AddVertex(0, std::vector<double>(d_ - 1, 0.5)).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_P(MesherTest, GoesOnAfterABudgetThatWasTooSmall) {
  const std::vector<double> cloud = MakeCloud("uniform", d_, Few(d_, 100));
  const auto whole = Create(cloud);
  ASSERT_EQ(whole->Refine(parameters_, context_), absl::OkStatus());
  const auto mesher = Create(cloud);
  MeshParameters small = parameters_;
  small.max_vertices = mesher->vertex_count() + 7;
  while (small.max_vertices < whole->vertex_count()) {
    EXPECT_EQ(mesher->Refine(small, context_).code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(mesher->vertex_count(), small.max_vertices);
    EXPECT_EQ(mesher->Extract(1, context_).status().code(), absl::StatusCode::kFailedPrecondition);
    small.max_vertices += whole->vertex_count() / 3;
  }
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  ExpectValid(Extract(*mesher));
}

// Compares the prediction of a refinement that is stopped at its first vertex with the size of the whole mesh.
void ExpectForetold(const MeshParameters& parameters, std::span<const double> cloud, double factor) {
  RunContext context;
  const auto mesher = *Mesher::Create(parameters, cloud, context);
  MeshParameters budget = parameters;
  budget.max_vertices = mesher->vertex_count() + 1;
  EXPECT_EQ(mesher->Refine(budget, context).code(), absl::StatusCode::kResourceExhausted);
  const auto predicted = static_cast<double>(context.Snapshot().estimated_vertices);
  RunContext again;
  EXPECT_EQ(mesher->Refine(parameters, again), absl::OkStatus());
  EXPECT_LT(predicted, factor * static_cast<double>(mesher->vertex_count()));
  EXPECT_GT(factor * predicted, static_cast<double>(mesher->vertex_count()));
  EXPECT_EQ(again.Snapshot().estimated_vertices, 0u) << "unknown";
}

TEST_P(MesherTest, ForetellsItsVerticesWhereThereAreSizes) {
  parameters_.max_circumradius = d_ == 2 ? 0.03 : d_ == 3 ? 0.12 : 0.5;
  ExpectForetold(parameters_, MakeCloud("uniform", d_, Few(d_, 200)), d_ <= 3 ? 1.5 : 10);
}

TEST(LargeMesherTest, ForetellsItsVertices) {
  ExpectForetold(InUnitBox(2), MakeCloud("uniform", 2, 60'000), 1.5);
  ExpectForetold(InUnitBox(3), MakeCloud("uniform", 3, 25'000), 1.5);
}

TEST_P(MesherTest, CanBeRefinedFurther) {
  const auto mesher = Create(MakeCloud("uniform", d_, Few(d_, 50)));
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  Mesh mesh = Extract(*mesher);
  uint64_t vertices = mesher->vertex_count();
  MeshParameters finer = parameters_;
  finer.rho = 0.9 * DefaultRho(d_);
  finer.max_circumradius = d_ == 2 ? 0.05 : d_ == 3 ? 0.12 : 0.5;
  ASSERT_EQ(mesher->Refine(finer, context_), absl::OkStatus());
  EXPECT_GT(mesher->vertex_count(), vertices);
  ASSERT_EQ(mesher->Update(mesh, 1, context_), absl::OkStatus());
  parameters_.rho = finer.rho;
  ExpectValid(mesh);
  EXPECT_TRUE(Canonical(mesh) == Canonical(Extract(*mesher)));
  vertices = mesher->vertex_count();
  ASSERT_EQ(mesher->Refine(finer, context_), absl::OkStatus());
  EXPECT_EQ(mesher->vertex_count(), vertices) << "the same demands are met already";
}

TEST_P(MesherTest, NegativeZerosKeepTheirBits) {
  parameters_.domain_low.assign(d_, -1);
  std::vector<double> cloud = {};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < d_; ++k) {
      cloud.push_back(k == i % d_ ? -0.0 : 0.25 * (i + 1));
    }
  }
  const auto mesher = Create(cloud);
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  Mesh mesh = Extract(*mesher);
  std::vector<double> added(d_, -0.5);
  added[0] = -0.0;
  const absl::StatusOr<std::vector<uint32_t>> vertices = mesher->AddPoints(added, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  ASSERT_EQ(mesher->Update(mesh, 1, context_), absl::OkStatus());
  for (const Mesh& each : {mesh, Extract(*mesher)}) {
    for (size_t i = 0; i < cloud.size(); ++i) {
      EXPECT_EQ(std::signbit(each.points[i]), std::signbit(cloud[i])) << i;
    }
    EXPECT_TRUE(std::signbit(each.points[size_t{vertices->front()} * d_]));
  }
}

// The table of vertices by their numbers is made by the call that asks first.
TEST_P(MesherTest, QueriesMayRunAtOnce) {
  const std::vector<double> cloud = MakeCloud("uniform", d_, 200);
  const auto mesher = Create(cloud);
  const auto count = static_cast<uint32_t>(cloud.size() / d_);
  const auto distance_sq = [&](uint32_t u, uint32_t v) {
    double sum = 0;
    for (int k = 0; k < d_; ++k) {
      sum += std::pow(cloud[size_t{u} * d_ + k] - cloud[size_t{v} * d_ + k], 2);
    }
    return sum;
  };
  std::vector<uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  std::array<absl::StatusOr<std::vector<double>>, 4> nearest;
  std::vector<std::jthread> threads;
  for (auto& found : nearest) {
    threads.emplace_back([&] { found = mesher->NearestNeighborDistances(all); });
  }
  threads.clear();
  ASSERT_TRUE(nearest[0].ok()) << nearest[0].status();
  for (uint32_t v = 0; v < count; ++v) {
    double corner_sq = 0;  // the corners of the box are vertices, too
    for (int k = 0; k < d_; ++k) {
      const double x = cloud[size_t{v} * d_ + k];
      corner_sq += std::pow(std::min(x, 1 - x), 2);
    }
    double least_sq = corner_sq;
    for (uint32_t u = 0; u < count; ++u) {
      least_sq = u == v ? least_sq : std::min(least_sq, distance_sq(u, v));
    }
    EXPECT_NEAR((*nearest[0])[v], std::sqrt(least_sq), 1e-12) << v;
  }
  for (const auto& found : nearest) {
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(*found, *nearest[0]);
  }
}

TEST_P(MesherTest, NodesOfCellsAreInOrder) {
  for (const std::string_view kind : {"uniform", "grid"}) {
    const auto mesher = Create(MakeCloud(kind, d_, Few(d_, 60)));
    std::vector<uint32_t> all(mesher->vertex_count());
    std::iota(all.begin(), all.end(), 0u);
    const absl::StatusOr<std::vector<Cell>> cells = mesher->ClippedCells(all, 2);
    ASSERT_TRUE(cells.ok()) << cells.status();
    for (const Cell& cell : *cells) {
      std::vector<std::vector<double>> nodes;
      for (size_t at = 0; at < cell.nodes.size(); at += d_) {
        nodes.emplace_back(cell.nodes.begin() + at, cell.nodes.begin() + at + d_);
      }
      if (d_ > 2) {
        EXPECT_TRUE(std::is_sorted(nodes.begin(), nodes.end()));
        continue;
      }
      EXPECT_EQ(std::min_element(nodes.begin(), nodes.end()), nodes.begin());
      for (size_t i = 0; i < nodes.size(); ++i) {  // the cell is to the left of every edge
        const std::vector<double>& from = nodes[i];
        const std::vector<double>& to = nodes[(i + 1) % nodes.size()];
        for (const std::vector<double>& x : nodes) {
          EXPECT_GE((to[0] - from[0]) * (x[1] - from[1]) - (to[1] - from[1]) * (x[0] - from[0]), -1e-12);
        }
      }
    }
  }
}

// The cells of a refined mesh, not clipped, have for neighbours just the vertices that share a simplex, but for ties.
TEST_P(MesherTest, CellsAreThoseOfTheMesh) {
  const auto mesher = Create(MakeCloud("uniform", d_, Few(d_, 60)));
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  const Mesh mesh = Extract(*mesher);
  std::vector<std::set<uint32_t>> neighbours(mesh.vertex_count());
  for (size_t at = 0; at < mesh.simplices.size(); at += d_ + 1) {
    for (int i = 0; i <= d_; ++i) {
      for (int k = 0; k <= d_; ++k) {
        if (i != k) {
          neighbours[mesh.simplices[at + i]].insert(mesh.simplices[at + k]);
        }
      }
    }
  }
  std::vector<uint32_t> all;
  for (uint32_t v = 0; v < mesh.vertex_count(); v += d_ <= 3 ? 1 : 97) {
    all.push_back(v);
  }
  const absl::StatusOr<std::vector<Cell>> cells = mesher->ClippedCells(all, 1e3);
  const absl::StatusOr<std::vector<double>> nearest = mesher->NearestNeighborDistances(all);
  ASSERT_TRUE(cells.ok() && nearest.ok());
  ASSERT_EQ(cells->size(), all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    const Cell& cell = (*cells)[i];
    const std::set<uint32_t>& expected = neighbours[all[i]];
    EXPECT_EQ(cell.vertex, all[i]);
    EXPECT_FALSE(cell.is_clipped);
    EXPECT_TRUE(std::includes(expected.begin(), expected.end(), cell.neighbours.begin(), cell.neighbours.end()));
    double shortest = std::numeric_limits<double>::infinity();
    for (const uint32_t u : expected) {
      double sum = 0;
      for (int k = 0; k < d_; ++k) {
        sum += std::pow(mesh.points[size_t{u} * d_ + k] - mesh.points[size_t{all[i]} * d_ + k], 2);
      }
      shortest = std::min(shortest, std::sqrt(sum));
    }
    EXPECT_NEAR((*nearest)[i], shortest, 1e-12);
    EXPECT_DOUBLE_EQ(cell.clip_radius, 1e3 * (*nearest)[i]);
  }
  const absl::StatusOr<std::vector<Cell>> whole = mesher->ClippedCells(all, std::numeric_limits<double>::infinity());
  ASSERT_TRUE(whole.ok());
  for (size_t i = 0; i < all.size(); ++i) {  // 1e3 was as good as infinite
    EXPECT_EQ(NodesOf((*whole)[i], d_), NodesOf((*cells)[i], d_));
    EXPECT_EQ((*whole)[i].neighbours, (*cells)[i].neighbours);
    EXPECT_EQ((*whole)[i].clip_radius, std::numeric_limits<double>::infinity());
    EXPECT_FALSE((*whole)[i].is_clipped);
  }
  for (size_t i = 0; i < all.size(); i += 11) {
    const absl::StatusOr<std::vector<Cell>> alone = mesher->ClippedCells({&all[i], 1}, 1e3);
    ASSERT_TRUE(alone.ok());
    EXPECT_EQ((*alone)[0].nodes, (*cells)[i].nodes) << "whatever else is asked for";
    EXPECT_EQ((*alone)[0].neighbours, (*cells)[i].neighbours);
  }
  const absl::StatusOr<std::vector<Cell>> clipped = mesher->ClippedCells(all, 1);
  ASSERT_TRUE(clipped.ok());
  EXPECT_TRUE(std::any_of(clipped->begin(), clipped->end(), [](const Cell& cell) { return cell.is_clipped; }));
  for (const double beta : {0.5, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(mesher->ClippedCells(all, beta).status().code(), absl::StatusCode::kInvalidArgument);
  }
  all = {0, static_cast<uint32_t>(mesh.vertex_count())};
  EXPECT_EQ(mesher->ClippedCells(all, 2).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(mesher->NearestNeighborDistances(all).status().message()), HasSubstr("vertices[1]"));
}

TEST_P(MesherTest, OnlyTheLastMeshCanBeUpdated) {
  const auto mesher = Create(MakeCloud("uniform", d_, Few(d_, 5)));
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  Mesh mesh = Extract(*mesher);
  Mesh other = mesh;
  other.simplices.resize(other.simplices.size() - (d_ + 1));
  EXPECT_EQ(mesher->Update(other, 1, context_).code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(mesher->AddPoints(std::vector<double>(d_, 0.71), context_).ok());
  EXPECT_EQ(mesher->Update(mesh, 1, context_).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(mesher->Extract(0, context_).status().code(), absl::StatusCode::kFailedPrecondition);
  ASSERT_EQ(mesher->Refine(parameters_, context_), absl::OkStatus());
  EXPECT_EQ(mesher->Extract(0, context_).status().code(), absl::StatusCode::kInvalidArgument) << "threads";
  MeshParameters wrong = parameters_;
  wrong.dimension = d_ == 2 ? 3 : 2;
  wrong.domain_low = wrong.domain_high = {};
  EXPECT_EQ(mesher->Refine(wrong, context_).code(), absl::StatusCode::kInvalidArgument);
}

TEST(MesherCells, OfTooManyNodesAreRefused) {
  for (const int d : {2, 3, 4}) {
    // A point amid others on a sphere has them all for neighbours.
    std::vector<double> points(d, 0.5);
    const std::vector<double> sphere = MakeCloud("sphere", d, d == 2 ? 17'000 : d == 3 ? 9'000 : 3'000);
    points.insert(points.end(), sphere.begin(), sphere.end());
    MeshParameters parameters = InUnitBox(d);
    RunContext context;
    const absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters, points, context);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    const std::vector<uint32_t> vertices = {1, 0};
    const absl::Status status = (*mesher)->ClippedCells(vertices, std::numeric_limits<double>::infinity()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << d;
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("vertex 0"), HasSubstr("16384"), HasSubstr("beta")));
    EXPECT_TRUE((*mesher)->ClippedCells(std::vector<uint32_t>{1}, std::numeric_limits<double>::infinity()).ok()) << d;
  }
}

}  // namespace
}  // namespace wellspace::core
