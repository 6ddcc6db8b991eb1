// `wellspace check --surface` from the outside: meshes by hand against surfaces, and the report of each fault.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/validate/validate_solid.h"
#include "tests/client/cli/process.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temporary_folder.h"

namespace wellspace {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A mesh of tests/data/surfaces/twocubes.off, whose tags are those of its sides.
struct TwoCubes {
  TwoCubes() : mesh(test::GridMesh({0, 0.5, 1, 1.5, 2}, {0, 0.5, 1}, {0, 0.5, 1})) {
    for (size_t s = 0; s < mesh.simplices.size() / 4; ++s) {
      regions.push_back(MiddleOf(&mesh.simplices[4 * s], 4)[0] < 1 ? 1 : 2);
    }
    facets = *core::FacetsOfRegions({.dimension = 3, .points = mesh.points, .simplices = mesh.simplices}, regions,
                                    core::RunContext());
    for (size_t f = 0; f < facets.size() / 3; ++f) {
      const std::array<double, 3> at = MiddleOf(&facets[3 * f], 3);
      const int second = at[0] < 1 ? 0 : 1;
      tags.push_back(at[0] == 0   ? 1
                     : at[0] == 1 ? 2
                     : at[0] == 2 ? 3
                     : at[1] == 0 ? 4 + second
                     : at[1] == 1 ? 6 + second
                     : at[2] == 0 ? 8 + second
                                  : 10 + second);
    }
  }

  std::array<double, 3> MiddleOf(const uint32_t* vertices, size_t count) const {
    std::array<double, 3> middle{};
    for (size_t k = 0; k < count; ++k) {
      for (size_t axis = 0; axis < 3; ++axis) {
        middle[axis] += mesh.points[3 * size_t{vertices[k]} + axis];
      }
    }
    for (double& x : middle) {
      x /= static_cast<double>(count);
    }
    return middle;
  }

  // As a MEDIT file.
  std::string Text(bool has_facets = true) const {
    std::string text = absl::StrCat("MeshVersionFormatted 2\nDimension 3\nVertices\n", mesh.points.size() / 3, "\n");
    for (size_t i = 0; i < mesh.points.size(); i += 3) {
      absl::StrAppendFormat(&text, "%.17g %.17g %.17g 0\n", mesh.points[i], mesh.points[i + 1], mesh.points[i + 2]);
    }
    absl::StrAppend(&text, "Tetrahedra\n", regions.size(), "\n");
    for (size_t s = 0; s < regions.size(); ++s) {
      for (size_t k = 0; k < 4; ++k) {
        absl::StrAppend(&text, mesh.simplices[4 * s + k] + 1, " ");
      }
      absl::StrAppend(&text, regions[s], "\n");
    }
    if (has_facets) {
      absl::StrAppend(&text, "Triangles\n", tags.size(), "\n");
      for (size_t f = 0; f < tags.size(); ++f) {
        absl::StrAppend(&text, facets[3 * f] + 1, " ", facets[3 * f + 1] + 1, " ", facets[3 * f + 2] + 1, " ", tags[f],
                        "\n");
      }
    }
    return text + "End\n";
  }

