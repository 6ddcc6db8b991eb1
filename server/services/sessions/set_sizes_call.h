// One call of SetSizes.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_SET_SIZES_CALL_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_SET_SIZES_CALL_H_

#include <cstdint>
#include <optional>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_stream.h"
#include "server/inputs/size_store.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Collects the samples of all messages, and gives them to the session when the client has sent them.
//
// Thread safety and invariants: those of Call.
class SetSizesCall final : public RequestStream<Call<grpc::ServerReadReactor<grpc::ByteBuffer>>> {
 public:
  // REQUIRES:   `response` is valid until the end of the call.
  SetSizesCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : RequestStream(environment, context), response_(response) {}

 private:
  using Sizes = v1::SetSizesRequest::SizesCase;

  void OnBegin() override;
  void OnRequest(grpc::ByteBuffer* bytes) override;
  void OnRequestsEnd() override;
  void OnEnd() override;
  LogFields Figures() const override;

  // The following want mutex_ to be held.
  // Takes the samples of the message in `bytes`. The first one says which session it is for.
  absl::Status Take(grpc::ByteBuffer* bytes);
  absl::Status TakeSamples(v1::SetSizesRequest& request);
  // Sets memory aside for the sizes that have come and for the next message, which it then reads.
  void ReserveAndRead();
  // Sets memory aside for the sizes that have come, and for `more` bytes.
  //
  // Errors:     MEMORY_LIMIT.
  absl::Status ReserveFor(uint64_t more);

  // Gives `sizes` to the session, on a thread that may wait for the disk. `of_vertices`: points are to be found. Until
  // the session has them, the memory that was set aside for them stays.
  absl::Status Set(SizeStore sizes, bool of_vertices);
  absl::Status FindPoints(SizeStore& sizes);

  grpc::ByteBuffer* const response_;  // gRPC's from Finish on
  // Guarded by mutex_.
  std::optional<SessionUse> session_;  // nothing before the first message
  Sizes sizes_case_ = v1::SetSizesRequest::SIZES_NOT_SET;
  SizeStore sizes_;
  uint64_t expected_revision_ = 0;
  uint64_t mesh_revision_ = 0;
  uint64_t count_ = 0;        // samples that were received
  MemoryReservation memory_;  // of sizes_, and of the message that comes
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_SET_SIZES_CALL_H_
