// QueryService on the client's side.
#include <algorithm>
#include <cmath>
#include <functional>

#include "absl/strings/str_cat.h"
#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/mesh_values.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

// Of one request, which then has half a MiB.
constexpr size_t kVerticesOfARequest = 1 << 17;

// Of one request to locate them.
constexpr size_t kPointsOfARequest = 1 << 14;

// GetServerInfoResponse.max_request_bytes of every server so far.
constexpr size_t kMostBytesOfARequest = size_t{4} << 20;

// A barycentric coordinate is 1 at most, but for rounding.
constexpr double kMostCoordinate = 1 + 1e-9;

// Makes as many calls as the vertices take, and goes on after the last answered vertex when a connection breaks off.
// Answers of a call about all vertices are not counted beforehand: it is repeated only as long as nothing has come.
//
// `open` starts a call with a request of these vertices; `take` hands a response on, and says how many vertices it was
// about.
template <typename Request, typename Response>
absl::Status StreamAnswers(
    Retrier& retrier, Request request, std::span<const uint32_t> vertices, const CallOptions& call,
    const std::function<std::unique_ptr<grpc::ClientReader<Response>>(grpc::ClientContext*, const Request&)>& open,
    const std::function<absl::StatusOr<size_t>(const Response&)>& take) {
  const bool all = vertices.empty();
  size_t answered = 0;
  const auto answer_part = [&](size_t end, Attempt& attempt) -> absl::Status {
    request.mutable_vertices()->Assign(vertices.begin() + (all ? 0 : answered), vertices.begin() + end);
    CallContext context(attempt);
    const std::unique_ptr<grpc::ClientReader<Response>> stream = open(context.get(), request);
    absl::Status damage;
    Response response;
    while (damage.ok() && stream->Read(&response)) {
      const absl::StatusOr<size_t> taken = take(response);
      damage = taken.status();
      answered += taken.value_or(0);
      if (!all && answered > end) {
        damage = Contradiction("more than ", end, " vertices");
      }
      attempt.NoteProgress();
    }
    if (!damage.ok()) {
      context.Cancel();
    }
    const absl::Status status = FromGrpcStatus(stream->Finish());
    if (!damage.ok()) {
      return attempt.Final(damage);
    }
    if (!all && answered == end) {
      // A connection that breaks after the last answer costs nothing; and a request without vertices asks about all.
      return attempt.Final(absl::OkStatus());
    }
    if (!status.ok()) {
      return all && answered > 0 && !absl::IsCancelled(status) ? attempt.Final(status) : status;
    }
    return all ? absl::OkStatus() : attempt.Final(Contradiction(answered, " of ", end, " vertices"));
  };
  const absl::Duration deadline = SinceBoot() + call.timeout;
  do {
    const size_t end = std::min(vertices.size(), answered + kVerticesOfARequest);
    WELLSPACE_RETURN_IF_ERROR(
        retrier.Run(deadline - SinceBoot(), call.stop, [&](Attempt& attempt) { return answer_part(end, attempt); }));
  } while (!all && answered < vertices.size());
  return absl::OkStatus();
}

// Whether `response` can be the answer to `request` about `count` points.
absl::Status CheckLocated(const v1::LocateRequest& request, size_t count, size_t dimension,
                          const v1::LocateResponse& response) {
  const size_t corners = count * (dimension + 1);
  if (static_cast<size_t>(response.simplices_size()) != count ||
      static_cast<size_t>(response.vertices_size()) != corners ||
      static_cast<size_t>(response.coordinates_size()) != corners) {
    return Contradiction(response.simplices_size(), " simplices, ", response.vertices_size(), " vertices and ",
                         response.coordinates_size(), " coordinates for ", count, " points");
  }
  if (response.revision() == 0 || (request.has_revision() && request.revision() != response.revision())) {
    return Contradiction("points in the mesh of revision ", response.revision(), ", not ", request.revision());
  }
  for (size_t i = 0; i < count; ++i) {
    const bool is_in_none = response.simplices(static_cast<int>(i)) == kNoSimplex;
    if (is_in_none && !request.allow_outside()) {
      return Contradiction("points[", request.point_offset() + i, "] is in no simplex, which was not allowed");
    }
    for (size_t at = i * (dimension + 1); at < (i + 1) * (dimension + 1); ++at) {
      const uint32_t vertex = response.vertices(static_cast<int>(at));
      const double coordinate = response.coordinates(static_cast<int>(at));
      if (!is_in_none && vertex >= response.vertex_count()) {
        return Contradiction("points[", request.point_offset() + i, "] is at vertex ", vertex, " of ",
                             response.vertex_count());
      }
      if (!(coordinate >= 0 && coordinate <= (is_in_none ? 0 : kMostCoordinate))) {
        return Contradiction("points[", request.point_offset() + i, "] has the barycentric coordinate ", coordinate);
      }
    }
  }
  return absl::OkStatus();
}

template <typename Response>
std::function<absl::StatusOr<size_t>(const Response&)> HandOn(const OnCells& on_cells) {
  return [&on_cells](const Response& response) -> absl::StatusOr<size_t> {
    WELLSPACE_ASSIGN_OR_RETURN(const CellBatch cells, CellsFromProto(response.cells()));
    WELLSPACE_RETURN_IF_ERROR(on_cells(cells));
    return cells.vertices.size();
  };
}

}  // namespace

