// Slow and independent ways to the results that the core computes fast, for the tests of predicates, cells and queries.
#ifndef WELLSPACE_TESTS_SUPPORT_BRUTE_FORCE_H_
#define WELLSPACE_TESTS_SUPPORT_BRUTE_FORCE_H_

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/cell/polytope.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/tree/morton.h"
#include "core/voronoi/query_structure.h"
#include "tests/support/dimensions.h"

namespace wellspace::test {

using Dimensions = ::testing::Types<Dimension<2>, Dimension<3>>;

// Coordinates below 2^10, so that the weights below are small enough to be as good as infinitesimal.
template <int D>
using IntegerPoint = std::array<int64_t, D>;

template <int D>
core::Point<D> ToPoint(const IntegerPoint<D>& p) {
  core::Point<D> out;
  for (int k = 0; k < D; ++k) {
    out[k] = static_cast<double>(p[k]);
  }
  return out;
}

// The name of one plane of a cell: the face of the box it begins with, or 2 D + the vertex's number.
using PlaneName = uint32_t;
template <int D>
using NodeName = std::array<PlaneName, D>;  // ascending

// A cell by its definition: every D planes that meet, kept where no other plane cuts their meeting point off.
template <int D>
struct ExactCell {
  std::set<NodeName<D>> names;
  std::set<core::Point<D>> positions;  // relative to the site; one for nodes in one place
};

// The cell of vertices[site] in the box [low, high], by all D-subsets of planes, in integers of any size. With
// `weighted`, in the power diagram where vertex k has the weight 2^(-64 r), r = 1, 2, ... its rank by coordinates,
// greatest first: for such coordinates that is the perturbation of TieRule::kPerturb with a number for its
// infinitesimal.
//
// REQUIRES:   distinct vertices in the box; all coordinates in [-2^10, 2^10].
template <int D>
ExactCell<D> ComputeExactCell(std::span<const IntegerPoint<D>> vertices, size_t site, const IntegerPoint<D>& low,
                              const IntegerPoint<D>& high, bool weighted);

// The same power diagram's answer to DecideCut: on which side of the bisector of vertices[site] and vertices[u] the
// node of `planes` lies, each a number of a vertex or, from vertices.size() on, a face of the box [low, high]; nothing
// where the planes do not meet in one point.
template <int D>
std::optional<core::Sign> ExactSide(std::span<const IntegerPoint<D>> vertices, size_t site,
                                    const std::array<size_t, D>& planes, size_t u, const IntegerPoint<D>& low,
                                    const IntegerPoint<D>& high, bool weighted);

// The names of a cell's nodes.
template <int D>
std::set<NodeName<D>> NamesOf(const core::Polytope<D>& cell);

// Invariant (1) of Polytope: a graph of a simple polytope, connected, whose faces obey the formula of Euler and
// Poincare.
template <int D>
::testing::AssertionResult IsSimplePolytope(const core::Polytope<D>& cell);

// Whether both cells have their nodes in the same places, up to the nodes' own slack.
template <int D>
::testing::AssertionResult HaveSameNodes(const core::Polytope<D>& a, const core::Polytope<D>& b);

// Guarantees (1) and (2) of ClippedVoronoi for any cell of vertex `v`, checked against all vertices: every node is on
// its D planes, and no vertex is nearer to it than its site is, up to its slack.
template <int D>
::testing::AssertionResult HasEmptyBalls(const core::QueryStructure<D>& structure, core::VertexId v,
                                         const core::Polytope<D>& cell);

// The cell of `v` inside `bounds` cut by all vertices, in an order drawn from `seed`.
template <int D>
void CutByAll(const core::QueryStructure<D>& structure, core::VertexId v, const core::Box<D>& bounds,
              const std::array<core::PlaneKind, 2 * D>& kinds, core::TieRule rule, uint64_t seed,
              core::Polytope<D>& cell);

// The whole cell of `v` in the box of the structure.
template <int D>
void CutByAllInBox(const core::QueryStructure<D>& structure, core::VertexId v, core::Polytope<D>& cell,
                   core::TieRule rule = core::TieRule::kKeep);

// The squared distance from `v` to its nearest vertex, by a look at each.
template <int D>
double NearestDistanceSq(const core::QueryStructure<D>& structure, core::VertexId v);

// The least r such that two features are within r of x: two points, or a point and a face of the box that it does not
// lie on.
template <int D>
double LocalFeatureSize(const core::Box<D>& box, const std::vector<core::Point<D>>& points, const core::Point<D>& x);

// A row-major cloud as points.
template <int D>
std::vector<core::Point<D>> ToPoints(std::span<const double> cloud);

// The points of a cloud as QueryStructure wants them: sorted in the Morton order of `grid`, of several in one cube of
// it the first.
template <int D>
std::vector<core::Point<D>> MortonSorted(const core::MortonGrid<D>& grid, std::vector<core::Point<D>> points);

// The same on MortonGrid(box).
template <int D>
std::vector<core::Point<D>> MortonSorted(const core::Box<D>& box, std::vector<core::Point<D>> points);

// MakeCloud in the unit box, sorted like that.
template <int D>
std::vector<core::Point<D>> SortedCloud(std::string_view kind, size_t n);

template <int D>
core::Box<D> UnitBox() {
  core::Box<D> box;
  box.low.fill(0);
  box.high.fill(1);
  return box;
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_BRUTE_FORCE_H_
