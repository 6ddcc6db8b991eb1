#include "client/mesh_receiver.h"

#include <limits>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/convert.h"
#include "proto/checksum.h"

namespace wellspace::client {
namespace {

template <typename... Parts>
absl::Status Contradiction(const Parts&... parts) {
  return absl::DataLossError(absl::StrCat("the server's answer is damaged: ", parts...));
}

// Vertices are numbered with 32 bits; larger counts cannot be true, and would make products of counts overflow.
constexpr uint64_t kMaxVertices = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kMaxSimplices = uint64_t{1} << 40;
constexpr uint64_t kMaxInputPoints = uint64_t{1} << 40;
constexpr int kMaxDimension = 64;

constexpr const char* kArrayNames[] = {"points", "weights", "simplices", "input vertices"};

template <typename T>
std::span<const T> SpanOf(const google::protobuf::RepeatedField<T>& values) {
  return {values.data(), static_cast<size_t>(values.size())};
}

template <typename T>
uint32_t ChecksumOf(const google::protobuf::RepeatedField<T>& values) {
  return Crc32c(values.data(), values.size() * sizeof(T));
}

absl::Status CheckVertices(const google::protobuf::RepeatedField<uint32_t>& vertices, uint64_t vertex_count,
                           const char* name) {
  for (const uint32_t vertex : vertices) {
    if (vertex >= vertex_count) {
      return Contradiction(name, " name vertex ", vertex, " of ", vertex_count);
    }
  }
  return absl::OkStatus();
}

}  // namespace

uint64_t MeshReceiver::WidthOf(int array) const {
  return array == kPoints ? header_.dimension : array == kSimplices ? header_.dimension + 1 : 1;
}

uint64_t MeshReceiver::SizeOf(int array) const {
  const uint64_t rows = array == kPoints      ? header_.vertex_count
                        : array == kWeights   ? (header_.has_weights ? header_.vertex_count : 0)
                        : array == kSimplices ? header_.simplex_count
                                              : header_.input_point_count;
  return rows * WidthOf(array);
}

absl::Status MeshReceiver::CheckMetadata(const MeshHeader& header) const {
  const size_t dimension = header.dimension;
  if (header.dimension < 1 || header.dimension > kMaxDimension ||
      (expectation_.dimension.has_value() && header.dimension != *expectation_.dimension) ||
      header.domain_low.size() != dimension || header.domain_high.size() != dimension) {
    return Contradiction(
        "a mesh of dimension ", header.dimension, " with a domain of ", header.domain_low.size(), " low and ",
        header.domain_high.size(), " high coordinates",
        expectation_.dimension.has_value() ? absl::StrCat(", for points of dimension ", *expectation_.dimension) : "");
  }
  if (header.vertex_count > kMaxVertices || header.simplex_count > kMaxSimplices ||
      header.input_point_count > kMaxInputPoints) {
    return Contradiction(header.vertex_count, " vertices, ", header.simplex_count, " simplices and ",
                         header.input_point_count, " points are more than can be");
  }
  if (expectation_.input_points.has_value() && header.input_point_count != *expectation_.input_points) {
    return Contradiction("a mesh of ", header.input_point_count, " points; ", *expectation_.input_points, " were sent");
  }
  return absl::OkStatus();
}

absl::Status MeshReceiver::SetMetadata(const v1::MeshMetadata& metadata) {
  if (!expects_metadata_) {
    return Contradiction("a second metadata message");
  }
  expects_metadata_ = false;
  MeshHeader header = HeaderFromProto(metadata);
  if (absl::Status status = CheckMetadata(header); !status.ok()) {
    return status;
  }
  if (has_metadata_) {
    const bool is_the_same =
        header.revision == header_.revision && header.dimension == header_.dimension &&
        header.vertex_count == header_.vertex_count && header.simplex_count == header_.simplex_count &&
        header.input_point_count == header_.input_point_count && header.chunk_count == header_.chunk_count &&
        header.has_weights == header_.has_weights && header.moved_vertex_count == header_.moved_vertex_count;
    return is_the_same ? absl::OkStatus()
                       : Contradiction("a continued download of another mesh: revision ", header.revision, " with ",
                                       header.vertex_count, " vertices after revision ", header_.revision, " with ",
                                       header_.vertex_count);
  }
  has_metadata_ = true;
  header_ = std::move(header);
  return sink_.Begin(header_);
}

absl::Status MeshReceiver::CheckOrder(Array array, uint64_t values) const {
  for (int before = 0; before < array; ++before) {
    if (received_[before] != SizeOf(before)) {
      return Contradiction(kArrayNames[array], " after ", received_[before] / WidthOf(before), " of ",
                           SizeOf(before) / WidthOf(before), " ", kArrayNames[before]);
    }
  }
  for (int after = array + 1; after < kArrays; ++after) {
    if (received_[after] != 0) {
      return Contradiction(kArrayNames[array], " after ", kArrayNames[after]);
    }
  }
  if (values % WidthOf(array) != 0) {
    return Contradiction("a chunk of ", kArrayNames[array], " has ", values, " numbers, no multiple of ",
                         WidthOf(array));
  }
  if (received_[array] + values > SizeOf(array)) {
    return Contradiction("more than the announced ", SizeOf(array) / WidthOf(array), " ", kArrayNames[array]);
  }
  return absl::OkStatus();
}

// Vertices that have moved come with their points, from vertex number `first` on.
absl::Status MeshReceiver::CheckMoved(const v1::MeshChunk& chunk, uint64_t first) const {
  const uint64_t end = first + chunk.points_size() / header_.dimension;
  uint64_t least = first;
  for (const uint32_t vertex : chunk.moved_vertices()) {
    if (vertex < least || vertex >= end) {
      return Contradiction("chunk ", chunk.index(), " has the moved vertex ", vertex, ", of vertices ", least, " to ",
                           end);
    }
    least = uint64_t{vertex} + 1;
  }
  if (moved_ + chunk.moved_vertices_size() > header_.moved_vertex_count) {
    return Contradiction("more than the announced ", header_.moved_vertex_count, " moved vertices");
  }
  return absl::OkStatus();
}

absl::Status MeshReceiver::AddChunk(const v1::MeshChunk& chunk) {
  if (expects_metadata_) {
    return Contradiction("a chunk before the metadata");
  }
  if (chunk.index() != next_chunk_ || next_chunk_ >= header_.chunk_count) {
    return Contradiction("chunk ", chunk.index(), " where chunk ", next_chunk_, " of ", header_.chunk_count,
                         " was expected");
  }
  const int arrays =
      !chunk.points().empty() + !chunk.weights().empty() + !chunk.simplices().empty() + !chunk.input_vertices().empty();
  if (arrays != 1) {
    return Contradiction("chunk ", chunk.index(), " has ", arrays, " arrays; expected one");
  }
  const Array array = !chunk.points().empty()      ? kPoints
                      : !chunk.weights().empty()   ? kWeights
                      : !chunk.simplices().empty() ? kSimplices
                                                   : kInputVertices;
  const uint32_t checksum = array == kPoints      ? ChecksumOf(chunk.points())
                            : array == kWeights   ? ChecksumOf(chunk.weights())
                            : array == kSimplices ? ChecksumOf(chunk.simplices())
                                                  : ChecksumOf(chunk.input_vertices());
  if (checksum != chunk.crc32c()) {
    return Contradiction("chunk ", chunk.index(), " has the CRC32C ", absl::Hex(checksum, absl::kZeroPad8), ", not ",
                         absl::Hex(chunk.crc32c(), absl::kZeroPad8), " as sent");
  }
  const uint64_t values = array == kPoints      ? chunk.points_size()
                          : array == kWeights   ? chunk.weights_size()
                          : array == kSimplices ? chunk.simplices_size()
                                                : chunk.input_vertices_size();
  absl::Status status = CheckOrder(array, values);
  if (status.ok() && (array == kSimplices || array == kInputVertices)) {
    status = CheckVertices(array == kSimplices ? chunk.simplices() : chunk.input_vertices(), header_.vertex_count,
                           kArrayNames[array]);
  }
  if (!status.ok()) {
    return status;
  }
  if (absl::Status moved = CheckMoved(chunk, array == kPoints ? received_[kPoints] / WidthOf(kPoints) : 0);
      !moved.ok()) {
    return moved;
  }
  ++next_chunk_;
  moved_ += chunk.moved_vertices_size();
  received_[array] += values;
  switch (array) {
    case kPoints:
      if (absl::Status added = sink_.AddPoints(SpanOf(chunk.points())); !added.ok() || chunk.moved_vertices().empty()) {
        return added;
      }
      return sink_.AddMovedVertices(SpanOf(chunk.moved_vertices()));
    case kWeights:
      return sink_.AddWeights(SpanOf(chunk.weights()));
    case kSimplices:
      return sink_.AddSimplices(SpanOf(chunk.simplices()));
    default:
      return sink_.AddInputVertices(SpanOf(chunk.input_vertices()));
  }
}

absl::Status MeshReceiver::Finish() {
  if (!has_metadata_) {
    return Contradiction("no mesh");
  }
  if (!has_all_chunks()) {
    return Contradiction(next_chunk_, " of ", header_.chunk_count, " chunks");
  }
  for (int array = 0; array < kArrays; ++array) {
    if (received_[array] != SizeOf(array)) {
      return Contradiction(received_[array] / WidthOf(array), " of ", SizeOf(array) / WidthOf(array), " ",
                           kArrayNames[array]);
    }
  }
  if (moved_ != header_.moved_vertex_count) {
    return Contradiction(moved_, " of ", header_.moved_vertex_count, " moved vertices");
  }
  return sink_.Finish();
}

}  // namespace wellspace::client
