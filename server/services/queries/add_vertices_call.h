// One call of AddVertices.
#ifndef WELLSPACE_SERVER_SERVICES_QUERIES_ADD_VERTICES_CALL_H_
#define WELLSPACE_SERVER_SERVICES_QUERIES_ADD_VERTICES_CALL_H_

#include <cstdint>
#include <memory>

#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_ids.h"
#include "server/jobs/job.h"
#include "server/log/log_fields.h"
#include "server/sessions/session.h"
#include "wellspace/v1/queries.pb.h"

namespace wellspace::server {

// Adds the vertices in a job, which is cancelled when the call ends before it.
//
// Thread safety and invariants: those of Call.
class AddVerticesCall final : public Call<grpc::ServerUnaryReactor> {
 public:
  // Serves the call. `request` and `response` are valid until its end.
  static grpc::ServerUnaryReactor* Serve(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                                         const v1::AddVerticesRequest* request, v1::AddVerticesResponse* response);

  AddVerticesCall(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                  const v1::AddVerticesRequest* request, v1::AddVerticesResponse* response)
      : Call(environment, context), request_(request), response_(response) {}

 private:
  void OnBegin() override { is_admitted_ = true; }
  void OnEnd() override;
  LogFields Figures() const override;

  // Has the vertices added for `identified`, and `done` called with the outcome.
  void Submit(const IdentifiedRequest& identified, RequestIds::Done done);
  void EndWith(const RequestIds::Answer& answer);

  bool is_admitted_ = false;                     // set before the call is known to others
  const v1::AddVerticesRequest* const request_;  // gRPC's from the end on
  v1::AddVerticesResponse* const response_;      // the same

  // Guarded by mutex_.
  std::shared_ptr<Job> job_;
  uint64_t added_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_QUERIES_ADD_VERTICES_CALL_H_
