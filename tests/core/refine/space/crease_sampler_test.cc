// Points and balls that are put around acute curves and corners before a mesh is made.
#include "core/refine/space/crease_sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "core/geometry/directions.h"
#include "core/input/space_cloud.h"
#include "core/refine/space/collar_points.h"
#include "core/refine/space/corner_sectors.h"
#include "tests/support/acute_parts.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

constexpr double kSame = 1e-9;  // relatively

class CreaseSamplerTest : public ::testing::Test {
 protected:
  void Sample(const test::TestSurface& surface, double edge) {
    RunContext context;
    absl::StatusOr<SpaceCloud> made = MakeSpaceCloud(surface.points, surface.Features(), edge, 1e-3, 10000, 1, context);
    ASSERT_TRUE(made.ok()) << made.status();
    cloud_.emplace(*std::move(made));
  }
  const SpatialDomain& domain() const { return *cloud_->domain; }
  const AcuteCreases& creases() const { return domain().creases(); }

  std::optional<SpaceCloud> cloud_;
};

TEST_F(CreaseSamplerTest, FindsNothingWhereNothingIsAcute) {
  Sample(test::Cube(), 0.2);
  EXPECT_TRUE(creases().IsEmpty());
  EXPECT_TRUE(creases().strands.empty());
  EXPECT_FALSE(creases().Shields({0, 0, 0}));
}

TEST_F(CreaseSamplerTest, FirstVerticesAtACornerAreAtOneDistance) {
  for (const test::TestSurface& part : {test::Wedge(20), test::Wedge(70), test::AcuteTetrahedron(10)}) {
    Sample(part, 0.2);
    size_t balls = 0;
    for (uint32_t corner = 0; corner < domain().curves().corners.size(); ++corner) {
      const Point<3>& centre = domain().complex().points[domain().curves().corners[corner]];
      for (const SpatialDomain::CurveEnd& end : domain().EndsAt(corner)) {
        const double radius = creases().balls[end.curve][end.is_last ? 1 : 0];
        if (radius > 0) {
          const std::vector<double>& arcs = creases().first_arcs[end.curve];
          const Point<3> first = domain().PointAt(end.curve, end.is_last ? arcs.back() : arcs.front());
          EXPECT_NEAR(Distance<3>(first, centre), radius, kSame * radius);
          EXPECT_EQ(std::exp2(std::round(std::log2(radius))), radius);
          EXPECT_LE(3 * radius, domain().LengthOf(end.curve) * (1 + kSame));
          ++balls;
        }
      }
    }
    EXPECT_GT(balls, 0);
  }
}

