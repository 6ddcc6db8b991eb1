// Slivers of four points that cannot move: quadruples of one plane and one circle, as swept or revolved scans have.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include "core/geometry/point.h"
#include "core/meshers/mesher.h"
#include "core/simplex/quality.h"
#include "core/sliver/repair.h"
#include "core/validate/validate.h"

namespace wellspace::core {
namespace {

using Points = std::vector<Point<3>>;

double Turn(int i, int n) { return 2 * std::numbers::pi * i / n; }

// The profile (distance from the axis, height) at `n` angles.
Points Revolved(const std::vector<std::array<double, 2>>& profile, int n) {
  Points points;
  for (const auto& [radius, height] : profile) {
    for (int i = 0; i < n; ++i) {
      points.push_back({radius * std::cos(Turn(i, n)), radius * std::sin(Turn(i, n)), height});
    }
  }
  return points;
}

Points Torus(int around, int along) {
  std::vector<std::array<double, 2>> profile;
  for (int j = 0; j < around; ++j) {
    profile.push_back({4 + std::cos(Turn(j, around)), std::sin(Turn(j, around))});
  }
  return Revolved(profile, along);
}

Points Cylinder(int around, int along) {
  std::vector<std::array<double, 2>> profile;
  for (int k = 0; k <= along; ++k) {
    profile.push_back({1, 3.0 * k / along});
  }
  return Revolved(profile, around);
}

Points Sphere(int latitudes, int longitudes) {
  std::vector<std::array<double, 2>> profile;
  for (int j = 1; j < latitudes; ++j) {
    profile.push_back({std::sin(Turn(j, 2 * latitudes)), std::cos(Turn(j, 2 * latitudes))});
  }
  Points points = Revolved(profile, longitudes);
  points.push_back({0, 0, 1});
  points.push_back({0, 0, -1});
  return points;
}

// A vase: a polyline turned about an axis.
Points Vase(int rows, int around) {
  std::vector<std::array<double, 2>> profile;
  for (int k = 0; k < rows; ++k) {
    profile.push_back({0.5 + 0.07 * ((k * 7) % 11), 0.5 * k});
  }
  return Revolved(profile, around);
}

Points Extruded(int corners, int along) {
  Points points;
  for (int k = 0; k < corners; ++k) {
    for (int i = 0; i < along; ++i) {
      points.push_back({0.5 * k, 0.09 * ((k * 5) % 11), 0.4 * i});
    }
  }
  return points;
}

Points Grid(int n) {
  Points points;
  for (int i = 0; i < n * n * n; ++i) {
    points.push_back({0.1 * (i % n), 0.1 * (i / n % n), 0.1 * (i / n / n)});
  }
  return points;
}

// Turned by `angle` about an axis that is none of the coordinates', scaled and shifted.
std::vector<double> Placed(const Points& points, double angle, double scale, const Point<3>& shift) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  std::vector<double> out;
  for (const Point<3>& p : points) {
    const Point<3> q = {c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]};
    const Point<3> r = {q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]};
    for (int k = 0; k < 3; ++k) {
      out.push_back(scale * r[k] + shift[k]);
    }
  }
  return out;
}

