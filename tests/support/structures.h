// Query structures as tests want them.
#ifndef WELLSPACE_TESTS_SUPPORT_STRUCTURES_H_
#define WELLSPACE_TESTS_SUPPORT_STRUCTURES_H_

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/base/run_context.h"
#include "core/voronoi/query_structure.h"
#include "tests/support/brute_force.h"

namespace wellspace::test {

// The structure of `points`, sorted as MortonSorted gives them, in `box`; a failure of the test where there is none.
template <int D>
core::QueryStructure<D> MakeStructure(const core::Box<D>& box, const std::vector<core::Point<D>>& points) {
  constexpr uint64_t kManyLeaves = 10'000'000;
  core::RunContext context;
  core::QueryStructure<D> structure;
  const absl::Status made =
      structure.Initialize(core::MortonGrid<D>(box), {points.begin(), points.end()}, kManyLeaves, 1, context);
  EXPECT_TRUE(made.ok()) << made;
  return structure;
}

// The same in the unit box.
template <int D>
core::QueryStructure<D> MakeStructure(const std::vector<core::Point<D>>& points) {
  return MakeStructure<D>(UnitBox<D>(), points);
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_STRUCTURES_H_
