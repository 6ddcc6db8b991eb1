// Paths, methods and broken requests over a real socket.
#include "server/network/http_endpoint.h"

#include <unistd.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/http_get.h"

namespace wellspace::server {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// An endpoint at address() that answers two paths.
class HttpEndpointTest : public ::testing::Test {
 protected:
  HttpEndpointTest() {
    HttpRoutes routes;
    routes["/one"] = [] { return HttpAnswer{.type = "text/x", .body = "first"}; };
    routes["/two"] = [] { return HttpAnswer{.status = "503 Service Unavailable", .body = "second"}; };
    endpoint_ = *HttpEndpoint::Start("127.0.0.1:0", std::move(routes));
  }

  const std::string& address() const { return endpoint_->address(); }

  std::string AnswerTo(const std::string& bytes) const {
    const int socket = SendHttp(address(), bytes);
    std::string answer = ReadHttp(socket);
    close(socket);
    return answer;
  }

 private:
  std::unique_ptr<HttpEndpoint> endpoint_;
};

TEST_F(HttpEndpointTest, AnswersItsPathsAndNothingElse) {
  EXPECT_THAT(HttpGet(address(), "/one"),
              AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), HasSubstr("\r\nContent-Type: text/x\r\nContent-Length: 5\r\n"),
                    EndsWith("\r\n\r\nfirst")));
  EXPECT_THAT(HttpGet(address(), "/two"), AllOf(StartsWith("HTTP/1.1 503 Service"), EndsWith("\r\n\r\nsecond")));
  EXPECT_THAT(HttpGet(address(), "/one?name=x"), StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(HttpGet(address(), "/"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(HttpGet(address(), "/onex"), StartsWith("HTTP/1.1 404 "));
}

TEST_F(HttpEndpointTest, RefusesOtherMethodsAndWhatIsNoRequest) {
  EXPECT_THAT(AnswerTo("POST /one HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 405 "));
  EXPECT_THAT(AnswerTo("nonsense\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(AnswerTo("GET /one\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(AnswerTo(std::string(9000, 'x')), StartsWith("HTTP/1.1 431 "));
  EXPECT_THAT(AnswerTo("HEAD /one HTTP/1.1\r\n\r\n"), AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), EndsWith("\r\n\r\n")));
}

// As many as would have held every thread of a server that has one for each.
TEST_F(HttpEndpointTest, IsNotHeldUpByRequestsThatNeverComeWhole) {
  constexpr int kSlow = 200;
  std::vector<int> slow;
  for (int i = 0; i < kSlow; ++i) {
    slow.push_back(SendHttp(address(), "GET /one HTTP/1.1\r\nHost: loc"));
  }
  const absl::Time begin = absl::Now();
  EXPECT_THAT(HttpGet(address(), "/one"), StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(2));
  // The oldest had to go, the others go when their time is up.
  for (const int socket : slow) {
    EXPECT_EQ(ReadHttp(socket), "");
    close(socket);
  }
}

}  // namespace
}  // namespace wellspace::server