  test::Tetrahedra mesh;
  std::vector<int32_t> regions;
  std::vector<uint32_t> facets;
  std::vector<int32_t> tags;
};

std::string ReadText(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class CheckSurfaceTest : public testing::Test {
 protected:
  static std::string Data(const std::string& name) {
    return absl::StrCat(std::getenv("WELLSPACE_DATA_DIR"), "/surfaces/", name);
  }

  RunResult Check(const std::string& mesh, const std::vector<std::string>& more = {},
                  const std::string& surface = Data("twocubes.off")) {
    std::vector<std::string> arguments = {"check", folder_.Write("two.mesh", mesh), "--surface", surface};
    if (surface == Data("twocubes.off")) {
      arguments.insert(arguments.end(), {"--solids", "holes"});
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunWellspace(arguments);
  }

  TemporaryFolder folder_;
};

TEST_F(CheckSurfaceTest, AMeshThatIsRightIsValid) {
  const RunResult result = Check(TwoCubes().Text(), {"--rho", "2"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("0.0000 % of the diagonal"), HasSubstr("around 2 solids"),
                                HasSubstr("curves                   20 of 20 kept"), HasSubstr("valid")));
}

TEST_F(CheckSurfaceTest, FiguresAreTold) {
  const RunResult result = Check(TwoCubes().Text(), {"--output", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["valid"], true);
  EXPECT_EQ(json["solid"]["pieces"], 2);
  ASSERT_EQ(json["solid"]["volumes"].size(), 2);
  for (const nlohmann::json& region : json["solid"]["volumes"]) {
    EXPECT_NEAR(region["volume"], 1, 1e-12) << region;
  }
  EXPECT_EQ(json["solid"]["areas"].size(), 11);
  EXPECT_EQ(json["surface"]["solids"], 2);
  EXPECT_LT(json["surface"]["deviation_of_facets"]["found"], 1e-12);
  EXPECT_LT(json["surface"]["deviation_of_surface"]["found"], 1e-12);
  EXPECT_EQ(json["surface"]["lost_curves"], 0);
  EXPECT_NEAR(json["surface"]["tolerance"], 0.002 * std::sqrt(6), 1e-12);
}

TEST_F(CheckSurfaceTest, EachFaultHasItsWords) {
  const std::vector<std::pair<std::string, std::function<void(TwoCubes&)>>> faults = {
      {"alone, and no facet", [](TwoCubes& m) { m.regions.pop_back(), m.mesh.simplices.resize(4 * m.regions.size()); }},
      {"between them is no facet", [](TwoCubes& m) { m.regions[3] = 3 - m.regions[3]; }},
      {"but the nearest triangle with it is", [](TwoCubes& m) { m.tags[0] = m.tags[0] == 3 ? 1 : 3; }},
      {"alone, and no facet", [](TwoCubes& m) { m.tags.pop_back(), m.facets.resize(3 * m.tags.size()); }},
      {"of the lower region on its outer side",
       [](TwoCubes& m) {
         for (size_t f = 0; f < m.tags.size(); ++f) {
           if (m.tags[f] == 2) {
             std::swap(m.facets[3 * f], m.facets[3 * f + 1]);
           }
         }
       }},
      // The corner (2, 1, 1), off by 1 %.
      {"away", [](TwoCubes& m) { m.mesh.points[m.mesh.points.size() - 3] -= 0.02; }},
  };
  for (const auto& [words, plant] : faults) {
    SCOPED_TRACE(words);
    TwoCubes cubes;
    plant(cubes);
    const RunResult result = Check(cubes.Text());
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("violation: "), HasSubstr(words)));
    EXPECT_THAT(result.out, ::testing::Not(HasSubstr("\nvalid")));
  }
}

TEST_F(CheckSurfaceTest, TheToleranceIsALengthOrAShare) {
  // The first side is a flat roof, without a crease: 0.03 high, 1.21 % of the diagonal.
  std::string roofed = ReadText(Data("twocubes.off"));
  for (const auto& [from, to] :
       {std::pair("12 22 0", "13 24 0"), std::pair("2 1 1\n", "2 1 1\n-0.03 0.5 0.5\n"),
        std::pair("3 0 1 3 1\n3 0 3 2 1\n", "3 0 1 12 1\n3 1 3 12 1\n3 3 2 12 1\n3 2 0 12 1\n")}) {
    const size_t at = roofed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    roofed.replace(at, std::string(from).size(), to);
  }
  const std::string surface = folder_.Write("roofed.off", roofed);
  const std::string mesh = TwoCubes().Text();
  const auto said = [&](const std::string& tolerance) {
    return Check(mesh, {"--solids", "holes", "--tolerance", tolerance}, surface).out;
  };
  EXPECT_THAT(said("0.2%"), HasSubstr("is 0.0299461 away from the surface at (0, 0.5, 0.5); at most 0.00494"));
  EXPECT_THAT(said("0.02997"), HasSubstr("is 0.03 away from all facets at (-0.03, 0.5, 0.5); at most 0.02997"));
  EXPECT_THAT(said("1.2%"), HasSubstr("violation"));
  EXPECT_THAT(said("1.3%"), HasSubstr("\nvalid"));
  EXPECT_THAT(said("0.0301"), HasSubstr("\nvalid"));
}

TEST_F(CheckSurfaceTest, FacetsAreFoundWhereAFileHasNone) {
  const RunResult result = Check(TwoCubes().Text(/*has_facets=*/false));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

TEST_F(CheckSurfaceTest, WithoutASurfaceTheMeshAloneIsChecked) {
  const std::string path = folder_.Write("two.mesh", TwoCubes().Text());
  const RunResult result = RunWellspace({"check", path});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("pieces                   2, closed"), HasSubstr("valid")));
}

TEST_F(CheckSurfaceTest, WhatCannotBeComparedIsRefused) {
  const std::string mesh = TwoCubes().Text();
  RunResult result = Check(mesh, {},
                           folder_.Write("open.off",
                                         "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n"
                                         "3 0 1 3\n3 1 2 3\n"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("open edges"), HasSubstr("`wellspace info ")));
  result = Check(mesh, {"--cloud", Data("cube.off")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("need not be vertices"));
  result = Check(mesh, {"--tolerance", "-1"});
  EXPECT_EQ(result.exit_code, 2);
  result = RunWellspace({"check", folder_.Path("two.mesh"), "--crease-angle", "20"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--surface"));
  result = RunWellspace({"check",
                         folder_.Write("plane.mesh",
                                       "MeshVersionFormatted 2\nDimension 2\nVertices\n3\n0 0 0\n"
                                       "1 0 0\n0 1 0\nTriangles\n1\n1 2 3 0\nEnd\n"),
                         "--surface", Data("twocubes.off")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("expected tetrahedra"));
}

}  // namespace
}  // namespace wellspace
