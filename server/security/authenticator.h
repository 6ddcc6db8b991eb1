// The caller of a call: every handler asks for it before it does anything else.
#ifndef WELLSPACE_SERVER_SECURITY_AUTHENTICATOR_H_
#define WELLSPACE_SERVER_SECURITY_AUTHENTICATOR_H_

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "grpcpp/server_context.h"
#include "server/security/tokens.h"

namespace wellspace::server {

// Knows callers by their bearer token (metadata `authorization: Bearer TOKEN`), by their client certificate, or takes
// all of them for the tenant "default".
//
// Thread safety: thread-safe.
class Authenticator {
 public:
  // The credentials of a caller. With both, the certificate only has to be there and the token names the tenant.
  struct Demands {
    std::shared_ptr<const TokenTable> tokens;  // null: no token
    bool client_certificate = false;           // the tenant is the common name of its subject
  };

  // Takes all callers.
  Authenticator() = default;
  explicit Authenticator(Demands demands) : demands_(std::move(demands)) {}

  // The caller of the call that has `context`. Neither waits nor does I/O.
  //
  // Guarantees: the message of an error has nothing of the caller's credentials.
  // Errors:     UNAUTHENTICATED: the call is to be ended at once, without a look at its request.
  absl::StatusOr<Caller> Authenticate(const grpc::ServerContextBase& context) const;

  // These are for calls that come from now on.
  void SetDemands(Demands demands);
  void SetTokens(std::shared_ptr<const TokenTable> tokens);

 private:
  Demands GetDemands() const;

  mutable std::mutex mutex_;
  Demands demands_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SECURITY_AUTHENTICATOR_H_
