#include "server/sessions/mesh_chunks.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "google/protobuf/wire_format_lite.h"
#include "grpcpp/support/slice.h"
#include "proto/checksum.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {
namespace {

using google::protobuf::internal::WireFormatLite;

// Tags, lengths, index and checksum around the values of a chunk, generously.
constexpr uint64_t kEnvelopeBytes = 64;

// Chunks that a stream holds a copy of: one that is written, one in the buffers of the connection.
constexpr uint64_t kChunksOnTheirWay = 2;

uint64_t DivideUp(uint64_t dividend, uint64_t divisor) { return (dividend + divisor - 1) / divisor; }

// Rows [begin, begin + rows) of `values` (rows of `width` numbers), cut at the end.
template <typename T>
MeshChunks::Chunk Rows(int field, const core::HugeVector<T>& values, uint64_t width, uint64_t begin, uint64_t rows) {
  const uint64_t first = begin * width;
  const uint64_t last = std::min<uint64_t>(values.size(), (begin + rows) * width);
  return {.field = field, .data = values.data() + first, .size = (last - first) * sizeof(T)};
}

// What a field of `size` bytes begins with.
std::string TagOf(int field, uint64_t size) {
  std::string tag;
  google::protobuf::io::StringOutputStream stream(&tag);
  google::protobuf::io::CodedOutputStream output(&stream);
  output.WriteTag(WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
  output.WriteVarint64(size);
  output.Trim();
  return tag;
}

}  // namespace

MeshChunks::MeshChunks(core::Mesh mesh, uint64_t max_bytes) : mesh_(std::move(mesh)) {
  const uint64_t bytes = std::max(max_bytes, 2 * kEnvelopeBytes) - kEnvelopeBytes;
  // Beside each point that has moved stands its number.
  points_per_chunk_ =
      bytes / (sizeof(double) * mesh_.dimension + (mesh_.moved_vertices.empty() ? 0 : sizeof(uint32_t)));
  simplices_per_chunk_ = bytes / (sizeof(uint32_t) * (mesh_.dimension + 1));
  weights_per_chunk_ = bytes / sizeof(double);
  inputs_per_chunk_ = bytes / sizeof(uint32_t);
  point_chunks_ = DivideUp(mesh_.vertex_count(), points_per_chunk_);
  weight_chunks_ = DivideUp(mesh_.weights.size(), weights_per_chunk_);
  simplex_chunks_ = DivideUp(mesh_.simplex_count(), simplices_per_chunk_);
  input_chunks_ = DivideUp(mesh_.input_vertex.size(), inputs_per_chunk_);
}

uint64_t MeshChunks::memory_bytes() const {
  return kChunksOnTheirWay * kMaxResponseBytes + (mesh_.points.capacity() + mesh_.weights.capacity()) * sizeof(double) +
         (mesh_.simplices.capacity() + mesh_.input_vertex.capacity() + mesh_.moved_vertices.capacity()) *
             sizeof(uint32_t);
}

MeshChunks::Chunk MeshChunks::Get(uint64_t index) const {
  if (index < point_chunks_) {
    const uint64_t first = index * points_per_chunk_;
    Chunk chunk = Rows(v1::MeshChunk::kPointsFieldNumber, mesh_.points, mesh_.dimension, first, points_per_chunk_);
    const auto& moved = mesh_.moved_vertices;
    const auto begin = std::lower_bound(moved.begin(), moved.end(), first);
    chunk.moved = {begin, std::lower_bound(begin, moved.end(), first + points_per_chunk_)};
    return chunk;
  }
  index -= point_chunks_;
  if (index < weight_chunks_) {
    return Rows(v1::MeshChunk::kWeightsFieldNumber, mesh_.weights, 1, index * weights_per_chunk_, weights_per_chunk_);
  }
  index -= weight_chunks_;
  if (index < simplex_chunks_) {
    return Rows(v1::MeshChunk::kSimplicesFieldNumber, mesh_.simplices, mesh_.dimension + 1,
                index * simplices_per_chunk_, simplices_per_chunk_);
  }
  index -= simplex_chunks_;
  return Rows(v1::MeshChunk::kInputVerticesFieldNumber, mesh_.input_vertex, 1, index * inputs_per_chunk_,
              inputs_per_chunk_);
}

// The arrays are the last fields of a chunk: what stands before them is small, and they follow as they are.
grpc::ByteBuffer SerializeChunk(const std::shared_ptr<const MeshChunks>& mesh, uint64_t index, int field) {
  const MeshChunks::Chunk chunk = mesh->Get(index);
  v1::MeshChunk message;
  message.set_index(index);
  message.set_crc32c(Crc32c(chunk.data, chunk.size));
  message.mutable_moved_vertices()->Add(chunk.moved.begin(), chunk.moved.end());
  const std::string before_values = message.SerializeAsString() + TagOf(chunk.field, chunk.size);
  const std::string head = TagOf(field, before_values.size() + chunk.size) + before_values;

  auto* holder = new std::shared_ptr<const MeshChunks>(mesh);
  const std::array<grpc::Slice, 2> slices = {
      grpc::Slice(head), grpc::Slice(
                             const_cast<void*>(chunk.data), chunk.size,  // gRPC only reads
                             [](void* held) { delete static_cast<std::shared_ptr<const MeshChunks>*>(held); }, holder)};
  return grpc::ByteBuffer(slices.data(), slices.size());
}

}  // namespace wellspace::server
