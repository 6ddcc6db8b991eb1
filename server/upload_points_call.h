// One call of UploadPoints.
#ifndef WELLSPACE_SERVER_UPLOAD_POINTS_CALL_H_
#define WELLSPACE_SERVER_UPLOAD_POINTS_CALL_H_

#include <cstdint>
#include <memory>
#include <string>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/call.h"
#include "server/memory_budget.h"
#include "server/request_stream.h"
#include "server/session.h"

namespace wellspace::server {

// Commits each message before it reads the next.
//
// Thread safety and invariants: those of Call.
class UploadPointsCall final : public RequestStream<Call<grpc::ServerReadReactor<grpc::ByteBuffer>>> {
 public:
  // REQUIRES:   `response` is valid until the end of the call.
  UploadPointsCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : RequestStream(environment, context), response_(response) {}

 private:
  void OnBegin() override;
  void OnRequest(grpc::ByteBuffer* bytes) override;
  void OnRequestsEnd() override;
  void OnEnd() override { memory_.Release(); }
  LogFields Figures() const override;

  // The following want mutex_ to be held.
  grpc::Status Accept(grpc::ByteBuffer* bytes);

  grpc::ByteBuffer* const response_;  // gRPC's from Finish on
  // Guarded by mutex_.
  std::shared_ptr<Session> session_;  // null before the first message
  MemoryReservation memory_;          // of the message that comes
  uint64_t coordinate_count_ = 0;     // received
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_UPLOAD_POINTS_CALL_H_
