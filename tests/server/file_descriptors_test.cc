// The real server without file descriptors: what it has goes on, what comes is refused, and later it is as if nothing
// had been.
#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_http2.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

constexpr rlim_t kDescriptors = 64;

// A limit on descriptors for the programs that are started while it lasts.
class ScopedDescriptorLimit {
 public:
  explicit ScopedDescriptorLimit(rlim_t limit) {
    getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit lower = {.rlim_cur = limit, .rlim_max = before_.rlim_max};
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &lower), 0);
  }
  ~ScopedDescriptorLimit() { setrlimit(RLIMIT_NOFILE, &before_); }
  ScopedDescriptorLimit(const ScopedDescriptorLimit&) = delete;
  ScopedDescriptorLimit& operator=(const ScopedDescriptorLimit&) = delete;

 private:
  rlimit before_ = {};
};

class FileDescriptors : public ::testing::Test {
 protected:
  FileDescriptors() {
    const ScopedDescriptorLimit limit(kDescriptors);
    daemon_ = std::make_unique<Daemon>(std::vector<std::string>(), folder_.Path("log"));
  }

  ~FileDescriptors() override {
    if (daemon_ != nullptr) {
      Stop();
    }
  }

  void Stop() {
    daemon_->Stop();
    daemon_.reset();
  }

  pid_t pid() { return daemon_->process().pid(); }

  size_t OpenDescriptors() {
    const auto entries = std::filesystem::directory_iterator(absl::StrCat("/proc/", pid(), "/fd"));
    return std::distance(begin(entries), end(entries));
  }

  // Processor time of the server.
  absl::Duration CpuTime() {
    std::ifstream file(absl::StrCat("/proc/", pid(), "/stat"));
    std::string word;
    double ticks = 0;
    constexpr int kUserTicks = 14;
    constexpr int kSystemTicks = 15;
    for (int i = 1; i <= kSystemTicks; ++i) {
      file >> word;
      ticks += i >= kUserTicks ? std::stod(word) : 0;
    }
    return absl::Seconds(ticks / static_cast<double>(sysconf(_SC_CLK_TCK)));
  }

  void ExpectNoBusyLoop() {
    const absl::Duration before = CpuTime();
    absl::SleepFor(absl::Seconds(1));  // what is measured
    EXPECT_LT(CpuTime() - before, absl::Milliseconds(300));
  }

  // The exit code of a client that has no connection yet.
  int MeshFromAnotherProcess() {
    const std::string cloud = folder_.Write("cloud.csv", "0,0\n1,0\n0.5,0.75\n");
    return Subprocess("wellspace", {"mesh", cloud, "-o", folder_.Path("mesh.vtu"), "--server", daemon_->address()})
        .Wait();
  }

  TemporaryFolder folder_;
  std::unique_ptr<Daemon> daemon_;
};

TEST_F(FileDescriptors, UsedUpByConnectionsRefuseFurtherOnesOnly) {
  const client::Client first = daemon_->Client();
  ASSERT_EQ(MeshTriangle(first), absl::OkStatus());
  std::vector<RawConnection> connections;
  for (rlim_t i = 0; i < 2 * kDescriptors; ++i) {
    connections.emplace_back(daemon_->address());
  }
  // The last ones are closed at once, and some descriptors are left for files.
  EXPECT_TRUE(connections.back().IsClosedByServer());
  EXPECT_LT(OpenDescriptors(), kDescriptors - 10);
  EXPECT_EQ(MeshTriangle(first), absl::OkStatus());
  ExpectNoBusyLoop();
  connections.clear();
  // Until the server has noticed that they are gone, it refuses.
  const absl::Time end = absl::Now() + absl::Minutes(1);
  bool is_served = false;
  while (!is_served && absl::Now() < end) {
    RawConnection another(daemon_->address());
    is_served = another.Begin() && another.IsAlive();
  }
  EXPECT_TRUE(is_served);
  EXPECT_EQ(MeshFromAnotherProcess(), 0);
  EXPECT_EQ(MeshTriangle(first), absl::OkStatus());
  Stop();
  EXPECT_THAT(folder_.Read("log"), HasSubstr("file descriptors"));
}

TEST_F(FileDescriptors, NoneAtAllMakeConnectionsWait) {
  const client::Client first = daemon_->Client();
  ASSERT_EQ(MeshTriangle(first), absl::OkStatus());
  rlimit before = {};
  const rlimit none = {.rlim_cur = 3, .rlim_max = kDescriptors};
  ASSERT_EQ(prlimit(pid(), RLIMIT_NOFILE, &none, &before), 0);
  RawConnection waiting(daemon_->address());
  waiting.Send(ConnectionStart());
  EXPECT_EQ(MeshTriangle(first), absl::OkStatus());
  ExpectNoBusyLoop();
  const rlimit some = {.rlim_cur = kDescriptors, .rlim_max = kDescriptors};
  ASSERT_EQ(prlimit(pid(), RLIMIT_NOFILE, &some, nullptr), 0);
  EXPECT_TRUE(waiting.IsAlive());
  EXPECT_EQ(MeshFromAnotherProcess(), 0);
}

}  // namespace
}  // namespace wellspace::server
