// Refinements of hard clouds under the eyes of a GuaranteeChecker, for the tests of guarantees and their long versions.
#ifndef WELLSPACE_TESTS_CORE_GUARANTEE_RUNS_H_
#define WELLSPACE_TESTS_CORE_GUARANTEE_RUNS_H_

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/refine/refine.h"
#include "tests/core/guarantees.h"
#include "tests/support/adversarial_clouds.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"

namespace wellspace::test {

// The box of a cloud. unit: the unit box; touching: the cloud's bounding box; margin: that with a quarter around; long:
// the cloud stretched by 100 along its last axis; flat: by 10 along all the others.
inline constexpr std::array<std::string_view, 5> kShapes = {"unit", "touching", "margin", "long", "flat"};

template <int D>
struct Input {
  core::Box<D> box;
  std::vector<core::Point<D>> points;
};

template <int D>
Input<D> MakeInput(std::string_view kind, std::string_view shape, size_t n, uint64_t seed) {
  std::vector<core::Point<D>> points = AdversarialCloud<D>(kind, n, seed);
  core::Box<D> box = UnitBox<D>();
  if (shape == "touching" || shape == "margin") {
    box = BoxAround<D>(points, shape == "margin" ? 0.25 : 0.0);
  }
  for (int k = 0; k < D; ++k) {
    const double stretch = shape == "long" && k == D - 1 ? 100 : shape == "flat" && k < D - 1 ? 10 : 1;
    box.high[k] = stretch > 1 ? stretch : box.high[k];
    for (core::Point<D>& p : points) {
      p[k] *= stretch;
    }
  }
  return {box, Accepted<D>(box, points)};
}

// All generators: those of clouds.h and the adversarial ones.
inline std::vector<std::string_view> AllGenerators() {
  std::vector<std::string_view> kinds = AllKinds();
  kinds.insert(kinds.end(), kAdversarialKinds.begin(), kAdversarialKinds.end());
  return kinds;
}

// The smallest rho for which refinement ends whatever the input.
template <int D>
double LeastRho() {
  return std::pow(2.0, 0.5 * (D - 1));
}

// The figures of a run, and its end.
struct Outcome {
  absl::Status status;
  uint64_t before = 0;  // points and corners
  uint64_t leaves = 0;  // of the tree over them
  uint64_t vertices = 0;
};

// Refines `input` with at most `multiple` times as many vertices as there are points, corners and leaves of the tree
// over them.
template <int D>
Outcome RefineInput(const Input<D>& input, const core::MeshCriteria<D>& criteria, double multiple,
                    const std::function<void(const core::QueryStructure<D>&)>& begin = nullptr,
                    const core::RefinementObserver<D>& observer = nullptr) {
  core::RunContext context;
  core::QueryStructure<D> structure;
  Outcome outcome;
  outcome.status = structure.Initialize(core::MortonGrid<D>(input.box), {input.points.begin(), input.points.end()},
                                        10'000'000, 1, context);
  if (!outcome.status.ok()) {
    return outcome;
  }
  outcome.before = structure.vertex_count();
  outcome.leaves = structure.tree().leaf_count();
  if (begin) {
    begin(structure);
  }
  const double budget = multiple * static_cast<double>(outcome.before + outcome.leaves);
  core::BoxRefinement<D> refinement(structure, LeastSeparation<D>(input.box) / 16);
  outcome.status = refinement.Run(criteria, static_cast<uint64_t>(budget), 2, context, observer);
  outcome.vertices = structure.vertex_count();
  return outcome;
}

inline constexpr std::array<core::Criterion, 2> kCriteria = {core::Criterion::kRadiusEdge,
                                                             core::Criterion::kWellSpaced};

inline std::string Name(core::Criterion criterion) {
  return criterion == core::Criterion::kRadiusEdge ? "radius-edge" : "well-spaced";
}

// No mesh of these clouds takes more vertices for each point, corner of the box and leaf of the tree over them.
// Measured, at LeastRho: at most 4 radius-edge, 12.2 well-spaced, both of a handful of points.
inline constexpr double kBudget = 25;

// Refines under the eyes of a checker.
template <int D>
typename GuaranteeChecker<D>::Seen ExpectGuarantees(const Input<D>& input, const core::MeshCriteria<D>& criteria,
                                                    int stride) {
  std::optional<GuaranteeChecker<D>> checker;
  const Outcome outcome = RefineInput<D>(
      input, criteria, kBudget,
      [&](const core::QueryStructure<D>& before) { checker.emplace(before, criteria, stride); },
      [&](const core::QueryStructure<D>& structure, const core::Insertion& insertion) {
        checker->Observe(structure, insertion);
      });
  EXPECT_TRUE(outcome.status.ok()) << outcome.status;
  EXPECT_EQ(checker->violation(), "");
  return checker->seen();
}

// Definition 1 and the size bounds at each insertion; all of (2), by brute force, now and then.
template <int D>
void ExpectGuaranteesOfAll(core::Criterion criterion, std::string_view shape, double rho, size_t n, uint64_t seed) {
  int away = 0;
  int on_faces = 0;
  int orders = 0;
  for (const std::string_view kind : AllGenerators()) {
    SCOPED_TRACE(std::string(kind) + " " + std::string(shape) + " " + Name(criterion) + " " + std::to_string(rho));
    const Input<D> input = MakeInput<D>(kind, shape, n, seed);
    const auto seen = ExpectGuarantees<D>(input, {.criterion = criterion, .rho = rho, .sizes = {}}, 83);
    away += seen.away;
    on_faces += seen.on_faces;
    orders += seen.orders;
  }
  EXPECT_GT(away, shape == "touching" ? 10 : 200);
  EXPECT_GT(on_faces, 200);
  EXPECT_GT(orders, 5);
}

// Whether the refinement of every generator's cloud ends within the budget.
template <int D>
void ExpectItEnds(core::Criterion criterion, double rho, size_t n, uint64_t seed, std::string_view shape) {
  for (const std::string_view kind : AllGenerators()) {
    SCOPED_TRACE(std::string(kind) + " " + std::string(shape) + " " + Name(criterion) + " rho " + std::to_string(rho) +
                 " n " + std::to_string(n) + " seed " + std::to_string(seed));
    const Outcome outcome =
        RefineInput<D>(MakeInput<D>(kind, shape, n, seed), {.criterion = criterion, .rho = rho, .sizes = {}}, kBudget);
    ASSERT_TRUE(outcome.status.ok()) << outcome.status << " of " << outcome.before << " points and corners, "
                                     << outcome.leaves << " leaves";
  }
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_GUARANTEE_RUNS_H_
