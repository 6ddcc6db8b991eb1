// The real server among peers that send endless frames without cost: it shuts them, stays small, and serves all
// others. And among peers that send much useful data, of which it shuts none. WELLSPACE_FLOOD_SECONDS says how
// long each flood lasts, on new connections; 0: until the first is shut.
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/http_get.h"
#include "tests/server/observer.h"
#include "tests/server/raw_call.h"
#include "tests/server/raw_http2.h"
#include "tests/server/security/certificates.h"
#include "tests/server/service_methods.h"
#include "tests/server/session_calls.h"
#include "tests/support/amount.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

const absl::Duration kFlood = absl::Seconds(test::Amount("WELLSPACE_FLOOD_SECONDS", 0));
[[maybe_unused]] constexpr uint64_t kMostMemory = uint64_t{200} << 20;
// gRPC 1.51 makes 70 bytes of each byte that names a header, of which a connection may send 4.5 MiB before it is shut:
// 320 MB on a quiet machine, and more where it is looked at late.
[[maybe_unused]] constexpr uint64_t kMostMemoryOfNamedHeaders = uint64_t{1} << 30;
constexpr int kPatienceSeconds = 5;
[[maybe_unused]] constexpr absl::Duration kServedWithin = absl::Seconds(1);
// Of one connection, with bytes that wait in the buffers of the system. Far more, and it is not shut.
constexpr uint64_t kMostSent = uint64_t{512} << 20;

constexpr char kMesh[] = "/wellspace.v1.MeshingService/MeshPoints";

struct Kind {
  const char* name;
  std::string start;  // behind the start of the connection
  Frame frame;        // again and again
  uint64_t most_memory = kMostMemory;
};

// Headers of a call whose end does not come.
std::string UnfinishedHeaders(const std::string& more = "") {
  Frame frame = BeginCall(1, kMesh);
  frame.flags = 0;
  frame.payload += more;
  return frame.Serialize();
}

const std::vector<Kind>& Kinds() {
  static const std::string call = BeginCall(1, kMesh).Serialize();
  static const std::vector<Kind> kinds = {
      {"WindowUpdate", "", {.type = Frame::kWindowUpdate, .payload = BigEndian(1)}},
      {"WindowUpdateOfACall", call, {.type = Frame::kWindowUpdate, .stream = 1, .payload = BigEndian(1)}},
      {"EmptySettings", "", {.type = Frame::kSettings}},
      {"Settings", "", {.type = Frame::kSettings, .payload = std::string("\0\4", 2) + BigEndian(65535)}},
      {"SettingsAck", "", {.type = Frame::kSettings, .flags = Frame::kAck}},
      {"Priority", "", {.type = Frame::kPriority, .stream = 1, .payload = std::string(5, '\0')}},
      {"Ping", "", {.type = Frame::kPing, .payload = "whatever"}},
      {"PingAck", "", {.type = Frame::kPing, .flags = Frame::kAck, .payload = "whatever"}},
      {"EmptyData", call, {.type = Frame::kData, .stream = 1}},
      {"EmptyDataOfNoCall", "", {.type = Frame::kData, .stream = 9}},
      {"ResetOfNoCall", "", {.type = Frame::kRstStream, .stream = 9, .payload = BigEndian(8)}},
      {"Continuation",
       UnfinishedHeaders(),
       {.type = Frame::kContinuation, .stream = 1, .payload = Header("x", std::string(100, 'x'))}},
      // Each byte names a header of the table, and becomes 70 bytes of memory.
      {"IndexedContinuation",
       UnfinishedHeaders(std::string("\x40\1a\1a", 5)),
       {.type = Frame::kContinuation, .stream = 1, .payload = std::string(200, '\xbe')},
       kMostMemoryOfNamedHeaders},
      {"EmptyContinuation", UnfinishedHeaders(), {.type = Frame::kContinuation, .stream = 1}},
      {"Unknown", "", {.type = 99}},
      {"LargeUnknown", "", {.type = 99, .payload = std::string(16384, 'x')}},
  };
  return kinds;
}

