// The real server among clients that speak HTTP/2 badly on purpose: it closes bad connections, and serves all
// others.
#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "grpcpp/support/status.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_http2.h"

namespace wellspace::server {
namespace {

constexpr char kInfo[] = "/wellspace.v1.MeshingService/GetServerInfo";
constexpr char kMesh[] = "/wellspace.v1.MeshingService/MeshPoints";

// One server for all tests of this program's run; after each it still meshes.
class MalformedHttp2 : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { daemon_ = std::make_unique<Daemon>(); }
  static void TearDownTestSuite() {
    if (daemon_ != nullptr) {
      daemon_->Stop();
    }
    daemon_.reset();
  }

  ~MalformedHttp2() override { EXPECT_EQ(MeshTriangle(daemon_->Client()), absl::OkStatus()); }

  static RawConnection Connect() { return RawConnection(daemon_->address()); }
  static RawConnection Begin() {
    RawConnection connection = Connect();
    EXPECT_TRUE(connection.Begin());
    return connection;
  }

  // Whether the server closes the connection on which it is sent `bytes` after a right beginning.
  static bool Closes(const std::string& bytes) {
    RawConnection connection = Begin();
    connection.Send(bytes);
    return connection.IsClosedByServer();
  }
  static bool Closes(const Frame& frame) { return Closes(frame.Serialize()); }

  static std::unique_ptr<Daemon> daemon_;
};

std::unique_ptr<Daemon> MalformedHttp2::daemon_;

// Headers of a call that end with `bytes`.
Frame HeadersWith(const std::string& bytes) {
  Frame frame = BeginCall(1, kInfo);
  frame.payload += bytes;
  return frame;
}

TEST_F(MalformedHttp2, ByHandIsUnderstoodWhenItIsRight) {
  RawConnection connection = Begin();
  connection.Send(BeginCall(1, kInfo));
  connection.Send(Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = 1, .payload = GrpcMessage("")});
  EXPECT_EQ(connection.ReadStatus(1), 0);
  EXPECT_TRUE(connection.IsAlive());
}

TEST_F(MalformedHttp2, WhatIsNoHttp2IsClosed) {
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"), std::string(1000, '\0'), std::string(1000, '\xff'),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11),  // how TLS begins
        std::string("PRI * HTTP/2.0\r\n\r\nXX\r\n\r\n"), std::string("SSH-2.0-OpenSSH_9.2\r\n")}) {
    RawConnection connection = Connect();
    connection.Send(bytes);
    EXPECT_TRUE(connection.IsClosedByServer()) << bytes.substr(0, 24);
  }
}

TEST_F(MalformedHttp2, AfterThePrefaceSettingsHaveToCome) {
  const std::string preface = ConnectionStart().substr(0, ConnectionStart().size() - Frame().Serialize().size());
  for (const std::string& bytes : {std::string(100, '\0'), std::string(100, '\xff'), BeginCall(1, kInfo).Serialize(),
                                   Frame{.type = Frame::kPing, .payload = std::string(8, 'p')}.Serialize()}) {
    RawConnection connection = Connect();
    connection.Send(preface + bytes);
    EXPECT_TRUE(connection.IsClosedByServer());
  }
}

TEST_F(MalformedHttp2, FramesOfAWrongSizeEndTheConnection) {
  // Larger than the two have agreed on: it is refused by its length, before it has come.
  EXPECT_TRUE(Closes(std::string("\xff\xff\xff\x00\x00\x00\x00\x00\x01", 9)));
  EXPECT_TRUE(Closes(std::string("\xff\xff\xff\x77\x00\x00\x00\x00\x00", 9)));
  EXPECT_TRUE(Closes(Frame{.type = Frame::kPing, .payload = "short"}));
  EXPECT_TRUE(Closes(Frame{.type = Frame::kSettings, .payload = std::string(7, '\0')}));
  EXPECT_TRUE(Closes(Frame{.type = Frame::kSettings, .flags = Frame::kAck, .payload = std::string(6, '\0')}));
  EXPECT_TRUE(Closes(Frame{.type = Frame::kWindowUpdate, .payload = "abc"}));
  EXPECT_TRUE(Closes(Frame{.type = Frame::kGoaway, .payload = "abc"}));
  EXPECT_TRUE(Closes(BeginCall(1, kMesh).Serialize() +
                     Frame{.type = Frame::kRstStream, .stream = 1, .payload = "abc"}.Serialize()));
}

