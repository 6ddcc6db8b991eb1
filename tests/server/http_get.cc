#include "tests/server/http_get.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"

namespace wellspace::server {

int SendHttp(const std::string& address, const std::string& bytes) {
  const size_t colon = address.rfind(':');
  sockaddr_in server = {};
  server.sin_family = AF_INET;
  server.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(colon + 1))));
  EXPECT_EQ(inet_pton(AF_INET, address.substr(0, colon).c_str(), &server.sin_addr), 1) << address;
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval patience = {.tv_sec = 60, .tv_usec = 0};
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  EXPECT_EQ(connect(socket, reinterpret_cast<const sockaddr*>(&server), sizeof(server)), 0) << address;
  EXPECT_EQ(send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  return socket;
}

std::string ReadHttp(int socket) {
  std::string text;
  char buffer[4096];
  for (ssize_t got = 1; got > 0; text.append(buffer, static_cast<size_t>(got > 0 ? got : 0))) {
    got = recv(socket, buffer, sizeof(buffer), 0);
  }
  return text;
}

std::string HttpGet(const std::string& address, const std::string& path) {
  const int socket = SendHttp(address, absl::StrCat("GET ", path, " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  std::string response = ReadHttp(socket);
  close(socket);
  return response;
}

double MetricAt(const std::string& address, const std::string& name) {
  const std::string metrics = HttpGet(address, "/metrics");
  const std::string start = absl::StrCat("\n", name, " ");
  const size_t found = metrics.find(start);
  return found == std::string::npos ? -1 : std::stod(metrics.substr(found + start.size()));
}

}  // namespace wellspace::server
