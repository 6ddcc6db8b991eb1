#include "core/validate/validate_domain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

using Edge = std::pair<uint32_t, uint32_t>;

constexpr double kRatioTolerance = 1e-9;
// A circle is looked through that is larger by so much, relatively, than the one that was computed.
constexpr double kCircleRoom = 1e-9;
// How far from its circumcentre a triangle is looked around, in circumradii, for the segment that a better vertex would
// have come too near to. That vertex lies within the circumcircle or a little beyond, and so much nearer to the
// segment.
constexpr double kReach = 1 + 0.5 * std::numbers::sqrt2;
// A line of facets goes on where two of them differ in direction by less, by the cosine: places of vertices are
// rounded.
constexpr double kStraight = 1e-9;

absl::Status Violation(const std::string& what) { return absl::FailedPreconditionError(what); }

// Vertices in a k-d tree: which of them lie in a disc.
//
// Thread safety: thread-compatible; const functions may run at once.
class PointTree {
 public:
  explicit PointTree(std::span<const double> points) : points_(points), order_(points.size() / 2) {
    std::iota(order_.begin(), order_.end(), 0);
    Sort(0, order_.size(), 0);
  }

  // Calls f(vertex) for those within `radius` of `centre`, until it returns false.
  template <typename F>
  bool ForEachIn(const Point<2>& centre, double radius, F&& f) const {
    return Visit(0, order_.size(), 0, centre, radius, f);
  }

 private:
  void Sort(size_t begin, size_t end, int axis) {
    if (end - begin < 2) {
      return;
    }
    const size_t middle = (begin + end) / 2;
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
        [&](uint32_t u, uint32_t v) { return points_[size_t{2} * u + axis] < points_[size_t{2} * v + axis]; });
    Sort(begin, middle, 1 - axis);
    Sort(middle + 1, end, 1 - axis);
  }

  template <typename F>
  bool Visit(size_t begin, size_t end, int axis, const Point<2>& centre, double radius, F& f) const {
    if (begin == end) {
      return true;
    }
    const size_t middle = (begin + end) / 2;
    const uint32_t v = order_[middle];
    const Point<2> p = PointAt<2>(points_, v);
    if (DistanceSq<2>(p, centre) <= radius * radius && !f(v)) {
      return false;
    }
    return (p[axis] < centre[axis] - radius || Visit(begin, middle, 1 - axis, centre, radius, f)) &&
           (p[axis] > centre[axis] + radius || Visit(middle + 1, end, 1 - axis, centre, radius, f));
  }

  const std::span<const double> points_;
  std::vector<uint32_t> order_;
};

std::array<uint32_t, 3> CornersOf(const MeshView& mesh, size_t triangle) {
  return {mesh.simplices[3 * triangle], mesh.simplices[3 * triangle + 1], mesh.simplices[3 * triangle + 2]};
}

Simplex<2> PlacesOf(const MeshView& mesh, const std::array<uint32_t, 3>& corners) {
  return {PointAt<2>(mesh.points, corners[0]), PointAt<2>(mesh.points, corners[1]),
          PointAt<2>(mesh.points, corners[2])};
}

std::string NameOf(const Edge& edge) { return absl::StrCat("the edge of vertices ", edge.first, " and ", edge.second); }

// The lines that facets form.
class FacetLines {
 public:
  FacetLines(const MeshView& mesh, std::span<const uint32_t> facets) : mesh_(mesh), facets_(facets) {
    for (size_t f = 0; f < facets.size(); f += 2) {
      beside_.emplace(facets[f], facets[f + 1]);
      beside_.emplace(facets[f + 1], facets[f]);
    }
  }

  // Whether a line that comes within `reach` of `p` meets another one at less than 60 degrees.
  //
  // Complexity: O(facets), times the length of lines within reach.
  bool HaveSmallAngleNear(const Point<2>& p, double reach) const {
    for (size_t f = 0; f < facets_.size(); f += 2) {
      const uint32_t u = facets_[f];
      const uint32_t v = facets_[f + 1];
      if (DistanceToSegment(At(u), At(v), p) <= reach && (LeadsToSmallAngle(u, v) || LeadsToSmallAngle(v, u))) {
        return true;
      }
    }
    return false;
  }

 private:
  Point<2> At(uint32_t v) const { return PointAt<2>(mesh_.points, v); }

  // Follows the line of the facet from `from` to `to`, and onwards.
  bool LeadsToSmallAngle(uint32_t from, uint32_t to) const {
    for (size_t i = 0; i < facets_.size() / 2; ++i) {
      const Point<2> back = Difference<2>(At(from), At(to));
      uint32_t next = to;
      const auto [begin, end] = beside_.equal_range(to);
      for (auto other = begin; other != end; ++other) {
        if (other->second == from) {
          continue;
        }
        const Point<2> away = Difference<2>(At(other->second), At(to));
        const double cosine = Dot<2>(back, away) / std::sqrt(NormSq<2>(back) * NormSq<2>(away));
        if (cosine > 0.5) {
          return true;
        }
        if (cosine < -1 + kStraight) {
          next = other->second;
        }
      }
      if (next == to) {
        return false;
      }
      from = std::exchange(to, next);
    }
    return false;
  }

