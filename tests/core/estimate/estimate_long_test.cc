// The estimate against the meshes themselves, on the clouds of bench/sizes and on others; docs/design/estimate.md says
// which of them the model was fitted to, and which are left out.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

// Under a sanitizer the process allocates more than the memory of the mesh.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMeasuresMemory = false;
#else
constexpr bool kMeasuresMemory = true;
#endif

struct Cloud {
  int dimension = 0;
  std::vector<double> points;
  std::vector<double> low;
  std::vector<double> high;
};

// A cloud of examples/, brought into the unit box as bench/sizes does it: a longest side of 0.8, centred.
Cloud Example(const std::string& name, int dimension) {
  Cloud cloud{dimension, {}, test::UnitLow(dimension), test::UnitHigh(dimension)};
  const char* const folder = std::getenv("WELLSPACE_EXAMPLES_DIR");
  std::ifstream file(std::string(folder == nullptr ? "examples" : folder) + "/" + name + ".csv");
  EXPECT_TRUE(file.is_open()) << "set WELLSPACE_EXAMPLES_DIR to the folder examples";
  std::string line;
  std::getline(file, line);  // the header
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::string field;
    for (int k = 0; k < dimension && std::getline(row, field, ','); ++k) {
      cloud.points.push_back(std::stod(field));
    }
  }
  std::vector<double> low(dimension, std::numeric_limits<double>::infinity());
  std::vector<double> high(dimension, -std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    low[i % dimension] = std::min(low[i % dimension], cloud.points[i]);
    high[i % dimension] = std::max(high[i % dimension], cloud.points[i]);
  }
  double longest = 0;
  for (int k = 0; k < dimension; ++k) {
    longest = std::max(longest, high[k] - low[k]);
  }
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const size_t k = i % dimension;
    cloud.points[i] = 0.5 + 0.8 / longest * (cloud.points[i] - (low[k] + high[k]) / 2);
  }
  return cloud;
}

// Clouds that the model was not fitted to (it was to a helix and a plane, akin to `spring` and `sheet`), in the unit
// box but for `slab`.
Cloud Unseen(std::string_view kind, int dimension, size_t n) {
  Cloud cloud{dimension, {}, test::UnitLow(dimension), test::UnitHigh(dimension)};
  test::SplitMix64 random(20081);
  std::vector<double> p(dimension);
  for (size_t i = 0; i < n; ++i) {
    const double t = (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    std::fill(p.begin(), p.end(), 0.5);
    if (kind == "spring") {  // on a helix, in 2-D a spiral
      const double radius = dimension == 2 ? 0.4 * t : 0.3;
      p[0] += radius * std::cos(40 * t);
      p[1] += radius * std::sin(40 * t);
      p[dimension - 1] = dimension == 2 ? p[1] : 0.1 + 0.8 * t;
    } else if (kind == "halos") {  // density falls with the cube of the distance from two centres
      const double radius = 0.2 * std::pow(1e-3 + random.Unit(), 1.5);
      double length = 0;
      for (double& x : p) {
        x = random.Gauss();
        length += x * x;
      }
      for (double& x : p) {
        x = (i % 2 == 0 ? 0.3 : 0.7) + radius * x / std::sqrt(length);
      }
    } else if (kind == "sheet") {  // on a wavy surface, in 2-D a curve
      for (double& x : p) {
        x = 0.05 + 0.9 * random.Unit();
      }
      p[dimension - 1] = 0.5 + 0.2 * std::sin(7 * p[0]) * (dimension == 2 ? 1 : std::cos(5 * p[1]));
    } else if (kind == "steps") {  // uniform, of a density that changes by 2^D from one half to the other, twice
      const double half = random.Unit();
      for (double& x : p) {
        x = random.Unit();
      }
      p[0] = half < 0.6 ? 0.25 * p[0] : half < 0.9 ? 0.25 + 0.25 * p[0] : 0.5 + 0.5 * p[0];
    } else {  // slab: a box of 1 : 1 : 4, points in the lower quarter
      for (double& x : p) {
        x = random.Unit();
      }
      cloud.high[dimension - 1] = 4;
    }
    cloud.points.insert(cloud.points.end(), p.begin(), p.end());
  }
  return cloud;
}

// The figures of a mesh that a process of its own makes, so that the peak of its memory is that of this mesh.
struct Made {
  double vertices = 0;
  double simplices = 0;
  double bytes = 0;
};

double PeakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;
}

