// Sockets that listen at an address.
#ifndef WELLSPACE_SERVER_NETWORK_LISTENING_SOCKETS_H_
#define WELLSPACE_SERVER_NETWORK_LISTENING_SOCKETS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "server/base/file_descriptor.h"
#include "server/network/listen_address.h"

namespace wellspace::server {

struct ListeningSockets {
  std::vector<FileDescriptor> sockets;  // do not block
  uint16_t port = 0;                    // of all of them
};

// Listens at `address`; a name is listened on at all of its addresses that this machine has.
//
// Errors:     UNAVAILABLE: the address is not of this machine, or its port is in use.
absl::StatusOr<ListeningSockets> ListenOn(const ListenAddress& address);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_NETWORK_LISTENING_SOCKETS_H_
