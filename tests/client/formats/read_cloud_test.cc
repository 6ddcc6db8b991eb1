// Clouds in tables of text and .node: points, columns, and errors that name file and line.
#include "client/formats/read_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <thread>

#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(ReadCloudTest, CsvSeparators) {
  for (const char* content :
       {"1,2\n3,4\n", "1, 2\n3 ,4", "1 2\n  3   4\n", "1\t2\n3\t4\n", "1;2\n3;4\n", "\"1\",\"2\"\n3,4\n"}) {
    const PointCloud cloud = ReadGood("cloud.csv", content);
    EXPECT_EQ(cloud.dimension, 2) << content;
    EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4)) << content;
  }
}

TEST_F(ReadCloudTest, CsvHeaderCommentsBlankLinesByteOrderMarkAndCrlf) {
  const PointCloud cloud =
      ReadGood("cloud.csv", "\xEF\xBB\xBF# made by hand\r\nlon,lat\r\n\r\n1,2\r\n  # more\r\n3,4 # the last\r\n");
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(cloud.Origin(0), EndsWith("cloud.csv:4"));
  EXPECT_THAT(cloud.Origin(1), EndsWith("cloud.csv:6"));
}

TEST_F(ReadCloudTest, CsvHeaderSelectsNamedColumns) {
  const PointCloud cloud = ReadGood("cloud.csv", "id,Z,x,\"Y\",name\n7,3,1,2,cow\n8,6,4,5,spot\n");
  EXPECT_EQ(cloud.dimension, 3);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(ReadCloudTest, CsvRowsHaveEveryColumnThatTheHeaderNames) {
  EXPECT_EQ(ReadBad("cloud.csv", "x,z,y\n1,2\n"), "cloud.csv:2: expected 3 coordinates, got 2");
  EXPECT_EQ(ReadBad("cloud.csv", "x,y,name\n1\n"), "cloud.csv:2: expected 2 coordinates, got 1");
}

TEST_F(ReadCloudTest, XyzPlainSkipsColumnsAfterThird) {
  EXPECT_THAT(ReadGood("cloud.xyz", "1 2 3 255 0 0\n4 5 6 0 255 0\n").points, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ(ReadGood("cloud.xyz", "1 2\n3 4\n").dimension, 2);
}

TEST_F(ReadCloudTest, UpToSixDimensions) {
  const CloudOptions four = {.format = "", .dimension = 4};
  EXPECT_THAT(ReadGood("cloud.csv", "1,2,3,4\n5,6,7,8\n", four).points, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_EQ(ReadGood("cloud.csv", "a b c d e\n1 2 3 4 5\n").dimension, 5);
  EXPECT_EQ(ReadGood("cloud.node", "1 6 0 0\n0 1 2 3 4 5 6\n").dimension, 6);
  EXPECT_EQ(ReadBad("cloud.csv", "1 2 3 4 5 6 7\n"),
            "cloud.csv:1: expected 2 to 6 coordinates, got 7; --columns 1,2,3 takes three of them");
}

// The names x, y and z choose among columns only where they can name all coordinates that are wanted.
TEST_F(ReadCloudTest, NamesAndSkippedColumnsWhenMoreThanThreeDimensionsAreWanted) {
  const CloudOptions four = {.format = "", .dimension = 4};
  EXPECT_THAT(ReadGood("cloud.csv", "x,y,z,w\n1,2,3,4\n").points, ElementsAre(1, 2, 3));
  EXPECT_THAT(ReadGood("cloud.csv", "x,y,z,w\n1,2,3,4\n", four).points, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(ReadBad("cloud.csv", "x,y,z\n1,2,3\n", four), "cloud.csv:2: expected 4 coordinates, got 3");
  EXPECT_THAT(ReadGood("cloud.xyz", "1 2 3 4 255\n", four).points, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(ReadBad("cloud.xyz", "1 2 3\n", four), "cloud.xyz:1: expected 4 coordinates, got 3");
}

TEST_F(ReadCloudTest, XyzOfChemistry) {
  const PointCloud cloud = ReadGood("water.xyz", "3\n\nO 0 0 0.1\nH 0 0.7 -0.4\n 0 -0.7 -0.4\n");
  EXPECT_THAT(cloud.points, ElementsAre(0, 0, 0.1, 0, 0.7, -0.4, 0, -0.7, -0.4));
  EXPECT_THAT(cloud.Origin(0), EndsWith(":3"));
  EXPECT_EQ(ReadBad("water.xyz", "2\nwater\nO 0 0 0\n"), "water.xyz:3: expected 2 points, as line 1 says, got 1");
  EXPECT_THAT(ReadBad("water.xyz", "1\nwater\nO 0 0 0\nH 1 0 0\n"), HasSubstr("water.xyz:4: expected the end"));
}

TEST_F(ReadCloudTest, NodeCountsFromZeroOrOne) {
  for (const char* content : {"2 3 0 0\n0 1 2 3\n1 4 5 6\n", "# TetGen\n2 3\n\n1 1 2 3\n2 4 5 6 # end\n",
                              "2 3 1 1\n1 1 2 3 0.5 1\n2 4 5 6 0.5 0\n"}) {
    const PointCloud cloud = ReadGood("cloud.node", content);
    EXPECT_EQ(cloud.dimension, 3);
    EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6)) << content;
  }
}

TEST_F(ReadCloudTest, NodeErrors) {
  EXPECT_EQ(ReadBad("a.node", ""), "a.node:1: expected a header, got an empty file");
  EXPECT_THAT(ReadBad("a.node", "2\n"), HasSubstr("a.node:1: expected the dimension"));
  EXPECT_THAT(ReadBad("a.node", "-2 2 0 0\n"), HasSubstr("a.node:1: expected the number of points"));
  EXPECT_THAT(ReadBad("a.node", "1 7 0 0\n0 1 2 3 4 5 6 7\n"),
              HasSubstr("a.node:1: expected a dimension from 2 to 6, got 7"));
  EXPECT_EQ(ReadBad("a.node", "4000000000 3 0 0\n0 1 2 3\n"),
            "a.node:2: expected 4000000000 points, as the header says, got 1");
  EXPECT_EQ(ReadBad("a.node", "1 2 0 0\n5 1 2\n"), "a.node:2: expected index 0 or 1, got \"5\"");
  EXPECT_EQ(ReadBad("a.node", "2 2 0 0\n1 1 2\n3 1 2\n"), "a.node:3: expected index 2, got \"3\"");
  EXPECT_EQ(ReadBad("a.node", "1 2 0 0\n1 1\n"), "a.node:2: expected 2 coordinates, got 1");
  EXPECT_THAT(ReadBad("a.node", "1 2 0 0\n1 1 nan\n"), HasSubstr("a.node:2: coordinate 2: expected a finite number"));
  EXPECT_THAT(ReadBad("a.node", "1 2 0 0\n1 1 2 3\n"), HasSubstr("a.node:2: expected 2 coordinates and 0 attributes"));
  EXPECT_THAT(ReadBad("a.node", "1 2 0 0\n1 1 2\n2 3 4\n"), HasSubstr("a.node:3: expected the end of the file"));
}

TEST_F(ReadCloudTest, ErrorsNameFileAndLine) {
  EXPECT_EQ(ReadBad("cloud.csv", "x,y,z\n1,2,3\n4,5\n"), "cloud.csv:3: expected 3 coordinates, got 2");
  EXPECT_EQ(ReadBad("cloud.csv", "1,2\n4,5,6\n"), "cloud.csv:2: expected 2 coordinates, got 3");
  EXPECT_EQ(ReadBad("cloud.csv", "1,2\n3,four\n"), "cloud.csv:2: field 2: expected a number, got \"four\"");
  EXPECT_EQ(ReadBad("cloud.csv", "1,2\n3,\n"),
            "cloud.csv:2: field 2: expected a number, got \"\"; --skip-invalid leaves such points out");
  EXPECT_EQ(ReadBad("cloud.csv", "1,2\n\n3,NaN\n"),
            "cloud.csv:3: field 2: expected a finite number, got \"NaN\"; --skip-invalid leaves such points out");
  EXPECT_EQ(ReadBad("cloud.csv", "-inf,2\n"),
            "cloud.csv:1: field 1: expected a finite number, got \"-inf\"; --skip-invalid leaves such points out");
  EXPECT_THAT(ReadBad("cloud.csv", "1,1e999\n"),
              HasSubstr("cloud.csv:1: field 2: expected a number of magnitude below"));
  EXPECT_EQ(ReadBad("cloud.csv", "1\n2\n"), "cloud.csv:1: expected 2 to 6 coordinates, got 1");
  EXPECT_EQ(ReadBad("cloud.csv", "1,2,3,4,5,6,7\n"),
            "cloud.csv:1: expected 2 to 6 coordinates, got 7 (fields are separated by \",\"); --columns 1,2,3 takes "
            "three of them");
  EXPECT_THAT(ReadBad("cloud.csv", std::string_view("1,2\n\0\x01,3\n", 10)), HasSubstr("got \"\\x00\\x01\""));
}

TEST_F(ReadCloudTest, DimensionIsCheckedAndStandsInForAnEmptyFile) {
  EXPECT_EQ(ReadBad("cloud.csv", "1,2,3\n", {.format = "", .dimension = 2}),
            "cloud.csv:1: expected 2 coordinates, got 3; --columns 1,2 takes 2 of them");
  EXPECT_EQ(ReadBad("a.node", "0 2 0 0\n", {.format = "", .dimension = 3}), "a.node:1: expected dimension 3, got 2");
  EXPECT_THAT(ReadBad("cloud.csv", "x,y\n"), HasSubstr("cloud.csv: no points"));
  const PointCloud empty = ReadGood("cloud.csv", "", {.format = "", .dimension = 2});
  EXPECT_EQ(empty.dimension, 2);
  EXPECT_THAT(empty.points, IsEmpty());
}

TEST_F(ReadCloudTest, FormatByNameAndByExtension) {
  EXPECT_EQ(ReadGood("points.data", "1 2 3\n", {.format = "xyz", .dimension = 0}).dimension, 3);
  EXPECT_EQ(ReadGood("POINTS.CSV", "1 2 3\n").dimension, 3);
  EXPECT_THAT(ReadBad("cloud.step", "1 2\n"),
              HasSubstr("no format is known by the extension \".step\"; expected one of .csv"));
  EXPECT_THAT(ReadBad("cloud", "1 2\n"), HasSubstr("no format is known by the extension \"\""));
  EXPECT_THAT(ReadBad("cloud.csv", "1 2\n", {.format = "e57", .dimension = 0}),
              HasSubstr("expected one of csv, xyz, node, ply, obj, off, npy, asc, pts"));
}

TEST_F(ReadCloudTest, FilesThatCannotBeRead) {
  EXPECT_EQ(ReadCloud(folder_.Path("none.csv")).status().code(), absl::StatusCode::kNotFound);
  const absl::StatusOr<PointCloud> folder = ReadCloud(folder_.Path("."), {.format = "csv", .dimension = 0});
  EXPECT_THAT(std::string(folder.status().message()), HasSubstr("it is a folder"));
}

TEST_F(ReadCloudTest, LineOfABinaryFileIsRefusedInBoundedMemory) {
  EXPECT_THAT(ReadBad("cloud.csv", std::string(3 * kMaxLineBytes, '7')), HasSubstr("cloud.csv:1: the line is longer"));
}

// A pipe hands the text out in pieces that do not end with a line.
TEST_F(ReadCloudTest, ReadsPipes) {
  const std::string path = folder_.Path("pipe.csv");
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  std::string content;
  for (int i = 0; i < 50000; ++i) {
    content += std::to_string(i) + "," + std::to_string(-i) + "\n";
  }
  std::thread writer([&] { folder_.Write("pipe.csv", content); });
  const absl::StatusOr<PointCloud> cloud = ReadCloud(path);
  writer.join();
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->size(), 50000u);
  for (int i = 0; i < 50000; ++i) {
    ASSERT_EQ(cloud->points[2 * i], i);
    ASSERT_EQ(cloud->points[2 * i + 1], -i);
  }
}

TEST(ParseFiniteTest, IsCorrectlyRounded) {
  const auto parse = [](std::string_view text) {
    double value = -1;
    EXPECT_TRUE(ParseFinite(text, value).ok()) << text;
    return std::bit_cast<uint64_t>(value);
  };
  EXPECT_EQ(parse("9007199254740993"), std::bit_cast<uint64_t>(9007199254740992.0));  // half way, to even
  EXPECT_EQ(parse("9007199254740993.000000000000000000000000000001"), std::bit_cast<uint64_t>(9007199254740994.0));
  EXPECT_EQ(parse("2.2250738585072011e-308"), 0x000fffffffffffffu);
  EXPECT_EQ(parse("4.9e-324"), 1u);
  EXPECT_EQ(parse("1e-400"), 0u);
  EXPECT_EQ(parse("-0"), 0x8000000000000000u);
  EXPECT_EQ(parse("+.5"), std::bit_cast<uint64_t>(0.5));
  double value = 0;
  for (const char* text : {"", "+", "-", ".", "1e", "0x10", "1 2", "1,5", "++1", "+-1", "1d3", "--1"}) {
    EXPECT_FALSE(ParseFinite(text, value).ok()) << text;
  }
}

TEST(AppendNumberTest, ReadsBackToTheBit) {
  const char* wanted = std::getenv("WELLSPACE_SEED");
  const uint64_t seed = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 20240608;
  SCOPED_TRACE(testing::Message() << "WELLSPACE_SEED=" << seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) {
      continue;
    }
    std::string text;
    AppendNumber(value, text);
    double read = 0;
    ASSERT_TRUE(ParseFinite(text, read).ok()) << text;
    ASSERT_EQ(std::bit_cast<uint64_t>(read), std::bit_cast<uint64_t>(value)) << text;
  }
}

TEST(LineIndexTest, FindsLinesAcrossGaps) {
  LineIndex index;
  const std::vector<uint64_t> lines = {1, 2, 3, 7, 8, 20, 21, 22, 22, 23, 30, 37, 44, 45, 45, 45, 45, 47};
  for (const uint64_t line : lines) {
    index.Add(line);
  }
  ASSERT_EQ(index.size(), lines.size());
  for (size_t point = 0; point < lines.size(); ++point) {
    EXPECT_EQ(index.LineOf(point), lines[point]) << point;
  }
}

}  // namespace
}  // namespace wellspace::formats
