// Demands that no mesh of max_vertices can meet are refused at once; those that one can meet are not.
#include "core/meshers/feasibility.h"

#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/estimate/domain_shape.h"
#include "core/input/domain_cloud.h"
#include "core/meshers/mesher.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/core/domain_input.h"

namespace wellspace::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

MeshParameters Cube(int dimension, double size) {
  return {.dimension = dimension,
          .max_circumradius = size,
          .min_dihedral = 0,
          .domain_low = std::vector<double>(dimension, 0.0),
          .domain_high = std::vector<double>(dimension, 1.0)};
}

absl::Status Meshed(const MeshParameters& parameters, uint64_t* vertices = nullptr) {
  RunContext context;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, {}, context);
  if (mesh.ok() && vertices != nullptr) {
    *vertices = mesh->vertex_count();
  }
  return mesh.status();
}

// The answer before any refinement.
absl::Status Feasible(const MeshParameters& parameters) {
  // The tree, whose leaves max_vertices limit, too, is another matter.
  MeshParameters of_tree = parameters;
  of_tree.max_vertices = 0;
  RunContext context;
  const absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(of_tree, {}, context);
  return mesher.ok() ? (*mesher)->CheckFeasible(parameters) : mesher.status();
}

bool IsTooFine(const absl::Status& status) {
  return status.code() == absl::StatusCode::kResourceExhausted &&
         status.GetPayload(absl::string_view(kDemandsTooFine.data(), kDemandsTooFine.size())).has_value();
}

double NumberAfter(const std::string& text, const std::string& words) {
  const size_t at = text.find(words);
  return at == std::string::npos ? 0 : std::stod(text.substr(at + words.size()));
}

class FeasibilityTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Dimensions, FeasibilityTest, ::testing::Range(2, 7));

// Of whole meshes, which take too long from 5-D on.
class FeasibilityOfMeshesTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Dimensions, FeasibilityOfMeshesTest, ::testing::Range(2, 5));

TEST_P(FeasibilityTest, SizesFarBelowTheBoxAreRefusedWithWhatFits) {
  const MeshParameters parameters = Cube(GetParam(), std::pow(1e-12, 1.0 / GetParam()) / 10);
  RunContext context;
  const absl::Status status = MeshPoints(parameters, {}, context).status();
  ASSERT_TRUE(IsTooFine(status)) << status;
  const std::string text(status.message());
  EXPECT_THAT(text, AllOf(HasSubstr("max_circumradius: "), HasSubstr("max_vertices = 50000000"),
                          HasSubstr("the smallest size that fits is about ")));
  EXPECT_GT(NumberAfter(text, "takes about "), 5e7);
  EXPECT_EQ(context.Snapshot().vertices, uint64_t{1} << GetParam()) << "before any work";
}

// Guarantee (1): a mesh of n vertices was possible with n.
TEST_P(FeasibilityOfMeshesTest, WhatWasMeshedIsNotRefused) {
  const int dimension = GetParam();
  const std::vector<double> sizes = dimension == 2   ? std::vector{0.5, 0.1, 0.03, 0.01}
                                    : dimension == 3 ? std::vector{0.6, 0.3, 0.1}
                                                     : std::vector{0.9, 0.6};
  for (const double size : sizes) {
    for (const double thickness : {1.0, 0.2}) {
      for (const bool with_box : {false, true}) {
        MeshParameters parameters = Cube(dimension, size);
        parameters.domain_high.back() = thickness;
        if (with_box) {
          parameters.size_boxes = {
              {std::vector<double>(dimension, -3.0), std::vector<double>(dimension, 0.3), size / 2},
              {std::vector<double>(dimension, 0.1), std::vector<double>(dimension, 0.2), size / 3}};
        }
        uint64_t vertices = 0;
        ASSERT_TRUE(Meshed(parameters, &vertices).ok());
        parameters.max_vertices = vertices;
        EXPECT_TRUE(Feasible(parameters).ok()) << Feasible(parameters) << " but took " << vertices;
      }
    }
  }
}

