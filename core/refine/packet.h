// Vertices that the refinement serves one after the other, and what another thread foresees of them: ADR 23.
#ifndef WELLSPACE_CORE_REFINE_PACKET_H_
#define WELLSPACE_CORE_REFINE_PACKET_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "core/base/cache_lines.h"
#include "core/base/ids.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/voronoi/extra_vertices.h"
#include "core/voronoi/star.h"

namespace wellspace::core {

// What is found of a cell between two insertions for it.
struct Step {
  Assessment found;
  uint32_t notices = 0;  // so many, the next of the packet's
  bool asks = false;     // for the next of the packet's requests; if not, it is the last step of its vertex
};

// Foreseen is what serving the vertices would do if nobody else were served meanwhile. It is put down in columns, vertex after vertex. What would be
// inserted is numbered from the vertices of the structure on, as many as there were then.
//
// Thread safety: thread-compatible.
template <int D>
struct alignas(kCacheLines) Packet {
  // How long the columns are.
  struct Ends {
    uint32_t steps = 0;
    uint32_t requests = 0;
    uint32_t notices = 0;
    uint32_t watched = 0;
    uint32_t simplices = 0;
  };
  // Of one vertex.
  struct Foreseen {
    bool is_wanted = false;      // it waited
    bool is_known = false;       // not what ends with an error
    double reach_sq = 0;         // squared, the distance beyond which nobody cuts the cell
    uint32_t new_simplices = 0;  // from there on to the end simplices have vertices that are foreseen to be inserted
    Ends begin;
  };

  Ends ends() const {
    const auto size = [](const auto& column) { return static_cast<uint32_t>(column.size()); };
    return {size(steps), size(requests), size(notices), size(watched), size(simplices)};
  }

  void CutTo(const Ends& ends) {
    steps.resize(ends.steps);
    requests.resize(ends.requests);
    inserted.CutTo(ends.requests);
    notices.resize(ends.notices);
    watched.resize(ends.watched);
    simplices.resize(ends.simplices);
  }

  // Whether the stretch has been served.
  bool IsServed() const { return served == vertices.size() && stretch_begin == stretch_end; }

  // Forgets what was foreseen; `vertices_now` are in the structure, and so many have been inserted in these rounds.
  void Prepare(uint32_t vertices_now, size_t inserted_now) {
    CutTo({});
    inserted.Clear(VertexId{vertices_now});
    foreseen.assign(vertices.size(), {});
    reach.low.fill(std::numeric_limits<double>::infinity());
    reach.high.fill(-std::numeric_limits<double>::infinity());
    unforeseen.clear();
    is_foreseen = false;
    parts_foreseen = 0;
    first_unforeseen = inserted_now;
  }

  // Begins to put down what is foreseen of vertex `at`.
  void BeginForeseen(size_t at) {
    foreseen[at].begin = ends();
    foreseen[at].new_simplices = foreseen[at].begin.simplices;
  }

  // Puts down the simplices of `star`, that of vertex `at`.
  void AppendStar(size_t at) {
    const auto new_begin = std::partition(star.begin(), star.end(), [this](const std::array<VertexId, D>& simplex) {
      return std::all_of(simplex.begin(), simplex.end(), [this](VertexId u) { return u < inserted.first(); });
    });
    foreseen[at].new_simplices = static_cast<uint32_t>(simplices.size() + (new_begin - star.begin()));
    simplices.insert(simplices.end(), star.begin(), star.end());
  }

  // Puts down that vertex `at`, at `site`, is foreseen up to here.
  void SetKnown(size_t at, const Point<D>& site) {
    foreseen[at].is_known = true;
    const double radius = 1.001 * std::sqrt(foreseen[at].reach_sq);  // whatever is rounded
    reach.Include(CubeAround<D>(site, radius));
  }

  // Whether what is foreseen of vertex `at`, at `site`, is what would be found now.
  //
  // Complexity: O(unforeseen).
  bool HoldsFor(size_t at, const Point<D>& site) const {
    return is_foreseen && foreseen[at].is_known &&
           std::none_of(unforeseen.begin(), unforeseen.end(),
                        [&](const Point<D>& p) { return DistanceSq<D>(p, site) <= foreseen[at].reach_sq; });
  }

  // Where what is foreseen of vertex `at` ends, once all of them are.
  Ends EndOf(size_t at) const { return at + 1 < foreseen.size() ? foreseen[at + 1].begin : ends(); }

  // What is foreseen to be inserted for vertex `at`.
  std::span<const Point<D>> InsertedFor(size_t at) const {
    if (!is_foreseen || !foreseen[at].is_known) {
      return {};
    }
    const uint32_t begin = foreseen[at].begin.requests;
    return inserted.positions().subspan(begin, EndOf(at).requests - begin);
  }

  // Takes note of points that were inserted and not foreseen, or foreseen and not inserted.
  void NoteUnforeseen(std::span<const Point<D>> points) {
    if (is_foreseen) {
      std::copy_if(points.begin(), points.end(), std::back_inserter(unforeseen),
                   [this](const Point<D>& p) { return reach.Contains(p); });
    }
  }

  // Gives `u` the number that it has got, if it was foreseen to be inserted, and was.
  void Rename(VertexId& u) const {
    if (u != kNoVertex && u >= inserted.first()) {
      u = names[Index(u) - Index(inserted.first())];
    }
  }

  // Roughly.
  uint64_t MemoryBytes() const {
    return steps.capacity() * sizeof(steps[0]) + requests.capacity() * sizeof(requests[0]) +
           notices.capacity() * sizeof(notices[0]) + watched.capacity() * sizeof(watched[0]) +
           (simplices.capacity() + listed.capacity()) * sizeof(simplices[0]);
  }

  // The stretch of the bucket that follows, the last is the next: by place in what was lifted.
  size_t stretch_begin = 0;
  size_t stretch_end = 0;
  std::vector<VertexId> vertices;
  size_t served = 0;  // of them

  bool is_foreseen = false;
  size_t parts_foreseen = 0;       // of those that it is foreseen in
  size_t first_unforeseen = 0;     // of what is inserted in these rounds
  std::vector<Foreseen> foreseen;  // by vertex
  std::vector<Step> steps;
  std::vector<InsertionRequest<D>> requests;
  ExtraVertices<D> inserted;  // by request
  std::vector<NeighborNotice> notices;
  std::vector<WatchedNode<D>> watched;
  Star<D> simplices;  // of the stars of good cells
  Star<D> listed;     // those of the packet before, which may still be read
  Box<D> reach;       // holds the ball that each vertex reaches
  Star<D> star;       // scratch

  std::vector<VertexId> names;       // by request; kNoVertex if it has not been inserted
  std::vector<Point<D>> unforeseen;  // those within reach
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PACKET_H_
