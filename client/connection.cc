#include "client/connection.h"

#include <algorithm>
#include <string>
#include <thread>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/mesh_assembler.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/channel.h"
#include "grpcpp/client_context.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::client {
namespace {

// Of the coordinates of one request, so that the message stays below 1 MiB.
constexpr size_t kChunkBytes = 1024 * 1024 - 64;

using MeshPointsStream = grpc::ClientReaderWriter<v1::MeshPointsRequest, v1::MeshPointsResponse>;

absl::Status FromGrpcStatus(const grpc::Status& status) {
  absl::Status result(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  google::rpc::Status details;
  if (!result.ok() && details.ParseFromString(status.error_details())) {
    for (const google::protobuf::Any& detail : details.details()) {
      result.SetPayload(detail.type_url(), absl::Cord(detail.value()));
    }
  }
  return result;
}

const char* PhaseName(v1::Phase phase) {
  switch (phase) {
    case v1::PHASE_WAITING:
      return "waiting";
    case v1::PHASE_TREE:
      return "tree";
    case v1::PHASE_REFINEMENT:
      return "refinement";
    case v1::PHASE_SIMPLICES:
      return "simplices";
    case v1::PHASE_DONE:
      return "done";
    default:
      return "unknown";  // of a newer server
  }
}

Progress ProgressFromProto(const v1::ProgressEvent& event) {
  return Progress{.phase = PhaseName(event.phase()),
                  .vertices = event.vertices(),
                  .estimated_vertices = event.estimated_vertices(),
                  .simplices = event.simplices(),
                  .fraction = event.fraction()};
}

void SetParameters(const MeshOptions& options, v1::MeshParameters* parameters) {
  parameters->set_dimension(options.dimension);
  parameters->set_rho(options.rho);
  parameters->set_criterion(options.criterion == Criterion::kWellSpaced ? v1::CRITERION_WELL_SPACED
                                                                        : v1::CRITERION_RADIUS_EDGE);
  parameters->set_max_circumradius(options.max_circumradius);
  for (const SizeBox& box : options.size_boxes) {
    v1::SizeBox* message = parameters->add_size_boxes();
    message->mutable_low()->Assign(box.low.begin(), box.low.end());
    message->mutable_high()->Assign(box.high.begin(), box.high.end());
    message->set_max_circumradius(box.max_circumradius);
  }
  if (!options.domain_low.empty() || !options.domain_high.empty()) {
    parameters->mutable_domain()->mutable_low()->Assign(options.domain_low.begin(), options.domain_low.end());
    parameters->mutable_domain()->mutable_high()->Assign(options.domain_high.begin(), options.domain_high.end());
  }
  parameters->set_margin(options.margin);
  parameters->set_max_vertices(options.max_vertices);
  parameters->set_threads(options.threads);
}

// Sends everything and half-closes. Stops early when the call has ended; its status says why.
template <typename Request, typename Stream>
void Upload(const MeshOptions& options, std::span<const double> points, Stream& stream) {
  Request request;
  SetParameters(options, request.mutable_parameters());
  if (!stream.Write(request)) {
    return;
  }
  const size_t row = std::max(1, options.dimension);
  const size_t chunk_size = std::max<size_t>(1, kChunkBytes / sizeof(double) / row) * row;
  while (!points.empty()) {
    const std::span<const double> chunk = points.first(std::min(points.size(), chunk_size));
    request.mutable_points()->mutable_coordinates()->Assign(chunk.begin(), chunk.end());
    if (!stream.Write(request)) {
      return;
    }
    points = points.subspan(chunk.size());
  }
  stream.WritesDone();
}

void SetDeadline(const MeshOptions& options, grpc::ClientContext& context) {
  if (options.timeout < absl::InfiniteDuration()) {
    context.set_deadline(absl::ToChronoTime(absl::Now() + options.timeout));
  }
}

// The status of a call that the caller could cancel by `stop`.
absl::Status StatusOf(const grpc::Status& status, const std::stop_token& stop) {
  if (status.error_code() == grpc::StatusCode::CANCELLED && stop.stop_requested()) {
    return absl::CancelledError("cancelled by the caller");
  }
  return FromGrpcStatus(status);
}

class GrpcConnection final : public Connection {
 public:
  explicit GrpcConnection(std::shared_ptr<grpc::Channel> channel)
      : stub_(v1::MeshingService::NewStub(std::move(channel))) {}

  absl::StatusOr<Mesh> MeshPoints(const MeshOptions& options, std::span<const double> points,
                                  const std::function<void(const Progress&)>& on_progress,
                                  std::stop_token stop) override;
  absl::StatusOr<MeshEstimate> EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                            std::stop_token stop) override;
  absl::StatusOr<ServerInfo> GetServerInfo() override;

 private:
  const std::unique_ptr<v1::MeshingService::Stub> stub_;
};

absl::StatusOr<Mesh> GrpcConnection::MeshPoints(const MeshOptions& options, std::span<const double> points,
                                                const std::function<void(const Progress&)>& on_progress,
                                                std::stop_token stop) {
  grpc::ClientContext context;
  SetDeadline(options, context);
  const std::unique_ptr<MeshPointsStream> stream = stub_->MeshPoints(&context);
  std::stop_callback cancel(stop, [&context] { context.TryCancel(); });

  // Points go up while answers come down: the server may fail the call before it has all.
  std::jthread uploader([&] { Upload<v1::MeshPointsRequest>(options, points, *stream); });
  const int dimension = std::max(1, options.dimension);
  MeshAssembler assembler(dimension, points.size() / dimension);
  absl::Status damage;
  v1::MeshPointsResponse response;
  while (damage.ok() && stream->Read(&response)) {
    if (response.has_metadata()) {
      damage = assembler.SetMetadata(response.metadata());
    } else if (response.has_chunk()) {
      damage = assembler.AddChunk(response.chunk());
    } else if (response.has_progress() && on_progress != nullptr) {
      on_progress(ProgressFromProto(response.progress()));
    }
  }
  if (!damage.ok()) {
    context.TryCancel();
  }
  uploader.join();
  const grpc::Status status = stream->Finish();
  if (!damage.ok()) {
    return damage;
  }
  if (!status.ok()) {
    return StatusOf(status, stop);
  }
  return assembler.Finish();
}

absl::StatusOr<MeshEstimate> GrpcConnection::EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                                          std::stop_token stop) {
  grpc::ClientContext context;
  SetDeadline(options, context);
  v1::EstimateMeshResponse response;
  const std::unique_ptr<grpc::ClientWriter<v1::EstimateMeshRequest>> stream = stub_->EstimateMesh(&context, &response);
  std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
  Upload<v1::EstimateMeshRequest>(options, points, *stream);
  if (const grpc::Status status = stream->Finish(); !status.ok()) {
    return StatusOf(status, stop);
  }
  return MeshEstimate{.vertices = response.vertices(),
                      .simplices = response.simplices(),
                      .memory_bytes = response.memory_bytes(),
                      .tree_leaves = response.tree_leaves()};
}

