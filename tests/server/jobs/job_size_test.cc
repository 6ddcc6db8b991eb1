// The sizes of jobs: small or not.
#include "server/jobs/job_size.h"

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "gtest/gtest.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

core::MeshParameters UnitBox(int dimension) {
  core::MeshParameters parameters{.dimension = dimension};
  parameters.domain_low.assign(dimension, 0);
  parameters.domain_high.assign(dimension, 1);
  return parameters;
}

TEST(IsSmallMesh, ByTheNumberOfPoints) {
  for (const int dimension : {2, 3}) {
    EXPECT_TRUE(IsSmallMesh(UnitBox(dimension), UniformPoints(0, dimension, 1)));
    EXPECT_TRUE(IsSmallMesh(UnitBox(dimension), UniformPoints(300, dimension, 1)));
    EXPECT_FALSE(IsSmallMesh(UnitBox(dimension), UniformPoints(60'000, dimension, 1)));
  }
  EXPECT_TRUE(IsSmallMesh(UnitBox(4), UniformPoints(100, 4, 1)));
  EXPECT_FALSE(IsSmallMesh(UnitBox(4), UniformPoints(5'000, 4, 1)));
  EXPECT_FALSE(IsSmallMesh(UnitBox(6), UniformPoints(300, 6, 1)));
}

TEST(IsSmallMesh, BySizesAtPointsAndLengthsOfEdges) {
  core::MeshParameters parameters = UnitBox(3);
  parameters.edge_length = 0.3;
  EXPECT_TRUE(IsSmallMesh(parameters, {}));
  parameters.edge_length = 0.01;
  EXPECT_FALSE(IsSmallMesh(parameters, {}));
  parameters.edge_length = 0;
  const auto with = [&parameters](size_t count, double size) {
    parameters.size_samples =
        std::make_shared<core::SizeSamples>(core::SizeSamples{UniformPoints(count, 3, 1), std::vector(count, size)});
    return IsSmallMesh(parameters, {});
  };
  EXPECT_TRUE(with(100, 0.3));
  EXPECT_FALSE(with(100, 0.01));
  EXPECT_FALSE(with(100, 1e-300));
  EXPECT_FALSE(with(60'000, 10));
}

TEST(IsSmallMesh, ByTheSizesInTheBox) {
  const std::vector<double> points = UniformPoints(300, 3, 1);
  for (const bool has_domain : {true, false}) {
    core::MeshParameters parameters = has_domain ? UnitBox(3) : core::MeshParameters();
    parameters.max_circumradius = 0.2;
    EXPECT_TRUE(IsSmallMesh(parameters, points));
    for (const double size : {0.02, 1e-9, 1e-103, 1e-300, 5e-324}) {
      parameters.max_circumradius = size;
      EXPECT_FALSE(IsSmallMesh(parameters, points)) << size;
    }
  }
  core::MeshParameters boxed = UnitBox(3);
  boxed.size_boxes = {{{0, 0, 0}, {0.1, 0.1, 0.1}, 0.1}};
  EXPECT_TRUE(IsSmallMesh(boxed, points));
  boxed.size_boxes = {{{0, 0, 0}, {0.1, 0.1, 0.1}, 0.001}};
  EXPECT_FALSE(IsSmallMesh(boxed, points));
}

TEST(IsSmallMesh, OfWhatDoesNotFitIntoDoublesIsFalse) {
  core::MeshParameters parameters = UnitBox(2);
  parameters.domain_high.assign(2, 1e300);
  parameters.domain_low.assign(2, -1e300);
  parameters.max_circumradius = 1e-300;
  EXPECT_FALSE(IsSmallMesh(parameters, {}));
}

TEST(IsSmallRefinement, CountsTheMeshThatIsThereAndTheStepsToItsStructure) {
  const std::vector<double> points = UniformPoints(300, 3, 1);
  EXPECT_TRUE(IsSmallRefinement(UnitBox(3), points, 1'000, 0));
  EXPECT_FALSE(IsSmallRefinement(UnitBox(3), points, 1'000, 100));
  EXPECT_FALSE(IsSmallRefinement(UnitBox(3), points, 1'000'000, 0));
}

TEST(IsSmallEstimate, ByTheNumberOfPoints) {
  EXPECT_TRUE(IsSmallEstimate(3, 300));
  EXPECT_FALSE(IsSmallEstimate(3, 1'000'000));
}

TEST(IsSmallAddition, ByWhatIsAddedAndBuiltAgain) {
  EXPECT_TRUE(IsSmallAddition(300, 1'000'000, 0));
  EXPECT_FALSE(IsSmallAddition(300, 1'000'000, 1));
  EXPECT_FALSE(IsSmallAddition(100'000, 1'000, 0));
}

TEST(IsSmallPart, ByTheMeshAndWhetherItIsCut) {
  EXPECT_TRUE(IsSmallPart(/*is_cut=*/false, 100'000));
  EXPECT_FALSE(IsSmallPart(/*is_cut=*/false, 1'000'000));
  EXPECT_TRUE(IsSmallPart(/*is_cut=*/true, 1'000'000));
  EXPECT_FALSE(IsSmallPart(/*is_cut=*/true, 100'000'000));
}

}  // namespace
}  // namespace wellspace::server
