// Which HTTP requests the console answers, by host, secret, origin and method.
#include "client/console/request_guard.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>

namespace wellspace::console {
namespace {

constexpr char kToken[] = "0123456789abcdef0123456789abcdef";

class RequestGuardTest : public ::testing::Test {
 protected:
  // The status of the refusal; 0: the request is answered.
  int Refusal(const RequestHead& head) const {
    const std::optional<struct Refusal> refusal = guard_.Refuse(head);
    return refusal.has_value() ? refusal->status : 0;
  }
  // A request as the page makes it.
  RequestHead Own() const {
    return {.method = "POST",
            .path = path_,
            .host = "127.0.0.1:4711",
            .origin = "http://127.0.0.1:4711",
            .fetch_site = "same-origin"};
  }

  const RequestGuard guard_{4711, kToken};
  const std::string path_ = guard_.prefix() + "api/sessions";
};

TEST(MakeTokenTest, TokensDiffer) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) {
    const std::string token = MakeToken();
    EXPECT_EQ(token.size(), 32u);
    EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos);
    tokens.insert(token);
  }
  EXPECT_EQ(tokens.size(), 100u);
}

TEST_F(RequestGuardTest, ItsOwnPageIsAnswered) {
  EXPECT_EQ(Refusal(Own()), 0);
  for (const char* host : {"localhost:4711", "[::1]:4711", "127.0.0.1:4711"}) {
    EXPECT_EQ(Refusal({.method = "GET", .path = path_, .host = host}), 0) << host;
  }
}

TEST_F(RequestGuardTest, OtherNamesOfThisMachineAreRefused) {
  for (const std::optional<std::string_view> host :
       {std::optional<std::string_view>(), std::optional<std::string_view>(""),
        std::optional<std::string_view>("127.0.0.1"), std::optional<std::string_view>("127.0.0.1:4712"),
        std::optional<std::string_view>("evil.example:4711"), std::optional<std::string_view>("evil127.0.0.1:4711"),
        std::optional<std::string_view>("127.0.0.1:4711.evil.example"),
        std::optional<std::string_view>("localhost.evil.example:4711"), std::optional<std::string_view>(":4711")}) {
    RequestHead head = Own();
    head.host = host;
    EXPECT_EQ(Refusal(head), 421) << host.value_or("none");
  }
}

TEST_F(RequestGuardTest, WithoutTheSecretNothingIsFound) {
  std::string other = guard_.prefix();
  other[5] = other[5] == '0' ? '1' : '0';
  for (const std::string& path :
       {std::string("/"), std::string(""), std::string("/api/sessions"), std::string("/") + kToken,
        "//" + std::string(kToken) + "/", other + "api/sessions", "/x" + guard_.prefix()}) {
    RequestHead head = Own();
    head.path = path;
    EXPECT_EQ(Refusal(head), 404) << path;
  }
}

TEST_F(RequestGuardTest, OtherOriginsAreRefused) {
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1:4711", "http://127.0.0.1:4712",
                             "http://localhost:4711", ""}) {
    RequestHead head = Own();
    head.origin = origin;
    EXPECT_EQ(Refusal(head), 403) << origin;
  }
  for (const char* site : {"cross-site", "same-site", "", "Same-Origin"}) {
    RequestHead head = Own();
    head.fetch_site = site;
    EXPECT_EQ(Refusal(head), 403) << site;
  }
  // A file of the user's leads to the first page, and to that alone.
  EXPECT_EQ(Refusal({.method = "GET", .path = guard_.prefix(), .host = "127.0.0.1:4711", .fetch_site = "cross-site"}),
            0);
  EXPECT_EQ(Refusal({.method = "POST", .path = guard_.prefix(), .host = "127.0.0.1:4711", .fetch_site = "cross-site"}),
            403);
}

TEST_F(RequestGuardTest, OtherMethodsAreRefused) {
  for (const char* method : {"PUT", "OPTIONS", "TRACE", "get", ""}) {
    RequestHead head = Own();
    head.method = method;
    EXPECT_EQ(Refusal(head), 405) << method;
  }
}

}  // namespace
}  // namespace wellspace::console
