// Sizes at points from tables and from the points of meshes.
#include "client/formats/read_sizes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using std::string_literals::operator""s;

class ReadSizesTest : public ::testing::Test {
 protected:
  SizedPoints Read(const std::string& name, std::string_view content, int dimension, const SizeOptions& options = {}) {
    absl::StatusOr<SizedPoints> read = ReadSizes(folder_.Write(name, content), dimension, options);
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *std::move(read) : SizedPoints();
  }
  std::string Refusal(const std::string& name, std::string_view content, int dimension,
                      const SizeOptions& options = {}) {
    const absl::Status status = ReadSizes(folder_.Write(name, content), dimension, options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << content;
    return std::string(status.message());
  }

  TemporaryFolder folder_;
};

TEST_F(ReadSizesTest, OfATableWithoutNamesTheLastColumn) {
  const SizedPoints read = Read("s.csv", "0.25,0.5,1e-3\n\n# so\n1,-2,4\n", 2);
  EXPECT_THAT(read.cloud.points, ElementsAre(0.25, 0.5, 1, -2));
  EXPECT_THAT(read.sizes, ElementsAre(1e-3, 4));
  EXPECT_EQ(read.cloud.Origin(1), folder_.Path("s.csv") + ":4");
  EXPECT_THAT(Read("s.txt", "1 2 3 4 5 6 7\n", 6).sizes, ElementsAre(7));
  EXPECT_THAT(Read("s.tsv", "1\t2\t3\t4\n", 3).sizes, ElementsAre(4));
}

TEST_F(ReadSizesTest, OfATableWithNamesTheColumnThatIsCalledSo) {
  const SizedPoints read = Read("s.csv", "id,h,x,y\n7,0.5,1,2\n8,0.25,3,4\n", 2);
  EXPECT_THAT(read.cloud.points, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(read.sizes, ElementsAre(0.5, 0.25));
  EXPECT_THAT(Read("s.csv", "lon;lat;Size\n1;2;3\n", 2).sizes, ElementsAre(3));
  EXPECT_THAT(Read("s.csv", "a,b,c,d,h\n1,2,3,4,5\n", 4).cloud.points, ElementsAre(1, 2, 3, 4));
}

TEST_F(ReadSizesTest, WhatIsWrongInATableIsNamedByItsRow) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"x,y,h\n1,2,0\n", ":2: size 0 is not allowed; a number above 0 is"},
      {"1,2,3\n1,2,-3\n", ":2: size -3 is not allowed"},
      {"1,2,3\n1,2,nan\n", ":2: column 3: expected a finite number, got \"nan\""},
      {"1,2,inf\n", ":1: column 3: "},
      {"x,y,h\n1,,3\n", ":2: column 2: "},
      {"1,2,3\n1,2\n", ":2: expected 3 fields, got 2"},
      {"1,2\n", ":1: expected 2 coordinates and a size, got 2 columns"},
      {"1,2,3,4\n", ":1: expected 2 coordinates and a size, got 4 columns"},
      {"x,y,z\n1,2,3\n", ":1: no column is called \"h\" or \"size\""},
      {"x,y,z,h\n1,2,3,4\n", ":1: expected 2 columns of coordinates beside \"h\", got 3"},
      {"x,y,h\n", ": no sizes; expected at least one"},
      {"", ": no sizes; expected at least one"},
  };
  for (const auto& [content, message] : wrong) {
    EXPECT_THAT(Refusal("s.csv", content, 2), HasSubstr("s.csv" + message)) << content;
  }
  EXPECT_THAT(Refusal("s.obj", "", 2), HasSubstr("no format is known by the extension \".obj\""));
}

constexpr char kVtu[] = R"(<VTKFile type="UnstructuredGrid" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="3" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5</DataArray></Cells>
<PointData><DataArray type="Float64" Name="NAME" format="ascii">VALUES</DataArray></PointData>
</Piece></UnstructuredGrid></VTKFile>)";

std::string Vtu(const std::string& name, const std::string& values) {
  std::string text = kVtu;
  text.replace(text.find("NAME"), 4, name);
  return text.replace(text.find("VALUES"), 6, values);
}

constexpr char kMsh[] =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n7 0 1 0\n$EndNodes\n"
    "$Elements\n1\n1 2 2 1 1 1 2 7\n$EndElements\n";
constexpr char kNodeData[] = "$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n3\n1 0.5\n7 2\n2 0.25\n$EndNodeData\n";

TEST_F(ReadSizesTest, OfAMshItsNodeData) {
  const SizedPoints read = Read("s.msh", std::string(kMsh) + kNodeData, 2);
  EXPECT_THAT(read.cloud.points, ElementsAre(0, 0, 1, 0, 0, 1));
  EXPECT_THAT(read.sizes, ElementsAre(0.5, 0.25, 2));
  EXPECT_THAT(Refusal("s.msh", kMsh, 2), HasSubstr("no data of its points are called \"h\""));
}

