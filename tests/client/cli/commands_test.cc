// The program from the outside: its output, its files and its exit codes.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/client/cli/process.h"

namespace wellspace {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST_F(CommandsTest, EstimateForPeopleAndForPrograms) {
  const std::string cloud = folder_.Write("cloud.csv", kPlane);
  const RunResult text = RunWellspace({"estimate", cloud, "--stats", Path("stats.json"), "--size", "0.3"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out,
              AllOf(HasSubstr("vertices "), HasSubstr("triangles "), HasSubstr("memory "), HasSubstr("iB\n")));
  const nlohmann::json stats = nlohmann::json::parse(folder_.Read("stats.json"));
  EXPECT_EQ(stats["dimension"], 2);
  EXPECT_GT(stats["vertices"], 5);
  EXPECT_GT(stats["simplices"], 5);
  EXPECT_GT(stats["memory_bytes"], 1000);
  const RunResult json = RunWellspace({"estimate", cloud, "--stats", "-", "--size", "0.3"});
  EXPECT_EQ(nlohmann::json::parse(json.out), stats);
  EXPECT_EQ(folder_.FileCount(), 2);
}

TEST_F(CommandsTest, SizesAndTheCriterionMakeMoreVertices) {
  const auto vertices = [this](const std::vector<std::string>& options) {
    Mesh(kPlane, "plane.vtu", options);
    return formats::ReadMesh(Path("plane.vtu"))->View().vertex_count();
  };
  const uint64_t plain = vertices({});
  EXPECT_GT(vertices({"--criterion", "well-spaced"}), plain);
  EXPECT_GT(vertices({"--size", "0.05"}), 2 * plain);
  EXPECT_GT(vertices({"--size-box", "0,0,0.1,0.1,0.02", "--size-box", "0.8,0.8,0.9,0.9,0.02"}), plain + 20);
}

std::string PointsOf4D() {
  std::string text;
  for (int i = 0; i < 12; ++i) {
    for (int axis = 0; axis < 4; ++axis) {
      text += std::to_string(std::fmod(0.1 + i * (0.6180339887 + 0.137 * axis), 1)) + (axis == 3 ? "\n" : ",");
    }
  }
  return text;
}

TEST_F(CommandsTest, MeshAndCheckIn4D) {
  Mesh(PointsOf4D(), "mesh.npz", {"--dimension", "4", "--stats", Path("stats.json")});
  const RunResult check = RunWellspace({"check", Path("mesh.npz"), "--cloud", Path("cloud.csv"), "--rho", "2.9000001"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_THAT(check.out, AllOf(HasSubstr("simplices"), EndsWith("valid\n")));
  const nlohmann::json stats = nlohmann::json::parse(folder_.Read("stats.json"));
  EXPECT_EQ(stats["dimension"], 4);
  EXPECT_EQ(stats["input_points"], 12);
  const RunResult render = RunWellspace({"render", Path("mesh.npz"), "-o", Path("a.png")});
  EXPECT_EQ(render.exit_code, 2);
  EXPECT_THAT(render.err, HasSubstr("mesh.npz: only 2-D and 3-D meshes can be drawn, and this one is 4-D"));
}

// Before anything is meshed.
TEST_F(CommandsTest, VtuIsRefusedAbove3D) {
  EXPECT_THAT(MeshFails("cloud.csv", PointsOf4D(), 2, {"--dimension", "4"}), HasSubstr("expected npz"));
  const RunResult stream = RunWellspace({"mesh", "-", "-o", "-", "--dimension", "5"});
  EXPECT_EQ(stream.exit_code, 2);
  EXPECT_THAT(stream.err, HasSubstr("vtu holds meshes up to 3-D, and this one is 5-D; expected npz"));
}

TEST_F(CommandsTest, BadCloudsAreToldWithTheirLine) {
  EXPECT_THAT(MeshFails("bad.csv", "x,y,z\n1,2,3\n4,5\n", 2), HasSubstr("bad.csv:3: expected 3 coordinates, got 2"));
  EXPECT_THAT(MeshFails("bad.csv", "1,2\n3,nan\n", 2), HasSubstr("bad.csv:2: field 2: expected a finite number"));
  EXPECT_THAT(MeshFails("bad.xyz", "1 2 3\n\n4 five 6\n", 2), HasSubstr("bad.xyz:3: field 2: expected a number"));
  EXPECT_THAT(MeshFails("bad.node", "2 3\n1 0 0 0\n", 2), HasSubstr("bad.node:2: expected 2 points"));
  EXPECT_THAT(MeshFails("bad.csv", "", 2), HasSubstr("bad.csv: no points"));
}

// The server names the index of a point, the tool adds where it was read.
TEST_F(CommandsTest, ErrorsOfTheServerAboutPointsAreToldWithTheirLine) {
  EXPECT_THAT(MeshFails("far.csv", "# two points\n0.5,0.5\n\n0.5,7\n", 2, {"--domain", "0,0,1,1"}),
              AllOf(HasSubstr("far.csv:4: "), HasSubstr("points[1]"), HasSubstr("7")));
  EXPECT_THAT(MeshFails("near.csv", "x,y\n1,1\n1,1.0000000000000002\n0,0\n", 2),
              AllOf(HasSubstr("near.csv:"), HasSubstr("points[0]"), HasSubstr("points[1]")));
}

TEST_F(CommandsTest, MeshAndCheckInThePlane) {
  Mesh(kPlane, "plane.vtu", {"--stats", Path("stats.json")});
  const RunResult check =
      RunWellspace({"check", Path("plane.vtu"), "--cloud", Path("cloud.csv"), "--rho", "1.41421357"});
  EXPECT_EQ(check.exit_code, 0) << check.out;
  EXPECT_THAT(check.out, AllOf(HasSubstr("triangles"), HasSubstr("smallest angle"), EndsWith("valid\n")));

  const nlohmann::json stats = nlohmann::json::parse(folder_.Read("stats.json"));
  const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(Path("plane.vtu"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(stats["dimension"], 2);
  EXPECT_EQ(stats["input_points"], 6);
  EXPECT_EQ(stats["duplicates"], 1);
  EXPECT_EQ(stats["duplicate_of"], nlohmann::json::parse("[[4, 0]]"));
  EXPECT_EQ(stats["vertices"], mesh->points.size() / 2);
  EXPECT_EQ(stats["simplices"], mesh->simplices.size() / 3);
  EXPECT_LE(stats["max_radius_edge"], std::sqrt(2) * (1 + 1e-9));
  EXPECT_GT(stats["min_angle_deg"], 20);
  EXPECT_GT(stats["peak_memory_bytes"], 1 << 20);
  EXPECT_FALSE(stats["counters"].empty());
  for (const char* phase : {"tree", "refinement", "simplices", "total"}) {
    EXPECT_GE(stats["seconds"][phase], 0) << phase;
  }
}

TEST_F(CommandsTest, MeshAndCheckInSpace) {
  Mesh(kSpace, "bare.node", {"--rho", "2", "--domain", "-1,-1,-1,2,2,2", "--no-boundary"});
  EXPECT_THAT(folder_.Read("bare.node"), HasSubstr(" 3 0 0\n0 0 0 0\n1 1 0 0.1\n"));
  EXPECT_THAT(folder_.Read("bare.ele"), HasSubstr(" 4 0\n0 "));
  Mesh(kSpace, "space.node", {"--rho", "2", "--domain", "-1,-1,-1,2,2,2", "--stats", Path("stats.json")});
  EXPECT_THAT(folder_.Read("space.node"), HasSubstr(" 3 0 1\n0 0 0 0 0\n1 1 0 0.1 0\n"));
  EXPECT_THAT(folder_.Read("space.ele"), HasSubstr(" 4 1\n0 "));
  for (const char* name : {"space.node", "space.ele"}) {
    const RunResult check = RunWellspace({"check", Path(name), "--cloud", Path("cloud.csv"), "--rho", "2.0000001"});
    EXPECT_EQ(check.exit_code, 0) << check.out;
    EXPECT_THAT(check.out, AllOf(HasSubstr("tetrahedra"), HasSubstr("smallest dihedral angle"), EndsWith("valid\n")));
  }
  const nlohmann::json stats = nlohmann::json::parse(folder_.Read("stats.json"));
  EXPECT_TRUE(stats.contains("min_dihedral_deg"));
  EXPECT_EQ(stats["domain_low"], nlohmann::json::parse("[-1.0, -1.0, -1.0]"));
  EXPECT_EQ(stats["domain_high"], nlohmann::json::parse("[2.0, 2.0, 2.0]"));
}

TEST_F(CommandsTest, NearPointsAreNamedAndMerged) {
  // The second, third and fifth line are twins of the first and the fourth.
  constexpr char kTwins[] =
      "0.25,0.5\n0.25000000000000006,0.5\n0.25,0.5000000000000001\n0.75,0.5\n0.75,0.4999999999999999\n0.1,0.9\n";
  EXPECT_THAT(MeshFails("twins.csv", kTwins, 2),
              AllOf(HasSubstr("4 pairs are too close"), HasSubstr("twins.csv:5"), HasSubstr("(--merge) of ")));
  Mesh(kTwins, "merged.vtu", {"--merge", "1e-12", "--stats", Path("stats.json")});
  const nlohmann::json stats = nlohmann::json::parse(folder_.Read("stats.json"));
  EXPECT_EQ(stats["merged_points"], 3);
  EXPECT_EQ(stats["duplicates"], 0);
  EXPECT_EQ(stats["duplicate_of"], nlohmann::json::parse("[[1,0],[2,0],[4,1]]"));
  const RunResult result = RunWellspace({"mesh", Path("cloud.csv"), "--merge", "1e-12", "-o", Path("again.vtu")});
  EXPECT_THAT(result.err, HasSubstr("6 points (3 merged) -> "));
  EXPECT_EQ(RunWellspace({"check", Path("again.vtu"), "--cloud", Path("cloud.csv"), "--merge", "1e-12"}).exit_code, 0);
  EXPECT_EQ(RunWellspace({"check", Path("again.vtu"), "--cloud", Path("cloud.csv"), "--merge", "1e-17"}).exit_code, 1);
  EXPECT_THAT(MeshFails("twins.csv", kTwins, 2, {"--merge", "-1"}),
              HasSubstr("--merge: expected a length of at least 0"));
}

TEST_F(CommandsTest, DemandsThatCannotBeMetAreRefusedAtOnce) {
  for (const char* size : {"1e-6", "1e-103", "1e-154", "1e-300"}) {
    EXPECT_THAT(MeshFails("plane.csv", kPlane, 4, {"--domain", "-1,-1,2,2", "--size", size}),
                AllOf(HasSubstr("--size: max_circumradius: "), HasSubstr("max_vertices = 50000000"),
                      HasSubstr("the smallest size that fits is about ")));
    const RunResult estimate =
        RunWellspace({"estimate", Path("plane.csv"), "--domain", "-1,-1,2,2", "--size", size, "--output", "json"});
    EXPECT_EQ(estimate.exit_code, 0) << estimate.err;
    const nlohmann::json figures = nlohmann::json::parse(estimate.out);
    EXPECT_GE(figures["vertices"], 1'000'000'000'000) << size;
    EXPECT_GE(figures["memory_bytes"], 1'000'000'000'000) << size;
  }
  EXPECT_THAT(
      MeshFails("flat.csv", "0,0,0\n1,1,1e-6\n0.5,0.25,5e-7\n", 4, {"--margin", "0"}),
      AllOf(HasSubstr("only 1e-06 thick along axis 2"), HasSubstr("the smallest thickness that fits is about ")));
}

TEST_F(CommandsTest, SliversAreRepairedOrPumpedAway) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  std::string cloud;
  for (int i = 0; i < 150; ++i) {
    cloud +=
        std::to_string(unit(random)) + "," + std::to_string(unit(random)) + "," + std::to_string(unit(random)) + "\n";
  }
  const auto statistics = [this] { return nlohmann::json::parse(folder_.Read("stats.json")); };
  Mesh(cloud, "repaired.vtu", {"--stats", Path("stats.json")});
  EXPECT_EQ(statistics()["triangulation"], "delaunay");
  EXPECT_GT(statistics()["slivers"]["moves"], 0);
  EXPECT_LT(statistics()["slivers"]["min_angle_before_deg"], 12);
  EXPECT_GE(statistics()["min_dihedral_deg"], 12);
  const RunResult repaired = RunWellspace(
      {"check", Path("repaired.vtu"), "--rho", "2", "--min-dihedral", "11.999", "--plot", Path("quality.svg")});
  EXPECT_EQ(repaired.exit_code, 0) << repaired.out << repaired.err;
  EXPECT_THAT(repaired.out, AllOf(HasSubstr("below 12\u00b0                0 (0.0000 %)"), Not(HasSubstr("regular"))));
  EXPECT_THAT(folder_.Read("quality.svg"), AllOf(testing::StartsWith("<?xml"), HasSubstr("</svg>")));
  EXPECT_EQ(RunWellspace({"check", Path("repaired.vtu"), "--min-dihedral", "40"}).exit_code, 1);
  const RunResult bad_plot = RunWellspace({"check", Path("repaired.vtu"), "--plot", Path("quality.gif")});
  EXPECT_EQ(bad_plot.exit_code, 2);
  EXPECT_THAT(bad_plot.err, HasSubstr("expected a picture .png, .svg or .pdf"));

  for (const char* name : {"pumped.vtu", "pumped.npz", "pumped.node"}) {
    Mesh(cloud, name, {"--min-dihedral", "0", "--pump-weights", "--stats", Path("stats.json")});
    EXPECT_EQ(statistics()["triangulation"], "regular");
    EXPECT_GT(statistics()["slivers"]["weighted_vertices"], 0);
    const RunResult pumped = RunWellspace({"check", Path(name), "--min-dihedral", "3"});
    EXPECT_EQ(pumped.exit_code, 0) << pumped.out << pumped.err;
    EXPECT_THAT(pumped.out, EndsWith("the regular triangulation of its weights\nvalid\n"));
    const RunResult rho = RunWellspace({"check", Path(name), "--rho", "2"});
    EXPECT_EQ(rho.exit_code, 2);
    EXPECT_THAT(rho.err, HasSubstr("this mesh has weights"));
  }
  // Another weight, another triangulation.
  absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(Path("pumped.npz"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto [least, most] = std::minmax_element(mesh->weights.begin(), mesh->weights.end());
  *least = 4 * *most;
  ASSERT_TRUE(formats::WriteMesh(Path("wrong.npz"), "", mesh->View()).ok());
  EXPECT_THAT(RunWellspace({"check", Path("wrong.npz")}).out, HasSubstr("violation: "));
  Mesh(cloud, "plain.vtu", {"--min-dihedral", "0", "--stats", Path("stats.json")});
  EXPECT_TRUE(statistics()["slivers"].is_null());
  EXPECT_EQ(RunWellspace({"mesh", Path("cloud.csv"), "-o", Path("no.vtu"), "--min-dihedral", "19"}).exit_code, 2);
}

// Four input points of one circle: none can move, and the angle before is 0.
TEST_F(CommandsTest, FlatTetrahedraOfATorusAreRepairedAndSpokenOf) {
  const auto torus = [](int around, int along) {
    std::string cloud;
    for (int k = 0; k < around * along; ++k) {
      const double phi = 2 * std::numbers::pi * (k / along) / around;
      const double theta = 2 * std::numbers::pi * (k % along) / along;
      const double radius = 4 + std::cos(phi);
      absl::StrAppendFormat(&cloud, "%.17g,%.17g,%.17g\n", radius * std::cos(theta), radius * std::sin(theta),
                            std::sin(phi));
    }
    return cloud;
  };
  Mesh(torus(10, 20), "torus.vtu", {"--stats", Path("stats.json")});
  const nlohmann::json statistics = nlohmann::json::parse(folder_.Read("stats.json"));
  EXPECT_GE(statistics["min_dihedral_deg"], 12);
  ASSERT_TRUE(statistics["slivers"].is_object());
  EXPECT_EQ(statistics["slivers"]["left"], 0);
  EXPECT_GT(statistics["slivers"]["operations"], 0);
  // Slivers that cannot be repaired are told of, though not in the exit code.
  const RunResult left = RunWellspace({"mesh", folder_.Write("other.csv", torus(12, 24)), "-o", Path("left.vtu"),
                                       "--criterion", "well-spaced", "--min-dihedral", "18", "--quiet"});
  EXPECT_EQ(left.exit_code, 0);
  EXPECT_THAT(left.err, AllOf(testing::StartsWith("warning: "), HasSubstr("left below --min-dihedral"),
                              HasSubstr("\n  vertices ")));
}

TEST_F(CommandsTest, EmptyCloudInADomain) {
  Mesh("", "empty.vtu", {"--domain", "0,0,1,1"});
  EXPECT_EQ(RunWellspace({"check", Path("empty.vtu")}).exit_code, 0);
}

TEST_F(CommandsTest, StandardStreams) {
  const RunResult mesh =
      RunWellspace({"mesh", "-", "-o", "-"}, {.input = kPlane, .environment = {}, .error_descriptor = -1});
  ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_THAT(mesh.out, testing::StartsWith("<?xml"));
  EXPECT_THAT(mesh.err, AllOf(HasSubstr("6 points (1 duplicates) -> "), EndsWith(" s\n")));
  const RunResult check = RunWellspace({"check", "-"}, {.input = mesh.out, .environment = {}, .error_descriptor = -1});
  EXPECT_EQ(check.exit_code, 0) << check.err << check.out;

  const RunResult quiet =
      RunWellspace({"mesh", "-", "-o", Path("out.vtu"), "--input-format", "xyz", "--stats", "-", "--quiet"},
                   {.input = kSpace, .environment = {}, .error_descriptor = -1});
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_THAT(quiet.err, IsEmpty());
  EXPECT_EQ(nlohmann::json::parse(quiet.out)["input_points"], 6);
  const RunResult bad =
      RunWellspace({"mesh", "-", "-o", "-"}, {.input = "1,2\n3\n", .environment = {}, .error_descriptor = -1});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.err, HasSubstr("<stdin>:2: expected 2 coordinates, got 1"));
}

TEST_F(CommandsTest, CheckFindsPlantedFaults) {
  Mesh(kPlane, "good.node");
  const absl::StatusOr<formats::Mesh> good = formats::ReadMesh(Path("good.node"));
  ASSERT_TRUE(good.ok()) << good.status();
  // Checks a mesh with one thing changed.
  const auto check = [this](const formats::Mesh& mesh) {
    std::ofstream nodes(Path("bad.node"));
    nodes.precision(17);
    nodes << mesh.points.size() / 2 << " 2 0 0\n";
    for (size_t i = 0; i < mesh.points.size() / 2; ++i) {
      nodes << i << " " << mesh.points[2 * i] << " " << mesh.points[2 * i + 1] << "\n";
    }
    std::ofstream simplices(Path("bad.ele"));
    simplices << mesh.simplices.size() / 3 << " 3 0\n";
    for (size_t i = 0; i < mesh.simplices.size() / 3; ++i) {
      simplices << i << " " << mesh.simplices[3 * i] << " " << mesh.simplices[3 * i + 1] << " "
                << mesh.simplices[3 * i + 2] << "\n";
    }
    nodes.close();
    simplices.close();
    return RunWellspace({"check", Path("bad.ele"), "--cloud", Path("cloud.csv")});
  };
  EXPECT_EQ(check(*good).exit_code, 0);

  formats::Mesh missing = *good;
  missing.simplices.resize(missing.simplices.size() - 3);
  formats::Mesh inverted = *good;
  std::swap(inverted.simplices[0], inverted.simplices[1]);
  formats::Mesh moved = *good;
  moved.points[0] += 1e-9;
  formats::Mesh twice = *good;
  twice.simplices[1] = twice.simplices[0];
  for (const formats::Mesh& bad : {missing, inverted, moved, twice}) {
    const RunResult result = check(bad);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.out, AllOf(HasSubstr("violation: "), Not(HasSubstr("valid\n"))));
  }
  const RunResult rho = RunWellspace({"check", Path("good.node"), "--rho", "0.6"});
  EXPECT_EQ(rho.exit_code, 1);
  EXPECT_THAT(rho.out, HasSubstr("violation: "));
}

// Tags of facets in every format that is read back, and none with --no-boundary.
TEST_F(CommandsTest, MeshesHaveTheirBoundary) {
  for (const std::string& cloud : {std::string(kPlane), std::string(kSpace)}) {
    const size_t tags = cloud == kPlane ? 4 : 6;
    for (const char* name : {"b.vtu", "b.npz", "b.msh", "b.mesh", "b.node"}) {
      SCOPED_TRACE(name);
      Mesh(cloud, name);
      const RunResult check = RunWellspace({"check", Path(name), "--output", "json"});
      ASSERT_EQ(check.exit_code, 0) << check.out;
      const nlohmann::json parts = nlohmann::json::parse(check.out)["boundary"];
      ASSERT_EQ(parts.size(), tags);
      for (size_t i = 0; i < tags; ++i) {
        EXPECT_EQ(parts[i]["tag"], i + 1);
        EXPECT_GT(parts[i]["facets"], 0);
      }
      EXPECT_THAT(RunWellspace({"check", Path(name)}).out,
                  HasSubstr(tags == 4 ? " facets, 4 tags" : " facets, 6 tags"));
      Mesh(cloud, name, {"--no-boundary"});
      EXPECT_TRUE(formats::ReadMesh(Path(name))->boundary.empty());
      EXPECT_EQ(RunWellspace({"check", Path(name)}).exit_code, 0);
    }
  }
}

TEST_F(CommandsTest, CheckFindsWrongBoundaries) {
  Mesh(kPlane, "good.node");
  const std::string edges = folder_.Read("good.edge");
  const auto check = [&](const std::string& from, const std::string& to) {
    std::string text = edges;
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    folder_.Write("good.edge", text.replace(at, from.size(), to));
    const RunResult result = RunWellspace({"check", Path("good.node")});
    EXPECT_EQ(result.exit_code, 1);
    return result.out;
  };
  const size_t end = edges.find('\n', edges.find("\n0 ") + 1);
  const std::string first = edges.substr(edges.find("\n0 ") + 1, end - edges.find("\n0 ") - 1);  // "0 a b 1"
  ASSERT_EQ(first.back(), '1');
  EXPECT_THAT(check(first, first.substr(0, first.size() - 1) + "2"), HasSubstr("lies on xmin, but has the tag 2"));
  EXPECT_THAT(check(first, first.substr(0, first.size() - 1) + "0"),
              HasSubstr("lies on xmin, but is no boundary facet"));
}

TEST_F(CommandsTest, CheckHoldsMeshesToTheCriterionAndToSizes) {
  Mesh(kPlane, "plain.vtu");
  Mesh(kPlane, "well.vtu", {"--criterion", "well-spaced"});
  Mesh(kPlane, "small.vtu", {"--size", "0.2", "--size-box", "0,0,0.25,0.25,0.05"});
  const auto check = [this](const std::string& name, const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"check", Path(name)};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunWellspace(arguments);
  };
  const std::vector<std::string> well_spaced = {"--criterion", "well-spaced", "--rho", "1.41421357"};
  EXPECT_EQ(check("well.vtu", well_spaced).exit_code, 0);
  const RunResult ill = check("plain.vtu", well_spaced);
  EXPECT_EQ(ill.exit_code, 1);
  EXPECT_THAT(ill.out, HasSubstr("violation: "));
  const std::vector<std::string> sizes = {"--size", "0.2", "--size-box", "0,0,0.25,0.25,0.05"};
  EXPECT_EQ(check("small.vtu", sizes).exit_code, 0);
  EXPECT_EQ(check("plain.vtu", sizes).exit_code, 1);
  EXPECT_EQ(check("small.vtu", {"--size", "0.15"}).exit_code, 1);
  EXPECT_EQ(check("small.vtu", {"--size-box", "0.5,0.5,1,1,0.05"}).exit_code, 1);
  // Demands that are not valid are no violation.
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"--criterion", "well-spaced"}, "--criterion requires --rho"},
      {{"--size", "-1"}, "--size: expected a number above 0, got \"-1\""},
      {{"--size-box", "0,0,0,1,1,1,1"},
       "--size-box 0,0,0,1,1,1,1: expected low corner, high corner and size, 5 numbers"},
      {{"--size-box", "1,0,0,1,1"}, "size box 0 reaches from 1 to 0 on axis 0; "},
  };
  for (const auto& [options, message] : wrong) {
    const RunResult result = check("small.vtu", options);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(options) << result.out;
    EXPECT_THAT(result.err, HasSubstr(message)) << testing::PrintToString(options);
  }
}

TEST_F(CommandsTest, SizesAtPointsAreReadKeptAndChecked) {
  folder_.Write("sizes.csv", "x,y,h\n0.25,0.25,0.01\n0.75,0.75,0.02\n");
  const std::string sizes = Path("sizes.csv");
  const std::vector<std::string> domain = {"--domain", "-1,-1,3,3", "--gradation", "0.2"};
  std::vector<std::string> options = domain;
  options.insert(options.end(), {"--size-field", sizes});
  Mesh(kPlane, "sized.vtu", options);
  Mesh(kPlane, "plain.vtu", domain);
  const auto check = [&](const std::string& name, const std::string& gradation) {
    return RunWellspace({"check", Path(name), "--size-field", sizes, "--gradation", gradation});
  };
  EXPECT_EQ(check("sized.vtu", "0.2").exit_code, 0);
  EXPECT_EQ(check("sized.vtu", "0.05").exit_code, 1);
  EXPECT_THAT(check("plain.vtu", "0.2").out, HasSubstr("of the size at point "));

  // As lengths of edges they are about a quarter smaller.
  options.insert(options.end(), {"--size-unit", "edge"});
  Mesh(kPlane, "edges.vtu", options);
  EXPECT_EQ(check("edges.vtu", "0.2").exit_code, 0);
  EXPECT_EQ(
      RunWellspace({"check", Path("sized.vtu"), "--size-field", sizes, "--gradation", "0.2", "--size-unit", "edge"})
          .exit_code,
      1);

  // On the vertices of a mesh of two triangles, sizes are much larger between them, unless they are interpolated.
  const std::string field = folder_.Write(
      "field.msh",
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 -1 -1 0\n2 2 -1 0\n3 2 2 0\n4 -1 2 0\n$EndNodes\n"
      "$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4\n$EndElements\n"
      "$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n4\n1 0.05\n2 0.05\n3 0.05\n4 0.05\n$EndNodeData\n");
  const auto vertices = [&](const std::string& between) {
    Mesh(kPlane, "between.vtu", {"--size-field", field, "--size-field-between", between});
    return formats::ReadMesh(Path("between.vtu"))->View().vertex_count();
  };
  const uint64_t constant = [&] {
    Mesh(kPlane, "constant.vtu", {"--size", "0.05"});
    return formats::ReadMesh(Path("constant.vtu"))->View().vertex_count();
  }();
  EXPECT_LT(vertices("grow"), constant / 4);
  EXPECT_GT(vertices("interpolate"), 0.8 * static_cast<double>(constant));
  EXPECT_EQ(RunWellspace({"check", Path("between.vtu"), "--size-field", field, "--size-field-between", "interpolate"})
                .exit_code,
            0);
  EXPECT_EQ(RunWellspace({"check", Path("between.vtu"), "--size", "0.0556"}).exit_code, 0);
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, {"--size-field", sizes, "--size-field-between", "interpolate"}),
              HasSubstr("no simplices"));

  // Errors of sizes name the row of the file.
  folder_.Write("sizes.csv", "x,y,h\n0.25,0.25,0.01\n0.5,0.75,nan\nNA,0.75,0.02\n");
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, options), HasSubstr(sizes + ":3: column 3: expected a finite number"));
  std::vector<std::string> skipping = options;
  skipping.insert(skipping.end(), {"--skip-invalid", "--stats", Path("stats.json")});
  Mesh(kPlane, "skipped.vtu", skipping);
  const nlohmann::json skipped = nlohmann::json::parse(folder_.Read("stats.json"));
  EXPECT_EQ(skipped["skipped_sizes"], 2);
  EXPECT_THAT(skipped["notes"].dump(), HasSubstr("2 sizes are left out"));
  folder_.Write("sizes.csv", "x,y,h\n0.25,0.25,0.01\n0.5,0.75,0\n");
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, options), HasSubstr(sizes + ":3: size 0 is not allowed"));
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, {"--gradation", "1.5"}), HasSubstr("--gradation: gradation: 1.5 is"));
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, {"--edge-length", "-1"}), HasSubstr("--edge-length: edge_length: -1"));
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, {"--size-unit", "edge"}), HasSubstr("--size-unit requires"));
}

