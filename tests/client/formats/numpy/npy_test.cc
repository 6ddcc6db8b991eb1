// Headers and arrays as numpy writes them, in every type and order, and those that are refused.
#include "client/formats/numpy/npy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <thread>

#include "client/formats/read_cloud.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(ParseNpyHeaderTest, TakesWhatNumpyWrites) {
  const absl::StatusOr<NpyHeader> header =
      ParseNpyHeader("{'descr': '<f8', 'fortran_order': True, 'shape': (3, 2), }      \n");
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_EQ(header->type, "<f8");
  EXPECT_TRUE(header->fortran_order);
  EXPECT_THAT(header->shape, ElementsAre(3, 2));
  EXPECT_THAT(ParseNpyHeader("{\"shape\":(7,),\"fortran_order\":False,\"descr\":\"|b1\"}")->shape, ElementsAre(7));
  EXPECT_THAT(ParseNpyHeader("{'descr': '<f8', 'fortran_order': False, 'shape': ()}")->shape, IsEmpty());
}

TEST(ParseNpyHeaderTest, RefusesTheRest) {
  for (const char* text : {
           "",
           "{",
           "{}",
           "{'descr': '<f8', 'fortran_order': False}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2)",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2)} x",
           "{'descr': '<f8' 'fortran_order': False, 'shape': (3, 2)}",
           "{'descr': '<f8', 'fortran_order': false, 'shape': (3, 2)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (3)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (3 2)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (-3, 2)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (3L, 2L)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999, 2)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (, )}",
           "{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (3, 2)}",
           "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), 'more': 1}",
           "{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (3, 2)}",
           "{'descr': '<f8, 'fortran_order': False, 'shape': (3, 2)}",
           "{'descr': '<f8\", 'fortran_order': False, 'shape': (3, 2)}",
       }) {
    EXPECT_EQ(ParseNpyHeader(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
  EXPECT_THAT(std::string(ParseNpyHeader("{'descr': 5}").status().message()), HasSubstr("wrong at \"5}\""));
}

TEST(NpyPreambleTest, IsAlignedAndReadsBack) {
  for (const uint64_t rows : {uint64_t{0}, uint64_t{1}, uint64_t{12345}, uint64_t{1} << 40}) {
    const std::string preamble = NpyPreamble("<f8", rows, 3);
    EXPECT_EQ(preamble.size() % 64, 0u);
    EXPECT_EQ(preamble.back(), '\n');
    EXPECT_THAT(ParseNpyHeader(std::string_view(preamble).substr(10))->shape, ElementsAre(rows, 3));
  }
}

class NpyCloudTest : public testing::Test {
 protected:
  template <typename T>
  static std::string Bytes(const std::vector<T>& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }

  // A file with this header and these bytes of values.
  static std::string Npy(const std::string& header, const std::string& values, char version = 1) {
    std::string text = "\x93NUMPY";
    text += version;
    text += '\0';
    const auto length = static_cast<uint32_t>(header.size());
    text.append(reinterpret_cast<const char*>(&length), version == 1 ? 2 : 4);
    return text + header + values;
  }

  std::string ReadBad(const std::string& content, int dimension = 0) {
    const absl::StatusOr<PointCloud> cloud =
        ReadCloud(folder_.Write("a.npy", content), {.format = "", .dimension = dimension});
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument) << cloud.status();
    return std::string(cloud.status().message()).substr(folder_.Path("").size());
  }

  TemporaryFolder folder_;
};

TEST_F(NpyCloudTest, EitherOrderTypeAndVersion) {
  const std::vector<double> rows = {1, 2, 3, 4, 5, 6};
  const std::vector<double> columns = {1, 4, 2, 5, 3, 6};
  const std::vector<float> floats = {1, 2, 3, 4, 5, 6};
  const std::string in_c = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}";
  for (const std::string& content : {Npy(in_c, Bytes(rows)), Npy(in_c, Bytes(rows), 2), Npy(in_c, Bytes(rows), 3),
                                     Npy("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3)}", Bytes(columns)),
                                     Npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3)}", Bytes(floats))}) {
    const absl::StatusOr<PointCloud> cloud = ReadCloud(folder_.Write("a.npy", content));
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    EXPECT_EQ(cloud->dimension, 3);
    EXPECT_EQ(cloud->size(), 2u);
    EXPECT_THAT(cloud->points, ElementsAre(1, 2, 3, 4, 5, 6));
    EXPECT_THAT(cloud->Origin(1), testing::EndsWith("a.npy[1]"));
  }
}

