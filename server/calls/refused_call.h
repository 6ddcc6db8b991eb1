// A call that is over before it begins.
#ifndef WELLSPACE_SERVER_CALLS_REFUSED_CALL_H_
#define WELLSPACE_SERVER_CALLS_REFUSED_CALL_H_

#include "grpcpp/support/server_callback.h"
#include "grpcpp/support/status.h"

namespace wellspace::server {

// Ends its call with an error and reads nothing of it. `Reactor` is gRPC's server reactor, of any kind.
//
//     return new RefusedCall<grpc::ServerWriteReactor<v1::WatchOperationResponse>>(status);
//
// Lifetime: deletes itself.
template <typename Reactor>
class RefusedCall final : public Reactor {
 public:
  // REQUIRES:   !status.ok().
  explicit RefusedCall(const grpc::Status& status) { this->Finish(status); }

  void OnDone() override { delete this; }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_REFUSED_CALL_H_
