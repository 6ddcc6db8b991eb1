#include "client/channel.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/formats/temporary_folder.h"

namespace wellspace::client {
namespace {

using ::testing::HasSubstr;

constexpr char kPem[] = "-----BEGIN CERTIFICATE-----\n";

void ExpectError(const std::string& address, const ConnectOptions& options, absl::StatusCode code,
                 const std::string& part) {
  const absl::Status status = OpenChannel(address, options, grpc::ChannelArguments()).status();
  EXPECT_EQ(status.code(), code) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(part));
}

bool Opens(const std::string& address, const ConnectOptions& options) {
  return OpenChannel(address, options, grpc::ChannelArguments()).ok();
}

TEST(OpenChannel, WantsAnAddress) {
  for (const char* address : {"", "host", ":1", "host:", "host:0", "host:65536", "host:x"}) {
    ExpectError(address, {}, absl::StatusCode::kInvalidArgument, "HOST:PORT");
  }
  EXPECT_TRUE(Opens("host:1", {}));
}

TEST(OpenChannel, TokensStayOnThisMachineInPlainText) {
  ConnectOptions options;
  options.token = "secret";
  for (const char* address : {"127.0.0.1:1", "127.3.2.1:1", "localhost:1", "[::1]:1"}) {
    EXPECT_TRUE(Opens(address, options)) << address;
  }
  for (const char* address : {"10.0.0.1:1", "127.example.org:1", "128.0.0.1:1", "host:1", "[::2]:1"}) {
    ExpectError(address, options, absl::StatusCode::kFailedPrecondition, "--insecure-remote");
  }
  options.tls = true;
  EXPECT_TRUE(Opens("host:1", options));
  options.tls = false;
  options.insecure_remote = true;
  EXPECT_TRUE(Opens("host:1", options));
}

TEST(OpenChannel, SaysWhatIsNoToken) {
  const TemporaryFolder folder;
  ConnectOptions options;
  options.token = "two words";
  ExpectError("localhost:1", options, absl::StatusCode::kInvalidArgument, "token");
  options.token = "secret";
  options.token_file = folder.Write("token", "secret");
  ExpectError("localhost:1", options, absl::StatusCode::kInvalidArgument, "one of them");
  options.token = "";
  EXPECT_TRUE(Opens("localhost:1", options));
  folder.Write("token", "secret\r\nsecret\n");
  ExpectError("localhost:1", options, absl::StatusCode::kInvalidArgument, options.token_file);
  folder.Write("token", "\n");
  ExpectError("localhost:1", options, absl::StatusCode::kInvalidArgument, options.token_file);
  options.token_file = folder.Path("none");
  ExpectError("localhost:1", options, absl::StatusCode::kNotFound, options.token_file);
}

TEST(OpenChannel, SaysWhichFileOfTlsIsWrong) {
  const TemporaryFolder folder;
  ConnectOptions options;
  options.tls_ca = folder.Write("ca.pem", "nonsense");
  ExpectError("localhost:1", options, absl::StatusCode::kInvalidArgument, options.tls_ca);
  options.tls_ca = folder.Path("none");
  ExpectError("localhost:1", options, absl::StatusCode::kNotFound, options.tls_ca);
  options.tls_ca = folder.Path("");
  ExpectError("localhost:1", options, absl::StatusCode::kNotFound, options.tls_ca);
  options.tls_ca = folder.Write("ca.pem", kPem);
  options.tls_certificate = options.tls_ca;
  ExpectError("localhost:1", options, absl::StatusCode::kInvalidArgument, "key");
}

}  // namespace
}  // namespace wellspace::client
