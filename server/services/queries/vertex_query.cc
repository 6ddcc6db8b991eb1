#include "server/services/queries/vertex_query.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/wire/errors.h"
#include "wellspace/v1/queries.pb.h"

namespace wellspace::server {
namespace {

class NearestNeighborQuery final : public VertexQuery {
 public:
  absl::Status Ask(const core::Mesher& mesher, std::span<const uint32_t> vertices) override {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> distances, mesher.NearestNeighborDistances(vertices));
    batch_.mutable_distances()->Add(distances.begin(), distances.end());
    return absl::OkStatus();
  }

  uint64_t batch_bytes() const override { return batch_.distances_size() * sizeof(double); }

  grpc::ByteBuffer TakeBatch() override {
    grpc::ByteBuffer bytes = Serialize(batch_);
    batch_.Clear();
    return bytes;
  }

 private:
  v1::ApproximateNearestNeighborsResponse batch_;
};

// `Response` has a VoronoiCellBatch. An infinite `beta` asks for whole cells.
template <typename Response>
class CellQuery final : public VertexQuery {
 public:
  explicit CellQuery(double beta) : beta_(beta) {}

  absl::Status Ask(const core::Mesher& mesher, std::span<const uint32_t> vertices) override {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<core::Cell> cells, mesher.ClippedCells(vertices, beta_));
    v1::VoronoiCellBatch& batch = *batch_.mutable_cells();
    for (const core::Cell& cell : cells) {
      batch.add_vertices(cell.vertex);
      batch.add_clip_radii(cell.clip_radius);
      batch.add_is_clipped(cell.is_clipped);
      batch.add_node_counts(static_cast<uint32_t>(cell.nodes.size() / mesher.dimension()));
      batch.mutable_nodes()->Add(cell.nodes.begin(), cell.nodes.end());
      batch.add_neighbour_counts(static_cast<uint32_t>(cell.neighbours.size()));
      batch.mutable_neighbours()->Add(cell.neighbours.begin(), cell.neighbours.end());
    }
    return absl::OkStatus();
  }

  uint64_t batch_bytes() const override {
    constexpr uint64_t kBytesPerCell = 20;  // vertex, radius, flag and counts
    const v1::VoronoiCellBatch& batch = batch_.cells();
    return batch.vertices_size() * kBytesPerCell + batch.nodes_size() * sizeof(double) +
           batch.neighbours_size() * sizeof(uint32_t);
  }

  grpc::ByteBuffer TakeBatch() override {
    grpc::ByteBuffer bytes = Serialize(batch_);
    batch_.mutable_cells()->Clear();  // keeps its memory
    return bytes;
  }

 private:
  const double beta_;
  Response batch_;
};

// Reads `message`, and the part of the request that all queries have.
template <typename Request>
absl::StatusOr<VertexQueryRequest> Parse(grpc::ByteBuffer* bytes, Request* message) {
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, message));
  return VertexQueryRequest{.session = message->name(),
                            .vertices = {message->vertices().begin(), message->vertices().end()},
                            .query = nullptr};
}

}  // namespace

absl::StatusOr<VertexQueryRequest> ParseNearestNeighbors(grpc::ByteBuffer* bytes) {
  v1::ApproximateNearestNeighborsRequest message;
  WELLSPACE_ASSIGN_OR_RETURN(VertexQueryRequest request, Parse(bytes, &message));
  request.query = std::make_unique<NearestNeighborQuery>();
  return request;
}

absl::StatusOr<VertexQueryRequest> ParseClippedCells(grpc::ByteBuffer* bytes) {
  v1::ClippedVoronoiCellsRequest message;
  WELLSPACE_ASSIGN_OR_RETURN(VertexQueryRequest request, Parse(bytes, &message));
  if (!(message.beta() >= 1 && std::isfinite(message.beta()))) {
    return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                     absl::StrCat("beta is ", message.beta(), "; a finite number of at least 1 is accepted"), "beta");
  }
  request.query = std::make_unique<CellQuery<v1::ClippedVoronoiCellsResponse>>(message.beta());
  return request;
}

absl::StatusOr<VertexQueryRequest> ParseCells(grpc::ByteBuffer* bytes) {
  v1::VoronoiCellsRequest message;
  WELLSPACE_ASSIGN_OR_RETURN(VertexQueryRequest request, Parse(bytes, &message));
  request.query = std::make_unique<CellQuery<v1::VoronoiCellsResponse>>(std::numeric_limits<double>::infinity());
  return request;
}

}  // namespace wellspace::server
