// GeoJSON: all geometries, rings as people write them, properties as markers and attributes, errors with their paths.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "tests/client/formats/domain/read_domain_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

class ReadGeoJsonTest : public ReadDomainTest {
 protected:
  PlanarDomain ReadGeometry(const std::string& type, const std::string& coordinates) {
    return ReadGood("a.geojson", Geometry(type, coordinates));
  }
  static std::string Geometry(const std::string& type, const std::string& coordinates) {
    return absl::StrCat(R"({"type":")", type, R"(","coordinates":)", coordinates, "}");
  }
  static std::string Feature(const std::string& geometry, const std::string& properties = "{}") {
    return absl::StrCat(R"({"type":"Feature","properties":)", properties, R"(,"geometry":)", geometry, "}");
  }
  static std::string Features(const std::vector<std::string>& features) {
    std::string text = R"({"type":"FeatureCollection","features":[)";
    for (const std::string& feature : features) {
      absl::StrAppend(&text, text.back() == '[' ? "" : ",\n", feature);
    }
    return text + "]}";
  }
  static std::string Square(double x, double y, double side) {
    return absl::StrCat("[[", x, ",", y, "],[", x + side, ",", y, "],[", x + side, ",", y + side, "],[", x, ",",
                        y + side, "],[", x, ",", y, "]]");
  }
  std::string Point(const PlanarDomain& domain, uint64_t point) { return Without(domain.PointOrigin(point)); }
};

TEST_F(ReadGeoJsonTest, ReadsEveryGeometry) {
  const PlanarDomain polygon = ReadGeometry("Polygon", "[" + Square(0, 0, 4) + "," + Square(1, 1, 2) + "]");
  EXPECT_THAT(polygon.points, ElementsAre(0, 0, 4, 0, 4, 4, 0, 4, 1, 1, 3, 1, 3, 3, 1, 3));
  EXPECT_THAT(polygon.segments, ElementsAre(0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4));
  EXPECT_THAT(polygon.markers, SizeIs(8));
  EXPECT_EQ(polygon.faces, PlanarDomain::FaceRule::kUnion);
  EXPECT_THAT(polygon.is_line, IsEmpty());
  EXPECT_EQ(Point(polygon, 6), "a.geojson:1: coordinates[1][2]");
  EXPECT_EQ(Without(polygon.SegmentOrigin(7)), "a.geojson:1: coordinates[1][3]");

  const PlanarDomain polygons =
      ReadGeometry("MultiPolygon", "[[" + Square(0, 0, 1) + "],[" + Square(2, 0, 3) + "," + Square(3, 1, 1) + "]]");
  EXPECT_EQ(polygons.point_count(), 12u);
  EXPECT_EQ(Point(polygons, 3), "a.geojson:1: coordinates[0][0][3]");
  EXPECT_EQ(Point(polygons, 8), "a.geojson:1: coordinates[1][1][0]");

  const PlanarDomain line = ReadGeometry("LineString", "[[0,0],[1,0],[1,1]]");
  EXPECT_THAT(line.segments, ElementsAre(0, 1, 1, 2));
  EXPECT_EQ(line.faces, PlanarDomain::FaceRule::kBox);
  EXPECT_THAT(line.is_line, IsEmpty());
  EXPECT_EQ(Point(line, 2), "a.geojson:1: coordinates[2]");

  const PlanarDomain lines = ReadGeometry("MultiLineString", "[[[0,0],[1,0]],[[0,1],[1,1],[0,2],[0,1]]]");
  EXPECT_THAT(lines.segments, ElementsAre(0, 1, 2, 3, 3, 4, 4, 2));
  EXPECT_EQ(Point(lines, 4), "a.geojson:1: coordinates[1][2]");

  const PlanarDomain points = ReadGeometry("MultiPoint", "[[3,4],[5,6]]");
  EXPECT_THAT(points.points, ElementsAre(3, 4, 5, 6));
  EXPECT_THAT(points.segments, IsEmpty());
  EXPECT_EQ(Point(points, 1), "a.geojson:1: coordinates[1]");
  EXPECT_EQ(Point(ReadGeometry("Point", "[3,4]"), 0), "a.geojson:1: coordinates");
}

