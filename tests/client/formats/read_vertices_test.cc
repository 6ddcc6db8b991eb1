// PLY, OBJ and OFF.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "client/formats/io/number.h"
#include "client/formats/read_cloud.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ReadVerticesTest : public ReadCloudTest {};

constexpr char kAscii[] =
    "ply\nformat ascii 1.0\ncomment by hand\nobj_info #1\n"
    "element camera 2\nproperty list uchar float view\n"
    "element vertex 3\nproperty uchar red\nproperty double z\nproperty list uchar int tags\nproperty float x\n"
    "property short y\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "1 0.5\n0\n"
    "255 3 0 1 2\n7 6 2 8 9 4 5\n\n0 0.1 1 nan -8 9\n"
    "3 0 1 2\n";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(ReadVerticesTest, PlyInAscii) {
  const PointCloud cloud = ReadGood("cloud.ply", kAscii);
  EXPECT_EQ(cloud.dimension, 3);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6, -8, 9, 0.1));
  EXPECT_THAT(cloud.Origin(0), EndsWith("cloud.ply:18"));
  EXPECT_THAT(cloud.Origin(2), EndsWith("cloud.ply:21"));
  EXPECT_EQ(ReadGood("cloud.ply", Replaced(kAscii, "double z", "double depth")).dimension, 2);
  EXPECT_THAT(ReadGood("cloud.ply",
                       "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty double y\r\n"
                       "property double x\r\nend_header\r\n1 2\r\n")
                  .points,
              ElementsAre(2, 1));
}

// Appends `value` in the byte order of the file.
template <typename T>
void Append(T value, bool big_endian, std::string& bytes) {
  char word[sizeof(T)];
  std::memcpy(word, &value, sizeof(T));
  if (big_endian) {
    std::reverse(word, word + sizeof(T));
  }
  bytes.append(word, sizeof(T));
}

std::string BinaryPly(bool big_endian, const std::vector<double>& points) {
  std::string file = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                     "_endian 1.0\nelement first 2\nproperty list uint16 int16 many\nproperty int8 one\n"
                     "element vertex " +
                     std::to_string(points.size() / 3) +
                     "\nproperty float64 x\nproperty list int8 double skipped\nproperty float64 y\nproperty uint8 red\n"
                     "property float64 z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const uint16_t length : {30, 0}) {
    Append<uint16_t>(length, big_endian, file);
    file.append(2 * length, '\n');
    Append<int8_t>(-1, big_endian, file);
  }
  for (size_t i = 0; i < points.size(); i += 3) {
    Append<double>(points[i], big_endian, file);
    Append<int8_t>(static_cast<int8_t>(i % 3), big_endian, file);
    file.append(i % 3 * 8, 'x');
    Append<double>(points[i + 1], big_endian, file);
    Append<uint8_t>(200, big_endian, file);
    Append<double>(points[i + 2], big_endian, file);
  }
  return file;
}

TEST_F(ReadVerticesTest, PlyInBinaryToTheBit) {
  std::mt19937_64 random(3);
  std::vector<double> points = {-0.0, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max()};
  while (points.size() < 30000) {
    const double value = std::bit_cast<double>(random());
    points.push_back(std::isfinite(value) ? value : 0.1);
  }
  for (const bool big_endian : {false, true}) {
    const PointCloud cloud = ReadGood("cloud.ply", BinaryPly(big_endian, points));
    ASSERT_EQ(cloud.points.size(), points.size());
    EXPECT_EQ(std::memcmp(cloud.points.data(), points.data(), points.size() * sizeof(double)), 0);
    EXPECT_THAT(cloud.Origin(7), EndsWith("cloud.ply[7]"));
  }
}