struct Flooded {
  uint64_t bytes = 0;     // that were sent
  bool is_stuck = false;  // the server took no more, and had not closed the connection
};

// Sends the frames of `kind` as fast as they are taken. Ends when the server closes the connection or takes no more, or
// `end` has come. The answers are read, or not.
Flooded Flood(const std::string& address, const Kind& kind, bool reads, absl::Time end) {
  constexpr size_t kPiece = size_t{256} << 10;
  RawConnection connection(address);
  connection.SetPatience(kPatienceSeconds);
  std::string piece;
  while (piece.size() < kPiece) {
    piece += kind.frame.Serialize();
  }
  uint64_t sent = 0;
  bool is_open = connection.Send(ConnectionStart() + Frame{.type = Frame::kSettings, .flags = Frame::kAck}.Serialize() +
                                 kind.start);
  while (is_open && sent < kMostSent && absl::Now() < end) {
    is_open = connection.Send(piece);
    sent += piece.size();
    if (reads) {
      connection.Discard();
    }
  }
  return {sent, connection.is_stuck()};
}

class CostlessFrames : public ::testing::TestWithParam<std::tuple<size_t, const char*, bool>> {};

TEST_P(CostlessFrames, AreCutOff) {
  const auto& [number, max_memory, reads] = GetParam();
  const Kind& kind = Kinds()[number];
  std::vector<std::string> arguments = {"--metrics-listen", "127.0.0.1:0"};
  if (std::string(max_memory) != "default") {
    arguments.insert(arguments.end(), {"--max-memory", max_memory});
  }
  const TemporaryFolder folder;
  Daemon daemon(arguments, folder.Path("log"));
  const std::string line = daemon.process().ReadLine();
  const std::string metrics = line.substr(line.rfind(' ') + 1);
  client::Client client = daemon.Client();
  ASSERT_TRUE(client.GetServerInfo().ok());
  Observer observer(client);
  const absl::Time end = kFlood > absl::ZeroDuration() ? absl::Now() + kFlood : absl::InfiniteFuture();
  bool is_stuck = false;
  do {
    const Flooded flooded = Flood(daemon.address(), kind, reads, end);
    EXPECT_LT(flooded.bytes, kMostSent);
    is_stuck = is_stuck || flooded.is_stuck;
  } while (absl::Now() < end && kFlood > absl::ZeroDuration() && !HasFailure());
  [[maybe_unused]] const absl::Duration longest = observer.Stop();
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(longest, kServedWithin);
  EXPECT_LT(daemon.process().PeakMemory(), kind.most_memory);
#endif
  EXPECT_EQ(MeshTriangle(daemon.Client()), absl::OkStatus());
  // gRPC itself sends away who pings, and reads no more of a peer who does not read its answers.
  EXPECT_TRUE(MetricAt(metrics, "wellspace_connections_shut_total") > 0 || is_stuck ||
              std::string(kind.name) == "Ping");
  daemon.Stop();
}

INSTANTIATE_TEST_SUITE_P(All, CostlessFrames,
                         ::testing::Combine(::testing::Range(size_t{0}, Kinds().size()),
                                            ::testing::Values("600MB", "default"), ::testing::Bool()),
                         [](const auto& test) {
                           return absl::StrCat(Kinds()[std::get<0>(test.param)].name, "At", std::get<1>(test.param),
                                               std::get<2>(test.param) ? "Read" : "Unread");
                         });

