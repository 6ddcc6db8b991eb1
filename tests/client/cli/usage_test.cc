// Wrong usage of the program: its messages and exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/cli/closed_port.h"
#include "tests/client/cli/commands_fixture.h"

namespace wellspace {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

class UsageTest : public CommandsTest {};

TEST_F(UsageTest, HelpAndVersion) {
  const RunResult help = RunWellspace({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("mesh"), HasSubstr("estimate"), HasSubstr("check"), HasSubstr("render"),
                              HasSubstr("server"), HasSubstr("Exit codes:"), HasSubstr("130")));
  for (const char* command : {"mesh", "estimate", "check", "render", "server"}) {
    const RunResult result = RunWellspace({command, "--help"});
    EXPECT_EQ(result.exit_code, 0) << command;
    EXPECT_THAT(result.out, HasSubstr("Usage:")) << command;
  }
  const RunResult version = RunWellspace({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_THAT(version.out, testing::StartsWith("wellspace "));
}

// As in a wheel, where both are one file.
TEST_F(UsageTest, TheToolIsTheServerToo) {
  const RunResult version = RunWellspace({"wellspaced", "--version"});
  EXPECT_EQ(version.exit_code, 0) << version.err;
  EXPECT_THAT(version.out, testing::StartsWith("wellspaced "));
  const RunResult wrong = RunWellspace({"wellspaced", "--no-such-option"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--no-such-option"));
}

TEST_F(UsageTest, WrongUsageIsExitCode2) {
  const std::string cloud = folder_.Write("cloud.csv", kPlane);
  const std::string out = Path("out.vtu");
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"knit"},
      {"mesh"},
      {"mesh", cloud},
      {"mesh", cloud, "-o", out, "--dimension", "1"},
      {"mesh", cloud, "-o", out, "--dimension", "7"},
      {"mesh", cloud, "-o", out, "--criterion", "round"},
      {"mesh", cloud, "-o", out, "--dimension", "3"},
      {"mesh", cloud, "-o", out, "--rho", "two"},
      {"mesh", cloud, "-o", out, "--rho", "nan"},
      {"mesh", cloud, "-o", out, "--rho", "0.3"},
      {"mesh", cloud, "-o", out, "--margin", "-1"},
      {"mesh", cloud, "-o", out, "--domain", "0,0,1"},
      {"mesh", cloud, "-o", out, "--domain", "0,0,0,1,1,1", "--dimension", "2"},
      {"mesh", cloud, "-o", out, "--domain", "0,0,1,1", "--margin", "0.1"},
      {"mesh", cloud, "-o", out, "--threads", "0"},
      {"mesh", cloud, "-o", out, "--max-vertices", "-1"},
      {"mesh", cloud, "-o", out, "--timeout", "0"},
      {"mesh", cloud, "-o", out, "--format", "stl"},
      {"mesh", cloud, "-o", Path("out.stl")},
      {"mesh", cloud, "-o", Path("none/out.vtu")},
      {"mesh", cloud, "-o", "-", "--stats", "-"},
      {"mesh", cloud, "-o", "-", "--format", "node"},
      {"mesh", Path("none.csv"), "-o", out},
      {"estimate"},
      {"estimate", cloud, "-o", out},
      {"estimate", cloud, "--rho", "0.3"},
      {"estimate", cloud, "--size-box", "0,0,1,1"},
      {"estimate", Path("none.csv")},
      {"check"},
      {"check", Path("none.vtu")},
      {"render", Path("none.vtu"), "-o", Path("a.png")},
      {"render", Path("none.vtu"), "-o", Path("a.gif")},
      {"render", Path("none.vtu"), "-o", Path("a.png"), "--width", "7"},
      {"render", Path("none.vtu"), "-o", Path("a.png"), "--plane", "1,2,3"},
      {"server"},
  };
  for (const std::vector<std::string>& arguments : wrong) {
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments) << result.err;
    EXPECT_THAT(result.err, Not(IsEmpty())) << testing::PrintToString(arguments);
    EXPECT_EQ(folder_.FileCount(), 1) << testing::PrintToString(arguments);
  }
}

// A file that is of another kind than the command wants is told with the command for it.
TEST_F(UsageTest, FilesOfAnotherKindAreTold) {
  const std::string cloud = folder_.Write("cloud.csv", kPlane);
  const std::string domain = folder_.Write("lake.poly", "0 2 0 0\n");
  const std::string picture = Path("a.png");
  const std::string is_cloud =
      cloud + ": this is a cloud, not a mesh; `wellspace mesh " + cloud + " -o " + Path("cloud.vtu") +
      "` makes a mesh of it, which can be given here, and `wellspace info " + cloud + "` tells what is in it";
  const std::string is_picture = "cannot write " + picture + ": this is a picture, not a mesh; write " + Path("a.vtu") +
                                 ", of which `wellspace render " + Path("a.vtu") + " -o " + picture +
                                 "` makes a picture";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"check", cloud}, is_cloud},
      {{"render", cloud, "-o", picture}, is_cloud},
      {{"check", Path("cloud.csv.gz")}, "cloud.csv.gz -o " + Path("cloud.vtu") + "` makes"},
      {{"check", domain},
       domain + ": this is a domain, not a mesh; `wellspace mesh " + domain + " -o " + Path("lake.vtu") +
           "` makes a mesh of it, which can be given here [INVALID_ARGUMENT]"},
      {{"check", picture}, picture + ": this is a picture, not a mesh [INVALID_ARGUMENT]"},
      {{"mesh", cloud, "-o", picture}, is_picture},
      {{"convert", cloud, picture}, is_picture},
      {{"download", "one", "-o", picture, "--server", "localhost:1"}, is_picture},
      {{"mesh", cloud, "-o", Path("a.stl")}, "no format is known by the extension \".stl\""},
  };
  for (const auto& [arguments, message] : cases) {
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, HasSubstr(message)) << testing::PrintToString(arguments);
    EXPECT_EQ(folder_.FileCount(), 2) << testing::PrintToString(arguments);
  }
}

