// The real server without file descriptors: its calls go on, new ones are refused, and later it is as if nothing
// had been.
#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "server/base/descriptor_limit.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_http2.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr rlim_t kDescriptors = 64;

class FileDescriptors : public ::testing::Test {
 protected:
  FileDescriptors() {
    daemon_ = std::make_unique<Daemon>(std::vector<std::string>(), folder_.Path("log"),
                                       AfterShell(absl::StrCat("ulimit -n ", kDescriptors)));
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
    absl::SleepFor(absl::Seconds(1));  // the measured time
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

// The hard limit, which the system grants for the asking.
TEST(DescriptorLimit, IsRaisedAtTheStart) {
  Daemon daemon({}, "", AfterShell("ulimit -Sn 100; ulimit -Hn 300"));
  rlimit limit = {};
  ASSERT_EQ(prlimit(daemon.process().pid(), RLIMIT_NOFILE, nullptr, &limit), 0);
  EXPECT_EQ(limit.rlim_cur, 300u);
  daemon.Stop();
}

TEST(DescriptorLimit, LeavesSomeForFiles) {
  for (const uint64_t limit : {0, 4, 64, 96, 1024, 65536}) {
    EXPECT_EQ(SpareDescriptors(limit, /*keeps_files=*/false), std::min<uint64_t>(limit / 4, 24)) << limit;
  }
  EXPECT_EQ(SpareDescriptors(64, /*keeps_files=*/true), 32u);
  EXPECT_EQ(SpareDescriptors(512, /*keeps_files=*/true), 256u);
  EXPECT_EQ(SpareDescriptors(1024, /*keeps_files=*/true), 256u);
  EXPECT_EQ(SpareDescriptors(4096, /*keeps_files=*/true), 1024u);
  for (const uint64_t limit : {0, 1, 64, 1024, 65536}) {
    EXPECT_GE(MaxWrittenFiles(limit), 1u) << limit;
    EXPECT_LE(MaxWrittenFiles(limit), std::max<uint64_t>(SpareDescriptors(limit, true), 1)) << limit;
  }
}

// An upload that has sent its points and does not end them yet.
class OpenUpload {
 public:
  OpenUpload(v1::SessionService::Stub& sessions, const std::string& name)
      : stream_(sessions.UploadPoints(&context_, &response_)) {
    stream_->Write(UploadRequest(name, 0, UniformPoints(kPoints, 3, 1)));
  }

  static constexpr size_t kPoints = 100;

  grpc::Status Finish() {
    stream_->WritesDone();
    return stream_->Finish();
  }
  uint64_t committed() const { return response_.committed_points(); }

 private:
  grpc::ClientContext context_;
  v1::UploadPointsResponse response_;
  std::unique_ptr<grpc::ClientWriter<v1::UploadPointsRequest>> stream_;
};

// A durable server, connections that say nothing, as many as it takes, and uploads, more than it opens files for.
TEST(DurableFileDescriptors, UsedUpByConnectionsAndUploadsLoseNothing) {
  constexpr uint64_t kLimit = 256;
  constexpr int kUploads = 100;
  const TemporaryFolder folder;
  Daemon daemon({"--data", folder.Path("data"), "--max-sessions-per-tenant", "1000"}, folder.Path("log"),
                AfterShell(absl::StrCat("ulimit -n ", kLimit)));
  const client::Client first = daemon.Client();
  ASSERT_EQ(MeshTriangle(first), absl::OkStatus());
  SessionCalls calls(grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
  std::vector<std::string> names;
  for (int i = 0; i < kUploads; ++i) {
    names.push_back(calls.Create().name());
  }
  std::vector<RawConnection> silent;
  for (uint64_t i = 0; i < 2 * kLimit; ++i) {
    silent.emplace_back(daemon.address());
  }
  EXPECT_TRUE(silent.back().IsClosedByServer());

  std::vector<std::unique_ptr<OpenUpload>> uploads;
  for (const std::string& name : names) {
    uploads.push_back(std::make_unique<OpenUpload>(calls.sessions(), name));
  }
  uint64_t served = 0;
  for (const std::unique_ptr<OpenUpload>& upload : uploads) {
    const grpc::Status status = upload->Finish();
    const bool is_served = status.ok() && upload->committed() == OpenUpload::kPoints;
    served += is_served ? 1 : 0;
    EXPECT_TRUE(is_served || DetailsOf(status).reason == "DISK_FULL") << status.error_message();
  }
  EXPECT_GE(served, MaxWrittenFiles(kLimit));
  // The others go on, and the server as well.
  for (const std::string& name : names) {
    EXPECT_EQ(calls.Upload(name, 0, UniformPoints(OpenUpload::kPoints, 3, 1)).committed_points(), OpenUpload::kPoints);
  }
  EXPECT_EQ(MeshTriangle(first), absl::OkStatus());
  daemon.Stop();
  EXPECT_THAT(folder.Read("log"), Not(HasSubstr("store_failed")));
}

// A file that must not grow further is a full disk: its server reads on, and says so.
TEST(DurableFileDescriptors, AFileThatMustNotGrowIsAFullDisk) {
  const TemporaryFolder folder;
  Daemon daemon({"--data", folder.Path("data")}, folder.Path("log"),
                AfterShell("ulimit -f 40960"));  // blocks of 512 bytes
  SessionCalls calls(grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
  const std::string name = calls.Create().name();
  constexpr uint64_t kPiece = 100'000;
  constexpr uint64_t kPoints = 10 * kPiece;  // 24 MB, where 21 go
  std::vector<v1::UploadPointsRequest> requests;
  for (uint64_t first = 0; first < kPoints; first += kPiece) {
    requests.push_back(UploadRequest(name, first, UniformPoints(kPiece, 3, first)));
  }
  grpc::Status status;
  calls.Upload(requests, &status);
  EXPECT_EQ(DetailsOf(status).reason, "DISK_FULL") << status.error_message();
  EXPECT_LT(calls.Get(name).committed_points(), kPoints);
  // A request that fits is taken when it is sent again.
  EXPECT_GE(calls.Upload({requests[0]}).committed_points(), kPiece);
  daemon.Stop();
  EXPECT_THAT(folder.Read("log"), Not(HasSubstr("store_failed")));
}

}  // namespace
}  // namespace wellspace::server
