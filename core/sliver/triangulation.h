// A triangulation of the box that can be edited: vertices come, go and gain weight, and their simplices with them.
#ifndef WELLSPACE_CORE_SLIVER_TRIANGULATION_H_
#define WELLSPACE_CORE_SLIVER_TRIANGULATION_H_

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/huge_pages.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A simplex of a Triangulation; numbers of simplices that have gone are used again.
enum class SimplexId : uint32_t {};
inline constexpr SimplexId kNoSimplex{std::numeric_limits<uint32_t>::max()};
constexpr uint32_t Index(SimplexId id) { return static_cast<uint32_t>(id); }

// The simplices that a new vertex would replace, and the facets that it would be joined to.
struct Cavity {
  // The facet of `simplex` opposite to its vertex `slot`.
  struct Facet {
    SimplexId simplex;
    int slot;
  };
  std::vector<SimplexId> simplices;
  std::vector<Facet> boundary;
};

// The regular triangulation of weighted vertices in a box whose corners are among them; with all weights zero, the
// Delaunay triangulation. All decisions are exact, and ties go as in cells (TieRule::kPerturb), so that the result
// depends on the vertices and weights alone.
//
// Thread safety: thread-compatible: const functions may run at once.
// Invariants: (1) simplices are positively oriented; (2) neighbours[i] is the simplex beyond the facet opposite to
// vertices[i], kNoSimplex on the boundary; (3) no weight exceeds a quarter of the squared distance to the nearest other
// vertex.
template <int D>
class Triangulation {
 public:
  struct Item {
    std::array<VertexId, D + 1> vertices;
    std::array<SimplexId, D + 1> neighbours;

    int SlotOf(VertexId v) const {
      int slot = 0;
      while (vertices[slot] != v) {
        ++slot;
      }
      return slot;
    }
    int SlotOf(SimplexId neighbour) const {
      int slot = 0;
      while (neighbours[slot] != neighbour) {
        ++slot;
      }
      return slot;
    }
  };

