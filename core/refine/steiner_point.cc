#include "core/refine/steiner_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

// An off-centre lies on a bisector only if its squared distance from the site is at least this times the edge's.
constexpr double kLeastHeight = 0.5;

template <int D>
SteinerPoint<D> Relative(const Polytope<D>& cell, const Point<D>& x) {
  SteinerPoint<D> point;
  for (int i = 0; i < D; ++i) {
    point.position[i] = cell.site()[i] + x[i];
  }
  point.empty_radius_sq = NormSq<D>(x);
  return point;
}

// Where the segment from `inside` to `outside` leaves a disc.
Point<2> WhereItLeaves(const Point<2>& inside, const Point<2>& outside, const Point<2>& centre, double radius) {
  const Point<2> along = Difference<2>(outside, inside);
  const Point<2> from = Difference<2>(inside, centre);
  const double a = NormSq<2>(along);
  const double b = Dot<2>(along, from);
  const double c = NormSq<2>(from) - radius * radius;
  const double t = std::min(1.0, (std::sqrt(std::max(0.0, b * b - a * c)) - b) / a);
  return {inside[0] + t * along[0], inside[1] + t * along[1]};
}

}  // namespace

template <int D>
double OffCenterFactor(double rho, bool is_at_boundary) {
  if constexpr (D == 2) {
    const double height = rho + std::sqrt(std::max(0.0, rho * rho - 0.25));
    return (is_at_boundary ? 0.85 : 0.996) * std::sqrt(height * height + 0.25) / rho;
  } else if (rho < 1.15) {
    return 1.5;
  } else {
    return D == 3 && is_at_boundary ? 1.25 : 1.1;
  }
}

template <int D>
SteinerPoint<D> OffCenter(const Polytope<D>& cell, int node, int plane, double distance_sq) {
  const Point<D>& x = cell.nodes()[node].x;
  if (NormSq<D>(x) <= distance_sq) {
    return Relative<D>(cell, x);
  }
  const double edge_sq = plane >= 0 ? 2 * cell.plane(plane).offset : std::numeric_limits<double>::infinity();
  if (distance_sq < kLeastHeight * edge_sq) {
    const double t = std::sqrt(distance_sq / NormSq<D>(x));
    Point<D> p = x;
    for (double& coordinate : p) {
      coordinate *= t;
    }
    return Relative<D>(cell, p);
  }
  Point<D> middle;
  Point<D> along;
  for (int i = 0; i < D; ++i) {
    middle[i] = 0.5 * cell.plane(plane).normal[i];
    along[i] = x[i] - middle[i];
  }
  // `along` is in the bisector, so at right angles to `middle`.
  double t = std::sqrt((distance_sq - 0.25 * edge_sq) / NormSq<D>(along));
  // Planes without a node are left out: the point is to depend on nothing but the cell.
  for (const CellNode<D>& on : cell.nodes()) {
    for (const uint16_t j : on.planes) {
      const Plane<D>& bound = cell.plane(j);
      const double slope = Dot<D>(bound.normal, along);
      const double gap = bound.offset - Dot<D>(bound.normal, middle);
      // A wall's normal points up its axis: turned outward here.
      const double outward = bound.kind == PlaneKind::kBisector || bound.face % 2 == 1 ? 1 : -1;
      if (j != plane && outward * gap < 0 && outward * slope < 0) {
        t = std::max(t, gap / slope);
      }
    }
  }
  t = std::min(t, 1.0);
  for (int i = 0; i < D; ++i) {
    middle[i] += t * along[i];
  }
  return Relative<D>(cell, middle);
}

Petal PetalOf(const Polytope<2>& cell, int node, int plane, double top_sq) {
  const Point<2>& u = cell.plane(plane).normal;
  const Point<2> middle = {0.5 * u[0], 0.5 * u[1]};
  const Point<2> up = Difference<2>(cell.nodes()[node].x, middle);
  const double height = std::sqrt(top_sq - 0.5 * cell.plane(plane).offset);
  const double radius = 0.5 * top_sq / height;
  const double t = (height - radius) / std::sqrt(NormSq<2>(up));
  return {{middle[0] + t * up[0], middle[1] + t * up[1]}, radius};
}

