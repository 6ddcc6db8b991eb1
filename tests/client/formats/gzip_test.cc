// Clouds that gzip has compressed: whole, cut, damaged, and bombs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <fstream>
#include <string>
#include <thread>

#include "client/formats/numpy/npy.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

std::string Gzip(std::string_view text) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&stream, text.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

class GzipTest : public ReadCloudTest {
 protected:
  static std::string ManyRows() {
    std::string text;
    for (int i = 0; i < 100'000; ++i) {
      text += std::to_string(i * 0.37) + "," + std::to_string(i) + "\n";
    }
    return text;
  }
};

TEST_F(GzipTest, EveryFormat) {
  struct Case {
    const char* name;
    std::string content;
  };
  std::string npy = NpyPreamble("<f8", 1, 3);
  const double values[] = {1, 2, 3};
  npy.append(reinterpret_cast<const char*>(values), sizeof(values));
  for (const Case& one : std::vector<Case>{
           {"a.csv.gz", "x,y,z\n1,2,3\n"},
           {"a.tsv.gz", "1\t2\t3\n"},
           {"a.txt.gz", "1 2 3\r"},
           {"a.dat.gz", "1;2;3\n"},
           {"a.xyz.gz", "1 2 3\n"},
           {"A.XYZ.GZ", "1 2 3\n"},
           {"a.asc.gz", "1 2 3\n"},
           {"a.pts.gz", "1\n1 2 3\n"},
           {"a.node.gz", "1 3 0 0\n1 1 2 3\n"},
           {"a.obj.gz", "v 1 2 3\n"},
           {"a.off.gz", "OFF\n1 0 0\n1 2 3\n"},
           {"a.ply.gz",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
            "end_header\n1 2 3\n"},
           {"a.npy.gz", npy},
       }) {
    EXPECT_THAT(ReadGood(one.name, Gzip(one.content)).points, ElementsAre(1, 2, 3)) << one.name;
  }
  // Whatever its name, a file that starts as gzip's do is no text.
  const PointCloud cloud = ReadGood("a.csv", Gzip("1,2\n\n3,4\n"));
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(cloud.Origin(1), EndsWith("a.csv:3"));
}

TEST_F(GzipTest, MembersOneAfterTheOtherAndZeros) {
  EXPECT_THAT(ReadGood("a.csv.gz", Gzip("1,2\n3") + Gzip("") + Gzip(",4\n") + std::string(1000, '\0')).points,
              ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadBad("a.csv.gz", Gzip("1,2\n") + "more"),
              HasSubstr("a.csv.gz: something else follows the data of gzip"));
}

TEST_F(GzipTest, CutAnywhereIsAnError) {
  const std::string packed = Gzip("1,2\n3,4\n5,6\n");
  for (size_t size = 0; size < packed.size(); ++size) {
    EXPECT_THAT(ReadBad("a.csv.gz", packed.substr(0, size)), AnyOf(HasSubstr("a.csv.gz: the data of gzip end early"),
                                                                   HasSubstr("a.csv.gz: expected a file of gzip")))
        << size;
  }
  const std::string many = Gzip(ManyRows());
  EXPECT_THAT(ReadBad("a.csv.gz", many.substr(0, many.size() / 2)), HasSubstr("a.csv.gz: the data of gzip end early"));
}

TEST_F(GzipTest, DamageIsAnError) {
  const std::string text = ManyRows();
  std::string packed = Gzip(text);
  packed[packed.size() - 6] ^= 1;  // of the checksum
  EXPECT_THAT(ReadBad("a.csv.gz", packed), HasSubstr("a.csv.gz: the data of gzip are damaged (incorrect data check)"));
  packed = Gzip("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n");
  packed[packed.size() - 6] ^= 1;
  EXPECT_THAT(ReadBad("a.ply.gz", packed), HasSubstr("(incorrect data check)"));
  EXPECT_THAT(ReadBad("a.csv.gz", "1,2\n"), HasSubstr("a.csv.gz: expected a file of gzip, which starts with"));
}

TEST_F(GzipTest, BombsAreRefused) {
  // A hundred times the same member, which is 16 MiB of rows.
  std::string rows;
  while (rows.size() < size_t{16} << 20) {
    rows += "0,0\n";
  }
  const std::string member = Gzip(rows);
  std::string bomb;
  for (int i = 0; i < 100; ++i) {
    bomb += member;
  }
  EXPECT_THAT(ReadBad("a.csv.gz", bomb), HasSubstr("inflate to more than 500 times their size"));
  EXPECT_THAT(ReadBad("a.csv.gz", Gzip(std::string(size_t{16} << 20, '7'))),
              HasSubstr("a.csv.gz:1: the line is longer"));
  // Blank lines are no rows, and take no memory; but time.
  std::string blank;
  for (int i = 0; i < 100; ++i) {
    blank += Gzip(std::string(size_t{1} << 20, '\n'));
  }
  EXPECT_THAT(ReadBad("a.csv.gz", blank), HasSubstr("inflate to more than 500 times their size"));
}

TEST_F(GzipTest, ReadsPipes) {
  const std::string path = folder_.Path("pipe.csv.gz");
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const std::string packed = Gzip(ManyRows());
  std::thread writer([&] { folder_.Write("pipe.csv.gz", packed); });
  const absl::StatusOr<PointCloud> cloud = ReadCloud(path);
  writer.join();
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->size(), 100'000u);
  EXPECT_EQ(cloud->points.back(), 99'999);
}

}  // namespace
}  // namespace wellspace::formats
