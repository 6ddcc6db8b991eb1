#include "server/network/connections.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/log/log_fields.h"

namespace wellspace::server {
namespace {

constexpr size_t kAddressBytes = sizeof(in6_addr);
constexpr size_t kMaxHosts = 10'000;
constexpr std::string_view kUnclaimed = "it sends what belongs to no call";

std::string KeyOf(const in6_addr& address, uint16_t port) {
  std::string key(reinterpret_cast<const char*>(&address), kAddressBytes);
  return key.append(reinterpret_cast<const char*>(&port), sizeof(port));
}

in6_addr Mapped(const in_addr& address) {
  in6_addr mapped = {};
  mapped.s6_addr[10] = 0xff;
  mapped.s6_addr[11] = 0xff;
  std::memcpy(&mapped.s6_addr[12], &address, sizeof(address));
  return mapped;
}

std::string PeerText(const std::string& key) {
  in6_addr address = {};
  uint16_t port = 0;
  if (key.size() == kAddressBytes + sizeof(port)) {
    std::memcpy(&address, key.data(), kAddressBytes);
    std::memcpy(&port, key.data() + kAddressBytes, sizeof(port));
  }
  char text[INET6_ADDRSTRLEN] = "";
  if (IN6_IS_ADDR_V4MAPPED(&address)) {
    return absl::StrCat("ipv4:", inet_ntop(AF_INET, &address.s6_addr[12], text, sizeof(text)), ":", port);
  }
  return absl::StrCat("ipv6:[", inet_ntop(AF_INET6, &address, text, sizeof(text)), "]:", port);
}

// The peers that share an allowance: an IPv4 address, or the network of 64 bits that one customer has with IPv6.
std::string HostOf(const std::string& key) {
  if (key.size() < kAddressBytes) {
    return key;
  }
  constexpr size_t kNetworkBytes = 8;
  in6_addr address;
  std::memcpy(&address, key.data(), kAddressBytes);
  return key.substr(0, IN6_IS_ADDR_V4MAPPED(&address) ? kAddressBytes : kNetworkBytes);
}

// The peer hears of the end by a reset, whatever it is still sending.
void ResetWhenClosed(int socket) {
  const linger reset = {.l_onoff = 1, .l_linger = 0};
  setsockopt(socket, SOL_SOCKET, SO_LINGER, &reset, sizeof(reset));
}

// Throws away bytes that came on a shut socket and were not read.
void Discard(int socket) {
  constexpr size_t kPiece = size_t{1} << 20;
  constexpr int kMostPieces = 1000;
  // TCP copies nothing with MSG_TRUNC. The peer cannot send more: Linux answers it with a reset.
  bool is_empty = true;
  for (int i = 0; i < kMostPieces && recv(socket, nullptr, kPiece, MSG_TRUNC | MSG_DONTWAIT) > 0; ++i) {
    is_empty = false;
  }
  // A peer who found the window closed would wait a minute for it to open. As for bytes that stay unread, Linux shall
  // send a reset when the socket is closed.
  if (!is_empty) {
    ResetWhenClosed(socket);
  }
}

// The state of a socket as TCP knows it; all 0 where it is none of TCP.
tcp_info TcpInfoOf(int socket) {
  tcp_info info = {};
  socklen_t size = sizeof(info);
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) {
    return {};
  }
  return info;
}

// The bytes that the peer has not taken yet, and those that it has.
struct Output {
  uint64_t waiting = 0;
  uint64_t taken = 0;
};

Output OutputOf(int socket) {
  int waiting = 0;
  if (ioctl(socket, SIOCOUTQ, &waiting) != 0) {
    return {};
  }
  return {.waiting = static_cast<uint64_t>(waiting), .taken = TcpInfoOf(socket).tcpi_bytes_acked};
}

// The bytes that come in answer to those sent: updates of windows, which other stacks send for every frame, and pings.
constexpr uint64_t kSentBytesPerClaimed = 16;
// The bytes that come with time: pings of both sides, and their answers. So little that a peer which holds back the end
// of headers fills no memory.
constexpr int64_t kClaimedPerSecond = 64;
// The first bytes of each connection: a handshake with certificates, settings.
constexpr int64_t kOfABeginning = 8 << 10;

}  // namespace

