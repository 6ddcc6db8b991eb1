// QueryService on the client's side.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "client/error_details.h"
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

// Of the points of one request to add them, and the vertices near them: three quarters of the least
// GetServerInfoResponse.max_request_bytes of a server.
constexpr size_t kBytesOfAnAddition = size_t{3} << 20;

// Of the id of a call that takes several requests; the server's limit is 128, and each but the first has a number more.
constexpr size_t kMaxLengthOfSharedId = 108;

// A barycentric coordinate is 1 at most, but for rounding.
constexpr double kMostCoordinate = 1 + 1e-9;

// Makes as many calls as the vertices take, and goes on after the last answered vertex when a connection breaks off.
// Answers of a call about all vertices are not counted beforehand: it is repeated only as long as nothing has come.
//
// `run` makes attempts at the server that has the session; `open` starts a call with a request of these vertices;
// `take` hands a response on, and says how many vertices it was about.
template <typename Request, typename Response>
absl::Status StreamAnswers(Request request, std::span<const uint32_t> vertices, const CallOptions& call,
                           const std::function<absl::Status(const CallOptions&, const AttemptAt&)>& run,
                           const std::function<std::unique_ptr<grpc::ClientReader<Response>>(
                               const Server&, grpc::ClientContext*, const Request&)>& open,
                           const std::function<absl::StatusOr<size_t>(const Response&)>& take) {
  const bool all = vertices.empty();
  size_t answered = 0;
  const auto answer_part = [&](size_t end, const Server& server, Attempt& attempt) -> absl::Status {
    request.mutable_vertices()->Assign(vertices.begin() + (all ? 0 : answered), vertices.begin() + end);
    CallContext context(attempt);
    const std::unique_ptr<grpc::ClientReader<Response>> stream = open(server, context.get(), request);
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
  CallInParts parts(call);
  do {
    const size_t end = std::min(vertices.size(), answered + kVerticesOfARequest);
    WELLSPACE_RETURN_IF_ERROR(
        run(parts.Next(), [&](const Server& server, Attempt& attempt) { return answer_part(end, server, attempt); }));
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

// `message` with `first` added to the numbers behind each `what`: the server counts the points of one request.
std::string WithIndicesFrom(uint64_t first, std::string_view what, std::string message) {
  for (size_t at = message.find(what); at != std::string::npos; at = message.find(what, at)) {
    at += what.size();
    uint64_t index = 0;
    const std::from_chars_result number = std::from_chars(message.data() + at, message.data() + message.size(), index);
    if (number.ec == std::errc()) {
      message.replace(at, number.ptr - message.data() - at, std::to_string(first + index));
    }
  }
  return message;
}

// The vertices that a call of AddVertices adds, and how far it is.
struct VertexAddition {
  // Has it take as many requests as the points need, in a session of `dimension`.
  absl::Status Divide(int dimension, const CallOptions& call) {
    const size_t row = std::max(1, dimension);
    if (points.size() % row != 0 || (!near.empty() && near.size() != points.size() / row)) {
      return absl::InvalidArgumentError(absl::StrCat("points: ", points.size(), " coordinates with ", near.size(),
                                                     " vertices near them; expected ", row,
                                                     " coordinates for each point, and one vertex for each or none"));
    }
    if (call.request_id.size() > kMaxLengthOfSharedId) {
      return absl::InvalidArgumentError(absl::StrCat("request_id has ", call.request_id.size(), " characters; at most ",
                                                     kMaxLengthOfSharedId,
                                                     " are accepted for more points than one request has"));
    }
    row_of_points = row;
    row_of_near = near.empty() ? 0 : 1;
    most = kBytesOfAnAddition / (row * sizeof(double) + sizeof(uint32_t));
    count = points.size() / row;
    return absl::OkStatus();
  }

  v1::AddVerticesRequest NextRequest() const {
    const size_t now = std::min(most, count - done);
    const std::span<const double> part = points.subspan(done * row_of_points, now * row_of_points);
    const std::span<const uint32_t> hints = near.subspan(done * row_of_near, now * row_of_near);
    v1::AddVerticesRequest request;
    request.set_name(session);
    request.mutable_points()->Assign(part.begin(), part.end());
    request.mutable_near()->Assign(hints.begin(), hints.end());
    return request;
  }

  // The error of the next request as that of the call.
  absl::Status Explain(const absl::Status& status) const {
    if (done == 0) {
      return status;
    }
    const std::string message =
        WithIndicesFrom(done, "near[", WithIndicesFrom(done, "points[", std::string(status.message())));
    return WithMessage(status, absl::StrCat(message, "; the first ", done, " of ", count, " points were added before"));
  }

  bool IsDone() const { return done >= count; }

  const std::string& session;
  std::span<const double> points;
  std::span<const uint32_t> near;
  // Undivided, all is one row.
  size_t row_of_points = points.size();
  size_t row_of_near = near.size();
  size_t count = 1;
  size_t most = 1;  // rows of a request
  size_t done = 0;
};

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
      request, vertices, call,
      [&](const CallOptions& part, const AttemptAt& attempt_at) { return RunOn(session, part, attempt_at); },
      [](const Server& server, grpc::ClientContext* context, const v1::ApproximateNearestNeighborsRequest& part) {
        return server.queries->ApproximateNearestNeighbors(context, part);
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
      request, vertices, call,
      [&](const CallOptions& part, const AttemptAt& attempt_at) { return RunOn(session, part, attempt_at); },
      [](const Server& server, grpc::ClientContext* context, const v1::ClippedVoronoiCellsRequest& part) {
        return server.queries->ClippedVoronoiCells(context, part);
      },
      HandOn<v1::ClippedVoronoiCellsResponse>(on_cells));
}

absl::Status GrpcConnection::VoronoiCells(const std::string& session, std::span<const uint32_t> vertices,
                                          const OnCells& on_cells, const CallOptions& call) {
  v1::VoronoiCellsRequest request;
  request.set_name(session);
  return StreamAnswers<v1::VoronoiCellsRequest, v1::VoronoiCellsResponse>(
      request, vertices, call,
      [&](const CallOptions& part, const AttemptAt& attempt_at) { return RunOn(session, part, attempt_at); },
      [](const Server& server, grpc::ClientContext* context, const v1::VoronoiCellsRequest& part) {
        return server.queries->VoronoiCells(context, part);
      },
      HandOn<v1::VoronoiCellsResponse>(on_cells));
}

absl::StatusOr<Located> GrpcConnection::Locate(const std::string& session, std::span<const double> points,
                                               const LocateOptions& options, const CallOptions& call) {
  CallInParts parts(call);
  WELLSPACE_ASSIGN_OR_RETURN(const Session found, GetSession(session, parts.Next()));
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
    WELLSPACE_RETURN_IF_ERROR(
        CallOn(session, &Server::queries, &v1::QueryService::Stub::Locate, request, parts.Next(), &response));
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
                                                          std::span<const uint32_t> near, const OnAdded& on_added,
                                                          const CallOptions& call) {
  CallInParts parts(call);
  VertexAddition addition{.session = session, .points = points, .near = near};
  if (points.size_bytes() + near.size_bytes() > kBytesOfAnAddition) {
    WELLSPACE_ASSIGN_OR_RETURN(const Session found, GetSession(session, parts.Next()));
    WELLSPACE_RETURN_IF_ERROR(addition.Divide(found.parameters.dimension, call));
  }
  const std::string id = RequestIdOf(call);
  std::optional<uint64_t> expected_revision = call.expected_revision;
  AddedVertices all;
  do {
    v1::AddVerticesRequest request = addition.NextRequest();
    request.set_request_id(addition.done == 0 ? id : absl::StrCat(id, "/", addition.done));
    SetExpectedRevision(expected_revision, request);
    const absl::StatusOr<AddedVertices> added = AddSome(request, parts.Next());
    if (!added.ok()) {
      return addition.Explain(added.status());
    }
    if (on_added != nullptr) {
      on_added(*added);
    }
    all.vertices.insert(all.vertices.end(), added->vertices.begin(), added->vertices.end());
    all.revision = added->revision;
    if (expected_revision.has_value()) {
      expected_revision = added->revision;
    }
    addition.done = std::min(addition.done + addition.most, addition.count);
  } while (!addition.IsDone());
  return all;
}

absl::StatusOr<AddedVertices> GrpcConnection::AddSome(const v1::AddVerticesRequest& request, const CallOptions& call) {
  v1::AddVerticesResponse response;
  WELLSPACE_RETURN_IF_ERROR(
      CallOn(request.name(), &Server::queries, &v1::QueryService::Stub::AddVertices, request, call, &response));
  const auto count = static_cast<size_t>(response.vertices_size());
  const auto coordinates = static_cast<size_t>(request.points_size());
  const auto near = static_cast<size_t>(request.near_size());
  if (coordinates == 0 ? count != 0 : count == 0 || coordinates % count != 0 || (near != 0 && count != near)) {
    return Contradiction(count, " vertices for points of ", coordinates, " coordinates");
  }
  return AddedVertices{.vertices = {response.vertices().begin(), response.vertices().end()},
                       .revision = response.revision()};
}

}  // namespace wellspace::client
