// Points of VTK's grids that are told by their axes, and of files of pieces.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/formats/read_cloud.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const CloudOptions kWithAttributes = {.keep_attributes = true};

// An image of 2 x 3 x 1 points, turned by a quarter about the z axis, with a number at each.
const char kImage[] =
    "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 1 3 2 2\" Origin=\"10 20 30\" Spacing=\"1 2 0.5\" "
    "Direction=\"0 -1 0 1 0 0 0 0 1\"><Piece Extent=\"0 1 1 3 2 2\"><PointData><DataArray type=\"Float64\" Name=\"h\" "
    "format=\"ascii\">1 2 3 4 5 6</DataArray></PointData></Piece></ImageData></VTKFile>";

// A grid of 3 x 2 x 1 points.
const char kRectilinear[] =
    "<VTKFile type=\"RectilinearGrid\"><RectilinearGrid WholeExtent=\"0 2 0 1 0 0\"><Piece Extent=\"0 2 0 1 0 0\">"
    "<Coordinates><DataArray type=\"Float64\" format=\"ascii\">0 0.1 5</DataArray><DataArray type=\"Float64\" "
    "format=\"ascii\">-1 7</DataArray><DataArray type=\"Float64\" format=\"ascii\">3</DataArray></Coordinates></Piece>"
    "</RectilinearGrid></VTKFile>";

std::string Changed(const std::string& text, const std::string& from, const std::string& to) {
  const std::string changed = absl::StrReplaceAll(text, {{from, to}});
  EXPECT_NE(changed, text) << from;
  return changed;
}

class VtkGridsTest : public ReadCloudTest {};

TEST_F(VtkGridsTest, ImagesAreTurnedAndScaled) {
  const PointCloud cloud = ReadGood("a.vti", kImage, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(8, 20, 31, 8, 21, 31, 6, 20, 31, 6, 21, 31, 4, 20, 31, 4, 21, 31));
  ASSERT_EQ(cloud.attributes.size(), 1);
  EXPECT_THAT(cloud.attributes[0].values, ElementsAre(1, 2, 3, 4, 5, 6));
  const std::string plain = Changed(Changed(kImage, "Direction=\"0 -1 0 1 0 0 0 0 1\"", ""), "Origin=\"10 20 30\"", "");
  EXPECT_THAT(ReadGood("a.vti", plain, {.columns = {"x", "y"}}).points,
              ElementsAre(0, 2, 1, 2, 0, 4, 1, 4, 0, 6, 1, 6));
}

TEST_F(VtkGridsTest, DemandsOfImagesAreRefused) {
  for (const auto& [from, to] : {std::pair{"Origin=\"10 20 30\"", "Origin=\"10 20\""},
                                 {"Origin=\"10 20 30\"", "Origin=\"10 nan 30\""},
                                 {"Spacing=\"1 2 0.5\"", "Spacing=\"1 2 0.5 4\""},
                                 {"Direction=\"0 -1", "Direction=\"x -1"}}) {
    EXPECT_THAT(ReadBad("a.vti", Changed(kImage, from, to)), HasSubstr("finite numbers as ")) << to;
  }
  EXPECT_THAT(ReadBad("a.vti", Changed(kImage, "1 2 3 4 5 6", "1 2 3 4 5"), kWithAttributes),
              HasSubstr("expected 1 values of \"h\" for each of 6 points, got 5"));
  // A few bytes tell of a billion points, which no memory is spent on.
  EXPECT_THAT(ReadBad("a.vti", Changed(kImage, "<Piece Extent=\"0 1 1 3 2 2\"", "<Piece Extent=\"0 999 0 999 0 999\"")),
              HasSubstr("expected an Extent of at most "));
  EXPECT_THAT(ReadBad("a.vtr", kImage), HasSubstr("expected <VTKFile type=\"RectilinearGrid\" ...>"));
}

TEST_F(VtkGridsTest, RectilinearGrids) {
  EXPECT_THAT(ReadGood("a.vtr", kRectilinear).points,
              ElementsAre(0, -1, 3, 0.1, -1, 3, 5, -1, 3, 0, 7, 3, 0.1, 7, 3, 5, 7, 3));
  EXPECT_THAT(ReadBad("a.vtr", Changed(kRectilinear, "0 0.1 5", "0 5")),
              HasSubstr("expected 3 coordinates along axis 0, as Extent says, got 2"));
  EXPECT_THAT(ReadBad("a.vtr", Changed(kRectilinear, "<Coordinates>",
                                       "<Coordinates><DataArray type=\"Float64\" format=\"ascii\">1</DataArray>")),
              HasSubstr("expected three arrays in <Coordinates>"));
  EXPECT_THAT(ReadBad("a.vtr", Changed(kRectilinear, "0 0.1 5", "0 inf 5")), HasSubstr("expected a finite number"));
  EXPECT_EQ(ReadGood("a.vtr", Changed(kRectilinear, "0 0.1 5", "0 inf 5"), {.skip_invalid = true}).skipped, 2);
}

