#include "server/network/http_endpoint.h"

#include <errno.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/network/listen_address.h"
#include "server/network/listening_sockets.h"

namespace wellspace::server {
namespace {

// The interval of looks for clients that take too long.
constexpr int kClientLookMs = 500;

std::string Response(const HttpAnswer& answer) {
  return absl::StrCat("HTTP/1.1 ", answer.status, "\r\nContent-Type: ", answer.type,
                      "\r\nContent-Length: ", answer.body.size(), "\r\nConnection: close\r\n\r\n", answer.body);
}

std::string Refusal(const std::string& status) { return Response({.status = status, .body = status + "\n"}); }

}  // namespace

struct HttpEndpoint::Client {
  FileDescriptor socket;
  std::chrono::steady_clock::time_point end;  // of our patience
  std::string request;
  std::string answer;  // the rest of the answer; empty: the request is not whole
};

absl::StatusOr<std::unique_ptr<HttpEndpoint>> HttpEndpoint::Start(const std::string& listen, HttpRoutes routes) {
  WELLSPACE_ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(listen));
  absl::StatusOr<ListeningSockets> listening = ListenOn(address);
  if (!listening.ok()) {
    return absl::UnavailableError(absl::StrCat("metrics: ", std::string(listening.status().message())));
  }
  address.port = listening->port;
  return std::unique_ptr<HttpEndpoint>(
      new HttpEndpoint(std::move(listening->sockets), address.ToString(), std::move(routes)));
}

HttpEndpoint::HttpEndpoint(std::vector<FileDescriptor> sockets, std::string address, HttpRoutes routes)
    : sockets_(std::move(sockets)),
      address_(std::move(address)),
      routes_(std::move(routes)),
      stop_(eventfd(0, EFD_CLOEXEC)),
      thread_([this] { Run(); }) {}

HttpEndpoint::~HttpEndpoint() {
  eventfd_write(stop_.get(), 1);
  thread_.join();
}

void HttpEndpoint::Run() {
  while (true) {
    std::vector<pollfd> watched = {{.fd = stop_.get(), .events = POLLIN, .revents = 0}};
    for (const FileDescriptor& socket : sockets_) {
      watched.push_back({.fd = socket.get(), .events = POLLIN, .revents = 0});
    }
    for (const Client& client : clients_) {
      const short events = client.answer.empty() ? POLLIN : POLLOUT;
      watched.push_back({.fd = client.socket.get(), .events = events, .revents = 0});
    }
    poll(watched.data(), watched.size(), clients_.empty() ? -1 : kClientLookMs);
    if (watched.front().revents != 0) {
      return;
    }
    // Connections that were watched come before those that are accepted now.
    size_t place = 1 + sockets_.size();
    const std::chrono::steady_clock::time_point now = std::chrono::steady_clock::now();
    std::erase_if(clients_, [&](Client& client) {
      const bool is_ready = watched[place++].revents != 0;
      return now >= client.end || (is_ready && !Serve(client));
    });
    for (size_t i = 0; i < sockets_.size(); ++i) {
      if (watched[1 + i].revents != 0) {
        Accept(sockets_[i].get());
      }
    }
  }
}

void HttpEndpoint::Accept(int socket) {
  FileDescriptor connection(accept4(socket, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (connection.get() < 0) {
    if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
      poll(nullptr, 0, kClientLookMs / 5);  // it waits still, and would be reported again at once
    }
    return;
  }
  if (clients_.size() >= kMostClients) {
    clients_.pop_front();
  }
  clients_.push_back({.socket = std::move(connection),
                      .end = std::chrono::steady_clock::now() + kTimeout,
                      .request = "",
                      .answer = ""});
  if (!Serve(clients_.back())) {
    clients_.pop_back();
  }
}

bool HttpEndpoint::Serve(Client& client) const {
  char buffer[4096];
  while (client.answer.empty()) {
    const ssize_t got = recv(client.socket.get(), buffer, sizeof(buffer), 0);
    if (got <= 0) {
      return got < 0 && (errno == EAGAIN || errno == EINTR);
    }
    client.request.append(buffer, static_cast<size_t>(got));
    const size_t end = client.request.find("\r\n\r\n");
    if (end != std::string::npos) {
      client.answer = AnswerTo(client.request);
    } else if (client.request.size() > kMostRequestBytes) {
      client.answer = Refusal("431 Request Header Fields Too Large");
    }
  }
  while (!client.answer.empty()) {
    const ssize_t sent = send(client.socket.get(), client.answer.data(), client.answer.size(), MSG_NOSIGNAL);
    if (sent < 0) {
      return errno == EAGAIN || errno == EINTR;
    }
    client.answer.erase(0, static_cast<size_t>(sent));
  }
  return false;
}

std::string HttpEndpoint::AnswerTo(const std::string& request) const {
  const std::string_view line = std::string_view(request).substr(0, request.find("\r\n"));
  const size_t method_end = line.find(' ');
  const size_t path_end = line.find_first_of(" ?", method_end + 1);
  if (method_end == std::string_view::npos || path_end == std::string_view::npos ||
      line.find(" HTTP/1.", method_end) == std::string_view::npos) {
    return Refusal("400 Bad Request");
  }
  const auto route = routes_.find(line.substr(method_end + 1, path_end - method_end - 1));
  if (route == routes_.end()) {
    return Refusal("404 Not Found");
  }
  const std::string_view method = line.substr(0, method_end);
  if (method != "GET" && method != "HEAD") {
    return Refusal("405 Method Not Allowed");
  }
  std::string response = Response(route->second());
  if (method == "HEAD") {
    response.resize(response.find("\r\n\r\n") + 4);
  }
  return response;
}

}  // namespace wellspace::server
