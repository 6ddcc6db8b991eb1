#include "server/store/mesh_chunks.h"

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

// The tag and the length that a field of `size` bytes begins with.
std::string TagOf(int field, uint64_t size) {
  std::string tag;
  google::protobuf::io::StringOutputStream stream(&tag);
  google::protobuf::io::CodedOutputStream output(&stream);
  output.WriteTag(WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
  output.WriteVarint64(size);
  output.Trim();
  return tag;
}

// An array of rows of `width` numbers. `bytes_beside`: what comes beside each row.
template <typename Values>
MeshArray CutArray(int field, const Values& values, uint64_t width, uint64_t max_bytes, uint64_t bytes_beside = 0) {
  const uint64_t bytes = std::max(max_bytes, 2 * kEnvelopeBytes) - kEnvelopeBytes;
  const uint64_t row_bytes = sizeof(values[0]) * width;
  return {.field = field,
          .data = values.data(),
          .row_bytes = row_bytes,
          .rows = values.size() / width,
          .rows_per_chunk = bytes / (row_bytes + bytes_beside)};
}

// The arrays of a part, in the order in which they are sent.
std::vector<std::pair<int, const core::HugeVector<uint32_t>*>> ArraysOf(const PartArrays& part) {
  return {{v1::MeshChunk::kVertexIdsFieldNumber, &part.vertex_ids},
          {v1::MeshChunk::kVertexOwnersFieldNumber, &part.vertex_owners},
          {v1::MeshChunk::kVertexRowsFieldNumber, &part.vertex_rows},
          {v1::MeshChunk::kSimplexIdsFieldNumber, &part.simplex_ids},
          {v1::MeshChunk::kSimplexOwnersFieldNumber, &part.simplex_owners},
          {v1::MeshChunk::kFacetIdsFieldNumber, &part.facet_ids}};
}

}  // namespace

std::vector<MeshArray> CutMesh(const core::Mesh& mesh, uint64_t max_bytes) {
  std::vector<MeshArray> arrays;
  const auto add = [&](int field, const auto& values, uint64_t width, uint64_t bytes_beside = 0) {
    arrays.push_back(CutArray(field, values, width, max_bytes, bytes_beside));
  };
  const uint64_t dimension = mesh.dimension;
  // Beside each point that has moved stands its number.
  add(v1::MeshChunk::kPointsFieldNumber, mesh.points, dimension, mesh.moved_vertices.empty() ? 0 : sizeof(uint32_t));
  add(v1::MeshChunk::kWeightsFieldNumber, mesh.weights, 1);
  add(v1::MeshChunk::kVertexOriginsFieldNumber, mesh.vertex_origins, 1);
  add(v1::MeshChunk::kVertexTagsFieldNumber, mesh.vertex_tags, 1);
  add(v1::MeshChunk::kSimplexRegionsFieldNumber, mesh.simplex_regions, 1);
  add(v1::MeshChunk::kSimplicesFieldNumber, mesh.simplices, dimension + 1);
  add(v1::MeshChunk::kInputVerticesFieldNumber, mesh.input_vertex, 1);
  add(v1::MeshChunk::kFacetsFieldNumber, mesh.facets, dimension);
  add(v1::MeshChunk::kRidgesFieldNumber, mesh.ridges, 2);
  return arrays;
}

bool IsOfBoundary(int field) {
  return field == v1::MeshChunk::kVertexOriginsFieldNumber || field == v1::MeshChunk::kVertexTagsFieldNumber ||
         field == v1::MeshChunk::kSimplexRegionsFieldNumber || field == v1::MeshChunk::kFacetsFieldNumber ||
         field == v1::MeshChunk::kRidgesFieldNumber || field == v1::MeshChunk::kFacetIdsFieldNumber;
}

MeshChunks::MeshChunks(core::Mesh mesh, uint64_t max_bytes)
    : mesh_(std::move(mesh)), arrays_(CutMesh(mesh_, max_bytes)) {}

MeshChunks::MeshChunks(core::Mesh mesh, PartArrays part, uint64_t max_bytes)
    : mesh_(std::move(mesh)), part_(std::move(part)), arrays_(CutMesh(mesh_, max_bytes)) {
  for (const auto& [field, values] : ArraysOf(part_)) {
    arrays_.push_back(CutArray(field, *values, 1, max_bytes));
  }
}

uint64_t MeshChunks::memory_bytes() const {
  uint64_t indices = mesh_.simplices.capacity() + mesh_.input_vertex.capacity() + mesh_.moved_vertices.capacity() +
                     mesh_.vertex_origins.capacity() + mesh_.facets.capacity() + mesh_.ridges.capacity();
  for (const auto& [field, values] : ArraysOf(part_)) {
    indices += values->capacity();
  }
  return kBytesOnTheirWay + (mesh_.points.capacity() + mesh_.weights.capacity()) * sizeof(double) +
         indices * sizeof(uint32_t) +
         (mesh_.vertex_tags.capacity() + mesh_.simplex_regions.capacity()) * sizeof(int32_t);
}

uint64_t MeshChunks::count(bool with_boundary) const {
  uint64_t count = 0;
  for (const MeshArray& array : arrays_) {
    count += with_boundary || !IsOfBoundary(array.field) ? array.chunks() : 0;
  }
  return count;
}

MeshChunks::Chunk MeshChunks::Get(uint64_t index, bool with_boundary) const {
  auto array = arrays_.begin();
  const auto is_left_out = [&] { return IsOfBoundary(array->field) && !with_boundary; };
  while (is_left_out() || index >= array->chunks()) {
    index -= is_left_out() ? 0 : array->chunks();
    ++array;
  }
  const uint64_t first = index * array->rows_per_chunk;
  const uint64_t last = std::min(array->rows, first + array->rows_per_chunk);
  Chunk chunk{.field = array->field,
              .data = static_cast<const char*>(array->data) + first * array->row_bytes,
              .size = (last - first) * array->row_bytes};
  if (array->field == v1::MeshChunk::kPointsFieldNumber) {
    const auto& moved = mesh_.moved_vertices;
    const auto begin = std::lower_bound(moved.begin(), moved.end(), first);
    chunk.moved = {begin, std::lower_bound(begin, moved.end(), last)};
  }
  return chunk;
}

// The arrays are the last fields of a chunk: the fields before them are small, and they follow as they are.
std::string ChunkHead(int field, uint64_t index, uint32_t crc32c, std::span<const uint32_t> moved, int array_field,
                      uint64_t size) {
  v1::MeshChunk message;
  message.set_index(index);
  message.set_crc32c(crc32c);
  message.mutable_moved_vertices()->Add(moved.begin(), moved.end());
  const std::string before_values = message.SerializeAsString() + TagOf(array_field, size);
  return TagOf(field, before_values.size() + size) + before_values;
}

grpc::ByteBuffer SerializeChunk(const std::shared_ptr<const MeshChunks>& mesh, uint64_t index, int field,
                                bool with_boundary) {
  const MeshChunks::Chunk chunk = mesh->Get(index, with_boundary);
  const std::string head =
      ChunkHead(field, index, Crc32c(chunk.data, chunk.size), chunk.moved, chunk.field, chunk.size);

  auto* holder = new std::shared_ptr<const MeshChunks>(mesh);
  const std::array<grpc::Slice, 2> slices = {
      grpc::Slice(head), grpc::Slice(
                             const_cast<void*>(chunk.data), chunk.size,  // gRPC only reads
                             [](void* held) { delete static_cast<std::shared_ptr<const MeshChunks>*>(held); }, holder)};
  return grpc::ByteBuffer(slices.data(), slices.size());
}

}  // namespace wellspace::server
