// Surfaces are told with all that is wrong with them; whatever their order, their scale and their threads.
#include "core/input/surface_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace {

// The bytes on the heap, and the most of them since the last question.
std::atomic<int64_t> held_bytes = 0;
std::atomic<int64_t> most_bytes = 0;

void* Counted(void* block) {
  if (block == nullptr) {
    throw std::bad_alloc();
  }
  const int64_t now = held_bytes += static_cast<int64_t>(malloc_usable_size(block));
  int64_t most = most_bytes;
  while (most < now && !most_bytes.compare_exchange_weak(most, now)) {
  }
  return block;
}

void Release(void* block) {
  held_bytes -= static_cast<int64_t>(malloc_usable_size(block));
  std::free(block);
}

}  // namespace

void* operator new(size_t size) { return Counted(std::malloc(size)); }
void* operator new(size_t size, std::align_val_t align) {
  const auto step = static_cast<size_t>(align);
  return Counted(std::aligned_alloc(step, (size + step - 1) / step * step));
}
void operator delete(void* block) noexcept { Release(block); }
void operator delete(void* block, size_t) noexcept { Release(block); }
void operator delete(void* block, std::align_val_t) noexcept { Release(block); }
void operator delete(void* block, size_t, std::align_val_t) noexcept { Release(block); }

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Kind = SurfaceFault::Kind;

absl::StatusOr<SurfaceReport> Inspect(const test::TestSurface& surface, SolidRule solids = SolidRule::kEvenOdd,
                                      double weld = 0, int threads = 1) {
  SurfaceFeatures features = surface.Features();
  features.solids = solids;
  features.weld = weld;
  return InspectSurface(surface.points, features, threads, RunContext());
}

SurfaceReport InspectGood(const test::TestSurface& surface, SolidRule solids = SolidRule::kEvenOdd, double weld = 0) {
  const auto report = Inspect(surface, solids, weld);
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *report : SurfaceReport();
}

std::vector<Kind> KindsOf(const SurfaceReport& report) {
  std::vector<Kind> kinds;
  for (const SurfaceFault& fault : report.faults) {
    kinds.push_back(fault.kind);
  }
  return kinds;
}