std::optional<Made> MakeMesh(const MeshParameters& parameters, const Cloud& cloud) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) {
    return std::nullopt;
  }
  malloc_trim(0);  // memory that this process has freed would serve the child
  const pid_t child = fork();
  if (child == 0) {
    RunContext context;
    const double before = PeakBytes();
    const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud.points, context);
    Made made;
    if (mesh.ok()) {
      made = {static_cast<double>(mesh->vertex_count()), static_cast<double>(mesh->simplex_count()),
              PeakBytes() - before};
    }
    const bool written = mesh.ok() && write(ends[1], &made, sizeof(made)) == sizeof(made);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  Made made;
  const bool is_read = child > 0 && read(ends[0], &made, sizeof(made)) == sizeof(made);
  close(ends[0]);
  int status = 0;
  if (child > 0) {
    waitpid(child, &status, 0);
  }
  return is_read && status == 0 ? std::optional(made) : std::nullopt;
}

double Factor(double a, double b) { return std::max(a, b) / std::min(a, b); }

// By the default the mesh is repaired, if `min_dihedral` does not say otherwise.
void ExpectGoodEstimate(const Cloud& cloud, double rho, double most, std::optional<double> min_dihedral = {}) {
  SCOPED_TRACE("rho " + std::to_string(rho));
  MeshParameters parameters;
  parameters.dimension = cloud.dimension;
  parameters.rho = rho;
  parameters.min_dihedral = min_dihedral;
  parameters.domain_low = cloud.low;
  parameters.domain_high = cloud.high;
  const std::optional<Made> made = MakeMesh(parameters, cloud);
  ASSERT_TRUE(made.has_value());
  RunContext context;
  const absl::StatusOr<MeshEstimate> estimate = EstimateMesh(parameters, cloud.points, context);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  const auto vertices = static_cast<double>(estimate->vertices);
  const auto simplices = static_cast<double>(estimate->simplices);
  const auto bytes = static_cast<double>(estimate->memory_bytes);
  EXPECT_LE(Factor(vertices, made->vertices), most) << vertices << " for " << made->vertices;
  EXPECT_LE(Factor(simplices, made->simplices), most) << simplices << " for " << made->simplices;
  if (kMeasuresMemory) {
    EXPECT_LE(Factor(bytes, made->bytes), most) << bytes << " for " << made->bytes;
  }
}

struct Case {
  std::string_view kind;  // of tests/support/clouds.h; one of the above; or a file of examples/
  int dimension;
  size_t points;  // 0 for a file
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.kind << "-" << c.dimension << "-" << c.points; }

std::string CaseName(const ::testing::TestParamInfo<Case>& info) {
  std::string name = test::CloudName(info.param.kind, info.param.dimension);
  return info.param.points == 0 ? name : name + "_" + std::to_string(info.param.points);
}

Cloud CloudOf(const Case& c) {
  if (c.points == 0) {
    return Example(std::string(c.kind), c.dimension);
  }
  if (std::find(test::kReferenceKinds.begin(), test::kReferenceKinds.end(), c.kind) == test::kReferenceKinds.end()) {
    return Unseen(c.kind, c.dimension, c.points);
  }
  return {c.dimension, test::MakeCloud(c.kind, c.dimension, c.points), test::UnitLow(c.dimension),
          test::UnitHigh(c.dimension)};
}

class EstimateLongTest : public ::testing::TestWithParam<Case> {};

