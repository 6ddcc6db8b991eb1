// Domains in the plane whose opposite sides match: vertices and facets in pairs, whatever lies inside, and later, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate_domain.h"
#include "core/validate/validate_periodic.h"
#include "tests/core/domain_input.h"
#include "tests/support/same_mesh.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;
using Input = test::DomainInput;

// All that is promised of the mesh of `input`.
absl::Status Check(const Mesh& mesh, const Input& input) {
  const MeshView view{.dimension = 2, .points = mesh.points, .simplices = mesh.simplices};
  const absl::Status domain = ValidateDomainMesh(view, mesh.facets, std::numbers::sqrt2, RunContext()).status();
  return domain.ok() ? ValidatePeriodic(view, input.parameters.periodic_axes) : domain;
}

class PeriodicDomainsTest : public test::SeededTest {
 protected:
  PeriodicDomainsTest() : SeededTest(4111) {}

  // The unit square along `axes`, its sides split at `stops`, from 0 to 1.
  static Input Square(std::vector<int> axes, const std::vector<double>& stops = {}) {
    std::vector<Point<2>> corners = {{0, 0}};
    for (const double stop : stops) {
      corners.push_back({stop, 0});
    }
    corners.push_back({1, 0});
    for (const double stop : stops) {
      corners.push_back({1, stop});
    }
    corners.push_back({1, 1});
    for (auto stop = stops.rbegin(); stop != stops.rend(); ++stop) {
      corners.push_back({*stop, 1});
    }
    corners.push_back({0, 1});
    for (auto stop = stops.rbegin(); stop != stops.rend(); ++stop) {
      corners.push_back({0, *stop});
    }
    Input input;
    input.Ring(corners);
    input.parameters.periodic_axes = std::move(axes);
    return input;
  }

  // The half of a polygon about (0, 0.5) on the right of the left side, and that on the left of the right one: from
  // `low` to `high`, with so many corners between.
  static void AddCrossingCircle(Input& input, double low, double high, int count) {
    for (const double side : {0.0, 1.0}) {
      const double radius = 0.5 * (high - low);
      Point<2> from = {side, low};
      for (int i = 1; i <= count + 1; ++i) {
        const double angle = std::numbers::pi * i / (count + 1);
        const double bulge = radius * std::sin(angle);
        const Point<2> to =
            i > count ? Point<2>{side, high}
                      : Point<2>{side == 0 ? bulge : 1 - bulge, 0.5 * (low + high) - radius * std::cos(angle)};
        input.Segment(from, to);
        from = to;
      }
    }
  }

  // Segments inside that end on the sides at the stops, with small angles there, on any of both sides; circles; points.
  Input RandomCell() {
    std::vector<double> stops;
    for (uint64_t i = 0, count = random_.Below(4); i < count; ++i) {
      stops.push_back((static_cast<double>(i) + 0.2 + 0.6 * random_.Unit()) / static_cast<double>(count));
    }
    static constexpr int kAxes[3][2] = {{0, 0}, {1, 1}, {0, 1}};
    const auto* axes = kAxes[random_.Below(3)];
    Input input = Square(axes[0] == axes[1] ? std::vector<int>{axes[0]} : std::vector<int>{0, 1}, stops);
    input.crossings = CrossingRule::kSplit;
    for (const double stop : stops) {
      for (const bool is_high : {false, true}) {
        if (random_.Below(2) == 0) {
          input.Segment({is_high ? 1.0 : 0.0, stop}, {0.1 + 0.8 * random_.Unit(), 0.05 + 0.9 * random_.Unit()});
        }
      }
      if (random_.Below(2) == 0) {
        const double shallow = std::exp2(-4 * random_.Unit() - 2);  // almost along the lower side
        input.Segment({stop, 0}, {stop < 0.5 ? 0.9 : 0.1, 0.5 * shallow});
      }
    }
    if (random_.Below(2) == 0) {
      input.Circle({0.5, 0.5}, 0.05 + 0.4 * random_.Unit(), 12);
    }
    for (uint64_t i = 0, count = random_.Below(20); i < count; ++i) {
      const double near = random_.Below(2) == 0 ? std::exp2(-12 * random_.Unit() - 1) : random_.Unit();
      input.points.insert(input.points.end(), {0.01 + 0.98 * near, 0.01 + 0.98 * random_.Unit()});
    }
    return input;
  }
};

