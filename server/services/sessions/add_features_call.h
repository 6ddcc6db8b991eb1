// One call of AddSegments or AddTriangles.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_ADD_FEATURES_CALL_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_ADD_FEATURES_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_stream.h"
#include "server/inputs/feature_store.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Commits each message before it reads the next. Several may be under way at once: each message says where its features
// belong, and others there are refused.
//
// Thread safety and invariants: those of Call.
class AddFeaturesCall : public RequestStream<Call<grpc::ServerReadReactor<grpc::ByteBuffer>>> {
 public:
  // REQUIRES:   `response` is valid until the end of the call.
  AddFeaturesCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : RequestStream(environment, context), response_(response) {}

 protected:
  // A message, whichever of the two calls it is of.
  struct Message {
    std::string name;
    FeatureCounts offset;
    FeaturePart features;
    absl::StatusOr<uint64_t> expected_revision = 0;
  };
  virtual absl::StatusOr<Message> ParseMessage(grpc::ByteBuffer* bytes) = 0;
  // Of a session with so many features.
  virtual grpc::ByteBuffer Answer(const store::v1::SessionRecord& record) const = 0;
  virtual const char* what() const = 0;  // "segments"

 private:
  void OnBegin() override;
  void OnRequest(grpc::ByteBuffer* bytes) override;
  void OnRequestsEnd() override;
  void OnEnd() override { memory_.Release(); }
  LogFields Figures() const override;

  // Reads `message` from `bytes`. The first one says which session it is for. Wants mutex_ to be held.
  absl::Status Parse(grpc::ByteBuffer* bytes, Message* message);
  // Takes a message, on a thread that may wait for the session log.
  absl::Status Add(const Message& message);
  // Reads the next message, or ends the call. Wants mutex_ to be held.
  void GoOn(absl::Status status);

  grpc::ByteBuffer* const response_;  // gRPC's from Finish on
  // Guarded by mutex_.
  std::optional<SessionUse> session_;  // nothing before the first message
  MemoryReservation memory_;           // of the message that comes
  FeatureCounts received_;
};

class AddSegmentsCall final : public AddFeaturesCall {
 public:
  using AddFeaturesCall::AddFeaturesCall;

 private:
  absl::StatusOr<Message> ParseMessage(grpc::ByteBuffer* bytes) override;
  grpc::ByteBuffer Answer(const store::v1::SessionRecord& record) const override;
  const char* what() const override { return "segments"; }
};

class AddTrianglesCall final : public AddFeaturesCall {
 public:
  using AddFeaturesCall::AddFeaturesCall;

 private:
  absl::StatusOr<Message> ParseMessage(grpc::ByteBuffer* bytes) override;
  grpc::ByteBuffer Answer(const store::v1::SessionRecord& record) const override;
  const char* what() const override { return "triangles"; }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_ADD_FEATURES_CALL_H_
