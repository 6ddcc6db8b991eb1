// Periodic boxes: vertices and facets on opposite faces in pairs, whatever the points, and as few as may be.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "core/validate/validate_periodic.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// The unit box, periodic along the first axes.
MeshParameters UnitBox(int dimension, int periodic) {
  MeshParameters parameters{.dimension = dimension,
                            .domain_low = std::vector<double>(dimension, 0),
                            .domain_high = std::vector<double>(dimension, 1)};
  for (int axis = 0; axis < periodic; ++axis) {
    parameters.periodic_axes.push_back(axis);
  }
  return parameters;
}

absl::StatusOr<Mesh> MeshOf(const MeshParameters& parameters, const std::vector<double>& points) {
  RunContext context;
  return MeshPoints(parameters, points, context);
}

// All that is promised of `mesh`.
absl::Status Check(const Mesh& mesh, const MeshParameters& parameters, const std::vector<double>& points) {
  const MeshView view{.dimension = mesh.dimension, .points = mesh.points, .simplices = mesh.simplices};
  const absl::Status status =
      ValidateMesh(view, {.rho = parameters.rho == 0 ? DefaultRho(mesh.dimension) : parameters.rho,
                          .criterion = parameters.criterion,
                          .max_circumradius = parameters.max_circumradius,
                          .cloud = points});
  return status.ok() ? ValidatePeriodic(view, parameters.periodic_axes) : status;
}