// The values as the file has them, in the byte order that `type` says.
template <typename T>
std::string BytesAs(const std::string& type, std::vector<T> values) {
  std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  for (size_t at = 0; type[0] == '>' && at < bytes.size(); at += sizeof(T)) {
    std::reverse(bytes.begin() + at, bytes.begin() + at + sizeof(T));
  }
  return bytes;
}

TEST_F(NpyCloudTest, EveryTypeInEitherByteOrderAndOrder) {
  const auto expect = [this](const std::string& type, auto zero) {
    using T = decltype(zero);
    for (const bool fortran : {false, true}) {
      const std::vector<T> values = fortran ? std::vector<T>{1, 3, 5, 2, 4, 120} : std::vector<T>{1, 2, 3, 4, 5, 120};
      const std::string header =
          "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (3, 2)}";
      const absl::StatusOr<PointCloud> cloud = ReadCloud(folder_.Write("a.npy", Npy(header, BytesAs(type, values))));
      ASSERT_TRUE(cloud.ok()) << cloud.status();
      EXPECT_THAT(cloud->points, ElementsAre(1, 2, 3, 4, 5, 120)) << header;
    }
  };
  for (const std::string order : {"<", ">"}) {
    expect(order + "i2", int16_t{});
    expect(order + "u2", uint16_t{});
    expect(order + "i4", int32_t{});
    expect(order + "u4", uint32_t{});
    expect(order + "i8", int64_t{});
    expect(order + "u8", uint64_t{});
    expect(order + "f4", float{});
    expect(order + "f8", double{});
  }
  expect("|i1", int8_t{});
  expect("|u1", uint8_t{});
}

TEST_F(NpyCloudTest, WholeNumbersComeExactlyOrNotAtAll) {
  const auto read = [this](const std::string& type, auto first) {
    const std::vector<decltype(first)> values = {first, 0};
    return ReadCloud(folder_.Write(
        "a.npy", Npy("{'descr': '" + type + "', 'fortran_order': False, 'shape': (1, 2)}", BytesAs(type, values))));
  };
  EXPECT_EQ(read("<i8", int64_t{-1} << 63)->points[0], -0x1p63);
  EXPECT_EQ(read(">i8", (int64_t{1} << 53) - 1)->points[0], 0x1p53 - 1);
  EXPECT_EQ(read("<u8", uint64_t{1} << 63)->points[0], 0x1p63);
  EXPECT_EQ(read("|i1", int8_t{-128})->points[0], -128);
  EXPECT_EQ(read("|u1", uint8_t{255})->points[0], 255);
  EXPECT_EQ(read(">i2", int16_t{-2})->points[0], -2);
  EXPECT_EQ(read("<u4", uint32_t{4294967295})->points[0], 4294967295);
  EXPECT_THAT(std::string(read("<i8", (int64_t{1} << 53) + 1).status().message()),
              HasSubstr("expected whole numbers that a double can hold, got 9007199254740993 at [0, 0]"));
  EXPECT_FALSE(read("<i8", std::numeric_limits<int64_t>::max()).ok());
  EXPECT_FALSE(read("<u8", std::numeric_limits<uint64_t>::max()).ok());
}

TEST_F(NpyCloudTest, ColumnsAndInvalidRows) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string content =
      Npy("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 8)}",
          Bytes<double>({0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, nan, 4, 5, 6, 7, 0, 1, 8, 9, 4, 5, 6, nan}));
  EXPECT_THAT(ReadBad(content), HasSubstr("--columns 1,2,3"));
  EXPECT_THAT(ReadBad(content, 2), HasSubstr("--columns 1,2"));
  const std::string path = folder_.Write("a.npy", content);
  const absl::StatusOr<PointCloud> cloud =
      ReadCloud(path, {.format = "", .dimension = 0, .columns = {"4", "3"}, .skip_invalid = true});
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_THAT(cloud->points, ElementsAre(3, 2, 9, 8));
  EXPECT_EQ(cloud->skipped, 1u);
  EXPECT_THAT(cloud->Origin(1), testing::EndsWith("a.npy[2]"));
}