TEST_F(CreaseSamplerTest, CollarPointsAreAtEqualDistancesOnAllPatches) {
  for (const test::TestSurface& part : {test::Wedge(20), test::AcuteTetrahedron(10), test::Cone(48, 0.5)}) {
    Sample(part, 0.2);
    size_t beside = 0;
    bool has_shift = false;
    for (const Strand& strand : creases().strands) {
      for (size_t k = 0; k < 2 && strand.curve != Strand::kNoCurve; ++k) {
        const double length = domain().LengthOf(strand.curve);
        const Point<3> at = domain().PointAt(strand.curve, strand.arcs[k]);
        // Across the curve, and shifted along it on all patches but one; on the sphere of a ball.
        const Point<3> way = Difference<3>(strand.ends[k].at, at);
        const double arc = domain().IsLoop(strand.curve) && strand.arcs[k] == length ? 0 : strand.arcs[k];
        const double shift = Dot<3>(way, SidesAt(domain(), strand.curve, arc).along);
        const std::vector<double>& arcs = creases().first_arcs[strand.curve];
        const bool is_on_sphere = (strand.arcs[k] == arcs.front() && creases().balls[strand.curve][0] > 0) ||
                                  (strand.arcs[k] == arcs.back() && creases().balls[strand.curve][1] > 0);
        EXPECT_NEAR(std::sqrt(NormSq<3>(way) - (is_on_sphere ? 0 : shift * shift)), strand.radii[k],
                    1e-6 * strand.radii[k]);
        EXPECT_LE(domain().index().Nearest(strand.ends[k].at)->distance_sq, 1e-24);
        // Out of the ball over the subsegment beside it, and no farther than it is long.
        const double chord = Distance<3>(domain().PointAt(strand.curve, strand.arcs[0]),
                                         domain().PointAt(strand.curve, std::min(length, strand.arcs[1])));
        EXPECT_LE(strand.radii[k], 0.8 * chord * (1 + kSame));
        EXPECT_TRUE(is_on_sphere || std::abs(shift) <= kShiftShare * chord * (1 + kSame)) << shift;
        has_shift = has_shift || (!is_on_sphere && shift > 0.01 * chord);
        ++beside;
      }
      const auto patches =
          domain().PatchesAtCurve(domain().NumberOfStrand(static_cast<uint32_t>(&strand - creases().strands.data())));
      ASSERT_EQ(patches.size(), 1);
      EXPECT_EQ(patches[0], strand.patch);
    }
    EXPECT_GT(beside, 0);
    EXPECT_TRUE(has_shift);
    for (uint32_t group = 0; group + 1 < creases().first_of_group.size(); ++group) {
      const std::span<const Strand> strands = creases().StrandsOfGroup(group);
      for (const Strand& strand : strands) {
        EXPECT_EQ(strand.group, group);
        EXPECT_EQ(strand.radii, strands[0].radii);
        EXPECT_EQ(strand.arcs, strands[0].arcs);
      }
      EXPECT_EQ(strands.size(), strands[0].curve == Strand::kNoCurve ? 1 : 2);
    }
  }
}

// A strand that is split has a vertex in its middle, which would else be in the ball over the subsegment beside it.
TEST_F(CreaseSamplerTest, MiddlesOfStrandsAreOutOfBallsOverSubsegments) {
  for (const test::TestSurface& part : {test::Wedge(20), test::AcuteTetrahedron(10), test::AcuteTetrahedron(25)}) {
    for (const double edge : {0.2, 100.0}) {
      Sample(part, edge);
      for (uint32_t i = 0; i < creases().strands.size(); ++i) {
        const Strand& strand = creases().strands[i];
        if (strand.curve != Strand::kNoCurve) {
          const Point<3> a = domain().PointAt(strand.curve, strand.arcs[0]);
          const Point<3> b = domain().PointAt(strand.curve, strand.arcs[1]);
          const Point<3> middle = domain().PointAt(domain().NumberOfStrand(i), 0.5);
          EXPECT_GE(DistanceSq<3>(middle, Between(a, b, 0.5)), 0.25 * DistanceSq<3>(a, b)) << edge;
        }
      }
    }
  }
}

// Strands around a corner lead from each of its curves to the next, so that nothing comes into the ball between them.
TEST_F(CreaseSamplerTest, StrandsGoAllTheWayAround) {
  for (const test::TestSurface& part : {test::Wedge(20), test::AcuteTetrahedron(10), test::Cone(48, 0.5)}) {
    Sample(part, 0.2);
    std::map<Point<3>, int> ends;  // how many strands end there
    for (const Strand& strand : creases().strands) {
      for (const StrandEnd& end : strand.ends) {
        ++ends[end.at];
      }
    }
    EXPECT_FALSE(ends.empty());
    for (const AcuteCreases::Collar& collar : creases().collars) {
      EXPECT_EQ(ends[collar.at], 2);
    }
    RunContext context;
    const absl::StatusOr<std::vector<CornerSector>> sectors =
        FindCornerSectors(domain(), std::vector<bool>(domain().curves().corners.size(), true), context);
    ASSERT_TRUE(sectors.ok());
    for (const CornerSector& sector : *sectors) {
      EXPECT_NEAR(NormSq<3>(sector.WayAt(0.5 * sector.turns.back())), 1, kSame);
    }
  }
}