TEST_F(ReadGeoJsonTest, ReadsCollectionsAndSaysWhereThingsAre) {
  const std::string line = Geometry("LineString", "[[0,0],[1,0]]");
  const std::string inner = R"({"type":"GeometryCollection","geometries":[)" + line + "," + line + "]}";
  const std::string outer = R"({"type":"GeometryCollection","geometries":[)" + line + "," + inner + "]}";
  const PlanarDomain domain = ReadGood(
      "a.geojson", Features({Feature(line), Feature("null"), Feature(outer), Feature(Geometry("Point", "[7,8]"))}));
  EXPECT_EQ(domain.point_count(), 9u);
  EXPECT_EQ(Point(domain, 1), "a.geojson:1: features[0].geometry.coordinates[1]");
  EXPECT_EQ(Point(domain, 2), "a.geojson:3: features[2].geometry.geometries[0].coordinates[0]");
  EXPECT_EQ(Point(domain, 7), "a.geojson:3: features[2].geometry.geometries[1].geometries[1].coordinates[1]");
  EXPECT_EQ(Without(domain.SegmentOrigin(2)),
            "a.geojson:3: features[2].geometry.geometries[1].geometries[0].coordinates[0]");
  EXPECT_EQ(Point(domain, 8), "a.geojson:4: features[3].geometry.coordinates");
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("1 geometry is null or has no positions")));
  EXPECT_EQ(Point(ReadGood("a.geojson", Feature(line)), 1), "a.geojson:1: geometry.coordinates[1]");
}

TEST_F(ReadGeoJsonTest, MembersMayComeInAnyOrderAndForeignOnesAreSkipped) {
  const PlanarDomain domain = ReadGood("a.json", R"(
{ "bbox": [0, 0, 1, 1], "name": "x", "crs": {"type": "name", "properties": {"coordinates": [[1]]}},
  "features": [
    { "id": 7, "geometry": {
        "coordinates": [[0, 0],
                        [1, 2e0]], "foreign": [[[[[[1, "a", null, true]]]]]], "type": "LineString" },
      "properties": {"m": 5, "deep": {"m": [6, {"m": 7}]}, "type": "Point"}, "type": "Feature" } ],
  "type": "FeatureCollection" })",
                                       {.marker_property = "m"});
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 2));
  EXPECT_THAT(domain.markers, ElementsAre(5));
  EXPECT_EQ(Point(domain, 1), "a.json:5: features[0].geometry.coordinates[1]");
}

TEST_F(ReadGeoJsonTest, RingsMayRepeatPointsAndBeOpen) {
  // Closed, open, with repeated points, and with its first point several times at the end.
  for (const char* ring : {"[[0,0],[1,0],[1,1],[0,0]]", "[[0,0],[1,0],[1,1]]", "[[0,0],[0,0],[1,0],[1,0],[1,1],[0,0]]",
                           "[[0,0],[1,0],[1,1],[1,1],[0,0],[0,0],[0,0]]"}) {
    const PlanarDomain domain = ReadGeometry("Polygon", absl::StrCat("[", ring, "]"));
    EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 1, 1)) << ring;
    EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 2, 0)) << ring;
  }
  const PlanarDomain domain =
      ReadGeometry("MultiPolygon", "[[[[0,0],[0,0],[1,0],[1,1],[1,1],[1,1],[0,0],[0,0]]],[[[5,5],[6,5],[6,6]]]]");
  EXPECT_EQ(domain.repeated_points, 4u);
  EXPECT_EQ(domain.unclosed_rings, 1u);
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr(": 4 points are dropped, which are equal to the ones before them"),
                                        HasSubstr(": 1 ring is closed, whose last point is not its first")));
  // Positions are those of the file.
  EXPECT_EQ(Point(domain, 1), "a.geojson:1: coordinates[0][0][2]");
  EXPECT_EQ(Point(domain, 2), "a.geojson:1: coordinates[0][0][3]");
  // Sides that meet without being next to each other are left to the cleaning: a bow tie, and a spike.
  EXPECT_THAT(ReadGeometry("Polygon", "[[[0,0],[1,1],[1,0],[0,1],[0,0]]]").points, SizeIs(8));
  EXPECT_THAT(ReadGeometry("Polygon", "[[[0,0],[1,0],[1,1],[2,2],[1,1],[0,0]]]").points, SizeIs(10));
}

