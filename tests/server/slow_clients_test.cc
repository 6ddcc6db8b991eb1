// The real server among many clients that begin and never finish ("slow loris"): it serves the others meanwhile, and
// lets go in the end.
#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_http2.h"
#include "tests/server/service_methods.h"

namespace wellspace::server {
namespace {

constexpr char kMesh[] = "/wellspace.v1.MeshingService/MeshPoints";

class SlowClients : public ::testing::Test {
 protected:
  // Starts the server with `flags`.
  void Start(std::vector<std::string> flags) { daemon_ = std::make_unique<Daemon>(std::move(flags)); }

  ~SlowClients() override {
    connections_.clear();
    if (daemon_ != nullptr) {
      daemon_->Stop();
    }
  }

  // One more connection, on which `bytes` have been sent.
  RawConnection& Send(const std::string& bytes) {
    connections_.emplace_back(daemon_->address());
    EXPECT_TRUE(connections_.back().Send(bytes));
    return connections_.back();
  }

  // Expects a client that behaves to be served.
  void ExpectServing() { EXPECT_EQ(MeshTriangle(daemon_->Client()), absl::OkStatus()); }

  std::unique_ptr<Daemon> daemon_;
  std::vector<RawConnection> connections_;
};

TEST_F(SlowClients, ThatNeverFinishTheBeginningAreClosed) {
  constexpr int kClients = 200;
  Start({"--handshake-timeout", "2"});
  const std::string start = ConnectionStart();
  for (int i = 0; i < kClients; ++i) {
    Send(start.substr(0, i % start.size()));  // nothing, some bytes, almost all of it
  }
  ExpectServing();
  for (RawConnection& connection : connections_) {
    EXPECT_TRUE(connection.IsClosedByServer());
  }
  ExpectServing();
}

TEST_F(SlowClients, ThatGoByteByByteAreClosedAllTheSame) {
  Start({"--handshake-timeout", "1"});
  const std::string start = ConnectionStart();
  RawConnection& slow = Send("");
  for (size_t i = 0; i + 1 < start.size() && slow.Send(start.substr(i, 1)); ++i) {
    absl::SleepFor(absl::Milliseconds(100));  // this makes it slow
  }
  EXPECT_TRUE(slow.IsClosedByServer());
  ExpectServing();
}

TEST_F(SlowClients, WithoutCallsAreClosed) {
  constexpr int kClients = 100;
  Start({"--max-connection-idle", "1"});
  for (int i = 0; i < kClients; ++i) {
    Send(ConnectionStart());
  }
  ExpectServing();
  for (RawConnection& connection : connections_) {
    // First it is told that the server takes no more calls on it.
    EXPECT_TRUE(connection.ReadUntil(Frame::kGoaway).has_value());
  }
  ExpectServing();
}

TEST_F(SlowClients, InTheMiddleOfHeadersOrMessagesHoldUpNoOther) {
  constexpr int kRounds = 10;
  Start({});
  for (int round = 0; round < kRounds; ++round) {
    for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
      Frame headers = BeginCall(1, PathOf(*method));
      // Within the frame of headers, after headers that go on, within the frame of a message, within the message.
      switch (connections_.size() % 4) {
        case 0:
          Send(ConnectionStart() + headers.Serialize().substr(0, 20));
          break;
        case 1:
          headers.flags = 0;
          Send(ConnectionStart() + headers.Serialize());
          break;
        case 2:
          Send(ConnectionStart() + headers.Serialize() +
               Frame{.type = Frame::kData, .stream = 1, .payload = std::string("\0\0", 2)}.Serialize());
          break;
        default:
          Send(ConnectionStart() + headers.Serialize() +
               Frame{.type = Frame::kData, .stream = 1, .payload = GrpcMessage("abc", 1000)}.Serialize());
      }
    }
  }
  EXPECT_GE(connections_.size(), 190u);
  ExpectServing();
  // None of them has a job, and those that go leave nothing behind.
  EXPECT_EQ(daemon_->Client().GetServerInfo()->running_jobs, 0);
  connections_.clear();
  ExpectServing();
}

TEST_F(SlowClients, OfOneConnectionHaveAsManyCallsAsAreAllowed) {
  constexpr uint32_t kCalls = 50;
  Start({"--max-streams", "10"});
  RawConnection& connection = Send("");
  ASSERT_TRUE(connection.Begin());
  // The server has said how many it takes; who sends more all the same is sent away.
  std::string calls;
  for (uint32_t i = 0; i < kCalls; ++i) {
    calls += BeginCall(2 * i + 1, kMesh).Serialize();
  }
  connection.Send(calls);
  EXPECT_TRUE(connection.IsClosedByServer());
  ExpectServing();
}

}  // namespace
}  // namespace wellspace::server
