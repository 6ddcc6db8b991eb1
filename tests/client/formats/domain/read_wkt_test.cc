// Well-known text: every geometry as people write it, and text that is none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/client/formats/domain/read_domain_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ReadWktTest : public ReadDomainTest {};

TEST_F(ReadWktTest, PolygonsAreAsThoseOfGeoJson) {
  const PlanarDomain wkt = ReadGood(
      "a.wkt", "POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0), (1 1, 3 1, 3 3, 1 3, 1 1))\nMULTIPOLYGON(((5 5,6 5,6 6)))");
  const PlanarDomain json = ReadGood(
      "a.geojson",
      R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{},"geometry":{"type":"Polygon",)"
      R"("coordinates":[[[0,0],[4,0],[4,4],[0,4],[0,0]],[[1,1],[3,1],[3,3],[1,3],[1,1]]]}},{"type":"Feature",)"
      R"("properties":{},"geometry":{"type":"MultiPolygon","coordinates":[[[[5,5],[6,5],[6,6]]]]}}]})");
  EXPECT_EQ(wkt.points, json.points);
  EXPECT_EQ(wkt.segments, json.segments);
  EXPECT_EQ(wkt.markers, json.markers);
  EXPECT_EQ(wkt.is_line, json.is_line);
  EXPECT_EQ(wkt.faces, json.faces);
  EXPECT_EQ(wkt.unclosed_rings, 1);
  EXPECT_EQ(Without(wkt.PointOrigin(6)), "a.wkt:1: coordinates[1][2]");
  EXPECT_EQ(Without(wkt.SegmentOrigin(9)), "a.wkt:2: coordinates[0][0][1]");
  EXPECT_THAT(wkt.notes, ElementsAre(HasSubstr("1 ring is closed")));
}

TEST_F(ReadWktTest, EveryGeometryInAnyDialect) {
  const PlanarDomain domain =
      ReadGood("a.wkt",
               "# drawn by hand\nsrid=4326;LineString Z (0 0 7, 1 0 7); POINTZM(5 5 1 2)\n"
               "MULTIPOINT(6 6,7 7)\nMultiPoint((8 8),\n (9 9))\nPOINT EMPTY\n"
               "MULTILINESTRING((0 1,1 1),(0 2,1 2))\nTRIANGLE((2 0,3 0,3 1,2 0))\n"
               "GEOMETRYCOLLECTION(POINT(4 4),GEOMETRYCOLLECTION M (LINESTRING M (0 3 1,1 3 1)))");
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 0, 1, 1, 1, 0, 2, 1, 2, 2, 0, 3, 0,
                                         3, 1, 4, 4, 0, 3, 1, 3));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 7, 8, 9, 10, 11, 12, 12, 13, 13, 11, 15, 16));
  EXPECT_THAT(domain.is_line, ElementsAre(1, 1, 1, 0, 0, 0, 1));
  EXPECT_EQ(domain.altitudes, 5);
  EXPECT_EQ(Without(domain.PointOrigin(2)), "a.wkt:2: coordinates");
  EXPECT_EQ(Without(domain.PointOrigin(6)), "a.wkt:4: coordinates[1]");
  EXPECT_EQ(Without(domain.PointOrigin(16)), "a.wkt:9: geometries[1].geometries[0].coordinates[1]");
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("1 geometry is null or has no positions"), HasSubstr("altitudes")));
  EXPECT_EQ(ReadGood("a.wkt", "MULTILINESTRING((0 0,1 1))").faces, PlanarDomain::FaceRule::kBox);
  EXPECT_THAT(ReadGood("a.wkt", "MULTIPOLYGON(EMPTY,((0 0,1 0,0 1)))").segments, ElementsAre(0, 1, 1, 2, 2, 0));
}

TEST_F(ReadWktTest, ErrorsNameTheLine) {
  const auto bad = [this](const std::string& text) { return ReadBad("a.wkt", text); };
  EXPECT_THAT(bad("\nCIRCULARSTRING(0 0,1 1,1 0)"),
              HasSubstr("a.wkt:2: expected a geometry of well-known text, one of POINT, MULTIPOINT, LINESTRING, "));
  EXPECT_THAT(bad("POLYGON 0 0"), EndsWith("a.wkt:1: expected \"(\" or EMPTY, got \"0\""));
  EXPECT_THAT(bad("POLYGON(0 0,1 1)"), EndsWith("expected \"(\", got \"0\""));
  EXPECT_THAT(bad("LINESTRING(0 0,\n1)"), EndsWith("a.wkt:2: expected a position of 2 to 4 numbers, got \")\""));
  EXPECT_THAT(bad("LINESTRING(0 0,1 1 1 1 1)"), EndsWith("expected \",\" or \")\", got \"1\""));
  EXPECT_THAT(bad("POINT(0 nan)"), HasSubstr("a.wkt:1: expected a finite number, got \"nan\""));
  EXPECT_THAT(bad("POINT(0 1e999)"), HasSubstr("a.wkt:1: "));
  EXPECT_THAT(bad("POINT(0 0,1 1)"), EndsWith("expected \",\" or \")\", got \",\""));
  EXPECT_THAT(bad("LINESTRING(0 0,1 1"), EndsWith("expected \",\" or \")\", got the end"));
  EXPECT_THAT(bad("SRID=x;POINT(0 0)"), EndsWith("expected the number of a reference system, got \"x\""));
  EXPECT_THAT(bad(std::string(1000, 'x')), HasSubstr("expected a word or a number, got \"xxx"));
  EXPECT_THAT(bad(""), EndsWith("no points; expected at least one"));
  EXPECT_THAT(bad("POINT EMPTY"), EndsWith("no points; expected at least one"));
  std::string nested;
  for (int i = 0; i < 100000; ++i) {
    nested += "GEOMETRYCOLLECTION(";
  }
  EXPECT_THAT(bad(nested), EndsWith("expected at most 32 nested collections, got more"));
  const absl::StatusOr<PlanarDomain> wrong = Read("a.wkt", "POINT(0 0)", {.region_property = "a"});
  EXPECT_THAT(std::string(wrong.status().message()), HasSubstr("--region-property is of the format geojson"));
}

// Starts of a file are domains or refused.
TEST_F(ReadWktTest, CutAnywhereIsNoTrouble) {
  const std::string text = "SRID=1;MULTIPOLYGON Z(((0 0 1,1 0 1,0 1 1,0 0 1),EMPTY));GEOMETRYCOLLECTION(POINT(1 2))";
  for (size_t size = 0; size < text.size(); ++size) {
    const absl::StatusOr<PlanarDomain> domain = Read("a.wkt", text.substr(0, size));
    EXPECT_TRUE(domain.ok() || absl::IsInvalidArgument(domain.status())) << size << domain.status();
  }
  EXPECT_THAT(ReadGood("a.wkt", text).notes, testing::Not(IsEmpty()));
}

}  // namespace
}  // namespace wellspace::formats