  const MeshView& mesh_;
  const std::span<const uint32_t> facets_;
  std::multimap<uint32_t, uint32_t> beside_;
};

// Whether a triangle may break rho, the radius-edge ratio being `ratio`. `is_on_facet`: of vertices.
bool IsExempt(const MeshView& mesh, const FacetLines& lines, const std::vector<bool>& is_on_facet, size_t triangle,
              double ratio) {
  const auto corners = CornersOf(mesh, triangle);
  const Simplex<2> places = PlacesOf(mesh, corners);
  int shortest = 0;
  for (int k = 1; k < 3; ++k) {
    if (DistanceSq<2>(places[k], places[(k + 1) % 3]) < DistanceSq<2>(places[shortest], places[(shortest + 1) % 3])) {
      shortest = k;
    }
  }
  if (is_on_facet[corners[shortest]] && is_on_facet[corners[(shortest + 1) % 3]]) {
    return true;
  }
  if (ratio > std::numbers::sqrt2 * (1 + kRatioTolerance)) {
    return false;
  }
  const Point<2> offset = ExactCircumcentreOffset<2>(places);
  return lines.HaveSmallAngleNear({places[0][0] + offset[0], places[0][1] + offset[1]},
                                  kReach * std::sqrt(NormSq<2>(offset)));
}

