// A triangulation of the box that can be edited: vertices come, go and gain weight, and their simplices with them.
#ifndef WELLSPACE_CORE_SLIVER_TRIANGULATION_H_
#define WELLSPACE_CORE_SLIVER_TRIANGULATION_H_

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/sliver/lifted_plane.h"
#include "core/sliver/link_columns.h"
#include "core/sliver/simplex_journal.h"

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

    // One of them is `v`, or `neighbour`. Without jumps, which could not be predicted.
    int SlotOf(VertexId v) const { return SlotIn(vertices, v); }
    int SlotOf(SimplexId neighbour) const { return SlotIn(neighbours, neighbour); }

   private:
    template <typename Id>
    static int SlotIn(const std::array<Id, D + 1>& ids, Id id) {
      int slot = 0;
      for (int i = 1; i <= D; ++i) {
        slot += ids[i] == id ? i : 0;
      }
      return slot;
    }
  };

  // Takes over a Delaunay triangulation of `points` in `box`, on up to `threads` threads.
  //
  // Shapes:     simplices: count x (D + 1) indices of points, positively oriented.
  // Complexity: O(points + simplices).
  // Errors:     RESOURCE_EXHAUSTED (facets cannot be numbered), CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(const Box<D>& box, HugeVector<Point<D>> points, std::span<const uint32_t> simplices, int threads,
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

  // Memory of the triangulation, up to scratch. Unit: bytes.
  uint64_t MemoryBytes() const {
    return points_.size() * (sizeof(Point<D>) + sizeof(FaceMask) + sizeof(double) + sizeof(SimplexId)) +
           link_number_.size() * sizeof(uint32_t) + items_.size() * (sizeof(Item) + sizeof(uint32_t));
  }

  // Peak memory of Build, beside its arguments. Unit: bytes.
  static uint64_t BuildBytes(uint64_t points, uint64_t simplices) {
    return points * (sizeof(FaceMask) + sizeof(double) + sizeof(SimplexId) + sizeof(uint32_t)) +
           simplices * (sizeof(Item) + 3 * sizeof(uint32_t));
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
  bool IsInConflict(SimplexId s, const Point<D>& p, double weight = 0);

  // A simplex that holds `p`, a point of the box, in its closure; walked to from `start`, a vertex that is in.
  //
  // REQUIRES:   no vertex has a weight.
  // Complexity: O(1 + simplices between start and p).
  // Errors:     none.
  SimplexId Locate(const Point<D>& p, VertexId start) const;

  // The cavity of a vertex at `p`, a point of the box; `from` is a simplex in conflict with it.
  //
  // Complexity: O(result).
  // Errors:     none.
  // Source:     Bowyer 1981, Watson 1981.
  void FindCavity(SimplexId from, const Point<D>& p, Cavity& out) {
    FindCavityUnless(from, p, out, [](const Cavity::Facet&) { return false; });
  }
  // FindCavity, but ends where `is_refused`(Cavity::Facet) of a facet of the boundary. Returns whether there is no such
  // one.
  template <typename IsRefused>
  bool FindCavityUnless(SimplexId from, const Point<D>& p, Cavity& out, IsRefused is_refused) {
    StartSearch();
    out.simplices.assign(1, from);
    mark_[Index(from)] = stamp_;
    return Grow(p, 0, box_.FacesOf(p), out, is_refused);
  }
  // The cavity of `v`, its star included, if its weight rose to `weight`.
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
  // The simplices that have changed. Invariant: one that was and is in, and is not there, has its vertices, and they
  // their places.
  SimplexJournal& journal() { return journal_; }

  // Undoes the Remove before, after which nothing was changed: simplices get their numbers back.
  void Restore();

 private:
  absl::Status TakeSimplices(std::span<const uint32_t> simplices, const RunContext& context);
  absl::Status MatchFacets(int threads, const RunContext& context);

  // A facet that still lacks the simplex on its inner side: that of `vertices`, by their numbers in link_, with another
  // vertex in `slot`, which is then positively oriented.
  struct Open {
    std::array<uint32_t, D + 1> vertices;
    int slot = 0;
    SimplexId beyond = kNoSimplex;
    int beyond_slot = 0;
    std::array<uint32_t, D> facet{};  // its vertices, ascending
  };
  struct Saved {
    SimplexId simplex;
    int beyond_slot;  // of the facet opposite to the removed vertex, seen from beyond
    Item item;
  };
  struct KnownPlane {
    SimplexId simplex = kNoSimplex;
    LiftedPlane<D> plane;
  };
  // A power of two; a search of places for a vertex asks for the same few dozen simplices again and again.
  static constexpr uint32_t kKnownPlanes = 512;

  LiftedPlane<D> PlaneOf(const std::array<VertexId, D + 1>& vertices) const;
  bool IsInConflict(const std::array<VertexId, D + 1>& vertices, const LiftedPlane<D>& plane, const Point<D>& p,
                    double weight) const;
  SimplexId Allocate();
  void Free(SimplexId s);
  void StartSearch();
  template <typename IsRefused>
  bool Grow(const Point<D>& p, double weight, FaceMask faces, Cavity& out, IsRefused is_refused);
  static std::array<uint32_t, D> FacetOf(const std::array<uint32_t, D + 1>& vertices, int opposite);
  // Different facets seldom have the same.
  static uint64_t KeyOf(const std::array<uint32_t, D>& facet) {
    uint64_t key = 0;
    for (const uint32_t u : facet) {
      key = (key << (64 / D)) + u;
    }
    return key;
  }
  // The faces of the box that all vertices of the facet lie on.
  FaceMask FacesOf(const std::array<VertexId, D + 1>& vertices, int opposite) const;
  uint32_t NumberInLink(VertexId u, VertexId removed);
  void PushOpen(const Open& open);
  Open TakeOpen(size_t at);
  uint32_t Wrap(const Open& open, SimplexId fresh);
  void LinkFacet(SimplexId fresh, const std::array<uint32_t, D + 1>& vertices, int slot);

  Box<D> box_;
  HugeVector<Point<D>> points_;
  HugeVector<FaceMask> faces_;
  HugeVector<double> weights_;
  HugeVector<SimplexId> simplex_of_;  // by vertex: one of its simplices; kNoSimplex where it is in none
  HugeVector<Item> items_;
  std::vector<SimplexId> free_;
  SimplexJournal journal_;
  size_t journal_size_ = 0;         // at the last Remove
  std::vector<KnownPlane> planes_;  // that of s, if it is known, at s modulo kKnownPlanes

  // Scratch.
  HugeVector<uint32_t> mark_;  // by simplex: stamp_ where the search has it, stamp_ + 1 where it has refused it
  uint32_t stamp_ = 0;
  std::vector<SimplexId> star_;
  std::vector<VertexId> link_;        // the neighbours of removed_
  HugeVector<uint32_t> link_number_;  // by vertex, where it is in link_ if that has it
  LinkColumns link_columns_;          // in 3-D
  std::vector<Open> open_;
  std::vector<uint64_t> open_keys_;  // KeyOf the facet of each
  VertexId removed_ = kNoVertex;
  std::vector<Saved> saved_;        // the star of removed_
  std::vector<SimplexId> filling_;  // the simplices that took its place
};

// Adds the simplices in conflict to those that are there and marked, up to the first refused facet. Simplices that
// are not in conflict but touch `p` are none.
template <int D>
template <typename IsRefused>
bool Triangulation<D>::Grow(const Point<D>& p, double weight, FaceMask faces, Cavity& out, IsRefused is_refused) {
  const uint32_t outside = stamp_ + 1;
  out.boundary.clear();
  for (size_t k = 0; k < out.simplices.size(); ++k) {
    const SimplexId s = out.simplices[k];
    for (int i = 0; i <= D; ++i) {
      const SimplexId next = items_[Index(s)].neighbours[i];
      if (next == kNoSimplex) {
        // Facets on a face of the box that p is on are replaced too.
        if ((FacesOf(items_[Index(s)].vertices, i) & faces) != 0) {
          continue;
        }
      } else {
        uint32_t& mark = mark_[Index(next)];
        if (mark == stamp_) {
          continue;
        }
        if (mark != outside) {
          if (IsInConflict(next, p, weight)) {
            mark = stamp_;
            out.simplices.push_back(next);
            continue;
          }
          mark = outside;
        }
      }
      out.boundary.push_back({s, i});
      if (is_refused(out.boundary.back())) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_TRIANGULATION_H_
