// A domain in the plane while it is refined: its segments and faces, and where each vertex is on them. MakeDomainCloud
// makes it of the planar graph. Refinement, PlaneMesher and PointPlacer add each vertex here that is added to the
// QueryStructure; the rules, the triangles and the estimate read it.
#ifndef WELLSPACE_CORE_REFINE_PLANE_PLANAR_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_PLANE_PLANAR_DOMAIN_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/features/periodic_sides.h"
#include "core/features/planar_faces.h"
#include "core/features/planar_graph.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"
#include "core/refine/plane/plane_place.h"
#include "core/tree/segment_lists.h"

namespace wellspace::core {

// The rounding of a place, relative to its coordinates: not little beside a segment that is short.
inline constexpr double kPlaceRounding = 0x1p-50;

// The squared circumradius of an equilateral triangle of area 1.
inline constexpr double kRadiusSqOfArea = 0.76980035891950102;

// Segments are named by number, faces as in PlanarFaces. The first vertices are the points of the graph, in its order;
// the others have been inserted: on a segment, or inside a face. That a vertex is on a segment is never computed.
//
// Thread safety: thread-compatible; const functions may run at once. Beside AddVertex, where MakeRoom has made room for
// the vertex, those of them may run that are asked of segments, or of vertices that there were before.
// Invariants: (1) a vertex that is on no segment lies inside a face that is meshed; (2) segments and faces stay as they
//             were made; (3) between two calls of those who add vertices, each vertex on a periodic side has its image.
class PlanarDomain {
 public:
  // REQUIRES:   every point of the graph is an end of a segment, or lies in a face that is meshed; `sides` are those of
  //             the graph.
  PlanarDomain(PlanarGraph graph, PlanarFaces faces, PeriodicSides sides = {});

  const PlanarGraph& graph() const { return graph_; }
  const PlanarFaces& faces() const { return faces_; }
  uint32_t segment_count() const { return static_cast<uint32_t>(graph_.segments.size()); }
  uint32_t point_count() const { return static_cast<uint32_t>(graph_.points.size()); }
  uint32_t vertex_count() const { return point_count() + static_cast<uint32_t>(places_.size()); }

  // Whether a face has a bound on areas.
  bool HasAreaBounds() const { return has_area_bounds_; }

  // Segments.

  const Point<2>& EndOf(uint32_t segment, bool is_b) const { return graph_.points[Index(EndVertex(segment, is_b))]; }
  VertexId EndVertex(uint32_t segment, bool is_b) const {
    return VertexId{is_b ? graph_.segments[segment].b : graph_.segments[segment].a};
  }
  double LengthOf(uint32_t segment) const { return lengths_[segment]; }
  // From the first end of a half-edge to the other, not normalized.
  Point<2> DirectionOf(HalfEdge h) const {
    return Difference<2>(EndOf(SegmentOf(h), !IsFromB(h)), EndOf(SegmentOf(h), IsFromB(h)));
  }
  // The ends of all segments, by segment.
  std::vector<SegmentLists::Ends> Ends() const;

  // Whether two ways that lead from the first end of `h` make an angle of less than 60 degrees, of which h is one.
  bool HasSmallAngle(HalfEdge h) const { return has_small_angle_[h]; }
  // The same of `h` or of its image: distances on both that are rounded for such an angle stay equal.
  bool HasSmallAngleAcross(HalfEdge h) const {
    const uint32_t image = sides_.ImageOf(SegmentOf(h));
    return has_small_angle_[h] || (image != PeriodicSides::kNone &&
                                   has_small_angle_[HalfEdgeOf(image, IsFromB(h) != sides_.IsTurned(SegmentOf(h)))]);
  }
  // The smallest angle between two segments with a common end. Unit: radians; pi where there are no two.
  double MinAngle() const { return min_angle_; }

  // How many vertices have been inserted on a segment; beside AddVertex, how many had been at some time.
  uint32_t SplitsOf(uint32_t segment) const { return splits_[segment].load(std::memory_order_relaxed); }

  // Points beside a segment.

  // Where `p` is beside a segment: how far along from its end a the foot is, on the line through it, and how far away,
  // with a sign. Units: as of the coordinates.
  struct Foot {
    double from_a = 0;
    double away = 0;
  };
  Foot FootOf(const Point<2>& p, uint32_t segment) const {
    const Point<2> along = DirectionOf(HalfEdgeOf(segment, false));
    const Point<2> from = Difference<2>(p, EndOf(segment, false));
    return {Dot<2>(from, along) / LengthOf(segment), Cross(along, from) / LengthOf(segment)};
  }
  // The squared distance between `p` and a segment.
  double DistanceSqTo(const Point<2>& p, uint32_t segment) const;

  // Places on segments.

  // Where a point of a segment is: computed from the nearer end, each coordinate rounded once or twice.
  Point<2> PositionOf(const SegmentPoint& place) const;
  double DistanceFromEnd(const SegmentPoint& place, bool is_b) const {
    return place.is_from_b == is_b ? place.distance : LengthOf(place.segment) - place.distance;
  }
  // The place at a distance from end a, as the distance from the nearer end.
  SegmentPoint FromNearerEnd(uint32_t segment, double from_a) const {
    const double length = LengthOf(segment);
    return from_a <= 0.5 * length ? SegmentPoint{segment, false, from_a} : SegmentPoint{segment, true, length - from_a};
  }
  // The place on `segment` halfway between two vertices on it, or at its ends.
  SegmentPoint MiddleOf(uint32_t segment, VertexId u, VertexId w) const {
    return FromNearerEnd(segment, 0.5 * (DistanceFromEnd(u, segment, false) + DistanceFromEnd(w, segment, false)));
  }
  // The place on `segment` of `p`, which is near to it: its foot.
  SegmentPoint PlaceBeside(const Point<2>& p, uint32_t segment) const {
    const bool is_from_b = FootOf(p, segment).from_a > 0.5 * LengthOf(segment);
    const Point<2> from = Difference<2>(p, EndOf(segment, is_from_b));
    return {segment, is_from_b, Dot<2>(from, DirectionOf(HalfEdgeOf(segment, is_from_b))) / LengthOf(segment)};
  }