// As tight as the header of least_vertices.h says: within a factor of the vertices of meshes.
TEST(Feasibility, BoundsAreNearWhatMeshesTake) {
  for (const auto& [dimension, size, factor] : {std::tuple{2, 0.01, 2.5}, std::tuple{3, 0.08, 4.0}}) {
    MeshParameters parameters = Cube(dimension, size);
    uint64_t vertices = 0;
    ASSERT_TRUE(Meshed(parameters, &vertices).ok());
    parameters.max_vertices = static_cast<uint64_t>(static_cast<double>(vertices) / factor);
    EXPECT_TRUE(IsTooFine(Feasible(parameters)));
  }
}

TEST(Feasibility, WhatIsSaidToFitFits) {
  for (const int dimension : {2, 3}) {
    for (const uint64_t most : {200, 2'000, 20'000}) {
      for (const int boxes : {0, 1}) {
        MeshParameters parameters = Cube(dimension, boxes == 0 ? 1e-5 : 0);
        parameters.max_vertices = most;
        if (boxes == 1) {
          parameters.size_boxes = {{std::vector<double>(dimension, 0.2), std::vector<double>(dimension, 0.5), 1e-5}};
        }
        const absl::Status status = Meshed(parameters);
        ASSERT_TRUE(IsTooFine(status)) << status;
        const double size = NumberAfter(std::string(status.message()), "fits is about ");
        (boxes == 0 ? parameters.max_circumradius : parameters.size_boxes[0].max_circumradius) = size;
        uint64_t vertices = 0;
        EXPECT_TRUE(Meshed(parameters, &vertices).ok()) << dimension << "-D, " << most << ": " << size;
        EXPECT_GE(vertices, most / 8) << dimension << "-D: " << size << " is not the smallest of " << most;
      }
    }
  }
}

TEST(Feasibility, ThinDomainsAreRefusedWithTheThicknessThatFits) {
  for (const int dimension : {2, 3}) {
    for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
      MeshParameters parameters = Cube(dimension, 0);
      parameters.criterion = criterion;
      parameters.domain_high.back() = dimension == 2 ? 1e-9 : 1e-6;
      const absl::Status status = Meshed(parameters);
      ASSERT_TRUE(IsTooFine(status)) << status;
      EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("domain: "), HasSubstr("thick along axis"),
                                                       HasSubstr("give a larger domain or margin")));
      parameters.max_vertices = 20'000;
      const double side = NumberAfter(std::string(Meshed(parameters).message()), "fits is about ");
      parameters.domain_high.back() = side;
      EXPECT_TRUE(Meshed(parameters).ok() || criterion == Criterion::kWellSpaced) << Meshed(parameters);
    }
  }
}

TEST(Feasibility, ThinDomainsThatCanBeMeshedAre) {
  for (const double thickness : {0.3, 0.1, 0.03}) {
    for (const double rho : {1.2, 2.0, 10.0}) {
      MeshParameters parameters = Cube(3, 0);
      parameters.rho = rho;
      parameters.domain_high.back() = thickness;
      uint64_t vertices = 0;
      ASSERT_TRUE(Meshed(parameters, &vertices).ok());
      parameters.max_vertices = vertices;
      EXPECT_TRUE(Feasible(parameters).ok()) << Feasible(parameters);
    }
  }
}

