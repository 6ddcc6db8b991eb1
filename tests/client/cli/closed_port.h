// An address at which no server is.
#ifndef WELLSPACE_TESTS_CLIENT_CLI_CLOSED_PORT_H_
#define WELLSPACE_TESTS_CLIENT_CLI_CLOSED_PORT_H_

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>

namespace wellspace {

// A port of the loopback that is bound, and that no process listens to.
class ClosedPort {
 public:
  ClosedPort() : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof(address);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), length), 0);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length), 0);
    number_ = ntohs(address.sin_port);
  }
  ~ClosedPort() { close(socket_); }
  ClosedPort(const ClosedPort&) = delete;
  ClosedPort& operator=(const ClosedPort&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(number_); }

 private:
  int socket_;
  uint16_t number_ = 0;
};

}  // namespace wellspace

#endif  // WELLSPACE_TESTS_CLIENT_CLI_CLOSED_PORT_H_
