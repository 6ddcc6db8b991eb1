// The connections of a server, and limits on the behaviour of their peers.
#ifndef WELLSPACE_SERVER_NETWORK_CONNECTIONS_H_
#define WELLSPACE_SERVER_NETWORK_CONNECTIONS_H_

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

#include "server/base/file_descriptor.h"
#include "server/base/options.h"
#include "spdlog/logger.h"

struct sockaddr_storage;

namespace wellspace::server {

// The limits of a connection. Its calls are the ones that gRPC has handed to us and that have not ended. Those that a
// peer has reset are among them, while gRPC 1.51 no longer counts them, and takes more.
struct ConnectionLimits {
  int max_streams = 1000;  // calls at once of a connection, as the peer is told; at least 1
  int max_calls = 10'000;  // of all connections together; at least 1
  // Of messages that are under way on a connection, in bytes: the most that gRPC holds of all of them.
  uint64_t max_received = uint64_t{512} << 20;
  // Time that a peer may read nothing. Longer than any stream waits for its client, unless --stall-limit is raised.
  std::chrono::seconds max_unread{120};
};

// Shuts connections whose peers begin calls only to give them up ("rapid reset", CVE-2023-44487). It also shuts
// connections whose peers send bytes that belong to no call, or do not read what they are sent.
//
// Bytes that came and that no call claims are those of frames that cost their sender nothing: WINDOW_UPDATE, SETTINGS,
// PRIORITY, PING, empty DATA, CONTINUATION, unknown types. gRPC reads them without end. Calls claim their headers and
// the messages that they were handed; bytes sent to the peer, and time, claim a little, for its windows and pings.
//
// A call is wasted if it ends within a second, and its client has cancelled it or has not sent any message. A
// connection is shut
//   - when it has more than one and a half times `max_streams` calls, and kSlack, that have begun and not ended; half
//     of it for each connection of its host that was shut lately, and never fewer than kSlack;
//   - when all have more than `max_calls`, and it has the most;
//   - when it has wasted more calls within a second than its host may: `max_streams` or kLeastWaste, whichever is more;
//     half of it for each connection of the host that was shut lately, and never fewer than kLeastWasteOfABadHost;
//   - when it has sent more than kMostUnclaimed bytes that no call claims, and none can have under way, when it is
//     looked twice, or many more; half of it for each connection of the host that was shut lately, and never less than
//     kLeastUnclaimedOfABadHost;
//   - when all have sent more than kMostUnclaimedOfAll, and it the most;
//   - when the peer has read nothing for `max_unread` although something waits for it.
// A message that has not come whole is claimed by none yet. So a caller whom the server knows may have kUnderWayOfACall
// under way for each call that it has, or had lately, and for one that is about to begin; and before calls begin, twice
// the bytes of messages before, up to kMostClaimedByEnds, to which the windows of HTTP/2 may have grown. All of it is
// at most `max_received`.
//
// Bytes that the peer has sent to a connection that is shut, and gRPC has not read, are thrown away. Calls that it has
// read are worked off: as long as there are more than kMostOrphans of them, no connection should be accepted.
//
// Each connection costs a second file descriptor.
//
// Thread safety: thread-safe; Sweep and ShutUnclaimed are one thread's.
class Connections {
 public:
  class Connection;
  using Clock = std::chrono::steady_clock;

  static constexpr int kSlack = 100;
  static constexpr int kLeastWaste = 100;
  static constexpr int kLeastWasteOfABadHost = 16;
  static constexpr int kMostOrphans = 500;
  static constexpr std::chrono::seconds kWindow{1};
  static constexpr std::chrono::seconds kForgivenAfter{10};  // one connection that was shut

  // In bytes. gRPC hands us a call with its first message, so that one of the largest has to be allowed on each
  // connection; but of all together not many more, since it makes up to 100 bytes of memory of one byte of headers
  // whose end does not come.
  static constexpr int64_t kMostUnclaimed = int64_t{kMaxRequestBytes} + (int64_t{512} << 10);
  static constexpr int64_t kMostUnclaimedAtOnce = int64_t{64} << 20;  // needs no second look
  static constexpr int64_t kLeastUnclaimedOfABadHost = int64_t{128} << 10;
  static constexpr int64_t kMostUnclaimedOfAll = int64_t{5} << 20;
  static constexpr int64_t kUnderWayOfACall = int64_t{8} << 20;  // a message, and a window
  static constexpr int64_t kFirstWindow = int64_t{64} << 10;     // with which a connection and a call begin
  // The bytes under way of a call that ended before its request did are claimed at its end, and lately after it: of
  // strangers no more than kMostClaimedByEndsOfStrangers.
  static constexpr int64_t kMostClaimedByEnds = int64_t{64} << 20;
  static constexpr int64_t kMostClaimedByEndsOfStrangers = int64_t{1} << 20;
  static constexpr std::chrono::seconds kLately{2};

