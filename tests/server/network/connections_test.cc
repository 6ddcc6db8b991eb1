// The limits of a connection, beyond which it is shut, with pairs of sockets in the place of connections.
#include "server/network/connections.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "spdlog/logger.h"

namespace wellspace::server {
namespace {

sockaddr_storage Ipv4(const std::string& address, uint16_t port) {
  sockaddr_storage peer = {};
  auto& ipv4 = reinterpret_cast<sockaddr_in&>(peer);
  ipv4.sin_family = AF_INET;
  ipv4.sin_port = htons(port);
  EXPECT_EQ(inet_pton(AF_INET, address.c_str(), &ipv4.sin_addr), 1);
  return peer;
}

sockaddr_storage Ipv6(const std::string& address, uint16_t port) {
  sockaddr_storage peer = {};
  auto& ipv6 = reinterpret_cast<sockaddr_in6&>(peer);
  ipv6.sin6_family = AF_INET6;
  ipv6.sin6_port = htons(port);
  EXPECT_EQ(inet_pton(AF_INET6, address.c_str(), &ipv6.sin6_addr), 1);
  return peer;
}

TEST(PeerKey, IsTheSameHoweverThePeerIsWritten) {
  EXPECT_EQ(PeerKey("ipv4:10.0.0.1:1234"), PeerKey(Ipv4("10.0.0.1", 1234)));
  EXPECT_EQ(PeerKey("ipv4:10.0.0.1:1234"), PeerKey(Ipv6("::ffff:10.0.0.1", 1234)));
  for (const char* peer : {"ipv6:[fe80::1]:99", "ipv6:%5Bfe80::1%5D:99", "ipv6:%5bfe80::1%25eth0%5d:99"}) {
    EXPECT_EQ(PeerKey(peer), PeerKey(Ipv6("fe80::1", 99))) << peer;
  }
  EXPECT_NE(PeerKey("ipv4:10.0.0.1:1234"), PeerKey("ipv4:10.0.0.1:1235"));
  EXPECT_NE(PeerKey("ipv4:10.0.0.1:1234"), PeerKey("ipv4:10.0.0.2:1234"));
  for (const char* peer : {"", "unknown", "unix:", "unix:/tmp/x:1", "ipv4:", "ipv4:1", "ipv4:10.0.0.1:", "ipv6::1",
                           "ipv4:10.0.0.1:65536", "ipv4:nonsense:1", "ipv6:[nonsense]:1"}) {
    EXPECT_EQ(PeerKey(std::string_view(peer)), "") << peer;
  }
}

// The server's end of a connection, and the peer's.
class Pair {
 public:
  Pair() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    server = FileDescriptor(ends[0]);
    peer = FileDescriptor(ends[1]);
  }

  bool IsShut() const {
    char byte = 0;
    return recv(peer.get(), &byte, 1, MSG_DONTWAIT) == 0;
  }

  FileDescriptor server;
  FileDescriptor peer;
};

class ConnectionsTest : public ::testing::Test {
 protected:
  static constexpr int kMaxStreams = 200;
  static constexpr int kMostCalls = kMaxStreams * 3 / 2 + Connections::kSlack;
  static constexpr char kPeer[] = "ipv4:10.0.0.1:1";

  // `count` calls that are over at once.
  void Waste(const char* peer, int count) {
    for (int i = 0; i < count; ++i) {
      const auto connection = connections_.CallBegan(peer, false);
      if (connection != nullptr) {
        connections_.CallEnded(*connection, {.is_wasted = true});
      }
    }
  }

  // Twice: bytes that are there for a moment do not count.
  void Look() {
    connections_.ShutUnclaimed();
    connections_.ShutUnclaimed();
  }

