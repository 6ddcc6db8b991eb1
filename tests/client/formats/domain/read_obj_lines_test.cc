// Wavefront's OBJ as a planar domain: vertices, lines, one z.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/client/formats/domain/read_domain_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ReadObjLinesTest : public ReadDomainTest {};

TEST_F(ReadObjLinesTest, ReadsVerticesAndLines) {
  const PlanarDomain domain = ReadGood("a.obj", R"(# two lines
o thing
v 0 0 2
v 1 0 2.0
v 1 1 2 0.5
vt 0 0
l 1 2 \
  3
v 5 5 2
l -1/1 -4/1
g other
usemtl x
)");
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 1, 1, 5, 5));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 3, 0));
  EXPECT_THAT(domain.markers, ElementsAre(0, 0, 0));
  EXPECT_EQ(domain.faces, PlanarDomain::FaceRule::kBox);
  EXPECT_THAT(domain.notes, IsEmpty());
  EXPECT_EQ(Without(domain.PointOrigin(3)), "a.obj:9");
  EXPECT_EQ(Without(domain.SegmentOrigin(1)), "a.obj:7");
  EXPECT_EQ(Without(domain.SegmentOrigin(2)), "a.obj:10");
}

TEST_F(ReadObjLinesTest, TwoCoordinatesAreEnoughAndFacesAreNotUsed) {
  const PlanarDomain domain = ReadGood("a.obj", "v 0 0\nv 1 0\nv 0 1\nl 1 1 2\nf 1 2 3\n");
  EXPECT_THAT(domain.segments, ElementsAre(0, 0, 0, 1));  // a segment without length is left to the cleaning
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("1 face is not used, only vertices and lines")));
}

TEST_F(ReadObjLinesTest, ErrorsNameTheLine) {
  struct Case {
    const char* text;
    const char* message;
  };
  for (const Case& one : {
           Case{"v 0 0 1\nv 1 0 1\n\nv 1 1 1.5\n",
                "a.obj:4: expected z to be 1, as in line 1, since a domain in the plane "
                "has one z, got 1.5"},
           {"v 0\n", "a.obj:1: expected 2 or 3 coordinates, got 1"},
           {"v 0 nan\n", "a.obj:1: coordinate 2: expected a finite number, got \"nan\""},
           {"v 0 0\nl 1 2\n", "a.obj:2: expected a vertex from 1 to 1 or from -1 to -1, of those above, got \"2\""},
           {"v 0 0\nl 1 0\n", "a.obj:2: expected a vertex from 1 to 1"},
           {"v 0 0\nl 1 -2\n", "a.obj:2: expected a vertex from 1 to 1"},
           {"v 0 0\nl 1 1.5\n", "a.obj:2: expected a vertex from 1 to 1"},
           {"v 0 0\nl 1 -\n", "a.obj:2: expected a vertex from 1 to 1"},
           {"v 0 0\nl 1 99999999999999999999\n", "a.obj:2: expected a vertex from 1 to 1"},
           {"l 1 2\n", "a.obj:1: expected vertices before the line, got none"},
           {"v 0 0\nl 1\n", "a.obj:2: expected a line of at least 2 vertices, got 1"},
           {"v 0 0\nl\n", "a.obj:2: expected a line of at least 2 vertices, got 0"},
           {"V 0 0\n", "a.obj:1: expected \"v\" for a vertex, got \"V\""},
           {"1 2 3\n", "a.obj:1: expected a word such as \"v\" or \"f\", got \"1\""},
           {"# nothing\n", "a.obj: no points; expected at least one"},
       }) {
    EXPECT_THAT(ReadBad("a.obj", one.text), StartsWith(one.message)) << one.text;
  }
}

}  // namespace
}  // namespace wellspace::formats
