// HOST:PORT, and the proxies that the environment puts before it.
#ifndef WELLSPACE_CLIENT_ADDRESS_H_
#define WELLSPACE_CLIENT_ADDRESS_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"

namespace wellspace::client {

// The host of HOST:PORT, without the brackets of IPv6.
//
// Errors:     INVALID_ARGUMENT for anything else, saying what is too much in a URL, such as http://HOST:PORT.
absl::StatusOr<std::string> HostOf(const std::string& address);

// The same of an address that a server has named: nothing but a name of DNS or a number, IPv6 in brackets, and a port.
absl::StatusOr<std::string> HostOfNamed(const std::string& address);

// `address`, HOST:PORT, as gRPC takes it for that and nothing else: unix:7233 would be a file.
std::string TargetOf(const std::string& address);

// Whether `host` is this machine's loopback by its name or number alone; names are not looked up.
bool IsLoopback(const std::string& host);

struct Proxy {
  std::string address;   // without credentials
  std::string variable;  // of the environment, from which it is
};

// The proxy by which gRPC reaches `host`, unless the channel forbids it: that of grpc_proxy, https_proxy or http_proxy,
// the first that is set, unless no_grpc_proxy or no_proxy name the host. None if there is none, or none that gRPC can
// use.
std::optional<Proxy> ProxyFor(const std::string& host);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_ADDRESS_H_