absl::Status GrpcConnection::ApproximateNearestNeighbors(const std::string& session, std::span<const uint32_t> vertices,
                                                         const OnDistances& on_distances, const CallOptions& call) {
  v1::ApproximateNearestNeighborsRequest request;
  request.set_name(session);
  return StreamAnswers<v1::ApproximateNearestNeighborsRequest, v1::ApproximateNearestNeighborsResponse>(
      retrier_, request, vertices, call,
      [this](grpc::ClientContext* context, const v1::ApproximateNearestNeighborsRequest& part) {
        return queries_->ApproximateNearestNeighbors(context, part);
      },
      [&on_distances](const v1::ApproximateNearestNeighborsResponse& response) -> absl::StatusOr<size_t> {
        const size_t count = response.distances_size();
        if (!std::ranges::all_of(response.distances(), [](double distance) { return distance >= 0; })) {
          return Contradiction("a distance that is negative or not a number");
        }
        WELLSPACE_RETURN_IF_ERROR(on_distances({response.distances().data(), count}));
        return count;
      });
}

absl::Status GrpcConnection::ClippedVoronoiCells(const std::string& session, std::span<const uint32_t> vertices,
                                                 double beta, const OnCells& on_cells, const CallOptions& call) {
  v1::ClippedVoronoiCellsRequest request;
  request.set_name(session);
  request.set_beta(beta);
  return StreamAnswers<v1::ClippedVoronoiCellsRequest, v1::ClippedVoronoiCellsResponse>(
      retrier_, request, vertices, call,
      [this](grpc::ClientContext* context, const v1::ClippedVoronoiCellsRequest& part) {
        return queries_->ClippedVoronoiCells(context, part);
      },
      HandOn<v1::ClippedVoronoiCellsResponse>(on_cells));
}

absl::Status GrpcConnection::VoronoiCells(const std::string& session, std::span<const uint32_t> vertices,
                                          const OnCells& on_cells, const CallOptions& call) {
  v1::VoronoiCellsRequest request;
  request.set_name(session);
  return StreamAnswers<v1::VoronoiCellsRequest, v1::VoronoiCellsResponse>(
      retrier_, request, vertices, call,
      [this](grpc::ClientContext* context, const v1::VoronoiCellsRequest& part) {
        return queries_->VoronoiCells(context, part);
      },
      HandOn<v1::VoronoiCellsResponse>(on_cells));
}

absl::StatusOr<Located> GrpcConnection::Locate(const std::string& session, std::span<const double> points,
                                               const LocateOptions& options, const CallOptions& call) {
  WELLSPACE_ASSIGN_OR_RETURN(const Session found, GetSession(session, call));
  const size_t dimension = std::max(1, found.parameters.dimension);
  v1::LocateRequest request;
  request.set_name(session);
  if (options.revision.has_value()) {
    request.set_revision(*options.revision);
  }
  request.set_allow_outside(options.allow_outside);
  Located located;
  size_t done = 0;  // coordinates
  do {
    const std::span<const double> part =
        points.subspan(done, std::min(kPointsOfARequest * dimension, points.size() - done));
    request.mutable_points()->Assign(part.begin(), part.end());
    request.set_point_offset(done / dimension);
    v1::LocateResponse response;
    WELLSPACE_RETURN_IF_ERROR(Call(*queries_, &v1::QueryService::Stub::Locate, request, call, &response));
    WELLSPACE_RETURN_IF_ERROR(CheckLocated(request, part.size() / dimension, dimension, response));
    located.simplices.insert(located.simplices.end(), response.simplices().begin(), response.simplices().end());
    located.vertices.insert(located.vertices.end(), response.vertices().begin(), response.vertices().end());
    located.coordinates.insert(located.coordinates.end(), response.coordinates().begin(), response.coordinates().end());
    located.revision = response.revision();
    located.vertex_count = response.vertex_count();
    request.set_revision(response.revision());  // all parts are of one mesh
    done += part.size();
  } while (done < points.size());
  return located;
}

absl::StatusOr<AddedVertices> GrpcConnection::AddVertices(const std::string& session, std::span<const double> points,
                                                          std::span<const uint32_t> near, const CallOptions& call) {
  v1::AddVerticesRequest request;
  request.set_name(session);
  request.mutable_points()->Assign(points.begin(), points.end());
  request.mutable_near()->Assign(near.begin(), near.end());
  request.set_request_id(RequestIdOf(call));
  SetExpectedRevision(call.expected_revision, request);
  if (const size_t bytes = request.ByteSizeLong(); bytes > kMostBytesOfARequest) {
    return absl::InvalidArgumentError(absl::StrCat("points: ", points.size(), " coordinates take ", bytes,
                                                   " bytes in one request, which has at most ", kMostBytesOfARequest,
                                                   "; add them in several calls"));
  }
  v1::AddVerticesResponse response;
  WELLSPACE_RETURN_IF_ERROR(Call(*queries_, &v1::QueryService::Stub::AddVertices, request, call, &response));
  const auto count = static_cast<size_t>(response.vertices_size());
  if (points.empty() ? count != 0
                     : count == 0 || points.size() % count != 0 || (!near.empty() && count != near.size())) {
    return Contradiction(count, " vertices for points of ", points.size(), " coordinates");
  }
  return AddedVertices{.vertices = {response.vertices().begin(), response.vertices().end()},
                       .revision = response.revision()};
}

}  // namespace wellspace::client