TEST_F(PeriodicDomainsTest, SidesMatch) {
  std::vector<Input> inputs = {Square({0}), Square({1}), Square({0, 1}), Square({0, 1}, {0.25, 0.3, 0.9})};
  inputs.push_back(Square({0, 1}));
  inputs.back().Circle({0.75, 0.5}, 0.2, 40);  // near the right side alone
  inputs.back().seeds = {{.at = {0.75, 0.5}, .is_hole = true}};
  for (const bool is_hole : {false, true}) {
    inputs.push_back(Square({0, 1}, {0.375, 0.625}));
    AddCrossingCircle(inputs.back(), 0.375, 0.625, 9);
    inputs.back().seeds = {{.at = {0.01, 0.5}, .is_hole = is_hole, .region = 1},
                           {.at = {0.99, 0.5}, .is_hole = is_hole, .region = 1}};
    if (is_hole) {
      inputs.back().seeds.front().region = inputs.back().seeds.back().region = 0;
    }
  }
  // A small angle on one side alone.
  inputs.push_back(Square({0, 1}, {0.5}));
  inputs.back().Segment({0, 0.5}, {0.3, 0.52}).Segment({0, 0.5}, {0.03, 0.6});
  for (size_t i = 0; i < inputs.size(); ++i) {
    for (const double size : {0.0, 0.07}) {
      inputs[i].parameters.max_circumradius = size;
      const absl::StatusOr<Mesh> mesh = inputs[i].Make();
      ASSERT_TRUE(mesh.ok()) << i << ": " << mesh.status();
      EXPECT_EQ(Check(*mesh, inputs[i]), absl::OkStatus()) << "input " << i;
      test::ExpectPointsKept(inputs[i].points, *mesh);
    }
  }
}

TEST_F(PeriodicDomainsTest, BoxWithLinesInside) {
  Input input;
  input.Segment({0.2, 0.3}, {0.9, 0.35});
  input.faces = FaceRule::kBox;
  input.parameters.domain_low = {0, 0};
  input.parameters.domain_high = {1, 1};
  input.parameters.periodic_axes = {0, 1};
  absl::StatusOr<Mesh> mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(Check(*mesh, input), absl::OkStatus());
  input.points.insert(input.points.end(), {0, 0.5});
  mesh = input.Make();
  EXPECT_THAT(mesh.status().message(), HasSubstr("points[2] at (0, 0.5), on the side x = 0"));
}

TEST_F(PeriodicDomainsTest, RandomCells) {
  int meshed = 0;
  for (int i = 0; i < 60; ++i) {
    const Input input = RandomCell();
    const absl::StatusOr<Mesh> mesh = input.Make();
    if (!mesh.ok()) {  // a crossing on a side, or points too near to a segment
      EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << "cell " << i << ": " << mesh.status();
      continue;
    }
    EXPECT_EQ(Check(*mesh, input), absl::OkStatus()) << "cell " << i;
    ++meshed;
  }
  EXPECT_GE(meshed, 40);
}

// A vertex that has no place any more has no image either: what goes on from there matches.
TEST_F(PeriodicDomainsTest, GoesOnAfterItsBudgetHasEnded) {
  int ended = 0;
  for (int i = 0; i < 20; ++i) {
    Input input = RandomCell();
    const absl::StatusOr<Mesh> whole = input.Make();
    for (uint64_t short_by = 1; whole.ok() && short_by <= 6; ++short_by) {
      const std::unique_ptr<Mesher> mesher = input.Create();
      MeshParameters little = input.parameters;
      little.max_vertices = whole->vertex_count() - short_by;
      RunContext context;
      if (mesher->Refine(little, context).ok()) {
        continue;
      }
      ++ended;
      ASSERT_EQ(mesher->Refine(input.parameters, context), absl::OkStatus());
      const absl::StatusOr<Mesh> mesh = mesher->Extract(1, context);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_EQ(Check(*mesh, input), absl::OkStatus()) << "cell " << i << ", short by " << short_by;
    }
  }
  EXPECT_GE(ended, 40);
}

// The same bits on any number of threads, and with segments in any order and direction.
TEST_F(PeriodicDomainsTest, OneMesh) {
  Input input = Square({0, 1}, {0.375, 0.625});
  AddCrossingCircle(input, 0.375, 0.625, 31);
  input.parameters.max_circumradius = 0.004;
  const absl::StatusOr<Mesh> mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(Check(*mesh, input), absl::OkStatus());
  input.parameters.threads = 4;
  absl::StatusOr<Mesh> other = input.Make();
  ASSERT_TRUE(other.ok());
  test::ExpectSameMesh(*mesh, *other);
  for (size_t s = 0; s + 1 < input.markers.size(); s += 2) {
    std::swap(input.ends[2 * s], input.ends[2 * s + 3]);
    std::swap(input.ends[2 * s + 1], input.ends[2 * s + 2]);
  }
  other = input.Make();
  ASSERT_TRUE(other.ok());
  test::ExpectSameMesh(*mesh, *other);
}

