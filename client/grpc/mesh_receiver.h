// A mesh from the chunks of a stream, with nothing that the server says believed unchecked.
#ifndef WELLSPACE_CLIENT_GRPC_MESH_RECEIVER_H_
#define WELLSPACE_CLIENT_GRPC_MESH_RECEIVER_H_

#include <array>
#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "client/mesh_sink.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::client {

// The known facts about a mesh.
struct MeshExpectation {
  std::optional<int> dimension{};
  std::optional<uint64_t> input_points{};
  std::optional<PartOptions> part{};  // that was asked for; none: the whole mesh was
};

// Whether there can be such a mesh.
//
// Errors:     DATA_LOSS, naming the fault; UNIMPLEMENTED: a whole mesh of a server that is too old for parts.
absl::Status CheckHeader(const MeshHeader& header, const MeshExpectation& expectation);

// Takes the metadata, then the chunks in their order; right ones go to a sink at once.
//
// Thread safety: thread-compatible.
// Invariants: nothing of the mesh is kept.
class MeshReceiver {
 public:
  using Expectation = MeshExpectation;

  // REQUIRES:   `sink` outlives this.
  MeshReceiver(MeshSink& sink, const Expectation& expectation) : sink_(sink), expectation_(expectation) {}

  // The stream broke off, and another follows: the same metadata, then the chunks from next_chunk() on.
  void Continue() { expects_metadata_ = true; }

  // Errors:     DATA_LOSS, naming the fault; errors of the sink. The stream is to be given up.
  absl::Status SetMetadata(const v1::MeshMetadata& metadata);
  absl::Status AddChunk(const v1::MeshChunk& chunk);

  // To be called once the last stream has ended.
  //
  // Errors:     DATA_LOSS when something is missing; errors of the sink.
  absl::Status Finish();

  bool has_metadata() const { return has_metadata_; }
  bool has_all_chunks() const { return has_metadata_ && next_chunk_ == header_.chunk_count; }
  uint64_t next_chunk() const { return next_chunk_; }
  const MeshHeader& header() const { return header_; }

 private:
  // The arrays, in their order.
  enum Array {
    kPoints,
    kWeights,
    kVertexOrigins,
    kVertexTags,
    kSimplexRegions,
    kSimplices,
    kInputVertices,
    kFacets,
    kRidges,
    kPartNumbers,  // the first of them, as PartNumbers has them
    kArrays = kPartNumbers + static_cast<int>(PartNumbers::kFacetIds) + 1
  };

  uint64_t WidthOf(int array) const;
  uint64_t SizeOf(int array) const;  // in numbers
  // Whether `values` may follow those that have come of `array`.
  absl::Status CheckOrder(Array array, uint64_t values) const;
  absl::Status CheckMoved(const v1::MeshChunk& chunk, uint64_t first) const;
  // Whether the values can be those of the array: vertices that there are, tags and regions that were announced.
  absl::Status CheckValues(Array array, const v1::MeshChunk& chunk) const;
  // Hands values that were checked to the sink. The last six arrays are those of a part.
  absl::Status Pass(Array array, const v1::MeshChunk& chunk);

  MeshSink& sink_;
  const Expectation expectation_;
  bool expects_metadata_ = true;
  bool has_metadata_ = false;
  MeshHeader header_;
  uint64_t next_chunk_ = 0;
  std::array<uint64_t, kArrays> received_ = {};  // numbers
  uint64_t moved_ = 0;                           // vertices that have moved
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_MESH_RECEIVER_H_