TEST_F(ReadGeoJsonTest, LinesBesidePolygonsAreTold) {
  const PlanarDomain domain =
      ReadGood("a.geojson", Features({Feature(Geometry("LineString", "[[0,0],[4,4]]")),
                                      Feature(Geometry("Polygon", "[[[0,0],[4,0],[4,4],[0,4]]]"))}));
  EXPECT_EQ(domain.faces, PlanarDomain::FaceRule::kUnion);
  EXPECT_THAT(domain.is_line, ElementsAre(1, 0, 0, 0, 0));
}

TEST_F(ReadGeoJsonTest, AltitudesAreCounted) {
  const PlanarDomain domain = ReadGeometry("LineString", "[[0,0,5],[1,0],[1,1,7,8]]");
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 1, 1));
  EXPECT_EQ(domain.altitudes, 2u);
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr(": 2 positions have altitudes, which are not used")));
}

TEST_F(ReadGeoJsonTest, EmptyGeometriesAreCounted) {
  const PlanarDomain domain =
      ReadGood("a.geojson", Features({Feature(Geometry("Polygon", "[]")), Feature(Geometry("MultiPolygon", "[[]]")),
                                      Feature(Geometry("Point", "[]")), Feature(Geometry("LineString", "[]")),
                                      Feature("null"), Feature(Geometry("Point", "[1,2]"))}));
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr(": 5 geometries are null or have no positions")));
  EXPECT_THAT(domain.points, ElementsAre(1, 2));
  EXPECT_THAT(ReadBad("a.geojson", Features({})), HasSubstr("a.geojson: no points; expected at least one"));
}

TEST_F(ReadGeoJsonTest, PropertiesAreMarkersAndAttributes) {
  const std::string polygon = Geometry("Polygon", "[" + Square(0, 0, 4) + "," + Square(1, 1, 2) + "]");
  const std::string two = Geometry("MultiPolygon", "[[" + Square(10, 0, 1) + "],[" + Square(20, 0, 1) + "]]");
  const PlanarDomain domain =
      ReadGood("a.geojson",
               Features({Feature(polygon, R"({"kind": 1.5, "side": 3})"), Feature(two, R"({"kind": -2, "side": null})"),
                         Feature(Geometry("Polygon", "[" + Square(30, 0, 1) + "]"), "null"),
                         Feature(Geometry("LineString", "[[0,9],[1,9]]"), R"({"side": -7.0, "kind": 1})")}),
               {.region_property = "kind", .marker_property = "side"});
  std::vector<int32_t> markers(8, 3);
  markers.resize(8 + 8 + 4, 0);
  markers.push_back(-7);
  EXPECT_EQ(domain.markers, markers);
  ASSERT_THAT(domain.seeds, SizeIs(3));
  EXPECT_EQ(domain.seeds[0].attribute, 1.5);
  EXPECT_EQ(domain.seeds[2].attribute, -2);
  EXPECT_EQ(domain.seeds[2].max_area, 0);
  // All rings of a polygon, the second of which is its hole here, are its own.
  EXPECT_EQ(domain.seeds[0].first_segment, 0u);
  EXPECT_EQ(domain.seeds[0].segment_count, 8u);
  EXPECT_EQ(domain.seeds[1].first_segment, 8u);
  EXPECT_EQ(domain.seeds[1].segment_count, 4u);
  EXPECT_EQ(domain.seeds[2].first_segment, 12u);
  EXPECT_EQ(domain.seeds[2].segment_count, 4u);
  // In the polygon, and not in its hole.
  const auto& seed = domain.seeds[0];
  EXPECT_TRUE(seed.x > 0 && seed.x < 4 && seed.y > 0 && seed.y < 4);
  EXPECT_FALSE(seed.x >= 1 && seed.x <= 3 && seed.y >= 1 && seed.y <= 3);
  EXPECT_EQ(Without(domain.SeedOrigin(0)), "a.geojson:1: features[0].geometry.coordinates[0]");
  EXPECT_EQ(Without(domain.SeedOrigin(2)), "a.geojson:2: features[1].geometry.coordinates[1][0]");
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("1 feature with polygons has no property \"kind\""),
                                        HasSubstr("2 features have no property \"side\"")));
}

TEST_F(ReadGeoJsonTest, APolygonWithoutInsideGetsNoRegion) {
  // Its hole is all of it.
  const PlanarDomain domain =
      ReadGood("a.geojson", Feature(Geometry("Polygon", "[[[0,0],[1,0],[2,2]],[[2,2],[1,0],[0,0]]]"), R"({"kind": 1})"),
               {.region_property = "kind"});
  EXPECT_THAT(domain.seeds, IsEmpty());
  EXPECT_THAT(domain.notes, ::testing::Contains(HasSubstr("1 polygon has no inside, and gets no region")));
}

