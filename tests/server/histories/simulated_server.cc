#include "tests/server/histories/simulated_server.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/store/durable_log.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kChunkBytes = 400;  // so that small meshes have several

}  // namespace

SimulatedServer::Process::Process(SimulatedServer& machine, std::shared_ptr<SessionLog> durable)
    : log(std::make_shared<spdlog::logger>("simulated")),
      connections({}, log),
      observability({v1::SessionService::service_full_name(), v1::OperationService::service_full_name(),
                     v1::QueryService::service_full_name()},
                    log, connections, [](const grpc::ServerContextBase&) { return std::string(); }),
      records(
          new PlantedRecords(durable, machine.disk_, kFolder, machine.plant_, [&machine] { return machine.step_; })),
      backend(
          {.workers = machine.workers_}, authenticator, observability, log,
          std::make_unique<SessionLog>(
              std::unique_ptr<Records>(records),
              std::make_unique<PlantedFiles>(durable, machine.plant_, [&machine] { return machine.step_; })),
          core::MeshPoints, core::EstimateMesh, machine.create_mesher_,
          {.clock = {
               .wall =
                   [&machine] { return absl::FromUnixSeconds(1'800'000'000) + absl::Milliseconds(++machine.ticks_); },
               .since_boot = [&machine] { return machine.since_boot_; }},
           .run_by = RunBy::kCaller,
           .make_session_name = [&machine] { return absl::StrFormat("sessions/%032x", ++machine.sessions_made_); }}) {}

absl::Status SimulatedServer::Start() {
  Begin(Step::kStart);
  WELLSPACE_ASSIGN_OR_RETURN(
      std::unique_ptr<SessionLog> log,
      OpenDurableLog({.folder = kFolder,
                      .files = &disk_.files(),
                      .tables = {.vfs = disk_.vfs(), .is_exclusive = true, .checkpoint_pages = 15},
                      .max_mesh_chunk_bytes = kChunkBytes}));
  process_ = std::make_unique<Process>(*this, std::move(log));
  backend_ = &process_->backend;
  WELLSPACE_RETURN_IF_ERROR(backend_->Restore());
  EndStep();
  return absl::OkStatus();
}

void SimulatedServer::Kill() {
  if (process_ == nullptr) {
    return;
  }
  for (auto& [operation, watcher] : watchers_) {
    watcher.call().Cancel();
    Finish(watcher.call());
  }
  watchers_.clear();
  backend_ = nullptr;
  process_ = nullptr;
}

void SimulatedServer::EndStep() {
  while (DoNext()) {
  }
  process_->records->EndStep();
  while (DoNext()) {
  }
  Begin(Step::kLook);
}

bool SimulatedServer::DoNext() {
  if (std::ranges::any_of(watchers_, [](auto& watched) { return watched.second.call().Deliver(); }) ||
      backend_->blocking().RunNext()) {
    return true;
  }
  return backend_->background().RunDue();
}

void SimulatedServer::Finish(DirectCall& call) {
  while (!call.has_ended() && (call.Deliver() || DoNext() || backend_->jobs().RunNext())) {
  }
}

template <typename Request, typename Response, typename Service>
Answered<Response> SimulatedServer::Unary(Service& service,
                                          grpc::ServerUnaryReactor* (Service::*method)(grpc::CallbackServerContext*,
                                                                                       const Request*, Response*),
                                          const Request& request) {
  DirectUnary<Request, Response> call(
      IsAlive(), request, [&](grpc::CallbackServerContext* context, const Request* own, Response* response) {
        return (service.*method)(context, own, response);
      });
  Finish(call);
  Answered<Response> answered;
  if (call.status().has_value()) {
    answered.is_ok = call.status()->ok();
    answered.error = answered.is_ok ? std::nullopt : call.status();
    answered.response = call.response();
  }
  return answered;
}

template <typename Response, typename Request>
Answered<Response> SimulatedServer::Stream(grpc::ServerReadReactor<grpc::ByteBuffer>* (SessionService::*method)(
                                               grpc::CallbackServerContext*, grpc::ByteBuffer*),
                                           const std::vector<Request>& requests, bool breaks_off,
                                           const std::function<void()>& beside) {
  std::deque<grpc::ByteBuffer> bytes;
  for (const Request& request : requests) {
    bytes.push_back(Serialize(request));
  }
  DirectUpload call(IsAlive(), std::move(bytes), breaks_off,
                    [&](grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
                      return (process_->sessions.*method)(context, response);
                    });
  if (beside) {
    call.SetOpen(true);
    while (call.Deliver() || DoNext()) {
    }
    beside();
    call.SetOpen(false);
  }
  Finish(call);
  Answered<Response> answered;
  if (call.status().has_value()) {
    answered.is_ok = call.status()->ok() && ParseRequest(&call.response(), &answered.response).ok();
    answered.error = answered.is_ok ? std::nullopt : call.status();
  }
  return answered;
}

Answered<v1::CreateSessionResponse> SimulatedServer::Create(const v1::CreateSessionRequest& request) {
  return Unary(process_->sessions, &SessionService::CreateSession, request);
}

Answered<v1::UpdateSessionResponse> SimulatedServer::Update(const v1::UpdateSessionRequest& request) {
  return Unary(process_->sessions, &SessionService::UpdateSession, request);
}

Answered<v1::DeleteSessionResponse> SimulatedServer::Delete(const v1::DeleteSessionRequest& request) {
  return Unary(process_->sessions, &SessionService::DeleteSession, request);
}

Answered<v1::ListSessionsResponse> SimulatedServer::List() {
  return Unary(process_->sessions, &SessionService::ListSessions, v1::ListSessionsRequest());
}

Answered<v1::UploadPointsResponse> SimulatedServer::Upload(const std::vector<v1::UploadPointsRequest>& requests,
                                                           bool breaks_off) {
  return Stream<v1::UploadPointsResponse>(&SessionService::UploadPoints, requests, breaks_off);
}

Answered<v1::UploadPointsResponse> SimulatedServer::UploadBeside(const std::vector<v1::UploadPointsRequest>& requests,
                                                                 const std::function<void()>& beside) {
  return Stream<v1::UploadPointsResponse>(&SessionService::UploadPoints, requests, /*breaks_off=*/false, beside);
}

Answered<v1::RemovePointsResponse> SimulatedServer::RemovePoints(const v1::RemovePointsRequest& request) {
  return Unary(process_->sessions, &SessionService::RemovePoints, request);
}

Answered<v1::AddSegmentsResponse> SimulatedServer::AddSegments(const v1::AddSegmentsRequest& request) {
  return Stream<v1::AddSegmentsResponse>(&SessionService::AddSegments, std::vector{request});
}

Answered<v1::AddTrianglesResponse> SimulatedServer::AddTriangles(const v1::AddTrianglesRequest& request) {
  return Stream<v1::AddTrianglesResponse>(&SessionService::AddTriangles, std::vector{request});
}

Answered<v1::SetSizesResponse> SimulatedServer::SetSizes(const v1::SetSizesRequest& request) {
  return Stream<v1::SetSizesResponse>(&SessionService::SetSizes, std::vector{request});
}

Answered<v1::AddVerticesResponse> SimulatedServer::AddVertices(const v1::AddVerticesRequest& request) {
  return Unary(process_->queries, &QueryService::AddVertices, request);
}

Answered<v1::StartRefinementResponse> SimulatedServer::Refine(const v1::StartRefinementRequest& request) {
  return Unary(process_->operations, &OperationService::StartRefinement, request);
}

Answered<v1::CancelOperationResponse> SimulatedServer::CancelOperation(const std::string& name) {
  v1::CancelOperationRequest request;
  request.set_name(name);
  return Unary(process_->operations, &OperationService::CancelOperation, request);
}

Answered<v1::ListOperationsResponse> SimulatedServer::ListOperations(const std::string& session) {
  v1::ListOperationsRequest request;
  request.set_parent(session);
  return Unary(process_->operations, &OperationService::ListOperations, request);
}

Answered<std::string> SimulatedServer::Download(const std::string& session) {
  v1::DownloadMeshRequest request;
  request.set_name(session);
  request.set_with_boundary(true);
  DirectDownload<grpc::ByteBuffer, grpc::ByteBuffer> call(
      IsAlive(), Serialize(request), [&](grpc::CallbackServerContext* context, const grpc::ByteBuffer* own) {
        return process_->sessions.DownloadMesh(context, own);
      });
  Finish(call);
  Answered<std::string> answered;
  if (call.status().has_value()) {
    answered.is_ok = call.status()->ok();
    answered.error = answered.is_ok ? std::nullopt : call.status();
  }
  for (const grpc::ByteBuffer& response : call.responses()) {
    answered.response += BytesOf(response);
  }
  return answered;
}

std::optional<v1::Operation> SimulatedServer::Watcher::End() const {
  for (const v1::WatchOperationResponse& response : call_->responses()) {
    if (response.has_operation()) {
      return response.operation();
    }
  }
  return std::nullopt;
}

void SimulatedServer::Watch(const std::string& operation) {
  v1::WatchOperationRequest request;
  request.set_name(operation);
  watchers_.emplace_back(
      operation,
      Watcher(std::make_unique<DirectDownload<v1::WatchOperationRequest, v1::WatchOperationResponse>>(
          IsAlive(), request, [&](grpc::CallbackServerContext* context, const v1::WatchOperationRequest* own) {
            return process_->operations.WatchOperation(context, own);
          })));
}

std::optional<v1::Operation> SimulatedServer::EndOf(const std::string& operation) const {
  const auto watched = std::ranges::find_if(watchers_, [&](const auto& one) { return one.first == operation; });
  return watched == watchers_.end() ? std::nullopt : watched->second.End();
}

bool SimulatedServer::RunJob() { return backend_->jobs().RunNext(); }

void SimulatedServer::Pass(absl::Duration time) {
  since_boot_ += time;
  backend_->background().Pass(time);
}

std::string SimulatedServer::CheckStates() {
  const absl::StatusOr<StoredSessions> stored = process_->records->Load();
  if (!stored.ok()) {
    return stored.status().ToString();
  }
  for (const std::shared_ptr<Session>& session : backend_->environment().sessions.All()) {
    const auto written = std::ranges::find_if(
        stored->sessions, [&](const StoredSession& one) { return one.state.name() == session->name(); });
    if (written == stored->sessions.end()) {
      return absl::StrCat(session->name(), " is not in the log");
    }
    absl::StatusOr<SessionState> again = StateOf(*written);
    if (!again.ok()) {
      return again.status().ToString();
    }
    SessionState shown = *session->state();
    shown.sizes_revision = again->sizes_revision;  // that of sizes that went is not in the log
    if (TextOf(shown) != TextOf(*again)) {
      return absl::StrCat("shown is\n", TextOf(shown), "and a restart would make\n", TextOf(*again));
    }
  }
  return "";
}

void SimulatedServer::Sweep() { backend_->background().Pass(absl::Hours(1)); }

}  // namespace wellspace::server
