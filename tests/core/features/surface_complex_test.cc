// Triangles become a complex: those that are dropped, its order, and input orders that it does not depend on.
#include "core/features/surface_complex.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<SurfaceComplex> Make(const test::TestSurface& surface, const std::vector<uint32_t>& place_of = {},
                                    const RunContext& context = RunContext()) {
  const SurfaceFeatures features = surface.Features();
  return MakeSurfaceComplex(surface.points, place_of, features, context);
}

// The invariants of SurfaceComplex.
void ExpectInOrder(const SurfaceComplex& complex) {
  EXPECT_TRUE(std::is_sorted(complex.points.begin(), complex.points.end()));
  EXPECT_EQ(std::adjacent_find(complex.points.begin(), complex.points.end()), complex.points.end());
  EXPECT_TRUE(std::is_sorted(complex.edges.begin(), complex.edges.end()));
  EXPECT_EQ(complex.sides.size(), 3 * complex.triangles.size());
  std::vector<std::array<uint32_t, 3>> sorted;
  for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
    std::array<uint32_t, 3> corners = complex.triangles[t];
    EXPECT_EQ(*std::min_element(corners.begin(), corners.end()), corners[0]);
    EXPECT_FALSE(AreCollinear(complex.Corner(t, 0), complex.Corner(t, 1), complex.Corner(t, 2)));
    for (uint32_t k = 0; k < 3; ++k) {
      const TriangleSide side = SideOf(t, k);
      const uint32_t edge = complex.edge_of_side[side];
      const auto at = complex.SidesAt(edge);
      EXPECT_TRUE(std::is_sorted(at.begin(), at.end()));
      EXPECT_NE(std::find(at.begin(), at.end(), side), at.end());
      EXPECT_EQ(complex.RunsUp(side), corners[k] == complex.edges[edge][0]);
      EXPECT_EQ(complex.ApexOf(side), corners[(k + 2) % 3]);
    }
    std::sort(corners.begin(), corners.end());
    sorted.push_back(corners);
  }
  EXPECT_TRUE(std::is_sorted(sorted.begin(), sorted.end()));
  EXPECT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end());
}

TEST(SurfaceComplexTest, ACubeHasEighteenEdgesOfTwoTriangles) {
  const auto complex = Make(test::Cube());
  ASSERT_TRUE(complex.ok()) << complex.status();
  ExpectInOrder(*complex);
  EXPECT_EQ(complex->points.size(), 8u);
  EXPECT_EQ(complex->triangles.size(), 12u);
  ASSERT_EQ(complex->edges.size(), 18u);
  for (uint32_t e = 0; e < 18; ++e) {
    ASSERT_EQ(complex->SidesAt(e).size(), 2u);
    EXPECT_NE(complex->RunsUp(complex->SidesAt(e)[0]), complex->RunsUp(complex->SidesAt(e)[1]));
  }
}

TEST(SurfaceComplexTest, EqualPointsAreOneAndMinusZeroIsZero) {
  test::TestSurface surface = test::Loose(test::Cube());
  for (double& x : surface.points) {
    x = x == 0 && &x != surface.points.data() ? -0.0 : x;
  }
  const auto complex = Make(surface);
  ASSERT_TRUE(complex.ok()) << complex.status();
  EXPECT_EQ(complex->points.size(), 8u);
  EXPECT_EQ(complex->edges.size(), 18u);
  EXPECT_EQ(complex->cleaning.equal_points, 28u);
  EXPECT_EQ(complex->point_of_input.size(), 36u);
}

TEST(SurfaceComplexTest, FlatTrianglesAreDroppedExactly) {
  test::TestSurface surface = test::Cube();
  surface.AddPolygon({{0.1, 0.1, 5}, {0.2, 0.2, 5}, {0.3, 0.30000000000000004, 5}});  // on a line but for one ulp
  surface.AddPolygon({{0.25, 0.5, 6}, {0.5, 1, 6}, {0.75, 1.5, 6}});
  surface.AddTriangle({0, 1, 1});
  const auto complex = Make(surface);
  ASSERT_TRUE(complex.ok()) << complex.status();
  ExpectInOrder(*complex);
  EXPECT_EQ(complex->cleaning.flat_triangles, 2u);
  EXPECT_EQ(complex->triangles.size(), 13u);
}

