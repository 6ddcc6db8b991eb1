// The meeting points of planes, in integers, to which positions of nodes and their error bounds are held.
#ifndef WELLSPACE_TESTS_SUPPORT_EXACT_NODES_H_
#define WELLSPACE_TESTS_SUPPORT_EXACT_NODES_H_

#include <gtest/gtest.h>

#include <array>

#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::test {

// Whether D planes meet in one point.
template <int D>
bool DoMeet(const core::Point<D>& site, const std::array<core::PlaneSource<D>, D>& planes);

// Whether each coordinate of `x` is within a relative error of 2^-bits of that of the point, relative to `site`, where
// the planes meet.
template <int D>
::testing::AssertionResult IsMeetingPointTo(int bits, const core::Point<D>& site,
                                            const std::array<core::PlaneSource<D>, D>& planes, const core::Point<D>& x);

// Whether every node of the cell is within its slack of where its planes meet, and its reach no less than that place is
// away from the site.
template <int D>
::testing::AssertionResult HasNodesWithinSlack(const core::Polytope<D>& cell);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_EXACT_NODES_H_
