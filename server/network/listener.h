// Accepts connections for a gRPC server.
#ifndef WELLSPACE_SERVER_NETWORK_LISTENER_H_
#define WELLSPACE_SERVER_NETWORK_LISTENER_H_

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "grpcpp/server_builder.h"
#include "server/base/file_descriptor.h"
#include "server/network/connections.h"
#include "server/network/listen_address.h"
#include "spdlog/logger.h"

namespace wellspace::server {

// Sockets that listen, the thread that accepts their connections and hands them to gRPC, and one that watches what
// becomes of them. gRPC reads on the first as long as there is something to read: a peer that sends without end keeps
// it until the second shuts the connection.
//
// gRPC 1.51 would listen itself, and would never do so again after an accept that failed (CVE-2023-4785). Here a
// connection that comes when there are hardly any file descriptors left is closed at once, so that some of them stay
// for files; accepting goes on whatever fails. Connections watches them from then on.
//
// Thread safety: thread-compatible.
class Listener {
 public:
  // Connections that are open at once; further ones are closed.
  static constexpr size_t kMostConnections = 10'000;

  // Listens at `address`; a name is listened on at all of its addresses that this machine has. A connection waits until
  // Start.
  //
  // Errors:     UNAVAILABLE: the address is not of this machine, or its port is in use.
  static absl::StatusOr<std::unique_ptr<Listener>> Open(const ListenAddress& address,
                                                        std::shared_ptr<spdlog::logger> log);
  ~Listener() { Stop(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // The port in use.
  uint16_t port() const { return port_; }

  // From now on connections go to `acceptor`, whose server has been started. To be called once. `connections` outlives
  // this. `keeps_files`: more descriptors are left for files.
  void Start(std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor, Connections& connections,
             bool keeps_files);

  // Listens no more. To be called before the server of the acceptor is shut down.
  void Stop();

 private:
  Listener(std::vector<FileDescriptor> sockets, uint16_t port, std::shared_ptr<spdlog::logger> log)
      : log_(std::move(log)), port_(port), sockets_(std::move(sockets)) {}

  void AcceptUntilStopped();
  void WatchUntilStopped();
  // Takes all connections that wait at `socket`. False when that failed for a reason that may go away.
  bool AcceptAll(int socket);
  // Whether there is a place for one more connection.
  bool HasRoomFor(const FileDescriptor& connection) const;
  void HandOver(int socket, FileDescriptor connection, const sockaddr_storage& peer);
  // At most one line every kLogInterval; the others are counted.
  void LogTrouble(const std::string& what);

  const std::shared_ptr<spdlog::logger> log_;
  const uint16_t port_;
  std::vector<FileDescriptor> sockets_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  Connections* connections_ = nullptr;  // from Start on
  bool keeps_files_ = false;
  FileDescriptor stop_;          // readable when the threads are to end
  FileDescriptor has_accepted_;  // readable when there is a connection to watch
  std::thread watching_;
  std::thread accepting_;
  // Of the latter.
  absl::Duration last_log_ = -absl::InfiniteDuration();  // since boot
  uint64_t unlogged_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_NETWORK_LISTENER_H_
