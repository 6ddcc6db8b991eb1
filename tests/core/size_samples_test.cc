// Sizes at points, and lengths of edges: from parameters to meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/canonical.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

using test::Canonical;
using test::InUnitBox;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A smooth size, about half of which varies over the unit box.
double SmoothSize(std::span<const double> x, double mean) {
  double sum = 0;
  for (const double coordinate : x) {
    sum += std::sin(2 * std::numbers::pi * coordinate);
  }
  return mean * (1 + 0.5 * sum / static_cast<double>(x.size()));
}

std::shared_ptr<SizeSamples> SmoothSamples(int dimension, size_t count, double mean, uint64_t seed = 11) {
  test::SplitMix64 random(seed);
  auto samples = std::make_shared<SizeSamples>();
  for (size_t i = 0; i < count; ++i) {
    for (int k = 0; k < dimension; ++k) {
      samples->points.push_back(random.Unit());
    }
    samples->sizes.push_back(SmoothSize(std::span(samples->points).last(dimension), mean));
  }
  return samples;
}

std::shared_ptr<SizeSamples> OneSample(std::vector<double> point, double size) {
  return std::make_shared<SizeSamples>(SizeSamples{std::move(point), {size}});
}

absl::StatusOr<Mesh> MeshOf(const MeshParameters& parameters, const std::vector<double>& points = {}) {
  RunContext context;
  return MeshPoints(parameters, points, context);
}

absl::Status Valid(const Mesh& mesh, const MeshParameters& parameters) {
  return ValidateMesh({mesh.dimension, mesh.points, mesh.simplices}, {.rho = DefaultRho(mesh.dimension),
                                                                      .max_circumradius = parameters.max_circumradius,
                                                                      .size_boxes = parameters.size_boxes,
                                                                      .size_samples = parameters.size_samples.get(),
                                                                      .gradation = parameters.gradation});
}

double MeanEdge(const Mesh& mesh) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  const size_t corners = mesh.dimension + 1;
  for (size_t s = 0; s < mesh.simplices.size(); s += corners) {
    for (size_t i = s; i < s + corners; ++i) {
      for (size_t j = s; j < i; ++j) {
        edges.insert(std::minmax(mesh.simplices[i], mesh.simplices[j]));
      }
    }
  }
  double sum = 0;
  for (const auto& [a, b] : edges) {
    double length_sq = 0;
    for (int k = 0; k < mesh.dimension; ++k) {
      const double by = mesh.points[size_t{a} * mesh.dimension + k] - mesh.points[size_t{b} * mesh.dimension + k];
      length_sq += by * by;
    }
    sum += std::sqrt(length_sq);
  }
  return sum / static_cast<double>(edges.size());
}

class SizeSamplesTest : public ::testing::TestWithParam<int> {
 protected:
  // Sizes that make some thousand vertices.
  double Mean() const { return d_ == 2 ? 0.03 : d_ == 3 ? 0.12 : 0.5; }

  const int d_ = GetParam();
  MeshParameters parameters_ = InUnitBox(d_);
};

INSTANTIATE_TEST_SUITE_P(Dimensions, SizeSamplesTest, ::testing::Values(2, 3, 4));

// For tests that would take too long in 4-D, or are not calibrated there.
class SizeSamplesUpTo3Test : public SizeSamplesTest {};

INSTANTIATE_TEST_SUITE_P(Dimensions, SizeSamplesUpTo3Test, ::testing::Values(2, 3));

TEST_P(SizeSamplesTest, EverySimplexKeepsThem) {
  for (const double gradation : {0.0, 1.0, 0.1}) {
    parameters_.gradation = gradation;
    for (const size_t count : {size_t{1}, size_t{7}, size_t{500}}) {
      SCOPED_TRACE(count);
      parameters_.size_samples = SmoothSamples(d_, count, Mean());
      const absl::StatusOr<Mesh> mesh = MeshOf(parameters_, std::vector<double>(d_, 0.3));
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_EQ(Valid(*mesh, parameters_), absl::OkStatus());
    }
  }
  // They ask for something: with half the sizes the mesh is not valid.
  const absl::StatusOr<Mesh> mesh = MeshOf(parameters_);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  parameters_.size_samples = SmoothSamples(d_, 500, 0.5 * Mean());
  EXPECT_THAT(std::string(Valid(*mesh, parameters_).message()), HasSubstr("of the size at point "));
}

