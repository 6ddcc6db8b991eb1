// STL, PCD, LAS, and VTK's files as clouds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/read_cloud.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using std::string_literals::operator""s;

const CloudOptions kWithAttributes = {.keep_attributes = true};

template <typename T>
std::string Bytes(T value, bool big_endian = false) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof(T));
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

template <typename T>
void Put(std::string& bytes, size_t at, T value) {
  bytes.replace(at, sizeof(T), Bytes(value));
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<std::string> NamesOf(const PointCloud& cloud) {
  std::vector<std::string> names;
  for (const Attribute& attribute : cloud.attributes) {
    names.push_back(attribute.name);
  }
  return names;
}

class PointFilesTest : public ReadCloudTest {
 protected:
  // Starts of a file are clouds or refused.
  void ExpectCutAnywhereIsNoTrouble(const std::string& name, const std::string& content) {
    for (size_t size = 0; size < content.size(); size += 1 + content.size() / 100) {
      const absl::StatusOr<PointCloud> cloud = Read(name, content.substr(0, size), kWithAttributes);
      EXPECT_TRUE(cloud.ok() || absl::IsInvalidArgument(cloud.status())) << size << cloud.status();
    }
  }
};

constexpr char kAsciiStl[] =
    "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 0\n   vertex 0 1 0.1\n"
    "  endloop\n endfacet\n"
    "facet normal 0 0 -1\nouter loop\nVERTEX 1 0 0\nvertex -0 -0 0\nvertex 0 0 2\nendloop\nendfacet\nendsolid a b\n";

TEST_F(PointFilesTest, StlInAsciiMergesEqualCorners) {
  const PointCloud cloud = ReadGood("a.stl", kAsciiStl);
  EXPECT_EQ(cloud.dimension, 3);
  EXPECT_THAT(cloud.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0.1, 0, 0, 2));
  EXPECT_THAT(cloud.Origin(3), EndsWith("a.stl:13"));
  EXPECT_THAT(cloud.notes, ElementsAre(EndsWith("a.stl: 2 faces are not used, only the points")));
  EXPECT_THAT(ReadGood("a.stl", kAsciiStl, {.columns = {"z", "x"}}).points, ElementsAre(0, 0, 0, 1, 0.1, 0, 2, 0));
  ExpectCutAnywhereIsNoTrouble("a.stl", kAsciiStl);
}

std::string BinaryStl(std::string header, const std::vector<float>& corners) {
  header.resize(80);
  std::string bytes = header + Bytes(static_cast<uint32_t>(corners.size() / 9));
  for (size_t i = 0; i < corners.size(); ++i) {
    bytes += (i % 9 == 0 ? std::string(12, '\x7e') : "") + Bytes(corners[i]) + (i % 9 == 8 ? "\0\1"s : "");
  }
  return bytes;
}

TEST_F(PointFilesTest, StlInBinaryEvenIfItStartsWithSolid) {
  const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0.1F, 1, 0, 0, 0, 0, 0, 0, 0, 2};
  for (const char* header : {"solid of another program", ""}) {
    const PointCloud cloud = ReadGood("a.stl", BinaryStl(header, corners));
    EXPECT_THAT(cloud.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, double{0.1F}, 0, 0, 2));
    EXPECT_THAT(cloud.Origin(3), EndsWith("a.stl[5]"));
    EXPECT_THAT(cloud.notes, ElementsAre(EndsWith("2 faces are not used, only the points")));
  }
  ExpectCutAnywhereIsNoTrouble("a.stl", BinaryStl("solid", corners));
}

TEST_F(PointFilesTest, StlInCapitals) {
  std::string text = "SOLID S\n";
  for (const char* corners :
       {"VERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 0\n", "VERTEX 0 0 0\nVERTEX 0 1 0\nVERTEX 0 0 1\n"}) {
    text += "  FACET NORMAL 0 0 0\nOUTER LOOP\n" + std::string(corners) + "ENDLOOP\nENDFACET\n";
  }
  EXPECT_THAT(ReadGood("a.stl", text + "ENDSOLID S\n").points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1));
}

// Of a writer that did not know the number of triangles when it wrote the header.
TEST_F(PointFilesTest, StlInBinaryWithACountOf0) {
  std::string file(84, '\0');
  for (int i = 0; i < 2; ++i) {
    std::string triangle(50, '\0');
    Put(triangle, 12, 1.0F + static_cast<float>(i));
    file += triangle;
  }
  EXPECT_THAT(ReadGood("a.stl", file).points, ElementsAre(1, 0, 0, 0, 0, 0, 2, 0, 0));
  EXPECT_THAT(ReadBad("a.stl", file.substr(0, 170)), HasSubstr("expected whole triangles"));
}