std::vector<std::vector<double>> SortedRows(std::span<const double> numbers, int columns) {
  std::vector<std::vector<double>> rows;
  for (size_t i = 0; i < numbers.size(); i += columns) {
    rows.emplace_back(numbers.begin() + i, numbers.begin() + i + columns);
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

class PeriodicTest : public test::SeededTest {
 protected:
  PeriodicTest() : SeededTest(1911) {}

  std::vector<double> Uniform(int dimension, size_t count) {
    std::vector<double> points(count * dimension);
    std::generate(points.begin(), points.end(), [this] { return random_.Unit(); });
    return points;
  }

  // Points near one corner, as near as 2^-20.
  std::vector<double> Clustered(int dimension, size_t count) {
    std::vector<double> points(count * dimension);
    std::generate(points.begin(), points.end(), [this] { return std::exp2(-20 * random_.Unit()); });
    return points;
  }

  // Points of a grid that reaches from face to face, some left out: all ties, on faces, edges and corners, too.
  std::vector<double> Grid(int dimension, int side, uint64_t one_in) {
    std::vector<double> points;
    for (int i = 0; i < std::pow(side + 1, dimension); ++i) {
      if (random_.Below(one_in) != 0) {
        continue;
      }
      for (int axis = 0, rest = i; axis < dimension; ++axis, rest /= side + 1) {
        points.push_back(static_cast<double>(rest % (side + 1)) / side);
      }
    }
    return points;
  }

  // Points on the faces alone, of which some coordinates are 0 or 1.
  std::vector<double> OnFaces(int dimension, size_t count) {
    std::vector<double> points = Uniform(dimension, count);
    for (size_t i = 0; i < count; ++i) {
      for (int k = 0; k < dimension; ++k) {
        if (k == static_cast<int>(i % dimension) || random_.Below(4) == 0) {
          points[i * dimension + k] = static_cast<double>(random_.Below(2));
        }
      }
    }
    return points;
  }
};

TEST_F(PeriodicTest, FacesMatch) {
  for (const int dimension : {2, 3}) {
    for (int periodic = 1; periodic <= dimension; ++periodic) {
      const std::vector<std::vector<double>> clouds = {{},
                                                       std::vector<double>(dimension, 0.4),
                                                       std::vector<double>(dimension, 0),
                                                       Uniform(dimension, 100),
                                                       Clustered(dimension, 20),
                                                       Grid(dimension, 3, 1),
                                                       Grid(dimension, 4, 3),
                                                       OnFaces(dimension, 40)};
      for (size_t i = 0; i < clouds.size(); ++i) {
        for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
          MeshParameters parameters = UnitBox(dimension, periodic);
          parameters.criterion = criterion;
          const auto mesh = MeshOf(parameters, clouds[i]);
          ASSERT_TRUE(mesh.ok()) << mesh.status();
          EXPECT_EQ(Check(*mesh, parameters, clouds[i]), absl::OkStatus())
              << dimension << "-D, " << periodic << " axes, cloud " << i;
        }
      }
    }
  }
}

TEST_F(PeriodicTest, HasFewMoreVertices) {
  struct Case {
    int dimension;
    size_t count;
    bool is_full;              // the points reach to the sides, which then have 2^(2/3) times as many vertices in 3-D
    std::vector<double> most;  // by axes: vertices relative to the plain box
  };
  for (const Case& one : {Case{2, 10'000, true, {1.02, 1.03}}, Case{3, 5'000, false, {1.01, 1.01, 1.01}},
                          Case{3, 5'000, true, {1.15, 1.3, 1.45}}}) {
    const std::vector<double> points = Uniform(one.dimension, one.count);
    uint64_t plain = 0;
    for (int periodic = 0; periodic <= one.dimension; ++periodic) {
      MeshParameters parameters = UnitBox(one.dimension, periodic);
      if (!one.is_full) {
        parameters.domain_low.clear();
        parameters.domain_high.clear();
      }
      const auto mesh = MeshOf(parameters, points);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      if (periodic == 0) {
        plain = mesh->vertex_count();
        continue;
      }
      const double ratio = static_cast<double>(mesh->vertex_count()) / static_cast<double>(plain);
      EXPECT_LT(ratio, one.most[periodic - 1]) << one.dimension << "-D, " << periodic << " axes";
    }
  }
}

TEST_F(PeriodicTest, KeepsToSizes) {
  for (const int dimension : {2, 3}) {
    MeshParameters parameters = UnitBox(dimension, dimension);
    parameters.size_boxes = {
        {std::vector<double>(dimension, 0), std::vector<double>(dimension, 0.1), dimension == 2 ? 0.01 : 0.04}};
    parameters.max_circumradius = 0.2;
    const auto mesh = MeshOf(parameters, {});
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(Check(*mesh, parameters, {}), absl::OkStatus());
  }
}

TEST_F(PeriodicTest, BoxesOfAllShapes) {
  const std::vector<std::vector<double>> sides = {{1, 0.05, 1}, {1, 8, 0.2}, {5, 1, 1}};
  for (const std::vector<double>& side : sides) {
    for (const int dimension : {2, 3}) {
      MeshParameters parameters = UnitBox(dimension, dimension);
      std::vector<double> points = Uniform(dimension, 50);
      for (int k = 0; k < dimension; ++k) {
        parameters.domain_low[k] = -0.3 * side[k];
        parameters.domain_high[k] = 0.7 * side[k];
      }
      for (size_t i = 0; i < points.size(); ++i) {
        const size_t k = i % dimension;
        points[i] = std::clamp((points[i] - 0.3) * side[k], parameters.domain_low[k], parameters.domain_high[k]);
      }
      const auto mesh = MeshOf(parameters, points);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_EQ(Check(*mesh, parameters, points), absl::OkStatus());
    }
  }
}

TEST_F(PeriodicTest, IsTheSameOnAnyThreadsAndInAnyOrder) {
  for (const int dimension : {2, 3}) {
    std::vector<double> points = Uniform(dimension, 5'000);
    const std::vector<double> on_faces = OnFaces(dimension, 300);
    points.insert(points.end(), on_faces.begin(), on_faces.end());
    MeshParameters parameters = UnitBox(dimension, 2);
    const auto one = MeshOf(parameters, points);
    ASSERT_TRUE(one.ok()) << one.status();
    EXPECT_EQ(Check(*one, parameters, points), absl::OkStatus());
    parameters.threads = 2;
    const auto two = MeshOf(parameters, points);
    ASSERT_TRUE(two.ok()) << two.status();
    EXPECT_EQ(one->points, two->points);
    EXPECT_EQ(one->simplices, two->simplices);
    std::vector<double> backward;
    for (size_t i = points.size(); i > 0; i -= dimension) {
      backward.insert(backward.end(), points.begin() + (i - dimension), points.begin() + i);
    }
    const auto turned = MeshOf(parameters, backward);
    ASSERT_TRUE(turned.ok()) << turned.status();
    EXPECT_EQ(SortedRows(one->points, dimension), SortedRows(turned->points, dimension));
  }
}

TEST_F(PeriodicTest, IsTheSameAfterAStop) {
  const std::vector<double> points = Uniform(3, 2'000);
  MeshParameters parameters = UnitBox(3, 3);
  const auto whole = MeshOf(parameters, points);
  ASSERT_TRUE(whole.ok()) << whole.status();
  RunContext context;
  const auto mesher = Mesher::Create(parameters, points, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  for (uint64_t most = 3'000; most < whole->vertex_count(); most += 501) {
    parameters.max_vertices = most;
    EXPECT_TRUE(absl::IsResourceExhausted((*mesher)->Refine(parameters, context)));
    EXPECT_LE((*mesher)->vertex_count(), most);
  }
  parameters.max_vertices = 0;
  ASSERT_EQ((*mesher)->Refine(parameters, context), absl::OkStatus());
  const auto mesh = (*mesher)->Extract(1, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->points, whole->points);
  EXPECT_EQ(mesh->simplices, whole->simplices);
}

TEST_F(PeriodicTest, NumbersInputsFirstThenCornersThenImages) {
  // On a face, an edge and a corner; the last is the image of the first.
  const std::vector<double> points = {0, 0.25, 0.5, 1, 1, 0.5, 0, 0, 0, 0.5, 0.5, 0.5, 1, 0.25, 0.5};
  const MeshParameters parameters = UnitBox(3, 3);
  const auto mesh = MeshOf(parameters, points);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(Check(*mesh, parameters, points), absl::OkStatus());
  EXPECT_EQ(mesh->statistics.input_points, 5u);
  EXPECT_EQ(mesh->statistics.duplicates, 0u);
  ASSERT_EQ(mesh->input_vertex.size(), 5u);
  for (uint32_t v = 0; v < mesh->vertex_count(); ++v) {
    if (v < 5) {
      EXPECT_EQ(mesh->input_vertex[v], v);
      EXPECT_EQ(mesh->vertex_origins[v], v);
      continue;
    }
    int on = 0;
    for (int k = 0; k < 3; ++k) {
      on += mesh->points[3 * v + k] == 0 || mesh->points[3 * v + k] == 1 ? 1 : 0;
    }
    EXPECT_EQ(mesh->vertex_origins[v] == kCornerOrigin, on == 3) << v;
  }
}

TEST_F(PeriodicTest, MergedPointsHaveImages) {
  std::vector<double> points = OnFaces(3, 200);
  MeshParameters parameters = UnitBox(3, 3);
  parameters.merge_distance = 0.02;
  const auto mesh = MeshOf(parameters, points);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const MeshView view{.dimension = 3, .points = mesh->points, .simplices = mesh->simplices};
  EXPECT_EQ(ValidateMesh(view, {.rho = 2}), absl::OkStatus());
  EXPECT_GT(mesh->statistics.merged_points, 0u);
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE(std::abs(mesh->points[3 * mesh->input_vertex[i / 3] + i % 3] - points[i]), 0.02);
  }
  EXPECT_EQ(ValidatePeriodic(view, parameters.periodic_axes), absl::OkStatus());
}

TEST_F(PeriodicTest, AddedPointsGetImages) {
  for (const int dimension : {2, 3}) {
    for (const bool keeps : {false, true}) {
      MeshParameters parameters = UnitBox(dimension, dimension);
      parameters.keep_vertices = keeps;
      std::vector<double> points = Uniform(dimension, 500);
      RunContext context;
      const auto mesher = Mesher::Create(parameters, points, context);
      ASSERT_TRUE(mesher.ok()) << mesher.status();
      ASSERT_EQ((*mesher)->Refine(parameters, context), absl::OkStatus());
      auto mesh = (*mesher)->Extract(1, context);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      for (int round = 0; round < 3; ++round) {
        const std::vector<double> added = OnFaces(dimension, 40);
        const auto vertices = (*mesher)->AddPoints(added, context);
        ASSERT_TRUE(vertices.ok()) << vertices.status();
        const std::vector<double> one = OnFaces(dimension, 1);
        const auto vertex = (*mesher)->AddVertex((*vertices)[0], one);
        ASSERT_TRUE(vertex.ok()) << vertex.status();
        points.insert(points.end(), added.begin(), added.end());
        points.insert(points.end(), one.begin(), one.end());
        ASSERT_EQ((*mesher)->Refine(parameters, context), absl::OkStatus());
        ASSERT_EQ((*mesher)->Update(*mesh, 1, context), absl::OkStatus());
        EXPECT_EQ(Check(*mesh, parameters, {}), absl::OkStatus());
        for (size_t i = 0; i < points.size() / dimension; ++i) {
          for (int k = 0; k < dimension; ++k) {
            ASSERT_EQ(mesh->points[size_t{mesh->input_vertex[i]} * dimension + k], points[i * dimension + k]);
          }
        }
        for (size_t i = 0; i < vertices->size(); ++i) {
          for (int k = 0; k < dimension; ++k) {
            EXPECT_EQ(mesh->points[(*vertices)[i] * dimension + k], added[i * dimension + k]);
          }
        }
      }
    }
  }
}

TEST_F(PeriodicTest, RefusesPointsTooCloseToImages) {
  const double near = std::nextafter(0.5, 1);
  const MeshParameters parameters = UnitBox(2, 1);
  EXPECT_THAT(std::string(MeshOf(parameters, {0, 0.5, 1, near}).status().message()),
              AllOf(HasSubstr("points[1]"), HasSubstr("points[0]"), HasSubstr("too close"), HasSubstr("image")));
  RunContext context;
  const auto mesher = Mesher::Create(parameters, std::vector<double>{0, 0.5}, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  ASSERT_EQ((*mesher)->Refine(parameters, context), absl::OkStatus());
  const uint64_t count = (*mesher)->vertex_count();
  EXPECT_THAT(std::string((*mesher)->AddPoints(std::vector<double>{1, near}, context).status().message()),
              AllOf(HasSubstr("points[0]"), HasSubstr("too close"), HasSubstr("image")));
  EXPECT_EQ((*mesher)->vertex_count(), count);
}

TEST_F(PeriodicTest, EstimatesCoverImages) {
  for (const int dimension : {2, 3}) {
    for (const auto& points : {Uniform(dimension, 2'000), Clustered(dimension, 300), OnFaces(dimension, 300)}) {
      const MeshParameters parameters = UnitBox(dimension, dimension);
      RunContext context;
      const auto estimate = EstimateMesh(parameters, points, context);
      ASSERT_TRUE(estimate.ok()) << estimate.status();
      const auto mesh = MeshOf(parameters, points);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      const double ratio = static_cast<double>(estimate->vertices) / static_cast<double>(mesh->vertex_count());
      EXPECT_GT(ratio, 0.5) << dimension;
      EXPECT_LT(ratio, 1.5) << dimension;
    }
  }
}

TEST_F(PeriodicTest, RefusesAxesThatAreNone) {
  const auto message = [](MeshParameters parameters) { return std::string(ValidateParameters(parameters).message()); };
  MeshParameters parameters{.dimension = 2, .periodic_axes = {0, 2}};
  EXPECT_EQ(message(parameters), "periodic_axes[1]: 2 is no axis in 2-D; 0 to 1 are");
  parameters.periodic_axes = {-1};
  EXPECT_EQ(message(parameters), "periodic_axes[0]: -1 is no axis in 2-D; 0 to 1 are");
  parameters.periodic_axes = {1, 0, 1};
  EXPECT_EQ(message(parameters), "periodic_axes[2]: axis 1 is there already, as periodic_axes[0]; give each axis once");
  parameters = {.dimension = 4, .periodic_axes = {0}};
  EXPECT_EQ(message(parameters), "periodic_axes: they are not allowed in 4-D; boxes are periodic in 2-D and 3-D");
  parameters = {.dimension = 3, .pump_weights = true, .periodic_axes = {0}};
  EXPECT_THAT(message(parameters), HasSubstr("pump_weights: true is not allowed with periodic_axes"));
  // Of a mesher, whatever parameters a later refinement has.
  RunContext context;
  const auto mesher = Mesher::Create(UnitBox(3, 1), std::vector<double>{0.5, 0.5, 0.5}, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  EXPECT_THAT(std::string((*mesher)->Refine({.dimension = 3, .pump_weights = true}, context).message()),
              HasSubstr("pump_weights: true is not allowed with periodic_axes"));
}

// The check itself.
TEST(ValidatePeriodicTest, NamesTheFirstViolation) {
  std::vector<double> points = {0, 0, 1, 0, 1, 1, 0, 1, 0.5, 0.5};
  const std::vector<uint32_t> simplices = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
  const MeshView view{.dimension = 2, .points = points, .simplices = simplices};
  const std::vector<int> both = {0, 1};
  EXPECT_EQ(ValidatePeriodic(view, both), absl::OkStatus());
  points.insert(points.end(), {1, 0.5});
  const std::vector<uint32_t> split = {0, 1, 4, 1, 5, 4, 5, 2, 4, 2, 3, 4, 3, 0, 4};
  const MeshView uneven{.dimension = 2, .points = points, .simplices = split};
  EXPECT_EQ(ValidatePeriodic(uneven, std::vector<int>{1}), absl::OkStatus());
  EXPECT_EQ(std::string(ValidatePeriodic(uneven, both).message()), "vertex 5 at (1, 0.5) on xmax has no image on xmin");
  EXPECT_THAT(std::string(ValidatePeriodic(view, std::vector<int>{2}).message()), HasSubstr("2 is no axis"));
  EXPECT_THAT(std::string(ValidatePeriodic(view, std::vector<int>{1, 1}).message()), HasSubstr("twice"));
}

TEST(ValidatePeriodicTest, ComparesFacets) {
  // A cube around its centre, whose facets are cut along either diagonal.
  std::vector<double> points;
  for (int i = 0; i < 8; ++i) {
    points.insert(points.end(), {i & 1 ? 1.0 : 0.0, i & 2 ? 1.0 : 0.0, i & 4 ? 1.0 : 0.0});
  }
  points.insert(points.end(), {0.5, 0.5, 0.5});
  const auto mesh_with = [&](bool low_turned, bool high_turned) {
    std::vector<uint32_t> simplices;
    for (const uint32_t side : {0u, 1u}) {  // of x: corners side, side + 2, side + 4, side + 6
      const bool turned = side == 0 ? low_turned : high_turned;
      const std::vector<uint32_t> halves =
          turned ? std::vector<uint32_t>{0, 2, 6, 0, 6, 4} : std::vector<uint32_t>{0, 2, 4, 2, 6, 4};
      for (int i = 0; i < 6; i += 3) {
        simplices.insert(simplices.end(), {halves[i] + side, halves[i + 1] + side, halves[i + 2] + side, 8u});
      }
    }
    return simplices;
  };
  for (const bool low : {false, true}) {
    for (const bool high : {false, true}) {
      const std::vector<uint32_t> simplices = mesh_with(low, high);
      const MeshView view{.dimension = 3, .points = points, .simplices = simplices};
      const absl::Status status = ValidatePeriodic(view, std::vector<int>{0});
      EXPECT_EQ(status.ok(), low == high) << status;
      if (low != high) {
        EXPECT_THAT(std::string(status.message()), HasSubstr("has no image on xm"));
      }
    }
  }
}

}  // namespace
}  // namespace wellspace::core
