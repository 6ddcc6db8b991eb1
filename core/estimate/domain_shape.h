// The area of the faces of a domain in the plane, and of their parts in boxes.
#ifndef WELLSPACE_CORE_ESTIMATE_DOMAIN_SHAPE_H_
#define WELLSPACE_CORE_ESTIMATE_DOMAIN_SHAPE_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/plane/planar_domain.h"

namespace wellspace::core {

// The faces that are meshed. Areas are bounds from below: the possible rounding up is taken off.
//
// Thread safety: immutable.
class DomainShape {
 public:
  // Faces whose triangles have the same largest area.
  struct Part {
    double area = 0;    // of the faces
    double length = 0;  // of the segments beside them, of both sides where both are meshed
    double max_area = std::numeric_limits<double>::infinity();

    // No triangle that keeps `max_circumradius` there has a larger circumradius.
    double SizeFor(double max_circumradius) const;
  };

  // REQUIRES:   `domain` outlives this.
  // Complexity: O(n log n) for n segments.
  explicit DomainShape(const PlanarDomain& domain);

  const Box<2>& box() const { return box_; }                 // of all segments
  const std::vector<Part>& parts() const { return parts_; }  // of least areas first
  double area() const;

  // The part of the faces in `part`.
  //
  // Complexity: O(sqrt(n)) for most domains and boxes.
  double AreaIn(const Box<2>& part) const;

  // Whether the faces have a point in common with `part`; false where rounding leaves a doubt.
  //
  // Complexity: O(n).
  bool Meets(const Box<2>& part) const;

  // How many vertices there are at least, on segments and as points, if no triangle has a circumradius above
  // `max_circumradius`: no edge is longer than twice that.
  //
  // Complexity: O(n).
  double LeastVertices(double max_circumradius) const;

 private:
  static constexpr size_t kRun = 16;

  // A segment with a meshed face on its left.
  struct Edge {
    Point<2> from;
    Point<2> to;
  };
  // Edges that follow each other.
  struct Node {
    Box<2> box;
    double along = 0;  // the first axis: how far they lead, with signs, and without
    double lengths = 0;
  };
  // A sum, and how much of it may have come from rounding.
  struct Sum {
    double value = 0;
    double size = 0;  // the sum of the terms' sizes, without signs
  };

  bool Contains(const Point<2>& p) const;
  void AddBelow(size_t level, size_t index, const Box<2>& part, Sum& sum) const;
  void AddBelow(const Edge& edge, const Box<2>& part, Sum& sum) const;

  const PlanarDomain& domain_;
  Box<2> box_;
  double largest_ = 0;  // coordinate
  std::vector<Part> parts_;
  std::vector<Edge> edges_;                // the segments that bound meshed faces
  std::vector<std::vector<Node>> levels_;  // over runs of edges, and over pairs of nodes
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_DOMAIN_SHAPE_H_
