// Addresses, proxies, tokens and files of TLS for a channel, and the errors of wrong ones.
#include "client/grpc/channel.h"

#include <cstdlib>
#include <map>
#include <optional>
#include <string>

#include "client/address.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/temporary_folder.h"

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

// The error names the fault of a URL, and the address that would do in its place.
TEST(OpenChannel, WantsNoUrl) {
  const auto code = absl::StatusCode::kInvalidArgument;
  ExpectError("http://127.0.0.1:7233", {}, code, "expected HOST:PORT without http://, 127.0.0.1:7233");
  ExpectError("HTTP://host:7233/", {}, code, "expected HOST:PORT without HTTP://, host:7233");
  ExpectError("grpc://[::1]:7233/wellspace.v1", {}, code, "expected HOST:PORT without grpc://, [::1]:7233");
  ExpectError("https://host:443", {}, code, "without https://, host:443, and TLS asked for by its own option, --tls");
  ExpectError("grpcs://host:443", {}, code, "--tls");
  ExpectError("http://host", {}, code, "expected HOST:PORT without http://");
  ExpectError("dns:///host:7233", {}, code, "expected HOST:PORT without dns://");
  ExpectError("host/path:7233", {}, code, "HOST:PORT");
}

constexpr const char* kProxyVariables[] = {"grpc_proxy", "https_proxy", "http_proxy", "no_grpc_proxy", "no_proxy"};

// The proxy for `host` where the environment has `variables` only, as "ADDRESS VARIABLE".
std::string ProxyIn(const std::map<std::string, std::string>& variables, const std::string& host) {
  for (const char* name : kProxyVariables) {
    unsetenv(name);
  }
  for (const auto& [name, value] : variables) {
    setenv(name.c_str(), value.c_str(), 1);
  }
  const std::optional<Proxy> proxy = ProxyFor(host);
  for (const char* name : kProxyVariables) {
    unsetenv(name);
  }
  return proxy.has_value() ? proxy->address + " " + proxy->variable : "";
}

TEST(ProxyFor, IsTheOneThatGrpcTakes) {
  EXPECT_EQ(ProxyIn({}, "host"), "");
  EXPECT_EQ(ProxyIn({{"http_proxy", "http://proxy:3128"}}, "host"), "http://proxy:3128 http_proxy");
  EXPECT_EQ(ProxyIn({{"http_proxy", "http://a:1"}, {"https_proxy", "http://b:2"}}, "host"), "http://b:2 https_proxy");
  EXPECT_EQ(ProxyIn({{"grpc_proxy", "http://c:3/"}, {"https_proxy", "http://b:2"}}, "host"), "http://c:3 grpc_proxy");
  EXPECT_EQ(ProxyIn({{"grpc_proxy", ""}, {"http_proxy", "http://a:1"}}, "host"), "");
  EXPECT_EQ(ProxyIn({{"http_proxy", "https://a:1"}}, "host"), "");
  EXPECT_EQ(ProxyIn({{"http_proxy", "http://user:se@cret@a:1"}}, "host"), "http://a:1 http_proxy");
  EXPECT_EQ(ProxyIn({{"http_proxy", "http://a:1"}, {"no_proxy", "other,.example.org"}}, "x.example.org"), "");
  EXPECT_EQ(ProxyIn({{"http_proxy", "http://a:1"}, {"no_proxy", "other"}}, "x.example.org"), "http://a:1 http_proxy");
  EXPECT_EQ(ProxyIn({{"http_proxy", "http://a:1"}, {"no_grpc_proxy", "other"}, {"no_proxy", "host"}}, "host"),
            "http://a:1 http_proxy");
}

TEST(IsLoopback, OfNamesAndNumbers) {
  for (const char* host :
       {"localhost", "LocalHost", "127.0.0.1", "127.3.2.1", "::1", "0:0:0:0:0:0:0:1", "::ffff:127.0.0.1"}) {
    EXPECT_TRUE(IsLoopback(host)) << host;
  }
  for (const char* host : {"128.0.0.1", "127.example.org", "localhost.example.org", "::2", "::ffff:128.0.0.1", "::"}) {
    EXPECT_FALSE(IsLoopback(host)) << host;
  }
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