TEST_F(ReadGeoJsonTest, WhatEnclosesNothingIsLeftOutAndCounted) {
  struct Case {
    const char* type;
    const char* coordinates;
    size_t points;
    size_t segments;
    const char* note;
  };
  for (const Case& one : {
           Case{"Polygon", "[[[0,0],[4,0],[0,4]],[[1,1],[2,2]]]", 3, 3,
                "1 ring encloses nothing, and is left out; the first is coordinates[1] in line 1"},
           {"Polygon", "[[[0,0],[4,0],[0,4]],[[1,1],[1,1],[1,1],[1,1]]]", 3, 3, "1 ring encloses nothing"},
           {"Polygon", "[[[0,0],[4,0],[0,4]],[]]", 3, 3, "1 ring encloses nothing"},
           {"Polygon", "[[[0,0],[4,0],[0,4]],[[0.1,0.1],[0.2,0.2],[0.4,0.4],[0.1,0.1]]]", 3, 3, "1 ring encloses"},
           {"Polygon", "[[[0,0],[4,0],[0,4]],[[1,1],[2,1],[2,2],[2,1],[1,1]]]", 3, 3, "1 ring encloses nothing"},
           {"MultiPolygon", "[[[[0,0],[1,0],[0,1]]],[[[5,5],[6,5]],[[7,7],[8,7],[7,8]]]]", 3, 3,
            "2 rings enclose nothing, and are left out; the first is coordinates[1][0] in line 1"},
           {"LineString", "[[1,1],[1,1]]", 0, 0, ""},
           {"MultiLineString", "[[[0,0],[1,1]],[[1,1],[1,1]]]", 2, 1,
            "1 line has no length, and is left out; the first is coordinates[1] in line 1"},
       }) {
    SCOPED_TRACE(one.coordinates);
    if (one.points == 0) {
      EXPECT_THAT(ReadBad("a.geojson", Geometry(one.type, one.coordinates)),
                  AllOf(HasSubstr("no points"), HasSubstr("left out, the first is coordinates in line 1")));
      continue;
    }
    const PlanarDomain domain = ReadGeometry(one.type, one.coordinates);
    EXPECT_EQ(domain.point_count(), one.points);
    EXPECT_EQ(domain.segment_count(), one.segments);
    EXPECT_THAT(Without(absl::StrJoin(domain.notes, "; ")), HasSubstr(one.note));
  }
  // A ring may be hardly more than a line, and may turn both ways.
  EXPECT_EQ(ReadGeometry("Polygon", "[[[0,0],[1,1],[2,2.0000000000000004]]]").segment_count(), 3u);
  EXPECT_EQ(ReadGeometry("Polygon", "[[[0,0],[2,2],[2,0],[0,2]]]").segment_count(), 4u);
}

TEST_F(ReadGeoJsonTest, FeaturesAreGroups) {
  const std::string square = Geometry("Polygon", "[" + Square(0, 0, 4) + "]");
  const std::string two = Geometry("MultiPolygon", "[[" + Square(10, 0, 1) + "],[" + Square(20, 0, 1) + "]]");
  EXPECT_THAT(ReadGood("a.geojson", Feature(two)).groups, IsEmpty());
  EXPECT_THAT(ReadGood("a.geojson", two).groups, IsEmpty());
  const PlanarDomain domain = ReadGood("a.geojson", Features({Feature(square), Feature(two), Feature("null")}));
  std::vector<uint32_t> groups(4, 0);
  groups.resize(12, 4);
  EXPECT_EQ(domain.groups, groups);
}

TEST_F(ReadGeoJsonTest, LongitudesAroundTheWorldGetAWarning) {
  EXPECT_THAT(ReadGeometry("LineString", "[[-100,0],[81,0]]").notes,
              ElementsAre(HasSubstr("longitudes span 181 degrees")));
  EXPECT_THAT(ReadGeometry("LineString", "[[-100,0],[80,0]]").notes, IsEmpty());
  EXPECT_THAT(ReadGeometry("LineString", "[[400000,0],[500000,0]]").notes, IsEmpty());
  EXPECT_THAT(ReadGeometry("LineString", "[[-100,0],[81,91]]").notes, IsEmpty());
}

