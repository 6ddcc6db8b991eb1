#include "server/listener.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace wellspace::server {
namespace {

// Before another attempt at what failed for want of descriptors or memory.
constexpr int kPauseMs = 100;

constexpr absl::Duration kLogInterval = absl::Seconds(10);

struct FreeAddresses {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

// The addresses of `host`, with `port`.
absl::StatusOr<Addresses> Resolve(const std::string& host, uint16_t port) {
  addrinfo hints = {};
  hints.ai_flags = AI_PASSIVE;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list); error != 0) {
    return absl::UnavailableError(gai_strerror(error));
  }
  return Addresses(list);
}

void SetOption(int socket, int level, int option, int value) {
  setsockopt(socket, level, option, &value, sizeof(value));
}

uint16_t PortOf(const sockaddr_storage& address) {
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

void SetPort(sockaddr* address, uint16_t port) {
  (address->sa_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(address)->sin6_port
                                  : reinterpret_cast<sockaddr_in*>(address)->sin_port) = htons(port);
}

// A socket that listens at `address`; without, errno says why.
std::optional<FileDescriptor> ListenAt(const addrinfo& address) {
  FileDescriptor socket(::socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, address.ai_protocol));
  if (socket.get() < 0) {
    return std::nullopt;
  }
  SetOption(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (address.ai_family == AF_INET6) {
    SetOption(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY, 0);
  }
  if (bind(socket.get(), address.ai_addr, address.ai_addrlen) != 0 || listen(socket.get(), SOMAXCONN) != 0) {
    return std::nullopt;
  }
  return socket;
}

// The port at which a socket listens.
uint16_t PortOf(const FileDescriptor& socket) {
  sockaddr_storage address = {};
  socklen_t size = sizeof(address);
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return PortOf(address);
}

// A machine without IPv6, say, has names for its addresses all the same.
bool IsOfAnotherMachine(int error) {
  return error == EADDRNOTAVAIL || error == EAFNOSUPPORT || error == EPROTONOSUPPORT;
}

// The first descriptor that is not for connections any more.
int DescriptorLimit() {
  rlimit limit = {};
  getrlimit(RLIMIT_NOFILE, &limit);
  const rlim_t most = std::min<rlim_t>(limit.rlim_cur, std::numeric_limits<int>::max());
  return static_cast<int>(most - std::min<rlim_t>(Listener::kSpareDescriptors, most / 4));
}

// A connection that broke before it was accepted, and the errors that accept(2) passes on from the network.
bool IsOfOneConnection(int error) {
  switch (error) {
    case EINTR:
    case ECONNABORTED:
    case EPROTO:
    case EPERM:
    case ENETDOWN:
    case ENOPROTOOPT:
    case EHOSTDOWN:
    case ENONET:
    case EHOSTUNREACH:
    case EOPNOTSUPP:
    case ENETUNREACH:
      return true;
    default:
      return false;
  }
}

}  // namespace

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

int FileDescriptor::Release() { return std::exchange(fd_, -1); }

absl::StatusOr<std::unique_ptr<Listener>> Listener::Open(const ListenAddress& address,
                                                         std::shared_ptr<spdlog::logger> log) {
  const auto error = [&address](const std::string& why) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", address.ToString(), ": ", why,
                                               "; is the port in use, or the address not of this machine?"));
  };
  const absl::StatusOr<Addresses> addresses = Resolve(address.host, address.port);
  if (!addresses.ok()) {
    return error(std::string(addresses.status().message()));
  }
  std::vector<FileDescriptor> sockets;
  uint16_t port = address.port;
  for (const addrinfo* one = addresses->get(); one != nullptr; one = one->ai_next) {
    SetPort(one->ai_addr, port);
    std::optional<FileDescriptor> socket = ListenAt(*one);
    if (socket.has_value()) {
      port = PortOf(*socket);
      sockets.push_back(*std::move(socket));
    } else if (!IsOfAnotherMachine(errno) || (one->ai_next == nullptr && sockets.empty())) {
      return error(strerror(errno));
    }
  }
  return std::unique_ptr<Listener>(new Listener(std::move(sockets), port, std::move(log)));
}

void Listener::Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor) {
  acceptor_ = std::move(acceptor);
  stop_ = FileDescriptor(eventfd(0, EFD_CLOEXEC));
  thread_ = std::thread([this] { Run(); });
}

void Listener::Stop() {
  if (thread_.joinable()) {
    eventfd_write(stop_.get(), 1);
    thread_.join();
  }
  sockets_.clear();
}

void Listener::Run() {
  std::vector<pollfd> watched;
  for (const FileDescriptor& socket : sockets_) {
    watched.push_back({.fd = socket.get(), .events = POLLIN, .revents = 0});
  }
  watched.push_back({.fd = stop_.get(), .events = POLLIN, .revents = 0});
  pollfd& stop = watched.back();
  while (true) {
    poll(watched.data(), watched.size(), -1);
    bool is_well = true;
    for (size_t i = 0; i < sockets_.size(); ++i) {
      if (watched[i].revents != 0) {
        is_well = AcceptAll(watched[i].fd) && is_well;
      }
    }
    if (!is_well) {
      poll(&stop, 1, kPauseMs);
    }
    if (stop.revents != 0) {
      return;
    }
  }
}

bool Listener::AcceptAll(int socket) {
  while (true) {
    FileDescriptor connection(accept4(socket, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (connection.get() >= 0) {
      HandOver(socket, std::move(connection));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return true;
    } else if (!IsOfOneConnection(errno)) {
      LogTrouble(absl::StrCat("connections have to wait: ", strerror(errno)));
      return false;
    }
  }
}

void Listener::HandOver(int socket, FileDescriptor connection) {
  // Descriptors are given out from the lowest: this one says how many there are at least.
  if (connection.get() >= DescriptorLimit()) {
    LogTrouble(
        "a connection was closed at once: the file descriptors of this process are used up; raise their limit (ulimit "
        "-n)");
    return;
  }
  SetOption(connection.get(), IPPROTO_TCP, TCP_NODELAY, 1);
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
  parameters.listener_fd = socket;
  parameters.fd = connection.Release();
  acceptor_->HandleNewConnection(&parameters);
}

void Listener::LogTrouble(const std::string& what) {
  const absl::Time now = absl::Now();
  if (now - last_log_ < kLogInterval) {
    ++unlogged_;
    return;
  }
  last_log_ = now;
  log_->warn("{} ({} times more since the last such line)", what, std::exchange(unlogged_, 0));
}

}  // namespace wellspace::server
