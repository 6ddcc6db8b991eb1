#include "server/network/listener.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/network/listening_sockets.h"

namespace wellspace::server {
namespace {

// Before another attempt at what failed for want of descriptors or memory.
constexpr int kPauseMs = 100;

// While calls of connections that were shut are worked off, how often it is looked whether they are, and how long
// nothing is accepted at most.
constexpr int kWaitMs = 10;
constexpr std::chrono::milliseconds kMaxWait(500);

// How often connections are looked at whose peers may not read.
constexpr int kPeerLookMs = 5000;

constexpr absl::Duration kLogInterval = absl::Seconds(10);

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

absl::StatusOr<std::unique_ptr<Listener>> Listener::Open(const ListenAddress& address,
                                                         std::shared_ptr<spdlog::logger> log) {
  WELLSPACE_ASSIGN_OR_RETURN(ListeningSockets listening, ListenOn(address));
  return std::unique_ptr<Listener>(new Listener(std::move(listening.sockets), listening.port, std::move(log)));
}

void Listener::Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor,
                     Connections& connections) {
  acceptor_ = std::move(acceptor);
  connections_ = &connections;
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
  watched.push_back({.fd = connections_->descriptor(), .events = POLLIN, .revents = 0});
  watched.push_back({.fd = stop_.get(), .events = POLLIN, .revents = 0});
  const pollfd& some_closed = watched[sockets_.size()];
  pollfd& stop = watched.back();
  Connections::Clock::time_point last_look = Connections::Clock::now();
  Connections::Clock::time_point last_accept = last_look;
  while (true) {
    // Connections wait in the system's queue.
    const bool waits = connections_->IsBusyWithTheShut() && Connections::Clock::now() < last_accept + kMaxWait;
    for (size_t i = 0; i < sockets_.size(); ++i) {
      watched[i].events = waits ? 0 : POLLIN;
    }
    poll(watched.data(), watched.size(), waits ? kWaitMs : connections_->Count() == 0 ? -1 : kPeerLookMs);
    if (some_closed.revents != 0) {
      connections_->Sweep();
    }
    if (const auto now = Connections::Clock::now(); now - last_look >= std::chrono::milliseconds(kPeerLookMs)) {
      connections_->ShutUnread();
      last_look = now;
    }
    bool is_well = true;
    for (size_t i = 0; i < sockets_.size(); ++i) {
      if (watched[i].revents != 0) {
        last_accept = Connections::Clock::now();
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
    sockaddr_storage peer = {};
    socklen_t size = sizeof(peer);
    FileDescriptor connection(accept4(socket, reinterpret_cast<sockaddr*>(&peer), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (connection.get() >= 0) {
      HandOver(socket, std::move(connection), peer);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return true;
    } else if (!IsOfOneConnection(errno)) {
      LogTrouble(absl::StrCat("connections have to wait: ", strerror(errno)));
      return false;
    }
  }
}

void Listener::HandOver(int socket, FileDescriptor connection, const sockaddr_storage& peer) {
  // Descriptors are given out from the lowest: this one says how many there are at least.
  if (connection.get() >= DescriptorLimit() || !connections_->Add(connection.get(), peer)) {
    LogTrouble(
        "a connection was closed at once: the file descriptors of this process are used up; raise their limit (ulimit "
        "-n)");
    return;
  }
  const int on = 1;
  setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
  parameters.listener_fd = socket;
  parameters.fd = connection.Release();
  acceptor_->HandleNewConnection(&parameters);
}

void Listener::LogTrouble(const std::string& what) {
  const absl::Duration now = SinceBoot();
  if (now - last_log_ < kLogInterval) {
    ++unlogged_;
    return;
  }
  last_log_ = now;
  log_->warn("{} ({} times more since the last such line)", what, std::exchange(unlogged_, 0));
}

}  // namespace wellspace::server
