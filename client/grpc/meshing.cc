// MeshingService and health on the client's side.
#include <algorithm>
#include <thread>
#include <utility>

#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/mesh_receiver.h"
#include "client/grpc/request_writer.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

using MeshPointsStream = grpc::ClientReaderWriter<v1::MeshPointsRequest, v1::MeshPointsResponse>;

// Segments and seeds of one message: about 256 KiB.
constexpr size_t kSegmentsOfARequest = 16'384;
constexpr size_t kSeedsOfARequest = 4'096;

v1::FaceRule RuleToProto(FaceRule rule) {
  return rule == FaceRule::kHoles     ? v1::FACE_RULE_HOLES
         : rule == FaceRule::kEvenOdd ? v1::FACE_RULE_EVEN_ODD
                                      : v1::FACE_RULE_BOX;
}

// Sends segments and faces; false when the call has ended. The rules come even where there is no segment.
template <typename Request, typename Stream>
bool UploadFeatures(const Features& features, Request& request, Stream& stream) {
  const size_t count = features.ends.size() / 2;
  const auto is_open = [&](size_t s) { return s < features.is_open.size() && features.is_open[s] != 0; };
  for (size_t first = 0; first < count;) {
    v1::SegmentChunk& chunk = *request.mutable_segments();
    chunk.Clear();
    chunk.set_open(is_open(first));
    for (const size_t begin = first;
         first < count && first - begin < kSegmentsOfARequest && is_open(first) == chunk.open(); ++first) {
      chunk.add_ends(features.ends[2 * first]);
      chunk.add_ends(features.ends[2 * first + 1]);
      if (!features.markers.empty()) {
        chunk.add_markers(features.markers[first]);
      }
    }
    if (!stream.Write(request)) {
      return false;
    }
  }
  size_t next = 0;
  do {
    v1::FaceOptions& options = *request.mutable_faces();
    options.Clear();
    options.set_faces(RuleToProto(features.faces));
    options.set_crossings(features.split_crossings ? v1::CROSSING_RULE_SPLIT : v1::CROSSING_RULE_REFUSE);
    for (const size_t end = std::min(next + kSeedsOfARequest, features.seeds.size()); next < end; ++next) {
      const FaceSeed& seed = features.seeds[next];
      v1::FaceSeed& message = *options.add_seeds();
      message.set_x(seed.x);
      message.set_y(seed.y);
      message.set_hole(seed.is_hole);
      message.set_region(seed.region);
      message.set_max_area(seed.max_area);
    }
    if (!stream.Write(request)) {
      return false;
    }
  } while (next < features.seeds.size());
  return true;
}

// Sends everything and half-closes. Stops early when the call has ended; its status says why.
// `request` is the first message, but for the parameters.
template <typename Request, typename Stream>
void SendCloud(const MeshOptions& options, std::span<const double> points, Request request, Stream& stream) {
  SetParameters(options, request.mutable_parameters());
  if (!stream.Write(request)) {
    return;
  }
  const size_t row = std::max(1, options.dimension);
  const size_t chunk_size = RowsOfARequest(row) * row;
  while (!points.empty()) {
    const std::span<const double> chunk = points.first(std::min(points.size(), chunk_size));
    request.mutable_points()->mutable_coordinates()->Assign(chunk.begin(), chunk.end());
    if (!stream.Write(request)) {
      return;
    }
    points = points.subspan(chunk.size());
  }
  if (options.features != nullptr && !UploadFeatures(*options.features, request, stream)) {
    return;
  }
  stream.WritesDone();
}

}  // namespace

absl::Status GrpcConnection::MeshPoints(const MeshOptions& options, std::span<const double> points, MeshSink& sink,
                                        const OnProgress& on_progress, const CallOptions& call) {
  const int dimension = std::max(1, options.dimension);
  return retrier_.Run(call.timeout, call.stop, [&](Attempt& attempt) {
    CallContext context(attempt);
    const std::unique_ptr<MeshPointsStream> stream = meshing_->MeshPoints(context.get());
    // Points go up while answers come down: the server may fail the call before it has all.
    v1::MeshPointsRequest first;
    first.set_with_boundary(sink.WantsBoundary());
    std::jthread uploader([&] { SendCloud(options, points, first, *stream); });
    MeshReceiver receiver(sink, {.dimension = dimension, .input_points = points.size() / dimension});
    absl::Status damage;
    bool has_begun = false;  // the work: it is not done twice
    v1::MeshPointsResponse response;
    while (damage.ok() && stream->Read(&response)) {
      has_begun = has_begun || !response.has_progress() || response.progress().phase() != v1::PHASE_WAITING;
      if (response.has_metadata()) {
        damage = receiver.SetMetadata(response.metadata());
      } else if (response.has_chunk()) {
        damage = receiver.AddChunk(response.chunk());
      } else if (response.has_progress() && on_progress != nullptr) {
        on_progress(ProgressFromProto(response.progress()));
      }
    }
    if (!damage.ok()) {
      context.Cancel();
    }
    uploader.join();
    const absl::Status status = FromGrpcStatus(stream->Finish());
    if (!damage.ok()) {
      return attempt.Final(damage);
    }
    if (!status.ok()) {
      const bool is_cancelled = absl::IsCancelled(status);  // by the caller, perhaps: the Retrier knows
      return has_begun && !is_cancelled ? attempt.Final(status) : status;
    }
    return attempt.Final(receiver.Finish());
  });
}

absl::StatusOr<MeshEstimate> GrpcConnection::EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                                          const CallOptions& call) {
  v1::EstimateMeshResponse response;
  const absl::Status status = retrier_.Run(call.timeout, call.stop, [&](Attempt& attempt) {
    CallContext context(attempt);
    RequestWriter<v1::EstimateMeshRequest> stream([&](grpc::CompletionQueue* queue) {
      return meshing_->PrepareAsyncEstimateMesh(context.get(), &response, queue);
    });
    SendCloud(options, points, v1::EstimateMeshRequest(), stream);
    return FromGrpcStatus(stream.Finish());
  });
  if (!status.ok()) {
    return status;
  }
  return MeshEstimate{.vertices = response.vertices(),
                      .simplices = response.simplices(),
                      .memory_bytes = response.memory_bytes(),
                      .tree_leaves = response.tree_leaves()};
}

absl::StatusOr<ServerInfo> GrpcConnection::GetServerInfo(const CallOptions& call) {
  v1::GetServerInfoResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      Call(*meshing_, &v1::MeshingService::Stub::GetServerInfo, v1::GetServerInfoRequest(), call, &response));
  return InfoFromProto(response);
}

absl::StatusOr<Health> GrpcConnection::CheckHealth(const std::string& service, const CallOptions& call) {
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  grpc::health::v1::HealthCheckResponse response;
  WELLSPACE_RETURN_IF_ERROR(Call(*health_, &grpc::health::v1::Health::Stub::Check, request, call, &response));
  switch (response.status()) {
    case grpc::health::v1::HealthCheckResponse::SERVING:
      return Health::kServing;
    case grpc::health::v1::HealthCheckResponse::NOT_SERVING:
      return Health::kNotServing;
    default:
      return Health::kUnknown;
  }
}

}  // namespace wellspace::client
