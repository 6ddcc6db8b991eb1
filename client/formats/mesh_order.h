// The order of the elements of a mesh in a file.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_ORDER_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_ORDER_H_

#include <cstdint>

namespace wellspace::formats {

// Elements of second order have a node at the middle of each of their edges, too.
enum class MeshOrder : uint8_t { kFirst = 1, kSecond = 2 };

// How many nodes an element of `corners` corners has: a line, a triangle or a tetrahedron.
constexpr int NodesOf(int corners, MeshOrder order) {
  return order == MeshOrder::kFirst ? corners : corners * (corners + 1) / 2;
}

// The edges of an element by its corners, in the order of VTK, which Abaqus has as well: the nodes at their middles
// stand behind the corners in this order. A line has the first of them, a triangle the first three.
inline constexpr uint8_t kElementEdges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_ORDER_H_
