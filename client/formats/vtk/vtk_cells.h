// The cells of a mesh as VTK has them: first the simplices, then the facets of the boundary. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_VTK_CELLS_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_VTK_CELLS_H_

#include <cstdint>
#include <string_view>

#include "client/formats/mesh.h"

namespace wellspace::formats {

// VTK's numbers of types.
inline constexpr uint8_t kVtkVertex = 1;
inline constexpr uint8_t kVtkPolyVertex = 2;
inline constexpr uint8_t kVtkLine = 3;
inline constexpr uint8_t kVtkTriangle = 5;
inline constexpr uint8_t kVtkTetrahedron = 10;
inline constexpr uint8_t kVtkQuadraticEdge = 21;
inline constexpr uint8_t kVtkQuadraticTriangle = 22;
inline constexpr uint8_t kVtkQuadraticTetrahedron = 24;

inline uint64_t VtkCellCount(const MeshShape& shape) { return shape.simplex_count + shape.facet_count(); }

// Nodes of all cells before number `cell`.
inline uint64_t VtkOffset(const MeshShape& shape, uint64_t cell) {
  const uint64_t simplices = cell < shape.simplex_count ? cell : shape.simplex_count;
  return simplices * shape.simplex_nodes() + (cell - simplices) * shape.facet_nodes();
}

inline uint8_t VtkCellType(const MeshShape& shape, uint64_t cell) {
  const int corners = shape.dimension + (cell < shape.simplex_count ? 1 : 0);
  if (shape.order == MeshOrder::kSecond) {
    return corners == 2 ? kVtkQuadraticEdge : corners == 3 ? kVtkQuadraticTriangle : kVtkQuadraticTetrahedron;
  }
  return corners == 2 ? kVtkLine : corners == 3 ? kVtkTriangle : kVtkTetrahedron;
}

// Names of data: of points the origin and the tag, of cells the region and the tag, which are 0 where there is none.
inline constexpr char kVtkOrigin[] = "origin";
inline constexpr char kVtkBoundary[] = "boundary";
inline constexpr char kVtkRegion[] = "region";
// Of the file: bytes of the text of NameLines.
inline constexpr char kVtkNames[] = "wellspace_names";

// Of a part: the numbers in the whole mesh, under names that VTK gives a meaning; who owns what; and which are ghosts.
inline constexpr char kVtkPointIds[] = "GlobalPointIds";
inline constexpr char kVtkCellIds[] = "GlobalCellIds";
inline constexpr char kVtkOwner[] = "owner";
inline constexpr char kVtkRow[] = "row";
inline constexpr char kVtkGhosts[] = "vtkGhostType";
// VTK's bit for a point or a cell that another piece has, too.
inline constexpr uint8_t kVtkDuplicate = 1;

// Whether cells have data.
inline bool HasCellData(const MeshShape& shape) {
  return !shape.boundary.empty() || shape.has_simplex_regions || !shape.regions.empty() || shape.part != nullptr;
}

// The type of a cell of `size` vertices in a section of polygonal data, as either format calls it.
inline uint8_t VtkPolyDataType(std::string_view section, uint64_t size) {
  if (section == "VERTICES" || section == "Verts") {
    return size == 1 ? kVtkVertex : kVtkPolyVertex;
  }
  if (section == "LINES" || section == "Lines") {
    return size == 2 ? kVtkLine : 4;
  }
  if (section == "POLYGONS" || section == "Polys") {
    return size == 3 ? kVtkTriangle : 7;
  }
  return 6;  // a strip of triangles
}

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_CELLS_H_
