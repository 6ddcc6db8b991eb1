// Output that cannot be written is told by the exit code, and nothing unfinished is left.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/cli/commands_fixture.h"
#include "tests/client/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace wellspace {
namespace {

using ::testing::HasSubstr;

RunResult RunAfter(const std::string& shell, const std::vector<std::string>& arguments) {
  return RunWellspace(arguments, {.input = "", .environment = {}, .error_descriptor = -1, .shell = shell});
}

class LostOutputTest : public testing::Test {
 protected:
  LostOutputTest() {
    cloud_ = folder_.Write("cloud.csv", kPlane);
    mesh_ = folder_.Path("mesh.node");
    EXPECT_EQ(RunWellspace({"mesh", cloud_, "-o", mesh_}).exit_code, 0);
  }

  std::string Path(const std::string& name) const { return folder_.Path(name); }

  // Every way to print something without a server of one's own.
  std::vector<std::vector<std::string>> Printing() const {
    return {{"--help"},
            {"--version"},
            {"mesh", "--help"},
            {"manual"},
            {"completion", "bash"},
            {"server", "info"},
            {"server", "info", "--output", "json"},
            {"server", "health"},
            {"estimate", cloud_},
            {"estimate", cloud_, "--stats", "-"},
            {"estimate", cloud_, "--output", "json"},
            {"mesh", cloud_, "-o", "-"},
            {"mesh", cloud_, "-o", Path("out.vtu"), "--stats", "-"},
            {"mesh", cloud_, "-o", Path("out.vtu"), "--output", "json"},
            {"check", mesh_},
            {"check", mesh_, "--output", "json"},
            {"check", mesh_, "--rho", "0.6"},  // a violation
            {"render", mesh_, "-o", Path("out.png"), "--width", "300", "--output", "json"},
            {"view", mesh_, "-o", "-"},
            {"view", mesh_, "-o", Path("out.html"), "--output", "json"}};
  }

  TemporaryFolder folder_;
  std::string cloud_;
  std::string mesh_;
};

TEST_F(LostOutputTest, AFullDeviceIsExitCode4) {
  for (const std::vector<std::string>& arguments : Printing()) {
    const RunResult result = RunAfter("exec >/dev/full", arguments);
    EXPECT_EQ(result.exit_code, 4) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, HasSubstr("cannot write <stdout>: No space left on device"))
        << testing::PrintToString(arguments);
  }
  const RunResult json = RunAfter("exec >/dev/full", {"estimate", cloud_, "--output", "json"});
  EXPECT_EQ(nlohmann::json::parse(json.err)["error"]["code"], "RESOURCE_EXHAUSTED");
}

TEST_F(LostOutputTest, APipeThatIsClosedIsExitCode4) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  close(ends[0]);
  for (const std::vector<std::string>& arguments : Printing()) {
    const RunResult result =
        RunWellspace(arguments, {.input = "", .environment = {}, .error_descriptor = -1, .output_descriptor = ends[1]});
    EXPECT_EQ(result.exit_code, 4) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, HasSubstr("cannot write <stdout>: Broken pipe")) << testing::PrintToString(arguments);
  }
  close(ends[1]);
}

// Output must not go to a file that has got the number of standard output.
TEST_F(LostOutputTest, AClosedStandardOutputIsExitCode4) {
  ASSERT_EQ(RunWellspace({"mesh", cloud_, "-o", Path("right.vtu")}).exit_code, 0);
  for (const char* shell : {"exec >&-", "exec <&- >&-"}) {
    for (const std::vector<std::string>& arguments : Printing()) {
      const RunResult result = RunAfter(shell, arguments);
      EXPECT_EQ(result.exit_code, 4) << testing::PrintToString(arguments);
      EXPECT_THAT(result.err, HasSubstr("cannot write <stdout>: Bad file descriptor"))
          << testing::PrintToString(arguments);
    }
    EXPECT_EQ(folder_.Read("out.vtu"), folder_.Read("right.vtu"));
  }
  for (const char* shell : {"exec 2>&-", "exec <&- >&- 2>&-"}) {
    EXPECT_EQ(RunAfter(shell, {"mesh", cloud_, "-o", Path("out.vtu")}).exit_code, 0) << shell;
    EXPECT_EQ(folder_.Read("out.vtu"), folder_.Read("right.vtu")) << shell;
  }
}

TEST_F(LostOutputTest, AClosedStandardInputIsExitCode2) {
  const std::vector<std::vector<std::string>> reading = {
      {"mesh", "-", "-o", Path("out.vtu")}, {"estimate", "-"}, {"check", "-"}, {"check", mesh_, "--cloud", "-"}};
  for (const std::vector<std::string>& arguments : reading) {
    const RunResult result = RunAfter("exec <&-", arguments);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, HasSubstr("cannot read <stdin>: Bad file descriptor")) << testing::PrintToString(arguments);
  }
}