TEST_P(SizeSamplesTest, TheMeshDependsNeitherOnTheirOrderNorOnThreads) {
  const std::shared_ptr<SizeSamples> samples = SmoothSamples(d_, 500, Mean());
  parameters_.size_samples = samples;
  const absl::StatusOr<Mesh> expected = MeshOf(parameters_);
  ASSERT_TRUE(expected.ok()) << expected.status();

  auto reversed = std::make_shared<SizeSamples>();
  for (size_t i = samples->sizes.size(); i > 0; --i) {
    const auto begin = samples->points.begin() + static_cast<std::ptrdiff_t>((i - 1) * d_);
    reversed->points.insert(reversed->points.end(), begin, begin + d_);
    reversed->sizes.push_back(samples->sizes[i - 1]);
  }
  for (const int threads : {1, 2, 4}) {
    parameters_.threads = threads;
    parameters_.size_samples = reversed;
    const absl::StatusOr<Mesh> mesh = MeshOf(parameters_);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->points, expected->points);
    EXPECT_EQ(mesh->simplices, expected->simplices);
  }
}

// Circumradii beside each other are bounded by sizes that differ by no more than the gradation allows. With a size that
// jumps by a factor of 20 between two samples, the mesh grades: neighbours differ by much less.
TEST_P(SizeSamplesUpTo3Test, NeighbouringSizesObeyTheGradation) {
  const double fine = d_ == 2 ? 0.005 : 0.05;
  auto samples = std::make_shared<SizeSamples>();
  samples->points.assign(d_, 0.5);
  samples->points.resize(2 * d_, 0.52);
  samples->sizes = {fine, 20 * fine};
  parameters_.size_samples = samples;
  parameters_.gradation = 0.2;
  const absl::StatusOr<Mesh> mesh = MeshOf(parameters_);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(Valid(*mesh, parameters_), absl::OkStatus());
  // By vertex: the longest of its edges, as a bound on the size there.
  std::vector<double> longest(mesh->vertex_count(), 0);
  const auto distance_from = [&](uint32_t v, double place) {
    double sum = 0;
    for (int k = 0; k < d_; ++k) {
      sum += (mesh->points[size_t{v} * d_ + k] - place) * (mesh->points[size_t{v} * d_ + k] - place);
    }
    return std::sqrt(sum);
  };
  for (size_t s = 0; s < mesh->simplices.size(); s += d_ + 1) {
    for (int i = 0; i < (d_ + 1) * (d_ + 1); ++i) {
      const uint32_t a = mesh->simplices[s + i / (d_ + 1)];
      const uint32_t b = mesh->simplices[s + i % (d_ + 1)];
      double length_sq = 0;
      for (int k = 0; k < d_; ++k) {
        const double by = mesh->points[size_t{a} * d_ + k] - mesh->points[size_t{b} * d_ + k];
        length_sq += by * by;
      }
      longest[a] = std::max(longest[a], std::sqrt(length_sq));
    }
  }
  for (uint32_t v = 0; v < longest.size(); ++v) {
    // An edge is at most 2 R, of a circumcentre no farther than R: R <= fine + G (|v - p| + R).
    const double most = (fine + 0.2 * distance_from(v, 0.5)) / (1 - 0.2);
    ASSERT_LE(longest[v], 2 * most * (1 + 1e-9)) << "vertex " << v;
  }
}

TEST_P(SizeSamplesTest, ALargerSizeBesideASmallerOneAsksForNothing) {
  parameters_.gradation = 0.5;
  parameters_.size_samples = OneSample(std::vector<double>(d_, 0.5), Mean());
  const absl::StatusOr<Mesh> one = MeshOf(parameters_);
  ASSERT_TRUE(one.ok()) << one.status();
  auto two = std::make_shared<SizeSamples>(*parameters_.size_samples);
  two->points.resize(2 * d_, 0.6);
  two->sizes.push_back(Mean() + 0.5 * 0.11 * std::sqrt(d_));
  parameters_.size_samples = two;
  const absl::StatusOr<Mesh> both = MeshOf(parameters_);
  ASSERT_TRUE(both.ok()) << both.status();
  EXPECT_EQ(both->points, one->points);
}

