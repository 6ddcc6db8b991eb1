// The address that a server listens on.
#ifndef WELLSPACE_SERVER_NETWORK_LISTEN_ADDRESS_H_
#define WELLSPACE_SERVER_NETWORK_LISTEN_ADDRESS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace wellspace::server {

struct ListenAddress {
  std::string host;  // a name or an IPv4 or IPv6 address, the latter without brackets
  uint16_t port = 0;

  // Whether only this machine can reach it: 127.0.0.0/8, ::1 or "localhost".
  bool IsLoopback() const;

  // "HOST:PORT", brackets around an IPv6 address.
  std::string ToString() const;
};

// Reads "HOST:PORT" or "[IPV6]:PORT".
//
// Errors:     INVALID_ARGUMENT, with the text and what would be accepted.
absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_NETWORK_LISTEN_ADDRESS_H_
