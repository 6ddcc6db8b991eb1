// The promises of docs/design/sliver.md on large clouds: angles, bound, numbers of vertices, time, and what pumping
// alone reaches.
//
// WELLSPACE_EXAMPLES_DIR: the folder of spot.csv.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMeasuresTime = false;
#else
constexpr bool kMeasuresTime = true;
#endif

struct Case {
  std::string_view kind;
  size_t points;
  bool is_kept_back = false;  // a cloud that nothing was tuned on
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.kind << "-3-" << c.points; }

// examples/spot.csv with a longest side of 0.8, centred in the unit box.
std::vector<double> Spot() {
  const char* const folder = std::getenv("WELLSPACE_EXAMPLES_DIR");
  std::ifstream file(std::string(folder == nullptr ? "examples" : folder) + "/spot.csv");
  EXPECT_TRUE(file.is_open()) << "set WELLSPACE_EXAMPLES_DIR to the folder examples";
  std::vector<double> points;
  std::string line;
  std::getline(file, line);  // the header
  while (std::getline(file, line)) {
    std::istringstream row(line);
    for (std::string field; std::getline(row, field, ',');) {
      points.push_back(std::stod(field));
    }
  }
  std::vector<double> low(3, std::numeric_limits<double>::infinity());
  std::vector<double> high(3, -std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < points.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], points[i]);
    high[i % 3] = std::max(high[i % 3], points[i]);
  }
  const double longest = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = 0.5 + 0.8 / longest * (points[i] - (low[i % 3] + high[i % 3]) / 2);
  }
  return points;
}

// Clouds of another seed and of other kinds than those of the table.
std::vector<double> KeptBack(std::string_view kind, size_t n) {
  test::SplitMix64 random(test::Seed(20090823));
  std::vector<double> points;
  for (size_t i = 0; i < n; ++i) {
    double p[3] = {random.Unit(), random.Unit(), random.Unit()};
    if (kind == "ball") {  // denser towards the centre
      const double radius = 0.45 * std::pow(random.Unit(), 0.7);
      double length = 0;
      for (double& x : p) {
        x = random.Gauss();
        length += x * x;
      }
      for (double& x : p) {
        x = 0.5 + radius * x / std::sqrt(length);
      }
    } else if (kind == "helix") {
      const double t = (static_cast<double>(i) + random.Unit()) / static_cast<double>(n);
      p[0] = 0.5 + 0.3 * std::cos(60 * t);
      p[1] = 0.5 + 0.3 * std::sin(60 * t);
      p[2] = 0.1 + 0.8 * t;
    } else if (kind == "wave") {  // a surface
      p[2] = 0.5 + 0.2 * std::sin(7 * p[0]) * std::cos(5 * p[1]);
    } else if (kind == "jitter") {  // a lattice, slightly disturbed
      for (double& x : p) {
        x = 0.05 + 0.05 * static_cast<double>(random.Below(19)) + 1e-3 * x;
      }
    }
    points.insert(points.end(), p, p + 3);
  }
  return points;
}

std::vector<double> CloudOf(const Case& c) {
  return c.kind == "spot" ? Spot() : c.is_kept_back ? KeptBack(c.kind, c.points) : test::MakeCloud(c.kind, 3, c.points);
}

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

class SliverLongTest : public ::testing::TestWithParam<Case> {
 protected:
  struct Made {
    Mesh mesh;
    double seconds = 0;  // of one core
  };

  Made MeshOf(double min_dihedral, bool pump_weights = false) const {
    MeshParameters parameters = test::InUnitBox(3);
    parameters.min_dihedral = min_dihedral;
    parameters.pump_weights = pump_weights;
    RunContext context;
    const double before = CpuSeconds();
    absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud_, context);
    const double seconds = CpuSeconds() - before;
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return {mesh.ok() ? *std::move(mesh) : Mesh{}, seconds};
  }

  // Indices, topology, exact volume, Delaunay or regular, the cloud; rho of those that are Delaunay.
  void ExpectValid(const Mesh& mesh, double min_angle_deg) const {
    const absl::Status status = ValidateMesh({3, mesh.points, mesh.simplices, mesh.weights},
                                             {.rho = 2, .cloud = cloud_, .min_angle_deg = min_angle_deg});
    EXPECT_TRUE(status.ok()) << status;
  }

  const std::vector<double> cloud_ = CloudOf(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Targets, SliverLongTest,
                         ::testing::Values(Case{"uniform", 100000}, Case{"sphere", 100000}, Case{"clusters", 100000},
                                           Case{"skew", 20000}, Case{"moment", 10000}, Case{"grid", 64000},
                                           Case{"spot", 2930}),
                         [](const auto& c) { return std::string(c.param.kind); });
INSTANTIATE_TEST_SUITE_P(KeptBack, SliverLongTest,
                         ::testing::Values(Case{"uniform", 40000, true}, Case{"ball", 30000, true},
                                           Case{"helix", 5000, true}, Case{"wave", 10000, true},
                                           Case{"jitter", 6000, true}),
                         [](const auto& c) { return std::string(c.param.kind); });

TEST_P(SliverLongTest, AnglesAreReachedWithFewVerticesInLittleTime) {
  const Made plain = MeshOf(0);
  const auto plain_vertices = static_cast<double>(plain.mesh.vertex_count());
  for (const double angle : {12.0, 15.0}) {
    SCOPED_TRACE(angle);
    const auto [mesh, seconds] = MeshOf(angle);
    ExpectValid(mesh, angle);
    EXPECT_TRUE(mesh.weights.empty());
    EXPECT_EQ(mesh.statistics.slivers_left, 0);
    const double growth = static_cast<double>(mesh.vertex_count()) / plain_vertices;
    EXPECT_LE(growth, angle == 12 ? 1.03 : 1.25);
    std::cout << absl::StrFormat("%s: %.0f degrees: from %.3f to %.3f degrees, %.4f vertices, %.2f time\n",
                                 ::testing::PrintToString(GetParam()), angle, plain.mesh.statistics.min_angle_deg,
                                 mesh.statistics.min_angle_deg, growth, seconds / plain.seconds);
    if (kMeasuresTime && angle == 12) {
      EXPECT_LE(seconds, 1.6 * plain.seconds);
    }
  }
}

TEST_P(SliverLongTest, PumpingAloneLeavesFewSlivers) {
  const Mesh mesh = MeshOf(0, true).mesh;
  ExpectValid(mesh, 3);
  const QualityReport report = MeasureQuality({3, mesh.points, mesh.simplices});
  const double share = static_cast<double>(report.CountBelow(5)) / static_cast<double>(report.simplices);
  std::cout << absl::StrFormat("%s: pumped: %.3f degrees, %d of %d below 5\n", ::testing::PrintToString(GetParam()),
                               report.min_angle_deg, report.CountBelow(5), report.simplices);
  EXPECT_LE(share, 1e-4);
}

}  // namespace
}  // namespace wellspace::core
