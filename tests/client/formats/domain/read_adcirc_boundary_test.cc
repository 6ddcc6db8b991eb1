// Boundaries of ADCIRC's grids as domains.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/client/formats/domain/read_domain_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ReadAdcircBoundaryTest : public ReadDomainTest {};

// Elements may be any: they are not looked at.
constexpr char kGrid[] =
    "a bay\n1 9\n1 0 0 5\n2 9 0 5\n3 9 9 1\n4 0 9 1\n5 3 3 2\n6 6 3 2\n7 6 6 2\n8 3 6 2\n9 1 1 1\n1 4 1 2 3 4\n"
    "1\n2\n2\n4\n1\n2\n8\n4 0\n1\n2\n3\n4\n4 21\n5\n8\n7\n6\n";

TEST_F(ReadAdcircBoundaryTest, RingsOfSeveralBoundaries) {
  const PlanarDomain domain = ReadGood("fort.14", kGrid);
  EXPECT_THAT(domain.points, ElementsAre(0, 9, 0, 0, 9, 0, 9, 9, 3, 3, 3, 6, 6, 6, 6, 3));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4));
  EXPECT_THAT(domain.markers, ElementsAre(1, 2, 2, 2, 3, 3, 3, 3));
  EXPECT_EQ(domain.faces, PlanarDomain::FaceRule::kEvenOdd);
  EXPECT_EQ(Without(domain.PointOrigin(4)), "fort.14:26");
  EXPECT_EQ(Without(domain.SegmentOrigin(7)), "fort.14:29");
  EXPECT_FALSE(IsDomainPath("fort.14"));  // but for --segments it has points
}

TEST_F(ReadAdcircBoundaryTest, AGridWithoutBoundariesIsNone) {
  const std::string grid = kGrid;
  EXPECT_THAT(ReadBad("a.14", grid.substr(0, grid.find("1\n2\n2\n4"))),
              HasSubstr("a.14:12: the file ends without boundaries, which a domain is made of"));
}

}  // namespace
}  // namespace wellspace::formats
