#include "client/grpc/mesh_receiver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/grpc/convert.h"
#include "client/grpc/mesh_values.h"
#include "client/printable.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"

namespace wellspace::client {
namespace {

// Vertices are numbered with 32 bits; larger counts cannot be true, and would make products of counts overflow.
constexpr uint64_t kMaxVertices = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kMaxSimplices = uint64_t{1} << 40;
constexpr uint64_t kMaxInputPoints = uint64_t{1} << 40;

constexpr const char* kArrayNames[] = {"points",          "weights",        "vertex origins", "vertex tags",
                                       "simplex regions", "simplices",      "input vertices", "facets",
                                       "ridges",          "vertex ids",     "vertex owners",  "vertex rows",
                                       "simplex ids",     "simplex owners", "facet ids"};

template <typename T>
std::span<const T> SpanOf(const google::protobuf::RepeatedField<T>& values) {
  return {values.data(), static_cast<size_t>(values.size())};
}

template <typename T>
uint32_t ChecksumOf(const google::protobuf::RepeatedField<T>& values) {
  return Crc32c(values.data(), values.size() * sizeof(T));
}

// Calls visit(values) with the chunk's values of the array number `array`, in the order of MeshReceiver::Array.
template <typename Visit>
auto VisitArray(const v1::MeshChunk& chunk, int array, Visit visit) {
  switch (array) {
    case 0:
      return visit(chunk.points());
    case 1:
      return visit(chunk.weights());
    case 2:
      return visit(chunk.vertex_origins());
    case 3:
      return visit(chunk.vertex_tags());
    case 4:
      return visit(chunk.simplex_regions());
    case 5:
      return visit(chunk.simplices());
    case 6:
      return visit(chunk.input_vertices());
    case 7:
      return visit(chunk.facets());
    case 8:
      return visit(chunk.ridges());
    case 9:
      return visit(chunk.vertex_ids());
    case 10:
      return visit(chunk.vertex_owners());
    case 11:
      return visit(chunk.vertex_rows());
    case 12:
      return visit(chunk.simplex_ids());
    case 13:
      return visit(chunk.simplex_owners());
    default:
      return visit(chunk.facet_ids());
  }
}

// The numbers of an array of a part.
std::span<const uint32_t> PartNumbersOf(const v1::MeshChunk& chunk, PartNumbers array) {
  switch (array) {
    case PartNumbers::kVertexIds:
      return SpanOf(chunk.vertex_ids());
    case PartNumbers::kVertexOwners:
      return SpanOf(chunk.vertex_owners());
    case PartNumbers::kVertexRows:
      return SpanOf(chunk.vertex_rows());
    case PartNumbers::kSimplexIds:
      return SpanOf(chunk.simplex_ids());
    case PartNumbers::kSimplexOwners:
      return SpanOf(chunk.simplex_owners());
    case PartNumbers::kFacetIds:
      break;
  }
  return SpanOf(chunk.facet_ids());
}

// Names go to terminals, and to files of text.
absl::Status CheckName(const std::string& name) {
  constexpr size_t kMostBytes = 256;
  return name.empty() || name.size() > kMostBytes || Printable(name) != name
             ? Contradiction("a part of the mesh with a name of ", name.size(),
                             " bytes that cannot be; names are of characters that are none of control")
             : absl::OkStatus();
}

bool IsTheSame(const MeshHeader& a, const MeshHeader& b) {
  return a.revision == b.revision && a.dimension == b.dimension && a.vertex_count == b.vertex_count &&
         a.simplex_count == b.simplex_count && a.input_point_count == b.input_point_count &&
         a.chunk_count == b.chunk_count && a.has_weights == b.has_weights &&
         a.moved_vertex_count == b.moved_vertex_count && a.boundary == b.boundary && a.regions == b.regions &&
         a.has_simplex_regions == b.has_simplex_regions && a.has_vertex_marks == b.has_vertex_marks &&
         a.ridge_count == b.ridge_count && a.part == b.part;
}

absl::Status CheckBoundary(const MeshHeader& header) {
  uint64_t facets = 0;
  std::set<int32_t> tags;
  for (const BoundaryPart& part : header.boundary) {
    facets += std::min(part.facet_count, kMaxSimplices);
    if (part.tag <= 0 || !tags.insert(part.tag).second || part.facet_count > kMaxSimplices) {
      return Contradiction("a part of the boundary with the tag ", part.tag, " and ", part.facet_count,
                           " facets; tags are above 0, each once");
    }
    WELLSPACE_RETURN_IF_ERROR(CheckName(part.name));
  }
  if (facets != header.facet_count || header.facet_count > kMaxSimplices) {
    return Contradiction("parts of the boundary with ", facets, " facets, ", header.facet_count, " in all");
  }
  if (header.ridge_count > kMaxSimplices) {
    return Contradiction(header.ridge_count, " ridges are more than can be");
  }
  std::set<int32_t> regions;
  for (const Region& region : header.regions) {
    if (region.id <= 0 || !regions.insert(region.id).second) {
      return Contradiction("a region with the id ", region.id, "; ids are above 0, each once");
    }
    WELLSPACE_RETURN_IF_ERROR(CheckName(region.name));
  }
  return absl::OkStatus();
}

// A part is the one that was asked for, and no larger than the whole.
absl::Status CheckPart(const MeshHeader& header, const std::optional<PartOptions>& wanted) {
  if (!header.part.has_value()) {
    return wanted.has_value() ? absl::UnimplementedError("the server is too old for parts: it sends the whole mesh")
                              : absl::OkStatus();
  }
  const PartHeader& part = *header.part;
  if (!wanted.has_value() || part.parts != wanted->parts || part.part != wanted->part) {
    return Contradiction("part ", part.part, " of ", part.parts, ", which was not asked for");
  }
  if (part.own_vertex_count > header.vertex_count || header.vertex_count > part.whole_vertex_count ||
      part.own_simplex_count > header.simplex_count || header.simplex_count > part.whole_simplex_count ||
      header.facet_count > part.whole_facet_count || part.whole_vertex_count > kMaxVertices ||
      part.whole_simplex_count > kMaxSimplices || part.whole_facet_count > kMaxSimplices) {
    return Contradiction("a part of ", header.vertex_count, " vertices, ", header.simplex_count, " simplices and ",
                         header.facet_count, " facets, which owns ", part.own_vertex_count, " and ",
                         part.own_simplex_count, ", of ", part.whole_vertex_count, ", ", part.whole_simplex_count,
                         " and ", part.whole_facet_count, " of the whole mesh");
  }
  return absl::OkStatus();
}

// The slivers of the statistics have vertices of the mesh.
absl::Status CheckLeftSlivers(const MeshHeader& header) {
  if (header.statistics.slivers.has_value()) {
    for (const LeftSliver& left : header.statistics.slivers->flattest_left) {
      WELLSPACE_RETURN_IF_ERROR(CheckVertices(header, "slivers", left.vertices));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckHeader(const MeshHeader& header, const MeshExpectation& expectation) {
  const size_t dimension = header.dimension;
  if (header.dimension < 1 || header.dimension > kMaxDimension ||
      (expectation.dimension.has_value() && header.dimension != *expectation.dimension) ||
      header.domain_low.size() != dimension || header.domain_high.size() != dimension) {
    return Contradiction(
        "a mesh of dimension ", header.dimension, " with a domain of ", header.domain_low.size(), " low and ",
        header.domain_high.size(), " high coordinates",
        expectation.dimension.has_value() ? absl::StrCat(", for points of dimension ", *expectation.dimension) : "");
  }
  if (header.vertex_count > kMaxVertices || header.simplex_count > kMaxSimplices ||
      header.input_point_count > kMaxInputPoints) {
    return Contradiction(header.vertex_count, " vertices, ", header.simplex_count, " simplices and ",
                         header.input_point_count, " points are more than can be");
  }
  if (expectation.input_points.has_value() && header.input_point_count != *expectation.input_points) {
    return Contradiction("a mesh of ", header.input_point_count, " points; ", *expectation.input_points, " were sent");
  }
  for (size_t axis = 0; axis < dimension; ++axis) {
    const double low = header.domain_low[axis];
    const double high = header.domain_high[axis];
    if (!std::isfinite(low) || !std::isfinite(high) || low > high) {
      return Contradiction("a domain from ", low, " to ", high, " along axis ", axis);
    }
  }
  WELLSPACE_RETURN_IF_ERROR(CheckLeftSlivers(header));
  WELLSPACE_RETURN_IF_ERROR(CheckBoundary(header));
  return CheckPart(header, expectation.part);
}

uint64_t MeshReceiver::WidthOf(int array) const {
  constexpr uint64_t kEnds = 2;
  return array == kPoints || array == kFacets ? header_.dimension
         : array == kSimplices                ? header_.dimension + 1
         : array == kRidges                   ? kEnds
                                              : 1;
}

uint64_t MeshReceiver::SizeOf(int array) const {
  const auto if_any = [](bool are_there, uint64_t rows) { return are_there ? rows : 0; };
  const std::array<uint64_t, kArrays> rows = {header_.vertex_count,
                                              if_any(header_.has_weights, header_.vertex_count),
                                              if_any(header_.has_vertex_marks, header_.vertex_count),
                                              if_any(header_.has_vertex_marks, header_.vertex_count),
                                              if_any(header_.has_simplex_regions, header_.simplex_count),
                                              header_.simplex_count,
                                              header_.input_point_count,
                                              header_.facet_count,
                                              header_.ridge_count,
                                              if_any(header_.part.has_value(), header_.vertex_count),
                                              if_any(header_.part.has_value(), header_.vertex_count),
                                              if_any(header_.part.has_value(), header_.vertex_count),
                                              if_any(header_.part.has_value(), header_.simplex_count),
                                              if_any(header_.part.has_value(), header_.simplex_count),
                                              if_any(header_.part.has_value(), header_.facet_count)};
  return rows[array] * WidthOf(array);
}

absl::Status MeshReceiver::SetMetadata(const v1::MeshMetadata& metadata) {
  if (!expects_metadata_) {
    return Contradiction("a second metadata message");
  }
  expects_metadata_ = false;
  MeshHeader header = HeaderFromProto(metadata);
  WELLSPACE_RETURN_IF_ERROR(CheckHeader(header, expectation_));
  if (has_metadata_) {
    return IsTheSame(header, header_)
               ? absl::OkStatus()
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
  int arrays = 0;
  Array array = kPoints;
  for (int candidate = 0; candidate < kArrays; ++candidate) {
    if (VisitArray(chunk, candidate, [](const auto& values) { return !values.empty(); })) {
      array = static_cast<Array>(candidate);
      ++arrays;
    }
  }
  if (arrays != 1) {
    return Contradiction("chunk ", chunk.index(), " has ", arrays, " arrays; expected one");
  }
  const uint32_t checksum = VisitArray(chunk, array, [](const auto& values) { return ChecksumOf(values); });
  if (checksum != chunk.crc32c()) {
    return Contradiction("chunk ", chunk.index(), " has the CRC32C ", absl::Hex(checksum, absl::kZeroPad8), ", not ",
                         absl::Hex(chunk.crc32c(), absl::kZeroPad8), " as sent");
  }
  const uint64_t values =
      VisitArray(chunk, array, [](const auto& array_values) -> uint64_t { return array_values.size(); });
  WELLSPACE_RETURN_IF_ERROR(CheckOrder(array, values));
  WELLSPACE_RETURN_IF_ERROR(CheckValues(array, chunk));
  WELLSPACE_RETURN_IF_ERROR(CheckMoved(chunk, array == kPoints ? received_[kPoints] / WidthOf(kPoints) : 0));
  ++next_chunk_;
  moved_ += chunk.moved_vertices_size();
  received_[array] += values;
  return Pass(array, chunk);
}

absl::Status MeshReceiver::CheckValues(Array array, const v1::MeshChunk& chunk) const {
  switch (array) {
    case kPoints:
      return CheckPoints(SpanOf(chunk.points()));
    case kWeights:
      return CheckWeights(SpanOf(chunk.weights()));
    case kVertexOrigins:
      return CheckOrigins(header_, SpanOf(chunk.vertex_origins()));
    case kVertexTags:
      return CheckTags(header_, SpanOf(chunk.vertex_tags()));
    case kSimplexRegions:
      return CheckRegions(header_, SpanOf(chunk.simplex_regions()));
    case kSimplices:
      return CheckVertices(header_, kArrayNames[array], SpanOf(chunk.simplices()));
    case kInputVertices:
      return CheckInputVertices(header_, SpanOf(chunk.input_vertices()));
    case kFacets:
      return CheckVertices(header_, kArrayNames[array], SpanOf(chunk.facets()));
    case kRidges:
      return CheckVertices(header_, kArrayNames[array], SpanOf(chunk.ridges()));
    default: {
      const auto numbers = static_cast<PartNumbers>(array - kPartNumbers);
      return CheckPartNumbers(header_, numbers, received_[array], PartNumbersOf(chunk, numbers));
    }
  }
}

absl::Status MeshReceiver::Pass(Array array, const v1::MeshChunk& chunk) {
  switch (array) {
    case kPoints:
      if (absl::Status added = sink_.AddPoints(SpanOf(chunk.points())); !added.ok() || chunk.moved_vertices().empty()) {
        return added;
      }
      return sink_.AddMovedVertices(SpanOf(chunk.moved_vertices()));
    case kWeights:
      return sink_.AddWeights(SpanOf(chunk.weights()));
    case kVertexOrigins:
      return sink_.AddVertexOrigins(SpanOf(chunk.vertex_origins()));
    case kVertexTags:
      return sink_.AddVertexTags(SpanOf(chunk.vertex_tags()));
    case kSimplexRegions:
      return sink_.AddSimplexRegions(SpanOf(chunk.simplex_regions()));
    case kSimplices:
      return sink_.AddSimplices(SpanOf(chunk.simplices()));
    case kInputVertices:
      return sink_.AddInputVertices(SpanOf(chunk.input_vertices()));
    case kFacets:
      return sink_.AddFacets(SpanOf(chunk.facets()));
    case kRidges:
      return sink_.AddRidges(SpanOf(chunk.ridges()));
    default: {
      const auto numbers = static_cast<PartNumbers>(array - kPartNumbers);
      return sink_.AddPartNumbers(numbers, PartNumbersOf(chunk, numbers));
    }
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
