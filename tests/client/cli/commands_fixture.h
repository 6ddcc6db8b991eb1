// A fixture for tests of commands that need no server: two clouds, and meshing that has to succeed or to fail.
#ifndef WELLSPACE_TESTS_CLIENT_CLI_COMMANDS_FIXTURE_H_
#define WELLSPACE_TESTS_CLIENT_CLI_COMMANDS_FIXTURE_H_

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "tests/client/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace wellspace {

inline constexpr char kPlane[] = "x,y\n0,0\n1,0.1\n0.4,0.9\n0.5,0.45\n0,0\n0.1,0.2\n";
inline constexpr char kSpace[] = "0 0 0\n1 0 0.1\n0 1 0\n0.1 0 1\n0.3 0.3 0.35\n0.31 0.3 0.35\n";

// The points of a slanted grid.
inline std::string Grid(int side) {
  std::string grid;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      grid += std::to_string(i) + " " + std::to_string(j * 1.0625 + i * 0.25) + "\n";
    }
  }
  return grid;
}

class CommandsTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.Path(name); }

  // Meshes `cloud`, which must succeed, to the file `output`.
  void Mesh(std::string_view cloud, const std::string& output, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"mesh", folder_.Write("cloud.csv", cloud), "-o", Path(output)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult result = RunWellspace(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  // Fails the test unless meshing `cloud` ends with `exit_code`, nothing written; returns the output.
  std::string MeshFails(const std::string& name, std::string_view cloud, int exit_code,
                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"mesh", folder_.Write(name, cloud), "-o", Path("out.vtu")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const int files = folder_.FileCount();
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(folder_.FileCount(), files);
    EXPECT_EQ(result.out, "");
    return result.err;
  }

  TemporaryFolder folder_;
};

}  // namespace wellspace

#endif  // WELLSPACE_TESTS_CLIENT_CLI_COMMANDS_FIXTURE_H_