TEST_F(ReadVerticesTest, PlyOfEveryType) {
  for (const bool big_endian : {false, true}) {
    const auto read = [&](const char* type, auto x, auto y) {
      std::string file = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                         "_endian 1.0\nelement vertex 1\nproperty " + type + " x\nproperty " + type +
                         " y\nend_header\n";
      Append(x, big_endian, file);
      Append(y, big_endian, file);
      return ReadGood("cloud.ply", file).points;
    };
    for (const char* type : {"char", "int8"}) EXPECT_THAT(read(type, int8_t{-128}, int8_t{1}), ElementsAre(-128, 1));
    for (const char* type : {"uchar", "uint8"}) EXPECT_THAT(read(type, uint8_t{255}, uint8_t{}), ElementsAre(255, 0));
    for (const char* type : {"short", "int16"}) EXPECT_THAT(read(type, int16_t{-2}, int16_t{3}), ElementsAre(-2, 3));
    for (const char* type : {"ushort", "uint16"}) {
      EXPECT_THAT(read(type, uint16_t{65535}, uint16_t{2}), ElementsAre(65535, 2));
    }
    for (const char* type : {"int", "int32"}) EXPECT_THAT(read(type, -70000, 70000), ElementsAre(-70000, 70000));
    for (const char* type : {"uint", "uint32"}) EXPECT_THAT(read(type, 4000000000u, 1u), ElementsAre(4e9, 1));
    for (const char* type : {"float", "float32"}) EXPECT_THAT(read(type, 0.1f, 1.5f), ElementsAre(double{0.1f}, 1.5));
    for (const char* type : {"double", "float64"}) EXPECT_THAT(read(type, 0.1, -1e300), ElementsAre(0.1, -1e300));
  }
}

TEST_F(ReadVerticesTest, PlyErrors) {
  const auto message = [this](const std::string& from, const std::string& to) {
    return ReadBad("a.ply", Replaced(kAscii, from, to));
  };
  EXPECT_EQ(ReadBad("a.ply", ""), "a.ply:1: expected \"ply\"");
  EXPECT_EQ(ReadBad("a.ply", "x,y\n1,2\n"), "a.ply:1: expected \"ply\"");
  EXPECT_EQ(message("ascii 1.0", "ascii 2.0"),
            "a.ply:2: expected format ascii, binary_little_endian or binary_big_endian, and version 1.0, got \"ascii\" "
            "and \"2.0\"");
  EXPECT_EQ(message("format ascii 1.0\n", ""), "a.ply:14: expected a line \"format\" before the end of the header");
  EXPECT_THAT(message("comment", "remark"), StartsWith("a.ply:3: expected \"format\", \"element\", "));
  EXPECT_EQ(message("camera 2", "camera -2"), "a.ply:5: expected \"element\", a name and a whole number below 2^32");
  EXPECT_EQ(message("element face 1", "element vertex 1"),
            "a.ply:13: expected one element \"vertex\", got another one");
  EXPECT_EQ(message("element vertex", "element point"), "a.ply:15: expected an element \"vertex\" in the header");
  EXPECT_EQ(message("property list uchar float view\n", ""),
            "a.ply:14: expected a property of element \"camera\", got none");
  EXPECT_THAT(message("element camera 2\n", ""), StartsWith("a.ply:5: expected \"property\" with a type and a name"));
  EXPECT_THAT(message("double z", "long z"), HasSubstr("a.ply:9: expected a type (char, uchar, short"));
  EXPECT_THAT(message("list uchar int tags", "list float int tags"),
              HasSubstr("a.ply:10: expected a whole type for the length of a list, got \"float\""));
  EXPECT_EQ(message("float x", "float y"),
            "a.ply:15: expected one property x, one y and at most one z of element \"vertex\"; --columns takes others");
  EXPECT_EQ(ReadBad("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n"),
            "a.ply:3: the file ends inside its header; expected \"end_header\"");
  EXPECT_EQ(message("255 3 0 1 2", "255 three 0 1 2"), "a.ply:18: value 2: expected a number, got \"three\"");
  EXPECT_EQ(message("255 3 0 1 2", "255 inf 0 1 2"),
            "a.ply:18: value 2: expected a finite number, got \"inf\"; --skip-invalid leaves such points out");
  EXPECT_EQ(message("255 3 0 1 2", "255 3 -1 1 2"),
            "a.ply:18: value 3: expected the length of a list, a whole number, got \"-1\"");
  EXPECT_EQ(message("255 3 0 1 2", "255 3 4000000000 1 2"),
            "a.ply:18: expected 3999999998 more values in the list that value 3 announces");
  EXPECT_EQ(message("255 3 0 1 2", "255 3 0 1"), "a.ply:18: expected more than 4 values, as the header says");
  EXPECT_EQ(message("255 3 0 1 2", ""), "a.ply:22: expected more than 3 values, as the header says");
  EXPECT_EQ(message("255 3 0 1 2", "255 3 0 1 2 3"),
            "a.ply:18: expected the end of the line, as the header says, got \"3\"");
  EXPECT_EQ(message("vertex 3", "vertex 4294967295"), "a.ply:22: expected more than 3 values, as the header says");
  EXPECT_EQ(
      ReadBad("a.ply", kAscii, {.format = "", .dimension = 2}),
      "a.ply:15: expected 2 coordinates, got 3 as properties of element \"vertex\"; --columns x,y takes 2 of them");
}

