#include "tests/support/brute_force.h"

#include <algorithm>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/dimensions.h"
#include "core/tree/morton.h"
#include "tests/support/bareiss.h"
#include "tests/support/clouds.h"

namespace wellspace::test {
namespace {

using boost::multiprecision::cpp_int;
using core::Box;
using core::CellNode;
using core::Plane;
using core::PlaneKind;
using core::Point;
using core::Polytope;
using core::QueryStructure;
using core::Sign;
using core::VertexId;

constexpr unsigned kBitsPerRank = 64;

Sign SignOf(const cpp_int& value) { return static_cast<Sign>(value.sign()); }

// normal . x <= offset, relative to the site; a wall may have either side of it inside.
template <int D>
struct ExactPlane {
  std::array<cpp_int, D> normal;
  cpp_int offset;
  bool keeps_above = false;
};

// A point as numerators over one positive denominator, by Cramer's rule.
template <int D>
struct HomogeneousPoint {
  std::array<cpp_int, D> numerator;
  cpp_int denominator;
};

template <int D>
std::optional<HomogeneousPoint<D>> Meet(const std::array<const ExactPlane<D>*, D>& planes) {
  std::array<std::array<cpp_int, D>, D> normals;
  for (int j = 0; j < D; ++j) {
    normals[j] = planes[j]->normal;
  }
  HomogeneousPoint<D> x;
  x.denominator = BareissDeterminant<D>(normals);
  if (x.denominator == 0) {
    return std::nullopt;
  }
  const int sign = x.denominator.sign();
  x.denominator *= sign;
  for (int k = 0; k < D; ++k) {
    auto replaced = normals;
    for (int j = 0; j < D; ++j) {
      replaced[j][k] = planes[j]->offset;
    }
    x.numerator[k] = sign * BareissDeterminant<D>(replaced);
  }
  return x;
}

// kPositive where the plane cuts `x` off.
template <int D>
Sign SideOf(const ExactPlane<D>& plane, const HomogeneousPoint<D>& x) {
  cpp_int excess = -plane.offset * x.denominator;
  for (int k = 0; k < D; ++k) {
    excess += plane.normal[k] * x.numerator[k];
  }
  const Sign side = SignOf(excess);
  return plane.keeps_above ? -side : side;
}

// The planes of the cell of one site: one for each vertex (the site's own is meaningless), then the faces of the box.
// All offsets are multiplied by 2 * 2^shift, so that the weights are integers; hence so are all positions.
template <int D>
struct ExactPlanes {
  std::vector<ExactPlane<D>> planes;
  unsigned shift = 0;
};

template <int D>
ExactPlanes<D> PlanesOf(std::span<const IntegerPoint<D>> vertices, size_t site, const IntegerPoint<D>& low,
                        const IntegerPoint<D>& high, bool weighted) {
  ExactPlanes<D> out;
  out.shift = kBitsPerRank * static_cast<unsigned>(vertices.size());
  const auto weight_of = [&](const IntegerPoint<D>& p) -> cpp_int {
    if (!weighted) {
      return 0;
    }
    const auto rank =
        1 + std::count_if(vertices.begin(), vertices.end(), [&](const IntegerPoint<D>& q) { return q > p; });
    return cpp_int(1) << (out.shift - kBitsPerRank * static_cast<unsigned>(rank));
  };
  for (const IntegerPoint<D>& p : vertices) {
    ExactPlane<D> plane;
    int64_t length_sq = 0;
    for (int k = 0; k < D; ++k) {
      const int64_t w = p[k] - vertices[site][k];
      plane.normal[k] = w;
      length_sq += w * w;
    }
    plane.offset = (cpp_int(length_sq) << out.shift) + weight_of(vertices[site]) - weight_of(p);
    out.planes.push_back(plane);
  }
  for (int face = 0; face < 2 * D; ++face) {
    const int axis = face / 2;
    ExactPlane<D> plane;
    plane.normal[axis] = 1;
    plane.offset = cpp_int(2 * ((face % 2 == 0 ? low : high)[axis] - vertices[site][axis])) << out.shift;
    plane.keeps_above = face % 2 == 0;
    out.planes.push_back(plane);
  }
  return out;
}

// Calls f for every ascending choice of D numbers below n.
template <int D, typename F>
void ForEachChoice(size_t n, F&& f, std::array<size_t, D> chosen = {}, int count = 0) {
  if (count == D) {
    f(chosen);
    return;
  }
  for (chosen[count] = count == 0 ? 0 : chosen[count - 1] + 1; chosen[count] < n; ++chosen[count]) {
    ForEachChoice<D>(n, f, chosen, count + 1);
  }
}

// The faces of dimension k of a simple polytope: each lies on D - k planes, and on those together no other face of this
// dimension does.
template <int D>
size_t CountFaces(const Polytope<D>& cell, int k) {
  std::vector<NodeName<D>> faces;
  for (const CellNode<D>& node : cell.nodes()) {
    NodeName<D> planes;
    std::copy(node.planes.begin(), node.planes.end(), planes.begin());
    std::sort(planes.begin(), planes.end());
    for (unsigned subset = 0; subset < (1u << D); ++subset) {
      if (std::popcount(subset) != D - k) {
        continue;
      }
      NodeName<D> face{};
      for (int i = 0, count = 0; i < D; ++i) {
        if (((subset >> i) & 1) != 0) {
          face[count++] = planes[i];
        }
      }
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end());
  return static_cast<size_t>(std::unique(faces.begin(), faces.end()) - faces.begin());
}

template <int D>
PlaneName NameOf(const Plane<D>& plane) {
  return plane.kind == PlaneKind::kBisector ? 2 * D + Index(plane.vertex) : plane.face;
}

}  // namespace

template <int D>
ExactCell<D> ComputeExactCell(std::span<const IntegerPoint<D>> vertices, size_t site, const IntegerPoint<D>& low,
                              const IntegerPoint<D>& high, bool weighted) {
  const ExactPlanes<D> exact = PlanesOf<D>(vertices, site, low, high, weighted);
  const std::vector<ExactPlane<D>>& planes = exact.planes;  // clang 14 captures no structured bindings
  ExactCell<D> cell;
  ForEachChoice<D>(planes.size(), [&](const std::array<size_t, D>& chosen) {
    if (std::find(chosen.begin(), chosen.end(), site) != chosen.end()) {
      return;
    }
    std::array<const ExactPlane<D>*, D> meeting;
    for (int j = 0; j < D; ++j) {
      meeting[j] = &planes[chosen[j]];
    }
    const auto x = Meet<D>(meeting);
    if (!x.has_value()) {
      return;
    }
    for (size_t other = 0; other < planes.size(); ++other) {
      if (other != site && SideOf<D>(planes[other], *x) == Sign::kPositive) {
        return;
      }
    }
    NodeName<D> name;
    Point<D> position;
    for (int k = 0; k < D; ++k) {
      name[k] = static_cast<PlaneName>(chosen[k] < vertices.size() ? 2 * D + chosen[k] : chosen[k] - vertices.size());
      // Cut off after 80 bits behind the point.
      const cpp_int fixed = (x->numerator[k] << 80) / (x->denominator << (exact.shift + 1));
      position[k] = std::ldexp(static_cast<double>(fixed), -80) + 0.0;
    }
    std::sort(name.begin(), name.end());
    cell.names.insert(name);
    cell.positions.insert(position);
  });
  return cell;
}

template <int D>
std::optional<Sign> ExactSide(std::span<const IntegerPoint<D>> vertices, size_t site,
                              const std::array<size_t, D>& planes, size_t u, const IntegerPoint<D>& low,
                              const IntegerPoint<D>& high, bool weighted) {
  const ExactPlanes<D> all = PlanesOf<D>(vertices, site, low, high, weighted);
  std::array<const ExactPlane<D>*, D> meeting;
  for (int j = 0; j < D; ++j) {
    meeting[j] = &all.planes[planes[j]];
  }
  const auto x = Meet<D>(meeting);
  return x.has_value() ? std::optional(SideOf<D>(all.planes[u], *x)) : std::nullopt;
}

template <int D>
std::set<NodeName<D>> NamesOf(const Polytope<D>& cell) {
  std::set<NodeName<D>> names;
  for (const CellNode<D>& node : cell.nodes()) {
    NodeName<D> name;
    for (int k = 0; k < D; ++k) {
      name[k] = NameOf<D>(cell.plane(node.planes[k]));
    }
    std::sort(name.begin(), name.end());
    names.insert(name);
  }
  return names;
}

template <int D>
::testing::AssertionResult IsSimplePolytope(const Polytope<D>& cell) {
  const auto nodes = cell.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (std::set<uint16_t>(nodes[i].planes.begin(), nodes[i].planes.end()).size() != D) {
      return ::testing::AssertionFailure() << "node " << i << " has a plane twice";
    }
    for (int k = 0; k < D; ++k) {
      const size_t j = nodes[i].neighbours[k];
      if (j >= nodes.size() || j == i) {
        return ::testing::AssertionFailure() << "node " << i << " has the neighbour " << j;
      }
      std::vector<uint16_t> shared;
      for (int l = 0; l < D; ++l) {
        if (std::find(nodes[j].planes.begin(), nodes[j].planes.end(), nodes[i].planes[l]) != nodes[j].planes.end()) {
          shared.push_back(nodes[i].planes[l]);
        }
      }
      const bool leaves_k = std::find(shared.begin(), shared.end(), nodes[i].planes[k]) == shared.end();
      const auto& back = nodes[j].neighbours;
      if (shared.size() != D - 1 || !leaves_k || std::count(back.begin(), back.end(), i) != 1) {
        return ::testing::AssertionFailure() << "nodes " << i << " and " << j << " are no edge";
      }
    }
  }
  int64_t alternating = 0;
  for (int k = 0; k < D; ++k) {
    const auto count = static_cast<int64_t>(CountFaces<D>(cell, k));
    alternating += k % 2 == 0 ? count : -count;
  }
  if (alternating != (D % 2 == 0 ? 0 : 2)) {
    return ::testing::AssertionFailure() << "the alternating sum of the numbers of faces is " << alternating;
  }
  std::vector<size_t> reached = {0};
  std::vector<bool> is_reached(nodes.size());
  is_reached[0] = true;
  for (size_t i = 0; i < reached.size(); ++i) {
    for (const size_t j : nodes[reached[i]].neighbours) {
      if (!is_reached[j]) {
        is_reached[j] = true;
        reached.push_back(j);
      }
    }
  }
  if (reached.size() != nodes.size()) {
    return ::testing::AssertionFailure() << "only " << reached.size() << " of " << nodes.size()
                                         << " nodes hang together";
  }
  return ::testing::AssertionSuccess();
}

template <int D>
::testing::AssertionResult HaveSameNodes(const Polytope<D>& a, const Polytope<D>& b) {
  const double reach = std::sqrt(std::max(a.reach_sq(), b.reach_sq()));
  const auto lacks = [reach](const Polytope<D>& from, const Polytope<D>& to) -> const CellNode<D>* {
    for (const CellNode<D>& node : from.nodes()) {
      const auto is_near = [&](const CellNode<D>& other) {
        const double tolerance = std::min(node.slack + other.slack + 1e-12 * reach, 1e-6 * reach);
        return core::DistanceSq<D>(node.x, other.x) <= tolerance * tolerance;
      };
      if (std::none_of(to.nodes().begin(), to.nodes().end(), is_near)) {
        return &node;
      }
    }
    return nullptr;
  };
  for (const bool forward : {true, false}) {
    if (const CellNode<D>* node = forward ? lacks(a, b) : lacks(b, a); node != nullptr) {
      return ::testing::AssertionFailure() << "the " << (forward ? "first" : "second") << " cell alone has the node "
                                           << ::testing::PrintToString(node->x) << " with slack " << node->slack;
    }
  }
  return ::testing::AssertionSuccess();
}

template <int D>
::testing::AssertionResult HasEmptyBalls(const QueryStructure<D>& structure, VertexId v, const Polytope<D>& cell) {
  const Point<D>& site = structure.point(v);
  const auto power = [](const Point<D>& w, const Point<D>& x) {  // (|w - x|^2 - |x|^2) / |w|: how far the bisector is
    long double along = 0;
    long double length_sq = 0;
    for (int k = 0; k < D; ++k) {
      along += static_cast<long double>(w[k]) * x[k];
      length_sq += static_cast<long double>(w[k]) * w[k];
    }
    return static_cast<double>((0.5L * length_sq - along) / std::sqrt(length_sq));
  };
  for (const CellNode<D>& node : cell.nodes()) {
    const double reach = std::sqrt(cell.reach_sq());
    const double tolerance = std::min(node.slack, 1e-6 * reach) + 1e-14 * reach;
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      const double gap = plane.kind == PlaneKind::kBisector
                             ? power(core::Difference<D>(structure.point(plane.vertex), site), node.x)
                             : plane.source.coordinate - site[plane.source.axis] - node.x[plane.source.axis];
      if (!(std::abs(gap) <= tolerance)) {
        return ::testing::AssertionFailure() << ::testing::PrintToString(node.x) << " is " << gap << " off its plane";
      }
    }
    for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
      if (VertexId{u} == v) {
        continue;
      }
      const Point<D> w = core::Difference<D>(structure.point(VertexId{u}), site);
      if (!(power(w, node.x) >= -tolerance - 1e-14 * std::sqrt(core::NormSq<D>(w)))) {
        return ::testing::AssertionFailure() << "vertex " << u << " is in the ball about the node "
                                             << ::testing::PrintToString(node.x) << " of vertex " << Index(v);
      }
    }
  }
  return ::testing::AssertionSuccess();
}

