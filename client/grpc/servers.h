// The servers of a connection: the one that it was made to, and those that servers have named as owners of sessions.
// Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_SERVERS_H_
#define WELLSPACE_CLIENT_GRPC_SERVERS_H_

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/connection.h"
#include "client/grpc/retry.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "wellspace/v1/admin.grpc.pb.h"
#include "wellspace/v1/meshing.grpc.pb.h"
#include "wellspace/v1/operations.grpc.pb.h"
#include "wellspace/v1/queries.grpc.pb.h"
#include "wellspace/v1/sessions.grpc.pb.h"

namespace wellspace::client {

// The id of the session in the name of one, or of one of its operations: the part behind "sessions/", which proxies are
// told. Empty for what is no such name.
std::string SessionIdOf(std::string_view name);

// The calls of one server.
//
// Thread safety: thread-safe.
struct Server {
  Server(std::string named, const std::shared_ptr<grpc::Channel>& channel);

  const std::string address;  // as another server has named it; empty: the first
  const std::unique_ptr<v1::MeshingService::Stub> meshing;
  const std::unique_ptr<v1::SessionService::Stub> sessions;
  const std::unique_ptr<v1::OperationService::Stub> operations;
  const std::unique_ptr<v1::QueryService::Stub> queries;
  const std::unique_ptr<v1::AdminService::Stub> admin;
  const std::unique_ptr<grpc::health::v1::Health::Stub> health;
};

// Which server has which session, by the errors SESSION_ELSEWHERE that calls have ended with.
//
// Thread safety: thread-safe.
// Invariants: a bounded number of servers and of sessions, whatever addresses a server names.
class Servers {
 public:
  // Without `open` no other server than that of `channel` is ever asked.
  Servers(const std::shared_ptr<grpc::Channel>& channel, OpenChannelTo open);

  const Server& first() const { return *first_; }

  // The server that has the session, as far as is known; else the first. `id`: of SessionIdOf.
  std::shared_ptr<const Server> Of(const std::string& id) const;

  // An attempt at a call on the session has ended with `status` at the server `asked`. Where that says which other one
  // has the session, the next attempt is to be made there at once; where it cannot be reached, at the first.
  //
  // Returns `status`, which says where it comes from unless that is the first server.
  // Errors:     of an address that is not to be asked; then `attempt` is final: DATA_LOSS, no HOST:PORT; others of the
  //             function that opens channels.
  absl::Status Follow(const std::string& id, const Server& asked, const absl::Status& status, Attempt& attempt);

 private:
  absl::Status GoTo(const std::string& id, const std::string& address);
  // Unless the session was found at another server meanwhile.
  void Forget(const std::string& id, const Server& asked);

  const OpenChannelTo open_;
  const std::shared_ptr<const Server> first_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const Server>> others_;                   // by address; guarded by mutex_
  std::unordered_map<std::string, std::shared_ptr<const Server>> owners_of_ids_;  // guarded by mutex_
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_SERVERS_H_
