// The form of parameters against the messages of the API, and the parameters that JSON from a page makes.
#include "client/console/parameter_form.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

namespace wellspace::console {
namespace {

using ::testing::HasSubstr;

TEST(ParameterFormTest, HasTheFieldsOfTheApiWithTheirComments) {
  std::map<std::string, client::Json> fields;
  for (const client::Json& field : ParameterForm()) {
    fields[field["name"]] = field;
    EXPECT_GT(field["help"].get<std::string>().size(), 10u) << field;
  }
  EXPECT_EQ(fields.at("rho")["kind"], "number");
  EXPECT_EQ(fields.at("max_vertices")["kind"], "integer");
  EXPECT_EQ(fields.at("keep_vertices")["kind"], "boolean");
  EXPECT_EQ(fields.at("criterion")["choices"],
            client::Json::parse(R"(["CRITERION_RADIUS_EDGE", "CRITERION_WELL_SPACED"])"));
  EXPECT_THAT(fields.at("max_circumradius")["help"].get<std::string>(), HasSubstr("circumradius"));
  EXPECT_EQ(fields.at("surface.tolerance")["kind"], "number");
  // Of the file, or of more than one number.
  for (const char* name : {"dimension", "domain", "size_boxes", "surface", "low"}) {
    EXPECT_FALSE(fields.contains(name)) << name;
  }
}

TEST(ParametersOfTest, NamedFieldsReplaceThoseBefore) {
  client::MeshOptions before;
  before.dimension = 2;
  before.rho = 1.5;
  before.pump_weights = true;
  before.max_circumradius = 0.25;
  const absl::StatusOr<client::MeshOptions> same = ParametersOf("", before);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->rho, 1.5);
  const absl::StatusOr<client::MeshOptions> changed = ParametersOf(
      R"({"rho": 1.75, "pump_weights": false, "max_circumradius": null, "criterion": "CRITERION_WELL_SPACED"})",
      before);
  ASSERT_TRUE(changed.ok()) << changed.status();
  EXPECT_EQ(changed->rho, 1.75);
  EXPECT_FALSE(changed->pump_weights);
  EXPECT_EQ(changed->max_circumradius, std::nullopt);
  EXPECT_EQ(changed->criterion, client::Criterion::kWellSpaced);
  EXPECT_EQ(changed->dimension, 2);
}

TEST(ParametersOfTest, NamedFieldsOfTheSurfaceReplaceThoseBefore) {
  client::MeshOptions before;
  before.surface_parameters = {.tolerance = 0.5, .edge_length = 2};
  const absl::StatusOr<client::MeshOptions> changed =
      ParametersOf(R"({"surface": {"tolerance": null, "min_size": 0.25}})", before);
  ASSERT_TRUE(changed.ok()) << changed.status();
  EXPECT_EQ(changed->surface_parameters, (client::SurfaceParameters{.edge_length = 2, .min_size = 0.25}));
}

TEST(ParametersOfTest, WhatIsNoParameterIsRefused) {
  for (const char* text : {"{", "[1]", "1", R"({"no_such": 1})", R"({"rho": "much"})", R"({"threads": 1.5})",
                           R"({"criterion": "WORST"})", R"({"rho": {}})", "{\"rho\": 1}\x80"}) {
    const absl::StatusOr<client::MeshOptions> parameters = ParametersOf(text, client::MeshOptions());
    ASSERT_EQ(parameters.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(parameters.status().message()), HasSubstr("parameters: ")) << text;
  }
}

}  // namespace
}  // namespace wellspace::console