TEST_F(ReadVerticesTest, PlyErrorsInBinary) {
  const std::string good = BinaryPly(false, {1, 2, 3, 4, 5, 6});
  const std::string at = std::to_string(good.size());
  EXPECT_EQ(ReadBad("a.ply", Replaced(good, "vertex 2", "vertex 4000000000")),
            "a.ply: byte " + std::to_string(good.size() + 9) +
                ": element \"vertex\" 2: expected 4000000000 rows of element \"vertex\", as the header says; the file "
                "ends in row 2");
  EXPECT_EQ(ReadBad("a.ply", BinaryPly(true, {1, 2, 3, 4, 5, std::numeric_limits<double>::infinity()})),
            "a.ply: byte " + std::to_string(good.size() - 8 - 3) +
                ": element \"vertex\" 1: coordinate 3: expected a finite number, got inf; --skip-invalid leaves such "
                "points out");
  std::string negative =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list char int a\n"
      "property float x\nproperty float y\nend_header\n";
  const std::string begin = std::to_string(negative.size());
  EXPECT_EQ(ReadBad("a.ply", negative + "\xff"),
            "a.ply: byte " + begin + ": element \"vertex\" 0: expected the length of a list, zero or more, got -1");
}

TEST_F(ReadVerticesTest, PlyCutAnywhereBeforeTheLastVertexIsRefused) {
  const std::string ascii = kAscii;
  for (size_t size = 0; size < ascii.find(" 9\n3 0") + 1; ++size) {
    EXPECT_THAT(ReadBad("a.ply", ascii.substr(0, size)), StartsWith("a.ply:")) << size;
  }
  const std::string binary = BinaryPly(true, {1, 2, 3, 4, 5, 6});
  for (size_t size = 0; size < binary.size(); ++size) {
    EXPECT_THAT(ReadBad("a.ply", binary.substr(0, size)), StartsWith("a.ply:")) << size;
  }
  EXPECT_EQ(ReadGood("a.ply", binary).size(), 2u);
}

TEST_F(ReadVerticesTest, Obj) {
  const PointCloud cloud =
      ReadGood("cloud.obj",
               "# a cube\nmtllib cube.mtl\no cube\nv 1 2 3\nv 4 5 6 0.5 # weight\r\n\tv 7 8 9 1 0 0\nvn 0 0 1\nvt 0 1\n"
               "v 1 \\\n  -1 \\\n\t0.1\nf 1//1 2//1 \\\n 3//1\nv 0 0 0 \\");
  EXPECT_EQ(cloud.dimension, 3);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 1, -1, 0.1, 0, 0, 0));
  EXPECT_THAT(cloud.Origin(2), EndsWith("cloud.obj:6"));
  EXPECT_THAT(cloud.Origin(3), EndsWith("cloud.obj:9"));
  EXPECT_EQ(ReadGood("cloud.obj", "v 1 2\nv 3 4\n").dimension, 2);
}

TEST_F(ReadVerticesTest, ObjErrors) {
  EXPECT_THAT(ReadBad("a.obj", "# nothing\nf 1 2 3\n"), HasSubstr("a.obj: no points; expected at least one"));
  EXPECT_EQ(ReadBad("a.obj", "v 1 2 3\n1 2 3\n"), "a.obj:2: expected a word such as \"v\" or \"f\", got \"1\"");
  EXPECT_EQ(ReadBad("a.obj", "v 1\n"), "a.obj:1: expected 2 or 3 coordinates, got 1");
  EXPECT_EQ(ReadBad("a.obj", "v 1 2 3\nv 1 \\\n2\n"), "a.obj:2: expected 3 coordinates, got 2");
  EXPECT_EQ(ReadBad("a.obj", "v 1 2 3\n", {.format = "", .dimension = 2}),
            "a.obj:1: expected 2 coordinates, got 3; --columns 1,2 takes 2 of them");
  EXPECT_EQ(ReadBad("a.obj", "v 1 two 3\n"), "a.obj:1: coordinate 2: expected a number, got \"two\"");
  EXPECT_EQ(ReadBad("a.obj", "v 1 2 nan\n"),
            "a.obj:1: coordinate 3: expected a finite number, got \"nan\"; --skip-invalid leaves such points out");
  EXPECT_THAT(ReadBad("a.obj", "v 1 2 3\nv " + std::string(3 << 19, '1')),
              StartsWith("a.obj:2: the line is longer than 1048576 bytes"));
  std::string endless = "v 1 2 3\nf";
  for (int i = 0; i < 5; ++i) {
    endless += std::string(1 << 18, '1') + "\\\n";
  }
  EXPECT_THAT(ReadBad("a.obj", endless), StartsWith("a.obj:5: the line and those that it continues are longer than"));
}