TEST_F(PeriodicDomainsTest, HasFewMoreVertices) {
  for (const double size : {0.02, 0.005}) {
    Input input = Square({}, {0.375, 0.625});
    AddCrossingCircle(input, 0.375, 0.625, 31);
    input.Circle({0.8, 0.2}, 0.1, 60);
    input.parameters.max_circumradius = size;
    const absl::StatusOr<Mesh> plain = input.Make();
    ASSERT_TRUE(plain.ok()) << plain.status();
    for (const std::vector<int>& axes : {std::vector<int>{0}, {0, 1}}) {
      input.parameters.periodic_axes = axes;
      const absl::StatusOr<Mesh> mesh = input.Make();
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      const double ratio = static_cast<double>(mesh->vertex_count()) / static_cast<double>(plain->vertex_count());
      EXPECT_LE(ratio, 1.03) << "size " << size << ", " << axes.size() << " axes";
    }
  }
}

TEST_F(PeriodicDomainsTest, AddedPointsGetImages) {
  Input input = Square({0, 1}, {0.375, 0.625});
  AddCrossingCircle(input, 0.375, 0.625, 9);
  const std::unique_ptr<Mesher> mesher = input.Create();
  RunContext context;
  ASSERT_EQ(mesher->Refine(input.parameters, context), absl::OkStatus());
  const std::vector<double> points = {0.5, 0.5, 0, 0.17, 1, 0.83, 0.29, 1, 0, 0, 0.61, 0, 0.61, 1};
  const absl::StatusOr<std::vector<uint32_t>> vertices = mesher->AddPoints(points, context);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_TRUE(mesher->AddVertex(vertices->at(0), std::vector<double>{1, 0.21}).ok());
  input.parameters.max_circumradius = 0.05;
  ASSERT_EQ(mesher->Refine(input.parameters, context), absl::OkStatus());
  const absl::StatusOr<Mesh> mesh = mesher->Extract(1, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(Check(*mesh, input), absl::OkStatus());
  for (size_t i = 0; i < vertices->size(); ++i) {
    for (const size_t k : {0, 1}) {
      EXPECT_EQ(mesh->points[2 * vertices->at(i) + k], points[2 * i + k]);
    }
  }
  // As near to a side as to be on it, and not exactly there.
  const std::vector<double> beside = {1e-15, 0.91};
  EXPECT_THAT(mesher->AddPoints(beside, context).status().message(), HasSubstr("points[0]"));
}

TEST_F(PeriodicDomainsTest, SidesThatDoNotMatchAreRefused) {
  Input input = Square({0, 1});
  input.Segment({0.5, 0.5}, {1, 0.5});  // it splits the right side
  input.crossings = CrossingRule::kSnap;
  EXPECT_EQ(input.Make().status().message(),
            "periodic_axes: points[5] at (1, 0.5), on the side x = 1, has no image on the side x = 0; expected a point "
            "at (0, 0.5), equal to the bit, or none on either side");
  input.parameters.periodic_axes = {1};
  EXPECT_TRUE(input.Make().ok());
  Input disc;
  disc.Circle({0, 0}, 1, 64);
  disc.parameters.periodic_axes = {0};
  EXPECT_THAT(disc.Make().status().message(), HasSubstr("side x = "));
}

TEST_F(PeriodicDomainsTest, IsCancelled) {
  Input input = Square({0, 1});
  input.parameters.max_circumradius = 0.001;
  const std::unique_ptr<Mesher> mesher = input.Create();
  RunContext context;
  context.Cancel();
  EXPECT_EQ(mesher->Refine(input.parameters, context).code(), absl::StatusCode::kCancelled);
  RunContext again;
  input.parameters.max_circumradius = 0.05;
  ASSERT_EQ(mesher->Refine(input.parameters, again), absl::OkStatus());
  const absl::StatusOr<Mesh> mesh = mesher->Extract(1, again);
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(Check(*mesh, input), absl::OkStatus());
}

}  // namespace
}  // namespace wellspace::core