// Bytes that are held back on many connections, each of which has less than the limit.
TEST(CostlessFramesOfMany, AreCutOffTogether) {
  constexpr uint64_t kEach = uint64_t{400} << 10;
  constexpr int kConnections = 40;
  const Frame more = {.type = Frame::kContinuation, .stream = 1, .payload = Header("x", std::string(1000, 'x'))};
  Daemon daemon({"--metrics-listen", "127.0.0.1:0"});
  const std::string line = daemon.process().ReadLine();
  std::vector<RawConnection> connections;
  std::string bytes = ConnectionStart() + UnfinishedHeaders();
  while (bytes.size() < kEach) {
    bytes += more.Serialize();
  }
  for (int i = 0; i < kConnections; ++i) {
    connections.emplace_back(daemon.address()).Send(bytes);
  }
  constexpr int kMayStay = 10;  // of 400 KiB each, of 4 MiB
  const absl::Time end = absl::Now() + absl::Minutes(1);
  double shut = 0;
  while (shut < kConnections - kMayStay && absl::Now() < end) {
    shut = MetricAt(line.substr(line.rfind(' ') + 1), "wellspace_connections_shut_total");
  }
  EXPECT_GE(shut, kConnections - kMayStay);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(daemon.process().PeakMemory(), kMostMemory);
#endif
  EXPECT_EQ(MeshTriangle(daemon.Client()), absl::OkStatus());
  daemon.Stop();
}

// After each test no connection was shut, and all bytes are claimed but for a few.
class WhatIsWanted : public ::testing::Test {
 protected:
  void SetUp() override { Start({}); }

  void Start(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--metrics-listen", "127.0.0.1:0"});
    daemon_ = std::make_unique<Daemon>(arguments, folder_.Path("log"));
    const std::string line = daemon_->process().ReadLine();
    metrics_ = line.substr(line.rfind(' ') + 1);
  }

  void TearDown() override {
    constexpr double kFew = 4096;  // of connections that are open
    const absl::Time end = absl::Now() + absl::Minutes(1);
    double unclaimed = MetricAt(metrics_, "wellspace_unclaimed_bytes");
    while (unclaimed > kFew && absl::Now() < end) {
      unclaimed = MetricAt(metrics_, "wellspace_unclaimed_bytes");
    }
    EXPECT_GE(unclaimed, 0);
    EXPECT_LE(unclaimed, kFew);
    EXPECT_EQ(MetricAt(metrics_, "wellspace_connections_shut_total"), 0) << folder_.Read("log");
    daemon_->Stop();
  }

  std::shared_ptr<grpc::Channel> Channel() const {
    return grpc::CreateChannel(daemon_->address(), grpc::InsecureChannelCredentials());
  }

  // A request of as many bytes as may be; sent again, it changes nothing.
  static v1::UploadPointsRequest LargeRequest(const std::string& session) {
    constexpr size_t kPoints = 174'000;  // of 24 bytes
    return UploadRequest(session, 0, UniformPoints(kPoints, 3, 1));
  }

  const TemporaryFolder folder_;
  std::unique_ptr<Daemon> daemon_;
  std::string metrics_;
};

TEST_F(WhatIsWanted, RequestsOfEveryMethodAre) {
  constexpr size_t kBytes = 1'000'000;
  // A field that no message has: number 1000, of so many bytes.
  const std::string request = std::string("\xc2\x3e\xc0\x84\x3d", 5) + std::string(kBytes, 'x');
  const auto channel = Channel();
  for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
    for (int i = 0; i < 2; ++i) {
      CallUnary(channel, PathOf(*method), request);
    }
  }
}

TEST_F(WhatIsWanted, ManyLargeUploadsAtOnceAre) {
  constexpr int kUploads = 8;
  constexpr int kMessages = 16;
  const auto channel = Channel();
  std::vector<std::thread> clients;
  for (int i = 0; i < kUploads; ++i) {
    clients.emplace_back([&] {
      SessionCalls calls(channel);
      const v1::UploadPointsRequest request = LargeRequest(calls.Create().name());
      const std::vector<v1::UploadPointsRequest> requests(kMessages, request);
      EXPECT_EQ(calls.Upload(requests).committed_points() * 3,
                static_cast<uint64_t>(request.points().coordinates_size()));
    });
  }
  for (std::thread& client : clients) {
    client.join();
  }
}

