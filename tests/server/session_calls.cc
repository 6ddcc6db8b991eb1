#include "tests/server/session_calls.h"

#include <chrono>
#include <random>
#include <span>
#include <thread>
#include <utility>

#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

class FakeSessionMesher final : public core::Mesher {
 public:
  // `mesh` null: that of MakeFakeMesh.
  FakeSessionMesher(core::MeshParameters parameters, std::span<const double> points, PhaseScript script,
                    std::shared_ptr<const core::Mesh> mesh = nullptr)
      : parameters_(std::move(parameters)),
        points_(points.begin(), points.end()),
        script_(std::move(script)),
        mesh_(std::move(mesh)) {}

  int dimension() const override { return parameters_.dimension; }
  uint64_t vertex_count() const override {
    return mesh_ != nullptr ? mesh_->vertex_count() : MakeFakeMesh(parameters_, points_).vertex_count();
  }
  uint64_t memory_bytes() const override { return points_.size() * sizeof(double); }
  absl::Status Refine(const core::MeshParameters&, core::RunContext& context) override {
    return Enter(core::Phase::kRefinement, context);
  }
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t>,
                                                      core::RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(Enter(core::Phase::kTree, context));
    points_.insert(points_.end(), points.begin(), points.end());
    return std::vector<uint32_t>(points.size() / dimension());
  }
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double>) override { return near; }
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override {
    return std::vector<double>(vertices.size(), 1.0);
  }
  absl::StatusOr<std::vector<core::Cell>> ClippedCells(std::span<const uint32_t> vertices, double) const override {
    return std::vector<core::Cell>(vertices.size());
  }
  absl::StatusOr<core::Mesh> Extract(int, core::RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(Enter(core::Phase::kSimplices, context));
    context.EnterPhase(core::Phase::kDone);
    return mesh_ != nullptr ? *mesh_ : MakeFakeMesh(parameters_, points_);
  }
  absl::Status Update(core::Mesh& mesh, int threads, core::RunContext& context) override {
    WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
    return absl::OkStatus();
  }
  absl::StatusOr<core::MeshEstimate> Estimate(const core::MeshParameters&, const core::RunContext&) const override {
    return core::MeshEstimate{};
  }

 private:
  absl::Status Enter(core::Phase phase, core::RunContext& context) {
    context.EnterPhase(phase);
    return script_(phase, context);
  }

  const core::MeshParameters parameters_;
  std::vector<double> points_;
  const PhaseScript script_;
  const std::shared_ptr<const core::Mesh> mesh_;
};

template <typename Stub, typename Request, typename Response>
Response Call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
              const Request& request, grpc::Status* status) {
  grpc::ClientContext context;
  Response response;
  const grpc::Status ended = (stub.*method)(&context, request, &response);
  if (status != nullptr) {
    *status = ended;
  } else {
    EXPECT_TRUE(ended.ok()) << ended.error_message();
  }
  return response;
}

}  // namespace

MesherFactory ScriptedMesher(PhaseScript script) {
  return [script = std::move(script)](const core::MeshParameters& parameters, std::span<const double> points,
                                      core::RunContext& context) -> absl::StatusOr<std::unique_ptr<core::Mesher>> {
    context.EnterPhase(core::Phase::kTree);
    WELLSPACE_RETURN_IF_ERROR(script(core::Phase::kTree, context));
    return std::make_unique<FakeSessionMesher>(parameters, points, script);
  };
}

MesherFactory FixedMesher(core::Mesh mesh) {
  return [shared = std::make_shared<const core::Mesh>(std::move(mesh))](
             const core::MeshParameters& parameters, std::span<const double> points, core::RunContext&) {
    const auto script = [](core::Phase, core::RunContext& context) { return context.Check(); };
    return absl::StatusOr<std::unique_ptr<core::Mesher>>(
        std::make_unique<FakeSessionMesher>(parameters, points, script, shared));
  };
}

PhaseScript EndlessIn(core::Phase phase, std::function<void()> begun) {
  return [phase, begun = std::move(begun)](core::Phase entered, core::RunContext& context) {
    if (entered == phase) {
      begun();
      while (!context.IsCancelled()) {
        std::this_thread::sleep_for(std::chrono::microseconds(100));  // as often as the core looks
      }
    }
    return context.Check();
  };
}

Watch::Watch(v1::OperationService::Stub& stub, const std::string& name, std::optional<uint64_t> after,
             std::optional<absl::Duration> timeout) {
  if (timeout.has_value()) {
    context_.set_deadline(absl::ToChronoTime(absl::Now() + *timeout));
  }
  v1::WatchOperationRequest request;
  request.set_name(name);
  if (after.has_value()) {
    request.set_after_sequence(*after);
  }
  stream_ = stub.WatchOperation(&context_, request);
}

Watch::~Watch() {
  if (!finished_) {
    Cancel();
    Finish();
  }
}