TEST_F(ReadGeoJsonTest, NumbersAreReadToTheBit) {
  const PlanarDomain domain = ReadGeometry(
      "MultiPoint",
      "[[0.1,1e-400],[9007199254740993,-0],[-0.0,18446744073709551616],[4.9e-324,1.7976931348623157e308]]");
  EXPECT_THAT(domain.points,
              ElementsAre(0.1, 0, 9007199254740992, 0, 0, 18446744073709551616.0, 4.9e-324, 1.7976931348623157e308));
  EXPECT_TRUE(std::signbit(domain.points[3]) && std::signbit(domain.points[4]));
}

TEST_F(ReadGeoJsonTest, WholeNumbersThatNoDoubleIsAreNamed) {
  const PlanarDomain domain = ReadGeometry("MultiPoint", "[[1,2],[9007199254740993,3],[18446744073709551615,1e30]]");
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("2 coordinates are whole numbers that no double is, and are rounded; "
                                                  "the first is 9007199254740993 at coordinates[1][0]")));
  EXPECT_THAT(ReadGeometry("Point", "[9007199254740992,1]").notes, IsEmpty());
  const std::string feature = Feature(Geometry("Polygon", "[" + Square(0, 0, 4) + "]"), R"({"r": 9007199254740993})");
  EXPECT_THAT(ReadBad("a.geojson", feature, {.region_property = "r"}),
              HasSubstr("properties.r: expected a number, or a string, for the attribute of the region, got "
                        "9007199254740993, which no double is"));
}

TEST_F(ReadGeoJsonTest, ErrorsOfGeometryNameThePath) {
  struct Case {
    const char* type;
    const char* coordinates;
    const char* message;
  };
  for (const Case& one : {
           Case{"LineString", "[[0,0],[1]]", "coordinates[1][1]: expected a position of at least 2 numbers, got 1"},
           {"LineString", "[[0,0],[]]", "coordinates: expected a position of at least 2 numbers, got an empty array"},
           {"LineString", "[0,0]",
            "coordinates: expected each position of a LineString in 2 nested arrays, its own "
            "included, got 1"},
           {"Polygon", "[[0,0],[1,0],[0,1]]", "coordinates: expected each position of a Polygon in 3 nested arrays"},
           {"Point", "[[0,0]]", "coordinates: expected each position of a Point in 1 array"},
           {"Polygon", "[[[0,0],[[1,0]]]]",
            "coordinates[0][1][0][0]: expected each position in 3 nested arrays, as the "
            "first one is, got one in 4"},
           {"LineString", "[[0,[0]]]", "coordinates[0][1]: expected a number, as the one before it, got an array"},
           {"LineString", "[[[0,0]],1]", "coordinates[1]: expected an array, as the one before it, got a number"},
           {"LineString", "[[0,\"1\"]]", "coordinates[0][1]: expected a number or an array of them, got \"1\""},
           {"LineString", "[[0,null]]", "coordinates[0][1]: expected a number or an array of them, got null"},
           {"LineString", "[[0,0],{}]", "coordinates[1]: expected a number or an array of them, got an object"},
           {"LineString", "[[0,1e400]]",
            "coordinates[0][1]: expected a number of magnitude below 1.8e308, got \"1e400\""},
           {"LineString", "[[0,NaN]]",
            "coordinates[0][1]: expected JSON: while parsing value - invalid literal; last "
            "read: '0,N' (JSON has neither NaN nor infinities)"},
           {"LineString", "[[0,-Infinity]]", "(JSON has neither NaN nor infinities)"},
           {"MultiPolygon", "[[[[[0,0]]]]]", "coordinates[0][0][0][0]: expected at most 4 nested arrays"},
           {"LineString", "null", "coordinates: expected an array, got null"},
           {"LineString", "{}", "coordinates: expected an array, got an object"},
           {"Circle", "[0,0]",
            "type: expected Point, MultiPoint, LineString, MultiLineString, Polygon, MultiPolygon, "
            "GeometryCollection, Feature or FeatureCollection, got \"Circle\""},
           {"GeometryCollection", "[]", "expected \"geometries\" in a GeometryCollection, got none"},
       }) {
    const std::string message = ReadBad("a.geojson", Geometry(one.type, one.coordinates));
    EXPECT_THAT(message, AllOf(StartsWith("a.geojson:1: "), HasSubstr(one.message))) << one.coordinates;
    const std::string feature =
        ReadBad("a.geojson", Features({Feature("null"), Feature(Geometry(one.type, one.coordinates))}));
    EXPECT_THAT(feature, StartsWith("a.geojson:2: features[1].geometry")) << one.coordinates;
  }
}