// All members but the const ones are guarded by mutex_ of Connections.
class Connections::Connection {
 public:
  Connection(uint64_t id_in, std::string key_in, FileDescriptor socket_in)
      : id(id_in), key(std::move(key_in)), host(HostOf(key)), socket(std::move(socket_in)) {}

  const uint64_t id;
  const std::string key;
  const std::string host;
  FileDescriptor socket;
  bool is_shut = false;  // or closed: its calls count no more
  int calls = 0;
  Clock::time_point window_begin = Clock::now();
  int wasted = 0;  // since window_begin
  // When something last did not wait, or was taken.
  Clock::time_point read_last = Clock::now();
  uint64_t taken = 0;

  // Bytes that calls have claimed since the last look. Not guarded: every message counts here.
  std::atomic<uint64_t> claimed = 0;
  std::atomic<uint64_t> of_messages = 0;  // of callers whom the server knows, ever
  int known_calls = 0;                    // of callers whom the server knows
  int known_calls_lately = 0;             // the most, since known_since
  bool was_known = false;                 // has ever had one
  Clock::time_point known_since = Clock::now();
  // As of the last look.
  Clock::time_point looked = Clock::now();
  uint64_t received = 0;
  uint64_t acknowledged = 0;
  int64_t unclaimed = 0;
  int64_t excess = 0;  // of these, those that no call can have under way
  int64_t excess_before = 0;
  // The bytes that may have been under way of calls that ended, until a while after the last of these ends.
  Clock::time_point last_end = Clock::now();
  int64_t of_ended = 0;
};

struct Connections::Host {
  int strikes = 0;
  Clock::time_point since;  // the strikes are counted
};

Connections::Connections(const ConnectionLimits& limits, std::shared_ptr<spdlog::logger> log)
    : limits_(limits), log_(std::move(log)), epoll_(epoll_create1(EPOLL_CLOEXEC)) {}

Connections::~Connections() = default;

bool Connections::Has(const sockaddr_storage& peer) const {
  constexpr uint8_t kEstablished = 1;  // of those that are no more, not all have been swept
  std::lock_guard lock(mutex_);
  const auto found = by_peer_.find(PeerKey(peer));
  return found != by_peer_.end() && TcpInfoOf(found->second->socket.get()).tcpi_state == kEstablished;
}

bool Connections::Add(int socket, const sockaddr_storage& peer) {
  FileDescriptor duplicate(fcntl(socket, F_DUPFD_CLOEXEC, 0));
  if (duplicate.get() < 0) {
    return false;
  }
  std::lock_guard lock(mutex_);
  const uint64_t id = next_id_++;
  // Only hang-ups are of interest, and these always come: gRPC shuts down the sockets that it closes.
  epoll_event event = {.events = EPOLLET, .data = {.u64 = id}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, duplicate.get(), &event) != 0) {
    return false;
  }
  const auto connection = std::make_shared<Connection>(id, PeerKey(peer), std::move(duplicate));
  by_id_.emplace(id, connection);
  by_peer_[connection->key] = connection;
  return true;
}

void Connections::Sweep() {
  constexpr int kEvents = 256;
  epoll_event events[kEvents];
  const int count = epoll_wait(epoll_.get(), events, kEvents, 0);
  std::lock_guard lock(mutex_);
  for (int i = 0; i < count; ++i) {
    const auto found = by_id_.find(events[i].data.u64);
    if ((events[i].events & EPOLLHUP) == 0 || found == by_id_.end()) {
      continue;
    }
    const std::shared_ptr<Connection> connection = found->second;
    // Nothing that gRPC could still read can be answered.
    Discard(connection->socket.get());
    Orphan(*connection);
    by_id_.erase(found);
    if (const auto peer = by_peer_.find(connection->key); peer != by_peer_.end() && peer->second == connection) {
      by_peer_.erase(peer);
    }
    connection->socket = FileDescriptor();
  }
}

