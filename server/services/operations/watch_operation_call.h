// One call of WatchOperation.
#ifndef WELLSPACE_SERVER_SERVICES_OPERATIONS_WATCH_OPERATION_CALL_H_
#define WELLSPACE_SERVER_SERVICES_OPERATIONS_WATCH_OPERATION_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/response_stream.h"
#include "server/sessions/operation.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/operations.pb.h"

namespace wellspace::server {

// Sends the events that the operation keeps and those to come, each when the one before is on its way, then the
// operation. Events that a slow reader misses, the operation has forgotten: nothing is stored here.
//
// Thread safety and invariants: those of ResponseStream.
class WatchOperationCall final
    : public ResponseStream<Call<grpc::ServerWriteReactor<v1::WatchOperationResponse>>, v1::WatchOperationResponse> {
 public:
  WatchOperationCall(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                     const v1::WatchOperationRequest& request)
      : ResponseStream(environment, context), name_(request.name()) {
    if (request.has_after_sequence()) {
      after_ = request.after_sequence();
    }
  }
  ~WatchOperationCall() override;

 private:
  void OnBegin() override;
  LogFields Figures() const override { return LogFields().Add("operation", name_); }
  std::optional<v1::WatchOperationResponse> NextResponse() override;

  // When the operation has changed, on any thread.
  void Wake();

  const std::string name_;
  // Guarded by mutex_.
  std::optional<uint64_t> after_;  // the last event that the client has
  std::optional<SessionUse> use_;  // keeps the session while it is watched
  std::shared_ptr<Operation> operation_;
  uint64_t watch_ = 0;
  bool is_end_sent_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_OPERATIONS_WATCH_OPERATION_CALL_H_