class SurfaceReportTest : public test::SeededTest {
 protected:
  SurfaceReportTest() : SeededTest(20'547) {}
};

TEST_F(SurfaceReportTest, ACube) {
  const SurfaceReport report = InspectGood(test::Cube());
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.box, (Box<3>{{0, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(report.points, 8u);
  EXPECT_EQ(report.triangles, 12u);
  EXPECT_EQ(report.volume, 1.0);
  EXPECT_THAT(report.solids, ElementsAre(1.0));
  EXPECT_DOUBLE_EQ(report.area, 6);
  EXPECT_NEAR(report.sharpest_angle_deg.value_or(0), 90, 1e-12);
  EXPECT_FALSE(report.is_inside_out);
  EXPECT_EQ(report.curves, 12u);
  EXPECT_EQ(report.corners, 8u);
  EXPECT_EQ(report.patches, 6u);
}

TEST_F(SurfaceReportTest, MaterialsByEvenOddNameTheEdgesAndByHolesAreSolids) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const SurfaceReport holes = InspectGood(given.surface, SolidRule::kHoles);
    EXPECT_THAT(holes.faults, IsEmpty()) << given.name;
    EXPECT_THAT(holes.solids, SizeIs(given.volumes.size())) << given.name;
  }
  const std::vector<test::NamedComplex> all = test::SevenComplexes();
  EXPECT_THAT(KindsOf(InspectGood(all[0].surface)), ElementsAre(Kind::kOddEdges));
  EXPECT_THAT(KindsOf(InspectGood(all[1].surface)), IsEmpty());
  EXPECT_DOUBLE_EQ(InspectGood(all[1].surface).volume.value_or(0), 0.973);  // the inner one is a cavity
  EXPECT_THAT(KindsOf(InspectGood(all[4].surface)), IsEmpty());
  EXPECT_THAT(KindsOf(InspectGood(all[5].surface)), ElementsAre(Kind::kOpenEdges));
  EXPECT_THAT(KindsOf(InspectGood(all[6].surface)), ElementsAre(Kind::kOddEdges, Kind::kOpenEdges));
  const SurfaceFault odd = InspectGood(all[0].surface).faults.front();
  EXPECT_EQ(odd.count, 4u);
  ASSERT_THAT(odd.places, SizeIs(4));
  EXPECT_EQ(odd.places[0].at, (Point<3>{1, 0, 0.5}));
  EXPECT_THAT(odd.places[0].triangles, SizeIs(3));
  EXPECT_THAT(odd.accepted, HasSubstr("holes"));
}

TEST_F(SurfaceReportTest, AnOpenSurfaceByHolesBoundsNothing) {
  test::TestSurface open = test::Cube();
  open.corners.resize(33);
  open.markers.resize(11);
  const SurfaceReport report = InspectGood(open, SolidRule::kHoles);
  ASSERT_THAT(KindsOf(report), ElementsAre(Kind::kOpenEdges));
  EXPECT_THAT(report.faults[0].accepted, HasSubstr("nothing is bounded"));
  EXPECT_EQ(report.faults[0].count, 3u);
  EXPECT_EQ(report.faults[0].loops, 1u);
  EXPECT_DOUBLE_EQ(report.faults[0].places[0].size, 2 + std::sqrt(2.0));
  EXPECT_FALSE(report.volume.has_value());
}

TEST_F(SurfaceReportTest, CracksAreWeldedAsFarAsIsAsked) {
  test::TestSurface cracked = test::Loose(test::Sphere(3));
  for (double& x : cracked.points) {
    x += 1e-8 * random_.Unit();
  }
  EXPECT_THAT(KindsOf(InspectGood(cracked)).back(), Kind::kOpenEdges);
  const SurfaceReport welded = InspectGood(cracked, SolidRule::kEvenOdd, 1e-7);
  EXPECT_THAT(welded.faults, IsEmpty());
  EXPECT_EQ(welded.points, 642u);
  EXPECT_EQ(welded.welded_points, 3 * 1280u - 642u);
}

TEST_F(SurfaceReportTest, WhatIsDroppedOrTurnedIsCountedAndPlaced) {
  test::TestSurface surface = test::Sphere(2);
  std::swap(surface.corners[30], surface.corners[31]);
  surface.AddTriangle({surface.corners[60], surface.corners[61], surface.corners[62]});
  surface.AddTriangle({surface.corners[0], surface.corners[0], surface.corners[1]});
  surface.AddPoint({0, 0, 0});
  const SurfaceReport report = InspectGood(surface);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.flipped_triangles, 1u);
  EXPECT_THAT(report.flipped_at.triangles, ElementsAre(10));
  EXPECT_EQ(report.equal_triangles, 1u);
  EXPECT_THAT(report.equal_at.triangles, ElementsAre(320));
  EXPECT_EQ(report.flat_triangles, 1u);
  EXPECT_THAT(report.flat_at.triangles, ElementsAre(321));
  EXPECT_EQ(report.loose_points, 1u);
  EXPECT_EQ(report.triangles, 320u);
}

TEST_F(SurfaceReportTest, InsideOutIsSaid) {
  test::TestSurface turned = test::Sphere(2);
  for (size_t i = 0; i < turned.corners.size(); i += 3) {
    std::swap(turned.corners[i], turned.corners[i + 1]);
  }
  const SurfaceReport report = InspectGood(turned);
  EXPECT_TRUE(report.is_inside_out);
  EXPECT_EQ(report.flipped_triangles, 0u);
  EXPECT_GT(report.volume.value_or(0), 3.5);
}

TEST_F(SurfaceReportTest, TwoThatOverlapAreSelfIntersections) {
  const SurfaceReport report = InspectGood(test::Joined(test::Cube(), test::Sphere(2, {1, 0.5, 0.5}, 0.3)));
  ASSERT_THAT(KindsOf(report), ElementsAre(Kind::kSelfIntersections));
  const SurfaceFault& fault = report.faults[0];
  EXPECT_GT(fault.count, kNamedFaults);
  EXPECT_THAT(fault.places, SizeIs(kNamedFaults));
  for (const FaultPlace& place : fault.places) {
    EXPECT_NEAR(place.at[0], 1, 1e-12);  // in the side of the cube
    EXPECT_NEAR(std::hypot(place.at[1] - 0.5, place.at[2] - 0.5), 0.3, 0.02);
    EXPECT_THAT(place.triangles, SizeIs(2));
  }
}

TEST_F(SurfaceReportTest, APointBesideATriangleIsTooNear) {
  test::TestSurface surface = test::Cube();
  surface =
      test::Joined(surface, test::Boxes({0.25, 0.5}, {0.25, 0.5}, {1 + 1e-14, 1.5}, [](int, int, int) { return 1; }));
  const SurfaceReport report = InspectGood(surface);
  ASSERT_THAT(KindsOf(report), ElementsAre(Kind::kNearPoints));
  EXPECT_NEAR(report.faults[0].places[0].size, 1e-14, 1e-15);
  EXPECT_NEAR(report.faults[0].places[0].at[2], 1, 1e-12);
}

TEST_F(SurfaceReportTest, MarkersThatDifferOnEqualTriangles) {
  test::TestSurface surface = test::Cube();
  surface.AddTriangle({surface.corners[0], surface.corners[1], surface.corners[2]}, 77);
  const SurfaceReport report = InspectGood(surface);
  ASSERT_THAT(KindsOf(report), ElementsAre(Kind::kMarkersDiffer));
  EXPECT_THAT(report.faults[0].places[0].triangles, ElementsAre(0, 12));
}

TEST_F(SurfaceReportTest, NeitherOrderNorThreadsChangeABit) {
  test::TestSurface surface = test::Joined(test::Sphere(4), test::Sphere(3, {0.2, 0.3, 0.4}, 1.1));
  for (double& x : surface.points) {
    x += 1e-3 * random_.Gauss();
  }
  surface.corners.resize(surface.corners.size() - 30);
  surface.markers.resize(surface.markers.size() - 10);
  const auto without_names = [](SurfaceReport report) {
    for (FaultPlace* place : {&report.flat_at, &report.equal_at, &report.flipped_at}) {
      place->triangles.clear();
    }
    for (SurfaceFault& fault : report.faults) {
      for (FaultPlace& place : fault.places) {
        place.triangles.clear();
      }
    }
    return report;
  };
  for (const double weld : {0.0, 0.01}) {
    const auto report = Inspect(surface, SolidRule::kEvenOdd, weld);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_THAT(report->faults, SizeIs(2));
    for (const int threads : {1, 2, 4}) {
      const auto other = Inspect(test::Shuffled(surface, random_), SolidRule::kEvenOdd, weld, threads);
      ASSERT_TRUE(other.ok()) << other.status();
      EXPECT_EQ(without_names(*other), without_names(*report)) << threads;
    }
  }
}

TEST_F(SurfaceReportTest, ScalesByPowersOfTwoChangeNothingElse) {
  const test::TestSurface surface = test::Joined(test::Cube(), test::Sphere(2, {1, 0.5, 0.5}, 0.3));
  const SurfaceReport report = InspectGood(surface);
  for (const int exponent : {-300, -60, 20, 300}) {
    test::TestSurface scaled = surface;
    for (double& x : scaled.points) {
      x = std::ldexp(x, exponent);
    }
    const SurfaceReport other = InspectGood(scaled);
    EXPECT_EQ(other.area, std::ldexp(report.area, 2 * exponent)) << exponent;
    EXPECT_EQ(other.sharpest_angle_deg, report.sharpest_angle_deg);
    EXPECT_EQ(other.curves, report.curves);
    ASSERT_THAT(other.faults, SizeIs(1));
    EXPECT_EQ(other.faults[0].count, report.faults[0].count);
    EXPECT_EQ(other.faults[0].places[0].at[0], std::ldexp(report.faults[0].places[0].at[0], exponent));
  }
}

TEST_F(SurfaceReportTest, WhatCannotBeServedIsRefusedByName) {
  test::TestSurface surface = test::Cube();
  const auto message = [](const absl::StatusOr<SurfaceReport>& report) {
    EXPECT_EQ(report.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(report.status().message());
  };
  test::TestSurface infinite = surface;
  infinite.points[4] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(message(Inspect(infinite)), HasSubstr("points[1]"));
  EXPECT_THAT(message(Inspect(test::TestSurface{.points = {0, 0, 0}})), HasSubstr("at least one triangle"));
  EXPECT_THAT(message(Inspect({.points = {1, 1, 1}, .corners = {0, 0, 0}})), HasSubstr("all corners are one point"));
  EXPECT_THAT(message(Inspect({.points = {0, 0, 0, 1, 1, 1, 2, 2, 2}, .corners = {0, 1, 2}})),
              HasSubstr("none of the 1 has an area"));
  EXPECT_THAT(message(Inspect({.points = {0, 0, 0, 1, 1, 1, 2, 3, 2}, .corners = {0, 1, 2, 0}})),
              HasSubstr("three of each triangle"));
  EXPECT_THAT(message(Inspect({.points = {0, 0, 0, 1, 1, 1, 2, 3, 2}, .corners = {0, 1, 3}})),
              HasSubstr("triangles[0]: its corner 3"));
  EXPECT_THAT(message(Inspect(surface, SolidRule::kEvenOdd, -1)), HasSubstr("weld: expected a length"));
  surface.markers.pop_back();
  EXPECT_THAT(message(Inspect(surface)), HasSubstr("markers: there are 11; expected 12"));
  SurfaceFeatures features = surface.Features();
  features.markers = {};
  features.crease_angle = 200;
  EXPECT_THAT(message(InspectSurface(surface.points, features, 1, RunContext())), HasSubstr("crease_angle"));
}

// Lends as much as is asked for, or nothing.
class Lender final : public MemoryLender {
 public:
  explicit Lender(bool lends) : lends_(lends) {}
  absl::Status Reserve(uint64_t bytes) override {
    reserved += bytes;
    return lends_ ? absl::OkStatus() : absl::ResourceExhaustedError("no");
  }
  absl::Status Allow(uint64_t bytes) override {
    allowed = std::max(allowed, bytes);
    return absl::OkStatus();
  }
  uint64_t reserved = 0;
  uint64_t allowed = 0;

 private:
  const bool lends_;
};

TEST_F(SurfaceReportTest, MemoryIsReservedBeforeTheWorkAndSuffices) {
  test::TestSurface noisy = test::Sphere(6);
  for (double& x : noisy.points) {
    x += 0.002 * random_.Gauss();
  }
  const test::TestSurface sphere = test::Sphere(6);
  for (const test::TestSurface& surface : {sphere, noisy, test::Loose(sphere)}) {
    for (const double weld : {0.0, 1e-9}) {
      SurfaceFeatures features = surface.Features();
      features.weld = weld;
      RunContext context;
      Lender lender(/*lends=*/true);
      context.SetMemoryLender(&lender);
      const int64_t before = held_bytes;
      most_bytes = before;
      ASSERT_TRUE(InspectSurface(surface.points, features, 1, context).ok());
      const auto used = static_cast<uint64_t>(most_bytes - before);
      EXPECT_LT(used, lender.reserved + lender.allowed) << surface.triangle_count();
      // Loose triangles have six times as many points as those that they become.
      const bool is_loose = surface.points.size() == 3 * surface.corners.size();
      EXPECT_GT((is_loose ? 8 : 4) * used, lender.reserved) << surface.triangle_count();
    }
  }
}

TEST_F(SurfaceReportTest, WithoutMemoryNothingIsBegun) {
  const test::TestSurface sphere = test::Sphere(2);
  RunContext context;
  Lender lender(/*lends=*/false);
  context.SetMemoryLender(&lender);
  EXPECT_EQ(InspectSurface(sphere.points, sphere.Features(), 1, context).status().code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace wellspace::core
