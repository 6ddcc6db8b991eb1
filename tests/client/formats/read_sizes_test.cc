// Sizes at points from tables and from the points of meshes.
#include "client/formats/read_sizes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ReadSizesTest : public ::testing::Test {
 protected:
  SizedPoints Read(const std::string& name, std::string_view content, int dimension) {
    absl::StatusOr<SizedPoints> read = ReadSizes(folder_.Write(name, content), dimension);
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *std::move(read) : SizedPoints();
  }
  std::string Refusal(const std::string& name, std::string_view content, int dimension) {
    const absl::Status status = ReadSizes(folder_.Write(name, content), dimension).status();
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

TEST_F(ReadSizesTest, OfAVtuItsPointData) {
  const SizedPoints read = Read("s.vtu", Vtu("h", "0.5 0.25 2"), 2);
  EXPECT_THAT(read.cloud.points, ElementsAre(0, 0, 1, 0, 0, 1));
  EXPECT_THAT(read.sizes, ElementsAre(0.5, 0.25, 2));
  EXPECT_THAT(Refusal("s.vtu", Vtu("h", "0.5 0.25 0"), 2), HasSubstr("s.vtu[2]: size 0 is not allowed"));
  EXPECT_THAT(Refusal("s.vtu", Vtu("h", "0.5 0.25 nan"), 2), HasSubstr("s.vtu"));
  EXPECT_THAT(Refusal("s.vtu", Vtu("h", "0.5 0.25"), 2), HasSubstr("expected a number for each of 3 points, got 2"));
  EXPECT_THAT(Refusal("s.vtu", Vtu("g", "1 2 3"), 2), HasSubstr("no data of its points are called \"h\""));
  EXPECT_THAT(Refusal("s.vtu", Vtu("h", "1 2 3"), 3), HasSubstr("expected points in 3-D, got 2-D"));
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

}  // namespace
}  // namespace wellspace::formats
