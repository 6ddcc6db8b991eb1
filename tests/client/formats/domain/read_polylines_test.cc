// Polylines in tables: told apart by blank lines, by '>' or by a column.
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

class ReadPolylinesTest : public ReadDomainTest {};

TEST_F(ReadPolylinesTest, BlankLinesEndPolylines) {
  const PlanarDomain domain = ReadGood("a.csv", "0,0\n1,0\n# a comment ends nothing\n1,1\n\n\n5,5\n6,5\n \n9,9\n");
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 1, 1, 5, 5, 6, 5, 9, 9));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 3, 4));
  EXPECT_THAT(domain.markers, ElementsAre(0, 0, 0));
  EXPECT_EQ(domain.faces, PlanarDomain::FaceRule::kBox);
  EXPECT_THAT(domain.notes, IsEmpty());
  EXPECT_EQ(Without(domain.PointOrigin(2)), "a.csv:4");
  EXPECT_EQ(Without(domain.PointOrigin(5)), "a.csv:10");
  EXPECT_EQ(Without(domain.SegmentOrigin(1)), "a.csv:2");
  EXPECT_EQ(Without(domain.SegmentOrigin(2)), "a.csv:7");
}

TEST_F(ReadPolylinesTest, ClosedPolylinesShareTheirPointAndRepeatedOnesAreDropped) {
  const PlanarDomain domain = ReadGood("a.txt", "> a ring, as GMT has it\n0 0\n1 0\n1 0\n1 1\n0 0\n>\n0 0\n0 1\n");
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 1, 1, 0, 0, 0, 1));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 2, 0, 3, 4));
  EXPECT_EQ(domain.repeated_points, 1u);
  EXPECT_EQ(Without(domain.PointOrigin(2)), "a.txt:5");
  EXPECT_EQ(Without(domain.SegmentOrigin(2)), "a.txt:5");
}

TEST_F(ReadPolylinesTest, AColumnTellsPolylinesApart) {
  const PlanarDomain domain = ReadGood("a.csv", "id;lat;lon;depth\na;0;1;9\n\na;2;3;9\nb;4;5;9\nb;6;7;9\n");
  EXPECT_THAT(domain.points, ElementsAre(1, 0, 3, 2, 5, 4, 7, 6));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("column 4 \"depth\" is not used")));
  const PlanarDomain chosen =
      ReadGood("a.dat", "7 1 0 0\n7 1 1 0\n8 1 1 1\n8 1 0 1\n", {.columns = {"3", "4"}, .id_column = "1"});
  EXPECT_THAT(chosen.segments, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(chosen.points, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
  const PlanarDomain named =
      ReadGood("a.csv", "u,v,w\n0,0,1\n1,0,1\n1,1,2\n", {.columns = {"U", "v"}, .id_column = "W"});
  EXPECT_THAT(named.segments, ElementsAre(0, 1));
}

TEST_F(ReadPolylinesTest, ErrorsNameTheLine) {
  struct Case {
    std::string text;
    std::string message;
    DomainOptions options = {};
  };
  for (const Case& one : std::vector<Case>{
           {"0,0\n1,nan\n", "a.csv:2: field 2: expected a finite number, got \"nan\""},
           {"0,0\n1,\n", "a.csv:2: field 2: expected a number, got \"\""},
           {"0;0\n1,5;1\n", "a.csv:2: field 1: expected a number, got \"1,5\" (a decimal comma?"},
           {"0,0\n1\n", "a.csv:2: expected 2 fields, got 1"},
           {"0,0\n1,2,3\n", "a.csv:2: expected 2 fields, as line 1 has, got 3"},
           {"0,0,1\n",
            "a.csv:1: expected two columns, or a header with names such as x, y and id, or --columns with names "
            "or numbers, got 3 columns without names"},
           {"a,b,c\n0,0,1\n", "a.csv:1: expected two columns, or a header"},
           {"x,y,id\n0,0,a\n1,0,b\n1,1,a\n",
            "a.csv:4: polyline \"a\" began in line 2 and has ended; expected the points of "
            "each polyline one after the other"},
           {"x,y,id\n0,0\n", "a.csv:2: expected 3 fields, got 2"},
           {"x,y,id\n", "a.csv: no points; expected at least one"},
           {"0,0\n", "a.csv:1: --columns: there is no column \"z\"", {.columns = {"1", "z"}}},
           {"x,y\n0,0\n", "a.csv:1: --id-column: there is no column \"part\"", {.id_column = "part"}},
           {"x,y\n0,0\n",
            "a.csv:1: column 2 is taken for a coordinate; expected another one for --id-column",
            {.id_column = "y"}},
       }) {
    EXPECT_THAT(ReadBad("a.csv", one.text, one.options), StartsWith(one.message)) << one.text;
  }
}

}  // namespace
}  // namespace wellspace::formats