void Connections::ShutUnread() {
  const Clock::time_point now = Clock::now();
  std::lock_guard lock(mutex_);
  for (const auto& [id, connection] : by_id_) {
    const Output output = OutputOf(connection->socket.get());
    if (output.waiting == 0 || output.taken != connection->taken) {
      connection->taken = output.taken;
      connection->read_last = now;
    } else if (now - connection->read_last > limits_.max_unread && !connection->is_shut) {
      Shut(*connection, "the peer does not read what it is sent");
    }
  }
}

std::chrono::milliseconds Connections::LookInterval() const {
  constexpr std::chrono::microseconds kLeast(25'000);
  constexpr std::chrono::microseconds kPerConnection(50);  // 1 or 2 of them are spent
  return std::chrono::duration_cast<std::chrono::milliseconds>(kLeast + Count() * kPerConnection);
}

void Connections::ShutUnclaimed() {
  const Clock::time_point now = Clock::now();
  std::lock_guard lock(mutex_);
  int64_t of_all = 0;
  for (const auto& [id, connection] : by_id_) {
    if (connection->is_shut) {
      continue;
    }
    CountUnclaimed(*connection, now);
    const int64_t lasting = LastingExcessOf(*connection);
    if (lasting > AllowedUnclaimed(connection->host) || connection->excess > kMostUnclaimedAtOnce) {
      Strike(connection->host);
      Shut(*connection, kUnclaimed);
    } else {
      of_all += lasting;
    }
  }
  while (of_all > kMostUnclaimedOfAll) {
    Connection* most = nullptr;
    for (const auto& [id, connection] : by_id_) {
      if (!connection->is_shut && (most == nullptr || LastingExcessOf(*connection) > LastingExcessOf(*most))) {
        most = connection.get();
      }
    }
    of_all -= LastingExcessOf(*most);
    Strike(most->host);
    Shut(*most, kUnclaimed);
  }
}

int64_t Connections::LastingExcessOf(const Connection& connection) {
  // Calls may have been read, and not begun yet; with the second look they have. Before the first has begun, windows
  // are too small for that.
  return connection.was_known ? std::min(connection.excess, connection.excess_before) : connection.excess;
}

void Connections::CountUnclaimed(Connection& connection, Clock::time_point now) const {
  // In this order: bytes claimed by now have come by now.
  const auto claimed = static_cast<int64_t>(connection.claimed.exchange(0));
  const tcp_info info = TcpInfoOf(connection.socket.get());
  const uint64_t received = info.tcpi_bytes_received - std::exchange(connection.received, info.tcpi_bytes_received);
  const uint64_t sent = info.tcpi_bytes_acked - std::exchange(connection.acknowledged, info.tcpi_bytes_acked);
  const auto elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(now - connection.looked);
  const int64_t by_time = elapsed.count() * kClaimedPerSecond / 1000;
  if (by_time > 0) {
    connection.looked = now;
  }
  connection.unclaimed +=
      static_cast<int64_t>(received) - claimed - static_cast<int64_t>(sent / kSentBytesPerClaimed) - by_time;
  connection.unclaimed = std::max<int64_t>(connection.unclaimed, 0);
  if (now - connection.last_end > kLately) {
    connection.of_ended = 0;
  }
  const int64_t of_ended = std::min(connection.of_ended, connection.unclaimed);
  connection.of_ended -= of_ended;
  connection.unclaimed -= of_ended;
  if (now - connection.known_since > kLately) {
    connection.known_since = now;
    connection.known_calls_lately = connection.known_calls;
  }
  connection.excess_before = connection.excess;
  connection.excess = std::max<int64_t>(0, connection.unclaimed - UnderWayOf(connection) - kOfABeginning);
}

int64_t Connections::UnderWayOf(const Connection& connection) const {
  const auto of_messages = static_cast<int64_t>(connection.of_messages.load());
  const int64_t calls = connection.was_known ? std::max(1, connection.known_calls_lately) : 0;
  const int64_t of_calls = calls * kUnderWayOfACall;
  return std::min(of_calls + std::min(2 * of_messages, kMostClaimedByEnds), static_cast<int64_t>(limits_.max_received));
}

std::shared_ptr<Connections::Connection> Connections::CallBegan(std::string_view peer, bool is_known) {
  const std::string key = PeerKey(peer);
  std::lock_guard lock(mutex_);
  const auto found = by_peer_.find(key);
  if (found == by_peer_.end()) {
    return nullptr;
  }
  const std::shared_ptr<Connection> connection = found->second;
  ++connection->calls;
  connection->known_calls += is_known ? 1 : 0;
  connection->was_known |= is_known;
  if (connection->known_calls > connection->known_calls_lately) {
    connection->known_calls_lately = connection->known_calls;
    connection->known_since = Clock::now();
  }
  if (connection->is_shut) {
    ++orphans_;
    return connection;
  }
  ++calls_;
  if (connection->calls > AllowedCalls(connection->host)) {
    Strike(connection->host);
    Shut(*connection, "calls begin faster than they end");
  } else if (calls_ > limits_.max_calls) {
    ShutTheBusiest();
  }
  return connection;
}

void Connections::Claim(Connection& connection, uint64_t bytes) { connection.claimed += bytes; }

void Connections::ClaimMessage(Connection& connection, uint64_t bytes) {
  connection.of_messages += bytes;
  Claim(connection, bytes);
}

void Connections::CallEnded(Connection& connection, const CallEnd& end) {
  std::lock_guard lock(mutex_);
  --connection.calls;
  connection.known_calls -= end.is_known ? 1 : 0;
  if (end.is_unfinished) {
    connection.last_end = Clock::now();
    connection.of_ended = end.is_known ? kMostClaimedByEnds
                                       : std::max(connection.of_ended, std::min(connection.of_ended + kFirstWindow,
                                                                                kMostClaimedByEndsOfStrangers));
  }
  if (connection.is_shut) {
    --orphans_;
    return;
  }
  --calls_;
  if (!end.is_wasted) {
    return;
  }
  if (const Clock::time_point now = Clock::now(); now - connection.window_begin > kWindow) {
    connection.window_begin = now;
    connection.wasted = 0;
  }
  if (++connection.wasted > AllowedWaste(connection.host)) {
    Strike(connection.host);
    Shut(connection, "calls are given up as soon as they have begun");
  }
}

bool Connections::IsBusyWithTheShut() const {
  std::lock_guard lock(mutex_);
  return orphans_ > kMostOrphans;
}

size_t Connections::Count() const {
  std::lock_guard lock(mutex_);
  return by_id_.size();
}

uint64_t Connections::ShutCount() const {
  std::lock_guard lock(mutex_);
  return shut_count_;
}

uint64_t Connections::UnclaimedBytes() const {
  std::lock_guard lock(mutex_);
  uint64_t bytes = 0;
  for (const auto& [id, connection] : by_id_) {
    bytes += connection->is_shut ? 0 : static_cast<uint64_t>(std::max<int64_t>(0, connection->unclaimed));
  }
  return bytes;
}

void Connections::Orphan(Connection& connection) {
  if (!std::exchange(connection.is_shut, true)) {
    calls_ -= connection.calls;
    orphans_ += connection.calls;
  }
}

void Connections::Shut(Connection& connection, std::string_view reason) {
  Orphan(connection);
  ++shut_count_;
  shutdown(connection.socket.get(), SHUT_RDWR);
  Discard(connection.socket.get());
  ResetWhenClosed(connection.socket.get());
  LogFields fields;
  fields.Add("event", "connection_shut").Add("peer", PeerText(connection.key));
  fields.Add("calls", static_cast<uint64_t>(connection.calls)).Add("message", reason);
  log_->warn("{}", fields.text());
}

void Connections::ShutTheBusiest() {
  Connection* busiest = nullptr;
  for (const auto& [id, connection] : by_id_) {
    if (!connection->is_shut && (busiest == nullptr || connection->calls > busiest->calls)) {
      busiest = connection.get();
    }
  }
  if (busiest != nullptr) {
    Shut(*busiest, "too many calls at once, most of them on this connection");
  }
}

int Connections::StrikesOf(const std::string& host) const {
  const auto found = hosts_.find(host);
  if (found == hosts_.end()) {
    return 0;
  }
  const auto forgiven = (Clock::now() - found->second.since) / kForgivenAfter;
  return static_cast<int>(std::max<int64_t>(0, found->second.strikes - forgiven));
}

int Connections::AllowedCalls(const std::string& host) const {
  const int64_t most = int64_t{limits_.max_streams} * 3 / 2 + kSlack;
  return static_cast<int>(std::max<int64_t>(most >> StrikesOf(host), kSlack));
}

int Connections::AllowedWaste(const std::string& host) const {
  const int most = std::max(limits_.max_streams, kLeastWaste);
  return std::max(most >> StrikesOf(host), kLeastWasteOfABadHost);
}

int64_t Connections::AllowedUnclaimed(const std::string& host) const {
  return std::max(kMostUnclaimed >> StrikesOf(host), kLeastUnclaimedOfABadHost);
}

void Connections::Strike(const std::string& name) {
  const Clock::time_point now = Clock::now();
  if (hosts_.size() >= kMaxHosts) {
    hosts_.clear();  // so many are not one attacker's, or he does not need any of them twice
  }
  constexpr int kMostStrikes = 20;
  const int strikes = std::min(StrikesOf(name) + 1, kMostStrikes);
  hosts_[name] = {.strikes = strikes, .since = now};
}

std::string PeerKey(const sockaddr_storage& peer) {
  if (peer.ss_family == AF_INET) {
    const auto& address = reinterpret_cast<const sockaddr_in&>(peer);
    return KeyOf(Mapped(address.sin_addr), ntohs(address.sin_port));
  }
  if (peer.ss_family == AF_INET6) {
    const auto& address = reinterpret_cast<const sockaddr_in6&>(peer);
    return KeyOf(address.sin6_addr, ntohs(address.sin6_port));
  }
  return "";
}

std::string PeerKey(std::string_view peer) {
  constexpr std::string_view kIpv4 = "ipv4:";
  constexpr std::string_view kIpv6 = "ipv6:";
  const size_t colon = peer.rfind(':');
  uint32_t port = 0;
  if (colon == std::string_view::npos || colon < kIpv4.size() ||
      !absl::SimpleAtoi(std::string(peer.substr(colon + 1)), &port) || port > UINT16_MAX) {
    return "";
  }
  std::string host(peer.substr(kIpv4.size(), colon - kIpv4.size()));
  if (peer.starts_with(kIpv4)) {
    in_addr address = {};
    return inet_pton(AF_INET, host.c_str(), &address) == 1 ? KeyOf(Mapped(address), static_cast<uint16_t>(port)) : "";
  }
  if (!peer.starts_with(kIpv6)) {
    return "";
  }
  // Brackets and the sign before a zone may be encoded as in a URI: "%5Bfe80::1%25eth0%5D".
  for (const std::string_view bracket : {"[", "%5B", "%5b"}) {
    if (host.starts_with(bracket)) {
      host.erase(0, bracket.size());
    }
  }
  host.resize(std::min(host.size(), host.find_first_of("%]")));
  in6_addr address = {};
  return inet_pton(AF_INET6, host.c_str(), &address) == 1 ? KeyOf(address, static_cast<uint16_t>(port)) : "";
}

}  // namespace wellspace::server