absl::Status CheckEdges(const MeshView& mesh, std::span<const uint32_t> facets) {
  std::map<Edge, int> directed;
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    const auto corners = CornersOf(mesh, t);
    for (int k = 0; k < 3; ++k) {
      if (++directed[{corners[k], corners[(k + 1) % 3]}] > 1) {
        return Violation(absl::StrCat("triangle ", t, ": ", NameOf({corners[k], corners[(k + 1) % 3]}),
                                      " has two triangles on one side"));
      }
    }
  }
  std::map<Edge, size_t> is_facet;
  for (size_t f = 0; f < facets.size() / 2; ++f) {
    const Edge edge = {facets[2 * f], facets[2 * f + 1]};
    if (edge.first >= mesh.points.size() / 2 || edge.second >= mesh.points.size() / 2) {
      return Violation(absl::StrCat("facet ", f, ": ", NameOf(edge), " names a vertex that there is not"));
    }
    if (!directed.contains(edge)) {
      return Violation(absl::StrCat("facet ", f, ": ", NameOf(edge), " has no triangle on its left"));
    }
    if (!is_facet.emplace(std::minmax(edge.first, edge.second), f).second) {
      return Violation(absl::StrCat("facet ", f, ": ", NameOf(edge), " is there twice"));
    }
  }
  for (const auto& [edge, count] : directed) {
    if (!directed.contains({edge.second, edge.first}) && !is_facet.contains(std::minmax(edge.first, edge.second))) {
      return Violation(absl::StrCat(NameOf(edge), " has one triangle, and is no facet"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckEmptyCircles(const MeshView& mesh) {
  const PointTree tree(mesh.points);
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    const auto corners = CornersOf(mesh, t);
    const Simplex<2> places = PlacesOf(mesh, corners);
    const Point<2> offset = ExactCircumcentreOffset<2>(places);
    const Point<2> centre = {places[0][0] + offset[0], places[0][1] + offset[1]};
    const double radius = std::sqrt(NormSq<2>(offset));
    std::optional<uint32_t> inside;
    tree.ForEachIn(centre, radius * (1 + kCircleRoom), [&](uint32_t v) {
      if (std::find(corners.begin(), corners.end(), v) == corners.end() &&
          InSphere<2>(places, PointAt<2>(mesh.points, v)).sign == Sign::kPositive) {
        inside = v;
      }
      return !inside.has_value();
    });
    if (inside.has_value()) {
      return Violation(absl::StrCat("triangle ", t, ": vertex ", *inside, " lies inside its circumcircle"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DomainReport> ValidateDomainMesh(const MeshView& mesh, std::span<const uint32_t> facets, double rho) {
  if (mesh.dimension != 2 || facets.size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("a domain has dimension 2 and facets of 2 vertices; the mesh has dimension ", mesh.dimension,
                     " and ", facets.size(), " numbers in its facets"));
  }
  WELLSPACE_RETURN_IF_ERROR(ValidateIndices(mesh));
  WELLSPACE_RETURN_IF_ERROR(ValidateOrientation(mesh));
  WELLSPACE_RETURN_IF_ERROR(CheckEdges(mesh, facets));
  WELLSPACE_RETURN_IF_ERROR(CheckEmptyCircles(mesh));
  DomainReport report;
  if (rho == 0) {
    return report;
  }
  std::vector<bool> is_on_facet(mesh.points.size() / 2);
  for (const uint32_t v : facets) {
    is_on_facet[v] = true;
  }
  const FacetLines lines(mesh, facets);
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    const double ratio = RadiusEdgeRatio<2>(PlacesOf(mesh, CornersOf(mesh, t)));
    if (ratio <= rho * (1 + kRatioTolerance)) {
      continue;
    }
    if (!IsExempt(mesh, lines, is_on_facet, t, ratio)) {
      return Violation(absl::StrCat("triangle ", t, ": circumradius over shortest edge is ", ratio, "; at most ", rho,
                                    " is allowed but at small angles of segments"));
    }
    ++report.exempt;
  }
  return report;
}

namespace {

// Whether facets lead from `from` to `to`, along the segment between them.
bool LeadAlong(const MeshView& mesh, const std::multimap<uint32_t, uint32_t>& beside, uint32_t from, uint32_t to,
               double tolerance) {
  const Point<2> a = PointAt<2>(mesh.points, from);
  const Point<2> along = Difference<2>(PointAt<2>(mesh.points, to), a);
  const double length = std::sqrt(NormSq<2>(along));
  double at = 0;
  for (uint32_t v = from; v != to;) {
    uint32_t next = v;
    double next_at = std::numeric_limits<double>::infinity();
    const auto [begin, end] = beside.equal_range(v);
    for (auto neighbour = begin; neighbour != end; ++neighbour) {
      const Point<2> d = Difference<2>(PointAt<2>(mesh.points, neighbour->second), a);
      const double away = std::abs(along[0] * d[1] - along[1] * d[0]) / length;
      const double t = Dot<2>(along, d) / length;
      if (away <= tolerance && t > at && t < next_at && t <= length + tolerance) {
        next = neighbour->second;
        next_at = t;
      }
    }
    if (next == v) {
      return false;
    }
    v = next;
    at = next_at;
  }
  return true;
}

bool Holds(const Simplex<2>& triangle, const Point<2>& p) {
  return Orientation<2>({triangle[0], triangle[1], p}).sign != Sign::kNegative &&
         Orientation<2>({triangle[1], triangle[2], p}).sign != Sign::kNegative &&
         Orientation<2>({triangle[2], triangle[0], p}).sign != Sign::kNegative;
}

bool IsMeshedAt(const MeshView& mesh, const Point<2>& p) {
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    if (Holds(PlacesOf(mesh, CornersOf(mesh, t)), p)) {
      return true;
    }
  }
  return false;
}

// How many ring segments lie to the left of `p`.
size_t RingsLeftOf(const DomainView& domain, const Point<2>& p) {
  size_t count = 0;
  for (size_t s = 0; s < domain.segments.size() / 2; ++s) {
    const Point<2> a = PointAt<2>(domain.points, domain.segments[2 * s]);
    const Point<2> b = PointAt<2>(domain.points, domain.segments[2 * s + 1]);
    if ((!domain.is_open.empty() && domain.is_open[s] != 0) || (a[1] > p[1]) == (b[1] > p[1])) {
      continue;
    }
    count += a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) < p[0] ? 1 : 0;
  }
  return count;
}

}  // namespace

absl::Status ValidateConformity(const MeshView& mesh, std::span<const uint32_t> facets, const DomainView& domain,
                                double tolerance) {
  std::map<Point<2>, uint32_t> vertex_at;
  for (uint32_t v = 0; v < mesh.points.size() / 2; ++v) {
    vertex_at.emplace(PointAt<2>(mesh.points, v), v);
  }
  std::multimap<uint32_t, uint32_t> beside;
  for (size_t f = 0; f < facets.size(); f += 2) {
    beside.emplace(facets[f], facets[f + 1]);
    beside.emplace(facets[f + 1], facets[f]);
  }
  for (size_t s = 0; s < domain.segments.size() / 2; ++s) {
    const Point<2> a = PointAt<2>(domain.points, domain.segments[2 * s]);
    const Point<2> b = PointAt<2>(domain.points, domain.segments[2 * s + 1]);
    const auto from = vertex_at.find(a);
    const auto to = vertex_at.find(b);
    if (from == vertex_at.end() || to == vertex_at.end()) {
      continue;  // it bounds nothing that is meshed
    }
    if (a != b && !LeadAlong(mesh, beside, from->second, to->second, tolerance) &&
        IsMeshedAt(mesh, {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])})) {
      return Violation(absl::StrCat("segments[", s, "]: no facets lead along it from vertex ", from->second,
                                    " to vertex ", to->second));
    }
  }
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    const Simplex<2> places = PlacesOf(mesh, CornersOf(mesh, t));
    for (size_t h = 0; h < domain.holes.size() / 2; ++h) {
      if (Holds(places, PointAt<2>(domain.holes, h))) {
        return Violation(absl::StrCat("triangle ", t, ": hole ", h, " lies in it"));
      }
    }
    if (domain.is_even_odd) {
      const Point<2> centroid = {(places[0][0] + places[1][0] + places[2][0]) / 3,
                                 (places[0][1] + places[1][1] + places[2][1]) / 3};
      if (RingsLeftOf(domain, centroid) % 2 == 0) {
        return Violation(absl::StrCat("triangle ", t, ": an even number of rings surrounds it"));
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
