#include "client/console/http_server.h"

#include <fcntl.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <string_view>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace wellspace::console {
namespace {

// The headers of every answer; a page allows itself more in its own element <meta>, which these do not widen.
constexpr std::pair<const char*, const char*> kHeaders[] = {
    {"Cache-Control", "no-store"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Referrer-Policy", "no-referrer"},
    {"X-Content-Type-Options", "nosniff"},
};
constexpr char kNoPolicy[] = "default-src 'none'; frame-ancestors 'none'";

std::optional<std::string_view> HeaderOf(MHD_Connection* connection, const char* name) {
  const char* const value = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  return value == nullptr ? std::nullopt : std::optional<std::string_view>(value);
}

HttpAnswer PlainAnswer(int status, std::string_view text) {
  return {.status = status, .type = "text/plain; charset=utf-8", .body = absl::StrCat(std::string(text), "\n")};
}

MHD_Response* ResponseOf(const HttpAnswer& answer) {
  if (answer.file.empty()) {
    return MHD_create_response_from_buffer(answer.body.size(), const_cast<char*>(answer.body.data()),
                                           MHD_RESPMEM_MUST_COPY);
  }
  const int file = open(answer.file.c_str(), O_RDONLY | O_CLOEXEC);
  unlink(answer.file.c_str());
  struct stat status {};
  if (file < 0 || fstat(file, &status) != 0) {
    return nullptr;
  }
  return MHD_create_response_from_fd64(static_cast<uint64_t>(status.st_size), file);  // which it closes
}

MHD_Result Send(MHD_Connection* connection, const HttpAnswer& answer) {
  MHD_Response* const response = ResponseOf(answer);
  if (response == nullptr) {
    return MHD_NO;
  }
  bool has_policy = false;
  for (const auto& [name, value] : kHeaders) {
    MHD_add_response_header(response, name, value);
  }
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, answer.type.c_str());
  for (const auto& [name, value] : answer.headers) {
    MHD_add_response_header(response, name.c_str(), value.c_str());
    has_policy |= name == kPolicyHeader;
  }
  if (!has_policy) {
    MHD_add_response_header(response, kPolicyHeader, kNoPolicy);
  }
  const MHD_Result queued = MHD_queue_response(connection, static_cast<unsigned>(answer.status), response);
  MHD_destroy_response(response);
  return queued;
}

// A socket that listens on the loopback, and its port.
absl::StatusOr<std::pair<int, int>> Listen(const HttpOptions& options) {
  const int listener = socket(options.is_ipv6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in v4{};
  v4.sin_family = AF_INET;
  v4.sin_port = htons(static_cast<uint16_t>(options.port));
  v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  v6.sin6_port = v4.sin_port;
  v6.sin6_addr = in6addr_loopback;
  auto* const address = options.is_ipv6 ? reinterpret_cast<sockaddr*>(&v6) : reinterpret_cast<sockaddr*>(&v4);
  socklen_t size = options.is_ipv6 ? sizeof(v6) : sizeof(v4);
  constexpr int kBacklog = 128;
  const int reuse = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof(reuse));
  if (listener < 0 || bind(listener, address, size) != 0 || listen(listener, kBacklog) != 0 ||
      getsockname(listener, address, &size) != 0) {
    const std::string why = std::strerror(errno);
    if (listener >= 0) {
      close(listener);
    }
    return absl::UnavailableError(absl::StrCat("port ", options.port, " of the loopback cannot be listened on: ", why));
  }
  return std::pair(listener, static_cast<int>(ntohs(options.is_ipv6 ? v6.sin6_port : v4.sin_port)));
}

MHD_Result AddArgument(void* query, MHD_ValueKind /*kind*/, const char* name, const char* value) {
  (*static_cast<std::map<std::string, std::string>*>(query))[name] = value == nullptr ? "" : value;
  return MHD_YES;
}

}  // namespace

// A request while it comes.
struct HttpServer::Exchange {
  ~Exchange() {
    if (body >= 0) {
      close(body);
    }
    if (!body_path.empty()) {
      unlink(body_path.c_str());
    }
  }

  bool has_begun = false;
  int body = -1;
  std::string body_path;
  uint64_t size = 0;
  std::optional<HttpAnswer> refusal;
};

// The callback of libmicrohttpd.
struct HttpServer::Callbacks {
  static void* Begin(void* /*server*/, const char* /*uri*/, MHD_Connection* /*connection*/) { return new Exchange(); }

  static void End(void* /*server*/, MHD_Connection* /*connection*/, void** exchange,
                  MHD_RequestTerminationCode /*code*/) {
    delete static_cast<Exchange*>(*exchange);
    *exchange = nullptr;
  }

