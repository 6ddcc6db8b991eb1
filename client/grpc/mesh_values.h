// Checks whether a server's data can be the values of a mesh. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_MESH_VALUES_H_
#define WELLSPACE_CLIENT_GRPC_MESH_VALUES_H_

#include <cstdint>
#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/types.h"

namespace wellspace::client {

// Far above the meshes of servers, far below numbers by which sizes of arrays overflow.
inline constexpr int kMaxDimension = 64;

// The error for an answer that contradicts itself.
template <typename... Parts>
absl::Status Contradiction(const Parts&... parts) {
  return absl::DataLossError(absl::StrCat("the server's answer is damaged: ", parts...));
}

// Each of these looks at a part of an array of the mesh with this header.
//
// Complexity: O(values), times the parts of the boundary for tags and the regions for regions.
// Errors:     DATA_LOSS, naming the first value that cannot be.

// Coordinates are finite.
absl::Status CheckPoints(std::span<const double> points);
// Weights are finite, and at least 0.
absl::Status CheckWeights(std::span<const double> weights);
// Simplices and facets have vertices that there are. `name`: of the array.
absl::Status CheckVertices(const MeshHeader& header, std::string_view name, std::span<const uint32_t> vertices);
// Input points have become vertices that there are, or none.
absl::Status CheckInputVertices(const MeshHeader& header, std::span<const uint32_t> vertices);
// Vertices come from input points that there are, or from none.
absl::Status CheckOrigins(const MeshHeader& header, std::span<const uint32_t> origins);
// Tags are those of parts of the boundary, or 0.
absl::Status CheckTags(const MeshHeader& header, std::span<const int32_t> tags);
// Regions are those of the header.
absl::Status CheckRegions(const MeshHeader& header, std::span<const int32_t> ids);
// Numbers of a part are those of vertices, simplices, facets and parts that there are; of what is owned, and of nothing
// else, the owner is the part itself. `first`: how many numbers of the array came before.
//
// REQUIRES:   header.part is there.
absl::Status CheckPartNumbers(const MeshHeader& header, PartNumbers array, uint64_t first,
                              std::span<const uint32_t> numbers);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_MESH_VALUES_H_
