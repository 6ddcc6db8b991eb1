#include "server/base/service_manager.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstddef>

#include "server/base/file_descriptor.h"

namespace wellspace::server {

void TellServiceManager(std::string_view state) {
  const char* const name = getenv("NOTIFY_SOCKET");
  sockaddr_un address = {};
  if (name == nullptr || name[0] == '\0' || strlen(name) >= sizeof(address.sun_path)) {
    return;
  }
  address.sun_family = AF_UNIX;
  memcpy(address.sun_path, name, strlen(name));
  if (name[0] == '@') {
    address.sun_path[0] = '\0';
  }
  const FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.get() >= 0) {
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + strlen(name));
    (void)sendto(socket.get(), state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address),
                 length);
  }
}

}  // namespace wellspace::server
