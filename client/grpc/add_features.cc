// The features that bound a domain, on their way to a session: segments, or triangles.
#include <optional>
#include <utility>

#include "client/error_details.h"
#include "client/grpc/convert.h"
#include "client/grpc/feature_messages.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/request_writer.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

// The differences of the two kinds: the request, and where it has its rows.
struct SegmentKind {
  using Request = v1::AddSegmentsRequest;
  using Response = v1::AddSegmentsResponse;
  using Offset = FeatureOffset;

  static Offset EndOf(const v1::Session& session) {
    return {.segments = session.segment_count(), .seeds = session.seed_count()};
  }
  static size_t CountOf(const Features& features) { return features.ends.size() / 2; }
  static size_t FillRows(const Features& features, const Offset& offset, size_t first, Request& request) {
    request.set_segment_offset(offset.segments + first);
    request.clear_segments();
    return first == CountOf(features) ? first : FillSegments(features, first, *request.mutable_segments());
  }
  static size_t FillSeeds(const Features& features, size_t first, Request& request) {
    return FillFaces(features, first, *request.mutable_faces());
  }
  static auto Prepare(v1::SessionService::Stub& stub, grpc::ClientContext* context, Response* response,
                      grpc::CompletionQueue* queue) {
    return stub.PrepareAsyncAddSegments(context, response, queue);
  }
};

struct TriangleKind {
  using Request = v1::AddTrianglesRequest;
  using Response = v1::AddTrianglesResponse;
  using Offset = SurfaceOffset;

  static Offset EndOf(const v1::Session& session) {
    return {.triangles = session.triangle_count(), .seeds = session.seed_count()};
  }
  static size_t CountOf(const SurfaceFeatures& surface) { return surface.corners.size() / 3; }
  static size_t FillRows(const SurfaceFeatures& surface, const Offset& offset, size_t first, Request& request) {
    request.set_triangle_offset(offset.triangles + first);
    request.clear_triangles();
    return first == CountOf(surface) ? first : FillTriangles(surface, first, *request.mutable_triangles());
  }
  static size_t FillSeeds(const SurfaceFeatures& surface, size_t first, Request& request) {
    return FillSurface(surface, first, *request.mutable_surface());
  }
  static auto Prepare(v1::SessionService::Stub& stub, grpc::ClientContext* context, Response* response,
                      grpc::CompletionQueue* queue) {
    return stub.PrepareAsyncAddTriangles(context, response, queue);
  }
};

// Sends everything and half-closes. Stops early when the call has ended; its status says why. `request` is the first
// message, but for the rows that it adds.
template <typename Kind, typename Given>
void Send(const Given& given, const typename Kind::Offset& offset, typename Kind::Request request,
          RequestWriter<typename Kind::Request>& stream) {
  request.set_seed_offset(offset.seeds);
  const size_t count = Kind::CountOf(given);
  for (size_t next = 0; next < count;) {
    next = Kind::FillRows(given, offset, next, request);
    if (!stream.Write(request)) {
      return;
    }
  }
  Kind::FillRows(given, offset, count, request);
  size_t next = 0;
  do {
    request.set_seed_offset(offset.seeds + next);
    next = Kind::FillSeeds(given, next, request);
    if (!stream.Write(request)) {
      return;
    }
  } while (next < given.seeds.size());
  stream.WritesDone();
}

// `run`: makes attempts at the server that has the session.
template <typename Kind, typename Given, typename Run>
absl::Status Add(const std::string& session, const Given& given, std::optional<typename Kind::Offset> begin,
                 std::optional<uint64_t> expected_revision, const Run& run, typename Kind::Response* response) {
  return run([&](const Server& server, Attempt& attempt) {
    if (!begin.has_value()) {
      const absl::StatusOr<v1::Session> found = FetchSession(session, server, attempt);
      if (!found.ok()) {
        return found.status();
      }
      begin = Kind::EndOf(*found);
    }
    CallContext context(attempt);
    RequestWriter<typename Kind::Request> stream(
        [&](grpc::CompletionQueue* queue) { return Kind::Prepare(*server.sessions, context.get(), response, queue); });
    typename Kind::Request first;
    first.set_name(session);
    // The commits of an attempt before this one have changed the revision.
    const std::optional<uint64_t> expected = std::exchange(expected_revision, std::nullopt);
    SetExpectedRevision(expected, first);
    Send<Kind>(given, *begin, std::move(first), stream);
    const absl::Status status = FromGrpcStatus(stream.Finish());
    if (!OwnerAddressOf(status).empty()) {
      expected_revision = expected;  // a server that has not the session commits nothing
    }
    return status;
  });
}

}  // namespace

absl::StatusOr<AddedSegments> GrpcConnection::AddSegments(const std::string& session, const Features& features,
                                                          const std::optional<FeatureOffset>& offset,
                                                          const CallOptions& call) {
  v1::AddSegmentsResponse response;
  const auto run = [&](const AttemptAt& attempt_at) { return RunOn(session, call, attempt_at); };
  WELLSPACE_RETURN_IF_ERROR(Add<SegmentKind>(session, features, offset, call.expected_revision, run, &response));
  return AddedSegments{
      .segment_count = response.segment_count(), .seed_count = response.seed_count(), .revision = response.revision()};
}

absl::StatusOr<AddedTriangles> GrpcConnection::AddTriangles(const std::string& session, const SurfaceFeatures& surface,
                                                            const std::optional<SurfaceOffset>& offset,
                                                            const CallOptions& call) {
  v1::AddTrianglesResponse response;
  const auto run = [&](const AttemptAt& attempt_at) { return RunOn(session, call, attempt_at); };
  WELLSPACE_RETURN_IF_ERROR(Add<TriangleKind>(session, surface, offset, call.expected_revision, run, &response));
  return AddedTriangles{.triangle_count = response.triangle_count(),
                        .seed_count = response.seed_count(),
                        .revision = response.revision()};
}

}  // namespace wellspace::client
