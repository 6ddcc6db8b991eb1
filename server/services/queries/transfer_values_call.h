// One call of TransferValues.
#ifndef WELLSPACE_SERVER_SERVICES_QUERIES_TRANSFER_VALUES_CALL_H_
#define WELLSPACE_SERVER_SERVICES_QUERIES_TRANSFER_VALUES_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/mesh/carry_field.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_stream.h"
#include "server/calls/response_stream.h"
#include "server/inputs/number_chunks.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/log/log_fields.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/queries.pb.h"

namespace wellspace::server {

// Collects the values, has a job carry them from one mesh to the other, and sends the result piece by piece. Both
// meshes are the call's from its first message on, whatever becomes of the session.
//
// Thread safety and invariants: those of RequestStream and ResponseStream.
class TransferValuesCall final
    : public ResponseStream<RequestStream<Call<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>>>,
                            grpc::ByteBuffer> {
 public:
  TransferValuesCall(const CallEnvironment& environment, grpc::CallbackServerContext* context)
      : ResponseStream(environment, context) {}

 private:
  using Mesh = std::shared_ptr<const MeshSnapshot>;

  void OnBegin() override;
  void OnRequest(grpc::ByteBuffer* bytes) override;
  void OnRequestsEnd() override;
  void OnEnd() override;
  LogFields Figures() const override;
  std::optional<grpc::ByteBuffer> NextResponse() override;

  // The following want mutex_ to be held.
  absl::Status Take(grpc::ByteBuffer* bytes);
  absl::Status TakeStart(const v1::TransferValuesRequest::Start& start);
  absl::Status TakeValues(v1::FieldValues& values);
  // Sets memory aside for the values that have come and for the next message, which it then reads.
  void ReserveAndRead();
  absl::Status Submit();
  // Rows of values that come, and that go.
  uint64_t RowsOf(const MeshSnapshot& mesh) const;
  uint64_t wanted_count() const { return RowsOf(*from_) * components_; }

  // On a worker.
  void Work(NumberChunks& values, Job& job);
  absl::StatusOr<core::CarriedField> Carry(const std::vector<double>& values, Job& job);

  // Constant once there is a job; before, guarded by mutex_.
  std::optional<SessionUse> use_;  // nothing before the first message
  Mesh from_;
  Mesh onto_;
  v1::FieldPlace place_ = v1::FIELD_PLACE_UNSPECIFIED;
  uint64_t components_ = 1;
  bool is_conservative_ = false;

  // Guarded by mutex_.
  NumberChunks values_;       // as they come
  MemoryReservation memory_;  // of them and of the message that comes; then of the result
  std::shared_ptr<Job> job_;
  uint64_t count_ = 0;                         // of values that have come
  std::optional<core::CarriedField> carried_;  // the result
  std::optional<uint64_t> next_;               // of the values that are sent; nothing before the start is
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_QUERIES_TRANSFER_VALUES_CALL_H_
