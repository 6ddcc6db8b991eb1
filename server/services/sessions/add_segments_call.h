// One call of AddSegments.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_ADD_SEGMENTS_CALL_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_ADD_SEGMENTS_CALL_H_

#include <cstdint>
#include <optional>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_stream.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Commits each message before it reads the next. Several may be under way at once: each message says where its segments
// belong, and others there are refused.
//
// Thread safety and invariants: those of Call.
class AddSegmentsCall final : public RequestStream<Call<grpc::ServerReadReactor<grpc::ByteBuffer>>> {
 public:
  // REQUIRES:   `response` is valid until the end of the call.
  AddSegmentsCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : RequestStream(environment, context), response_(response) {}

 private:
  void OnBegin() override;
  void OnRequest(grpc::ByteBuffer* bytes) override;
  void OnRequestsEnd() override;
  void OnEnd() override { memory_.Release(); }
  LogFields Figures() const override;

  // Reads `request` from `bytes`. The first one says which session it is for. Wants mutex_ to be held.
  absl::Status Parse(grpc::ByteBuffer* bytes, v1::AddSegmentsRequest* request);
  // Takes a message, on a thread that may wait for the session log.
  absl::Status Add(const v1::AddSegmentsRequest& request);
  // Reads the next message, or ends the call. Wants mutex_ to be held.
  void GoOn(absl::Status status);

  grpc::ByteBuffer* const response_;  // gRPC's from Finish on
  // Guarded by mutex_.
  std::optional<SessionUse> session_;  // nothing before the first message
  MemoryReservation memory_;           // of the message that comes
  uint64_t segment_count_ = 0;         // received
  uint64_t seed_count_ = 0;            // received
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_ADD_SEGMENTS_CALL_H_