TEST_F(WhatIsWanted, UploadsThatAreCancelledWithinAMessageAre) {
  constexpr int kUploads = 60;
  SessionCalls calls(Channel());
  const v1::UploadPointsRequest request = LargeRequest(calls.Create().name());
  for (int i = 0; i < kUploads; ++i) {
    grpc::ClientContext context;
    v1::UploadPointsResponse response;
    const auto stream = calls.sessions().UploadPoints(&context, &response);
    stream->Write(request);
    context.TryCancel();
    EXPECT_FALSE(stream->Finish().ok());
  }
  calls.Get(request.name());
}

// As for a session that is no more: the client sends its data until it hears of the end.
TEST_F(WhatIsWanted, UploadsThatTheServerEndsAre) {
  constexpr int kUploads = 60;
  SessionCalls calls(Channel());
  const v1::UploadPointsRequest request = LargeRequest("sessions/none");
  for (int i = 0; i < kUploads; ++i) {
    grpc::Status status;
    calls.Upload(std::vector<v1::UploadPointsRequest>(4, request), &status);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  }
}

// Some stacks open both windows for every frame, and ping between.
TEST_F(WhatIsWanted, WindowsAndPingsOfADownloadAre) {
  constexpr int kDownloads = 20;
  SessionClient session(Channel());
  session.Upload(UniformPoints(5000, 3, 1));
  session.Refine();
  v1::DownloadMeshRequest request;
  request.set_name(session.name());
  RawConnection connection(daemon_->address());
  ASSERT_TRUE(connection.Begin());
  for (uint32_t stream = 1; stream < 2 * kDownloads; stream += 2) {
    connection.Send(BeginCall(stream, "/wellspace.v1.SessionService/DownloadMesh").Serialize() +
                    Frame{.type = Frame::kData,
                          .flags = Frame::kEndStream,
                          .stream = stream,
                          .payload = GrpcMessage(request.SerializeAsString())}
                        .Serialize());
    bool has_ended = false;
    while (!has_ended) {
      const std::optional<Frame> frame = connection.Read();
      ASSERT_TRUE(frame.has_value());
      if (frame->type == Frame::kData && !frame->payload.empty()) {
        const std::string opened = BigEndian(static_cast<uint32_t>(frame->payload.size()));
        connection.Send(Frame{.type = Frame::kWindowUpdate, .payload = opened}.Serialize() +
                        Frame{.type = Frame::kWindowUpdate, .stream = stream, .payload = opened}.Serialize());
      } else if (frame->type == Frame::kPing && (frame->flags & Frame::kAck) == 0) {
        connection.Send(Frame{.type = Frame::kPing, .flags = Frame::kAck, .payload = frame->payload});
      }
      has_ended = (frame->flags & Frame::kEndStream) != 0 && frame->stream == stream &&
                  (frame->type == Frame::kData || frame->type == Frame::kHeaders);
    }
  }
}

class WhatIsWantedByTls : public WhatIsWanted {
 protected:
  void SetUp() override {
    const CertificateFiles server = authority_.Issue("server");
    Start({"--tls-cert", server.certificate, "--tls-key", server.key});
  }

  std::shared_ptr<grpc::Channel> Channel() const {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = folder_.Read("authority.pem");
    return grpc::CreateChannel(daemon_->address(), grpc::SslCredentials(options));
  }

  const Authority authority_{folder_, "authority"};
};

TEST_F(WhatIsWantedByTls, LargeMessagesAndSmallOnesAre) {
  SessionCalls calls(Channel());
  const v1::UploadPointsRequest large = LargeRequest(calls.Create().name());
  calls.Upload(std::vector<v1::UploadPointsRequest>(16, large));
  const v1::UploadPointsRequest small =
      UploadRequest(large.name(), 0, {large.points().coordinates().begin(), large.points().coordinates().begin() + 3});
  calls.Upload(std::vector<v1::UploadPointsRequest>(10'000, small));
  for (int i = 0; i < 1000; ++i) {
    calls.Get(large.name());
  }
}

}  // namespace
}  // namespace wellspace::server