// As GDAL and ArcGIS write it: words in any case, the lower left corner or its cell's centre, lines of any length.
constexpr char kEsriGrid[] =
    "ncols        3\nnrows        2\nxllcorner    100.0\nyllcorner    -20\ncellsize     10\nNODATA_value  -9999\n"
    " 1 2 -9999\n 4\n 5.5 nan\n";

TEST_F(ReadSizesTest, OfAnEsriGridTheCentresOfItsCells) {
  const SizedPoints read = Read("s.asc", kEsriGrid, 2);
  EXPECT_THAT(read.cloud.points, ElementsAre(105, -5, 115, -5, 105, -15, 115, -15));
  EXPECT_THAT(read.sizes, ElementsAre(1, 2, 4, 5.5));
  EXPECT_EQ(read.cloud.skipped, 2);
  EXPECT_THAT(read.cloud.notes, ElementsAre(HasSubstr("2 of 6 cells of the raster have no data, and no size")));
  EXPECT_EQ(read.cloud.Origin(2), folder_.Path("s.asc") + "[3]");
  const SizedPoints centres = Read("s.asc", "NCOLS 1\nNROWS 2\nXLLCENTER 1\nYLLCENTER 2\nDX 1\nDY 0.5\n7 8", 2);
  EXPECT_THAT(centres.cloud.points, ElementsAre(1, 2.5, 1, 2));
  EXPECT_THAT(centres.sizes, ElementsAre(7, 8));
  EXPECT_TRUE(centres.cloud.notes.empty());
}

TEST_F(ReadSizesTest, WhatIsWrongInAnEsriGridIsToldWithItsLine) {
  const auto refusal = [this](const std::string& from, const std::string& to) {
    std::string text = kEsriGrid;
    text.replace(text.find(from), from.size(), to);
    return Refusal("s.asc", text, 2);
  };
  EXPECT_THAT(Refusal("s.asc", "", 2), HasSubstr("expected ncols in the header, a whole number from 1 on"));
  EXPECT_THAT(refusal("ncols        3", "ncols 2.5"), HasSubstr("expected ncols in the header, a whole number from 1"));
  EXPECT_THAT(refusal("ncols        3", "ncols 4000000000"), HasSubstr("expected fewer than 2^32 cells, at least one"));
  EXPECT_THAT(refusal("ncols        3", "nculs 3"),
              HasSubstr("s.asc:1: expected a word of the header of an ESRI grid"));
  EXPECT_THAT(refusal("nrows        2", "ncols 3"), HasSubstr("s.asc:2: expected ncols once, got it again"));
  EXPECT_THAT(refusal("xllcorner    100.0", "xllcorner inf"),
              HasSubstr("s.asc:3: xllcorner: expected a finite number"));
  EXPECT_THAT(refusal("xllcorner    100.0", ""), HasSubstr("expected either xllcorner or xllcenter in the header"));
  EXPECT_THAT(refusal("cellsize     10", "cellsize 10 dx 10"), HasSubstr("expected either cellsize or dx"));
  EXPECT_THAT(refusal("cellsize     10", "cellsize 0"), HasSubstr("expected cells with a width and a height above 0"));
  EXPECT_THAT(refusal("cellsize     10", "cellsize 1e308"), HasSubstr("expected cells with a width and a height"));
  EXPECT_THAT(refusal(" 4\n", " x\n"), HasSubstr("s.asc:8: a cell: expected a number, got \"x\""));
  EXPECT_THAT(refusal(" nan", ""), HasSubstr("s.asc:9: the file ends; expected 6 cells, got 5"));
  EXPECT_THAT(refusal(" nan", " 1 1"), HasSubstr("s.asc:9: expected 6 cells, as the header says, got more"));
  EXPECT_THAT(refusal(" 4\n", " 0\n"), HasSubstr("s.asc[3]: size 0 is not allowed; a number above 0 is"));
  EXPECT_THAT(Refusal("s.asc", kEsriGrid, 3), HasSubstr("a raster has sizes in the plane"));
}

