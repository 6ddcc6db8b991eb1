// Every number of a request may be any double: meshing and estimating end, within bounded work, and counts are counts.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/base/saturate.h"
#include "core/meshers/mesher.h"
#include "gtest/gtest.h"

namespace wellspace::core {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Field {
  const char* name;
  std::function<void(MeshParameters&, double)> set;
};

void SetDomain(MeshParameters& parameters, double side) {
  parameters.domain_low.assign(parameters.dimension, 0.0);
  parameters.domain_high.assign(parameters.dimension, side);
}

std::vector<Field> Fields() {
  const auto box = [](MeshParameters& p, double low, double high, double size) {
    p.size_boxes.push_back({std::vector<double>(p.dimension, low), std::vector<double>(p.dimension, high), size});
  };
  const auto sample = [](MeshParameters& p, double place, double size) {
    p.size_samples = std::make_shared<SizeSamples>(SizeSamples{std::vector<double>(p.dimension, place), {size}});
  };
  return {
      {"rho", [](MeshParameters& p, double x) { p.rho = x; }},
      {"margin", [](MeshParameters& p, double x) { p.margin = x; }},
      {"max_circumradius", [](MeshParameters& p, double x) { p.max_circumradius = x; }},
      {"max_circumradius in a box",
       [](MeshParameters& p, double x) {
         SetDomain(p, 2);
         p.max_circumradius = x;
       }},
      {"size of a box", [box](MeshParameters& p, double x) { box(p, 0.25, 0.5, x); }},
      {"size of a place", [box](MeshParameters& p, double x) { box(p, 0.25, 0.25, x); }},
      {"corners of a size box", [box](MeshParameters& p, double x) { box(p, -x, x, 0.5); }},
      {"corner of a size box", [box](MeshParameters& p, double x) { box(p, x, x, 0.5); }},
      {"edge_length", [](MeshParameters& p, double x) { p.edge_length = x; }},
      {"size of a sample", [sample](MeshParameters& p, double x) { sample(p, 0.25, x); }},
      {"place of a sample", [sample](MeshParameters& p, double x) { sample(p, x, 0.5); }},
      {"place of a sample in a large domain",
       [sample](MeshParameters& p, double x) {
         SetDomain(p, 1e300);
         sample(p, x, 0.5);
       }},
      {"gradation",
       [sample, box](MeshParameters& p, double x) {
         p.gradation = x;
         sample(p, 0.25, 0.1);
         box(p, 0.25, 0.5, 0.2);
       }},
      {"domain", [](MeshParameters& p, double x) { SetDomain(p, x); }},
      {"domain beside a size",
       [](MeshParameters& p, double x) {
         SetDomain(p, x);
         p.max_circumradius = 1;
       }},
      {"domain beside a size box",
       [box](MeshParameters& p, double x) {
         SetDomain(p, x);
         box(p, -1e300, 1e300, 1);
       }},
      {"thickness of the domain",
       [](MeshParameters& p, double x) {
         SetDomain(p, 1);
         p.domain_high.back() = x;
       }},
      {"merge_distance", [](MeshParameters& p, double x) { p.merge_distance = x; }},
      {"min_dihedral", [](MeshParameters& p, double x) { p.min_dihedral = x; }},
  };
}

void ExpectBounded(const MeshParameters& parameters, const std::vector<double>& points, const std::string& what) {
  RunContext context;
  if (const absl::StatusOr<MeshEstimate> estimate = EstimateMesh(parameters, points, context); estimate.ok()) {
    EXPECT_GE(estimate->vertices, uint64_t{1} << parameters.dimension) << what;
    EXPECT_GE(estimate->simplices, 2u) << what;
    EXPECT_GE(estimate->memory_bytes, 1'000'000u) << what;
    EXPECT_LE(estimate->vertices, static_cast<uint64_t>(kMostCounted)) << what;
    EXPECT_LE(estimate->simplices, static_cast<uint64_t>(kMostCounted)) << what;
    EXPECT_LE(estimate->memory_bytes, static_cast<uint64_t>(kMostCounted)) << what;
    EXPECT_LE(estimate->bytes_per_vertex, 1e8) << what;
  } else {
    EXPECT_FALSE(estimate.status().message().empty()) << what;
  }
  RunContext again;
  if (const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, points, again); mesh.ok()) {
    EXPECT_LE(mesh->vertex_count(), parameters.max_vertices) << what;
  } else {
    EXPECT_TRUE(mesh.status().code() == absl::StatusCode::kInvalidArgument ||
                mesh.status().code() == absl::StatusCode::kResourceExhausted)
        << what << ": " << mesh.status();
  }
}

class ParameterExtremesTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Dimensions, ParameterExtremesTest, ::testing::Range(2, 7));

// Every so many exponents, for each field others: meshes and estimates take from 1 ms in 2-D to half a second in 6-D.
TEST_P(ParameterExtremesTest, EveryExponentOfEveryFieldEnds) {
  const int dimension = GetParam();
  const int step = std::vector{0, 0, 29, 61, 131, 263, 401}[dimension];
  std::vector<double> points(2 * dimension, 0.125);
  std::fill(points.begin() + dimension, points.end(), 0.5);
  int first = 0;
  for (const Field& field : Fields()) {
    for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
      const auto expect = [&](double x) {
        MeshParameters parameters{.dimension = dimension, .criterion = criterion};
        parameters.min_dihedral = 0;
        parameters.max_vertices = (uint64_t{1} << dimension) + (dimension < 5 ? 60 : 10);
        field.set(parameters, x);
        // In a domain that leaves points out there are none.
        const bool has_points = parameters.domain_high.empty() || parameters.domain_high.back() >= 1;
        ExpectBounded(parameters, has_points ? points : std::vector<double>{},
                      std::string(field.name) + " = " + std::to_string(std::log2(x)));
      };
      first = (first + 7) % step;
      for (int exponent = -1074 + first; exponent <= 1023; exponent += step) {
        expect(std::ldexp(1.0, exponent));
        if (dimension < 5) {
          expect(std::ldexp(1.9375, exponent));
        }
      }
      for (const double x :
           {0.0, -0.0, -1.0, kInfinity, -kInfinity, std::nan(""), std::numeric_limits<double>::max()}) {
        expect(x);
      }
    }
  }
}

TEST(ParameterExtremes, LargeVertexLimitsAreNoLargeReservations) {
  for (const double size : {1e-3, 1e-6, 1e-100, 1e-300}) {
    for (const uint64_t most : {uint64_t{0}, uint64_t{1}, uint64_t{1000}, ~uint64_t{0}}) {
      const MeshParameters parameters{
          .dimension = 2, .max_circumradius = size, .domain_low = {0, 0}, .domain_high = {1, 1}, .max_vertices = most};
      RunContext context;
      const absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters, {}, context);
      if (mesher.ok()) {
        const absl::StatusOr<MeshEstimate> estimate = (*mesher)->Estimate(parameters, context);
        ASSERT_TRUE(estimate.ok());
        EXPECT_GE(estimate->vertices, std::min(0.3 / size / size, kMostCounted)) << "never 0 for what does not fit";
      }
    }
  }
}

TEST(ParameterExtremes, LongestSideThatOverflowsIsNamed) {
  RunContext context;
  const absl::Status status = MeshPoints({.dimension = 2}, std::vector{-1.7e308, 0.0, 1.7e308, 1.0}, context).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message().find("nan"), absl::string_view::npos) << status;
}

TEST(SaturatedCount, IsDefinedForEveryDouble) {
  EXPECT_EQ(SaturatedCount(0), 0u);
  EXPECT_EQ(SaturatedCount(-1e300), 0u);
  EXPECT_EQ(SaturatedCount(std::nan("")), 0u);
  EXPECT_EQ(SaturatedCount(41.9), 41u);
  EXPECT_EQ(SaturatedCount(0x1p53), uint64_t{1} << 53);
  EXPECT_EQ(SaturatedCount(1e300), uint64_t{1} << 53);
  EXPECT_EQ(SaturatedCount(kInfinity), uint64_t{1} << 53);
}

}  // namespace
}  // namespace wellspace::core