template <int D>
void CutByAll(const QueryStructure<D>& structure, VertexId v, const Box<D>& bounds,
              const std::array<PlaneKind, 2 * D>& kinds, core::TieRule rule, uint64_t seed, Polytope<D>& cell) {
  std::vector<uint32_t> order(structure.vertex_count());
  std::iota(order.begin(), order.end(), 0);
  SplitMix64 random(seed);
  for (size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[random.Below(i)]);
  }
  cell.Reset(structure.point(v), bounds, kinds, rule);
  for (const uint32_t u : order) {
    if (VertexId{u} != v) {
      cell.Cut(VertexId{u}, structure.point(VertexId{u}));
    }
  }
}

template <int D>
void CutByAllInBox(const QueryStructure<D>& structure, VertexId v, Polytope<D>& cell, core::TieRule rule) {
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  CutByAll<D>(structure, v, structure.box(), kinds, rule, Index(v), cell);
}

template <int D>
double NearestDistanceSq(const QueryStructure<D>& structure, VertexId v) {
  double nearest = std::numeric_limits<double>::infinity();
  for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
    if (VertexId{u} != v) {
      nearest = std::min(nearest, core::DistanceSq<D>(structure.point(VertexId{u}), structure.point(v)));
    }
  }
  return nearest;
}