TEST(Feasibility, SizesBelowWhatDoublesServeAreBlamed) {
  MeshParameters parameters = Cube(2, 0);
  parameters.size_boxes = {{{2, 2}, {3, 3}, 1e-200}, {{0.5, 0.5}, {0.5, 0.5}, 1e-200}};
  const absl::Status status = Meshed(parameters);
  EXPECT_TRUE(IsTooFine(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("size_boxes[1].max_circumradius: 1e-200 is too fine"));
}

TEST(Feasibility, WithoutADomainPointsSayHowLargeItIs) {
  const MeshParameters parameters{.dimension = 3, .max_circumradius = 1e-5};
  RunContext context;
  EXPECT_TRUE(IsTooFine(MeshPoints(parameters, std::vector<double>{0, 0, 0, 1, 1, 1}, context).status()));
  EXPECT_TRUE(MeshPoints(parameters, std::vector<double>{0, 0, 0, 1e-4, 1e-4, 1e-4}, context).ok());
}

// ---- Domains in the plane

using test::DomainInput;

// An L of three unit squares, with a square hole in one of them.
DomainInput Angle() {
  DomainInput input = DomainInput().Ring({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});
  input.Ring({{0.25, 0.25}, {0.75, 0.25}, {0.75, 0.75}, {0.25, 0.75}});
  input.seeds.push_back({.at = {0.5, 0.5}, .is_hole = true});
  return input;
}
constexpr double kAngleArea = 3 - 0.25;

absl::Status Feasible(const DomainInput& input) {
  MeshParameters of_tree = input.parameters;
  of_tree.max_vertices = 0;
  DomainInput plain = input;
  plain.parameters = of_tree;
  return plain.Create()->CheckFeasible(input.parameters);
}

std::shared_ptr<const SizeSamples> OneSize(double x, double y, double size) {
  auto samples = std::make_shared<SizeSamples>();
  samples->points = {x, y};
  samples->sizes = {size};
  return samples;
}

TEST(DomainFeasibility, HopelessSizesOfEveryKindAreRefusedBeforeAnyWorkWithWhatFits) {
  struct Demand {
    const char* name;
    std::string_view unit;
    void (*set)(DomainInput&, double size);
  };
  const std::vector<Demand> demands = {
      {"max_circumradius: ", "size", [](DomainInput& input, double size) { input.parameters.max_circumradius = size; }},
      {"edge_length: ", "size", [](DomainInput& input, double size) { input.parameters.edge_length = size; }},
      {"size_boxes[0].max_circumradius: ", "size",
       [](DomainInput& input, double size) {
         input.parameters.size_boxes = {{{0.9, 0.1}, {1.9, 0.9}, size}};
       }},
      {"size_samples.sizes[0]: ", "size",
       [](DomainInput& input, double size) {
         input.parameters.gradation = 0.002;  // at the default it would ask for little
         input.parameters.size_samples = OneSize(1.5, 0.5, size);
       }},
      {"seeds[1].max_area: ", "area", [](DomainInput& input, double area) {
         input.seeds.resize(1);
         input.seeds.push_back({.at = {1.5, 0.5}, .region = 1, .max_area = area});
       }}};
  for (const Demand& demand : demands) {
    for (const uint64_t most : {uint64_t{2'000}, uint64_t{20'000}}) {
      DomainInput input = Angle();
      input.parameters.max_vertices = most;
      demand.set(input, 1e-9);
      RunContext context;
      const absl::Status status = MeshPoints(input.parameters, {input.points, input.features()}, context).status();
      const bool is_sample = std::string_view(demand.name).starts_with("size_samples");
      ASSERT_TRUE(IsTooFine(status)) << demand.name << status;
      const std::string text(status.message());
      EXPECT_THAT(text, AllOf(HasSubstr(demand.name), HasSubstr(absl::StrCat("max_vertices = ", most)),
                              ::testing::Not(HasSubstr("rho"))));
      EXPECT_GT(NumberAfter(text, "takes about "), static_cast<double>(most));
      EXPECT_EQ(context.Snapshot().vertices, 10u) << "before any work";
      demand.set(input, NumberAfter(text, "fits is about "));
      const absl::StatusOr<Mesh> mesh = input.Make();
      ASSERT_TRUE(mesh.ok()) << demand.name << mesh.status() << text;
      EXPECT_GE(mesh->vertex_count(), most / (is_sample ? 40 : 10)) << text << " is not the smallest";
    }
  }
}

TEST(DomainFeasibility, WhatWasMeshedIsNotRefused) {
  for (const double size : {0.5, 0.1, 0.03}) {
    for (int kind = 0; kind < 5; ++kind) {
      DomainInput input = kind == 4 ? DomainInput().Ring({{0, 0}, {1, 0}, {1, 1e-3}, {0, 1e-3}}) : Angle();
      input.parameters.max_circumradius = kind == 0 || kind == 4 ? size : 0;
      if (kind == 1) {
        input.parameters.size_boxes = {{{-3, -3}, {0.5, 5}, size / 2}, {{0.2, 0.2}, {1.2, 0.8}, size / 3}};
      } else if (kind == 2) {
        input.parameters.size_samples = OneSize(1.5, 0.5, size / 10);
      } else if (kind == 3) {
        input.seeds.push_back({.at = {1.5, 0.5}, .region = 1, .max_area = size * size});
      }
      const absl::StatusOr<Mesh> mesh = input.Make();
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      input.parameters.max_vertices = mesh->vertex_count();
      EXPECT_TRUE(Feasible(input).ok()) << kind << ": " << Feasible(input) << " but took " << mesh->vertex_count();
    }
  }
}

TEST(DomainFeasibility, BoundsAreNearWhatMeshesTake) {
  DomainInput input = Angle();
  input.parameters.max_circumradius = 0.02;
  const absl::StatusOr<Mesh> mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  input.parameters.max_vertices = static_cast<uint64_t>(mesh->vertex_count() / 2.5);
  EXPECT_TRUE(IsTooFine(Feasible(input)));
}

// A strip takes as many vertices as its sides are long, however small its area is.
TEST(DomainFeasibility, LongSidesCount) {
  DomainInput input = DomainInput().Ring({{0, 0}, {1, 0}, {1, 1e-6}, {0, 1e-6}});
  input.parameters.rho = 1e6;
  input.parameters.max_circumradius = 1e-6;
  input.parameters.max_vertices = 100'000;
  EXPECT_TRUE(IsTooFine(Feasible(input))) << Feasible(input);
}

TEST(DomainFeasibility, SizesInHolesAreNoDemands) {
  DomainInput input = Angle();
  input.parameters.size_boxes = {{{0.3, 0.3}, {0.7, 0.7}, 1e-3}};
  input.parameters.max_vertices = 5'000;
  EXPECT_TRUE(Feasible(input).ok()) << Feasible(input);
  input.parameters.size_boxes = {{{0.4, 0.4}, {0.6, 0.6}, 1e-200}};
  EXPECT_TRUE(Feasible(input).ok()) << Feasible(input);
}

TEST(DomainFeasibility, SizesBelowWhatDoublesServeAreBlamed) {
  DomainInput input = Angle();
  input.parameters.size_boxes = {{{0.4, 0.4}, {0.6, 0.6}, 1e-200}, {{1.5, 0.5}, {1.5, 0.5}, 1e-200}};
  EXPECT_TRUE(IsTooFine(Feasible(input)));
  EXPECT_THAT(std::string(Feasible(input).message()), HasSubstr("size_boxes[1].max_circumradius: 1e-200 is too fine"));
  input.parameters.size_boxes.clear();
  input.parameters.size_samples = OneSize(1.5, 0.5, 1e-200);
  EXPECT_THAT(std::string(Feasible(input).message()), HasSubstr("size_samples.sizes[0]: 1e-200 is too fine"));
}

TEST(DomainFeasibility, WhatLiesInABoxIsMeasured) {
  const DomainInput input = Angle();
  RunContext context;
  const absl::StatusOr<DomainCloud> made =
      MakeDomainCloud(input.points, input.features(), {{0, 0}, {1, 1}}, 0, 1'000'000, 1, context);
  ASSERT_TRUE(made.ok()) << made.status();
  const DomainShape shape(*made->planar);
  const double unit = made->frame.scale * made->frame.scale;
  EXPECT_NEAR(shape.area(), kAngleArea * unit, 1e-9 * unit);
  const auto area_in = [&](const Point<2>& low, const Point<2>& high) {
    return shape.AreaIn({made->frame.Scaled(low), made->frame.Scaled(high)}) / unit;
  };
  EXPECT_NEAR(area_in({-9, -9}, {9, 9}), kAngleArea, 1e-9);
  EXPECT_NEAR(area_in({0, 0}, {1, 1}), 0.75, 1e-9);
  EXPECT_NEAR(area_in({0.5, 0.5}, {1.5, 1.5}), 0.25 * 3 - 0.0625, 1e-9);
  EXPECT_NEAR(area_in({1.25, -1}, {1.5, 3}), 0.25, 1e-9);
  EXPECT_EQ(area_in({0.3, 0.3}, {0.7, 0.7}), 0);
  EXPECT_EQ(area_in({1.2, 1.2}, {1.7, 1.7}), 0);
}

}  // namespace
}  // namespace wellspace::core