TEST_P(SizeSamplesTest, ARefinedMeshTakesOthers) {
  RunContext context;
  parameters_.size_samples = OneSample(std::vector<double>(d_, 0.25), Mean());
  absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters_, {}, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  ASSERT_EQ((*mesher)->Refine(parameters_, context), absl::OkStatus());
  const uint64_t first = (*mesher)->vertex_count();

  // Refused demands change nothing.
  MeshParameters refused = parameters_;
  refused.size_samples = OneSample(std::vector<double>(d_, kNan), Mean());
  EXPECT_THAT(std::string((*mesher)->Refine(refused, context).message()), HasSubstr("size_samples.points[0]: "));
  EXPECT_TRUE((*mesher)->Extract(1, context).ok());

  parameters_.size_samples = SmoothSamples(d_, 500, Mean());
  ASSERT_EQ((*mesher)->Refine(parameters_, context), absl::OkStatus());
  EXPECT_GT((*mesher)->vertex_count(), first);
  const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(Valid(*mesh, parameters_), absl::OkStatus());
  const uint64_t held = (*mesher)->memory_bytes();

  // Without any, nothing more is asked for, and nothing is held of them.
  parameters_.size_samples = nullptr;
  ASSERT_EQ((*mesher)->Refine(parameters_, context), absl::OkStatus());
  EXPECT_EQ((*mesher)->vertex_count(), mesh->vertex_count());
  EXPECT_LT((*mesher)->memory_bytes(), held);
}

TEST_P(SizeSamplesUpTo3Test, EstimatesSeeThem) {
  parameters_.min_dihedral = 0;
  parameters_.size_samples = SmoothSamples(d_, 2000, 0.5 * Mean());
  RunContext context;
  const absl::StatusOr<MeshEstimate> estimate = EstimateMesh(parameters_, {}, context);
  const absl::StatusOr<Mesh> mesh = MeshOf(parameters_);
  ASSERT_TRUE(estimate.ok() && mesh.ok());
  const double factor = static_cast<double>(estimate->vertices) / static_cast<double>(mesh->vertex_count());
  EXPECT_GT(factor, 0.8) << estimate->vertices << " of " << mesh->vertex_count();
  EXPECT_LT(factor, 1.25);
}

TEST_P(SizeSamplesTest, WhatIsTooFineIsRefusedAtOnce) {
  parameters_.gradation = 0.01;
  parameters_.size_samples = SmoothSamples(d_, 1000, 1e-5);
  parameters_.max_vertices = d_ == 2 ? 100'000 : 1'000;
  const absl::Status status = MeshOf(parameters_).status();
  EXPECT_TRUE(status.GetPayload({kDemandsTooFine.data(), kDemandsTooFine.size()}).has_value()) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("size_samples.sizes["));
  EXPECT_THAT(std::string(status.message()), HasSubstr("the smallest size that fits is about "));

  parameters_.size_samples = OneSample(std::vector<double>(d_, 0.5), 1e-200);
  EXPECT_THAT(std::string(MeshOf(parameters_).status().message()),
              HasSubstr("size_samples.sizes[0]: 1e-200 is too fine for the arithmetic of doubles"));
}

TEST_P(SizeSamplesTest, BadOnesAreNamed) {
  const auto expect = [this](SizeSamples samples, const std::string& message) {
    parameters_.size_samples = std::make_shared<SizeSamples>(std::move(samples));
    const absl::Status status = MeshOf(parameters_).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << message;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
  };
  const std::vector<double> two(2 * d_, 0.5);
  expect({two, {1, 0}}, "size_samples.sizes[1]: 0 is not allowed; a number above 0 is");
  expect({two, {-1, 1}}, "size_samples.sizes[0]: -1 is not allowed");
  expect({two, {1, kNan}}, "size_samples.sizes[1]: nan is not allowed");
  expect({two, {kInfinity, 1}}, "size_samples.sizes[0]: inf is not allowed");
  expect({two, {1}}, "size_samples.points: ");
  std::vector<double> bad = two;
  bad[d_ + 1] = kNan;
  expect({bad, {1, 1}}, "size_samples.points[1]: coordinate 1 is nan; a finite number is needed");
  parameters_.size_samples = nullptr;
  for (const double gradation : {-1.0, 1.5, kNan}) {
    parameters_.gradation = gradation;
    EXPECT_THAT(std::string(ValidateParameters(parameters_).message()), HasSubstr("gradation: "));
  }
}

