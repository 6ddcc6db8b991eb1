#include "client/mesh_assembler.h"

#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"
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

// The values of a message whose fields are all numbers of type T, by the names of the fields: a client shows counters that it does
// not know by name.
std::map<std::string, uint64_t> CountersByName(const v1::OperationCounters& counters) {
  std::map<std::string, uint64_t> by_name;
  const google::protobuf::Descriptor* descriptor = counters.GetDescriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = descriptor->field(i);
    by_name[field->name()] = counters.GetReflection()->GetUInt64(counters, field);
  }
  return by_name;
}

MeshStatistics StatisticsFromProto(const v1::MeshStatistics& message) {
  MeshStatistics statistics;
  statistics.input_points = message.input_points();
  statistics.duplicates = message.duplicates();
  statistics.vertices = message.vertices();
  statistics.simplices = message.simplices();
  statistics.max_radius_edge = message.max_radius_edge();
  statistics.min_angle_deg = message.min_angle_deg();
  statistics.seconds["tree"] = message.seconds().tree();
  statistics.seconds["refinement"] = message.seconds().refinement();
  statistics.seconds["simplices"] = message.seconds().simplices();
  statistics.seconds["total"] = message.seconds().total();
  statistics.peak_memory_bytes = message.peak_memory_bytes();
  statistics.counters = CountersByName(message.counters());
  return statistics;
}

// Appends `values`, rows of `width` numbers, to `array`, which is to have `rows` rows at the end.
template <typename T>
absl::Status Append(const google::protobuf::RepeatedField<T>& values, uint64_t width, uint64_t rows, const char* name,
                    std::vector<T>* array) {
  if (values.size() % width != 0) {
    return Contradiction("a chunk of ", name, " has ", values.size(), " numbers, no multiple of ", width);
  }
  if (array->size() + values.size() > rows * width) {
    return Contradiction("more than the announced ", rows, " ", name);
  }
  array->insert(array->end(), values.begin(), values.end());
  return absl::OkStatus();
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

absl::Status MeshAssembler::SetMetadata(const v1::MeshMetadata& metadata) {
  if (has_metadata_) {
    return Contradiction("a second metadata message");
  }
  if (metadata.dimension() != dimension_ || metadata.domain().low_size() != dimension_ ||
      metadata.domain().high_size() != dimension_) {
    return Contradiction("a mesh of dimension ", metadata.dimension(), " with a domain of ",
                         metadata.domain().low_size(), " low and ", metadata.domain().high_size(),
                         " high coordinates, for points of dimension ", dimension_);
  }
  if (metadata.vertex_count() > kMaxVertices || metadata.simplex_count() > kMaxSimplices) {
    return Contradiction(metadata.vertex_count(), " vertices and ", metadata.simplex_count(),
                         " simplices are more than can be");
  }
  if (metadata.input_point_count() != input_points_) {
    return Contradiction("a mesh of ", metadata.input_point_count(), " points; ", input_points_, " were sent");
  }
  has_metadata_ = true;
  vertex_count_ = metadata.vertex_count();
  simplex_count_ = metadata.simplex_count();
  chunk_count_ = metadata.chunk_count();
  mesh_.dimension = dimension_;
  mesh_.domain_low.assign(metadata.domain().low().begin(), metadata.domain().low().end());
  mesh_.domain_high.assign(metadata.domain().high().begin(), metadata.domain().high().end());
  mesh_.statistics = StatisticsFromProto(metadata.statistics());
  return absl::OkStatus();
}

absl::Status MeshAssembler::AddChunk(const v1::MeshChunk& chunk) {
  if (!has_metadata_) {
    return Contradiction("a chunk before the metadata");
  }
  if (chunk.index() != next_chunk_ || next_chunk_ >= chunk_count_) {
    return Contradiction("chunk ", chunk.index(), " where chunk ", next_chunk_, " of ", chunk_count_, " was expected");
  }
  ++next_chunk_;
  const int arrays = !chunk.points().empty() + !chunk.simplices().empty() + !chunk.input_vertices().empty();
  if (arrays != 1) {
    return Contradiction("chunk ", chunk.index(), " has ", arrays, " arrays; expected one");
  }
  const uint32_t checksum = !chunk.points().empty()      ? ChecksumOf(chunk.points())
                            : !chunk.simplices().empty() ? ChecksumOf(chunk.simplices())
                                                         : ChecksumOf(chunk.input_vertices());
  if (checksum != chunk.crc32c()) {
    return Contradiction("chunk ", chunk.index(), " has the CRC32C ", absl::Hex(checksum, absl::kZeroPad8), ", not ",
                         absl::Hex(chunk.crc32c(), absl::kZeroPad8), " as sent");
  }
  if (!chunk.points().empty()) {
    return Append(chunk.points(), dimension_, vertex_count_, "points", &mesh_.points);
  }
  if (!chunk.simplices().empty()) {
    if (absl::Status status = CheckVertices(chunk.simplices(), vertex_count_, "simplices"); !status.ok()) {
      return status;
    }
    return Append(chunk.simplices(), dimension_ + 1, simplex_count_, "simplices", &mesh_.simplices);
  }
  if (absl::Status status = CheckVertices(chunk.input_vertices(), vertex_count_, "input vertices"); !status.ok()) {
    return status;
  }
  return Append(chunk.input_vertices(), 1, input_points_, "input vertices", &mesh_.input_vertex);
}

absl::StatusOr<Mesh> MeshAssembler::Finish() {
  if (!has_metadata_) {
    return Contradiction("no mesh");
  }
  if (next_chunk_ != chunk_count_) {
    return Contradiction(next_chunk_, " of ", chunk_count_, " chunks");
  }
  if (mesh_.points.size() != vertex_count_ * dimension_ ||
      mesh_.simplices.size() != simplex_count_ * (dimension_ + 1) || mesh_.input_vertex.size() != input_points_) {
    return Contradiction(mesh_.points.size() / dimension_, " of ", vertex_count_, " vertices, ",
                         mesh_.simplices.size() / (dimension_ + 1), " of ", simplex_count_, " simplices, ",
                         mesh_.input_vertex.size(), " of ", input_points_, " input vertices");
  }
  return std::move(mesh_);
}

}  // namespace wellspace::client
