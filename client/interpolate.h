// Functions that are carried from the vertices of a mesh to other points.
#ifndef WELLSPACE_CLIENT_INTERPOLATE_H_
#define WELLSPACE_CLIENT_INTERPOLATE_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "client/types.h"

namespace wellspace::client {

// The kind of values at vertices.
struct VertexValues {
  size_t width = 1;                    // numbers of each vertex
  std::optional<uint64_t> revision{};  // of the mesh whose vertices they are, Mesh.revision; none: as `located`
};

// A function with `values` at the vertices, and linear between them, at points that Client::Locate has found.
//
// Shapes:     values: located.vertex_count x width, row-major. The result: n x width; NaN at points in no simplex.
// Complexity: O(n * vertices of a simplex * width).
// Errors:     INVALID_ARGUMENT: values of another number of vertices. FAILED_PRECONDITION: of the vertices of another
//             mesh, by its revision.
absl::StatusOr<std::vector<double>> Interpolate(const Located& located, std::span<const double> values,
                                                const VertexValues& kind = {});

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_INTERPOLATE_H_