TEST_F(UsageTest, HelpSpeaksOfDomains) {
  EXPECT_THAT(RunWellspace({"--help"}).out, StartsWith("Quality simplicial meshes of point clouds and of domains"));
  for (const char* command : {"mesh", "estimate", "upload"}) {
    const std::string help = RunWellspace({command, "--help"}).out;
    EXPECT_THAT(help.substr(0, help.find('\n')), HasSubstr("domain")) << command;
    EXPECT_THAT(help, HasSubstr("File of points, of a domain or of a surface")) << command;
  }
  EXPECT_THAT(RunWellspace({"manual"}).out, HasSubstr("meshes of point clouds and of domains"));
}

// A message about wrong usage says where to read more; for programs it is JSON.
TEST_F(UsageTest, WrongUsageIsExplained) {
  struct Case {
    std::vector<std::string> arguments;
    std::string message;
  };
  const std::vector<Case> cases = {
      {{}, "a command is missing; expected one of mesh, estimate, "},
      {{"knit", "a.csv"}, "there is no command knit; expected one of mesh, "},
      {{"mehs", "a.csv", "-o", "a.vtu"}, "there is no command mehs (did you mean mesh?); expected one of mesh, "},
      {{"meshes"}, "there is no command meshes (did you mean mesh?); expected one of mesh, "},
      {{"est"}, "there is no command est (did you mean estimate?); expected one of mesh, "},
      {{"create", "one"}, "there is no command create (did you mean session create?); expected one of mesh, "},
      {{"--versoin"},
       "not expected: --versoin (did you mean --version?); a command is missing; expected one of mesh, "},
      {{"session", "delte"}, "there is no command delte (did you mean delete?); expected one of create, "},
      {{"session"},
       "a command is missing; expected one of create, list, show, update, delete; see wellspace session --help"},
      {{"session", "make"}, "there is no command make; expected one of create, "},
      {{"mesh"}, "IN is required; see wellspace mesh --help"},
      {{"mesh", "a.csv", "-o", "a.vtu", "--bogus", "7", "more"}, "not expected: --bogus; see wellspace mesh --help"},
      {{"mesh", "a.csv", "-o", "a.vtu", "--sise=7"},
       "not expected: --sise=7 (did you mean --size?); see wellspace mesh --help"},
      {{"mesh", "a.csv", "-o", "a.vtu", "--timeout", "0"}, "--timeout: expected a number above 0, got \"0\""},
      {{"mesh", "a.csv", "-o", "a.vtu", "--max-vertices", "-1"},
       "--max-vertices: expected a whole number of at least 1, got \"-1\""},
      {{"mesh", "a.csv", "-o", "a.vtu", "--threads", "x"},
       "--threads: expected a whole number of at least 1 and at most 1024, got \"x\""},
      {{"upload", "one", "a.csv", "--offset", "-1"}, "--offset: expected a whole number of at least 0, got \"-1\""},
      {{"session", "list", "--limit", "0"}, "--limit: expected a whole number of at least 1, got \"0\""},
      {{"cells", "one", "3", "-4"}, "VERTEX: expected a whole number of at least 0 and at most 4294967295, got \"-4\""},
  };
  for (const Case& one : cases) {
    const RunResult text = RunWellspace(one.arguments);
    EXPECT_EQ(text.exit_code, 2) << one.message;
    EXPECT_THAT(text.err, AllOf(StartsWith("wellspace: " + one.message), EndsWith("--help [INVALID_ARGUMENT]\n")));
    std::vector<std::string> as_json = one.arguments;
    as_json.insert(as_json.end(), {"--output", "json"});
    if (one.message.find("command") != std::string::npos || one.message.find("not expected") == 0) {
      continue;  // --output is no option of these, or one of those that are told
    }
    const RunResult json = RunWellspace(as_json);
    EXPECT_EQ(json.exit_code, 2) << one.message;
    const nlohmann::json error = nlohmann::json::parse(json.err).at("error");
    EXPECT_EQ(error.at("code"), "INVALID_ARGUMENT");
    EXPECT_THAT(error.at("message").get<std::string>(), StartsWith(one.message));
  }
}

