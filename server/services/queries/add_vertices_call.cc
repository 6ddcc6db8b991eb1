#include "server/services/queries/add_vertices_call.h"

#include <mutex>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "server/jobs/job_size.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/session_use.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The contents of one request; they outlive its call, for calls that repeat it.
struct Addition {
  SessionUse use;
  std::vector<double> points;
  std::vector<uint32_t> near;
  uint64_t expected_revision = 0;
  IdentifiedRequest identified;
};

void SetResponse(const AddedVertices& added, v1::AddVerticesResponse& response) {
  response.mutable_vertices()->Assign(added.vertices.begin(), added.vertices.end());
  response.set_revision(added.revision);
}

// On a worker.
RequestIds::Answer Add(const Addition& addition, const MesherFactory& create_mesher, Job& job) {
  v1::AddVerticesResponse response;
  absl::Status status = RunGuarded([&] {
    Session& session = addition.use.session();
    const StructureUse structure(addition.use.session_ptr());
    WELLSPACE_RETURN_IF_ERROR(session.PrepareStructure(addition.expected_revision, create_mesher, job));
    const auto answer = [&](const AddedVertices& added) {
      SetResponse(added, response);
      return addition.identified.Answer(response);
    };
    WELLSPACE_ASSIGN_OR_RETURN(
        const AddedVertices added,
        session.AddVertices(addition.points, addition.near, addition.expected_revision, job.context(), answer));
    SetResponse(added, response);
    return absl::OkStatus();
  });
  return {std::move(status), response.SerializeAsString()};
}

}  // namespace

grpc::ServerUnaryReactor* AddVerticesCall::Serve(const CallEnvironment& environment,
                                                 grpc::CallbackServerContext* context,
                                                 const v1::AddVerticesRequest* request,
                                                 v1::AddVerticesResponse* response) {
  const auto call = std::make_shared<AddVerticesCall>(environment, context, request, response);
  Begin(call);
  if (call->is_admitted_) {
    environment.request_ids.Once(
        call->caller().tenant, request->request_id(), *request,
        [&call](const IdentifiedRequest& identified, RequestIds::Done done) {
          call->Submit(identified, std::move(done));
        },
        [call](const RequestIds::Answer& answer) { call->EndWith(answer); });
  }
  return call.get();
}

void AddVerticesCall::Submit(const IdentifiedRequest& identified, RequestIds::Done done) {
  // Of a request with an id the records are asked whether another process has answered it, which may take a while.
  const auto refuse = [&](const absl::Status& status) {
    if (identified.request_id.empty() || !environment().session_log.is_durable()) {
      done({status, ""});
    } else {
      environment().blocking.Run(request_->name(), [done, status] { done({status, ""}); });
    }
  };
  absl::StatusOr<std::shared_ptr<Session>> session = FindSession(environment(), caller(), request_->name());
  if (!session.ok()) {
    refuse(session.status());
    return;
  }
  const absl::StatusOr<uint64_t> expected_revision = ExpectedRevisionOf(*request_);
  if (!expected_revision.ok()) {
    refuse(expected_revision.status());
    return;
  }
  // The request as gRPC has it, and as the job does.
  const uint64_t bytes = 2 * (request_->points_size() * sizeof(double) + request_->near_size() * sizeof(uint32_t));
  absl::StatusOr<MemoryReservation> held = environment().memory.Reserve(bytes, "the vertices to be added");
  if (!held.ok()) {
    refuse(held.status());
    return;
  }
  const Session::Size size = (*session)->GetSize(0);
  const bool is_small =
      IsSmallAddition(request_->points_size() / (*session)->dimension(), size.vertices, size.replayed_steps);
  const std::shared_ptr<const Addition> addition(
      new Addition{.use = SessionUse(*std::move(session)),
                   .points = {request_->points().begin(), request_->points().end()},
                   .near = {request_->near().begin(), request_->near().end()},
                   .expected_revision = *expected_revision,
                   .identified = identified});
  absl::StatusOr<std::shared_ptr<Job>> job =
      environment().jobs.Submit({.tenant = caller().tenant,
                                 .is_small = is_small,
                                 .held = *std::move(held),
                                 .work = [addition, done, &create_mesher = environment().create_mesher](Job& running) {
                                   done(Add(*addition, create_mesher, running));
                                 }});
  if (!job.ok()) {
    refuse(job.status());
    return;
  }
  std::lock_guard lock(mutex_);
  job_ = *std::move(job);
  if (ending()) {
    OnEnd();
  }
}

void AddVerticesCall::OnEnd() {
  // A call with a request_id may be repeated by one that waits for the same answer.
  if (job_ != nullptr && request_->request_id().empty()) {
    environment().jobs.Cancel(job_);  // it may wait for memory, to have the structure built
  }
}

void AddVerticesCall::EndWith(const RequestIds::Answer& answer) {
  std::lock_guard lock(mutex_);
  if (ending()) {
    return;  // the response is gRPC's already
  }
  if (answer.status.ok()) {
    response_->ParseFromString(answer.response);
    added_ = response_->vertices_size();
    environment().observability.work().OnPoints(added_);
  }
  End(answer.status);
}

LogFields AddVerticesCall::Figures() const {
  LogFields figures;
  figures.Add("session", request_->name()).Add("points", added_);
  return figures;
}

}  // namespace wellspace::server
