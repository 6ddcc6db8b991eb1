// Limits of control groups and of the machine, from files as Linux writes them.
#include "server/base/resources.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "server/base/options.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kGigabyte = uint64_t{1} << 30;

// A machine of 16 GiB whose files a test writes.
class ResourcesTest : public ::testing::Test {
 protected:
  ResourcesTest() { Write("proc/meminfo", "MemTotal:       16777216 kB\nMemFree:         1000000 kB\n"); }

  void Write(const std::string& path, const std::string& content) {
    std::filesystem::create_directories(std::filesystem::path(folder_.Path(path)).parent_path());
    folder_.Write(path, content);
  }

  Resources Read() const {
    const std::string root = folder_.Path("");
    return ReadResources(root.substr(0, root.find_last_not_of('/') + 1));
  }

  static int Cores() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

  TemporaryFolder folder_;
};

TEST_F(ResourcesTest, AreTheMachinesWithoutControlGroups) {
  EXPECT_EQ(Read().memory_bytes, 16 * kGigabyte);
  EXPECT_EQ(Read().processors, Cores());
  EXPECT_EQ(DefaultMaxMemory(Read()), 12 * kGigabyte);
}

TEST_F(ResourcesTest, AreThoseOfAContainer) {
  Write("proc/self/cgroup", "0::/\n");
  Write("sys/fs/cgroup/memory.max", "4294967296\n");
  Write("sys/fs/cgroup/cpu.max", "100000 100000\n");
  EXPECT_EQ(Read().memory_bytes, 4 * kGigabyte);
  EXPECT_EQ(Read().processors, 1);
  EXPECT_EQ(DefaultMaxMemory(Read()), 3 * kGigabyte);
}

TEST_F(ResourcesTest, AreTheLeastOfAllGroupsAbove) {
  Write("proc/self/cgroup", "0::/system.slice/wellspaced.service\n");
  Write("sys/fs/cgroup/system.slice/wellspaced.service/memory.max", "8589934592\n");
  Write("sys/fs/cgroup/system.slice/memory.max", "2147483648\n");
  Write("sys/fs/cgroup/system.slice/wellspaced.service/cpu.max", "max 100000\n");
  Write("sys/fs/cgroup/system.slice/cpu.max", "50000 100000\n");
  EXPECT_EQ(Read().memory_bytes, 2 * kGigabyte);
  EXPECT_EQ(Read().processors, 1);
}

TEST_F(ResourcesTest, OfAGroupWithoutLimitsAreTheMachines) {
  Write("proc/self/cgroup", "0::/user.slice\n");
  Write("sys/fs/cgroup/user.slice/memory.max", "max\n");
  Write("sys/fs/cgroup/user.slice/cpu.max", "max 100000\n");
  EXPECT_EQ(Read().memory_bytes, 16 * kGigabyte);
  EXPECT_EQ(Read().processors, Cores());
}

TEST_F(ResourcesTest, AreNeverMoreThanTheMachines) {
  Write("proc/self/cgroup", "0::/\n");
  Write("sys/fs/cgroup/memory.max", "1099511627776\n");
  Write("sys/fs/cgroup/cpu.max", "1000000000 100000\n");
  EXPECT_EQ(Read().memory_bytes, 16 * kGigabyte);
  EXPECT_EQ(Read().processors, Cores());
}

TEST_F(ResourcesTest, AreThoseOfVersion1) {
  Write("proc/self/cgroup", "5:memory:/docker/abc\n4:cpu,cpuacct:/docker/abc\n1:name=systemd:/docker/abc\n0::/x\n");
  // Within a container its own group is the root, and its path is not there.
  Write("sys/fs/cgroup/memory/memory.limit_in_bytes", "1073741824\n");
  Write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "100000\n");
  Write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(Read().memory_bytes, kGigabyte);
  EXPECT_EQ(Read().processors, 1);
  // On the host.
  Write("sys/fs/cgroup/memory/docker/abc/memory.limit_in_bytes", "536870912\n");
  EXPECT_EQ(Read().memory_bytes, kGigabyte / 2);
}

TEST_F(ResourcesTest, OfVersion1WithoutLimitsAreTheMachines) {
  Write("proc/self/cgroup", "5:memory:/\n4:cpu:/\n");
  Write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  Write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  Write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(Read().memory_bytes, 16 * kGigabyte);
  EXPECT_EQ(Read().processors, Cores());
}

TEST_F(ResourcesTest, ThatAreNonsenseAreNoLimits) {
  for (const std::string& groups : {std::string(""), std::string("0::"), std::string("nonsense\n::\n0:x\n"),
                                    std::string("0::relative\n"), std::string("\0\0\0", 3)}) {
    Write("proc/self/cgroup", groups);
    EXPECT_EQ(Read().memory_bytes, 16 * kGigabyte);
  }
  Write("proc/self/cgroup", "0::/\n");
  for (const char* text : {"", "-5", "many", "99999999999999999999999"}) {
    Write("sys/fs/cgroup/memory.max", text);
    Write("sys/fs/cgroup/cpu.max", text);
    EXPECT_EQ(Read().memory_bytes, 16 * kGigabyte) << text;
    EXPECT_EQ(Read().processors, Cores()) << text;
  }
  // A period of nothing.
  Write("sys/fs/cgroup/cpu.max", "1000 0\n");
  EXPECT_EQ(Read().processors, Cores());
}

TEST_F(ResourcesTest, AreKnownOfThisMachine) {
  EXPECT_GT(ReadResources().memory_bytes, kMinMemoryBytes);
  EXPECT_GE(ReadResources().processors, 1);
}

TEST(DefaultMaxMemory, IsNeverTooSmallToWorkWith) {
  EXPECT_EQ(DefaultMaxMemory({.memory_bytes = 1000}), kMinMemoryBytes);
  EXPECT_EQ(DefaultMaxMemory({.memory_bytes = 0}), 0u);
}

}  // namespace
}  // namespace wellspace::server
