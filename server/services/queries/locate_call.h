// One call of Locate.
#ifndef WELLSPACE_SERVER_SERVICES_QUERIES_LOCATE_CALL_H_
#define WELLSPACE_SERVER_SERVICES_QUERIES_LOCATE_CALL_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/jobs/job.h"
#include "server/log/log_fields.h"
#include "server/sessions/session_use.h"
#include "wellspace/v1/queries.pb.h"

namespace wellspace::server {

// Locates the points in a job, which is cancelled when the call ends before it.
//
// Thread safety and invariants: those of Call.
class LocateCall final : public Call<grpc::ServerUnaryReactor> {
 public:
  // REQUIRES:   `request` and `response` are valid until the end of the call.
  LocateCall(const CallEnvironment& environment, grpc::CallbackServerContext* context, const v1::LocateRequest* request,
             v1::LocateResponse* response)
      : Call(environment, context), request_(request), response_(response) {}

 private:
  void OnBegin() override;
  void OnEnd() override;
  LogFields Figures() const override;

  // Wants mutex_ to be held: submits the job.
  absl::Status Submit();
  // On a worker.
  void Locate(Job& job);

  const v1::LocateRequest* const request_;  // gRPC's from the end on
  v1::LocateResponse* const response_;      // the same

  // Of the job; before it, guarded by mutex_.
  std::optional<SessionUse> use_;
  std::vector<double> points_;
  uint64_t revision_ = 0;
  bool allow_outside_ = false;
  uint64_t offset_ = 0;

  // Guarded by mutex_.
  std::shared_ptr<Job> job_;
  uint64_t count_ = 0;  // of points
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_QUERIES_LOCATE_CALL_H_