TEST(SurfaceComplexTest, OfEqualTrianglesOneStaysWhicheverWayTheyGo) {
  test::TestSurface surface = test::Cube();
  surface.markers.assign(12, 7);
  surface.AddTriangle({surface.corners[1], surface.corners[2], surface.corners[0]}, 7);
  surface.AddTriangle({surface.corners[4], surface.corners[3], surface.corners[5]}, 7);
  const auto complex = Make(surface);
  ASSERT_TRUE(complex.ok()) << complex.status();
  ExpectInOrder(*complex);
  EXPECT_EQ(complex->cleaning.equal_triangles, 2u);
  EXPECT_EQ(complex->triangles.size(), 12u);
  EXPECT_EQ(complex->conflict_count, 0u);
  std::set<uint32_t> sources(complex->sources.begin(), complex->sources.end());
  EXPECT_EQ(sources.size(), 12u);
  EXPECT_EQ(*sources.rbegin(), 11u);  // the first that is given stands for both
}

TEST(SurfaceComplexTest, EqualTrianglesWithOtherMarkersAreTold) {
  test::TestSurface surface = test::Cube();
  surface.AddTriangle({surface.corners[1], surface.corners[2], surface.corners[0]}, surface.markers[0] - 1);
  const auto complex = Make(surface);
  ASSERT_TRUE(complex.ok()) << complex.status();
  EXPECT_EQ(complex->conflict_count, 1u);
  EXPECT_THAT(complex->conflicts, ::testing::ElementsAre(MarkerConflict{0, 12}));
  EXPECT_NE(std::find(complex->markers.begin(), complex->markers.end(), surface.markers[0] - 1),
            complex->markers.end());
}

TEST(SurfaceComplexTest, PlacesOfPointsMayBeGiven) {
  test::TestSurface loose = test::Loose(test::Cube());
  // Each corner becomes the first within a tenth.
  std::vector<double> kept;
  std::vector<uint32_t> place_of;
  for (size_t i = 0; i < loose.points.size(); i += 3) {
    size_t at = 0;
    for (; at < kept.size(); at += 3) {
      if (std::equal(kept.begin() + at, kept.begin() + at + 3, loose.points.begin() + i)) {
        break;
      }
    }
    place_of.push_back(static_cast<uint32_t>(at / 3));
    if (at == kept.size()) {
      kept.insert(kept.end(), loose.points.begin() + i, loose.points.begin() + i + 3);
    }
  }
  test::TestSurface surface = loose;
  surface.points = kept;
  const auto complex = Make(surface, place_of);
  ASSERT_TRUE(complex.ok()) << complex.status();
  EXPECT_EQ(complex->edges.size(), 18u);
  EXPECT_EQ(complex->point_of_input.size(), 36u);
}

TEST(SurfaceComplexTest, ACornerThatIsNoPointIsNamed) {
  test::TestSurface surface = test::Cube();
  surface.AddTriangle({0, 1, 8});
  EXPECT_THAT(Make(surface).status().message(),
              HasSubstr("triangles[12]: its corner 8 is not a point; points are 0 to 7"));
  surface.points.clear();
  EXPECT_THAT(Make(surface).status().message(), HasSubstr("there are no points"));
}

TEST(SurfaceComplexTest, ARunThatIsCancelledMakesNoComplex) {
  RunContext context;
  context.Cancel();
  EXPECT_EQ(Make(test::Sphere(3), {}, context).status().code(), absl::StatusCode::kCancelled);
}

class SurfaceComplexOrderTest : public test::SeededTest {
 protected:
  SurfaceComplexOrderTest() : SeededTest(20'541) {}
};

TEST_F(SurfaceComplexOrderTest, NoOrderChangesABit) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    test::TestSurface surface = test::Joined(given.surface, test::Sphere(2, {0.3, 0.2, 0.1}, 3));
    surface.AddTriangle({surface.corners[0], surface.corners[2], surface.corners[1]}, surface.markers[0]);
    const auto complex = Make(surface);
    ASSERT_TRUE(complex.ok()) << complex.status();
    for (int round = 0; round < 5; ++round) {
      const auto other = Make(test::Shuffled(surface, random_));
      ASSERT_TRUE(other.ok()) << other.status();
      EXPECT_EQ(other->points, complex->points) << given.name;
      EXPECT_EQ(other->triangles, complex->triangles);
      EXPECT_EQ(other->markers, complex->markers);
      EXPECT_EQ(other->edges, complex->edges);
      EXPECT_EQ(other->first_side, complex->first_side);
      EXPECT_EQ(other->sides, complex->sides);
      EXPECT_EQ(other->edge_of_side, complex->edge_of_side);
    }
  }
}

}  // namespace
}  // namespace wellspace::core