TEST_F(ReadGeoJsonTest, ErrorsOfStructureNameThePath) {
  const std::string line = Geometry("LineString", "[[0,0],[1,0]]");
  struct Case {
    std::string text;
    std::string message;
  };
  for (const Case& one : std::vector<Case>{
           {"", "a.geojson:1: expected JSON: while parsing value - unexpected end of input"},
           {"{", "a.geojson:1: expected JSON: while parsing object key - unexpected end of input"},
           {"x", "a.geojson:1: expected JSON: while parsing value - invalid literal; last read: 'x'"},
           {"[]", "a.geojson:1: expected an object of GeoJSON, got an array"},
           {"3", "a.geojson:1: expected an object of GeoJSON, got 3"},
           {"{}", "a.geojson:1: expected an object of GeoJSON, with a \"type\", got one without"},
           {line + line, "a.geojson:1: expected JSON: while parsing value - unexpected '{'; expected end of input"},
           {line + std::string(1, '\0') + "x", "a.geojson:1: expected the end of the file, got a byte 0"},
           {R"({"type":"Topology","objects":{}})", "a.geojson:1: type: expected Point, "},
           {R"({"type":7})", "a.geojson:1: type: expected a string, got 7"},
           {R"({"type":"Feature"})", "a.geojson:1: expected \"geometry\" in a Feature, got none"},
           {R"({"type":"Feature","geometry":7})", "a.geojson:1: geometry: expected a geometry or null, got 7"},
           {R"({"type":"Feature","geometry":[]})", "a.geojson:1: geometry: expected a geometry or null, got an array"},
           {R"({"type":"Feature","geometry":null,"geometry":null})",
            "a.geojson:1: geometry: expected it once, got it again"},
           {Features({line}), "a.geojson:1: features[0].type: expected Feature, got \"LineString\""},
           {Features({"7"}), "a.geojson:1: features[0]: expected a Feature, got 7"},
           {Features({Feature("null"), "[]"}), "a.geojson:2: features[1]: expected a Feature, got an array"},
           {Feature(Feature(line)), "a.geojson:1: geometry.type: expected Point, "},
           {R"({"type":"FeatureCollection","features":{}})", "a.geojson:1: features: expected an array, got an object"},
           {R"({"type":"FeatureCollection","features":[],"coordinates":[]})",
            "a.geojson:1: expected no \"coordinates\" in a FeatureCollection"},
           {R"({"type":"GeometryCollection","geometries":[null]})",
            "a.geojson:1: geometries[0]: expected a geometry, got null"},
           {"\n\n{\"type\":\n\"Feature\",\n\"a\":tru}",
            "a.geojson:5: expected JSON: while parsing value - invalid literal"},
           {"{\"a\":\"\xff\"}", "a.geojson:1: expected JSON: while parsing value - invalid string: ill-formed UTF-8"},
       }) {
    EXPECT_THAT(ReadBad("a.geojson", one.text), StartsWith(one.message)) << one.text;
  }
}

TEST_F(ReadGeoJsonTest, PropertiesOfOtherKindsAreRefused) {
  const std::string polygon = Geometry("Polygon", "[" + Square(0, 0, 1) + "]");
  const auto message = [&](const std::string& properties) {
    return ReadBad("a.geojson", Features({Feature(polygon, properties)}),
                   {.region_property = "kind", .marker_property = "side"});
  };
  EXPECT_EQ(
      message(R"({"kind":true})"),
      "a.geojson:1: features[0].properties.kind: expected a number, or a string, for the attribute of the region, "
      "got true");
  EXPECT_THAT(message(R"({"kind":[1]})"), HasSubstr("got an array"));
  EXPECT_THAT(message(R"({"side":1.5})"),
              HasSubstr("expected a whole number from -2^31 to below 2^31, or a string, for the marker, got 1.5"));
  EXPECT_THAT(message(R"({"side":2147483648})"), HasSubstr("got 2147483648"));
  EXPECT_THAT(message(R"({"side":true})"), HasSubstr("features[0].properties.side: "));
  EXPECT_THAT(message(R"({"side":{"side":1}})"), HasSubstr("got an object"));
}

