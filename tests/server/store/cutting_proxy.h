// Between a program and its database: a connection that breaks at the worst moment.
#ifndef WELLSPACE_TESTS_SERVER_STORE_CUTTING_PROXY_H_
#define WELLSPACE_TESTS_SERVER_STORE_CUTTING_PROXY_H_

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <string_view>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

namespace wellspace::server {

// Forwards connections of the loopback to another port of it, and breaks those in which a transaction is committed,
// while it is told to: before the database hears of it, or once it has answered, unheard.
//
// Thread safety: thread-safe.
class CuttingProxy {
 public:
  // kForGood: as kAfterCommit, and no connection is made any more.
  enum class Cut { kNever, kBeforeCommit, kAfterCommit, kForGood };

  explicit CuttingProxy(int port) : to_(port), listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = AddressOf(0);
    socklen_t size = sizeof(address);
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(listen(listener_, 16), 0);
    port_ = ntohs(address.sin_port);
    threads_.emplace_back([this] { Accept(); });
  }
  ~CuttingProxy() {
    is_ending_ = true;
    threads_[0].join();
    for (size_t i = 1; i < threads_.size(); ++i) {
      threads_[i].join();
    }
    close(listener_);
  }
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  int port() const { return port_; }
  // The next commit is cut so.
  void CutNext(Cut cut) { cut_ = cut; }

 private:
  static constexpr int kLookMs = 20;

  static sockaddr_in AddressOf(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    return address;
  }

  void Accept() {
    while (!is_ending_) {
      pollfd wait{.fd = listener_, .events = POLLIN, .revents = 0};
      if (poll(&wait, 1, kLookMs) > 0) {
        threads_.emplace_back([this, client = accept(listener_, nullptr, nullptr)] { Forward(client); });
      }
    }
  }

  void Forward(int client) {
    const int server = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = AddressOf(to_);
    if (!is_broken_ && connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
      std::array<pollfd, 2> wait = {pollfd{.fd = client, .events = POLLIN, .revents = 0},
                                    pollfd{.fd = server, .events = POLLIN, .revents = 0}};
      bool is_open = true;
      bool drops_answer = false;
      while (is_open && !is_ending_) {
        if (poll(wait.data(), wait.size(), kLookMs) <= 0) {
          continue;
        }
        if (wait[1].revents != 0) {
          is_open = !drops_answer && Copy(server, client, nullptr);
        } else if (wait[0].revents != 0) {
          Cut cut = Cut::kNever;
          is_open = Copy(client, server, &cut) && cut != Cut::kBeforeCommit;
          drops_answer = cut == Cut::kAfterCommit || cut == Cut::kForGood;
          is_broken_ = is_broken_ || cut == Cut::kForGood;
        }
      }
    }
    close(client);
    close(server);
  }

  // Copies what is there. With `cut`: says how the commit in it is to be cut, and copies none that is cut before.
  bool Copy(int from, int to, Cut* cut) {
    std::array<char, 65536> bytes;
    const ssize_t count = recv(from, bytes.data(), bytes.size(), 0);
    if (count <= 0) {
      return false;
    }
    if (cut != nullptr && std::string_view(bytes.data(), count).find("COMMIT") != std::string_view::npos) {
      *cut = cut_.exchange(Cut::kNever);
    }
    return (cut != nullptr && *cut == Cut::kBeforeCommit) || send(to, bytes.data(), count, MSG_NOSIGNAL) == count;
  }

  const int to_;
  const int listener_;
  int port_ = 0;
  std::atomic<Cut> cut_ = Cut::kNever;
  std::atomic<bool> is_broken_ = false;
  std::atomic<bool> is_ending_ = false;
  std::vector<std::thread> threads_;  // the first accepts, and makes the others
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_CUTTING_PROXY_H_
