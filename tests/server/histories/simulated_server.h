// The server's services, sessions and store in one thread, over a simulated disk.
#ifndef WELLSPACE_TESTS_SERVER_HISTORIES_SIMULATED_SERVER_H_
#define WELLSPACE_TESTS_SERVER_HISTORIES_SIMULATED_SERVER_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/protobuf/message.h"
#include "server/backend.h"
#include "server/network/connections.h"
#include "server/services/operations/operation_service.h"
#include "server/services/queries/query_service.h"
#include "server/services/sessions/session_service.h"
#include "tests/server/histories/direct_call.h"
#include "tests/server/histories/planted_log.h"
#include "tests/server/store/simulated_disk.h"

namespace wellspace::server {

// The end of a call, as its client sees it. Neither: its server died before.
template <typename Response>
struct Answered {
  bool is_ok = false;
  std::optional<grpc::Status> error{};
  Response response{};
};

// One machine: its disk, its clock, and one process of the server at a time. All of a process runs in the calls of
// this: tasks that are posted to its threads, and requests of its clients. When the disk is dead the process is, too:
// whatever else it does goes nowhere.
//
// Thread safety: none.
class SimulatedServer {
 public:
  static constexpr char kFolder[] = "/data";

  SimulatedServer(SimulatedDisk& disk, Plant plant, MesherFactory create_mesher = core::Mesher::Create, int workers = 1)
      : disk_(disk), plant_(std::move(plant)), create_mesher_(std::move(create_mesher)), workers_(workers) {
    if (!plant_.omits_synchronize.empty()) {
      disk_.OmitSynchronize(plant_.omits_synchronize, [this] { return step_ == plant_.during; });
    }
  }
  ~SimulatedServer() { Kill(); }
  SimulatedServer(const SimulatedServer&) = delete;
  SimulatedServer& operator=(const SimulatedServer&) = delete;

  // Starts a process. An error, if it cannot serve.
  absl::Status Start();
  // Ends the process as a crash does. REQUIRES: the disk is dead, or there is no process.
  void Kill();

  // The step that the process is at from now on.
  void Begin(Step step) { step_ = step; }
  // Ends the step: calls of EndStep that are left out look like a process that is still at it.
  void EndStep();

  // Calls, each to its end.
  Answered<v1::CreateSessionResponse> Create(const v1::CreateSessionRequest& request);
  Answered<v1::UpdateSessionResponse> Update(const v1::UpdateSessionRequest& request);
  Answered<v1::DeleteSessionResponse> Delete(const v1::DeleteSessionRequest& request);
  Answered<v1::ListSessionsResponse> List();
  Answered<v1::UploadPointsResponse> Upload(const std::vector<v1::UploadPointsRequest>& requests,
                                            bool breaks_off = false);
  // Sends these, and leaves the call open over `beside`; then it ends as ever.
  Answered<v1::UploadPointsResponse> UploadBeside(const std::vector<v1::UploadPointsRequest>& requests,
                                                  const std::function<void()>& beside);
  Answered<v1::RemovePointsResponse> RemovePoints(const v1::RemovePointsRequest& request);
  Answered<v1::AddSegmentsResponse> AddSegments(const v1::AddSegmentsRequest& request);
  Answered<v1::AddTrianglesResponse> AddTriangles(const v1::AddTrianglesRequest& request);
  Answered<v1::SetSizesResponse> SetSizes(const v1::SetSizesRequest& request);
  Answered<v1::AddVerticesResponse> AddVertices(const v1::AddVerticesRequest& request);
  Answered<v1::StartRefinementResponse> Refine(const v1::StartRefinementRequest& request);
  Answered<v1::CancelOperationResponse> CancelOperation(const std::string& name);
  Answered<v1::ListOperationsResponse> ListOperations(const std::string& session);
  // All that a download brings, one behind the other.
  Answered<std::string> Download(const std::string& session);

  // A client that watches an operation, for as long as the process lives.
  class Watcher {
   public:
    explicit Watcher(std::unique_ptr<DirectDownload<v1::WatchOperationRequest, v1::WatchOperationResponse>> call)
        : call_(std::move(call)) {}

    // The operation as it has ended; nothing: the client was not told.
    std::optional<v1::Operation> End() const;
    DirectCall& call() { return *call_; }

   private:
    std::unique_ptr<DirectDownload<v1::WatchOperationRequest, v1::WatchOperationResponse>> call_;
  };
  void Watch(const std::string& operation);
  // The operation at its end, as the client that watches it was told.
  std::optional<v1::Operation> EndOf(const std::string& operation) const;

  // Runs the job whose turn it is. False: there is none.
  bool RunJob();
  // The same from within a job, beside it.
  bool RunJobBeside() { return backend_->jobs().RunNext(); }
  // Time passes, for leases and for all that is to be done at a time.
  void Pass(absl::Duration time);
  // The hourly removal of files that are garbage.
  void Sweep();

  // The records of all sessions, and the epoch of the server.
  absl::StatusOr<Census> ReadCensus() { return process_->records->ReadCensus(); }

  // Compares the states that sessions show with those that a restart would make of the log. Returns the difference.
  std::string CheckStates();

 private:
  std::function<bool()> IsAlive() {
    return [this] { return !disk_.is_dead(); };
  }
  // Has all done that is to be done, until `call` has ended.
  void Finish(DirectCall& call);
  // Does the next task, but for jobs. False: there is none.
  bool DoNext();
  template <typename Request, typename Response, typename Service>
  Answered<Response> Unary(Service& service,
                           grpc::ServerUnaryReactor* (Service::*method)(grpc::CallbackServerContext*, const Request*,
                                                                        Response*),
                           const Request& request);
  template <typename Response, typename Request>
  Answered<Response> Stream(grpc::ServerReadReactor<grpc::ByteBuffer>* (SessionService::*method)(
                                grpc::CallbackServerContext*, grpc::ByteBuffer*),
                            const std::vector<Request>& requests, bool breaks_off = false,
                            const std::function<void()>& beside = nullptr);

  // A process.
  struct Process {
    Process(SimulatedServer& machine, std::shared_ptr<SessionLog> durable);

    std::shared_ptr<spdlog::logger> log;
    Connections connections;
    Observability observability;
    Authenticator authenticator;
    PlantedRecords* records;  // of the backend
    Backend backend;
    SessionService sessions{backend.environment()};
    OperationService operations{backend.environment()};
    QueryService queries{backend.environment()};
  };

  SimulatedDisk& disk_;
  const Plant plant_;
  const MesherFactory create_mesher_;
  const int workers_;
  Step step_ = Step::kLook;
  uint64_t sessions_made_ = 0;
  uint64_t ticks_ = 0;  // of the wall clock, which is looked at: no two times are the same
  absl::Duration since_boot_ = absl::Hours(1);
  std::vector<std::pair<std::string, Watcher>> watchers_;  // by operation
  std::unique_ptr<Process> process_;
  Backend* backend_ = nullptr;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HISTORIES_SIMULATED_SERVER_H_