TEST_F(ReadGeoJsonTest, PropertiesThatAreStringsAreNames) {
  const auto polygon = [](double low) { return Geometry("Polygon", "[" + Square(low, low, 1) + "]"); };
  const DomainOptions options{.region_property = "kind", .marker_property = "side"};
  const PlanarDomain domain = ReadGood("a.geojson",
                                       Features({Feature(polygon(0), R"({"kind":"water","side":"shore"})"),
                                                 Feature(polygon(2), R"({"kind":"land","side":"shore"})"),
                                                 Feature(polygon(4), R"({"kind":"water","side":"quay"})"),
                                                 Feature(polygon(6), R"({"kind":"","side":""})")}),
                                       options);
  EXPECT_THAT(domain.region_names, ElementsAre(std::pair(1, "water"), std::pair(2, "land")));
  EXPECT_THAT(domain.marker_names, ElementsAre(std::pair(1, "shore"), std::pair(2, "quay")));
  ASSERT_EQ(domain.seeds.size(), 3u) << "an empty name is none";
  EXPECT_EQ(domain.seeds[0].attribute, 1);
  EXPECT_EQ(domain.seeds[1].attribute, 2);
  EXPECT_EQ(domain.seeds[2].attribute, 1);
  EXPECT_THAT(domain.markers, ElementsAre(1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 0, 0, 0, 0));

  const auto message = [&](const char* first, const char* second) {
    return ReadBad("a.geojson", Features({Feature(polygon(0), first), Feature(polygon(2), second)}), options);
  };
  EXPECT_THAT(message(R"({"kind":"water"})", R"({"kind":1})"),
              HasSubstr("features[1].properties.kind: expected a string, got 1"));
  EXPECT_THAT(message(R"({"side":1})", R"({"side":"shore"})"),
              HasSubstr("features[1].properties.side: expected a number, as features before have it, got \"shore\""));
}

TEST_F(ReadGeoJsonTest, DeepNestingIsRefused) {
  const auto nested = [](const std::string& open, size_t count) {
    std::string text;
    for (size_t i = 0; i < count; ++i) {
      text += open;
    }
    return text;
  };
  EXPECT_THAT(ReadBad("a.geojson", R"({"a":)" + nested("[", 1000000)), HasSubstr("expected at most 256 nested values"));
  EXPECT_THAT(ReadBad("a.geojson", R"({"properties":)" + nested(R"({"a":)", 1000000)),
              HasSubstr("expected at most 256 nested values"));
  EXPECT_THAT(ReadBad("a.geojson", nested(R"({"type":"GeometryCollection","geometries":[)", 100000)),
              HasSubstr("expected at most 256 nested values"));
  EXPECT_THAT(ReadBad("a.geojson", nested(R"({"type":"Feature","geometry":)", 100000)),
              HasSubstr("geometry.type: expected Point"));
  EXPECT_THAT(ReadBad("a.geojson", R"({"coordinates":)" + nested("[", 1000000)),
              HasSubstr("expected at most 4 nested arrays"));
}

TEST_F(ReadGeoJsonTest, LinesMayEndInAnyWay) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char* part : {"{\"type\":\"LineString\",", "\"coordinates\":[", "[1,", "2],", "[3,4,", "x]]}"}) {
      absl::StrAppend(&text, part, end);
    }
    EXPECT_THAT(ReadBad("a.geojson", text), StartsWith("a.geojson:6: coordinates[1][2]: ")) << end;
  }
}

TEST_F(ReadGeoJsonTest, CutFilesAreRefused) {
  const std::string text = Features({Feature(Geometry("Polygon", "[" + Square(0, 0, 1) + "]"), R"({"a":[1,{}]})")});
  for (size_t size = 0; size < text.size(); ++size) {
    const absl::StatusOr<PlanarDomain> domain = Read("a.geojson", text.substr(0, size));
    EXPECT_EQ(domain.status().code(), absl::StatusCode::kInvalidArgument) << size;
    EXPECT_THAT(domain.status().message(), HasSubstr("a.geojson:1: ")) << size;
  }
}

