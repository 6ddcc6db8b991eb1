// Domains in the plane, made by hand.
#ifndef WELLSPACE_TESTS_CORE_DOMAIN_INPUT_H_
#define WELLSPACE_TESTS_CORE_DOMAIN_INPUT_H_

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/geometry/point.h"
#include "core/meshers/mesher.h"
#include "tests/support/clouds.h"

namespace wellspace::test {

// Points and segments with all that is said of them.
struct DomainInput {
  std::vector<double> points;
  std::vector<uint32_t> ends;
  std::vector<int32_t> markers{};
  std::vector<core::FaceSeed> seeds{};
  core::FaceRule faces = core::FaceRule::kHoles;
  core::CrossingRule crossings = core::CrossingRule::kRefuse;
  core::MeshParameters parameters{.dimension = 2};
  std::vector<uint32_t> groups{};
  double snap_distance = 0;

  DomainInput& Ring(const std::vector<core::Point<2>>& corners, int32_t marker = 0) {
    const auto first = static_cast<uint32_t>(points.size() / 2);
    const auto count = static_cast<uint32_t>(corners.size());
    for (uint32_t i = 0; i < count; ++i) {
      points.insert(points.end(), corners[i].begin(), corners[i].end());
      ends.insert(ends.end(), {first + i, first + (i + 1) % count});
      markers.push_back(marker);
    }
    return *this;
  }
  DomainInput& Circle(const core::Point<2>& centre, double radius, int count, int32_t marker = 0) {
    std::vector<core::Point<2>> corners;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      corners.push_back({centre[0] + radius * std::cos(angle), centre[1] + radius * std::sin(angle)});
    }
    return Ring(corners, marker);
  }

  DomainInput& Segment(const core::Point<2>& a, const core::Point<2>& b, int32_t marker = 0) {
    const auto first = static_cast<uint32_t>(points.size() / 2);
    points.insert(points.end(), {a[0], a[1], b[0], b[1]});
    ends.insert(ends.end(), {first, first + 1});
    markers.push_back(marker);
    return *this;
  }

  core::Features features() const {
    core::Features made;
    made.ends = ends;
    made.markers = markers;
    made.seeds = seeds;
    made.faces = faces;
    made.crossings = crossings;
    made.groups = groups;
    made.snap_distance = snap_distance;
    return made;
  }
  absl::StatusOr<core::Mesh> Make() const {
    core::RunContext context;
    return core::MeshPoints(parameters, {points, features()}, context);
  }
  std::unique_ptr<core::Mesher> Create() const {
    core::RunContext context;
    absl::StatusOr<std::unique_ptr<core::Mesher>> mesher =
        core::Mesher::Create(parameters, {points, features()}, context);
    EXPECT_TRUE(mesher.ok()) << mesher.status();
    return *std::move(mesher);
  }
};

// Random segments between points of a small grid, which cross and touch; in a box with room around them.
inline DomainInput SegmentsOnASmallGrid(SplitMix64& random) {
  DomainInput input;
  input.faces = core::FaceRule::kBox;
  input.crossings = core::CrossingRule::kSplit;
  input.parameters.domain_low = {-1, -1};
  input.parameters.domain_high = {9, 9};
  const uint64_t size = 2 + random.Below(7);
  const size_t count = 1 + random.Below(8);
  for (size_t i = 0; i < 2 * count; ++i) {
    input.points.push_back(static_cast<double>(random.Below(size)));
    input.points.push_back(static_cast<double>(random.Below(size)));
    input.ends.push_back(static_cast<uint32_t>(i));
  }
  return input;
}

inline core::Point<2> At(const core::Mesh& mesh, uint32_t v) { return core::PointAt<2>(mesh.points, v); }

// Checks that each of the points that were `given`, if it is meshed, is a vertex where it was.
inline void ExpectPointsKept(const std::vector<double>& given, const core::Mesh& mesh) {
  ASSERT_EQ(mesh.input_vertex.size(), given.size() / 2);
  for (size_t i = 0; i < mesh.input_vertex.size(); ++i) {
    if (mesh.input_vertex[i] != core::kNoOutput) {
      EXPECT_EQ(At(mesh, mesh.input_vertex[i]), core::PointAt<2>(given, i)) << i;
    }
  }
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_DOMAIN_INPUT_H_
