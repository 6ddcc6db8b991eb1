// Parameters that a domain in the plane refuses, by name.
#include "core/input/domain_parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace wellspace::core {
namespace {

using ::testing::StartsWith;

MeshParameters InThePlane() { return {.dimension = 2}; }

TEST(ValidateDomainParameters, NamesWhatADomainDoesNotHave) {
  Features holes;
  holes.faces = FaceRule::kHoles;
  EXPECT_TRUE(ValidateDomainParameters(InThePlane(), holes).ok());
  MeshParameters parameters = InThePlane();
  parameters.dimension = 3;
  EXPECT_THAT(std::string(ValidateDomainParameters(parameters, holes).message()), StartsWith("dimension:"));
  parameters = InThePlane();
  parameters.criterion = Criterion::kWellSpaced;
  EXPECT_THAT(std::string(ValidateDomainParameters(parameters, holes).message()), StartsWith("criterion:"));
  parameters = InThePlane();
  Features snapped = holes;
  snapped.crossings = CrossingRule::kSnap;
  for (const double distance : {-1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    snapped.snap_distance = distance;
    EXPECT_THAT(std::string(ValidateDomainParameters(parameters, snapped).message()), StartsWith("snap_distance:"));
  }
  snapped.snap_distance = 0.5;
  EXPECT_TRUE(ValidateDomainParameters(parameters, snapped).ok());
  snapped.crossings = CrossingRule::kRefuse;
  EXPECT_THAT(std::string(ValidateDomainParameters(parameters, snapped).message()), StartsWith("snap_distance:"));
  parameters.rho = 0.5;
  EXPECT_THAT(std::string(ValidateDomainParameters(parameters, holes).message()), StartsWith("rho:"));
}

TEST(ValidateDomainParameters, ABoxIsOfTheRuleBoxAlone) {
  MeshParameters parameters = InThePlane();
  parameters.domain_low = {0, 0};
  parameters.domain_high = {1, 1};
  Features features;
  EXPECT_TRUE(ValidateDomainParameters(parameters, features).ok());
  for (const FaceRule rule : {FaceRule::kHoles, FaceRule::kEvenOdd}) {
    features.faces = rule;
    EXPECT_THAT(std::string(ValidateDomainParameters(parameters, features).message()), StartsWith("domain:"));
  }
}

}  // namespace
}  // namespace wellspace::core