absl::StatusOr<ServerInfo> GrpcConnection::GetServerInfo() {
  grpc::ClientContext context;
  v1::GetServerInfoResponse response;
  if (const grpc::Status status = stub_->GetServerInfo(&context, v1::GetServerInfoRequest(), &response); !status.ok()) {
    return FromGrpcStatus(status);
  }
  ServerInfo info;
  info.version = response.version();
  info.dimensions.assign(response.dimensions().begin(), response.dimensions().end());
  info.max_points = response.max_points();
  info.max_vertices = response.max_vertices();
  info.workers = response.workers();
  info.running_jobs = response.running_jobs();
  info.queued_jobs = response.queued_jobs();
  return info;
}

}  // namespace

std::string BlamedField(const absl::Status& status) {
  google::rpc::BadRequest bad_request;
  const std::string type = absl::StrCat("type.googleapis.com/", bad_request.GetTypeName());
  const absl::optional<absl::Cord> payload = status.GetPayload(type);
  if (!payload.has_value() || !bad_request.ParseFromString(std::string(*payload)) ||
      bad_request.field_violations().empty()) {
    return "";
  }
  return bad_request.field_violations(0).field();
}

std::shared_ptr<Connection> MakeConnection(std::shared_ptr<grpc::Channel> channel) {
  return std::make_shared<GrpcConnection>(std::move(channel));
}

}  // namespace wellspace::client
