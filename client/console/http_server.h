// HTTP on the loopback, by libmicrohttpd.
#ifndef WELLSPACE_CLIENT_CONSOLE_HTTP_SERVER_H_
#define WELLSPACE_CLIENT_CONSOLE_HTTP_SERVER_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/console/request_guard.h"

struct MHD_Daemon;

namespace wellspace::console {

// A request that the guard has let pass, with its body.
struct HttpRequest {
  std::string method;
  std::string path;  // decoded, without the prefix: "api/sessions"
  std::map<std::string, std::string> query{};
  std::string body_path{};  // the file that has the body; empty: the request has none
};

struct HttpAnswer {
  int status = 200;
  std::string type = "application/json";
  std::string body{};
  std::string file{};  // in the place of `body`: this file, which is removed
  std::vector<std::pair<std::string, std::string>> headers{};
};

// The header by which an answer that is a page says which sources it allows itself.
inline constexpr char kPolicyHeader[] = "Content-Security-Policy";

// Called by the thread of a connection, several at once.
using HttpHandler = std::function<HttpAnswer(const HttpRequest&)>;

struct HttpOptions {
  bool is_ipv6 = false;  // listens on [::1] rather than on 127.0.0.1
  int port = 0;          // 0: a free one
  std::string token{};
  std::string folder{};  // for bodies of requests; of this user alone
  uint64_t max_body_bytes = uint64_t{1} << 30;
};

// Answers on the loopback until it is destroyed. Each connection has a thread. The resources of a request are bounded:
// kMaxConnections at once, kMaxHeadBytes of its head, `max_body_bytes` of its body, which goes to a file, and
// kIdleSeconds without a byte.
//
// All answers forbid everything that a page of the console does not need: other origins, frames, caches, guessed types.
//
// Thread safety: thread-safe.
class HttpServer {
 public:
  static constexpr unsigned kMaxConnections = 32;
  static constexpr unsigned kIdleSeconds = 30;
  static constexpr size_t kMaxHeadBytes = 16384;

  // REQUIRES:   `handler` can be called until this is destroyed.
  //
  // Errors:     UNAVAILABLE: the port cannot be listened on.
  static absl::StatusOr<std::unique_ptr<HttpServer>> Start(const HttpOptions& options, HttpHandler handler);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  // "http://127.0.0.1:PORT/TOKEN/".
  std::string url() const;
  int port() const { return port_; }

 private:
  struct Exchange;
  struct Callbacks;

  HttpServer(HttpOptions options, HttpHandler handler);

  const HttpOptions options_;
  const HttpHandler handler_;
  int port_ = 0;
  std::optional<RequestGuard> guard_;
  MHD_Daemon* daemon_ = nullptr;
};

}  // namespace wellspace::console

#endif  // WELLSPACE_CLIENT_CONSOLE_HTTP_SERVER_H_