TEST_F(MalformedHttp2, SettingsThatCannotBeEndTheConnection) {
  constexpr char kWindow[] = "\x00\x04";
  constexpr char kFrameSize[] = "\x00\x05";
  const auto settings = [](const char* id, uint32_t value) {
    return Frame{.type = Frame::kSettings, .payload = std::string(id, 2) + BigEndian(value)};
  };
  EXPECT_TRUE(Closes(settings(kWindow, 0xffffffff)));
  EXPECT_TRUE(Closes(settings(kFrameSize, 1)));
  EXPECT_TRUE(Closes(settings(kFrameSize, 0xffffffff)));
}

TEST_F(MalformedHttp2, HeadersThatCannotBeDecodedHarmNoOther) {
  int closed = 0;
  for (const std::string& hpack :
       {std::string("\x80", 1),                                  // the entry 0
        std::string("\xff\xff\xff\xff\x7f", 5),                  // an entry that was never made
        std::string("\xff\xff\xff\xff\xff\xff\xff\xff", 8),      // a number without end
        std::string("\x3f\xff\xff\xff\x7f", 5),                  // a table of half a gigabyte
        std::string("\x00\x7f\xff\xff\xff\x7f", 6),              // a name of half a gigabyte
        std::string("\x00\x01", 2),                              // that ends within a name
        std::string("\x00\x85\xff\xff\xff\xff\xff\x01x", 9)}) {  // Huffman's code with the end within
    RawConnection connection = Begin();
    connection.Send(HeadersWith(hpack));
    connection.Send(Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = 1, .payload = GrpcMessage("")});
    // gRPC may forgive some of these. Most of them end the connection.
    ++closed;
    closed -= connection.IsAlive() ? 1 : 0;
  }
  EXPECT_GE(closed, 3);
}

TEST_F(MalformedHttp2, HeadersThatMustNotBeSentHarmNoOther) {
  for (const std::string& header :
       {Header("Upper-Case", "x"), Header("with\nnewline", "x"), Header("x", std::string("a\0b", 3)),
        Header("", "no name"), Header(":path", "twice"), Header(":unknown", "x"), Header("grpc-timeout", "forever"),
        Header("grpc-encoding", "nonsense"), Header("content-length", "-1"), Header("binary-bin", "!!!"),
        Header("te", "gzip"), Header("host", std::string(300, 'h'))}) {
    RawConnection connection = Begin();
    connection.Send(HeadersWith(header));
    connection.Send(Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = 1, .payload = GrpcMessage("")});
    connection.IsAlive();
  }
}

TEST_F(MalformedHttp2, MetadataWithoutEndIsRefused) {
  std::string headers;
  for (int i = 0; i < 16; ++i) {
    headers += Header(absl::StrCat("x-", i), std::string(1000, 'x'));
  }
  RawConnection connection = Begin();
  connection.Send(HeadersWith(headers).Serialize());
  connection.Send(Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = 1, .payload = GrpcMessage("")});
  EXPECT_EQ(connection.ReadStatus(1), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(MalformedHttp2, HeadersInPiecesWithoutEndAreWaitedForAtNoOthersCost) {
  Frame first = BeginCall(1, kInfo);
  first.flags = 0;
  RawConnection waiting = Begin();
  waiting.Send(first);
  for (int i = 0; i < 100; ++i) {
    waiting.Send(Frame{.type = Frame::kContinuation, .stream = 1, .payload = Header("x", std::string(100, 'x'))});
  }
  EXPECT_TRUE(Begin().IsAlive());
}

TEST_F(MalformedHttp2, FramesOutOfOrderEndTheConnection) {
  const Frame continuation = {.type = Frame::kContinuation, .flags = Frame::kEndHeaders, .stream = 1};
  EXPECT_TRUE(Closes(continuation));
  EXPECT_TRUE(Closes(BeginCall(1, kMesh).Serialize() + continuation.Serialize()));
  Frame unfinished = BeginCall(1, kInfo);
  unfinished.flags = 0;
  const Frame ping = {.type = Frame::kPing, .payload = std::string(8, 'p')};
  EXPECT_TRUE(Closes(unfinished.Serialize() + ping.Serialize()));
  Frame of_another = continuation;
  of_another.stream = 3;
  EXPECT_TRUE(Closes(unfinished.Serialize() + of_another.Serialize()));
}

TEST_F(MalformedHttp2, StreamsThatCannotBeHarmNoOther) {
  for (const uint32_t stream : {0u, 2u, 0x7ffffffeu}) {
    RawConnection connection = Begin();
    connection.Send(BeginCall(stream, kInfo));
    connection.Send(
        Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = stream, .payload = GrpcMessage("")});
    connection.IsAlive();
  }
  // Of calls that there are not, or not any more.
  RawConnection connection = Begin();
  connection.Send(Frame{.type = Frame::kData, .stream = 9, .payload = "data"});
  connection.Send(ResetCall(11));
  connection.Send(Frame{.type = Frame::kWindowUpdate, .stream = 13, .payload = BigEndian(1)});
  connection.Send(BeginCall(15, kInfo));
  connection.Send(ResetCall(15));
  connection.Send(Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = 15, .payload = GrpcMessage("")});
  EXPECT_TRUE(connection.IsAlive());
}