TEST_F(PointFilesTest, StlErrors) {
  EXPECT_EQ(ReadBad("a.stl", ""), "a.stl:1: expected \"solid\" at the start of the file");
  EXPECT_EQ(ReadBad("a.stl", Replaced(kAsciiStl, "vertex 1e0 0 0", "vertex 1e0 0")),
            "a.stl:5: expected three coordinates after \"vertex\"");
  EXPECT_EQ(ReadBad("a.stl", Replaced(kAsciiStl, "1e0", "one")), "a.stl:5: expected a number, got \"one\"");
  EXPECT_THAT(ReadBad("a.stl", Replaced(kAsciiStl, "1e0", "nan")), HasSubstr("a.stl:5: expected a finite number"));
  EXPECT_THAT(ReadBad("a.stl", Replaced(kAsciiStl, "endloop", "endlop")), HasSubstr("a.stl:7: expected \"facet\""));
  EXPECT_EQ(ReadBad("a.stl", Replaced(kAsciiStl, "endsolid a b\n", "")),
            "a.stl:15: the file ends; expected \"endsolid\"");
  const std::string binary = BinaryStl("", std::vector<float>(18, 1));
  EXPECT_EQ(ReadBad("a.stl", binary.substr(0, 140)),
            "a.stl: byte 140: expected 2 triangles, as the header says; the file ends in triangle 1");
  std::string huge = binary;
  Put<uint32_t>(huge, 80, 4'000'000'000);
  EXPECT_THAT(ReadBad("a.stl", huge), HasSubstr("expected 4000000000 triangles, as the header says"));
  std::string infinite = binary;
  Put(infinite, 84 + 50 + 12, INFINITY);
  EXPECT_THAT(ReadBad("a.stl", infinite), HasSubstr("a.stl: byte 134: triangle 1, corner 0: coordinate 1: expected a "
                                                    "finite number, got inf; --skip-invalid"));
  EXPECT_EQ(ReadGood("a.stl", infinite, {.skip_invalid = true}).skipped, 1);
  EXPECT_THAT(ReadBad("a.stl", kAsciiStl, {.dimension = 2}),
              HasSubstr("expected 2 coordinates, got 3; --columns x,y takes 2 of them"));
}

constexpr char kAsciiPcd[] =
    "# .PCD v.7\nVERSION .7\nFIELDS rgb z x y normal\nSIZE 4 4 4 8 4\nTYPE U F F F F\nCOUNT 1 1 1 1 2\nWIDTH 3\n"
    "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ascii\n"
    "16909060 3 1 2 0.5 nan\n255 6 4 5 1 2\n0 9 7 8 3 4\n";

TEST_F(PointFilesTest, PcdInAscii) {
  const PointCloud cloud = ReadGood("a.pcd", kAsciiPcd, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(cloud.Origin(2), EndsWith("a.pcd:14"));
  EXPECT_THAT(NamesOf(cloud), ElementsAre("red", "green", "blue", "normal:0", "normal:1"));
  EXPECT_THAT(cloud.attributes[0].values, ElementsAre(2, 0, 0));
  EXPECT_THAT(cloud.attributes[2].values, ElementsAre(4, 255, 0));
  EXPECT_THAT(cloud.attributes[3].values, ElementsAre(0.5, 1, 3));
  EXPECT_TRUE(std::isnan(cloud.attributes[4].values[0]));
  EXPECT_THAT(ReadGood("a.pcd", kAsciiPcd).attributes, IsEmpty());
  // A colour may be in a float, as PCL writes it: here 0x3f804020.
  EXPECT_THAT(ReadGood("a.pcd", Replaced(Replaced(kAsciiPcd, "TYPE U", "TYPE F"), "16909060", "1.001956939697265625"),
                       kWithAttributes)
                  .attributes[0]
                  .values[0],
              128);
  ExpectCutAnywhereIsNoTrouble("a.pcd", kAsciiPcd);
}

constexpr char kBinaryPcdHeader[] =
    "VERSION .7\nFIELDS x y z _ i\nSIZE 4 8 4 1 2\nTYPE F F I U I\nCOUNT 1 1 1 3 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ";

TEST_F(PointFilesTest, PcdOfVersion06CallsFieldsColumns) {
  EXPECT_EQ(ReadGood("a.pcd", Replaced(kAsciiPcd, "FIELDS", "COLUMNS"), kWithAttributes).points,
            ReadGood("a.pcd", kAsciiPcd, kWithAttributes).points);
}

TEST_F(PointFilesTest, PcdInBinary) {
  const std::string first = Bytes(0.5F) + Bytes(0.1) + Bytes(int32_t{-7}) + "abc" + Bytes(int16_t{-2});
  const std::string second = Bytes(1.5F) + Bytes(1e300) + Bytes(int32_t{9}) + "abc" + Bytes(int16_t{300});
  const std::string file = kBinaryPcdHeader + "binary\n"s + first + second;
  const PointCloud cloud = ReadGood("a.pcd", file, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(0.5, 0.1, -7, 1.5, 1e300, 9));
  EXPECT_THAT(cloud.attributes, ElementsAre(Attribute{"i", {-2, 300}}));
  EXPECT_THAT(cloud.Origin(1), EndsWith("a.pcd[1]"));
  EXPECT_THAT(ReadBad("a.pcd", file.substr(0, file.size() - 1)),
              HasSubstr("expected 2 points of 21 bytes, as the header says; the file ends in point 1"));
  EXPECT_THAT(ReadBad("a.pcd", Replaced(file, "POINTS 2", "POINTS 4000000000")), HasSubstr("in point 2"));
  EXPECT_THAT(ReadBad("a.pcd", Replaced(file, Bytes(1.5F), Bytes(NAN))),
              HasSubstr("a.pcd[1]: coordinate 1: expected a finite number, got nan"));
  EXPECT_THAT(ReadGood("a.pcd", Replaced(file, Bytes(0.5F), Bytes(NAN)), {.skip_invalid = true}).Origin(0),
              EndsWith("a.pcd[1]"));
  ExpectCutAnywhereIsNoTrouble("a.pcd", file);
}

// Field by field; the bytes are a run, a short reference and a long one that goes on in its own output.
TEST_F(PointFilesTest, PcdCompressedByLzf) {
  const std::string header =
      "FIELDS x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA binary_compressed\n";
  // x: four times 1.5; y: 0.25, 1.5, 1.5, 1.5.
  const std::string compressed = "\3"s + Bytes(1.5F) + "\xe0\3\3"s + "\3"s + Bytes(0.25F) + "\x40\7"s + "\xe0\x1\3"s;
  const auto file = [&](uint32_t compressed_bytes, uint32_t bytes, const std::string& data) {
    return header + Bytes(compressed_bytes) + Bytes(bytes) + data;
  };
  const auto size = static_cast<uint32_t>(compressed.size());
  const std::string data = "\3"s + Bytes(1.5F) + "\xe0\3\3"s + "\3"s + Bytes(0.25F) + "\x40\7"s + "\xc0\3"s;
  const auto data_size = static_cast<uint32_t>(data.size());
  EXPECT_THAT(ReadGood("a.pcd", file(data_size, 32, data)).points,
              ElementsAre(1.5, 0.25, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5));
  EXPECT_THAT(ReadBad("a.pcd", file(size, 32, compressed)), HasSubstr("expected 32 bytes, got more"));
  EXPECT_THAT(ReadBad("a.pcd", file(data_size, 31, data)), HasSubstr("expected 4 points of 8 bytes"));
  EXPECT_THAT(ReadBad("a.pcd", file(data_size - 2, 32, data)),
              HasSubstr("LZF, compressed byte 15: expected 32 bytes, got 24"));
  EXPECT_THAT(ReadBad("a.pcd", file(4'000'000'000, 32, data)),
              HasSubstr("expected 4000000000 compressed bytes from byte 96 on; the file ends"));
  EXPECT_THAT(ReadBad("a.pcd", file(3, 32, "\xe0\3\3"s)),
              HasSubstr("LZF, compressed byte 3: expected a reference to one of 0 bytes before, got 4"));
  ExpectCutAnywhereIsNoTrouble("a.pcd", file(data_size, 32, data));
}

TEST_F(PointFilesTest, PcdErrors) {
  const auto message = [this](const std::string& from, const std::string& to) {
    return ReadBad("a.pcd", Replaced(kAsciiPcd, from, to));
  };
  EXPECT_EQ(ReadBad("a.pcd", "x y z\n"),
            "a.pcd:1: expected \"VERSION\" or \"FIELDS\" at the start of the file, got \"x\"");
  EXPECT_EQ(message("SIZE 4", "SIZE 3"), "a.pcd:4: expected a size of 1, 2, 4 or 8, got \"3\"");
  EXPECT_EQ(message("SIZE 4 4", "SIZE 4"), "a.pcd:4: expected a value for each of 5 fields, got 4");
  EXPECT_EQ(message("TYPE U", "TYPE S"), "a.pcd:5: expected a type F, I or U, got \"S\"");
  EXPECT_EQ(message("1 1 1 1 2", "1 1 1 1 0"), "a.pcd:6: expected a count from 1 to 65536, got \"0\"");
  EXPECT_EQ(message("SIZE 4 4", "SIZE 4 2"), "a.pcd:11: expected a size of 4 or 8 of field \"z\" of type F, got 2");
  EXPECT_EQ(message("POINTS 3", "POINTS x"), "a.pcd:10: expected \"POINTS\" and a whole number below 2^32");
  EXPECT_EQ(message("POINTS 3\n", ""), "a.pcd:10: expected \"FIELDS\" and \"POINTS\" before \"DATA\"");
  EXPECT_EQ(message("POINTS 3", "POINTS 4"), "a.pcd:14: expected 4 points, as the header says; the file ends after 3");
  EXPECT_EQ(message("4 5 1 2", "4 5 1"), "a.pcd:13: expected a value of field \"normal\", as the header says");
  EXPECT_EQ(message("4 5 1 2", "4 5 1 2 3"), "a.pcd:13: expected the end of the line, as the header says, got \"3\"");
  EXPECT_EQ(message(" x ", " u "), "a.pcd:11: expected one x, one y and at most one z; --columns takes others");
  EXPECT_EQ(message("DATA ascii", "DATA text"),
            "a.pcd:11: expected \"DATA ascii\", \"DATA binary\" or \"DATA binary_compressed\"");
}

// A file of LAS with two points after a record of variable length. Version 1.2, or 1.4 with the long count.
std::string Las(uint8_t minor, uint8_t format, const std::vector<std::string>& records) {
  std::string bytes(minor == 4 ? 375 : 227, '\0');
  bytes.replace(0, 4, "LASF");
  Put<uint8_t>(bytes, 24, 1);
  Put<uint8_t>(bytes, 25, minor);
  Put<uint16_t>(bytes, 94, bytes.size());
  Put<uint32_t>(bytes, 96, bytes.size() + 60);
  Put<uint32_t>(bytes, 100, 1);
  Put<uint8_t>(bytes, 104, format);
  Put<uint16_t>(bytes, 105, records[0].size());
  if (minor == 4) {
    Put<uint64_t>(bytes, 247, records.size());
  } else {
    Put<uint32_t>(bytes, 107, records.size());
  }
  for (int axis = 0; axis < 3; ++axis) {
    Put<double>(bytes, 131 + 8 * axis, 0.25);
    Put<double>(bytes, 155 + 8 * axis, 1000.0 * axis);
  }
  bytes += std::string(60, 'v');
  for (const std::string& record : records) {
    bytes += record;
  }
  return bytes;
}

std::string LasRecord(size_t size, int32_t x, int32_t y, int32_t z) {
  std::string record(size, '\0');
  Put(record, 0, x);
  Put(record, 4, y);
  Put(record, 8, z);
  Put<uint16_t>(record, 12, 500 + x);
  return record;
}

TEST_F(PointFilesTest, Las12WithTimeAndColour) {
  std::string record = LasRecord(34 + 2, -4, 5, 6);  // two bytes more than the format has
  Put<uint8_t>(record, 14, 0b01'011'010);            // return 2 of 3
  Put<uint8_t>(record, 15, 0b011'00110);             // class 6
  Put<int8_t>(record, 16, -12);
  Put<uint8_t>(record, 17, 77);
  Put<uint16_t>(record, 18, 4242);
  Put<double>(record, 20, 123456.75);
  Put<uint16_t>(record, 28, 65535);
  Put<uint16_t>(record, 30, 256);
  Put<uint16_t>(record, 32, 1);
  std::string withheld = record;
  Put<uint8_t>(withheld, 15, 0b100'00110);
  const std::string file = Las(2, 3, {withheld, record});
  const PointCloud cloud = ReadGood("a.las", file, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(-1, 1001.25, 2001.5));
  EXPECT_THAT(
      cloud.attributes,
      ElementsAre(Attribute{"intensity", {496}}, Attribute{"return_number", {2}}, Attribute{"number_of_returns", {3}},
                  Attribute{"classification", {6}}, Attribute{"scan_angle", {-12}}, Attribute{"user_data", {77}},
                  Attribute{"point_source_id", {4242}}, Attribute{"gps_time", {123456.75}}, Attribute{"red", {65535}},
                  Attribute{"green", {256}}, Attribute{"blue", {1}}));
  EXPECT_THAT(cloud.Origin(0), EndsWith("a.las[1]"));
  EXPECT_THAT(cloud.notes, ElementsAre(EndsWith("1 point is left out, which the file marks as withheld")));
  EXPECT_THAT(ReadGood("a.las", file, {.dimension = 2, .columns = {"x", "gps_time"}}).points,
              ElementsAre(-1, 123456.75));
  ExpectCutAnywhereIsNoTrouble("a.las", file);
}

TEST_F(PointFilesTest, Las14WithInfrared) {
  std::string record = LasRecord(38, 4, 8, 12);
  Put<uint8_t>(record, 14, 0xb9);  // return 9 of 11
  Put<uint8_t>(record, 16, 200);
  Put<uint8_t>(record, 17, 3);
  Put<int16_t>(record, 18, -5000);
  Put<uint16_t>(record, 20, 9);
  Put<double>(record, 22, 0.5);
  Put<uint16_t>(record, 34, 11);
  Put<uint16_t>(record, 36, 12);
  const PointCloud cloud = ReadGood("a.las", Las(4, 8, {record, LasRecord(38, 8, 0, 0)}), kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(1, 1002, 2003, 2, 1000, 2000));
  EXPECT_THAT(NamesOf(cloud),
              ElementsAre("intensity", "return_number", "number_of_returns", "classification", "scan_angle",
                          "user_data", "point_source_id", "gps_time", "red", "green", "blue", "nir"));
  std::vector<double> of_first;
  for (const Attribute& attribute : cloud.attributes) {
    of_first.push_back(attribute.values[0]);
  }
  EXPECT_THAT(of_first, ElementsAre(504, 9, 11, 200, -30, 3, 9, 0.5, 0, 0, 11, 12));
}

TEST_F(PointFilesTest, ACutLasIsReadAsFarAsItGoes) {
  const std::string whole = Las(2, 0, {LasRecord(20, 4, 8, 12), LasRecord(20, 8, 0, 0), LasRecord(20, 0, 0, 0)});
  const PointCloud cloud = ReadGood("a.las", whole.substr(0, whole.size() - 21), {.skip_invalid = true});
  EXPECT_THAT(cloud.points, ElementsAre(1, 1002, 2003));
  EXPECT_EQ(cloud.skipped, 2);
  EXPECT_THAT(cloud.notes, ElementsAre(HasSubstr("the file ends after 1 of 3 points, as its header says"),
                                       HasSubstr("2 points are left out, of which a coordinate is missing")));
  EXPECT_THAT(ReadBad("a.las", whole.substr(0, whole.size() - 21)),
              HasSubstr("got 1, which --skip-invalid takes alone"));
  EXPECT_EQ(ReadGood("a.las", whole, {.skip_invalid = true}).skipped, 0);
}

TEST_F(PointFilesTest, LasErrors) {
  const std::string good = Las(2, 0, {LasRecord(20, 1, 2, 3)});
  const auto with = [&](size_t at, auto value) {
    std::string bytes = good;
    Put(bytes, at, value);
    return ReadBad("a.las", bytes);
  };
  EXPECT_EQ(ReadBad("a.las", "PLY"), "a.las: byte 0: expected \"LASF\" at the start of a file of LAS, got \"PLY\"");
  EXPECT_EQ(ReadBad("a.las", good.substr(0, 100)),
            "a.las: byte 100: expected a header of at least 227 bytes; the file ends");
  EXPECT_EQ(with(25, uint8_t{5}), "a.las: byte 24: expected version 1.0 to 1.4, got 1.5");
  EXPECT_EQ(with(104, uint8_t{11}), "a.las: byte 104: expected a point format from 0 to 10, got 11");
  EXPECT_EQ(with(104, uint8_t{1}), "a.las: byte 105: expected points of at least 28 bytes in format 1, got 20");
  EXPECT_EQ(with(104, uint8_t{0x80}),
            "a.las: byte 104: the points are compressed (LAZ), which is not read; expected LAS, as laszip -i IN -o "
            "OUT.las or pdal translate IN OUT.las make it");
  EXPECT_THAT(with(96, uint32_t{10}), HasSubstr("a.las: byte 94: expected a header of at least 227 bytes"));
  EXPECT_THAT(with(96, uint32_t{4'000'000'000}), HasSubstr("from byte 4000000000 on; the file ends"));
  EXPECT_EQ(with(107, uint32_t{4'000'000'000}),
            "a.las: byte 307: expected 4000000000 points of 20 bytes, as the header says, got 1, which "
            "--skip-invalid takes alone; the file ends");
  EXPECT_THAT(with(131, std::numeric_limits<double>::infinity()),
              HasSubstr("a.las: byte 131: expected a finite scale other than 0 and a finite offset of coordinate 1, "
                        "got inf and "));
  // All points would be one.
  EXPECT_THAT(with(139, 0.0), HasSubstr("a.las: byte 139: expected a finite scale other than 0"));
  EXPECT_THAT(with(155, std::numeric_limits<double>::quiet_NaN()), HasSubstr("and a finite offset of coordinate 1"));
  // Beyond the largest double only with the scale.
  std::string large = good;
  Put(large, 131, 1e308);
  Put(large, 155, 1.7e308);
  EXPECT_THAT(ReadBad("a.las", large),
              HasSubstr("a.las: byte 287: point 0: coordinate 1: expected a finite number, got inf"));
  EXPECT_EQ(ReadGood("a.las", good).size(), 1);
  EXPECT_THAT(ReadBad("b.laz", Replaced(good, "\x14\0"s, "\x14\0"s).replace(104, 1, "\x80")), HasSubstr("LAZ"));
}

constexpr char kAsciiVtk[] =
    "# vtk DataFile Version 3.0\ntitle # of it\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n1 2 3 4 5\n6\n7 8 9.5\n"
    "POLYGONS 1 4\n3 0 1 2\nCELL_DATA 1\nSCALARS material int\nLOOKUP_TABLE default\n5\n"
    "POINT_DATA 3\nSCALARS heat%20flux double 1\nLOOKUP_TABLE mine\n0.5 nan 2.5\n"
    "LOOKUP_TABLE mine 2\n0 0 0 1 1 1 1 1\nVECTORS wind float\n1 2 3 4 5 6 7 8 9\n"
    "FIELD FieldData 2\nid 1 3 long\n7 8 9\nx 1 3 int\n1 2 3\n";

TEST_F(PointFilesTest, VtkInAscii) {
  const PointCloud cloud = ReadGood("a.vtk", kAsciiVtk, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9.5));
  EXPECT_THAT(NamesOf(cloud), ElementsAre("heat flux", "wind:0", "wind:1", "wind:2", "id", "x:0"));
  EXPECT_EQ(cloud.attributes[0].values[2], 2.5);
  EXPECT_TRUE(std::isnan(cloud.attributes[0].values[1]));
  EXPECT_THAT(cloud.attributes[2].values, ElementsAre(2, 5, 8));
  EXPECT_THAT(cloud.attributes[4].values, ElementsAre(7, 8, 9));
  EXPECT_THAT(ReadGood("a.vtk", kAsciiVtk).attributes, IsEmpty());
  EXPECT_THAT(ReadGood("a.vtk", kAsciiVtk, {.columns = {"y", "id"}}).points, ElementsAre(2, 7, 5, 8, 8, 9));
  ExpectCutAnywhereIsNoTrouble("a.vtk", kAsciiVtk);
}

TEST_F(PointFilesTest, VtkInBinaryOfVersion5) {
  const std::string file = "# vtk DataFile Version 5.1\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 double\n" +
                           Bytes(1.0, true) + Bytes(2.0, true) + Bytes(0.1, true) + Bytes(4.0, true) +
                           Bytes(5.0, true) + Bytes(6.0, true) + "\nMETADATA\nINFORMATION 0\n\nCELLS 2 1\n" +
                           "OFFSETS vtktypeint64\n" + Bytes(int64_t{0}, true) + Bytes(int64_t{1}, true) +
                           "\nCONNECTIVITY vtktypeint64\n" + Bytes(int64_t{1}, true) + "\nCELL_TYPES 1\n" +
                           Bytes(int32_t{1}, true) + "\nPOINT_DATA 2\nSCALARS bits bit\nLOOKUP_TABLE default\n\x40\n" +
                           "SCALARS s short 1\nLOOKUP_TABLE default\n" + Bytes(int16_t{-3}, true) +
                           Bytes(int16_t{1000}, true) + "\nCOLOR_SCALARS rgb 3\n\1\2\3\4\5\xff\n";
  const PointCloud cloud = ReadGood("a.vtk", file, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 0.1, 4, 5, 6));
  EXPECT_THAT(NamesOf(cloud), ElementsAre("bits", "s", "rgb:0", "rgb:1", "rgb:2"));
  EXPECT_THAT(cloud.attributes[0].values, ElementsAre(0, 1));
  EXPECT_THAT(cloud.attributes[1].values, ElementsAre(-3, 1000));
  EXPECT_THAT(cloud.attributes[4].values, ElementsAre(3, 255));
  ExpectCutAnywhereIsNoTrouble("a.vtk", file);
  EXPECT_THAT(ReadBad("a.vtk", Replaced(file, "POINTS 2", "POINTS 4000000000")),
              HasSubstr("expected 12000000000 numbers after POINTS, got "));
}

// Words are not told apart by lines.
TEST_F(PointFilesTest, VtkWithDataOnTheLineOfAHeader) {
  const std::string text =
      "# vtk DataFile Version 1.0\na track\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0\n1 0 0\n1 1 0\n0 1 1\n\n"
      "LINES 1 5 4\n0\n1\n2\n3\n\nPOINT_DATA 4\nSCALARS t float\nLOOKUP_TABLE default\n1\n2\n3\n4\n";
  const PointCloud cloud = ReadGood("a.vtk", text, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 1));
  ASSERT_THAT(NamesOf(cloud), ElementsAre("t"));
  EXPECT_THAT(cloud.attributes[0].values, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(cloud.notes, ElementsAre(EndsWith("1 cell is not used, only the points")));
  EXPECT_THAT(ReadGood("a.vtk", text).notes, ElementsAre(EndsWith("1 cell is not used, only the points")));
}

TEST_F(PointFilesTest, VtkErrors) {
  const auto message = [this](const std::string& from, const std::string& to) {
    return ReadBad("a.vtk", Replaced(kAsciiVtk, from, to), kWithAttributes);
  };
  EXPECT_EQ(ReadBad("a.vtk", "vtk\n"), "a.vtk:1: expected \"# vtk DataFile Version\" at the start of the file");
  EXPECT_EQ(message("ASCII", "TEXT"), "a.vtk:3: expected \"ASCII\" or \"BINARY\", got \"TEXT\"");
  EXPECT_EQ(message("POLYDATA", "TABLE"),
            "a.vtk:4: expected DATASET POLYDATA, UNSTRUCTURED_GRID, STRUCTURED_GRID, STRUCTURED_POINTS or "
            "RECTILINEAR_GRID, got \"TABLE\"");
  EXPECT_THAT(message("3 float", "3 half"), HasSubstr("a.vtk:5: expected a type of numbers"));
  EXPECT_THAT(message("POINTS 3", "POINTS 5000000000"), HasSubstr("a.vtk:5: expected a whole number of at most"));
  EXPECT_EQ(message("9.5\n", "nine\n"), "a.vtk:8: expected a number, got \"nine\"");
  EXPECT_THAT(message("9.5\n", "inf\n"), HasSubstr("a.vtk[2]: coordinate 3: expected a finite number"));
  EXPECT_THAT(message("POLYGONS", "POLYGON"), HasSubstr("a.vtk:9: expected the start of a section"));
  EXPECT_EQ(message("POINT_DATA 3", "POINT_DATA 4"), "a.vtk:15: expected data of 3 points, got 4");
  EXPECT_EQ(ReadBad("a.vtk", "# vtk DataFile Version 3.0\n\nASCII\n"), "a.vtk:3: the file ends; expected \"POINTS\"");
}

constexpr char kVtp[] =
    "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\"><PolyData>"
    "<Piece NumberOfPoints=\"2\" NumberOfVerts=\"0\"><PointData><DataArray type=\"Float32\" Name=\"heat\" "
    "format=\"ascii\">1.5 nan</DataArray><DataArray type=\"UInt8\" Name=\"rgb\" NumberOfComponents=\"3\" "
    "format=\"binary\">BgAAAAECAwQF/w==</DataArray></PointData><Points><DataArray type=\"Float64\" "
    "NumberOfComponents=\"3\" format=\"ascii\">0.1 2 3\n4 5 6</DataArray></Points></Piece></PolyData></VTKFile>\n";

TEST_F(PointFilesTest, VtpAndVtu) {
  const PointCloud cloud = ReadGood("a.vtp", kVtp, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(0.1, 2, 3, 4, 5, 6));
  EXPECT_THAT(NamesOf(cloud), ElementsAre("heat", "rgb:0", "rgb:1", "rgb:2"));
  EXPECT_EQ(cloud.attributes[0].values[0], 1.5);
  EXPECT_TRUE(std::isnan(cloud.attributes[0].values[1]));
  EXPECT_THAT(cloud.attributes[3].values, ElementsAre(3, 255));
  EXPECT_THAT(ReadGood("a.vtp", kVtp).attributes, IsEmpty());
  EXPECT_THAT(cloud.Origin(1), EndsWith("a.vtp[1]"));
  const std::string vtu =
      Replaced(Replaced(Replaced(kVtp, "PolyData", "UnstructuredGrid"), "<PolyData", "<UnstructuredGrid"), "</PolyData",
               "</UnstructuredGrid");
  EXPECT_EQ(ReadGood("a.vtu", Replaced(vtu, "NumberOfVerts", "NumberOfCells")).points, cloud.points);
  EXPECT_THAT(ReadBad("a.vtp", vtu), HasSubstr("a.vtp:1: expected <VTKFile type=\"PolyData\" ...>"));
  EXPECT_THAT(ReadBad("a.vtp", Replaced(kVtp, "NumberOfPoints=\"2\"", "NumberOfPoints=\"3\"")),
              HasSubstr("expected 9 coordinates for 3 points, got 6"));
  EXPECT_THAT(ReadBad("a.vtp", Replaced(kVtp, "1.5 nan", "1.5"), kWithAttributes),
              HasSubstr("expected 1 values of \"heat\" for each of 2 points, got 1"));
  EXPECT_THAT(ReadBad("a.vtp", Replaced(kVtp, "UInt8", "UInt9"), kWithAttributes),
              HasSubstr("a.vtp:1: expected Bit, a type from Int8 to UInt64, Float32 or Float64, got \"UInt9\""));
  ExpectCutAnywhereIsNoTrouble("a.vtp", kVtp);
}

// A grid whose points are all there, and bits, which fill bytes.
TEST_F(PointFilesTest, StructuredGridsAndBits) {
  const std::string text =
      "<VTKFile type=\"StructuredGrid\" header_type=\"UInt32\"><StructuredGrid WholeExtent=\"0 1 0 1 2 2\">"
      "<Piece Extent=\"0 1 0 1 2 2\"><PointData><DataArray type=\"Bit\" Name=\"b\" format=\"binary\">AQAAAKA="
      "</DataArray></PointData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 1 1 0 "
      "1 "
      "0 1 1 1 1 2</DataArray></Points></Piece></StructuredGrid></VTKFile>";
  const PointCloud cloud = ReadGood("a.vts", text, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 2));
  ASSERT_EQ(cloud.attributes.size(), 1);
  EXPECT_THAT(cloud.attributes[0].values, ElementsAre(1, 0, 1, 0));
  EXPECT_THAT(cloud.notes, ElementsAre(HasSubstr("1 cell is not used")));
  for (const char* extent : {"", "0 1 0 1 2", "0 1 0 1 2 x", "1 0 0 1 2 2", "0 2147483647 0 2147483647 0 0"}) {
    EXPECT_THAT(ReadBad("a.vts", Replaced(text, "Piece Extent=\"0 1 0 1 2 2", "Piece Extent=\""s + extent)),
                HasSubstr("Extent"))
        << extent;
  }
  EXPECT_THAT(ReadBad("a.vts", Replaced(text, "Piece Extent=\"0 1", "Piece Extent=\"0 2")),
              HasSubstr("expected 18 coordinates for 6 points, got 12"));
  ExpectCutAnywhereIsNoTrouble("a.vts", text);
}

// VTK names components line by line: those without a name are blank lines, which else end the lines about an array.
TEST_F(PointFilesTest, BlankNamesOfComponents) {
  const PointCloud cloud =
      ReadGood("a.vtk",
               "# vtk DataFile Version 5.1\nt\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 1 1 0 2\n"
               "METADATA\nCOMPONENT_NAMES\n\nnorth\n\nINFORMATION 0\n\nPOINT_DATA 2\nVECTORS v "
               "float\n1 2 3 4 5 6\nMETADATA\nCOMPONENT_NAMES\nx\n\n\nINFORMATION 1\nNAME a LOCATION "
               "b\nDATA 1 2\n\nSCALARS s int 1\nLOOKUP_TABLE default\n7\n8\n",
               kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(0, 0, 1, 1, 0, 2));
  EXPECT_THAT(NamesOf(cloud), ElementsAre("v:0", "v:1", "v:2", "s"));
  EXPECT_THAT(cloud.attributes[3].values, ElementsAre(7, 8));
}

// Points of meshes, whatever their elements are.
constexpr char kMsh[] =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 7 \"sea\"\n$EndPhysicalNames\n"
    "$Nodes\n4\n3 0 0 0\n9 1 0 0.5\n1 1 1 0\n2 0 1 0\n$EndNodes\n$Elements\n1\n1 3 2 7 1 3 9 1 2\n$EndElements\n";
constexpr char kMedit[] =
    "MeshVersionFormatted 2\nDimension 3 # of space\nVertices 4\n0 0 0 1  1 0 0.5 1\n1 1 0 0\n0 1 0 0\n"
    "Quadrilaterals 1\n1 2 3 4 7\nEnd\n";

TEST_F(PointFilesTest, MshAndMeditAreReadAsPoints) {
  for (const auto& [name, text] : {std::pair("a.msh", kMsh), std::pair("a.mesh", kMedit)}) {
    SCOPED_TRACE(name);
    const PointCloud cloud = ReadGood(name, text);
    EXPECT_EQ(cloud.dimension, 3);
    EXPECT_THAT(cloud.points, ElementsAre(0, 0, 0, 1, 0, 0.5, 1, 1, 0, 0, 1, 0));
    EXPECT_THAT(cloud.notes, IsEmpty());
    EXPECT_THAT(cloud.Origin(3), EndsWith(name + "[3]"s));
    EXPECT_THAT(ReadGood(name, text, {.columns = {"z", "x"}}).points, ElementsAre(0, 0, 0.5, 1, 0, 1, 0, 0));
    EXPECT_EQ(ReadBad(name, text, {.dimension = 2}),
              name + ": expected 2 coordinates, got 3; --columns x,y takes 2 of them"s);
    EXPECT_THAT(ReadBad(name, Replaced(text, "0.5", "nan")), HasSubstr("expected a finite number, got \"nan\""));
    const PointCloud skipped =
        ReadGood(name, Replaced(Replaced(text, "0.5", "nan"), "0 1 0", "0 1 7"), {.skip_invalid = true});
    EXPECT_THAT(skipped.points, ElementsAre(0, 0, 0, 1, 1, 0, 0, 1, 7));
    EXPECT_EQ(skipped.skipped, 1);
    EXPECT_THAT(skipped.Origin(2), EndsWith(name + "[3]"s));
    EXPECT_THAT(ReadBad(name, Replaced(text, "0.5", "half"), {.skip_invalid = true}),
                HasSubstr("expected a number, got \"half\""));
    ExpectCutAnywhereIsNoTrouble(name, text);
  }
  EXPECT_EQ(ReadBad("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"), "a.msh:3: the file ends; expected \"$Nodes\"");
  EXPECT_EQ(ReadBad("a.mesh", "MeshVersionFormatted 2\nDimension 3\nEnd\n"),
            "a.mesh:3: the file ends; expected Vertices");
  EXPECT_THAT(ReadGood("b.mesh", "MeshVersionFormatted 1 Dimension 2 Vertices 1 0.5 2 7").points, ElementsAre(0.5, 2));
}

// Formats with three coordinates in the plane, too: z = 0 everywhere is no third dimension, unless it is asked for.
TEST_F(PointFilesTest, PaddedPointsAreInThePlane) {
  const std::string flat = Replaced(kMsh, "0.5", "0");
  const PointCloud plane = ReadGood("a.msh", flat);
  EXPECT_EQ(plane.dimension, 2);
  EXPECT_THAT(plane.points, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
  EXPECT_THAT(plane.notes, ElementsAre(EndsWith(
                               "a.msh: all points have z = 0, and are taken in the plane; --columns x,y,z takes them "
                               "in space")));
  const PointCloud wanted = ReadGood("a.msh", flat, {.dimension = 2});
  EXPECT_EQ(wanted.points, plane.points);
  EXPECT_THAT(wanted.notes, IsEmpty());
  EXPECT_EQ(ReadGood("a.msh", flat, {.dimension = 3}).dimension, 3);
  EXPECT_EQ(ReadGood("a.msh", flat, {.columns = {"x", "y", "z"}}).dimension, 3);
  const PointCloud legacy = ReadGood(
      "a.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n");
  EXPECT_THAT(legacy.points, ElementsAre(0, 0, 1, 0, 0, 1, 1, 1));
  // Elsewhere a program has written it.
  const PointCloud table = ReadGood("a.csv", "0,0,7\n1,0,7\n1,1,7\n0,1,7\n");
  EXPECT_EQ(table.dimension, 3);
  EXPECT_THAT(table.notes, ElementsAre(EndsWith(
                               "a.csv: all points have z = 7, and are taken in space; --columns x,y takes them in the "
                               "plane")));
  EXPECT_THAT(ReadGood("a.csv", "0,0,7\n1,0,7\n1,1,7\n0,1,6\n").notes, IsEmpty());
}

}  // namespace
}  // namespace wellspace::formats
