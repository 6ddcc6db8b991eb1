// Addresses to listen on: text and back, loopback, and what is refused.
#include "server/network/listen_address.h"

#include <string>

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

TEST(ListenAddress, ReadsAndWritesTheSame) {
  for (const std::string text : {"127.0.0.1:7233", "localhost:0", "[::1]:65535", "0.0.0.0:1", "mesh.example.org:443"}) {
    const absl::StatusOr<ListenAddress> address = ParseListenAddress(text);
    ASSERT_TRUE(address.ok()) << address.status();
    EXPECT_EQ(address->ToString(), text);
  }
}

TEST(ListenAddress, RefusesWhatIsNone) {
  for (const std::string text :
       {"", ":", ":80", "host", "host:", "host:x", "host:-1", "host:65536", "host:80 ", "host:8x", "::1:80", "[::1]",
        "[::1:80", "::1]:80", "[host]:80", "[]:80", "unix:/tmp/socket", "dns:///host:80", "a b:80"}) {
    const absl::StatusOr<ListenAddress> address = ParseListenAddress(text);
    ASSERT_FALSE(address.ok()) << text;
    EXPECT_EQ(address.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(address.status().message().find("HOST:PORT"), absl::string_view::npos);
  }
}

TEST(ListenAddress, KnowsLoopback) {
  for (const std::string text : {"127.0.0.1:1", "127.9.8.7:1", "[::1]:1", "localhost:1"}) {
    EXPECT_TRUE(ParseListenAddress(text)->IsLoopback()) << text;
  }
  for (const std::string text : {"0.0.0.0:1", "128.0.0.1:1", "[::]:1", "[fe80::1]:1", "10.0.0.1:1", "localhost.org:1",
                                 "127.0.0.1.example.org:1"}) {
    EXPECT_FALSE(ParseListenAddress(text)->IsLoopback()) << text;
  }
}

}  // namespace
}  // namespace wellspace::server