TEST_F(MalformedHttp2, FramesOfUnknownTypesAreLeftOut) {
  RawConnection connection = Begin();
  for (int type = 10; type < 256; ++type) {
    connection.Send(Frame{.type = static_cast<uint8_t>(type), .flags = 0xff, .stream = 1, .payload = "whatever"});
  }
  EXPECT_TRUE(connection.IsAlive());
}

TEST_F(MalformedHttp2, AWindowThatOverflowsEndsTheConnectionOrTheCall) {
  const std::string most = BigEndian(0x7fffffff);
  RawConnection whole = Begin();
  whole.Send(BeginCall(1, kMesh));
  for (int i = 0; i < 4; ++i) {
    whole.Send(Frame{.type = Frame::kWindowUpdate, .payload = most});
    whole.Send(Frame{.type = Frame::kWindowUpdate, .stream = 1, .payload = most});
  }
  // gRPC counts in 64 bits and goes on.
  whole.IsAlive();
  EXPECT_TRUE(Closes(Frame{.type = Frame::kWindowUpdate, .payload = BigEndian(0)}));
}

TEST_F(MalformedHttp2, DataBeyondTheWindowEndTheConnection) {
  constexpr uint32_t kAnnounced = uint32_t{1} << 30;
  const std::string piece = Frame{.type = Frame::kData, .stream = 1, .payload = std::string(16384, 'x')}.Serialize();
  RawConnection connection = Begin();
  connection.Send(BeginCall(1, kMesh));
  connection.Send(Frame{.type = Frame::kData, .stream = 1, .payload = GrpcMessage("", kAnnounced)});
  uint64_t sent = 0;
  // At once, or, when the end of the call comes between, after a ping that is not answered.
  while (sent < kAnnounced && connection.Send(piece)) {
    sent += piece.size();
  }
  EXPECT_LT(sent, kAnnounced);
}

TEST_F(MalformedHttp2, CallsThatAreResetAtOnceCostNothingLasting) {
  RawConnection connection = Begin();
  uint32_t stream = 1;
  for (int round = 0; round < 100; ++round) {
    std::string bytes;
    for (int i = 0; i < 100; ++i, stream += 2) {
      bytes += BeginCall(stream, kMesh).Serialize() + ResetCall(stream).Serialize();
    }
    if (!connection.Send(bytes)) {
      break;  // the server had enough of it
    }
  }
  client::Client other = daemon_->Client();
  const absl::StatusOr<client::ServerInfo> info = other.GetServerInfo();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->running_jobs + info->queued_jobs, 0);
}

TEST_F(MalformedHttp2, APeerThatPingsWithoutEndIsSentAway) {
  RawConnection connection = Begin();
  std::string pings;
  for (int i = 0; i < 1000; ++i) {
    pings += Frame{.type = Frame::kPing, .payload = std::string(8, 'p')}.Serialize();
  }
  connection.Send(pings);
  EXPECT_TRUE(connection.ReadUntil(Frame::kGoaway).has_value());
  EXPECT_TRUE(connection.IsClosedByServer());
}

TEST_F(MalformedHttp2, SettingsWithoutEndAreAnsweredOrSentAway) {
  RawConnection connection = Begin();
  std::string settings;
  for (int i = 0; i < 10'000; ++i) {
    settings += Frame{.type = Frame::kSettings, .payload = std::string("\x00\x04", 2) + BigEndian(65535)}.Serialize();
  }
  connection.Send(settings);
  EXPECT_TRUE(connection.ReadUntil(Frame::kSettings).has_value());
}

}  // namespace
}  // namespace wellspace::server
