// Messages of the process to the service manager that started it: that it serves, and that it stops.
#ifndef WELLSPACE_SERVER_BASE_SERVICE_MANAGER_H_
#define WELLSPACE_SERVER_BASE_SERVICE_MANAGER_H_

#include <string_view>

namespace wellspace::server {

// Sends `state`, "READY=1" for example, to the datagram socket that NOTIFY_SOCKET names: a path, or an abstract name
// after '@'. Without that variable nothing is sent. A state that cannot be sent is lost: the manager has a limit of
// its own for how long it waits.
//
// Threads:    any, while none changes the environment.
// Source:     sd_notify(3), whose protocol systemd promises to keep; a library for it would be one more to ship.
void TellServiceManager(std::string_view state);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_SERVICE_MANAGER_H_
