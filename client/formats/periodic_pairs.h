// Pairs of vertices on opposite sides of a periodic box, for the formats that hold them.
#ifndef WELLSPACE_CLIENT_FORMATS_PERIODIC_PAIRS_H_
#define WELLSPACE_CLIENT_FORMATS_PERIODIC_PAIRS_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// A vertex on the low side across an axis, and the vertex on the high side with the same other coordinates.
using VertexPair = std::array<uint32_t, 2>;

// Keeps the vertices on the sides across the periodic axes of a mesh while its points come, and pairs them.
//
// Memory:     8 bytes for each coordinate of such a vertex and 8 more, for each of its sides.
// Thread safety: thread-compatible.
class PeriodicPairs {
 public:
  // None where `shape` has no periodic axes. REQUIRES: these are axes of the mesh, whose box is known.
  explicit PeriodicPairs(const MeshShape& shape);

  // Takes the next vertices: rows of as many coordinates as the mesh has dimensions.
  //
  // Complexity: O(axes) each.
  void Add(std::span<const double> points);

  // The pairs across `axis`, one of the periodic ones, by ascending vertices of the low side. All vertices have come.
  //
  // Complexity: that of sorting the vertices on both sides.
  // Errors:     INVALID_ARGUMENT, naming a vertex that has no partner.
  absl::StatusOr<std::vector<VertexPair>> Across(int axis);

 private:
  // A vertex on a side, and its coordinates; that of the axis is 0.
  struct OnSide {
    std::array<double, 3> at{};
    uint32_t vertex = 0;

    bool operator<(const OnSide& other) const { return at < other.at; }
  };

  struct Sides {
    int axis = 0;
    double low = 0;
    double high = 0;
    std::array<std::vector<OnSide>, 2> vertices;
  };

  const size_t dimension_;
  uint32_t next_ = 0;  // the number of the next vertex
  std::vector<Sides> sides_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_PERIODIC_PAIRS_H_
