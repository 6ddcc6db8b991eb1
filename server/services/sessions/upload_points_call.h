// One call of UploadPoints.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_UPLOAD_POINTS_CALL_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_UPLOAD_POINTS_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_stream.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Commits points whenever they have kCommittedBytes, and at its end; it goes on reading meanwhile. One upload has a
// session at a time: the first message of another waits for a moment, in which one whose connection broke is noticed.
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
  void OnEnd() override;
  LogFields Figures() const override;

  // On the background thread: another upload had the session.
  void TryAgain();

  // The following want mutex_ to be held.
  // Reads `request` from `bytes`. The first one says which session it is for.
  absl::Status Parse(grpc::ByteBuffer* bytes, v1::UploadPointsRequest* request);
  // With first_: takes it when the session is free, or comes again, or ends the call.
  void TryToBegin();
  // Checks the points that the first message says that the session has.
  absl::Status CheckPrefix(const v1::UploadPointsRequest& first) const;
  // Takes a message, and reads the next or ends the call.
  void Take(const v1::UploadPointsRequest& request);
  // Begins a commit of received points, if they are many and no other is under way; reads the next message unless too
  // much waits for that.
  void GoOn();
  // Has the received points committed on a thread that may wait, and `then` called with the outcome, with mutex_ held.
  void Commit(void (UploadPointsCall::*then)(absl::Status));
  void OnCommitted(absl::Status status);
  void OnLastCommitted(absl::Status status);

  grpc::ByteBuffer* const response_;  // gRPC's from Finish on
  // Guarded by mutex_.
  std::optional<SessionUse> session_;  // nothing before the first message
  std::unique_ptr<UploadUse> upload_;  // null: the session is not this upload's
  int attempts_ = 0;                   // to have it
  bool is_first_ = true;               // no message has been taken
  bool is_committing_ = false;         // a commit is under way
  bool is_reading_ = true;             // a message is on its way; no: too much waits for the commit
  v1::UploadPointsRequest first_;      // while it waits for the session
  MemoryReservation memory_;           // of the message that comes
  uint64_t coordinate_count_ = 0;      // received
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_UPLOAD_POINTS_CALL_H_