uint32_t BigEndian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4 && at + i < bytes.size(); ++i) {
    value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  }
  return value;
}

TEST_F(CommandsTest, RenderMakesPictures) {
  Mesh(kPlane, "plane.vtu");
  Mesh(kSpace, "space.vtu");
  for (const char* name : {"plane.vtu", "space.vtu"}) {
    const RunResult png = RunWellspace({"render", Path(name), "-o", Path("a.png"), "--width", "500"});
    ASSERT_EQ(png.exit_code, 0) << png.err;
    EXPECT_EQ(folder_.Read("a.png").substr(1, 3), "PNG");
    EXPECT_EQ(BigEndian(folder_.Read("a.png"), 16), 500u);
    const RunResult svg = RunWellspace({"render", Path(name), "-o", Path("a.svg"), "--width", "700"});
    ASSERT_EQ(svg.exit_code, 0) << svg.err;
    EXPECT_THAT(folder_.Read("a.svg"), AllOf(HasSubstr("width=\"700px\""), HasSubstr("</svg>")));
  }
  const std::string picture = folder_.Read("a.svg");
  EXPECT_EQ(
      RunWellspace({"render", Path("space.vtu"), "-o", Path("a.svg"), "--plane", "-1,0.5,0,0", "--up", "y"}).exit_code,
      0);
  EXPECT_NE(folder_.Read("a.svg"), picture);
  const RunResult as_json =
      RunWellspace({"render", Path("plane.vtu"), "-o", Path("b.png"), "--width", "300", "--output", "json"});
  EXPECT_EQ(as_json.exit_code, 0) << as_json.err;
  EXPECT_EQ(nlohmann::json::parse(as_json.out),
            (nlohmann::json{{"mesh", Path("plane.vtu")}, {"picture", Path("b.png")}, {"width", 300}}));
  const RunResult nothing = RunWellspace({"render", Path("space.vtu"), "-o", Path("none.png"), "--plane", "1,0,0,-50"});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("space.vtu: the plane cuts off all"));
  // A Cairo that cannot be loaded.
  folder_.Write("libcairo.so.2", "");
  const RunResult loaded = RunWellspace({"render", Path("plane.vtu"), "-o", Path("c.png")},
                                        {.input = "", .environment = {"LD_LIBRARY_PATH=" + folder_.Path("")}});
  EXPECT_NE(loaded.exit_code, 0);
  EXPECT_THAT(loaded.err, AllOf(HasSubstr("libcairo.so.2: file too short"), HasSubstr("package libcairo2")));
  EXPECT_FALSE(std::filesystem::exists(Path("c.png")));
}

