// `wellspace view`: pages in files, on standard output, and for a browser.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/client/cli/commands_fixture.h"

namespace wellspace {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ViewCommandTest : public CommandsTest {
 protected:
  // The header of the page.
  nlohmann::json HeaderOf(const std::string& page) const {
    const std::string start = "id=\"mesh\">";
    const size_t from = page.find(start);
    if (from == std::string::npos) {
      return nullptr;
    }
    return nlohmann::json::parse(page.substr(from + start.size(), page.find("</script>", from) - from - start.size()));
  }

  // A browser that makes the file `opened`, with its arguments, under its name at once.
  std::string Browser() const {
    const std::string path = folder_.Write("browser",
                                           "#!/bin/sh\nprintf '%s' \"$@\" > \"$0.part\"\n"
                                           "mv \"$0.part\" \"$(dirname \"$0\")/opened\"\n");
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path;
  }
};

TEST_F(ViewCommandTest, FilesOfEveryFormat) {
  for (const char* name : {"mesh.vtu", "mesh.npz", "mesh.msh", "mesh.mesh", "mesh.node", "mesh.vtk"}) {
    Mesh(kSpace, name);
    const RunResult result = RunWellspace({"view", Path(name), "-o", Path("page.html")});
    ASSERT_EQ(result.exit_code, 0) << name << result.err;
    EXPECT_EQ(result.out, "") << name;
    const std::string page = folder_.Read("page.html");
    EXPECT_THAT(page, StartsWith("<!doctype html>")) << name;
    EXPECT_THAT(page, EndsWith("</html>\n")) << name;
    const nlohmann::json header = HeaderOf(page);
    EXPECT_EQ(header["name"], name);
    EXPECT_EQ(header["dimension"], 3) << name;
    EXPECT_EQ(header["up"], 2) << name;
    EXPECT_EQ(header["boundary"].size(), 6u) << name;
    EXPECT_EQ(header["boundary"][0]["name"], "xmin") << name;
    const RunResult standard = RunWellspace({"view", Path(name), "-o", "-"});
    EXPECT_EQ(standard.exit_code, 0) << standard.err;
    EXPECT_EQ(standard.out, page) << name;
  }
}

TEST_F(ViewCommandTest, DataOfVerticesAndStandardInput) {
  Mesh("x,y,height\n0,0,1\n1,0.1,2\n0.4,0.9,4\n0.5,0.45,8\n", "plane.vtu", {"--dimension", "2"});
  const RunResult result =
      RunWellspace({"view", Path("plane.vtu"), "-o", Path("page.html"), "--up", "y", "--output", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report["page"], Path("page.html"));
  EXPECT_EQ(report["opened"], false);
  const nlohmann::json header = HeaderOf(folder_.Read("page.html"));
  EXPECT_EQ(header["fields"], nlohmann::json({"height"}));
  EXPECT_EQ(header["up"], 1);
  RunOptions options;
  options.input = folder_.Read("plane.vtu");
  const RunResult input = RunWellspace({"view", "-", "-o", "-"}, options);
  ASSERT_EQ(input.exit_code, 0) << input.err;
  EXPECT_EQ(HeaderOf(input.out)["name"], "mesh");
}

TEST_F(ViewCommandTest, WithoutAFileItOpensABrowser) {
  Mesh(kSpace, "mesh.npz");
  std::filesystem::create_directory(Path("temporary"));
  RunOptions options;
  options.environment = {"TMPDIR=" + Path("temporary"), "BROWSER=" + Browser() + ":other"};
  const RunResult result = RunWellspace({"view", Path("mesh.npz")}, options);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string page = result.out.substr(0, result.out.find('\n'));
  EXPECT_THAT(page, StartsWith(Path("temporary") + "/wellspace-"));
  EXPECT_THAT(page, EndsWith("/mesh.npz.html"));
  std::ifstream file(page);
  EXPECT_EQ(HeaderOf({std::istreambuf_iterator<char>(file), {}})["name"], "mesh.npz");
  // The browser is not waited for.
  for (int i = 0; i < 3000 && !std::filesystem::exists(Path("opened")); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(folder_.Read("opened"), page);
}

TEST_F(ViewCommandTest, WithoutABrowserItSaysWhereThePageIs) {
  Mesh(kSpace, "mesh.npz");
  RunOptions options;
  options.shell = "unset DISPLAY WAYLAND_DISPLAY";
  for (const std::string& browser : {std::string("BROWSER=") + Path("nothing"), std::string("BROWSER=")}) {
    options.environment = {"TMPDIR=" + Path(""), browser};
    const RunResult result = RunWellspace({"view", Path("mesh.npz")}, options);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("mesh.npz.html\nNo browser was found: open this file in one.\n"));
  }
}

TEST_F(ViewCommandTest, ErrorsHaveTheirExitCodes) {
  const auto fails = [this](const std::vector<std::string>& arguments, int exit_code, const std::string& text) {
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(text));
    EXPECT_FALSE(std::filesystem::exists(Path("page.html")));
  };
  Mesh(kSpace, "mesh.npz");
  Mesh("0 0 0 0\n1 0 0.1 0.2\n0 1 0.3 0.7\n", "four.npz", {"--dimension", "4"});
  fails({"view", Path("four.npz"), "-o", Path("page.html")}, 2, "four.npz: only 2-D and 3-D meshes can be shown");
  fails({"view", folder_.Write("cloud.csv", kPlane), "-o", Path("page.html")}, 2, "no format is known");
  fails({"view", Path("absent.vtu"), "-o", Path("page.html")}, 2, "absent.vtu");
  fails({"view", Path("mesh.npz"), "-o", "-", "--output", "json"}, 2, "only one of them can be standard output");
  fails({"view", Path("mesh.npz"), "-o", Path("page.html"), "--up", "w"}, 2, "--up");
  fails({"view", Path("mesh.npz"), "-o", Path("absent/page.html")}, 2, "absent");
  RunOptions options;
  options.environment = {"TMPDIR=" + Path("absent")};
  const RunResult folder = RunWellspace({"view", Path("mesh.npz")}, options);
  EXPECT_EQ(folder.exit_code, 4);
  EXPECT_THAT(folder.err, HasSubstr("cannot be made"));
}

}  // namespace
}  // namespace wellspace