  Connections(const ConnectionLimits& limits, std::shared_ptr<spdlog::logger> log);
  ~Connections();
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;

  // Whether there is a connection from `peer` already, to another address of this machine. Calls of a second one could
  // not be told from its own.
  bool Has(const sockaddr_storage& peer) const;
  // Takes note of a connection that was accepted from `peer` and is about to be handed to gRPC. False when there is no
  // descriptor left.
  bool Add(int socket, const sockaddr_storage& peer);

  // Readable when Sweep has something to do.
  int descriptor() const { return epoll_.get(); }
  // Forgets connections that are closed.
  void Sweep();
  // Shuts connections whose peers do not read. To be called every few seconds.
  void ShutUnread();
  // Shuts connections on which bytes come that no call claims. To be called as often as LookInterval says.
  void ShutUnclaimed();
  // So often that little comes meanwhile, and that looking takes little of a thread's time.
  std::chrono::milliseconds LookInterval() const;

  // A call has begun on the connection from `peer`, as gRPC writes it: "ipv4:127.0.0.1:1234". Null when there is no
  // such connection. `is_known`: the server knows the caller.
  std::shared_ptr<Connection> CallBegan(std::string_view peer, bool is_known);
  // The call accounts for `bytes` that came.
  static void Claim(Connection& connection, uint64_t bytes);
  // As above, for a message of a caller whom the server knows.
  static void ClaimMessage(Connection& connection, uint64_t bytes);
  struct CallEnd {
    bool is_known = false;  // as of CallBegan
    bool is_wasted = false;
    bool is_unfinished = false;  // more of its request may come
  };
  // It has ended.
  void CallEnded(Connection& connection, const CallEnd& end);

  // So many calls of connections that were shut or closed go on that more connections had better wait.
  bool IsBusyWithTheShut() const;

  // Connections that are open.
  size_t Count() const;
  // Connections that were shut.
  uint64_t ShutCount() const;
  // Bytes that came on connections that are open, and that no call has claimed, when it was last looked.
  uint64_t UnclaimedBytes() const;

 private:
  struct Host;

  // The following want mutex_ to be held.
  void Orphan(Connection& connection);
  void Shut(Connection& connection, std::string_view reason);
  void ShutTheBusiest();
  // How many connections of `host` were shut, less the forgiven ones.
  int StrikesOf(const std::string& host) const;
  // How many calls a connection of `host` may have, and waste within a second.
  int AllowedCalls(const std::string& host) const;
  int AllowedWaste(const std::string& host) const;
  // How many bytes a connection of `host` may send that no call claims.
  int64_t AllowedUnclaimed(const std::string& host) const;
  // Takes note of the bytes that have come and were claimed since the last look.
  void CountUnclaimed(Connection& connection, Clock::time_point now) const;
  // Bytes that calls of the connection may have under way.
  int64_t UnderWayOf(const Connection& connection) const;
  // Bytes that no call of the connection can have under way, in this look and the last one.
  static int64_t LastingExcessOf(const Connection& connection);
  void Strike(const std::string& host);

  const ConnectionLimits limits_;
  const std::shared_ptr<spdlog::logger> log_;
  const FileDescriptor epoll_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::unordered_map<std::string, std::shared_ptr<Connection>> by_peer_;
  std::unordered_map<uint64_t, std::shared_ptr<Connection>> by_id_;
  std::unordered_map<std::string, Host> hosts_;  // of which connections were shut lately
  uint64_t next_id_ = 1;
  int64_t calls_ = 0;    // of connections that were not shut
  int64_t orphans_ = 0;  // of the calls that were
  uint64_t shut_count_ = 0;
};

// The address and port of a peer, whatever the way it is written: 18 bytes. Empty if it has none.
std::string PeerKey(const sockaddr_storage& peer);
std::string PeerKey(std::string_view peer);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_NETWORK_CONNECTIONS_H_