  // Takes over a Delaunay triangulation of `points` in `box`.
  //
  // Shapes:     simplices: count x (D + 1) indices of points, positively oriented.
  // Complexity: O(points + simplices).
  // Errors:     RESOURCE_EXHAUSTED (facets cannot be numbered), CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(const Box<D>& box, HugeVector<Point<D>> points, std::span<const uint32_t> simplices,
                     const RunContext& context);

  const Box<D>& box() const { return box_; }
  uint32_t vertex_count() const { return static_cast<uint32_t>(points_.size()); }
  const Point<D>& point(VertexId v) const { return points_[Index(v)]; }
  FaceMask faces(VertexId v) const { return faces_[Index(v)]; }
  double weight(VertexId v) const { return weights_[Index(v)]; }
  bool IsIn(VertexId v) const { return simplex_of_[Index(v)] != kNoSimplex; }

  // Simplices are numbered below this; some numbers are free.
  uint32_t simplex_limit() const { return static_cast<uint32_t>(items_.size()); }
  bool IsIn(SimplexId s) const { return items_[Index(s)].vertices[0] != kNoVertex; }
  const Item& item(SimplexId s) const { return items_[Index(s)]; }
  Simplex<D> Corners(SimplexId s) const {
    Simplex<D> corners;
    for (int i = 0; i <= D; ++i) {
      corners[i] = point(items_[Index(s)].vertices[i]);
    }
    return corners;
  }

  // The faces of the box that the facet opposite to vertex `slot` of `s` lies on.
  FaceMask FacesOf(SimplexId s, int slot) const { return FacesOf(item(s).vertices, slot); }

  // What it takes in memory, up to scratch.
  uint64_t MemoryBytes() const {
    return points_.size() * (sizeof(Point<D>) + sizeof(FaceMask) + sizeof(double) + sizeof(SimplexId)) +
           items_.size() * (sizeof(Item) + sizeof(uint32_t));
  }

  // What Build takes at its peak, its arguments not counted.
  static uint64_t BuildBytes(uint64_t points, uint64_t simplices) {
    return points * (sizeof(FaceMask) + sizeof(double) + sizeof(SimplexId) + 2 * sizeof(uint32_t)) +
           simplices * (sizeof(Item) + (D + 2) * sizeof(uint32_t));
  }

  // The squared distance from each vertex to its nearest other, by vertex; infinite where it is in no simplex.
  //
  // REQUIRES:   no vertex has a weight.
  // Complexity: O(simplices).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<HugeVector<double>> NearestDistancesSq(const RunContext& context) const;

  // The simplices of vertex `v`.
  //
  // REQUIRES:   v is in.
  // Complexity: O(result).
  void Star(VertexId v, std::vector<SimplexId>& out);

  // Whether a vertex at `p` of weight `weight` would replace simplex `s`.
  //
  // REQUIRES:   p different from the vertices of s; weights as invariant (3) has them.
  // Complexity: O(1).
  // Errors:     none.
  bool IsInConflict(SimplexId s, const Point<D>& p, double weight = 0) const;

  // A simplex that holds `p`, a point of the box, in its closure; walked to from `start`, a vertex that is in.
  //
  // REQUIRES:   no vertex has a weight.
  // Complexity: O(1 + simplices between start and p).
  // Errors:     none.
  SimplexId Locate(const Point<D>& p, VertexId start) const;

  // What a vertex at `p`, a point of the box, would replace; `from` is a simplex in conflict with it.
  //
  // Complexity: O(result).
  // Errors:     none.
  // Source:     Bowyer 1981, Watson 1981.
  void FindCavity(SimplexId from, const Point<D>& p, Cavity& out);
  // What `v` would replace, its star included, if its weight rose to `weight`.
  //
  // REQUIRES:   v is in, and its weight is less.
  void FindCavityOfWeight(VertexId v, double weight, Cavity& out);
  // Whether the last cavity found has `s`.
  bool IsInCavity(SimplexId s) const { return mark_[Index(s)] == stamp_; }

  // Adds a vertex number for Insert. It is in no simplex.
  VertexId AddVertex();

  // Puts `v` at `p` with `weight`, replacing `cavity`, the last that was found, and that for it. The new simplices are
  // in `created`.
  //
  // REQUIRES:   v is not in; or the cavity is that of a weight, and p its place.
  // Complexity: O(cavity).
  // Errors:     none.
  void Insert(VertexId v, const Point<D>& p, double weight, const Cavity& cavity, std::vector<SimplexId>& created);

  // Takes `v` out; the hole is filled by simplices of its neighbours, `created`.
  //
  // REQUIRES:   v is no corner of the box.
  // Complexity: O(simplices times neighbours).
  // Errors:     none.
  // Source:     gift wrapping: beyond each facet comes the vertex whose ball through the facet is empty of neighbours.
  void Remove(VertexId v, std::vector<SimplexId>& created);
  // Undoes the Remove before, after which nothing was changed: simplices get their numbers back.
  void Restore();

 private:
  // A facet that waits for a simplex on its inner side: that of `vertices` with another vertex in `slot`, which is then
  // positively oriented.
  struct Open {
    std::array<VertexId, D + 1> vertices;
    int slot = 0;
    SimplexId beyond = kNoSimplex;
    int beyond_slot = 0;
    uint64_t sum = 0;  // of the numbers of the facet's vertices: other facets seldom have the same
  };
  struct Saved {
    SimplexId simplex;
    Item item;
  };

  SimplexId Allocate();
  void Free(SimplexId s);
  void StartSearch();
  void Grow(const Point<D>& p, double weight, FaceMask faces, Cavity& out);
  // The sum of the numbers of the facet's vertices.
  static uint64_t SumOf(const std::array<VertexId, D + 1>& vertices, int opposite);
  // The faces of the box that all vertices of the facet lie on.
  FaceMask FacesOf(const std::array<VertexId, D + 1>& vertices, int opposite) const;
  VertexId Wrap(const Open& open, SimplexId fresh);
  void LinkFacet(SimplexId fresh, int slot);

  Box<D> box_;
  HugeVector<Point<D>> points_;
  HugeVector<FaceMask> faces_;
  HugeVector<double> weights_;
  HugeVector<SimplexId> simplex_of_;  // by vertex: one of its simplices; kNoSimplex where it is in none
  HugeVector<Item> items_;
  std::vector<SimplexId> free_;

  // Scratch.
  HugeVector<uint32_t> mark_;  // by simplex: stamp_ where the search has it, stamp_ + 1 where it has refused it
  uint32_t stamp_ = 0;
  std::vector<SimplexId> star_;
  std::vector<VertexId> link_;
  std::vector<Open> open_;
  VertexId removed_ = kNoVertex;
  std::vector<Saved> saved_;        // the star of removed_
  std::vector<SimplexId> filling_;  // what took its place
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_TRIANGULATION_H_
