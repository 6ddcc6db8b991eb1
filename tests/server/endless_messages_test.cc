// Messages that announce a gigabyte and come, to the real server, from callers whom it does not know: gRPC would have
// all of such a message before it looks at its length, and before the server looks at the caller.
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "server/base/options.h"
#include "server/security/tokens.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_http2.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kMaxMemoryBytes = kMinMemoryBytes;
constexpr uint64_t kMostReceived = kLeastReceivedBytes + (64 << 20);  // gRPC looks now and then
// The thread that ends a call waits for its turn, and on a busy machine the other connections are read meanwhile; and
// memory of a call is given back while the next one is read. Far less than what they announce, or than kMostReceived of
// each.
constexpr uint64_t kMostReceivedOfMany = 2 * kLeastReceivedBytes;
constexpr uint32_t kAnnounced = uint32_t{1} << 30;

class EndlessMessages : public ::testing::Test {
 protected:
  EndlessMessages() {
    const std::string tokens = folder_.Write("tokens", *MakeTokenLine("acme", token_));
    daemon_ = std::make_unique<Daemon>(
        std::vector<std::string>{"--token-file", tokens, "--max-memory", absl::StrCat(kMaxMemoryBytes)});
  }

  ~EndlessMessages() override {
    EXPECT_EQ(MeshTriangle(daemon_->Client({.token = token_})), absl::OkStatus());
    daemon_->Stop();
  }

  // No job runs: all memory of the server is held by gRPC.
  void ExpectReceivedAtMost([[maybe_unused]] uint64_t bytes) const {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    EXPECT_LT(daemon_->process().PeakMemory(), kMaxMemoryBytes + bytes);
#endif
  }

  const std::string token_ = std::string(40, 't');
  TemporaryFolder folder_;
  std::unique_ptr<Daemon> daemon_;
};

// The service and method of a call whose request is one message.
class EndlessMessagesOfOneCall : public EndlessMessages, public ::testing::WithParamInterface<const char*> {};

TEST_P(EndlessMessagesOfOneCall, EndIt) {
  RawConnection connection(daemon_->address());
  EXPECT_LE(connection.SendMessageUntilRefused(GetParam(), kAnnounced), kMostReceived);
  ExpectReceivedAtMost(kMostReceived);
}

INSTANTIATE_TEST_SUITE_P(All, EndlessMessagesOfOneCall,
                         ::testing::Values("/wellspace.v1.SessionService/GetSession",
                                           "/wellspace.v1.SessionService/DownloadMesh", "/grpc.health.v1.Health/Check",
                                           "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"),
                         [](const auto& test) {
                           const std::string path = test.param;
                           return path.substr(path.rfind('/') + 1);
                         });

TEST_F(EndlessMessages, OneAfterTheOtherDoNotAddUp) {
  for (int i = 0; i < 4; ++i) {
    RawConnection connection(daemon_->address());
    EXPECT_LE(connection.SendMessageUntilRefused("/wellspace.v1.SessionService/GetSession", kAnnounced), kMostReceived);
  }
  ExpectReceivedAtMost(kMostReceivedOfMany);
}

TEST_F(EndlessMessages, OfCallsWhoseRequestIsAStreamAreReadForAWindowOnly) {
  for (const std::string path :
       {"/wellspace.v1.SessionService/UploadPoints", "/wellspace.v1.MeshingService/MeshPoints"}) {
    RawConnection connection(daemon_->address());
    EXPECT_LE(connection.SendMessageUntilRefused(path, kAnnounced), kMaxMemoryBytes / 4) << path;
  }
  ExpectReceivedAtMost(kMostReceived);
}

TEST_F(EndlessMessages, OfManyConnectionsShareTheLimit) {
  constexpr int kConnections = 8;
  std::vector<std::thread> senders;
  for (int i = 0; i < kConnections; ++i) {
    senders.emplace_back([&] {
      RawConnection connection(daemon_->address());
      EXPECT_LE(connection.SendMessageUntilRefused("/wellspace.v1.SessionService/GetSession", kAnnounced),
                kMostReceived);
    });
  }
  for (std::thread& sender : senders) {
    sender.join();
  }
  ExpectReceivedAtMost(kMostReceivedOfMany);
}

}  // namespace
}  // namespace wellspace::server
