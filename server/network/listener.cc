#include "server/network/listener.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/base/descriptor_limit.h"
#include "server/network/listening_sockets.h"

namespace wellspace::server {
namespace {

// The delay of another attempt, after one that failed for want of descriptors or memory.
constexpr int kPauseMs = 100;

// While calls of connections that were shut are worked off, how often it is looked whether they are, and how long
// nothing is accepted at most.
constexpr int kWaitMs = 10;
constexpr std::chrono::milliseconds kMaxWait(500);

// The interval of looks for connections whose peers do not read.
constexpr std::chrono::milliseconds kUnreadInterval(5000);

constexpr absl::Duration kLogInterval = absl::Seconds(10);

// Does something every now and then.
class Timer {
 public:
  using Clock = Connections::Clock;

  // Whether `interval` has passed since this was last true.
  bool IsDue(std::chrono::milliseconds interval) {
    const Clock::time_point now = Clock::now();
    const bool is_due = now - last_ >= interval;
    last_ = is_due ? now : last_;
    return is_due;
  }

 private:
  Clock::time_point last_ = Clock::now();
};

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

void Listener::Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor, Connections& connections,
                     bool keeps_files) {
  acceptor_ = std::move(acceptor);
  keeps_files_ = keeps_files;
  connections_ = &connections;
  stop_ = FileDescriptor(eventfd(0, EFD_CLOEXEC));
  has_accepted_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  watching_ = std::thread([this] { WatchUntilStopped(); });
  accepting_ = std::thread([this] { AcceptUntilStopped(); });
}

void Listener::Stop() {
  if (accepting_.joinable()) {
    eventfd_write(stop_.get(), 1);
    accepting_.join();
    watching_.join();
  }
  sockets_.clear();
}

void Listener::WatchUntilStopped() {
  pollfd watched[] = {{.fd = stop_.get(), .events = POLLIN, .revents = 0},
                      {.fd = connections_->descriptor(), .events = POLLIN, .revents = 0},
                      {.fd = has_accepted_.get(), .events = POLLIN, .revents = 0}};
  const auto& [stop, some_closed, has_accepted] = watched;
  Timer unread;
  Timer unclaimed;
  while (stop.revents == 0) {
    const std::chrono::milliseconds look = connections_->LookInterval();
    poll(watched, std::size(watched), connections_->Count() == 0 ? -1 : static_cast<int>(look.count()));
    if (has_accepted.revents != 0) {
      eventfd_t ignored = 0;
      eventfd_read(has_accepted.fd, &ignored);
    }
    if (some_closed.revents != 0) {
      connections_->Sweep();
    }
    if (unclaimed.IsDue(look)) {
      connections_->ShutUnclaimed();
    }
    if (unread.IsDue(kUnreadInterval)) {
      connections_->ShutUnread();
    }
  }
}

void Listener::AcceptUntilStopped() {
  std::vector<pollfd> watched;
  for (const FileDescriptor& socket : sockets_) {
    watched.push_back({.fd = socket.get(), .events = POLLIN, .revents = 0});
  }
  watched.push_back({.fd = stop_.get(), .events = POLLIN, .revents = 0});
  pollfd& stop = watched.back();
  Connections::Clock::time_point last_accept = Connections::Clock::now();
  while (true) {
    // Connections wait in the system's queue.
    const bool waits = connections_->IsBusyWithTheShut() && Connections::Clock::now() < last_accept + kMaxWait;
    for (size_t i = 0; i < sockets_.size(); ++i) {
      watched[i].events = waits ? 0 : POLLIN;
    }
    poll(watched.data(), watched.size(), waits ? kWaitMs : -1);
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

bool Listener::HasRoomFor(const FileDescriptor& connection) const {
  const uint64_t limit = DescriptorLimit();
  // Descriptors are given out from the lowest: this one says how many there are at least.
  return static_cast<uint64_t>(connection.get()) < limit - SpareDescriptors(limit, keeps_files_);
}

void Listener::HandOver(int socket, FileDescriptor connection, const sockaddr_storage& peer) {
  if (connections_->Has(peer)) {
    return;  // the peer comes again from another port
  }
  if (connections_->Count() >= kMostConnections) {
    LogTrouble(absl::StrCat("a connection was closed at once: there are ", kMostConnections, " already"));
    return;
  }
  if (!HasRoomFor(connection) || !connections_->Add(connection.get(), peer)) {
    LogTrouble(
        "a connection was closed at once: the file descriptors of this process are used up; raise their limit (ulimit "
        "-n)");
    return;
  }
  eventfd_write(has_accepted_.get(), 1);
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
