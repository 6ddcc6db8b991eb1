#include "client/address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

constexpr std::string_view kSchemeEnd = "://";

std::optional<std::string> HostBeforePort(const std::string& address) {
  const size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return std::nullopt;
  }
  uint16_t port = 0;
  const char* last = address.data() + address.size();
  const auto [end, code] = std::from_chars(address.data() + colon + 1, last, port);
  if (code != std::errc() || end != last || port == 0) {
    return std::nullopt;
  }
  std::string host = address.substr(0, colon);
  return host.front() == '[' && host.back() == ']' ? host.substr(1, host.size() - 2) : host;
}

// Of a URL: the part that is too much, and the rest.
absl::Status UrlError(const std::string& address, size_t scheme_end) {
  const std::string scheme = address.substr(0, scheme_end + kSchemeEnd.size());
  std::string rest = address.substr(scheme.size());
  rest = rest.substr(0, rest.find('/'));
  const bool names_tls = absl::EndsWithIgnoreCase(address.substr(0, scheme_end), "s");
  return absl::InvalidArgumentError(
      absl::StrCat("'", address, "' is no address of a server, but a URL; expected HOST:PORT without ", scheme,
                   HostBeforePort(rest).has_value() ? absl::StrCat(", ", rest) : "",
                   names_tls ? ", and TLS asked for by its own option, --tls" : ""));
}

std::optional<std::string> Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::nullopt : std::make_optional<std::string>(value);
}

bool IsNameOrNumber(const std::string& host) {
  return std::ranges::all_of(
      host, [](unsigned char c) { return absl::ascii_isalnum(c) || c == '-' || c == '.' || c == '_'; });
}

bool IsExempt(const std::string& host) {
  std::optional<std::string> exempt = Environment("no_grpc_proxy");
  if (!exempt.has_value()) {
    exempt = Environment("no_proxy");
  }
  for (const absl::string_view suffix : absl::StrSplit(exempt.value_or(""), ',', absl::SkipEmpty())) {
    if (absl::EndsWithIgnoreCase(host, suffix)) {
      return true;
    }
  }
  return false;
}

}  // namespace

absl::StatusOr<std::string> HostOf(const std::string& address) {
  if (const size_t scheme_end = address.find(kSchemeEnd); scheme_end != std::string::npos) {
    return UrlError(address, scheme_end);
  }
  std::optional<std::string> host = HostBeforePort(address);
  if (!host.has_value() || host->find('/') != std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", address, "' is no address of a server; expected HOST:PORT with a port from 1 to 65535"));
  }
  return *std::move(host);
}

absl::StatusOr<std::string> HostOfNamed(const std::string& address) {
  WELLSPACE_ASSIGN_OR_RETURN(std::string host, HostOf(address));
  constexpr size_t kLongestName = 253;
  in6_addr ipv6;
  const bool is_right = address.front() == '[' ? inet_pton(AF_INET6, host.c_str(), &ipv6) == 1
                                               : IsNameOrNumber(host) && host.size() <= kLongestName;
  if (!is_right) {
    return absl::InvalidArgumentError(
        "expected HOST:PORT, with the name of a host, its IPv4 address, or its IPv6 address in brackets");
  }
  return host;
}

std::string TargetOf(const std::string& address) {
  // IPv6 in its brackets begins no URI.
  return IsNameOrNumber(address.substr(0, address.rfind(':'))) ? absl::StrCat("dns:///", address) : address;
}

bool IsLoopback(const std::string& host) {
  const bool ipv4 = host.find_first_not_of("0123456789.") == std::string::npos;
  if (ipv4) {
    return host.rfind("127.", 0) == 0;
  }
  in6_addr ipv6;
  if (inet_pton(AF_INET6, host.c_str(), &ipv6) == 1) {
    return IN6_IS_ADDR_LOOPBACK(&ipv6) || (IN6_IS_ADDR_V4MAPPED(&ipv6) && ipv6.s6_addr[12] == 127);
  }
  return absl::EqualsIgnoreCase(host, "localhost");
}

std::optional<Proxy> ProxyFor(const std::string& host) {
  for (const char* variable : {"grpc_proxy", "https_proxy", "http_proxy"}) {
    const std::optional<std::string> url = Environment(variable);
    if (!url.has_value()) {
      continue;
    }
    // An empty one means none; gRPC takes no other scheme, and then goes without a proxy.
    constexpr std::string_view kScheme = "http://";
    if (!absl::StartsWithIgnoreCase(*url, absl::string_view(kScheme.data(), kScheme.size())) || IsExempt(host)) {
      return std::nullopt;
    }
    std::string authority = url->substr(kScheme.size());
    authority = authority.substr(0, authority.find('/'));
    if (const size_t credentials = authority.rfind('@'); credentials != std::string::npos) {
      authority = authority.substr(credentials + 1);
    }
    return Proxy{.address = absl::StrCat("http://", authority), .variable = variable};
  }
  return std::nullopt;
}

}  // namespace wellspace::client