// Options that are well-formed but cannot be are judged by the server; the tool says which option it was.
TEST_F(UsageTest, WrongOptionsAreNamedWithTheirValueAndWhatWouldDo) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"--domain", "0,0,1"},
       "--domain 0,0,1: expected low corner and high corner, 4 numbers in 2-D to 12 in 6-D, got 3"},
      {{"--domain", "0,0,0,1,1,1", "--dimension", "2"}, "--domain 0,0,0,1,1,1: expected 4 numbers with --dimension 2"},
      {{"--domain", "0,0,1,0"}, "--domain: domain: along axis 1 it goes from 0 to 0; finite numbers are needed"},
      {{"--rho", "0.3"}, "--rho: rho: 0.3 is not allowed in 2-D; "},
      {{"--margin", "-1"}, "--margin: margin: -1 is not allowed; "},
      {{"--size", "-2"}, "--size: max_circumradius: -2 is not allowed; "},
      {{"--size", "small"}, "--size: expected a number, got \"small\""},
      {{"--size-box", "0,0,1,1"}, "--size-box 0,0,1,1: expected low corner, high corner and size, 5 numbers in 2-D"},
      {{"--size-box", "0,0,0,1,1,1,0.1"}, "cloud.csv:2: expected 3 coordinates, got 2"},
      {{"--size-box", "0,0,0,1,1,1,0.1", "--dimension", "2"}, "5 numbers in 2-D, got 7"},
      {{"--size-box", "0,0,1,1,0.1", "--size-box", "0,0.5,1,0.25,0.1"},
       "--size-box 0,0.5,1,0.25,0.1: size_boxes[1].high[1]: 0.25 is not allowed; "},
      {{"--size-box", "0,0,1,1,0"}, "--size-box 0,0,1,1,0: size_boxes[0].max_circumradius: 0 is not allowed; "},
      // A 0 does not stand for the default.
      {{"--gradation", "0"}, "--gradation: gradation: 0 is not allowed; expected a number above 0 and at most 1, or "},
      {{"--gradation", "-0.0"}, "--gradation: gradation: 0 is not allowed; "},
      {{"--size", "0"}, "--size: max_circumradius: 0 is not allowed; expected a number above 0, or "},
      {{"--edge-length", "0"}, "--edge-length: edge_length: 0 is not allowed; "},
      {{"--rho", "0"}, "--rho: rho: 0 is not allowed; "},
      {{"--size-box", "0,0,1,x,1"}, "--size-box: expected a number, got \"x\""},
      {{"--criterion", "round"}, "--criterion: round not in {radius-edge,well-spaced}"},
  };
  for (const auto& [options, message] : wrong) {
    EXPECT_THAT(MeshFails("cloud.csv", kPlane, 2, options), HasSubstr(message)) << testing::PrintToString(options);
  }
}

TEST_F(UsageTest, UnreachableServerIsExitCode3) {
  const ClosedPort closed;
  const std::string server = closed.address();
  EXPECT_EQ(RunWellspace({"server", "info", "--server", server}).exit_code, 3);
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 3, {"--server", server}), HasSubstr("server " + server + ": "));
  const RunResult by_environment = RunWellspace(
      {"server", "info"}, {.input = "", .environment = {"WELLSPACE_SERVER=" + server}, .error_descriptor = -1});
  EXPECT_EQ(by_environment.exit_code, 3);
}

TEST_F(UsageTest, LimitIsExitCode4AndTimeoutIsExitCode5) {
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 4, {"--max-vertices", "7"}), HasSubstr("7"));
  EXPECT_THAT(MeshFails("cloud.csv", kPlane, 5, {"--timeout", "1e-9"}), HasSubstr("--timeout: 1e-09 seconds passed"));
}

}  // namespace
}  // namespace wellspace
