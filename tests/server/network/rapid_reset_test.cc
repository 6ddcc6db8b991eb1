// The real server among peers that begin calls only to give them up, as fast as they can: its memory stays small,
// others are served, and soon it is as if nothing had been. The environment may ask for more calls: WELLSPACE_STREAMS.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/http_get.h"
#include "tests/server/observer.h"
#include "tests/server/raw_http2.h"
#include "tests/support/amount.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

const int kStreams = test::Amount("WELLSPACE_STREAMS", 6'000);
constexpr int kStreamsASecond = 24'000;
constexpr int kBatch = 100;
[[maybe_unused]] constexpr uint64_t kMostMemory = uint64_t{200} << 20;
constexpr absl::Duration kServedWithin = absl::Seconds(1);
constexpr absl::Duration kIdleAgainWithin = absl::Seconds(5);

// The headers of a call in a few bytes: the first time they enter the table of HPACK, later they are named by their
// places there.
std::string CompactHeaders(const std::string& path, bool is_first) {
  const std::vector<std::pair<std::string, std::string>> headers = {
      {":method", "POST"},         {":scheme", "http"}, {":path", path},
      {":authority", "localhost"}, {"te", "trailers"},  {"content-type", "application/grpc"}};
  constexpr int kStaticEntries = 61;
  std::string bytes;
  for (size_t i = 0; i < headers.size(); ++i) {
    if (is_first) {
      std::string literal = Header(headers[i].first, headers[i].second);
      literal[0] = '\x40';  // to be indexed
      bytes += literal;
    } else {
      bytes.push_back(static_cast<char>(0x80 | (kStaticEntries + headers.size() - i)));
    }
  }
  return bytes;
}

// Begins and resets `streams` calls of `path`, on new connections when the server has closed one. Returns how many it
// has closed.
int Attack(const std::string& address, const std::string& path, int streams, bool reconnects) {
  const absl::Time begin = absl::Now();
  int closed = 0;
  int sent = 0;
  while (sent < streams && (closed == 0 || reconnects)) {
    RawConnection connection(address);
    bool is_open =
        connection.Send(ConnectionStart() + Frame{.type = Frame::kSettings, .flags = Frame::kAck}.Serialize());
    for (uint32_t stream = 1; is_open && sent < streams; sent += kBatch) {
      std::string bytes;
      for (int i = 0; i < kBatch; ++i, stream += 2) {
        Frame call = BeginCall(stream, path);
        call.payload = CompactHeaders(path, stream == 1);
        bytes += call.Serialize() + ResetCall(stream).Serialize();
      }
      is_open = connection.Send(bytes);
      // The attack's own pace; nothing waits for this.
      absl::SleepFor(begin + absl::Seconds(1.0 * sent / kStreamsASecond) - absl::Now());
    }
    // A server that is behind closes it a little later. Of new ones the last may be too short to be closed.
    closed += !is_open || (!reconnects && connection.IsClosedByServer()) ? 1 : 0;
  }
  return closed;
}

class RapidResetTest : public ::testing::Test {
 protected:
  RapidResetTest() : daemon_({"--metrics-listen", "127.0.0.1:0"}, folder_.Path("log")) {
    const std::string line = daemon_.process().ReadLine();
    EXPECT_THAT(line, HasSubstr("metrics on "));
    metrics_ = line.substr(line.rfind(' ') + 1);
  }

  // From now on no call is in flight within kIdleAgainWithin.
  void ExpectIdleSoon() {
    const absl::Time begin = absl::Now();
    while (MetricAt(metrics_, "wellspace_calls_in_flight") != 0 && absl::Now() - begin < absl::Minutes(1)) {
    }
    EXPECT_LT(absl::Now() - begin, kIdleAgainWithin);
  }

  // After so many connections were shut.
  void ExpectServed(int closed) {
    EXPECT_GE(MetricAt(metrics_, "wellspace_connections_shut_total"), closed);
    EXPECT_EQ(MeshTriangle(daemon_.Client()), absl::OkStatus());
    daemon_.Stop();
    if (closed > 0) {
      EXPECT_THAT(folder_.Read("log"), HasSubstr("event=connection_shut peer=ipv4:127.0.0.1:"));
    }
  }

  TemporaryFolder folder_;
  Daemon daemon_;
  std::string metrics_;
};

// The parameter: the path of the calls.
class RapidReset : public RapidResetTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(RapidReset, IsCutOff) {
  client::Client client = daemon_.Client();
  ASSERT_TRUE(client.GetServerInfo().ok());
  Observer observer(client);
  EXPECT_EQ(Attack(daemon_.address(), GetParam(), kStreams, /*reconnects=*/false), 1);
  [[maybe_unused]] const absl::Duration longest = observer.Stop();
  ExpectIdleSoon();
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(longest, kServedWithin);
  EXPECT_LT(daemon_.process().PeakMemory(), kMostMemory);
#endif
  ExpectServed(1);
}

// Whatever that costs meanwhile, nothing remains.
TEST_P(RapidReset, OnNewConnectionsIsCutOffEachTime) {
  const int closed = Attack(daemon_.address(), GetParam(), kStreams, /*reconnects=*/true);
  ExpectIdleSoon();
  ExpectServed(closed);
}

INSTANTIATE_TEST_SUITE_P(
    All, RapidReset,
    ::testing::Values("/wellspace.v1.MeshingService/GetServerInfo", "/wellspace.v1.MeshingService/MeshPoints",
                      "/wellspace.v1.OperationService/WatchOperation", "/grpc.health.v1.Health/Check",
                      "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", "/no.such.Service/Method"),
    [](const auto& test) {
      const std::string path = test.param;
      return path.substr(path.rfind('/') + 1);
    });

// A client that cancels a few calls has not done anything wrong.
TEST_F(RapidResetTest, IsNotWhatAClientDoesThatCancels) {
  RawConnection connection(daemon_.address());
  ASSERT_TRUE(connection.Begin());
  constexpr uint32_t kCancelled = 100;
  for (uint32_t i = 0; i < kCancelled; ++i) {
    ASSERT_TRUE(connection.Send(BeginCall(2 * i + 1, "/wellspace.v1.MeshingService/GetServerInfo").Serialize() +
                                ResetCall(2 * i + 1).Serialize()));
  }
  EXPECT_TRUE(connection.IsAlive());
  ExpectIdleSoon();
  EXPECT_TRUE(connection.IsAlive());
  EXPECT_EQ(MetricAt(metrics_, "wellspace_connections_shut_total"), 0);
  daemon_.Stop();
}

}  // namespace
}  // namespace wellspace::server