TEST_F(ReadVerticesTest, Off) {
  EXPECT_THAT(ReadGood("a.off", "OFF\n# two\n2 1 0\n\n1 2 3\n4 5 6 # second\n2 0 1\n").points,
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(ReadGood("a.off", "OFF 1 0 0\n1 2 3\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "OFF1 0 0\n1 2 3\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "OFF\n1 0\n1 2 3\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "OFF\n1\n0 0\n1 2 3\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "COFF\n1 0 0\n1 2 3 255 0 0 255\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "NOFF\n1 0 0\n1 2 3 0 0 1\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "STCNOFF\n1 0 0\n1 2 3 0 0 1\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "4OFF\n1 0 0\n1 2 3 4\n").points, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadGood("a.off", "nOFF\n5\n1 0 0\n1 2 3 4 5\n").points, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(ReadGood("a.off", "nOFF 2\n1 0 0\n1 2\n").points, ElementsAre(1, 2));
  EXPECT_THAT(ReadGood("a.off", "off\n1 0 0\n1 2 3\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "coff\n1 0 0\n1 2 3 255 0 0 255\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("a.off", "OFF\n0 0 0\n").points, IsEmpty());
  EXPECT_THAT(ReadGood("a.off", "OFF\n1 0 0\n1 2 3\n").Origin(0), EndsWith("a.off:3"));
}

TEST_F(ReadVerticesTest, OffErrors) {
  for (const char* content : {"", "noff\n1 0 0\n", "8 6 12\n", "4nOFF\n", "ply\n"}) {
    EXPECT_EQ(ReadBad("a.off", content),
              "a.off:1: expected OFF, STOFF, COFF, NOFF, CNOFF, 4OFF or nOFF at the start of the file");
  }
  EXPECT_EQ(ReadBad("a.off", "OFF BINARY\n"),
            "a.off:1: expected the numbers of vertices, faces and edges, whole numbers below 2^32, got \"BINARY\"");
  EXPECT_THAT(ReadBad("a.off", "OFF\n1 0 0 0\n1 2 3\n"), HasSubstr("a.off:2: expected the numbers of vertices"));
  EXPECT_THAT(ReadBad("a.off", "nOFF\n-3\n"), HasSubstr("a.off:2: expected the dimension and the numbers"));
  EXPECT_EQ(ReadBad("a.off", "nOFF\n7\n1 0 0\n"), "a.off:3: expected a dimension from 2 to 6, got 7");
  EXPECT_THAT(ReadBad("a.off", "OFF\n1\n"), HasSubstr("a.off:2: the file ends inside its header"));
  EXPECT_EQ(ReadBad("a.off", "OFF\n4000000000 0 0\n1 2 3\n"),
            "a.off:3: expected 4000000000 vertices, as the header says, got 1");
  EXPECT_EQ(ReadBad("a.off", "OFF\n1 0 0\n1 2\n"), "a.off:3: expected 3 coordinates, got 2");
  EXPECT_EQ(ReadBad("a.off", "OFF\n1 0 0\n1 2 x\n"), "a.off:3: coordinate 3: expected a number, got \"x\"");
  EXPECT_EQ(ReadBad("a.off", "OFF\n1 0 0\n1 2 3 4\n"),
            "a.off:3: expected 3 coordinates, got also \"4\" (COFF, NOFF and STOFF have more numbers)");
  EXPECT_EQ(ReadBad("a.off", "OFF\n1 0 0\n1 2 3\n", {.format = "", .dimension = 4}),
            "a.off:2: expected 4 coordinates, got 3");
  const std::string good = "nOFF\n4\n2 1 0\n1 2 3 4\n5 6 7 8\n";
  for (size_t size = 0; size < good.rfind('8'); ++size) {
    EXPECT_THAT(ReadBad("a.off", good.substr(0, size)), StartsWith("a.off:")) << size;
  }
}

}  // namespace
}  // namespace wellspace::formats