TEST_F(CreaseSamplerTest, ShieldsWhatIsInsideAlone) {
  for (const test::TestSurface& part :
       {test::Wedge(45), test::Wedge(20), test::AcuteTetrahedron(10), test::Cone(48, 0.5)}) {
    Sample(part, 0.2);
    for (uint32_t curve = 0; curve < domain().curve_count(); ++curve) {
      const std::vector<double>& arcs = creases().first_arcs[curve];
      for (size_t i = 1; creases().is_acute[curve] && i < arcs.size(); ++i) {
        const Point<3> a = domain().PointAt(curve, arcs[i - 1]);
        const Point<3> b = domain().PointAt(curve, arcs[i]);
        EXPECT_TRUE(creases().Shields(Between(a, b, 0.5)));
        // No other first vertex is in the ball over a subsegment that is never split.
        for (const Point<3>& p : cloud_->cloud.points) {
          const double share = DistanceSq<3>(p, Between(a, b, 0.5)) / (0.25 * DistanceSq<3>(a, b));
          EXPECT_GE(share, 1 - kSame);
        }
      }
    }
    for (const AcuteCreases::Collar& collar : creases().collars) {
      EXPECT_FALSE(creases().Shields(collar.at));
    }
  }
  for (const double degrees : {45.0, 20.0}) {
    Sample(test::Wedge(degrees), 0.2);
    for (uint32_t strand = 0; strand < creases().strands.size(); ++strand) {
      EXPECT_FALSE(creases().Shields(domain().PointAt(domain().NumberOfStrand(strand), 0.5)));
    }
  }
}

// The whole ball about an acute corner, also where no subsegment is near.
TEST_F(CreaseSamplerTest, ShieldsTheBallsOfCorners) {
  for (const test::TestSurface& part : {test::Wedge(20), test::AcuteTetrahedron(10)}) {
    Sample(part, 0.2);
    size_t balls = 0;
    for (uint32_t corner = 0; corner < domain().curves().corners.size(); ++corner) {
      const Point<3>& centre = domain().complex().points[domain().curves().corners[corner]];
      const SpatialDomain::CurveEnd& end = domain().EndsAt(corner)[0];
      const double radius = creases().balls[end.curve][end.is_last ? 1 : 0];
      for (int axis = 0; axis < 3 && radius > 0; ++axis) {
        for (const double share : {-0.9, -0.5, 0.5, 0.9}) {
          Point<3> inside = centre;
          inside[axis] += share * radius;
          EXPECT_TRUE(creases().Shields(inside)) << axis << " " << share;
        }
        ++balls;
      }
    }
    EXPECT_GT(balls, 0);
  }
}

// A curve that is long and stays near its own corner leaves the ball there, however far away other curves are.
TEST_F(CreaseSamplerTest, CurvesThatWindLeaveTheBallOfTheirCorner) {
  Sample(test::SpiralBar(8), 100);
  size_t balls = 0;
  for (uint32_t curve = 0; curve < domain().curve_count(); ++curve) {
    const std::vector<double>& arcs = creases().first_arcs[curve];
    if (creases().balls[curve][0] > 0) {
      EXPECT_GT(arcs.front(), 0);
      EXPECT_LT(arcs.front(), arcs.back());
      EXPECT_LT(arcs.back(), domain().LengthOf(curve));
      ++balls;
    }
  }
  EXPECT_GT(balls, 0);
}

TEST_F(CreaseSamplerTest, SpacingsGrowSlowly) {
  Sample(test::Wedge(20), 0.05);
  for (uint32_t curve = 0; curve < domain().curve_count(); ++curve) {
    const std::vector<double>& arcs = creases().first_arcs[curve];
    for (size_t i = 2; creases().is_acute[curve] && i < arcs.size(); ++i) {
      const double before = arcs[i - 1] - arcs[i - 2];
      const double after = arcs[i] - arcs[i - 1];
      EXPECT_LE(std::max(before, after), 1.6 * std::min(before, after));
    }
  }
}

}  // namespace
}  // namespace wellspace::core
