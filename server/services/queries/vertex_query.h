// The queries of [HT08] Figure 3 about some vertices of a session, answered in batches.
#ifndef WELLSPACE_SERVER_SERVICES_QUERIES_VERTEX_QUERY_H_
#define WELLSPACE_SERVER_SERVICES_QUERIES_VERTEX_QUERY_H_

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/meshers/mesher.h"
#include "grpcpp/support/byte_buffer.h"

namespace wellspace::server {

// A question that is asked of each vertex, and the batch of answers in the making.
//
// Thread safety: thread-compatible.
class VertexQuery {
 public:
  virtual ~VertexQuery() = default;

  // Adds the answers for `vertices` to the batch.
  //
  // REQUIRES:   the vertices exist.
  // Complexity: O(1) for each in a refined mesh.
  virtual absl::Status Ask(const core::Mesher& mesher, std::span<const uint32_t> vertices) = 0;

  // Of the batch when it is serialized, about.
  virtual uint64_t batch_bytes() const = 0;

  // The batch as a response; the next one is empty.
  virtual grpc::ByteBuffer TakeBatch() = 0;
};

// A request for one of the queries.
struct VertexQueryRequest {
  std::string session;             // its name
  std::vector<uint32_t> vertices;  // empty: all
  std::unique_ptr<VertexQuery> query;
};

// Reads the serialized request of one of the calls.
//
// Errors:     MALFORMED_REQUEST; INVALID_REQUEST (beta).
using VertexQueryParser = absl::StatusOr<VertexQueryRequest> (*)(grpc::ByteBuffer* bytes);
absl::StatusOr<VertexQueryRequest> ParseNearestNeighbors(grpc::ByteBuffer* bytes);
absl::StatusOr<VertexQueryRequest> ParseClippedCells(grpc::ByteBuffer* bytes);
absl::StatusOr<VertexQueryRequest> ParseCells(grpc::ByteBuffer* bytes);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_QUERIES_VERTEX_QUERY_H_
