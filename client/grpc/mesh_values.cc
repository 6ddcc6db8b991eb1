#include "client/grpc/mesh_values.h"

#include <algorithm>
#include <cmath>

namespace wellspace::client {

absl::Status CheckPoints(std::span<const double> points) {
  const auto wrong = std::ranges::find_if(points, [](double x) { return !std::isfinite(x); });
  return wrong == points.end() ? absl::OkStatus() : Contradiction("a coordinate of a vertex is ", *wrong);
}

absl::Status CheckWeights(std::span<const double> weights) {
  const auto wrong = std::ranges::find_if(weights, [](double weight) { return !(weight >= 0) || std::isinf(weight); });
  return wrong == weights.end() ? absl::OkStatus() : Contradiction("the weight of a vertex is ", *wrong);
}

absl::Status CheckVertices(const MeshHeader& header, std::string_view name, std::span<const uint32_t> vertices) {
  const auto wrong = std::ranges::find_if(vertices, [&](uint32_t vertex) { return vertex >= header.vertex_count; });
  return wrong == vertices.end() ? absl::OkStatus()
                                 : Contradiction(absl::string_view(name.data(), name.size()), " name vertex ", *wrong,
                                                 " of ", header.vertex_count);
}

absl::Status CheckInputVertices(const MeshHeader& header, std::span<const uint32_t> vertices) {
  const auto wrong = std::ranges::find_if(
      vertices, [&](uint32_t vertex) { return vertex >= header.vertex_count && vertex != kNoVertex; });
  return wrong == vertices.end() ? absl::OkStatus()
                                 : Contradiction("input vertices name vertex ", *wrong, " of ", header.vertex_count);
}

absl::Status CheckOrigins(const MeshHeader& header, std::span<const uint32_t> origins) {
  if (header.part.has_value()) {
    return absl::OkStatus();  // they are numbers of the whole mesh's input points, of which a part does not tell
  }
  const auto wrong = std::ranges::find_if(
      origins, [&](uint32_t origin) { return origin >= header.input_point_count && origin < kCornerOrigin; });
  return wrong == origins.end()
             ? absl::OkStatus()
             : Contradiction("vertex origins name input point ", *wrong, " of ", header.input_point_count);
}

absl::Status CheckTags(const MeshHeader& header, std::span<const int32_t> tags) {
  const auto is_unknown = [&](int32_t tag) {
    const auto has_tag = [tag](const BoundaryPart& part) { return part.tag == tag; };
    return tag != 0 && std::ranges::none_of(header.boundary, has_tag);
  };
  const auto wrong = std::ranges::find_if(tags, is_unknown);
  return wrong == tags.end()
             ? absl::OkStatus()
             : Contradiction("vertex tags name the tag ", *wrong, ", which no part of the boundary has");
}

absl::Status CheckRegions(const MeshHeader& header, std::span<const int32_t> ids) {
  const auto is_unknown = [&](int32_t id) {
    return std::ranges::none_of(header.regions, [id](const Region& region) { return region.id == id; });
  };
  const auto wrong = std::ranges::find_if(ids, is_unknown);
  return wrong == ids.end() ? absl::OkStatus()
                            : Contradiction("simplex regions name the region ", *wrong, ", which there is not");
}

namespace {

// The owners of vertices or simplices, of which the part owns the first `own`.
absl::Status CheckOwners(const PartHeader& part, uint64_t own, uint64_t first, std::span<const uint32_t> owners) {
  for (size_t i = 0; i < owners.size(); ++i) {
    if (owners[i] >= part.parts || (owners[i] == part.part) != (first + i < own)) {
      return Contradiction("number ", first + i, " of part ", part.part, ", which owns the first ", own,
                           ", has the owner ", owners[i]);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckPartNumbers(const MeshHeader& header, PartNumbers array, uint64_t first,
                              std::span<const uint32_t> numbers) {
  const PartHeader& part = *header.part;
  uint64_t end = part.whole_vertex_count;
  switch (array) {
    case PartNumbers::kVertexOwners:
      return CheckOwners(part, part.own_vertex_count, first, numbers);
    case PartNumbers::kSimplexOwners:
      return CheckOwners(part, part.own_simplex_count, first, numbers);
    case PartNumbers::kSimplexIds:
      end = part.whole_simplex_count;
      break;
    case PartNumbers::kFacetIds:
      end = part.whole_facet_count;
      break;
    case PartNumbers::kVertexIds:
    case PartNumbers::kVertexRows:
      break;
  }
  const auto wrong = std::ranges::find_if(numbers, [&](uint32_t number) { return number >= end; });
  return wrong == numbers.end() ? absl::OkStatus()
                                : Contradiction("a part names the number ", *wrong, " of ", end, " of the whole mesh");
}

}  // namespace wellspace::client
