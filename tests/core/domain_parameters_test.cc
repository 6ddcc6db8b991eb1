#include "core/domain_parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  parameters.merge_distance = 0.5;
  EXPECT_THAT(std::string(ValidateDomainParameters(parameters, holes).message()), StartsWith("merge_distance:"));
  parameters = InThePlane();
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