TEST_F(VtkGridsTest, LegacyGrids) {
  const std::string image =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 2\nORIGIN 1 2 3\n"
      "SPACING 0.5 1 4\nPOINT_DATA 4\nSCALARS h double 1\nLOOKUP_TABLE default\n1 2 3 4\n";
  const PointCloud cloud = ReadGood("a.vtk", image, kWithAttributes);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 1.5, 2, 3, 1, 2, 7, 1.5, 2, 7));
  ASSERT_EQ(cloud.attributes.size(), 1);
  EXPECT_THAT(cloud.attributes[0].values, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(ReadGood("a.vtk", Changed(image, "SPACING", "ASPECT_RATIO")).points, cloud.points);
  const std::string grid =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 2 2 1\nX_COORDINATES 2 double\n"
      "0 0.1\nY_COORDINATES 2 float\n-1 7\nZ_COORDINATES 1 int\n3\n";
  EXPECT_THAT(ReadGood("a.vtk", grid).points, ElementsAre(0, -1, 3, 0.1, -1, 3, 0, 7, 3, 0.1, 7, 3));
  EXPECT_THAT(ReadBad("a.vtk", Changed(grid, "DIMENSIONS 2 2", "DIMENSIONS 2 3")),
              HasSubstr("expected 3 coordinates along axis 1, as DIMENSIONS says, got 2"));
  EXPECT_THAT(ReadBad("a.vtk", Changed(grid, "Z_COORDINATES 1 int\n3\n", "")), HasSubstr("the file ends"));
  EXPECT_THAT(ReadBad("a.vtk", Changed(image, "SPACING 0.5 1 4", "SPACING 0.5 1 x")),
              HasSubstr("three numbers after SPACING"));
  EXPECT_THAT(ReadBad("a.vtk", Changed(image, "DIMENSIONS 2 1 2", "DIMENSIONS 9999 9999 2")),
              HasSubstr("expected DIMENSIONS of at most "));
  EXPECT_EQ(ReadGood("a.vtk", Changed(image, "DIMENSIONS 2 1 2", "DIMENSIONS 0 4000000000 4000000000")).size(), 0);
}

TEST_F(VtkGridsTest, PiecesLieBesideTheirFile) {
  folder_.Write("a_0.vti", kImage);
  folder_.Write("b_1.vti", Changed(kImage, "Origin=\"10 ", "Origin=\"110 "));
  const std::string pieces =
      "<VTKFile type=\"PImageData\"><PImageData><Piece Source=\"a_0.vti\"/><Piece Source=\"b_1.vti\"/></PImageData>"
      "</VTKFile>";
  const PointCloud cloud = ReadGood("a.pvti", pieces, kWithAttributes);
  ASSERT_EQ(cloud.size(), 12);
  EXPECT_EQ(cloud.points[18], 108);
  ASSERT_EQ(cloud.attributes.size(), 1);
  EXPECT_EQ(cloud.attributes[0].values.size(), 12);
  for (const char* source : {"", "/etc/passwd", "../a_0.vti", "x/../../a_0.vti", ".."}) {
    EXPECT_THAT(ReadBad("a.pvti", Changed(pieces, "b_1.vti", source)), HasSubstr("a file beside this one")) << source;
  }
  EXPECT_THAT(ReadBad("a.pvti", Changed(pieces, "b_1.vti", "a_0.vti")), HasSubstr("expected each piece once"));
  EXPECT_THAT(ReadBad("a.pvti", Changed(pieces, "b_1.vti", "./x/../a_0.vti")), HasSubstr("a file beside this one"));
  EXPECT_THAT(ReadBad("a.pvti", Changed(pieces, "b_1.vti", "././a_0.vti")), HasSubstr("expected each piece once"));
  EXPECT_EQ(Read("a.pvti", Changed(pieces, "b_1.vti", "-")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(ReadBad("a.pvtu", pieces), HasSubstr("expected <VTKFile type=\"PUnstructuredGrid\" ...>"));
  EXPECT_EQ(Read("a.pvti", Changed(pieces, "b_1.vti", "c.vti")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(Read("a.pvti", Changed(pieces, "b_1.vti", "c\n\xff")).status().message()),
              HasSubstr("a.pvti: cannot open the piece \"c\\n\\xff\": No such file"));
  EXPECT_THAT(ReadBad("a.pvti", Changed(pieces, "b_1.vti", ".")),
              HasSubstr("cannot open the piece \".\": it is a folder"));
  folder_.Write("b_1.vti", Changed(kImage, "Name=\"h\"", "Name=\"k\""));
  EXPECT_THAT(ReadBad("a.pvti", pieces, kWithAttributes),
              HasSubstr("b_1.vti: expected data of points as in the pieces before, \"x y z h\", got \"x y z k\""));
  EXPECT_THAT(ReadBad("a.pvti", "<VTKFile type=\"PImageData\"/>"), HasSubstr("expected one <Piece> or more"));
}

// Starts of files are clouds or refused.
TEST_F(VtkGridsTest, CutAnywhere) {
  for (const auto& [name, text] : {std::pair<std::string, std::string>{"a.vti", kImage}, {"a.vtr", kRectilinear}}) {
    for (size_t size = 0; size < text.size(); ++size) {
      const absl::StatusOr<PointCloud> cloud = Read(name, text.substr(0, size), kWithAttributes);
      EXPECT_TRUE(cloud.ok() || absl::IsInvalidArgument(cloud.status())) << size << cloud.status();
    }
  }
}

}  // namespace
}  // namespace wellspace::formats
