// The crossings of an edge of a cell and the surface, with which the assessment of a facet in space begins.
#ifndef WELLSPACE_CORE_REFINE_SPACE_CROSSING_H_
#define WELLSPACE_CORE_REFINE_SPACE_CROSSING_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/point.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {

struct Crossing {
  Point<3> at{};  // on the triangle, rounded
  uint32_t triangle = 0;
  uint32_t patch = 0;
  uint32_t before = 0;  // the solid that the edge comes from
  uint32_t beyond = 0;  // the solid that it goes on in; the same at a membrane

  bool operator==(const Crossing&) const = default;
};

// The crossings of one edge of a cell after the other. An edge is the dual of a facet: its ends are the circumcentres
// of the tetrahedra on both sides, and it goes between the cells of the facet's vertices.
//
// Thread safety: thread-compatible.
class EdgeCrossings {
 public:
  // `patch_of`: by triangle. Both have to outlive this.
  EdgeCrossings(const SurfaceIndex& index, std::span<const uint32_t> patch_of) : index_(index), patch_of_(patch_of) {}

  // Finds the crossings of the edge from `a` to `b`. `from`: a node of the index whose closed cube holds both.
  //
  // Guarantees: (1) which there are is exact, as SurfaceIndex::FindCrossings says; (2) from b to a they are the same,
  //             with the same bits, in the reverse order.
  // Complexity: O(nodes of the index that the edge meets, and their triangles); no allocation once warm.
  void Find(const Point<3>& a, const Point<3>& b, IndexNode from = 0);

  // Find, where it is known that of all triangles none but these are crossed, ascending.
  void FindAmong(const Point<3>& a, const Point<3>& b, std::span<const uint32_t> triangles);

  // In the order from a to b.
  const std::vector<Crossing>& all() const { return all_; }

  // Whether the facet is one of the boundary between solids, or of a membrane: whether the ends are in different
  // solids, or an odd number of membranes is crossed. Two crossings of one thin part are none.
  bool IsBoundary() const;

  // The crossing that is nearest to `v`, of those as near the one of the lowest triangle; null if there is none.
  const Crossing* NearestTo(const Point<3>& v) const;

 private:
  void TakeFound(const Point<3>& a, const Point<3>& b);

  const SurfaceIndex& index_;
  const std::span<const uint32_t> patch_of_;
  std::vector<SurfaceCrossing> found_;
  std::vector<Crossing> all_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_CROSSING_H_
