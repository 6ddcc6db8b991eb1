#include "server/network/listening_sockets.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace wellspace::server {
namespace {

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

}  // namespace

absl::StatusOr<ListeningSockets> ListenOn(const ListenAddress& address) {
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
  return ListeningSockets{.sockets = std::move(sockets), .port = port};
}

}  // namespace wellspace::server