  static MHD_Result Handle(void* server, MHD_Connection* connection, const char* path, const char* method,
                           const char* /*version*/, const char* data, size_t* size, void** exchange) {
    const HttpServer& self = *static_cast<const HttpServer*>(server);
    Exchange& one = *static_cast<Exchange*>(*exchange);
    if (!one.has_begun) {
      one.has_begun = true;
      return CheckHead(self, connection, path, method);
    }
    if (*size > 0) {
      Take(self, std::string_view(data, *size), one);
      *size = 0;
      return MHD_YES;
    }
    if (one.refusal.has_value()) {
      return Send(connection, *one.refusal);
    }
    HttpRequest request{.method = std::strcmp(method, "HEAD") == 0 ? "GET" : method,
                        .path = std::string(path).substr(self.guard_->prefix().size()),
                        .query = {}};
    MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, AddArgument, &request.query);
    if (one.body >= 0) {
      close(one.body);
      one.body = -1;
      request.body_path = one.body_path;
    }
    return Send(connection, self.handler_(request));
  }

  // Ends a request without its body where it is not to be answered.
  static MHD_Result CheckHead(const HttpServer& self, MHD_Connection* connection, const char* path,
                              const char* method) {
    const std::optional<Refusal> refusal = self.guard_->Refuse({.method = method,
                                                                .path = path,
                                                                .host = HeaderOf(connection, MHD_HTTP_HEADER_HOST),
                                                                .origin = HeaderOf(connection, MHD_HTTP_HEADER_ORIGIN),
                                                                .fetch_site = HeaderOf(connection, "Sec-Fetch-Site")});
    if (refusal.has_value()) {
      return Send(connection, PlainAnswer(refusal->status, refusal->message));
    }
    const std::optional<std::string_view> length = HeaderOf(connection, MHD_HTTP_HEADER_CONTENT_LENGTH);
    uint64_t bytes = 0;
    if (length.has_value() &&
        std::from_chars(length->data(), length->data() + length->size(), bytes).ec == std::errc() &&
        bytes > self.options_.max_body_bytes) {
      return Send(connection, TooLarge(self));
    }
    return MHD_YES;
  }

  static HttpAnswer TooLarge(const HttpServer& self) {
    return PlainAnswer(MHD_HTTP_CONTENT_TOO_LARGE,
                       absl::StrCat("At most ", self.options_.max_body_bytes, " bytes are accepted."));
  }

  // Appends a part of the body to its file.
  static void Take(const HttpServer& self, std::string_view part, Exchange& one) {
    if (one.refusal.has_value()) {
      return;
    }
    one.size += part.size();
    if (one.size > self.options_.max_body_bytes) {
      one.refusal = TooLarge(self);
      return;
    }
    if (one.body < 0) {
      std::string path = absl::StrCat(self.options_.folder, "/body-XXXXXX");
      one.body = mkostemp(path.data(), O_CLOEXEC);
      one.body_path = one.body < 0 ? "" : path;
    }
    while (!part.empty()) {
      const ssize_t written = one.body < 0 ? -1 : write(one.body, part.data(), part.size());
      if (written < 0 && errno != EINTR) {
        one.refusal = PlainAnswer(MHD_HTTP_INSUFFICIENT_STORAGE,
                                  absl::StrCat("The file could not be kept: ", std::strerror(errno), "."));
        return;
      }
      part.remove_prefix(static_cast<size_t>(std::max<ssize_t>(written, 0)));
    }
  }
};

HttpServer::HttpServer(HttpOptions options, HttpHandler handler)
    : options_(std::move(options)), handler_(std::move(handler)) {}

absl::StatusOr<std::unique_ptr<HttpServer>> HttpServer::Start(const HttpOptions& options, HttpHandler handler) {
  std::unique_ptr<HttpServer> server(new HttpServer(options, std::move(handler)));
  // The socket is made here, as the guard has to know its port before the first request.
  const absl::StatusOr<std::pair<int, int>> socket_and_port = Listen(options);
  if (!socket_and_port.ok()) {
    return socket_and_port.status();
  }
  const auto [listener, port] = *socket_and_port;
  server->port_ = port;
  server->guard_.emplace(port, options.token);
  const unsigned flags = MHD_USE_THREAD_PER_CONNECTION | MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_POLL;
  server->daemon_ = MHD_start_daemon(
      flags, 0, nullptr, nullptr, &Callbacks::Handle, server.get(), MHD_OPTION_LISTEN_SOCKET, listener,
      MHD_OPTION_CONNECTION_LIMIT, kMaxConnections, MHD_OPTION_CONNECTION_TIMEOUT, kIdleSeconds,
      MHD_OPTION_CONNECTION_MEMORY_LIMIT, kMaxHeadBytes, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_URI_LOG_CALLBACK,
      &Callbacks::Begin, server.get(), MHD_OPTION_NOTIFY_COMPLETED, &Callbacks::End, server.get(), MHD_OPTION_END);
  if (server->daemon_ == nullptr) {
    close(listener);
    return absl::UnavailableError(absl::StrCat("port ", port, " of the loopback cannot be served"));
  }
  return server;
}

HttpServer::~HttpServer() {
  if (daemon_ != nullptr) {
    MHD_stop_daemon(daemon_);
  }
}

std::string HttpServer::url() const {
  return absl::StrCat("http://", options_.is_ipv6 ? "[::1]" : "127.0.0.1", ":", port_, guard_->prefix());
}

}  // namespace wellspace::console
