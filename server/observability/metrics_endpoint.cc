#include "server/observability/metrics_endpoint.h"

#include <errno.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "prometheus/text_serializer.h"
#include "server/network/listen_address.h"
#include "server/network/listening_sockets.h"

namespace wellspace::server {
namespace {

// How often clients that take too long are looked for.
constexpr int kClientLookMs = 500;

std::string Response(std::string_view status, std::string_view type, std::string_view body) {
  return absl::StrCat("HTTP/1.1 ", std::string(status), "\r\nContent-Type: ", std::string(type),
                      "\r\nContent-Length: ", body.size(), "\r\nConnection: close\r\n\r\n", std::string(body));
}

std::string RefusalResponse(std::string_view status) {
  return Response(status, "text/plain", absl::StrCat(std::string(status), "\n"));
}

}  // namespace

struct MetricsEndpoint::Client {
  FileDescriptor socket;
  std::chrono::steady_clock::time_point end;  // of our patience
  std::string request;
  std::string answer;  // what is not sent yet; empty: the request is not whole
};

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Start(const std::string& listen,
                                                                        const Metrics& metrics) {
  WELLSPACE_ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(listen));
  absl::StatusOr<ListeningSockets> listening = ListenOn(address);
  if (!listening.ok()) {
    return absl::UnavailableError(absl::StrCat("metrics: ", std::string(listening.status().message())));
  }
  address.port = listening->port;
  return std::unique_ptr<MetricsEndpoint>(
      new MetricsEndpoint(std::move(listening->sockets), address.ToString(), metrics));
}

MetricsEndpoint::MetricsEndpoint(std::vector<FileDescriptor> sockets, std::string address, const Metrics& metrics)
    : sockets_(std::move(sockets)),
      address_(std::move(address)),
      metrics_(metrics),
      stop_(eventfd(0, EFD_CLOEXEC)),
      thread_([this] { Run(); }) {}

MetricsEndpoint::~MetricsEndpoint() {
  eventfd_write(stop_.get(), 1);
  thread_.join();
}

void MetricsEndpoint::Run() {
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
    // Those that were watched come before those that are accepted now.
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

void MetricsEndpoint::Accept(int socket) {
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

bool MetricsEndpoint::Serve(Client& client) const {
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
      client.answer = RefusalResponse("431 Request Header Fields Too Large");
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

std::string MetricsEndpoint::AnswerTo(const std::string& request) const {
  const std::string_view line = std::string_view(request).substr(0, request.find("\r\n"));
  const size_t method_end = line.find(' ');
  const size_t path_end = line.find_first_of(" ?", method_end + 1);
  if (method_end == std::string_view::npos || path_end == std::string_view::npos ||
      line.find(" HTTP/1.", method_end) == std::string_view::npos) {
    return RefusalResponse("400 Bad Request");
  }
  if (line.substr(method_end + 1, path_end - method_end - 1) != "/metrics") {
    return RefusalResponse("404 Not Found");
  }
  const std::string_view method = line.substr(0, method_end);
  if (method != "GET" && method != "HEAD") {
    return RefusalResponse("405 Method Not Allowed");
  }
  std::vector<prometheus::MetricFamily> families;
  for (const std::shared_ptr<prometheus::Collectable>& collectable : metrics_.Collectables()) {
    std::vector<prometheus::MetricFamily> some = collectable->Collect();
    std::move(some.begin(), some.end(), std::back_inserter(families));
  }
  std::string answer =
      Response("200 OK", "text/plain; version=0.0.4; charset=utf-8", prometheus::TextSerializer().Serialize(families));
  if (method == "HEAD") {
    answer.resize(answer.find("\r\n\r\n") + 4);
  }
  return answer;
}

}  // namespace wellspace::server