TEST_F(LostOutputTest, FilesOnAFullDeviceAreExitCode4) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"mesh", cloud_, "-o", "/dev/full", "--format", "vtu"},
                                             {"mesh", cloud_, "-o", Path("out.vtu"), "--stats", "/dev/full"},
                                             {"estimate", cloud_, "--stats", "/dev/full"}}) {
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, 4) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, HasSubstr("cannot write /dev/full: No space left on device"));
  }
}

TEST_F(LostOutputTest, AFileThatIsAPipeWhoseReaderLeavesIsExitCode4) {
  const std::string pipe = Path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  Process process({"mesh", folder_.Write("grid.csv", Grid(150)), "-o", pipe, "--format", "vtu"});
  const int reader = open(pipe.c_str(), O_RDONLY | O_CLOEXEC);  // returns once the program opens it for writing
  ASSERT_GE(reader, 0);
  close(reader);
  const RunResult result = process.Wait();
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("cannot write " + pipe + ": Broken pipe"));
}

TEST_F(LostOutputTest, TheLimitOfAFilesSizeLeavesNoFile) {
  const std::string grid = folder_.Write("grid.csv", Grid(40));
  ASSERT_EQ(RunWellspace({"mesh", grid, "-o", Path("grid.npz")}).exit_code, 0);
  const int files = folder_.FileCount();
  std::vector<std::vector<std::string>> writing = {
      {"render", Path("grid.npz"), "-o", Path("out.png")},
      {"render", Path("grid.npz"), "-o", Path("out.svg")},
      {"view", Path("grid.npz"), "-o", Path("out.html")},
      {"check", Path("grid.npz"), "--plot", Path("out.svg"), "--output", "json"}};
  for (const char* name : {"out.vtu", "out.vtkhdf", "out.npz", "out.msh", "out.mesh", "out.node", "out.vtk", "out.xdmf",
                           "out.su2", "out.inp"}) {
    writing.push_back({"mesh", grid, "-o", Path(name)});
  }
  writing.push_back({"mesh", grid, "-o", Path("out.txt"), "--format", "msh22"});
  for (const std::vector<std::string>& arguments : writing) {
    const RunResult result = RunAfter("ulimit -f 1", arguments);
    EXPECT_EQ(result.exit_code, 4) << testing::PrintToString(arguments) << result.err;
    EXPECT_THAT(result.err, HasSubstr("File too large")) << testing::PrintToString(arguments);
    EXPECT_EQ(folder_.FileCount(), files) << testing::PrintToString(arguments);
  }
}

// The .node is a pipe that fills up, so that signals find the program at work on a .ele with its temporary name.
TEST_F(LostOutputTest, SignalsLeaveNoTemporaryFile) {
  const std::string grid = folder_.Write("grid.csv", Grid(150));
  struct Case {
    std::vector<int> signals;
    int exit_code;
  };
  const std::vector<Case> cases = {{{SIGINT}, 130},         {{SIGTERM}, 143},         {{SIGHUP}, 129},
                                   {{SIGINT, SIGINT}, 130}, {{SIGHUP, SIGTERM}, 143}, {{SIGXCPU}, 128 + SIGXCPU},
                                   {{SIGTERM, SIGHUP}, 129}};
  const std::string pipe = Path("pipe.node");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int files = folder_.FileCount();
  for (const Case& one : cases) {
    Process process({"mesh", grid, "-o", Path("pipe.ele")});
    const int reader = open(pipe.c_str(), O_RDONLY | O_CLOEXEC);  // returns once the program opens it for writing
    ASSERT_GE(reader, 0);
    char buffer[4096];
    ASSERT_GT(read(reader, buffer, 1), 0);      // the buffer is full, and all files are open
    EXPECT_EQ(folder_.FileCount(), files + 3);  // .ele, .edge and .poly
    for (const int signal : one.signals) {
      process.Send(signal);
    }
    if (one.signals.size() == 1) {
      while (read(reader, buffer, sizeof(buffer)) > 0) {
      }
    }
    EXPECT_EQ(process.Wait().exit_code, one.exit_code) << testing::PrintToString(one.signals);
    close(reader);
    EXPECT_EQ(folder_.FileCount(), files) << testing::PrintToString(one.signals);
  }
}

// nohup(1) has it ignored, and it stays so: the mesh is made.
TEST_F(LostOutputTest, AnIgnoredHangupStaysIgnored) {
  const std::string grid = folder_.Write("grid.csv", Grid(150));
  const std::string pipe = Path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  Process process({"mesh", grid, "-o", pipe, "--format", "vtu"},
                  {.input = "", .environment = {}, .error_descriptor = -1, .shell = "trap '' HUP"});
  const int reader = open(pipe.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  ASSERT_EQ(kill(process.id(), SIGHUP), 0);
  char buffer[4096];
  while (read(reader, buffer, sizeof(buffer)) > 0) {
  }
  close(reader);
  EXPECT_EQ(process.Wait().exit_code, 0);
}

}  // namespace
}  // namespace wellspace
