#include "server/network/listen_address.h"

#include <arpa/inet.h>

#include <charconv>

#include "absl/strings/str_cat.h"

namespace wellspace::server {
namespace {

bool IsIpv6(const std::string& host) {
  in6_addr address;
  return inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

}  // namespace

bool ListenAddress::IsLoopback() const {
  if (in_addr ipv4; inet_pton(AF_INET, host.c_str(), &ipv4) == 1) {
    return (ntohl(ipv4.s_addr) >> 24) == 127;
  }
  if (in6_addr ipv6; inet_pton(AF_INET6, host.c_str(), &ipv6) == 1) {
    return IN6_IS_ADDR_LOOPBACK(&ipv6);
  }
  return host == "localhost";
}

std::string ListenAddress::ToString() const {
  return IsIpv6(host) ? absl::StrCat("[", host, "]:", port) : absl::StrCat(host, ":", port);
}

absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text) {
  const absl::Status error = absl::InvalidArgumentError(
      absl::StrCat("cannot listen on '", text, "'; expected HOST:PORT or [IPV6]:PORT with a port from 0 to 65535"));
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return error;
  }
  ListenAddress address;
  address.host = text.substr(0, colon);
  if (address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
    if (!IsIpv6(address.host)) {
      return error;
    }
  } else if (address.host.find_first_of(":[]/% ") != std::string::npos) {
    return error;
  }
  const char* first = text.data() + colon + 1;
  const char* last = text.data() + text.size();
  const auto [end, code] = std::from_chars(first, last, address.port);
  if (code != std::errc() || end != last) {
    return error;
  }
  return address;
}

}  // namespace wellspace::server