SteinerPoint<2> PetalPoint(const Polytope<2>& cell, int node, int plane, double top_sq, double rho) {
  Point<2> x = cell.nodes()[node].x;
  const Point<2>& u = cell.plane(plane).normal;
  const auto [centre, radius] = PetalOf(cell, node, plane, top_sq);
  const auto is_inside = [&, centre = centre, radius = radius](const Point<2>& p) {
    return DistanceSq<2>(p, centre) <= radius * radius;
  };
  const auto is_conforming = [&](const Point<2>& p) {
    const double distance = std::sqrt(NormSq<2>(p));
    return (rho - 1) * (std::sqrt(DistanceSq<2>(p, u)) - distance) <= distance - rho * cell.plane(plane).length;
  };
  Point<2> best = x;
  int from = plane;
  while (is_inside(x)) {
    const CellNode<2>& at = cell.nodes()[node];
    const int k = at.planes[0] == from ? 0 : 1;
    from = at.planes[1 - k];
    node = at.neighbours[k];
    const Point<2>& next = cell.nodes()[node].x;
    const Point<2> end = is_inside(next) ? next : WhereItLeaves(x, next, centre, radius);
    if (cell.plane(from).kind != PlaneKind::kBisector || NormSq<2>(end) < NormSq<2>(x)) {
      break;
    }
    if (NormSq<2>(end) > NormSq<2>(best) && is_conforming(end)) {
      best = end;
    }
    x = next;
  }
  return Relative<2>(cell, best);
}

template <int D>
SteinerPoint<D> EncroachmentPoint(const Polytope<D>& cell, FaceMask site_faces, int face) {
  const unsigned on_face = 1u << face;
  const unsigned opposite = 1u << (face ^ 1);
  std::vector<Point<D>> nodes;
  const auto add = [&](unsigned wanted) {
    for (const CellNode<D>& node : cell.nodes()) {
      if ((cell.FacesOf(node) & wanted) == wanted) {
        nodes.push_back(node.x);
      }
    }
  };
  add(on_face | (site_faces & ~opposite));
  if (nodes.empty()) {  // ties hide the faces of a node
    add(on_face);
  }
  std::sort(nodes.begin(), nodes.end());  // the sum is to depend on nothing but the cell
  Point<D> sum{};
  for (const Point<D>& x : nodes) {
    for (int i = 0; i < D; ++i) {
      sum[i] += x[i];
    }
  }
  for (double& s : sum) {
    s /= static_cast<double>(nodes.size());
  }
  SteinerPoint<D> point = Relative<D>(cell, sum);
  for (int index = 0; index < 2 * D; ++index) {
    if (cell.plane(index).kind == PlaneKind::kFace && cell.plane(index).face == face) {
      point.position[face / 2] = cell.plane(index).source.coordinate;
    }
  }
  return point;
}

template <int D>
SteinerPoint<D> SnapToBoundary(const Box<D>& box, SteinerPoint<D> point) {
  for (int i = 0; i < D; ++i) {
    point.position[i] = std::clamp(point.position[i], box.low[i], box.high[i]);
  }
  while (true) {
    int nearest = -1;
    double nearest_sq = 0.5 * point.empty_radius_sq;
    const FaceMask faces = box.FacesOf(point.position);
    for (int face = 0; face < 2 * D; ++face) {
      const double distance = box.DistanceToFace(point.position, face);
      if (((faces >> face) & 1) == 0 && distance * distance < nearest_sq) {
        nearest_sq = distance * distance;
        nearest = face;
      }
    }
    if (nearest < 0) {
      return point;
    }
    point.position[nearest / 2] = box.FaceCoordinate(nearest);
    point.empty_radius_sq -= nearest_sq;
  }
}

#define WELLSPACE_INSTANTIATE(D)                                                    \
  template double OffCenterFactor<D>(double, bool);                                 \
  template SteinerPoint<D> OffCenter<D>(const Polytope<D>&, int, int, double);      \
  template SteinerPoint<D> EncroachmentPoint<D>(const Polytope<D>&, FaceMask, int); \
  template SteinerPoint<D> SnapToBoundary<D>(const Box<D>&, SteinerPoint<D>);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
