// The standard error of the real program: its lines, and that the program ends when nothing reads them.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"
#include "server/base/resources.h"
#include "server/log/log_fields.h"
#include "server/security/tokens.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_call.h"
#include "tests/server/raw_http2.h"
#include "tests/server/security/certificates.h"
#include "tests/support/temporary_folder.h"
#include "wellspace/v1/operations.pb.h"

namespace wellspace::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class WellspacedLog : public ::testing::Test {
 protected:
  void Start(std::vector<std::string> arguments) {
    daemon_ = std::make_unique<Daemon>(std::move(arguments), folder_.Path("log"));
  }

  // All of the log; the program has ended then.
  std::vector<std::string> StopAndReadLines() {
    daemon_->Stop();
    std::vector<std::string> lines = absl::StrSplit(folder_.Read("log"), '\n', absl::SkipEmpty());
    return lines;
  }

  // The same of a log in JSON, all of whose lines are objects.
  std::vector<nlohmann::json> StopAndReadObjects() {
    std::vector<nlohmann::json> objects;
    for (const std::string& line : StopAndReadLines()) {
      objects.push_back(nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false));
      EXPECT_TRUE(objects.back().is_object()) << line;
    }
    return objects;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Daemon> daemon_;
};

TEST_F(WellspacedLog, BeginsWithTheVersionAndTheLimits) {
  Start({"--log-format", "json", "--max-points", "123", "--stall-limit", "7.5", "--max-streams", "77"});
  const std::vector<nlohmann::json> lines = StopAndReadObjects();
  ASSERT_FALSE(lines.empty());
  const nlohmann::json& start = lines.front();
  EXPECT_EQ(start.value("event", ""), "started");
  EXPECT_EQ(start.value("version", ""), WELLSPACE_VERSION);
  EXPECT_EQ(start.value("listen", ""), daemon_->address());
  EXPECT_EQ(start.value("max_points", 0), 123);
  EXPECT_EQ(start.value("stall_limit_seconds", 0.0), 7.5);
  EXPECT_EQ(start.value("max_streams", 0), 77);
  // Those that nothing was said about.
  EXPECT_EQ(start.value("workers", 0), ReadResources().processors);
  EXPECT_EQ(start.value("max_threads", 0), ReadResources().processors);
  EXPECT_EQ(start.value("max_memory_bytes", uint64_t{0}), DefaultMaxMemory(ReadResources()));
}

TEST_F(WellspacedLog, LimitsWithoutAnyFlagAreThoseThatClientsAreTold) {
  Start({});
  const absl::StatusOr<client::ServerInfo> info = daemon_->Client().GetServerInfo();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->max_memory_bytes, DefaultMaxMemory(ReadResources()));
  EXPECT_EQ(info->workers, ReadResources().processors);
  daemon_->Stop();
  Start({"--max-memory", "0"});
  EXPECT_EQ(daemon_->Client().GetServerInfo()->max_memory_bytes, 0u);
  daemon_->Stop();
}

// A client without a token can send a name that is as long as a message.
TEST_F(WellspacedLog, NamesOfStrangersAreCut) {
  constexpr int kCalls = 5;
  Start({"--token-file", folder_.Write("tokens", *MakeTokenLine("acme", std::string(40, 't')))});
  const auto channel = grpc::CreateChannel(daemon_->address(), grpc::InsecureChannelCredentials());
  v1::WatchOperationRequest request;
  request.set_name(std::string(4'000'000, 'n'));
  for (int i = 0; i < kCalls; ++i) {
    const grpc::Status status =
        CallUnary(channel, "/wellspace.v1.OperationService/WatchOperation", request.SerializeAsString()).status;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
  }
  CallUnary(channel, absl::StrCat("/", std::string(5000, 's'), "/", std::string(2000, 'm')), "");
  const std::vector<std::string> lines = StopAndReadLines();
  EXPECT_EQ(
      std::count_if(lines.begin(), lines.end(),
                    [](const std::string& line) { return line.find("code=UNAUTHENTICATED") != std::string::npos; }),
      kCalls);
  for (const std::string& line : lines) {
    EXPECT_LT(line.size(), 2000u) << line.substr(0, 300);
  }
}

// Nor do they come back whole: a client takes 8 KiB of trailing metadata.
TEST_F(WellspacedLog, AnErrorThatNamesALongNameArrives) {
  Start({});
  const auto channel = grpc::CreateChannel(daemon_->address(), grpc::InsecureChannelCredentials());
  v1::WatchOperationRequest request;
  request.set_name(std::string(4'000'000, 'n'));
  const grpc::Status status =
      CallUnary(channel, "/wellspace.v1.OperationService/WatchOperation", request.SerializeAsString()).status;
  EXPECT_NE(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_NE(status.error_code(), grpc::StatusCode::OK);
  EXPECT_LE(status.error_message().size(), 1024u);
  daemon_->Stop();
}

TEST_F(WellspacedLog, SigtermEndsItThoughNothingReadsItsErrors) {
  const std::string fifo = folder_.Path("log");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const int pipe = open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(pipe, 0);
  const std::string filler(4096, 'f');
  while (write(pipe, filler.data(), filler.size()) > 0) {
  }
  Start({"--log-format", "json"});
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(daemon_->Client().GetServerInfo().ok());
  }
  const absl::Time begin = absl::Now();
  daemon_->Stop();
  EXPECT_LT(absl::Now() - begin, absl::Seconds(20));
  close(pipe);
}

TEST_F(WellspacedLog, AFailedHandshakeIsAnEvent) {
  const Authority authority(folder_, "authority");
  const CertificateFiles files = authority.Issue("server");
  Start({"--log-format", "json", "--tls-cert", files.certificate, "--tls-key", files.key});
  RawConnection plain(daemon_->address());
  plain.Send(ConnectionStart());
  EXPECT_TRUE(plain.IsClosedByServer());
  bool is_event = false;
  for (const nlohmann::json& line : StopAndReadObjects()) {
    if (line.value("event", "") == "handshake_failed") {
      is_event = true;
      EXPECT_EQ(line.value("level", ""), "warning");
      EXPECT_THAT(line.value("message", ""), AllOf(HasSubstr("wrong version number"), Not(HasSubstr("{"))));
    }
  }
  EXPECT_TRUE(is_event);
}

// gRPC's own lines, too, are objects.
TEST_F(WellspacedLog, WhatGrpcLogsIsOfTheSameFormat) {
  setenv("GRPC_VERBOSITY", "debug", /*overwrite=*/1);
  Start({"--log-format", "json", "--log-level", "debug"});
  unsetenv("GRPC_VERBOSITY");
  ASSERT_EQ(MeshTriangle(daemon_->Client()), absl::OkStatus());
  const std::vector<nlohmann::json> lines = StopAndReadObjects();
  EXPECT_TRUE(std::any_of(lines.begin(), lines.end(),
                          [](const nlohmann::json& line) { return line.value("event", "") == "grpc"; }));
}

}  // namespace
}  // namespace wellspace::server
