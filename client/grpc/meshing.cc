// MeshingService and health on the client's side.
#include <algorithm>
#include <thread>
#include <utility>

#include "client/grpc/convert.h"
#include "client/grpc/feature_messages.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/mesh_receiver.h"
#include "client/grpc/request_writer.h"
#include "client/grpc/size_messages.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

using MeshPointsStream = grpc::ClientReaderWriter<v1::MeshPointsRequest, v1::MeshPointsResponse>;

// Sends `rows` rows and `seeds` seeds, each message filled by a function that returns the number after the last; false
// when the call has ended. The rules come even where there are no rows.
template <typename Request, typename Stream, typename FillRows, typename FillSeeds>
bool SendRowsAndSeeds(size_t rows, FillRows fill_rows, size_t seeds, FillSeeds fill_seeds, Request& request,
                      Stream& stream) {
  for (size_t next = 0; next < rows;) {
    next = fill_rows(next);
    if (!stream.Write(request)) {
      return false;
    }
  }
  size_t next = 0;
  do {
    next = fill_seeds(next);
    if (!stream.Write(request)) {
      return false;
    }
  } while (next < seeds);
  return true;
}

template <typename Request, typename Stream>
bool SendFeatures(const Features& features, Request& request, Stream& stream) {
  return SendRowsAndSeeds(
      features.ends.size() / 2, [&](size_t next) { return FillSegments(features, next, *request.mutable_segments()); },
      features.seeds.size(), [&](size_t next) { return FillFaces(features, next, *request.mutable_faces()); }, request,
      stream);
}

template <typename Request, typename Stream>
bool SendFeatures(const SurfaceFeatures& surface, Request& request, Stream& stream) {
  return SendRowsAndSeeds(
      surface.corners.size() / 3,
      [&](size_t next) { return FillTriangles(surface, next, *request.mutable_triangles()); }, surface.seeds.size(),
      [&](size_t next) { return FillSurface(surface, next, *request.mutable_surface()); }, request, stream);
}

// The same of sizes at points. They come before the points, so that wrong ones are refused at once.
template <typename Request, typename Stream>
bool UploadSizes(const SizeSamples& samples, int dimension, Request& request, Stream& stream) {
  size_t next = 0;
  do {
    next = FillSizes(samples, dimension, next, *request.mutable_size_samples());
    if (!stream.Write(request)) {
      return false;
    }
  } while (next < samples.sizes.size());
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
  if (options.size_samples != nullptr && !UploadSizes(*options.size_samples, options.dimension, request, stream)) {
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
  if (options.features != nullptr && !SendFeatures(*options.features, request, stream)) {
    return;
  }
  if (options.surface != nullptr && !SendFeatures(*options.surface, request, stream)) {
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
    const std::unique_ptr<MeshPointsStream> stream = servers_.first().meshing->MeshPoints(context.get());
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
      return servers_.first().meshing->PrepareAsyncEstimateMesh(context.get(), &response, queue);
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
  WELLSPACE_RETURN_IF_ERROR(Call(*servers_.first().meshing, &v1::MeshingService::Stub::GetServerInfo,
                                 v1::GetServerInfoRequest(), call, &response));
  return InfoFromProto(response);
}

absl::StatusOr<Health> GrpcConnection::CheckHealth(const std::string& service, const CallOptions& call) {
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  grpc::health::v1::HealthCheckResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      Call(*servers_.first().health, &grpc::health::v1::Health::Stub::Check, request, call, &response));
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
