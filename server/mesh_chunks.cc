#include "server/mesh_chunks.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "proto/checksum.h"

namespace wellspace::server {
namespace {

// Tags, lengths, index and checksum around the values of a chunk, generously.
constexpr uint64_t kEnvelopeBytes = 64;

uint64_t DivideUp(uint64_t dividend, uint64_t divisor) { return (dividend + divisor - 1) / divisor; }

// Appends rows [begin, begin + rows) of `values` (rows of `width` numbers), cut at the end, to `field` and returns their checksum.
template <typename T>
uint32_t CopyRows(const std::vector<T>& values, uint64_t width, uint64_t begin, uint64_t rows,
                  google::protobuf::RepeatedField<T>* field) {
  const T* first = values.data() + begin * width;
  const T* last = values.data() + std::min<uint64_t>(values.size(), (begin + rows) * width);
  field->Reserve(static_cast<int>(last - first));
  field->Add(first, last);
  return Crc32c(first, (last - first) * sizeof(T));
}

}  // namespace

MeshChunks::MeshChunks(core::Mesh mesh, uint64_t max_bytes) : mesh_(std::move(mesh)) {
  const uint64_t bytes = std::max(max_bytes, 2 * kEnvelopeBytes) - kEnvelopeBytes;
  points_per_chunk_ = bytes / (sizeof(double) * mesh_.dimension);
  simplices_per_chunk_ = bytes / (sizeof(uint32_t) * (mesh_.dimension + 1));
  inputs_per_chunk_ = bytes / sizeof(uint32_t);
  point_chunks_ = DivideUp(mesh_.vertex_count(), points_per_chunk_);
  simplex_chunks_ = DivideUp(mesh_.simplex_count(), simplices_per_chunk_);
  input_chunks_ = DivideUp(mesh_.input_vertex.size(), inputs_per_chunk_);
}

v1::MeshChunk MeshChunks::Make(uint64_t index) const {
  v1::MeshChunk chunk;
  chunk.set_index(index);
  if (index < point_chunks_) {
    chunk.set_crc32c(
        CopyRows(mesh_.points, mesh_.dimension, index * points_per_chunk_, points_per_chunk_, chunk.mutable_points()));
  } else if (index -= point_chunks_; index < simplex_chunks_) {
    chunk.set_crc32c(CopyRows(mesh_.simplices, mesh_.dimension + 1, index * simplices_per_chunk_, simplices_per_chunk_,
                              chunk.mutable_simplices()));
  } else {
    index -= simplex_chunks_;
    chunk.set_crc32c(
        CopyRows(mesh_.input_vertex, 1, index * inputs_per_chunk_, inputs_per_chunk_, chunk.mutable_input_vertices()));
  }
  return chunk;
}

}  // namespace wellspace::server
