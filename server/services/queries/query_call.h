// One call that asks about vertices: ApproximateNearestNeighbors, ClippedVoronoiCells or VoronoiCells.
#ifndef WELLSPACE_SERVER_SERVICES_QUERIES_QUERY_CALL_H_
#define WELLSPACE_SERVER_SERVICES_QUERIES_QUERY_CALL_H_

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/response_stream.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/log/log_fields.h"
#include "server/services/queries/vertex_query.h"
#include "server/sessions/session.h"
#include "server/sessions/session_use.h"

namespace wellspace::server {

// Answers in batches of about kMaxResponseBytes, made by jobs. A job makes batches until kBatchesAhead wait to be
// written, and another goes on when half of them are: a client that reads slowly takes no worker's time, and no more
// memory than that. A job that finds the queue full comes again, unless it is the first: begun work is not refused.
//
// All batches of an answer are of the same structure: once it changes the call ends with SESSION_BUSY or
// REVISION_MISMATCH.
//
// Thread safety: thread-safe.
// Invariants: those of ResponseStream; at most one job is under way.
class QueryCall final : public ResponseStream<Call<grpc::ServerWriteReactor<grpc::ByteBuffer>>, grpc::ByteBuffer> {
 public:
  static constexpr size_t kBatchesAhead = 4;

  QueryCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, VertexQueryParser parse,
            const grpc::ByteBuffer& request)
      : ResponseStream(environment, context), parse_(parse), bytes_(request) {}

 private:
  // Whether batches are being made.
  enum class Work { kIdle, kUnderWay, kRefused, kDone };

  void OnBegin() override;
  void OnEnd() override;
  LogFields Figures() const override;
  std::optional<grpc::ByteBuffer> NextResponse() override;

  // On the background thread: the queue was full, or the structure being built.
  void TryAgain();

  // The following want mutex_ to be held.
  absl::Status Find();
  // Submits a job if one is wanted and none is under way.
  void WorkAhead();

  // On a worker: makes batches.
  void MakeBatches(Job& job);
  // The same: asks about the next vertices until the batch is full, or there are none. `*is_at_work`: another job has
  // the structure built again just now; to be tried again.
  absl::Status FillBatch(Job& job, bool* is_at_work);
  absl::Status Ask(const core::Mesher& mesher);

  const VertexQueryParser parse_;

  // Of the job under way; before the first, guarded by mutex_.
  VertexQueryRequest request_;
  std::optional<SessionUse> use_;
  std::optional<StructureUse> structure_;  // from the first batch on
  uint64_t version_ = 0;                   // of the structure; see Session::Query
  uint64_t next_ = 0;                      // of the vertices asked about
  std::optional<uint64_t> count_;          // of them

  // Guarded by mutex_.
  grpc::ByteBuffer bytes_;
  Work work_ = Work::kIdle;
  std::shared_ptr<Job> job_;
  MemoryReservation memory_;  // of batches and request
  std::deque<grpc::ByteBuffer> ready_;
  uint64_t batches_ = 0;  // sent
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_QUERIES_QUERY_CALL_H_
