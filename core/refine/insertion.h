// Insertions of the refinement: requests of a cell, as the rules return them and batches record them; and those
// that have happened, as observers see them.
#ifndef WELLSPACE_CORE_REFINE_INSERTION_H_
#define WELLSPACE_CORE_REFINE_INSERTION_H_

#include "core/base/ids.h"
#include "core/refine/steiner_point.h"

namespace wellspace::core {

// Why a vertex was inserted.
enum class Reason {
  kRatio,         // a node broke rho
  kSize,          // a node was farther than the sizes allow
  kEncroachment,  // the cell touched a face of the box, or a segment, that its site does not lie on
};

// An insertion that has just happened.
struct Insertion {
  Reason reason = Reason::kRatio;
  VertexId near = kNoVertex;   // the vertex whose cell was looked at
  VertexId other = kNoVertex;  // for kRatio, the other end of the edge
  VertexId vertex = kNoVertex;
  double edge_sq = 0;        // the edge that asked for it; the distance between `near` and the face for an encroachment
  double edge_limit_sq = 0;  // all edges that ask for something are at least 1 / sqrt 2 times as long
  double empty_radius_sq = 0;  // no older vertex is nearer to it, up to rounding
};

// The place of a vertex in a box, of which nothing is known beside the position.
struct Nowhere {
  // Whether the vertex is on a feature, and not where its cell asks for one.
  static constexpr bool IsOnFeature() { return false; }
};

// An insertion that a cell asks for, with the point before it was snapped to the boundary. `Place` is that of the
// domain (box_domain.h), and has the functions of Nowhere.
template <int D, typename Place = Nowhere>
struct InsertionRequest {
  Insertion insertion;
  SteinerPoint<D> candidate;
  SteinerPoint<D> point;
  [[no_unique_address]] Place place;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_INSERTION_H_
