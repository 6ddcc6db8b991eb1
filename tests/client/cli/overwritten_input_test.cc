// No command writes over its input, or one file twice: it says so before any work.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/client/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace wellspace {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr char kNodes[] = "5 2 0 0\n0 0 0\n1 1 0.1\n2 0.4 0.9\n3 0.5 0.45\n4 0.1 0.2\n";
constexpr char kTable[] = "0,0\n1,0.1\n0.4,0.9\n0.5,0.45\n0.1,0.2\n";

class OverwrittenInputTest : public testing::Test {
 protected:
  OverwrittenInputTest() {
    nodes_ = folder_.Write("a.node", kNodes);
    table_ = folder_.Write("a.csv", kTable);
  }

  std::string Path(const std::string& name) const { return folder_.Path(name); }

  std::string SymbolicLink(const std::string& name, const std::string& target) const {
    std::filesystem::create_symlink(target, Path(name));
    return Path(name);
  }

  std::string HardLink(const std::string& name, const std::string& target) const {
    std::filesystem::create_hard_link(target, Path(name));
    return Path(name);
  }

  // Fails the test unless the command is refused with a message that has `argument` and `other`, and the inputs are
  // what they were.
  void IsRefused(const std::vector<std::string>& arguments, const std::string& argument, const std::string& other,
                 const std::string& shell = "") const {
    const int files = folder_.FileCount();
    const RunResult result =
        RunWellspace(arguments, {.input = "", .environment = {}, .error_descriptor = -1, .shell = shell});
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr(argument), HasSubstr(" would write "), HasSubstr(other)))
        << testing::PrintToString(arguments);
    EXPECT_EQ(folder_.FileCount(), files) << testing::PrintToString(arguments);
    EXPECT_EQ(folder_.Read("a.node"), kNodes) << testing::PrintToString(arguments);
    EXPECT_EQ(folder_.Read("a.csv"), kTable) << testing::PrintToString(arguments);
  }

  TemporaryFolder folder_;
  std::string nodes_;
  std::string table_;
};

TEST_F(OverwrittenInputTest, OfAPairByTheNameOfTheOther) {
  IsRefused({"mesh", nodes_, "-o", Path("a.ele")}, "--out " + Path("a.ele") + " would write " + nodes_,
            "the same file as IN " + nodes_);
  IsRefused({"mesh", nodes_, "-o", Path("a.ELE")}, "--out", "IN");
  IsRefused({"mesh", nodes_, "-o", Path("a.out"), "--format", "node"}, "--out", "IN");
  IsRefused({"mesh", nodes_, "-o", nodes_}, "--out", "IN");
}

TEST_F(OverwrittenInputTest, ByItsNameInOtherWords) {
  IsRefused({"mesh", table_, "-o", table_, "--format", "vtu"}, "--out", "IN");
  IsRefused({"mesh", table_, "-o", Path("./a.csv"), "--format", "npz"}, "--out", "IN");
  IsRefused({"mesh", table_, "-o", Path("out.vtu"), "--stats", table_}, "--stats", "IN");
  IsRefused({"estimate", table_, "--stats", table_}, "--stats", "IN");
  const std::string folder = SymbolicLink("folder", ".");
  IsRefused({"mesh", table_, "-o", folder + "/a.csv", "--format", "medit"}, "--out", "IN");
  IsRefused({"mesh", nodes_, "-o", folder + "/a.ele"}, "--out", "IN");
}

TEST_F(OverwrittenInputTest, ThroughLinks) {
  IsRefused({"mesh", table_, "-o", SymbolicLink("symbolic.vtu", "a.csv")}, "--out", "IN");
  IsRefused({"mesh", table_, "-o", HardLink("hard.vtu", table_)}, "--out", "IN");
  IsRefused({"mesh", SymbolicLink("symbolic.csv", "a.csv"), "-o", table_, "--format", "msh41"}, "--out", "IN");
  SymbolicLink("pair.ele", "a.node");
  IsRefused({"mesh", nodes_, "-o", Path("pair.node")}, "--out", "IN");
  IsRefused({"estimate", table_, "--stats", Path("hard.vtu")}, "--stats", "IN");
}

TEST_F(OverwrittenInputTest, ByRedirection) {
  IsRefused({"mesh", "-", "-o", table_, "--format", "vtu"}, "--out", "IN (standard input)", "exec <" + table_);
  IsRefused({"mesh", table_, "-o", "-"}, "--out (standard output)", "IN", "exec >>" + table_);
  IsRefused({"mesh", table_, "-o", Path("out.vtu"), "--stats", "-"}, "--stats", "IN", "exec >>" + table_);
  IsRefused({"estimate", table_}, "the estimate", "IN", "exec >>" + table_);
}

TEST_F(OverwrittenInputTest, OneFileForTwoOutputs) {
  IsRefused({"mesh", table_, "-o", Path("out.vtu"), "--stats", Path("out.vtu")}, "--stats", "and so would --out");
  IsRefused({"mesh", table_, "-o", Path("out.node"), "--stats", Path("./out.ele")}, "--stats", "and so would --out");
  SymbolicLink("old.json", "old.vtu");
  folder_.Write("old.vtu", "old");
  IsRefused({"mesh", table_, "-o", Path("old.vtu"), "--stats", Path("old.json")}, "--stats", "and so would --out");
}

TEST_F(OverwrittenInputTest, OfMeshesAndTheirClouds) {
  ASSERT_EQ(RunWellspace({"mesh", table_, "-o", Path("mesh.node")}).exit_code, 0);
  const std::string picture = HardLink("picture.png", Path("mesh.ele"));
  IsRefused({"render", Path("mesh.node"), "-o", picture}, "--out", "MESH");
  IsRefused({"view", Path("mesh.node"), "-o", picture}, "--out", "MESH");
  IsRefused({"check", Path("mesh.node"), "--plot", picture}, "--plot", "MESH");
  IsRefused({"check", Path("mesh.node"), "--cloud", table_, "--plot", SymbolicLink("plot.svg", "a.csv")}, "--plot",
            "--cloud");
}

// Before the server is looked for: there is none.
TEST_F(OverwrittenInputTest, OfCommandsAboutSessions) {
  const std::string server = "127.0.0.1:1";
  IsRefused({"cells", "one", "--vertices", table_, "-o", table_, "--server", server}, "--out", "--vertices");
  IsRefused({"add", "one", table_, "--server", server}, "the list of vertices", "IN", "exec >>" + table_);
  IsRefused(
      {"download", "one", "-o", Path("a.vtu"), "--server", server, "--token-file", SymbolicLink("a.vtu", "a.csv")},
      "--out", "--token-file");
}

TEST_F(OverwrittenInputTest, OtherFilesAndDevicesMayBeWritten) {
  folder_.Write("b.ele", "old");
  EXPECT_EQ(RunWellspace({"mesh", nodes_, "-o", Path("b.ele")}).exit_code, 0);
  EXPECT_EQ(RunWellspace({"mesh", nodes_, "-o", "/dev/null", "--format", "vtu", "--stats", "/dev/null"}).exit_code, 0);
  EXPECT_EQ(folder_.Read("a.node"), kNodes);
  EXPECT_THAT(folder_.Read("b.node"), testing::StartsWith("1"));
}

}  // namespace
}  // namespace wellspace