template <int D>
double LocalFeatureSize(const Box<D>& box, const std::vector<Point<D>>& points, const Point<D>& x) {
  double nearest = std::numeric_limits<double>::infinity();
  double second = nearest;
  double with_face = nearest;
  for (const Point<D>& p : points) {
    const double distance = std::sqrt(core::DistanceSq<D>(p, x));
    second = std::min(second, std::max(distance, nearest));
    nearest = std::min(nearest, distance);
    for (int face = 0; face < 2 * D; ++face) {
      if (((box.FacesOf(p) >> face) & 1) == 0) {
        with_face = std::min(with_face, std::max(distance, box.DistanceToFace(x, face)));
      }
    }
  }
  return std::min(second, with_face);
}

template <int D>
std::vector<Point<D>> ToPoints(std::span<const double> cloud) {
  std::vector<Point<D>> points(cloud.size() / D);
  for (size_t i = 0; i < cloud.size(); ++i) {
    points[i / D][i % D] = cloud[i];
  }
  return points;
}

template <int D>
std::vector<Point<D>> MortonSorted(const core::MortonGrid<D>& grid, std::vector<Point<D>> points) {
  std::stable_sort(points.begin(), points.end(), [&](const Point<D>& a, const Point<D>& b) {
    return core::MortonLess<D>(grid.CubeOf(a), grid.CubeOf(b));
  });
  points.erase(std::unique(points.begin(), points.end(),
                           [&](const Point<D>& a, const Point<D>& b) { return grid.CubeOf(a) == grid.CubeOf(b); }),
               points.end());
  return points;
}

