// The boundary of a mesh of a box, face by face.
#ifndef WELLSPACE_CORE_SIMPLEX_BOUNDARY_H_
#define WELLSPACE_CORE_SIMPLEX_BOUNDARY_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"

namespace wellspace::core {

// Facets of the boundary that a solver treats alike.
struct BoundaryPart {
  int32_t tag = 0;  // above 0; by which solvers tell the facets
  std::string name;
  uint64_t facets = 0;

  bool operator==(const BoundaryPart&) const = default;
};

// Simplices of one material.
struct Region {
  int32_t id = 0;  // above 0
  std::string name;

  bool operator==(const Region&) const = default;
};

// The tag of a vertex that is on no part of the boundary.
inline constexpr int32_t kNoTag = 0;

// The tag of a face of the box: 1 for the low one of the first axis, 2 for the high one, 3 for the low one of the next.
constexpr int32_t FaceTag(int face) { return face + 1; }

// "xmin", "xmax", "ymin", "ymax", "zmin", "zmax"; the axes after the third are w, v and u.
//
// REQUIRES:   0 <= face < 2 kMaxDimension; see FaceIndex.
std::string FaceName(int face);

// The regions of a mesh without features: one.
Region WholeBox();

// The facets on the faces of a box.
struct BoxBoundary {
  HugeVector<uint32_t> facets;      // rows of `dimension` vertices, part after part
  std::vector<BoundaryPart> parts;  // one for each face, by ascending tag
  HugeVector<int32_t> vertex_tags;  // by vertex: the least tag of a face that it is on, or kNoTag
  HugeVector<uint32_t> simplices;   // by facet: the row of its simplex
};

// A mesh of the box from `low` to `high`.
struct BoxMesh {
  std::span<const double> low;
  std::span<const double> high;
  std::span<const double> points;       // rows of as many coordinates as `low` has
  std::span<const uint32_t> simplices;  // rows of one vertex more
};

// Finds the facets of which all vertices are on one face of the box, exactly.
//
// REQUIRES:   `mesh` decomposes the box, its simplices are positively oriented, and there is one.
// Guarantees: (1) they are the facets that belong to one simplex only, each once, and each is on one face: two faces
//             share no D affinely independent points; (2) its simplex' other vertex, put before those of the facet,
//             makes a positively oriented simplex: in 2-D the mesh is on the left of an edge, in 3-D a triangle is
//             counterclockwise seen from outside; (3) within a part, facets come in the order of their simplices.
// Complexity: one pass over the points and one over the simplices; memory of two bytes a vertex beside the result.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
absl::StatusOr<BoxBoundary> FindBoxBoundary(const BoxMesh& mesh, int threads, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_BOUNDARY_H_
