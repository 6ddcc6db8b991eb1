// Shapefiles, byte by byte as their description has them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tests/client/formats/domain/read_domain_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

template <typename T>
std::string Little(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

std::string Big(int32_t value) {
  std::string bytes = Little(value);
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string Numbers(const std::vector<double>& values) {
  std::string bytes;
  for (const double value : values) {
    bytes += Little(value);
  }
  return bytes;
}

// The file of records with these contents. All shapes of a file are of one type, or null.
std::string File(int32_t type, const std::vector<std::string>& contents) {
  std::string records;
  for (size_t i = 0; i < contents.size(); ++i) {
    records += Big(static_cast<int32_t>(i + 1)) + Big(static_cast<int32_t>(contents[i].size() / 2)) + contents[i];
  }
  return Big(9994) + std::string(20, '\0') + Big(static_cast<int32_t>((100 + records.size()) / 2)) +
         Little(int32_t{1000}) + Little(type) + Numbers(std::vector<double>(8)) + records;
}

// Polylines and polygons; `more` are the fields that follow the points.
std::string Shape(int32_t type, const std::vector<int32_t>& parts, const std::vector<double>& points,
                  const std::string& more = "") {
  std::string bytes = Little(type) + Numbers({0, 0, 0, 0}) + Little(static_cast<int32_t>(parts.size())) +
                      Little(static_cast<int32_t>(points.size() / 2));
  for (const int32_t part : parts) {
    bytes += Little(part);
  }
  return bytes + Numbers(points) + more;
}

class ReadShapefileTest : public ReadDomainTest {};

const std::vector<double> kTwoRings = {0, 0, 0, 4, 4, 4, 4, 0, 0, 0, 1, 1, 3, 1, 3, 3, 1, 3, 1, 1};

TEST_F(ReadShapefileTest, PolygonsPolylinesAndPoints) {
  const std::string text =
      File(5, {Shape(5, {0, 5}, kTwoRings), Little(int32_t{0}), Shape(5, {0}, {9, 9, 9, 8, 8, 8})});
  const PlanarDomain domain = ReadGood("a.shp", text);
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 0, 4, 4, 4, 4, 0, 1, 1, 3, 1, 3, 3, 1, 3, 9, 9, 9, 8, 8, 8));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 8, 9, 9, 10, 10, 8));
  EXPECT_EQ(domain.faces, ReadGood("a.wkt", "POLYGON((0 0,1 0,0 1))").faces);
  EXPECT_EQ(Without(domain.PointOrigin(5)), "a.shp:1: coordinates[1][0][1]");
  EXPECT_EQ(Without(domain.SegmentOrigin(9)), "a.shp:3: coordinates[0][0][1]");
  EXPECT_THAT(domain.notes, ElementsAre(HasSubstr("1 geometry is null"), HasSubstr("1 ring is closed")));

  // With Z and M, whose numbers follow the points.
  const std::string measures = Numbers({0, 1, 5, 5, 5, 0, 1, -1e39, -1e39, -1e39});
  EXPECT_THAT(ReadGood("a.shp", File(13, {Shape(13, {0}, {0, 0, 1, 0, 1, 1}, measures)})).segments,
              ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(
      ReadGood("a.shp", File(1, {Little(int32_t{1}) + Numbers({5, 6}), Little(int32_t{1}) + Numbers({7, 8})})).points,
      ElementsAre(5, 6, 7, 8));
  EXPECT_THAT(ReadGood("a.shp", File(11, {Little(int32_t{11}) + Numbers({5, 6, 7, 0})})).points, ElementsAre(5, 6));
  const std::string points = Little(int32_t{8}) + Numbers({0, 0, 0, 0}) + Little(int32_t{2}) + Numbers({1, 2, 3, 4});
  const PlanarDomain multi = ReadGood("a.shp", File(8, {points}));
  EXPECT_THAT(multi.points, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(multi.faces, PlanarDomain::FaceRule::kBox);
}

TEST_F(ReadShapefileTest, ErrorsNameTheRecord) {
  const auto bad = [this](const std::string& text) { return ReadBad("a.shp", text); };
  const std::string good = File(5, {Shape(5, {0, 5}, kTwoRings)});
  std::string other = good;
  other[0] = 'x';
  EXPECT_THAT(bad(other), HasSubstr("a.shp: expected a shapefile, with the code 9994 and the version 1000, got "));
  EXPECT_THAT(bad(good + "x"), EndsWith("a.shp:1: expected the end of the file after 320 bytes, as its header says"));
  EXPECT_THAT(bad(""), EndsWith("a.shp: the file ends after 0 bytes; expected 100 more"));
  EXPECT_THAT(
      bad(File(31, {Shape(31, {0}, {0, 0})})),
      EndsWith("a.shp:1: expected a shape of points (1, 8), polylines (3) or polygons (5), or 10 or 20 more with Z "
               "or M, got the type 31"));
  EXPECT_THAT(bad(File(5, {Shape(5, {0, 7, 5}, kTwoRings)})),
              EndsWith("a.shp:1: part 1: expected its points from 7 to at most 10, got 7 to 5"));
  EXPECT_THAT(bad(File(5, {Shape(5, {1}, kTwoRings)})),
              EndsWith("a.shp:1: part 0: expected its points from 0 to at most 10, got 1 to 10"));
  EXPECT_THAT(bad(File(5, {Shape(5, {}, kTwoRings)})), EndsWith("a.shp:1: expected parts with all 10 points, got 0"));
  std::string many = good;
  many.replace(100 + 8 + 40, 4, Little(int32_t{0x7fffffff}));
  EXPECT_THAT(bad(many), HasSubstr("a.shp:1: expected 2 parts and 2147483647 points within the "));
  std::string long_record = good;
  long_record.replace(104, 4, Big(0x7fffffff));
  EXPECT_THAT(bad(long_record), HasSubstr("a.shp:1: expected a record of at least 2 words, within the 320 bytes"));
  std::string not_finite = good;
  not_finite.replace(good.size() - 8, 8, Little(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_THAT(bad(not_finite), EndsWith("a.shp:1: coordinates[1][0][4][1]: expected a finite number, got nan"));
  EXPECT_THAT(bad(File(1, {Little(int32_t{1}) + Numbers({5})})), EndsWith("expected a point of 20 bytes, got 12"));
  for (size_t size = 0; size < good.size(); ++size) {
    EXPECT_THAT(bad(good.substr(0, size)), HasSubstr("the file ends after ")) << size;
  }
}

}  // namespace
}  // namespace wellspace::formats