template <int D>
std::vector<Point<D>> MortonSorted(const Box<D>& box, std::vector<Point<D>> points) {
  return MortonSorted<D>(core::MortonGrid<D>(box), std::move(points));
}

template <int D>
std::vector<Point<D>> SortedCloud(std::string_view kind, size_t n) {
  return MortonSorted<D>(UnitBox<D>(), ToPoints<D>(MakeCloud(kind, D, n)));
}

#define WELLSPACE_INSTANTIATE(D)                                                                                    \
  template ExactCell<D> ComputeExactCell<D>(std::span<const IntegerPoint<D>>, size_t, const IntegerPoint<D>&,       \
                                            const IntegerPoint<D>&, bool);                                          \
  template std::set<NodeName<D>> NamesOf<D>(const Polytope<D>&);                                                    \
  template ::testing::AssertionResult IsSimplePolytope<D>(const Polytope<D>&);                                      \
  template ::testing::AssertionResult HaveSameNodes<D>(const Polytope<D>&, const Polytope<D>&);                     \
  template ::testing::AssertionResult HasEmptyBalls<D>(const QueryStructure<D>&, VertexId, const Polytope<D>&);     \
  template void CutByAll<D>(const QueryStructure<D>&, VertexId, const Box<D>&, const std::array<PlaneKind, 2 * D>&, \
                            core::TieRule, uint64_t, Polytope<D>&);                                                 \
  template void CutByAllInBox<D>(const QueryStructure<D>&, VertexId, Polytope<D>&, core::TieRule);                  \
  template double NearestDistanceSq<D>(const QueryStructure<D>&, VertexId);                                         \
  template double LocalFeatureSize<D>(const Box<D>&, const std::vector<Point<D>>&, const Point<D>&);                \
  template std::vector<Point<D>> ToPoints<D>(std::span<const double>);                                              \
  template std::vector<Point<D>> MortonSorted<D>(const core::MortonGrid<D>&, std::vector<Point<D>>);                \
  template std::vector<Point<D>> MortonSorted<D>(const Box<D>&, std::vector<Point<D>>);                             \
  template std::vector<Point<D>> SortedCloud<D>(std::string_view, size_t);                                          \
  template std::optional<Sign> ExactSide<D>(std::span<const IntegerPoint<D>>, size_t, const std::array<size_t, D>&, \
                                            size_t, const IntegerPoint<D>&, const IntegerPoint<D>&, bool);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::test
