// What the service manager is told, read from a socket in its place.
#include "server/base/service_manager.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <string>

#include "gtest/gtest.h"
#include "server/base/file_descriptor.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

// The socket of a service manager, at `name`, which the environment of the test has as NOTIFY_SOCKET.
class Manager {
 public:
  explicit Manager(const std::string& name) : name_(name), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    memcpy(address.sun_path, name.data(), name.size());
    if (name[0] == '@') {
      address.sun_path[0] = '\0';
    }
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), length), 0) << strerror(errno);
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
  }
  ~Manager() {
    unsetenv("NOTIFY_SOCKET");
    unlink(name_.c_str());
  }

  // The next state that came; empty: none.
  std::string Next() {
    char buffer[256];
    const ssize_t got = recv(socket_.get(), buffer, sizeof(buffer), 0);
    return got < 0 ? "" : std::string(buffer, static_cast<size_t>(got));
  }

 private:
  const std::string name_;
  const FileDescriptor socket_;
};

TEST(ServiceManager, IsToldAtItsPath) {
  const TemporaryFolder folder;
  Manager manager(folder.Path("notify"));
  TellServiceManager("READY=1");
  TellServiceManager("STOPPING=1");
  EXPECT_EQ(manager.Next(), "READY=1");
  EXPECT_EQ(manager.Next(), "STOPPING=1");
  EXPECT_EQ(manager.Next(), "");
}

TEST(ServiceManager, IsToldByAnAbstractName) {
  Manager manager("@wellspace-test-" + std::to_string(getpid()));
  TellServiceManager("READY=1");
  EXPECT_EQ(manager.Next(), "READY=1");
}

TEST(ServiceManager, NeedNotBeThere) {
  unsetenv("NOTIFY_SOCKET");
  TellServiceManager("READY=1");
  for (const std::string& name : {std::string(), std::string("/nowhere/notify"), std::string(5000, 'x')}) {
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
    TellServiceManager("READY=1");
  }
  unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace wellspace::server