// A file of tests/data/formats.
std::string RasterOfLibtiff(const std::string& name) {
  const char* const folder = std::getenv("WELLSPACE_DATA_DIR");
  std::ifstream file(std::string(folder == nullptr ? "tests/data" : folder) + "/formats/raster_" + name + ".tif",
                     std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Rasters of 17 columns and 20 rows, written by libtiff 4.5: differences of int16 by LZW; float32 in tiles, by deflate
// with the predictor of floating-point numbers; bytes by PackBits in the other byte order. The places are the same, but
// that in the second those of centres are told.
TEST_F(ReadSizesTest, OfAGeoTiffTheCentresOfItsCells) {
  struct Case {
    const char* name;
    double scale;
    double nodata;
    double corner;  // half a cell, if places are those of corners
  };
  for (const Case& one :
       {Case{"lzw", 1, 29, 0.5}, Case{"deflate_tiles", 0.125, 3.625, 0}, Case{"packbits_big", 1, 0, 0.5}}) {
    SCOPED_TRACE(one.name);
    const SizedPoints read = Read("s.tif", RasterOfLibtiff(one.name), 2);
    size_t at = 0;
    for (int cell = 0; cell < 17 * 20; ++cell) {
      const int column = cell % 17;
      const int row = cell / 17;
      const double size = (1 + (column * 3 + row * 7) % 50) * one.scale;
      if (size == one.nodata) {
        continue;
      }
      ASSERT_LT(at, read.sizes.size());
      EXPECT_EQ(read.sizes[at], size) << cell;
      EXPECT_EQ(read.cloud.points[2 * at], 1000 + (column + one.corner) * 10) << cell;
      EXPECT_EQ(read.cloud.points[2 * at + 1], 2000 - (row + one.corner) * 5) << cell;
      EXPECT_EQ(read.cloud.Origin(at), folder_.Path("s.tif") + "[" + std::to_string(cell) + "]");
      ++at;
    }
    EXPECT_EQ(at, read.sizes.size());
    EXPECT_EQ(read.cloud.skipped, 340 - at);
    EXPECT_EQ(read.cloud.notes.size(), at < 340 ? 1 : 0);
  }
}

TEST_F(ReadSizesTest, WhatIsWrongInAGeoTiffIsTold) {
  const std::string good = RasterOfLibtiff("lzw");
  const auto word = [](const std::string& bytes, size_t at, size_t size) {
    size_t value = 0;
    for (size_t i = size; i-- > 0;) {
      value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
    }
    return value;
  };
  // With another value of a tag, or another tag in its place.
  const auto refusal = [&](uint16_t tag, uint32_t value, uint16_t other = 0) {
    std::string bytes = good;
    const size_t directory = word(bytes, 4, 4);
    for (size_t i = 0; i < word(bytes, directory, 2); ++i) {
      const size_t entry = directory + 2 + 12 * i;
      if (word(bytes, entry, 2) == tag) {
        bytes.replace(entry + 8, 4, reinterpret_cast<const char*>(&value), 4);
        bytes.replace(entry, 2, reinterpret_cast<const char*>(other == 0 ? &tag : &other), 2);
      }
    }
    return Refusal("s.tif", bytes, 2);
  };
  EXPECT_THAT(Refusal("s.tif", "", 2), HasSubstr("expected a TIFF, which starts with II or MM"));
  EXPECT_THAT(Refusal("s.tif", "II+\0\b\0\0\0"s, 2), HasSubstr("expected a TIFF of the version 42, got 43; gdal_"));
  EXPECT_THAT(Refusal("s.tif", "II*\0\xff\0\0\0"s, 2),
              HasSubstr("expected a directory within the 8 bytes of the file"));
  EXPECT_THAT(refusal(256, 0), HasSubstr("expected fewer than 2^32 cells, at least one, got 0 columns and 20 rows"));
  EXPECT_THAT(refusal(257, 0x7fffffff), HasSubstr("expected at most 1040 cells for each byte of the file"));
  EXPECT_THAT(refusal(258, 12), HasSubstr("expected samples of 8, 16, 32 or 64 bits, floating-point ones of 32 or 64"));
  EXPECT_THAT(refusal(339, 4), HasSubstr("got 16 bits of the format 4"));
  EXPECT_THAT(refusal(259, 7), HasSubstr("expected no compression, LZW, deflate or PackBits, got the number 7; gdal_"));
  EXPECT_THAT(refusal(259, 8), HasSubstr("block 0 does not decompress to 238 bytes by zlib"));
  EXPECT_THAT(refusal(277, 3), HasSubstr("expected one band, got 3; gdal_translate -b 1 takes one"));
  EXPECT_THAT(refusal(278, 5), HasSubstr("expected offsets and sizes of 4 blocks, got 3 and 3"));
  EXPECT_THAT(refusal(317, 3), HasSubstr("expected the predictor 1 or 2, or 3 of floating-point samples, got 3"));
  EXPECT_THAT(refusal(33550, 0, 33551), HasSubstr("expected a tie point (tag 33922) with a scale (33550), or a"));
  EXPECT_THAT(Refusal("s.tif", good, 3), HasSubstr("a raster has sizes in the plane"));
  for (size_t size = 0; size + 4 < good.size(); ++size) {  // the directory is at the end; then the place of another one
    EXPECT_FALSE(ReadSizes(folder_.Write("s.tif", good.substr(0, size)), 2).ok()) << size;
  }
}

TEST_F(ReadSizesTest, WhatIsMissingIsLeftOutAndCounted) {
  const SizeOptions skipping{.skip_invalid = true};
  const SizedPoints read = Read("s.csv", "x,y,h\n1,2,nan\n3,4,0.5\nNA,4,1\n5,6,\n7,8,2\n", 2, skipping);
  EXPECT_THAT(read.cloud.points, ElementsAre(3, 4, 7, 8));
  EXPECT_THAT(read.sizes, ElementsAre(0.5, 2));
  EXPECT_EQ(read.cloud.skipped, 3u);
  EXPECT_THAT(read.cloud.notes, ElementsAre(HasSubstr("s.csv: 3 sizes are left out")));
  EXPECT_EQ(read.cloud.Origin(1), folder_.Path("s.csv") + ":6");
  EXPECT_THAT(Refusal("s.csv", "x,y,h\n1,2,-9999\n", 2, skipping), HasSubstr(":2: size -9999 is not allowed"));
  EXPECT_THAT(Refusal("s.csv", "x,y,h\n1,2,nan\n", 2, skipping), HasSubstr("no sizes"));
  const SizedPoints of_mesh = Read("s.vtu", Vtu("h", "1 nan 3"), 2, skipping);
  EXPECT_THAT(of_mesh.sizes, ElementsAre(1, 3));
  EXPECT_EQ(of_mesh.cloud.skipped, 1u);
  EXPECT_EQ(of_mesh.cloud.Origin(1), folder_.Path("s.vtu") + "[2]");
}

TEST_F(ReadSizesTest, SizesAreInterpolatedBetweenTheVerticesOfAMesh) {
  constexpr double kGrowth = 0.3;
  const SizeOptions interpolating{.growth_to_interpolate = kGrowth};
  for (const std::array<double, 3>& sizes : {std::array{0.1, 0.1, 0.1}, {0.02, 0.1, 0.3}, {5.0, 5.0, 5.0}}) {
    const SizedPoints read =
        Read("s.vtu", Vtu("h", absl::StrCat(sizes[0], " ", sizes[1], " ", sizes[2])), 2, interpolating);
    const size_t count = read.sizes.size();
    ASSERT_GE(count, 3u);
    EXPECT_EQ(read.cloud.points.size(), 2 * count);
    EXPECT_EQ(count == 3, sizes[0] == 5) << "more are needed only where sizes grow above them";
    std::set<std::pair<double, double>> places;
    for (size_t i = 0; i < count; ++i) {
      const double x = read.cloud.points[2 * i];
      const double y = read.cloud.points[2 * i + 1];
      EXPECT_TRUE(places.emplace(x, y).second) << "a point is there twice";
      EXPECT_NEAR(read.sizes[i], sizes[0] * (1 - x - y) + sizes[1] * x + sizes[2] * y, 1e-12);
      EXPECT_THAT(read.cloud.Origin(i), HasSubstr("s.vtu["));
    }
    for (int k = 0; k <= 40; ++k) {
      for (int l = 0; k + l <= 40; ++l) {
        const double x = k / 40.0;
        const double y = l / 40.0;
        double least = std::numeric_limits<double>::infinity();
        for (size_t i = 0; i < count; ++i) {
          least = std::min(least, read.sizes[i] + kGrowth * std::hypot(x - read.cloud.points[2 * i],
                                                                       y - read.cloud.points[2 * i + 1]));
        }
        EXPECT_LE(least, 1.1 * (sizes[0] * (1 - x - y) + sizes[1] * x + sizes[2] * y) + 1e-12);
      }
    }
  }
  // As lengths of edges they stand for smaller circumradii, and more are needed.
  SizeOptions of_edges = interpolating;
  of_edges.radius_of_size = 0.5;
  EXPECT_GT(Read("s.vtu", Vtu("h", "0.1 0.1 0.1"), 2, of_edges).sizes.size(),
            Read("s.vtu", Vtu("h", "0.1 0.1 0.1"), 2, interpolating).sizes.size());
  EXPECT_THAT(Refusal("s.csv", "0,0,1\n", 2, interpolating), HasSubstr("s.csv: no simplices"));
  EXPECT_THAT(Refusal("s.vtu", Vtu("h", "1 nan 1"), 2, interpolating), HasSubstr("s.vtu[1]: size nan"));
  EXPECT_THAT(Refusal("s.vtu", Vtu("h", "1e-9 1e-9 1e-9"), 2, interpolating), HasSubstr("more than 10000000"));
}

}  // namespace
}  // namespace wellspace::formats