  // Periodic sides.

  const PeriodicSides& sides() const { return sides_; }
  // The image of a place on a segment; on none if that has no image. Its position has the other coordinate to the bit.
  SegmentPoint ImageOf(const SegmentPoint& place) const {
    const uint32_t image = place.IsOnSegment() ? sides_.ImageOf(place.segment) : PeriodicSides::kNone;
    return image == PeriodicSides::kNone
               ? SegmentPoint()
               : SegmentPoint{image, place.is_from_b != sides_.IsTurned(place.segment), place.distance};
  }

  // Vertices.

  // Adds the vertex after the last: on a segment, or inside `face`.
  void AddVertex(const SegmentPoint& place, uint32_t face);
  // Makes room for so many more vertices.
  //
  // Complexity: O(1), amortised.
  void MakeRoom(size_t vertices);

  // Whether `v` is a point of the graph, and has not been inserted.
  bool IsGraphPoint(VertexId v) const { return Index(v) < point_count(); }
  // Where `v` is on a segment; on none if it is an end of segments, or inside a face.
  SegmentPoint PlaceOf(VertexId v) const {
    return IsGraphPoint(v) ? SegmentPoint() : places_[Index(v) - point_count()].OnSegment();
  }
  // Whether `v` is inside a face: on no segment, and an end of none.
  bool IsInFace(VertexId v) const {
    return IsGraphPoint(v) ? faces_.point_face[Index(v)] != PlanarFaces::kOnSegments
                           : places_[Index(v) - point_count()].segment == SegmentPoint::kNone;
  }
  // REQUIRES:   IsInFace(v).
  uint32_t FaceOf(VertexId v) const {
    return IsGraphPoint(v) ? faces_.point_face[Index(v)] : places_[Index(v) - point_count()].face_or_end;
  }
  // Whether `v` is on `segment`, or an end of it.
  bool IsOn(VertexId v, uint32_t segment) const {
    return IsGraphPoint(v) ? EndVertex(segment, false) == v || EndVertex(segment, true) == v
                           : places_[Index(v) - point_count()].segment == segment;
  }
  // How far `v`, which is on `segment` or an end of it, is from one of its ends.
  double DistanceFromEnd(VertexId v, uint32_t segment, bool is_b) const;

  // Ways and sectors around a vertex.

  // The ways that lead from `v` along segments, counterclockwise: none from a vertex inside a face. Between two that
  // follow each other lies a sector, of the face left of the first.
  std::span<const HalfEdge> WaysFrom(VertexId v) const;
  // The ways from a vertex at `place`, which is no end of segments.
  std::span<const HalfEdge> WaysFrom(const SegmentPoint& place) const {
    return place.IsOnSegment() ? std::span<const HalfEdge>(ways_).subspan(2 * size_t{place.segment}, 2)
                               : std::span<const HalfEdge>();
  }
  // The number of the sector at `v` that the direction `d` leads into, as of the way before it; one of the two, where
  // it leads along a segment. 0 for a vertex inside a face.
  size_t SectorToward(VertexId v, const Point<2>& d) const { return SectorToward(WaysFrom(v), d); }
  // SectorToward by the ways from a vertex.
  size_t SectorToward(std::span<const HalfEdge> ways, const Point<2>& d) const;
  uint32_t FaceOfSector(VertexId v, size_t sector) const {
    const std::span<const HalfEdge> ways = WaysFrom(v);
    return ways.empty() ? FaceOf(v) : faces_.left_face[ways[sector]];
  }

  // The vertices on each segment in their order, with both of its ends: for segment s they are
  // vertices[first[s]] to vertices[first[s + 1]].
  struct Chains {
    std::vector<uint32_t> first;
    std::vector<VertexId> vertices;

    std::span<const VertexId> Of(uint32_t segment) const {
      return {vertices.data() + first[segment], first[segment + 1] - first[segment]};
    }
  };
  // Complexity: O(vertices log vertices).
  Chains FindChains() const;

  uint64_t MemoryBytes() const;

 private:
  // On a segment, or inside a face: there is one for every vertex.
  struct InsertedPlace {
    uint32_t segment = SegmentPoint::kNone;
    uint32_t face_or_end = 0;  // the face; on a segment whether the distance is from its end b
    double distance = 0;

    SegmentPoint OnSegment() const {
      return segment == SegmentPoint::kNone ? SegmentPoint() : SegmentPoint{segment, face_or_end != 0, distance};
    }
  };

  PlanarGraph graph_;
  PlanarFaces faces_;
  PeriodicSides sides_;
  std::vector<double> lengths_;  // by segment
  std::vector<HalfEdge> ways_;   // 2 of each segment: pieces from a vertex on it, toward b and a
  double min_angle_ = std::numbers::pi;
  std::vector<bool> has_small_angle_;          // by half-edge
  std::vector<std::atomic<uint32_t>> splits_;  // by segment
  bool has_area_bounds_ = false;
  HugeVector<InsertedPlace> places_;  // by vertex that was inserted
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_PLANAR_DOMAIN_H_