TEST_F(NpyCloudTest, NoPoints) {
  const std::string content = Npy("{'descr': '<f8', 'fortran_order': True, 'shape': (0, 5)}", "");
  const absl::StatusOr<PointCloud> cloud = ReadCloud(folder_.Write("a.npy", content));
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->dimension, 5);
  EXPECT_EQ(cloud->size(), 0u);
}

TEST_F(NpyCloudTest, Errors) {
  const std::string point = Bytes<double>({1, 2});
  const auto header = [](const std::string& type, const std::string& shape) {
    return "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + "}";
  };
  EXPECT_EQ(ReadBad(""), "a.npy: the array ends after 0 bytes, inside its header");
  EXPECT_THAT(ReadBad("x,y\n1,2\n3,4\n"), HasSubstr("a.npy: expected an array of numpy, which starts with"));
  EXPECT_EQ(ReadBad(Npy(header("<f8", "(1, 2)"), point, 4)),
            "a.npy: expected version 1.0, 2.0 or 3.0 of the format, got 4.0");
  EXPECT_THAT(ReadBad(Npy("{'descr': '<f8'}", point)), HasSubstr("a.npy: expected the header {'descr'"));
  for (const char* type : {"<c8", "<f2", "|b1", "|O", "<i3", "?i4", "|i4", "i4", "", "<m8", "<f16"}) {
    EXPECT_EQ(
        ReadBad(Npy(header(type, "(1, 2)"), point)),
        std::string("a.npy: expected numbers of type f4, f8, i1, i2, i4, i8, u1, u2, u4 or u8, got \"") + type + "\"");
  }
  EXPECT_EQ(ReadBad(Npy(header("<f8", "(2,)"), point)),
            "a.npy: expected an array of 2 dimensions, rows and columns, got one of 1");
  EXPECT_EQ(ReadBad(Npy(header("<f8", "(2, 1)"), point)),
            "a.npy: expected 2 to 6 coordinates, got an array of 2 rows and 1 columns");
  EXPECT_EQ(ReadBad(Npy(header("<f8", "(1, 2)"), point), 3),
            "a.npy: expected 3 coordinates, got an array of 1 rows and 2 columns");
  EXPECT_EQ(ReadBad(Npy(header("<f8", "(2, 2)"), point)),
            "a.npy: expected 32 bytes of values for 2 rows and 2 columns of type \"<f8\", got 16");
  EXPECT_THAT(ReadBad(Npy(header("<f8", "(1, 2)"), point + "x")), HasSubstr("a.npy: expected 16 bytes of values"));
  EXPECT_THAT(ReadBad(Npy(header("<f8", "(999999999999999999, 6)"), point)), HasSubstr("a.npy: expected at most"));
  EXPECT_EQ(ReadBad(Npy(header("<f8", "(2, 2)"), Bytes<double>({1, 2, 3, std::numeric_limits<double>::infinity()}))),
            "a.npy[1]: coordinate 2: expected a finite number, got inf; --skip-invalid leaves such points out");
}

// A pipe has no size that could refute the header: memory grows with the bytes that come.
TEST_F(NpyCloudTest, ReadsPipesWithoutBelievingThem) {
  const std::string path = folder_.Path("pipe.npy");
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const auto read = [&](const std::string& shape, const std::string& values) {
    std::thread writer([&] {
      folder_.Write("pipe.npy", Npy("{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + "}", values));
    });
    absl::StatusOr<PointCloud> cloud = ReadCloud(path);
    writer.join();
    return cloud;
  };
  std::vector<double> many(4 * 30'000);
  for (size_t i = 0; i < many.size(); ++i) {
    many[i] = static_cast<double>(i);
  }
  const absl::StatusOr<PointCloud> cloud = read("(30000, 4)", Bytes(many));
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->points, many);
  EXPECT_THAT(std::string(read("(99999999999999, 4)", Bytes(many)).status().message()), HasSubstr("inside its values"));
  EXPECT_THAT(std::string(read("(1, 2)", Bytes<double>({1, 2, 3})).status().message()),
              HasSubstr("as the header says, got more"));
}

}  // namespace
}  // namespace wellspace::formats
