// The parts of the Voronoi cell of one vertex, whichever class it is: planes, and nodes where these meet.
#ifndef WELLSPACE_CORE_CELL_CELL_PARTS_H_
#define WELLSPACE_CORE_CELL_CELL_PARTS_H_

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <type_traits>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// The kinds of bounding planes of a cell. Planes that are no bisectors are its walls, at right angles to an axis.
enum class PlaneKind : uint8_t {
  kBisector,
  kFace,  // of the box
  kClip,  // of the box that a clipped cell is computed in, or of the walls far outside the box
};

// The first shape of a cell clipped by the box `clip`: the part of `box` in it. `kinds` gets the kind of each face, by
// FaceIndex.
template <int D>
Box<D> ClippedBox(const Box<D>& box, const Box<D>& clip, std::array<PlaneKind, 2 * D>& kinds) {
  Box<D> bounds = box;
  kinds.fill(PlaneKind::kFace);
  for (int i = 0; i < D; ++i) {
    if (clip.low[i] > bounds.low[i]) {
      bounds.low[i] = clip.low[i];
      kinds[FaceIndex(i, false)] = PlaneKind::kClip;
    }
    if (clip.high[i] < bounds.high[i]) {
      bounds.high[i] = clip.high[i];
      kinds[FaceIndex(i, true)] = PlaneKind::kClip;
    }
  }
  return bounds;
}

template <int D>
struct Plane {
  PlaneKind kind = PlaneKind::kBisector;
  uint8_t face = 0;             // FaceIndex, unless a bisector
  VertexId vertex = kNoVertex;  // of a bisector
  Point<D> normal;              // relative to the site: normal . x = offset; of a bisector the vector to its vertex
  double offset = 0;
  double length = 0;      // |normal|
  double distance = 0;    // of the plane from the site, |offset| / length
  PlaneSource<D> source;  // for exact decisions, in the coordinates of the input; the rest is rounded
};

// Makes `plane` the wall on face `face` of `bounds`.
template <int D>
void SetWall(const Point<D>& site, const Box<D>& bounds, int face, PlaneKind kind, Plane<D>& plane) {
  const int axis = face / 2;
  plane.kind = kind;
  plane.face = static_cast<uint8_t>(face);
  plane.vertex = kNoVertex;
  plane.normal = {};
  plane.normal[axis] = 1;
  plane.length = 1;
  plane.source.axis = axis;
  plane.source.coordinate = bounds.FaceCoordinate(face);
  plane.offset = plane.source.coordinate - site[axis];
  plane.distance = std::abs(plane.offset);
}

// Makes `plane` the bisector of the site and `u` at `position` = site + normal, for length_sq = NormSq<D>(normal).
template <int D>
WELLSPACE_INLINE void SetBisector(VertexId u, const Point<D>& position, const Point<D>& normal, double length_sq,
                                  Plane<D>& plane) {
  plane.kind = PlaneKind::kBisector;
  plane.vertex = u;
  plane.normal = normal;
  plane.offset = 0.5 * length_sq;
  plane.length = std::sqrt(length_sq);
  plane.distance = 0.5 * plane.length;
  plane.source.generator = position;
  plane.source.axis = -1;
}

// Numbers the nodes of a cell: a mesh in 6-D has cells of more than 2^16.
template <int D>
using NodeIndex = std::conditional_t<(D <= 4), uint16_t, uint32_t>;

template <int D>
struct CellNode {
  Point<D> x;                      // relative to the site
  double radius_sq = 0;            // |x|^2
  double reach = 0;                // at least |x| of the exact node
  double slack = 0;                // bounds the error of x, and of products with it, per unit of length
  std::array<uint16_t, D> planes;  // that meet here, by index; of a placed one bisectors by vertex, then walls by face
  std::array<NodeIndex<D>, D> neighbours;  // neighbours[k]: the node at the other end of the edge that leaves planes[k]
};

// The order that a placed node has its planes in is that of these keys: bisectors by their vertices, then walls, whose
// vertex is kNoVertex, the largest, by face. It does not depend on when a plane came, so the node does not either.
template <int D>
WELLSPACE_INLINE uint64_t PlaneOrderKey(std::span<const Plane<D>> planes, uint16_t index) {
  return uint64_t{Index(planes[index].vertex)} << 16 | index;
}

// The places in that order of the planes with these indices.
template <int D>
WELLSPACE_INLINE std::array<uint32_t, D> RanksOf(std::span<const Plane<D>> planes,
                                                 const std::array<uint16_t, D>& indices) {
  std::array<uint64_t, D> keys;
  for (int k = 0; k < D; ++k) {
    keys[k] = PlaneOrderKey<D>(planes, indices[k]);
  }
  std::array<uint32_t, D> ranks{};
  for (int k = 0; k < D; ++k) {
    for (int i = 0; i < D; ++i) {
      ranks[k] += keys[i] < keys[k] ? 1 : 0;
    }
  }
  return ranks;
}

// The faces of the box that a node of a cell with these planes lies on.
template <int D>
FaceMask FacesOf(std::span<const Plane<D>> planes, const CellNode<D>& node) {
  FaceMask faces = 0;
  for (const uint16_t index : node.planes) {
    if (planes[index].kind == PlaneKind::kFace) {
      faces = static_cast<FaceMask>(faces | (1u << planes[index].face));
    }
  }
  return faces;
}

// The most vertices that cut a cell in one go, in the plane and in space.
inline constexpr size_t kMostCutTogether = 64;

// The most parts of a cell, so that its parts can be numbered and a cut ends soon. Cells of a refined mesh are
// far smaller; a vertex amid unrefined ones can have all of them for neighbours.
template <int D>
inline constexpr size_t kMostNodes = D <= 4 ? size_t{1} << 14 : size_t{1} << 18;
inline constexpr size_t kMostPlanes = size_t{1} << 15;

// A vertex whose squared distance from the site, as computed, is more than so many times the squared reach of a cell
// cannot cut it: its bisector is half as far. The part over 4 is for rounding.
inline constexpr double kCutLimit = 4 * (1 + 0x1p-49);

// Ends the program unless `holds`: something that must be true of the graph of a cell after a cut. Exact decisions take
// away a connected part of the nodes, so that it is true whatever the input; the check is for errors of the program or
// of the machine, which would else become a mesh that is wrong unnoticed. A cut pays a few comparisons for it.
WELLSPACE_INLINE void AbortUnlessCellHolds(bool holds) {
  if (!holds) [[unlikely]] {
    std::abort();
  }
}

// How often the stages after the floating-point filter were needed.
struct DecisionCounters {
  uint64_t exact = 0;
  uint64_t perturbed = 0;
};

// Whether the bisector of `site` and `generator` cuts off the node where those of `planes` meet that `node` names,
// exactly; the decision is counted.
template <int D, typename PlaneIndex>
bool DecideNode(const Point<D>& site, std::span<const Plane<D>> planes, const std::array<PlaneIndex, D>& node,
                const Point<D>& generator, TieRule rule, DecisionCounters& counters) {
  std::array<PlaneSource<D>, D> sources;
  for (int k = 0; k < D; ++k) {
    sources[k] = planes[node[k]].source;
  }
  const ExactDecision decision = DecideCut<D>(site, sources, generator, rule);
  ++counters.exact;
  counters.perturbed += decision.perturbed ? 1 : 0;
  return decision.sign == Sign::kPositive;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_CELL_PARTS_H_