TEST_P(EstimateLongTest, AtTheDefaultRho) {
  ExpectGoodEstimate(CloudOf(GetParam()), DefaultRho(GetParam().dimension), 1.5);
}

INSTANTIATE_TEST_SUITE_P(Sizes, EstimateLongTest,
                         ::testing::Values(Case{"uniform", 2, 10000}, Case{"inner", 2, 10000},
                                           Case{"clusters", 2, 100000}, Case{"lines", 2, 100000},
                                           Case{"annuli", 2, 100000}, Case{"grid", 2, 90000}, Case{"coast-110m", 2, 0},
                                           Case{"coast-50m", 2, 0}, Case{"uniform", 2, 1000000},
                                           Case{"uniform", 3, 10000}, Case{"uniform", 3, 100000},
                                           Case{"inner", 3, 10000}, Case{"sphere", 3, 10000},
                                           Case{"clusters", 3, 100000}, Case{"annuli", 3, 100000},
                                           Case{"skew", 3, 2000}, Case{"skew", 3, 20000}, Case{"moment", 3, 2000},
                                           Case{"moment", 3, 10000}, Case{"grid", 3, 64000}, Case{"spot", 3, 0}),
                         CaseName);

INSTANTIATE_TEST_SUITE_P(Unseen, EstimateLongTest,
                         ::testing::Values(Case{"spring", 2, 5000}, Case{"halos", 2, 20000}, Case{"sheet", 2, 5000},
                                           Case{"steps", 2, 20000}, Case{"slab", 2, 5000}, Case{"spring", 3, 5000},
                                           Case{"halos", 3, 10000}, Case{"sheet", 3, 5000}, Case{"steps", 3, 10000},
                                           Case{"slab", 3, 5000}),
                         CaseName);

class EstimateAtAnyRhoLongTest : public ::testing::TestWithParam<Case> {};

TEST_P(EstimateAtAnyRhoLongTest, FromTheTightestToNone) {
  const int dimension = GetParam().dimension;
  for (const double rho : {1.0, 1.2, 1.7, 3.0, 5.0, 20.0, 1000.0}) {
    // Large rho asks for the triangulation of the points themselves where that is quadratic: nothing to wait for.
    const bool is_quadratic = dimension == 3 && (GetParam().kind == "skew" || GetParam().kind == "sphere");
    if ((dimension == 3 && rho < 1.2) || (is_quadratic && rho > 20)) {
      continue;
    }
    ExpectGoodEstimate(CloudOf(GetParam()), rho, 2, /*min_dihedral=*/0);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, EstimateAtAnyRhoLongTest,
                         ::testing::Values(Case{"uniform", 2, 10000}, Case{"inner", 2, 10000},
                                           Case{"clusters", 2, 10000}, Case{"lines", 2, 10000},
                                           Case{"annuli", 2, 10000}, Case{"grid", 2, 10000}, Case{"coast-110m", 2, 0},
                                           Case{"uniform", 3, 3000}, Case{"inner", 3, 3000}, Case{"sphere", 3, 1000},
                                           Case{"clusters", 3, 3000}, Case{"annuli", 3, 3000}, Case{"skew", 3, 2000},
                                           Case{"moment", 3, 2000}, Case{"grid", 3, 8000}, Case{"spot", 3, 0}),
                         CaseName);

// Without the 3-D spring, whose own triangulation is quadratic too.
INSTANTIATE_TEST_SUITE_P(Unseen, EstimateAtAnyRhoLongTest,
                         ::testing::Values(Case{"spring", 2, 2000}, Case{"halos", 2, 5000}, Case{"sheet", 2, 2000},
                                           Case{"steps", 2, 5000}, Case{"slab", 2, 3000}, Case{"halos", 3, 3000},
                                           Case{"sheet", 3, 1000}, Case{"steps", 3, 3000}, Case{"slab", 3, 2000}),
                         CaseName);

}  // namespace
}  // namespace wellspace::core