// Edges of meshes without points are as long as asked for.
TEST_P(SizeSamplesUpTo3Test, EdgesHaveTheLengthThatIsDesired) {
  parameters_.min_dihedral = 0;
  for (const double length : d_ == 2 ? std::vector{0.02, 0.01} : std::vector{0.08, 0.06}) {
    parameters_.edge_length = length;
    parameters_.size_samples = nullptr;
    const absl::StatusOr<Mesh> mesh = MeshOf(parameters_);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_NEAR(MeanEdge(*mesh) / length, 1, 0.03);

    // The same at points.
    parameters_.edge_length = 0;
    parameters_.gradation = 0.05;
    auto samples = SmoothSamples(d_, 2'000, length);
    samples->sizes.assign(samples->sizes.size(), length);
    samples->measure = SizeMeasure::kEdgeLength;
    parameters_.size_samples = samples;
    const absl::StatusOr<Mesh> sampled = MeshOf(parameters_);
    ASSERT_TRUE(sampled.ok()) << sampled.status();
    EXPECT_NEAR(MeanEdge(*sampled) / length, 1, 0.1);
    EXPECT_EQ(Valid(*sampled, parameters_), absl::OkStatus());
  }
}

TEST_P(SizeSamplesTest, OfALengthAndABoundTheSmallerHolds) {
  parameters_.max_circumradius = Mean();
  const absl::StatusOr<Mesh> bounded = MeshOf(parameters_);
  parameters_.edge_length = 10;
  const absl::StatusOr<Mesh> same = MeshOf(parameters_);
  parameters_.max_circumradius = 10;
  parameters_.edge_length = Mean() / CircumradiusOf(1, d_);
  const absl::StatusOr<Mesh> by_length = MeshOf(parameters_);
  ASSERT_TRUE(bounded.ok() && same.ok() && by_length.ok());
  EXPECT_EQ(same->points, bounded->points);
  EXPECT_NEAR(static_cast<double>(by_length->vertex_count()), static_cast<double>(bounded->vertex_count()),
              0.05 * static_cast<double>(bounded->vertex_count()));
  parameters_.edge_length = -1;
  EXPECT_THAT(std::string(ValidateParameters(parameters_).message()), HasSubstr("edge_length: -1 is not allowed"));
}

// A slower growth from boxes makes more vertices, and keeps its rule.
TEST_P(SizeSamplesTest, TheGradationHoldsForBoxesToo) {
  parameters_.size_boxes = {{std::vector<double>(d_, 0.4), std::vector<double>(d_, 0.5), Mean() / 2}};
  uint64_t before = 0;
  for (const double gradation : {0.0, 1.0, 0.3}) {
    parameters_.gradation = gradation;
    const absl::StatusOr<Mesh> mesh = MeshOf(parameters_);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(Valid(*mesh, parameters_), absl::OkStatus());
    EXPECT_TRUE(gradation == 1 ? mesh->vertex_count() == before : mesh->vertex_count() > before);
    before = mesh->vertex_count();
  }
}

TEST(SizeSamplesInDomains, AreKeptAndChecked) {
  Features features;
  features.faces = FaceRule::kHoles;
  const std::vector<uint32_t> ends = {0, 1, 1, 2, 2, 3, 3, 0};
  features.ends = ends;
  const std::vector<double> points = {0, 0, 1, 0, 1, 1, 0, 1};
  MeshParameters parameters{.dimension = 2};
  parameters.size_samples = SmoothSamples(2, 400, 0.03);
  RunContext context;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, {points, features}, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_GT(mesh->vertex_count(), 500u);
  EXPECT_EQ(ValidateSizing({2, mesh->points, mesh->simplices}, {.samples = parameters.size_samples.get()}),
            absl::OkStatus());
  const absl::StatusOr<MeshEstimate> estimate = EstimateMesh(parameters, {points, features}, context);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_NEAR(static_cast<double>(estimate->vertices), static_cast<double>(mesh->vertex_count()),
              0.25 * static_cast<double>(mesh->vertex_count()));

  // A size outside counts from where it is: beside the domain it asks for small triangles, far away for nothing.
  parameters.size_samples = nullptr;
  const absl::StatusOr<Mesh> plain = MeshPoints(parameters, {points, features}, context);
  parameters.size_samples = OneSample({1.25, 0.5}, 1e-4);
  const absl::StatusOr<Mesh> beside = MeshPoints(parameters, {points, features}, context);
  ASSERT_TRUE(plain.ok() && beside.ok()) << beside.status();
  EXPECT_GT(beside->vertex_count(), plain->vertex_count() + 20);
  EXPECT_EQ(ValidateSizing({2, beside->points, beside->simplices}, {.samples = parameters.size_samples.get()}),
            absl::OkStatus());
  for (const double far : {1e3, 1e30, 1e300}) {
    parameters.size_samples = OneSample({0.5, -far}, 1e-4);
    const absl::StatusOr<Mesh> mesh_of_far = MeshPoints(parameters, {points, features}, context);
    ASSERT_TRUE(mesh_of_far.ok()) << mesh_of_far.status();
    EXPECT_EQ(mesh_of_far->points, plain->points) << far;
  }
}

}  // namespace
}  // namespace wellspace::core