bool Watch::Read() {
  v1::WatchOperationResponse response;
  if (!stream_->Read(&response)) {
    return false;
  }
  EXPECT_FALSE(operation.has_value()) << "something after the operation's end";
  if (response.has_progress()) {
    events.push_back(response.progress());
    times.push_back(absl::Now());
  } else {
    operation = response.operation();
  }
  return true;
}

bool Watch::ReadUntil(v1::Phase phase) {
  while (events.empty() || events.back().phase() < phase) {
    if (!Read()) {
      return false;
    }
  }
  return true;
}

grpc::Status Watch::Finish() {
  while (Read()) {
  }
  finished_ = true;
  return stream_->Finish();
}

SessionCalls::SessionCalls(const std::shared_ptr<grpc::Channel>& channel)
    : sessions_(v1::SessionService::NewStub(channel)), operations_(v1::OperationService::NewStub(channel)) {}

v1::Session SessionCalls::Create(const v1::CreateSessionRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::CreateSession, request, status).session();
}

v1::Session SessionCalls::Create(int dimension) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(dimension);
  return Create(request);
}

v1::Session SessionCalls::Get(const std::string& name, grpc::Status* status) {
  v1::GetSessionRequest request;
  request.set_name(name);
  return Call(*sessions_, &v1::SessionService::Stub::GetSession, request, status).session();
}

v1::ListSessionsResponse SessionCalls::List(const v1::ListSessionsRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::ListSessions, request, status);
}

v1::Session SessionCalls::Update(const v1::UpdateSessionRequest& request, grpc::Status* status) {
  return Call(*sessions_, &v1::SessionService::Stub::UpdateSession, request, status).session();
}

void SessionCalls::Delete(const v1::DeleteSessionRequest& request, grpc::Status* status) {
  Call(*sessions_, &v1::SessionService::Stub::DeleteSession, request, status);
}

void SessionCalls::Delete(const std::string& name, grpc::Status* status) {
  v1::DeleteSessionRequest request;
  request.set_name(name);
  Delete(request, status);
}

v1::UploadPointsResponse SessionCalls::Upload(const std::vector<v1::UploadPointsRequest>& requests,
                                              grpc::Status* status) {
  grpc::ClientContext context;
  v1::UploadPointsResponse response;
  const auto stream = sessions_->UploadPoints(&context, &response);
  for (const v1::UploadPointsRequest& request : requests) {
    stream->Write(request);
  }
  stream->WritesDone();
  const grpc::Status ended = stream->Finish();
  if (status != nullptr) {
    *status = ended;
  } else {
    EXPECT_TRUE(ended.ok()) << ended.error_message();
  }
  return response;
}

v1::UploadPointsResponse SessionCalls::Upload(const std::string& name, uint64_t offset,
                                              const std::vector<double>& coordinates, grpc::Status* status) {
  return Upload({UploadRequest(name, offset, coordinates)}, status);
}

v1::Operation SessionCalls::Start(const v1::StartRefinementRequest& request, grpc::Status* status) {
  return Call(*operations_, &v1::OperationService::Stub::StartRefinement, request, status).operation();
}

v1::Operation SessionCalls::Start(const std::string& name, grpc::Status* status) {
  v1::StartRefinementRequest request;
  request.set_name(name);
  return Start(request, status);
}

v1::Operation SessionCalls::GetOperation(const std::string& name, grpc::Status* status) {
  v1::GetOperationRequest request;
  request.set_name(name);
  return Call(*operations_, &v1::OperationService::Stub::GetOperation, request, status).operation();
}

v1::ListOperationsResponse SessionCalls::ListOperations(const v1::ListOperationsRequest& request,
                                                        grpc::Status* status) {
  return Call(*operations_, &v1::OperationService::Stub::ListOperations, request, status);
}

v1::Operation SessionCalls::Cancel(const std::string& name, grpc::Status* status) {
  v1::CancelOperationRequest request;
  request.set_name(name);
  return Call(*operations_, &v1::OperationService::Stub::CancelOperation, request, status).operation();
}

v1::Operation SessionCalls::Refine(const std::string& name) {
  Watch watch(*operations_, Start(name).name());
  const grpc::Status status = watch.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return watch.operation.value_or(v1::Operation());
}

v1::UploadPointsRequest UploadRequest(const std::string& name, uint64_t offset,
                                      const std::vector<double>& coordinates) {
  v1::UploadPointsRequest request;
  request.set_name(name);
  request.set_point_offset(offset);
  request.mutable_points()->mutable_coordinates()->Assign(coordinates.begin(), coordinates.end());
  return request;
}

std::vector<double> UniformPoints(size_t count, int dimension, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  std::vector<double> points(count * dimension);
  for (double& coordinate : points) {
    coordinate = uniform(generator);
  }
  return points;
}

}  // namespace wellspace::server
