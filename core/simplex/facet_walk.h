// The simplices of a part of the mesh, each found once: from facet to facet.
#ifndef WELLSPACE_CORE_SIMPLEX_FACET_WALK_H_
#define WELLSPACE_CORE_SIMPLEX_FACET_WALK_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/simplex/facet_pencil.h"
#include "core/simplex/simplex_list.h"
#include "core/simplex/site_columns.h"
#include "core/voronoi/neighbour_lists.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Computes stars of the Delaunay triangulation that TieRule::kPerturb defines, one after the other. A star is complete when every one of
// its facets at the vertex has a simplex on both sides, or lies on the box. Beyond a facet that lacks one is the simplex with the vertex
// whose ball through the facet holds no other.
//
// Thread safety: thread-compatible. Reused from block to block.
// Invariants: (1) open facets have a vertex of the block and one simplex; (2) each is listed at its vertex with the lowest place,
// which is one of the block, as vertices of the block come first.
template <int D>
class FacetWalk {
  static_assert(D == 2 || D == 3);

 public:
  // Appends to `out` the simplices whose vertex with the lowest output index is in one of `leaves`. Stops early when the context
  // is cancelled.
  //
  // Shapes:     rank, output_index: by vertex; rank numbers the vertices of all leaves, and those of `leaves` one after the other.
  // REQUIRES:   `structure` refined: no circumcentre outside the box; `neighbours` made of the lists of the refinement that has refined it. Where one
  //             is missing the walk may abort.
  // Guarantees: (1) the simplices that have a corner in `leaves` are those of the vertices' whole cells (QueryStructure::Voronoi).
  // Complexity: O(f e) for each vertex of the block, with f facets and e entries of the table: O(1) in a refined structure. A scan for the first star
  //             of what hangs together.
  // Errors:     none.
  // Source:     gift wrapping (Chand and Kapur 1970) in Delaunay triangulations: McLain 1976; with a stop by cells: Maus 1984.
  void AppendStars(const QueryStructure<D>& structure, const NeighbourTable& neighbours, std::span<const NodeId> leaves,
                   std::span<const uint32_t> rank, std::span<const uint32_t> output_index, const RunContext& context,
                   SimplexList<D>& out);

  // What its scratch takes in memory.
  uint64_t MemoryBytes() const {
    return places_.capacity() * sizeof(Place) + near_.MemoryBytes() + first_at_.capacity() * sizeof(uint32_t) +
           has_simplices_.capacity() + open_.capacity() * sizeof(OpenFacet) +
           foreign_.capacity() * (2 * sizeof(uint32_t) + 1);
  }
  // Queries are stars.
  QueryCounters counters() const;

 private:
  // The places of a simplex, positively oriented.
  using Corners = std::array<uint32_t, D + 1>;
  // A facet at the vertex that it is listed at: its other vertices, and which of its sides lacks a simplex. The same facet from the
  // other side has another key.
  using Key = uint64_t;
  struct OpenFacet {
    Key key;
    uint32_t next;  // at the same vertex, or among the unused ones
  };
  // A facet at the vertex that it is listed at, with the side that lacks a simplex.
  struct Facet {
    uint32_t place;
    std::array<uint32_t, D - 1> others;
    bool is_flipped;
  };
  static constexpr uint32_t kNone = ~uint32_t{0};
  // Vertices of the block and near to it, numbered as they are met: the place of a vertex.
  struct Place {
    Point<D> point;
    VertexId vertex;
  };

  static Key KeyOf(const std::array<uint32_t, D - 1>& others, bool is_flipped);
  static Key Opposite(Key key);
  static std::array<uint32_t, D - 1> OthersOf(Key key);
  static bool IsFlipped(Key key) { return D == 2 && (key & 1) != 0; }

  void Begin(const QueryStructure<D>& structure, const NeighbourTable& neighbours, std::span<const NodeId> leaves,
             std::span<const uint32_t> rank, std::span<const uint32_t> output_index);
  bool CloseFacets(std::span<const NodeId> leaves, const RunContext& context, SimplexList<D>& out);
  void CloseFacetsAt(uint32_t place, SimplexList<D>& out);
  void AddCellOf(uint32_t place, SimplexList<D>& out);
  void Gather(uint32_t place);
  uint32_t FindApex(const Facet& facet, FacetBall<D>& ball);
  void Shrink(const FacetPencil<D>& pencil, const Facet& facet, uint32_t u, double power, uint32_t& apex,
              FacetBall<D>& ball);
  void AddSimplex(const Corners& corners, int known_facet, double radius_sq, SimplexList<D>& out);
  void ToggleFacet(uint32_t place, Key key);
  uint32_t PlaceOf(VertexId v);
  const Point<D>& PointAt(uint32_t place) const { return places_[place].point; }
  uint32_t OutputIndex(uint32_t place) const { return output_index_[Index(places_[place].vertex)]; }

  const QueryStructure<D>* structure_ = nullptr;
  std::span<const uint32_t> rank_;
  uint32_t first_rank_ = 0;
  std::span<const uint32_t> output_index_;
  const NeighbourTable* neighbours_ = nullptr;
  std::vector<Place> places_;
  absl::flat_hash_map<uint32_t, uint32_t> foreign_;  // by vertex, of those that are not of the block: the place
  SiteColumns<D> near_;                              // the neighbours of the vertex whose star is being closed
  double near_radius_ = 0;                           // no farther than this
  uint32_t own_count_ = 0;                           // places below are of the block
  std::vector<uint32_t> first_at_;                   // by own place: its open facets
  std::vector<uint8_t> has_simplices_;               // by own place
  std::vector<OpenFacet> open_;
  uint32_t unused_ = kNone;
  size_t open_count_ = 0;
  size_t facets_left_ = 0;  // more than the simplices at the block's vertices, less those found beyond a facet
  Workspace<D> workspace_;
  QueryCounters counters_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_FACET_WALK_H_