  Connections connections_{{.max_streams = kMaxStreams, .max_calls = 1000}, std::make_shared<spdlog::logger>("none")};
};

TEST_F(ConnectionsTest, AsManyCallsAsClientsAreToldAndSomeMoreAreServed) {
  const Pair pair;
  ASSERT_TRUE(connections_.Add(pair.server.get(), Ipv4("10.0.0.1", 1)));
  for (int i = 0; i < kMostCalls; ++i) {
    ASSERT_NE(connections_.CallBegan(kPeer, false), nullptr);
  }
  EXPECT_FALSE(pair.IsShut());
  connections_.CallBegan(kPeer, false);
  EXPECT_TRUE(pair.IsShut());
  EXPECT_EQ(connections_.ShutCount(), 1u);
  EXPECT_TRUE(connections_.IsBusyWithTheShut() == (kMostCalls + 1 > Connections::kMostOrphans));
}

TEST_F(ConnectionsTest, CallsThatHaveEndedDoNotCount) {
  const Pair pair;
  ASSERT_TRUE(connections_.Add(pair.server.get(), Ipv4("10.0.0.1", 1)));
  for (int i = 0; i < 10 * kMostCalls; ++i) {
    connections_.CallEnded(*connections_.CallBegan(kPeer, false), {});
  }
  EXPECT_FALSE(pair.IsShut());
}

TEST_F(ConnectionsTest, WasteIsBoundedAndHalvedForAHostThatWasShut) {
  for (const int allowed : {kMaxStreams, kMaxStreams / 2, kMaxStreams / 4, kMaxStreams / 8, 16, 16}) {
    const Pair pair;
    ASSERT_TRUE(connections_.Add(pair.server.get(), Ipv4("10.0.0.1", 1)));
    Waste(kPeer, allowed < Connections::kLeastWasteOfABadHost ? Connections::kLeastWasteOfABadHost : allowed);
    EXPECT_FALSE(pair.IsShut()) << allowed;
    Waste(kPeer, 1);
    EXPECT_TRUE(pair.IsShut()) << allowed;
  }
  // Others have done nothing.
  const Pair other;
  ASSERT_TRUE(connections_.Add(other.server.get(), Ipv4("10.0.0.2", 1)));
  Waste("ipv4:10.0.0.2:1", kMaxStreams);
  EXPECT_FALSE(other.IsShut());
}

TEST_F(ConnectionsTest, AllTogetherAreBoundedAtTheCostOfTheBusiest) {
  std::vector<Pair> pairs(5);
  for (uint16_t i = 0; i < pairs.size(); ++i) {
    ASSERT_TRUE(connections_.Add(pairs[i].server.get(), Ipv4("10.0.0.1", i)));
    const int calls = i == 2 ? 300 : 175;
    for (int call = 0; call < calls; ++call) {
      connections_.CallBegan(absl::StrCat("ipv4:10.0.0.1:", i), false);
    }
  }
  for (size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(pairs[i].IsShut(), false) << i;
  }
  connections_.CallBegan("ipv4:10.0.0.1:0", false);
  for (size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(pairs[i].IsShut(), i == 2) << i;
  }
}

TEST_F(ConnectionsTest, WhatIsClosedIsForgotten) {
  Pair pair;
  ASSERT_TRUE(connections_.Add(pair.server.get(), Ipv4("10.0.0.1", 1)));
  const auto connection = connections_.CallBegan(kPeer, false);
  connections_.Sweep();
  EXPECT_EQ(connections_.Count(), 1u);
  shutdown(pair.server.get(), SHUT_RDWR);  // as gRPC does
  connections_.Sweep();
  EXPECT_EQ(connections_.Count(), 0u);
  EXPECT_EQ(connections_.CallBegan(kPeer, false), nullptr);
  connections_.CallEnded(*connection, {.is_wasted = true});
  EXPECT_EQ(connections_.ShutCount(), 0u);
}

// A connection over TCP on this machine: the server's end, and the peer's.
std::pair<FileDescriptor, FileDescriptor> TcpPair() {
  const FileDescriptor listening(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_storage address = Ipv4("127.0.0.1", 0);
  socklen_t size = sizeof(sockaddr_in);
  EXPECT_EQ(bind(listening.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(listen(listening.get(), 1), 0);
  EXPECT_EQ(getsockname(listening.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  FileDescriptor peer(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(connect(peer.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
  FileDescriptor server(accept4(listening.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  return {std::move(server), std::move(peer)};
}

bool HasHungUp(int socket, int milliseconds = 0) {
  pollfd watched = {.fd = socket, .events = 0, .revents = 0};
  return poll(&watched, 1, milliseconds) == 1 && (watched.revents & POLLHUP) != 0;
}

TEST(Connections, APeerThatReadsNothingIsShut) {
  Connections connections({.max_streams = 1, .max_calls = 1, .max_unread = std::chrono::seconds(0)},
                          std::make_shared<spdlog::logger>("none"));
  const auto [server, peer] = TcpPair();
  ASSERT_TRUE(connections.Add(server.get(), Ipv4("127.0.0.1", 1)));
  // Nothing waits for it.
  connections.ShutUnread();
  connections.ShutUnread();
  EXPECT_FALSE(HasHungUp(server.get()));
  const std::string bytes(65536, 'x');
  while (send(server.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0) {
  }
  connections.ShutUnread();  // by now something has been taken, into the buffers of the peer
  EXPECT_FALSE(HasHungUp(server.get()));
  connections.ShutUnread();
  EXPECT_TRUE(HasHungUp(server.get()));
  EXPECT_EQ(connections.ShutCount(), 1u);
}

TEST_F(ConnectionsTest, APeerWhoFoundTheWindowClosedHearsOfTheEndAtOnce) {
  auto [server, peer] = TcpPair();
  ASSERT_TRUE(connections_.Add(server.get(), Ipv4("127.0.0.1", 1)));
  const std::string bytes(65536, 'x');
  pollfd writable = {.fd = peer.get(), .events = POLLOUT, .revents = 0};
  constexpr int kUntilTheWindowIsClosed = 1000;  // ms; Linux fills the last of it after 200
  while (poll(&writable, 1, kUntilTheWindowIsClosed) == 1) {
    send(peer.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  shutdown(server.get(), SHUT_RDWR);  // as gRPC does
  server = FileDescriptor();
  connections_.Sweep();
  EXPECT_EQ(connections_.Count(), 0u);
  constexpr int kPatience = 5000;  // ms; without a reset Linux takes 60 s
  EXPECT_TRUE(HasHungUp(peer.get(), kPatience));
}

// A connection over TCP, of which gRPC has read all that came.
class SendingPeer {
 public:
  SendingPeer(Connections& connections, uint16_t port, const std::string& host = "10.0.0.1")
      : name_(absl::StrCat("ipv4:", host, ":", port)) {
    std::tie(server_, peer_) = TcpPair();
    EXPECT_TRUE(connections.Add(server_.get(), Ipv4(host, port)));
  }

  const std::string& name() const { return name_; }

  void Send(int64_t bytes) {
    std::string piece(65536, 'x');
    while (bytes > 0) {
      piece.resize(std::min<size_t>(piece.size(), bytes));
      ASSERT_EQ(send(peer_.get(), piece.data(), piece.size(), MSG_NOSIGNAL), static_cast<ssize_t>(piece.size()));
      bytes -= static_cast<int64_t>(piece.size());
      // The last of it has come when it is read.
      for (size_t left = piece.size(); left > 0;) {
        pollfd readable = {.fd = server_.get(), .events = POLLIN, .revents = 0};
        ASSERT_EQ(poll(&readable, 1, -1), 1);
        const ssize_t got = recv(server_.get(), nullptr, left, MSG_TRUNC | MSG_DONTWAIT);
        ASSERT_GT(got, 0);
        left -= got;
      }
    }
  }

  bool IsShut() const { return HasHungUp(server_.get()); }

 private:
  const std::string name_;
  FileDescriptor server_;
  FileDescriptor peer_;
};

constexpr int64_t kLittle = 4096;
constexpr int64_t kBeginning = 8192;

TEST_F(ConnectionsTest, WhatNoCallClaimsIsBoundedAndHalvedForAHostThatWasShut) {
  constexpr int64_t kMost = Connections::kMostUnclaimed;
  constexpr int64_t kLeast = Connections::kLeastUnclaimedOfABadHost;
  for (const int64_t allowed : {kMost, kMost / 2, kMost / 4, kMost / 8, kMost / 16, kMost / 32, kLeast, kLeast}) {
    SendingPeer peer(connections_, 1);
    peer.Send(kBeginning + allowed);
    Look();
    EXPECT_FALSE(peer.IsShut()) << allowed;
    peer.Send(kLittle);
    Look();
    EXPECT_TRUE(peer.IsShut()) << allowed;
    connections_.Sweep();
  }
  EXPECT_EQ(connections_.ShutCount(), 8u);
}

// gRPC hands a call of one message over when that has come: it takes seconds where a network is slow.
TEST_F(ConnectionsTest, OneOfTheLargestMessagesMayComeSlowlyBeforeItsCallBegins) {
  SendingPeer peer(connections_, 1);
  for (int i = 0; i < 64; ++i) {
    peer.Send(kMaxRequestBytes / 64);
    Look();
    ASSERT_FALSE(peer.IsShut()) << i;
  }
}

TEST_F(ConnectionsTest, WhatComesBeforeAnyCallIsLookedAtOnce) {
  SendingPeer peer(connections_, 1);
  peer.Send(Connections::kMostUnclaimed + kBeginning + kLittle);
  connections_.ShutUnclaimed();
  EXPECT_TRUE(peer.IsShut());
}

TEST_F(ConnectionsTest, WhatComesBehindCallsIsLookedAtTwiceUnlessItIsMuch) {
  constexpr int64_t kUnbegun = Connections::kUnderWayOfACall + 2 * Connections::kMostUnclaimed;
  SendingPeer peer(connections_, 1);
  const auto connection = connections_.CallBegan(peer.name(), true);
  connections_.CallEnded(*connection, {.is_known = true});
  peer.Send(kUnbegun);
  connections_.ShutUnclaimed();
  EXPECT_FALSE(peer.IsShut());
  // Its calls have begun by now, and have had their messages.
  Connections::Claim(*connection, kUnbegun);
  Look();
  EXPECT_FALSE(peer.IsShut());
  peer.Send(Connections::kMostUnclaimedAtOnce + Connections::kUnderWayOfACall + kBeginning + kLittle);
  connections_.ShutUnclaimed();
  EXPECT_TRUE(peer.IsShut());
}

TEST_F(ConnectionsTest, WhatCallsClaimIsNotBounded) {
  SendingPeer peer(connections_, 1);
  const auto connection = connections_.CallBegan(peer.name(), false);
  for (int i = 0; i < 20; ++i) {
    peer.Send(Connections::kMostUnclaimed);
    Connections::Claim(*connection, Connections::kMostUnclaimed);
    Look();
    ASSERT_FALSE(peer.IsShut()) << i;
  }
  EXPECT_EQ(connections_.UnclaimedBytes(), 0u);
  // Claims beyond the bytes that came are no credit.
  Connections::Claim(*connection, 10 * Connections::kMostUnclaimed);
  Look();
  peer.Send(Connections::kMostUnclaimed + kBeginning + kLittle);
  Look();
  EXPECT_TRUE(peer.IsShut());
}

class ConnectionsOfCallers : public ConnectionsTest, public ::testing::WithParamInterface<bool> {};

TEST_P(ConnectionsOfCallers, MayHaveMessagesUnderWayIfTheyAreKnown) {
  const bool is_known = GetParam();
  SendingPeer peer(connections_, 1);
  constexpr int kCalls = 3;
  for (int i = 0; i < kCalls; ++i) {
    connections_.CallBegan(peer.name(), is_known);
  }
  peer.Send(Connections::kMostUnclaimed + kBeginning + (is_known ? kCalls * Connections::kUnderWayOfACall : 0));
  Look();
  EXPECT_FALSE(peer.IsShut());
  peer.Send(kLittle);
  Look();
  EXPECT_TRUE(peer.IsShut());
}

INSTANTIATE_TEST_SUITE_P(Both, ConnectionsOfCallers, ::testing::Bool());

// Windows have grown with the bytes before, and calls are read before they begin.
TEST_F(ConnectionsTest, MoreMayBeUnderWayWhereMessagesHaveCome) {
  constexpr int64_t kMessage = int64_t{1} << 20;
  SendingPeer peer(connections_, 1);
  const auto connection = connections_.CallBegan(peer.name(), true);
  peer.Send(kMessage);
  Connections::ClaimMessage(*connection, kMessage);
  Look();
  connections_.CallEnded(*connection, {.is_known = true});
  peer.Send(Connections::kMostUnclaimed + kBeginning + Connections::kUnderWayOfACall + 2 * kMessage);
  Look();
  EXPECT_FALSE(peer.IsShut());
  peer.Send(kLittle);
  Look();
  EXPECT_TRUE(peer.IsShut());
}

TEST_F(ConnectionsTest, CallsThatEndBeforeTheirRequestClaimWhatIsStillToCome) {
  SendingPeer peer(connections_, 1);
  const auto end_one = [&] {
    const auto connection = connections_.CallBegan(peer.name(), false);
    connections_.CallEnded(*connection, {.is_known = false, .is_unfinished = true});
  };
  for (int i = 0; i < 50; ++i) {
    end_one();
    Look();
    peer.Send(Connections::kFirstWindow);
    Look();
    ASSERT_FALSE(peer.IsShut()) << i;
  }
  EXPECT_EQ(connections_.UnclaimedBytes(), 0u);
  // Not of all at once: it would cost nothing again.
  for (int i = 0; i < 1000; ++i) {
    end_one();
  }
  peer.Send(Connections::kMostClaimedByEndsOfStrangers + Connections::kMostUnclaimed + kBeginning + kLittle);
  Look();
  EXPECT_TRUE(peer.IsShut());
}

TEST_F(ConnectionsTest, WhatNoCallClaimsIsBoundedOfAllTogetherAtTheCostOfTheWorst) {
  constexpr int64_t kEach = Connections::kMostUnclaimedOfAll / 10 + kBeginning;
  std::vector<std::unique_ptr<SendingPeer>> peers;
  for (uint16_t i = 0; i < 10; ++i) {
    peers.push_back(std::make_unique<SendingPeer>(connections_, i, absl::StrCat("10.0.1.", i)));
    peers.back()->Send(i == 2 ? kEach : kEach - kLittle);
  }
  Look();
  EXPECT_EQ(connections_.ShutCount(), 0u);
  peers[0]->Send(5 * kLittle);
  peers[2]->Send(6 * kLittle);
  Look();
  for (size_t i = 0; i < peers.size(); ++i) {
    EXPECT_EQ(peers[i]->IsShut(), i == 2) << i;
  }
}

TEST_F(ConnectionsTest, OnePeerIsThereOnce) {
  const sockaddr_storage address = Ipv4("10.0.0.1", 1);
  EXPECT_FALSE(connections_.Has(address));
  {
    SendingPeer peer(connections_, 1);
    EXPECT_TRUE(connections_.Has(address));
    EXPECT_FALSE(connections_.Has(Ipv4("10.0.0.1", 2)));
  }
  // It is no more, though not swept yet.
  EXPECT_FALSE(connections_.Has(address));
}

TEST_F(ConnectionsTest, CallsOfNoConnectionAreNotCounted) {
  EXPECT_EQ(connections_.CallBegan("unix:", false), nullptr);
  EXPECT_EQ(connections_.CallBegan("unknown", false), nullptr);
}

}  // namespace
}  // namespace wellspace::server