struct Case {
  const char* name;
  std::function<Points()> make;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class SliverFlatsTest : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(
    Clouds, SliverFlatsTest,
    ::testing::Values(Case{"Torus", [] { return Torus(10, 20); }}, Case{"LargeTorus", [] { return Torus(30, 60); }},
                      Case{"Cylinder", [] { return Cylinder(20, 10); }}, Case{"Sphere", [] { return Sphere(12, 24); }},
                      Case{"Vase", [] { return Vase(12, 24); }}, Case{"Extruded", [] { return Extruded(20, 15); }},
                      Case{"Grid", [] { return Grid(6); }}),
    [](const auto& c) { return std::string(c.param.name); });

Mesh MeshOf(const MeshParameters& parameters, const std::vector<double>& cloud) {
  RunContext context;
  absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : Mesh{};
}

absl::Status Validate(const Mesh& mesh, const std::vector<double>& cloud, double rho, double min_angle_deg) {
  ValidationOptions options;
  options.rho = rho;
  options.cloud = cloud;
  options.min_angle_deg = min_angle_deg;
  return ValidateMesh({3, mesh.points, mesh.simplices, mesh.weights}, options);
}

TEST_P(SliverFlatsTest, AreRepairedAtEveryScaleAndTurn) {
  const Points points = GetParam().make();
  const struct {
    double angle;
    double scale;
    Point<3> shift;
  } kPlaces[] = {{0, 1, {0, 0, 0}},
                 {0.4, 1, {0, 0, 0}},
                 {1.1, 1, {0, 0, 0}},
                 {0, 1e-6, {0, 0, 0}},
                 {0, 1e6, {0, 0, 0}},
                 {0.7, 1e-6, {0, 0, 0}},
                 {2.3, 1e6, {0, 0, 0}},
                 {0, 1, {500'000.25, 5'400'000.5, 120}},
                 {0.9, 7, {451'234.567, 5'412'345.678, 88.1}}};
  for (const auto& [angle, scale, shift] : kPlaces) {
    SCOPED_TRACE(testing::Message() << "turned by " << angle << ", scaled by " << scale << ", shifted by " << shift[0]);
    const std::vector<double> cloud = Placed(points, angle, scale, shift);
    const Mesh mesh = MeshOf({}, cloud);
    EXPECT_EQ(mesh.statistics.slivers_left, 0);
    EXPECT_TRUE(mesh.statistics.slivers_wanted);
    const absl::Status valid = Validate(mesh, cloud, 2, 12);
    EXPECT_TRUE(valid.ok()) << valid;
  }
}

TEST_P(SliverFlatsTest, DoNotDependOnThreads) {
  const std::vector<double> cloud = Placed(GetParam().make(), 0.4, 1, {0, 0, 0});
  MeshParameters parameters;
  const Mesh one = MeshOf(parameters, cloud);
  parameters.threads = 3;
  const Mesh three = MeshOf(parameters, cloud);
  EXPECT_EQ(one.points, three.points);
  EXPECT_EQ(one.simplices, three.simplices);
  EXPECT_EQ(one.statistics.sliver_operations, three.statistics.sliver_operations);
}

// However large rho is, and with it stars: the repair ends, and counts the slivers left.
TEST(SliverWorkTest, IsBoundedWhateverRho) {
  const std::vector<double> torus = Placed(Torus(12, 24), 0, 1, {0, 0, 0});
  const std::vector<double> sphere = Placed(Sphere(15, 30), 0, 1, {0, 0, 0});
  uint64_t given_up = 0;
  for (const double rho : {2.0, 5.0, 30.0, 1000.0}) {
    for (const std::vector<double>& cloud : {torus, sphere}) {
      SCOPED_TRACE(testing::Message() << "rho " << rho << ", points " << cloud.size() / 3);
      MeshParameters parameters;
      parameters.rho = rho;
      const Mesh mesh = MeshOf(parameters, cloud);
      const MeshStatistics& statistics = mesh.statistics;
      const uint64_t most = RepairReport::kMostOperations * (statistics.slivers + RepairReport::kFreeSlivers);
      EXPECT_LT(statistics.sliver_operations, most + most / 100);
      // Those of the default are far from the bound.
      EXPECT_LT(statistics.sliver_operations, rho == 2 ? 10'000 * statistics.slivers : most + most / 100);
      const uint64_t by_work = statistics.slivers_left_by[static_cast<size_t>(SliverReason::kWork)];
      EXPECT_TRUE(by_work == 0 || statistics.sliver_operations >= most);
      given_up += by_work;
      const absl::Status valid = Validate(mesh, cloud, rho, statistics.slivers_left == 0 ? 12 : 0);
      EXPECT_TRUE(valid.ok()) << valid;
    }
  }
  EXPECT_GT(given_up, 0);  // so that the bound is reached at all
}

// Each sliver that is left has a reason, and the flattest are named: they are tetrahedra of the mesh with that angle.
TEST(SliverLeftTest, IsNamedWithTheReason) {
  MeshParameters parameters;
  parameters.criterion = Criterion::kWellSpaced;
  parameters.min_dihedral = 18;
  const std::vector<double> cloud = Placed(Sphere(10, 20), 0, 1, {0, 0, 0});
  const Mesh mesh = MeshOf(parameters, cloud);
  const MeshStatistics& statistics = mesh.statistics;
  ASSERT_GT(statistics.slivers_left, 0);
  EXPECT_EQ(statistics.slivers_left_by[0] + statistics.slivers_left_by[1] + statistics.slivers_left_by[2],
            statistics.slivers_left);
  EXPECT_EQ(statistics.slivers_left, MeasureQuality({3, mesh.points, mesh.simplices}).CountBelow(18));
  ASSERT_EQ(statistics.flattest_left.size(), std::min<size_t>(statistics.slivers_left, kMostNamedSlivers));
  EXPECT_NEAR(statistics.flattest_left[0].min_angle_deg, statistics.min_angle_deg, 1e-9);
  std::vector<std::array<uint32_t, 4>> simplices;
  for (size_t at = 0; at < mesh.simplices.size(); at += 4) {
    std::array<uint32_t, 4>& corners = simplices.emplace_back();
    std::copy_n(&mesh.simplices[at], 4, corners.begin());
    std::sort(corners.begin(), corners.end());
  }
  for (const LeftSliver& sliver : statistics.flattest_left) {
    std::array<uint32_t, 4> corners = sliver.vertices;
    std::sort(corners.begin(), corners.end());
    EXPECT_EQ(std::count(simplices.begin(), simplices.end(), corners), 1);
    EXPECT_LT(sliver.min_angle_deg, 18);
  }
}

// An angle of 0 before is not taken for nothing asked.
TEST(SliverLeftTest, NothingIsSaidOnlyWhereNothingWasAsked) {
  const std::vector<double> cloud = Placed(Torus(10, 20), 0, 1, {0, 0, 0});
  MeshParameters parameters;
  EXPECT_TRUE(MeshOf(parameters, cloud).statistics.slivers_wanted);
  parameters.min_dihedral = 0;
  EXPECT_FALSE(MeshOf(parameters, cloud).statistics.slivers_wanted);
  parameters.pump_weights = true;
  EXPECT_TRUE(MeshOf(parameters, cloud).statistics.slivers_wanted);
}

}  // namespace
}  // namespace wellspace::core