TEST_F(CommandsTest, ServerInfoOfTheEmbeddedServer) {
  const RunResult result = RunWellspace({"server", "info"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("embedded"), HasSubstr("version"), HasSubstr("2, 3"), HasSubstr("workers")));
}

// Reads a descriptor until it ends.
std::string ReadAll(int descriptor) {
  std::string text;
  char buffer[4096];
  for (ssize_t got = 0; (got = read(descriptor, buffer, sizeof(buffer))) > 0;) {
    text.append(buffer, got);
  }
  return text;
}

TEST_F(CommandsTest, ProgressBarOnlyOnATerminalAndUnlessQuiet) {
  const std::string cloud = folder_.Write("cloud.csv", kPlane);
  for (const bool quiet : {false, true}) {
    int terminal = -1;
    int error = -1;
    ASSERT_EQ(openpty(&terminal, &error, nullptr, nullptr, nullptr), 0);
    std::vector<std::string> arguments = {"mesh", cloud, "-o", Path("out.vtu")};
    if (quiet) {
      arguments.push_back("--quiet");
    }
    EXPECT_EQ(RunWellspace(arguments, {.input = "", .environment = {}, .error_descriptor = error}).exit_code, 0);
    close(error);
    const std::string shown = ReadAll(terminal);
    close(terminal);
    if (quiet) {
      EXPECT_THAT(shown, IsEmpty());
    } else {
      EXPECT_THAT(shown, AllOf(HasSubstr("\r"), HasSubstr("% "), HasSubstr("6 points")));
    }
  }
  EXPECT_THAT(RunWellspace({"mesh", cloud, "-o", Path("out.vtu")}).err, Not(HasSubstr("\r")));
}

// The program is stopped while it writes a big mesh into a pipe that is not emptied, so that the signal finds it at
// work.
TEST_F(CommandsTest, CtrlCIsExitCode130) {
  const std::string cloud = folder_.Write("grid.csv", Grid(150));
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string pipe = Path("pipe" + std::to_string(signal));
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    Process process({"mesh", cloud, "-o", pipe, "--format", "vtu"});
    const int reader = open(pipe.c_str(), O_RDONLY);  // returns once the program opens it for writing
    ASSERT_GE(reader, 0);
    process.Send(signal);
    const std::string written = ReadAll(reader);
    close(reader);
    const RunResult result = process.Wait();
    EXPECT_EQ(result.exit_code, 128 + signal) << result.err;
    EXPECT_THAT(result.err, HasSubstr("cancelled"));
    EXPECT_THAT(written, Not(HasSubstr("</VTKFile>")));
  }
}

}  // namespace
}  // namespace wellspace