// The land of the world by Natural Earth, compressed.
std::string Land() {
  const char* folder = std::getenv("WELLSPACE_EXAMPLES_DIR");
  return std::string(folder != nullptr ? folder : "examples") + "/land-110m.geojson.gz";
}

TEST_F(ReadGeoJsonTest, ReadsTheWorld) {
  const absl::StatusOr<PlanarDomain> land = ReadPlanarDomain(Land());
  ASSERT_TRUE(land.ok()) << land.status();
  EXPECT_EQ(land->point_count(), 5000u);
  EXPECT_EQ(land->segment_count(), 5000u);
  EXPECT_EQ(land->faces, PlanarDomain::FaceRule::kUnion);
  EXPECT_EQ(land->unclosed_rings, 0u);
  EXPECT_EQ(land->repeated_points, 0u);
}

TEST_F(ReadGeoJsonTest, ACutArchiveIsRefused) {
  std::ifstream file(Land(), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  ASSERT_GT(bytes.size(), 10000u);
  // In the middle; and within the checksum, when the parser has seen the end of the text.
  for (const size_t size : {bytes.size() / 2, bytes.size() - 5}) {
    EXPECT_THAT(ReadBad("a.geojson.gz", bytes.substr(0, size)), StartsWith("a.geojson.gz: ")) << size;
  }
}

// RFC 8142, and lines as ogr2ogr and jq write them.
TEST_F(ReadGeoJsonTest, TextsOneAfterTheOther) {
  const std::string first = Feature(Geometry("Polygon", "[" + Square(0, 0, 4) + "]"), R"({"a":7,"b":3})");
  const std::string second = Feature(Geometry("Polygon", "[" + Square(5, 0, 1) + "]"), R"({"a":8})");
  const std::string third = Geometry("LineString", "[[9,9],[10,9]]");
  const DomainOptions options = {.region_property = "a", .marker_property = "b"};
  const PlanarDomain together = ReadGood("a.geojson", Features({first, second, Feature(third)}), options);
  for (const auto& [name, text] :
       {std::pair<std::string, std::string>("a.geojsonl", absl::StrCat(first, "\n", second, "\n\n", third)),
        {"a.ndjson", absl::StrCat(first, "\r\n", second, "\r\n", third, "\r\n")},
        {"a.geojsons", absl::StrCat("\x1e", first, "\n\x1e", second, "\n\x1e", third, "\n")},
        {"b.ndjson", absl::StrCat(first, second, third)}}) {
    SCOPED_TRACE(name);
    const PlanarDomain domain = ReadGood(name, text, options);
    EXPECT_EQ(domain.points, together.points);
    EXPECT_EQ(domain.segments, together.segments);
    EXPECT_EQ(domain.markers, together.markers);
    EXPECT_EQ(domain.is_line, together.is_line);
    EXPECT_EQ(domain.seeds, together.seeds);
    EXPECT_EQ(domain.faces, together.faces);
  }
  const PlanarDomain lines = ReadGood("a.geojsonl", absl::StrCat(first, "\n", second, "\n"));
  EXPECT_EQ(Point(lines, 6), "a.geojsonl:2: geometry.coordinates[0][2]");
  EXPECT_EQ(Without(lines.SegmentOrigin(7)), "a.geojsonl:2: geometry.coordinates[0][3]");
  EXPECT_THAT(ReadGood("a.geojsonl", Features({first, second})).points, SizeIs(16));
  EXPECT_THAT(ReadBad("a.geojsonl", first + "\n" + Geometry("Circle", "[]")),
              StartsWith("a.geojsonl:2: type: expected Point"));
  EXPECT_THAT(ReadBad("a.geojsonl", first + "\n[1]"),
              StartsWith("a.geojsonl:2: expected an object of GeoJSON, got an array"));
  EXPECT_THAT(ReadBad("a.geojsonl", first + "\n{\"type\":"), StartsWith("a.geojsonl:2: type: expected JSON: "));
  EXPECT_THAT(ReadBad("a.geojsonl", first + std::string(1, '\0')), StartsWith("a.geojsonl:1: expected JSON: "));
  EXPECT_THAT(ReadBad("a.geojsonl", "\n\x1e\n"), StartsWith("a.geojsonl: no points"));
  EXPECT_THAT(ReadBad("a.geojson", first + "\n" + second), StartsWith("a.geojson:2: expected JSON: "));
}

}  // namespace
}  // namespace wellspace::formats
