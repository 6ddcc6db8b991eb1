// Files of VTK's own writers: appended data, pieces, meshes in the legacy format and of polygons.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "client/formats/mesh_or_cloud.h"
#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/formats/vtk/vtk_array.h"
#include "tests/client/formats/mesh_files_fixture.h"
#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string TestData(const std::string& name) {
  const char* const folder = std::getenv("WELLSPACE_DATA_DIR");
  return std::string(folder == nullptr ? "tests/data" : folder) + "/formats/" + name;
}

// The encoding of a file's arrays.
struct Encoding {
  bool is_base64 = false;
  bool is_compressed = false;
  bool is_wide = false;   // the words of headers
  bool is_apart = false;  // base64 of the header ends before that of the bytes
};

std::string Words(std::vector<uint64_t> words, const Encoding& encoding) {
  std::string bytes;
  for (const uint64_t word : words) {
    bytes.append(reinterpret_cast<const char*>(&word), encoding.is_wide ? 8 : 4);
  }
  return bytes;
}

std::string Base64(const std::string& bytes) {
  std::string text;
  AppendBase64(bytes, text);
  return text;
}

// An array in blocks of 48 bytes if it is compressed.
std::string Encoded(const std::string& bytes, const Encoding& encoding) {
  std::vector<uint64_t> words = {bytes.size()};
  std::string data = bytes;
  if (encoding.is_compressed) {
    constexpr size_t kBlock = 48;
    data.clear();
    words = {(bytes.size() + kBlock - 1) / kBlock, kBlock, bytes.size() % kBlock};
    for (size_t at = 0; at < bytes.size(); at += kBlock) {
      const std::string block = bytes.substr(at, kBlock);
      std::string packed(compressBound(block.size()), '\0');
      uLongf size = packed.size();
      EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(block.data()),
                         block.size()),
                Z_OK);
      data += packed.substr(0, size);
      words.push_back(size);
    }
  }
  const std::string header = Words(words, encoding);
  if (!encoding.is_base64) {
    return header + data;
  }
  return encoding.is_compressed || encoding.is_apart ? Base64(header) + Base64(data) : Base64(header + data);
}

template <typename T>
std::string Bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// A square of two triangles, appended; `cut` bytes are missing at the end.
std::string AppendedSquare(const Encoding& encoding, size_t cut = 0) {
  std::string data;
  std::string text =
      "<?xml version=\"1.0\"?>\n<!-- <AppendedData encoding=\"raw\">_ comes later -->\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"";
  text += encoding.is_wide ? "UInt64\"" : "UInt32\"";
  text += encoding.is_compressed ? " compressor=\"vtkZLibDataCompressor\">" : ">";
  text += "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">";
  const auto add = [&](const std::string& attributes, const std::string& bytes) {
    text += "<DataArray " + attributes + " format=\"appended\" offset=\"" + std::to_string(data.size()) + "\"/>";
    data += Encoded(bytes, encoding);
  };
  text += "<PointData>";
  add("type=\"Float64\" Name=\"h\"", Bytes<double>({0.1, 0.2, 0.3, 0.4}));
  text += "</PointData><CellData>";
  add("type=\"Int32\" Name=\"region\"", Bytes<int32_t>({3, 4}));
  text += "</CellData><Points>";
  add("type=\"Float64\" NumberOfComponents=\"3\"", Bytes<double>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}));
  text += "</Points><Cells>";
  add("type=\"Int64\" Name=\"connectivity\"", Bytes<int64_t>({0, 1, 2, 0, 2, 3}));
  add("type=\"Int64\" Name=\"offsets\"", Bytes<int64_t>({3, 6}));
  add("type=\"UInt8\" Name=\"types\"", Bytes<uint8_t>({5, 5}));
  text += "</Cells></Piece></UnstructuredGrid>\n  <AppendedData encoding=\"";
  text += encoding.is_base64 ? "base64" : "raw";
  text += "\">\n   _" + data.substr(0, data.size() - cut);
  return cut > 0 ? text : text + "\n  </AppendedData>\n</VTKFile>\n";
}

class VtkFilesTest : public MeshFilesFixture {
 protected:
  MeshOrCloud ReadEither(const std::string& name) {
    absl::StatusOr<MeshOrCloud> read = ReadMeshOrCloud(folder_.Path(name), {.keep_attributes = true});
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *std::move(read) : MeshOrCloud{};
  }

  void ExpectSquare(const Mesh& mesh) {
    EXPECT_EQ(mesh.dimension, 2);
    EXPECT_THAT(mesh.points, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
    EXPECT_THAT(mesh.simplices, ElementsAre(0, 1, 2, 0, 2, 3));
    EXPECT_THAT(mesh.simplex_regions, ElementsAre(3, 4));
  }
};

std::vector<Encoding> AllEncodings() {
  std::vector<Encoding> all;
  for (const bool is_compressed : {false, true}) {
    for (const bool is_wide : {false, true}) {
      for (const bool is_base64 : {false, true}) {
        for (const bool is_apart : {false, true}) {
          all.push_back({is_base64, is_compressed, is_wide, is_apart});
        }
      }
    }
  }
  return all;
}

TEST_F(VtkFilesTest, AppendedDataOfEveryKind) {
  for (const Encoding& encoding : AllEncodings()) {
    SCOPED_TRACE(testing::PrintToString(
        std::vector<bool>{encoding.is_base64, encoding.is_compressed, encoding.is_wide, encoding.is_apart}));
    folder_.Write("a.vtu", AppendedSquare(encoding));
    ExpectSquare(ReadGood("a.vtu"));
    const MeshOrCloud read = ReadEither("a.vtu");
    EXPECT_THAT(read.notes, IsEmpty());
    ASSERT_EQ(read.attributes.size(), 1);
    EXPECT_EQ(read.attributes[0], (Attribute{"h", {0.1, 0.2, 0.3, 0.4}}));
  }
}

// Cut anywhere in its data, or with an offset that is none, a file is refused and names the line.
TEST_F(VtkFilesTest, AppendedDataThatAreNotThere) {
  for (const Encoding& encoding : AllEncodings()) {
    const size_t all = AppendedSquare(encoding).size();
    for (size_t cut = 1; cut < 60 && cut < all; ++cut) {
      folder_.Write("a.vtu", AppendedSquare(encoding, cut));
      EXPECT_THAT(ReadBad("a.vtu"), HasSubstr("a.vtu:3: ")) << cut;
    }
  }
  folder_.Write("a.vtu", AppendedSquare({}));
  EXPECT_THAT(
      ReadBadWith("a.vtu", "\"types\" format=\"appended\" offset=\"", "\"types\" format=\"appended\" offset=\"9999"),
      HasSubstr("a.vtu:3: expected the offset of an array in <AppendedData>, at most "));
  folder_.Write("a.vtu", AppendedSquare({}));
  EXPECT_THAT(ReadBadWith("a.vtu", "   _", "    "), HasSubstr("<AppendedData>, which is not there"));
}

// The file of a user, made by vtkXMLUnstructuredGridWriter.
TEST_F(VtkFilesTest, AppendedDataOfVtkItself) {
  const absl::StatusOr<Mesh> mesh = ReadMesh(TestData("appended_raw.vtu"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->dimension, 2);
  EXPECT_EQ(mesh->points.size(), 8);
  EXPECT_EQ(mesh->simplices.size(), 6);
  const absl::StatusOr<PointCloud> cloud = ReadCloud(TestData("appended_raw.vtu"), {.keep_attributes = true});
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->attributes.size(), 1);
  EXPECT_EQ(cloud->attributes[0].name, "h");
  EXPECT_EQ(cloud->attributes[0].values.size(), 4);
}

std::string Piece(const std::string& points, const std::string& cells, const std::string& regions) {
  return "<Piece NumberOfPoints=\"3\" NumberOfCells=\"1\"><PointData><DataArray type=\"Int32\" Name=\"id\" "
         "format=\"ascii\">1 2 3</DataArray></PointData><CellData><DataArray type=\"Int32\" Name=\"region\" "
         "format=\"ascii\">" +
         regions +
         "</DataArray></CellData><Points><DataArray type=\"Float64\" "
         "NumberOfComponents=\"3\" format=\"ascii\">" +
         points +
         "</DataArray></Points><Cells><DataArray type=\"Int64\" "
         "Name=\"offsets\" format=\"ascii\">3</DataArray><DataArray type=\"Int64\" Name=\"connectivity\" "
         "format=\"ascii\">" +
         cells +
         "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5"
         "</DataArray></Cells></Piece>";
}

TEST_F(VtkFilesTest, PiecesFollowOneAnother) {
  const auto file = [](const std::string& pieces) {
    return "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>" + pieces + "</UnstructuredGrid></VTKFile>";
  };
  const std::string first = Piece("0 0 0 1 0 0 0 1 0", "0 1 2", "8");
  folder_.Write("a.vtu", file(first + Piece("5 0 0 6 0 0 5 1 0", "2 0 1", "9")));
  const MeshOrCloud read = ReadEither("a.vtu");
  EXPECT_THAT(read.mesh.points, ElementsAre(0, 0, 1, 0, 0, 1, 5, 0, 6, 0, 5, 1));
  EXPECT_THAT(read.mesh.simplices, ElementsAre(0, 1, 2, 5, 3, 4));
  EXPECT_THAT(read.mesh.simplex_regions, ElementsAre(8, 9));
  ASSERT_EQ(read.attributes.size(), 1);
  EXPECT_THAT(read.attributes[0].values, ElementsAre(1, 2, 3, 1, 2, 3));
  // A vertex of another piece is none.
  folder_.Write("a.vtu", file(first + Piece("5 0 0 6 0 0 5 1 0", "2 0 3", "9")));
  EXPECT_THAT(ReadBad("a.vtu"), HasSubstr("cell 1: expected vertices from 0 to below 3, got 3"));
}

// Data of a cell with a triangle between those of two tetrahedra, in two pieces.
TEST_F(VtkFilesTest, DataOfCellsAreThoseOfSimplices) {
  const auto piece = [](const std::string& data, const char* type = "Float32") {
    return std::string("<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\"><CellData><DataArray type=\"") + type +
           "\" Name=\"u\" NumberOfComponents=\"2\" format=\"ascii\">" + data +
           "</DataArray><DataArray type=\"String\" Name=\"title\" format=\"ascii\">97</DataArray></CellData><Points>"
           "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1"
           "</DataArray></Points><Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">"
           "0 1 2 3 0 1 2 1 2 3 4</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 7 11"
           "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 5 10</DataArray></Cells></Piece>";
  };
  const auto write = [&](const std::string& pieces) {
    folder_.Write("a.vtu",
                  "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>" + pieces + "</UnstructuredGrid></VTKFile>");
  };
  write(piece("1 2 3 4 5 6") + piece("7 nan 9 10 11 12"));
  const MeshOrCloud read = ReadEither("a.vtu");
  ASSERT_EQ(read.View().simplex_attributes.size(), 2);
  const Attribute& first = read.View().simplex_attributes[0];
  EXPECT_EQ(first.name, "u:0");
  EXPECT_THAT(first.values, ElementsAre(1, 5, 7, 11));
  const Attribute& second = read.View().simplex_attributes[1];
  EXPECT_EQ(second.name, "u:1");
  EXPECT_THAT(second.values, ElementsAre(2, 6, ::testing::IsNan(), 12));
  EXPECT_THAT(ReadGood("a.vtu").simplex_attributes, IsEmpty()) << "they are not asked for";
  // Of the second piece alone, or with a number too few.
  for (const std::string& numbers : {std::string("1 2 3 4 5"), std::string()}) {
    write(piece("1 2 3 4 5 6") + piece(numbers));
    const absl::StatusOr<Mesh> bad = ReadMesh(folder_.Path("a.vtu"), SimplexData::kKeep);
    EXPECT_THAT(std::string(bad.status().message()), HasSubstr("expected 2 values of \"u\" for each of 6 cells, got"));
    EXPECT_TRUE(ReadMesh(folder_.Path("a.vtu")).ok());
  }
}

TEST_F(VtkFilesTest, DataOfCellsOfLegacyFilesAndPolygons) {
  folder_.Write("a.vtk",
                "# vtk DataFile Version 2.0\nsquare\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
                "LINES 1 3\n2 0 1\nPOLYGONS 2 8 3 0 1 2 3 0 2 3 CELL_DATA 3 SCALARS region int\nLOOKUP_TABLE t 9 3 4\n"
                "VECTORS flow double 1 2 3 4 5 6 7 8 9 SCALARS heat double 1 LOOKUP_TABLE default 0.5 1.5 2.5\n");
  const MeshOrCloud legacy = ReadEither("a.vtk");
  ASSERT_EQ(legacy.mesh.simplex_attributes.size(), 4);
  EXPECT_EQ(legacy.mesh.simplex_attributes[1].name, "flow:1");
  EXPECT_THAT(legacy.mesh.simplex_attributes[1].values, ElementsAre(5, 8));
  EXPECT_EQ(legacy.mesh.simplex_attributes[3].name, "heat");
  EXPECT_THAT(legacy.mesh.simplex_attributes[3].values, ElementsAre(1.5, 2.5));
  folder_.Write("a.vtp",
                "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"4\" NumberOfVerts=\"1\" "
                "NumberOfPolys=\"1\"><CellData><DataArray type=\"Int8\" Name=\"k\" format=\"ascii\">5 6</DataArray>"
                "</CellData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">"
                "0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points><Verts><DataArray type=\"Int64\" Name=\"connectivity\" "
                "format=\"ascii\">3</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">1"
                "</DataArray></Verts><Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2"
                "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece>"
                "</PolyData></VTKFile>");
  const MeshOrCloud polygons = ReadEither("a.vtp");
  ASSERT_EQ(polygons.mesh.simplex_attributes.size(), 1);
  EXPECT_THAT(polygons.mesh.simplex_attributes[0].values, ElementsAre(6));
}

constexpr char kLegacySquare[] =
    "# vtk DataFile Version 3.0\nsquare\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n1 1 0\n0 1 "
    "0\n"
    "CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5\n5\nCELL_DATA 2\nSCALARS region int 1\nLOOKUP_TABLE default\n3\n4\n";

TEST_F(VtkFilesTest, LegacyFilesAreMeshes) {
  folder_.Write("a.vtk", kLegacySquare);
  ExpectSquare(ReadGood("a.vtk"));
  EXPECT_TRUE(ReadEither("a.vtk").is_mesh);
  // Nothing but blanks is between words.
  std::string text = kLegacySquare;
  for (size_t at = text.find("DATASET"); at < text.size(); ++at) {
    text[at] = text[at] == '\n' ? ' ' : text[at];
  }
  folder_.Write("a.vtk", text);
  ExpectSquare(ReadGood("a.vtk"));
  folder_.Write(
      "a.vtk",
      "# vtk DataFile Version 5.1\nsquare\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD f 1\ntitle 1 2 string\na b\nc\n"
      "POINTS 4 double\n0 0 0 1 0 0 1 1 0 0 1 0\nMETADATA\nINFORMATION 0\n\nCELLS 3 6\nOFFSETS vtktypeint64\n"
      "0 3 6\nCONNECTIVITY vtktypeint64\n0 1 2 0 2 3\nCELL_TYPES 2\n5 5\nCELL_DATA 2\nFIELD FieldData 1\n"
      "region 1 2 int\n3 4\n");
  ExpectSquare(ReadGood("a.vtk"));
  // Polygons in the plane are triangles, lines without a tag are left out and told of.
  folder_.Write(
      "a.vtk",
      "# vtk DataFile Version 2.0\nsquare\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
      "LINES 1 3\n2 0 1\nPOLYGONS 2 8 3 0 1 2 3 0 2 3 CELL_DATA 3 SCALARS region int\nLOOKUP_TABLE t 9 3 4\n");
  const Mesh polygons = ReadGood("a.vtk");
  ExpectSquare(polygons);
  EXPECT_THAT(polygons.notes, ElementsAre(HasSubstr("1 cell is left out")));
}

TEST_F(VtkFilesTest, ErrorsOfLegacyMeshes) {
  const auto message = [this](const std::string& from, const std::string& to) {
    folder_.Write("a.vtk", kLegacySquare);
    return ReadBadWith("a.vtk", from, to);
  };
  EXPECT_THAT(message("3 0 2 3", "4 0 2 3"), HasSubstr("cell 1: expected a number of vertices that are there"));
  EXPECT_THAT(message("3 0 2 3", "2 0 2 3"), HasSubstr("expected vertices of 2 cells, got 1 more"));
  EXPECT_THAT(message("3 0 2 3", "3 0 2 4"), HasSubstr("cell 1: expected vertices from 0 to below 4, got 4"));
  EXPECT_THAT(message("3 0 2 3", "3 0 2 -1"), HasSubstr("got -1"));
  EXPECT_THAT(message("\n5\n5\n", "\n5\n9\n"), HasSubstr("got type 9"));
  EXPECT_THAT(message("CELL_TYPES 2\n5\n5\n", ""), HasSubstr("got 0 types and 2 offsets"));
  EXPECT_THAT(message("0 1 0\n", "0 1 0.5\n"), HasSubstr("expected z = 0"));
  EXPECT_THAT(message("0 1 0\n", "0 nan 0\n"), HasSubstr("point 3: expected finite coordinates, got nan"));
  EXPECT_THAT(message("UNSTRUCTURED_GRID", "STRUCTURED_GRID"), HasSubstr("got a STRUCTURED_GRID"));
  EXPECT_THAT(message("CELLS 2 8", "CELLS 4000000000 8"), HasSubstr("a.vtk:"));
  ExpectCutAnywhereIsNoTrouble(Mesh{.dimension = 2, .points = {0, 0, 1, 0, 0, 1}, .simplices = {0, 1, 2}}, "a.vtk",
                               "vtk");
}

// Points in the plane stay there, though VTK's have a third coordinate.
TEST_F(VtkFilesTest, OurFlatPointsHaveTwoCoordinates) {
  for (const char* name : {"a.vtu", "a.vtk"}) {
    for (const int dimension : {2, 3}) {
      Mesh points{.dimension = dimension, .points = {0, 0, 0, 1, 0.5, 0}, .simplices = {}};
      Write(points, name);
      EXPECT_EQ(ReadGood(name).dimension, dimension);
      EXPECT_EQ(ReadGood(name).points, points.points);
    }
  }
}

// The kind of the cells that `convert` lost: cells that are no simplices, of which only the points are taken.
TEST_F(VtkFilesTest, CellsThatAreNotReadAreToldOf) {
  std::string quads = kLegacySquare;
  quads.replace(quads.find("CELLS 2 8"), std::string::npos, "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n9\n");
  folder_.Write("a.vtk", quads);
  const MeshOrCloud legacy = ReadEither("a.vtk");
  EXPECT_FALSE(legacy.is_mesh);
  EXPECT_THAT(legacy.notes, ElementsAre(HasSubstr("only points are read, since it is no mesh of simplices: "),
                                        HasSubstr("1 cell is not used, only the points"),
                                        HasSubstr("all points have z = 0, and are taken in the plane")));
  const std::string polygons =
      "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"4\" NumberOfPolys=\"1\"><Points><DataArray "
      "type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points><Polys>"
      "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray type=\"Int64\" "
      "Name=\"offsets\" format=\"ascii\">4</DataArray></Polys></Piece></PolyData></VTKFile>";
  folder_.Write("a.vtp", polygons);
  EXPECT_THAT(ReadEither("a.vtp").notes,
              ElementsAre(HasSubstr("got type 7"), HasSubstr("1 cell is not used"), HasSubstr("in the plane")));
  std::string triangle = polygons;
  triangle.replace(triangle.find("0 1 2 3<"), 8, "0 1 2<");
  triangle.replace(triangle.find(">4<"), 3, ">3<");
  folder_.Write("a.vtp", triangle);
  EXPECT_THAT(ReadGood("a.vtp").simplices, ElementsAre(0, 1, 2));
  EXPECT_EQ(ReadGood("a.vtp").dimension, 2);
}

// A pair of which one file is damaged is no cloud.
TEST_F(VtkFilesTest, HalfAPairIsRefused) {
  folder_.Write("a.node", "3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n");
  EXPECT_FALSE(ReadEither("a.node").is_mesh);
  folder_.Write("a.ele", "1 3 0\n0 0 1 3\n");
  EXPECT_THAT(std::string(ReadMeshOrCloud(folder_.Path("a.node"), {}).status().message()),
              HasSubstr("got \"3\"; --input-format node reads the points alone"));
  EXPECT_TRUE(ReadMeshOrCloud(folder_.Path("a.node"), {.format = "node"}).ok());
}

// Written by VTK 9.1.
TEST_F(VtkFilesTest, CompressedByLz4AndLzma) {
  const char* const folder = std::getenv("WELLSPACE_DATA_DIR");
  for (const char* name : {"vtk_lz4.vtu", "vtk_lzma.vtu"}) {
    SCOPED_TRACE(name);
    const absl::StatusOr<Mesh> mesh =
        ReadMesh(std::string(folder == nullptr ? "tests/data" : folder) + "/formats/" + name);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->dimension, 2);
    ASSERT_EQ(mesh->points.size(), 50);
    EXPECT_EQ(mesh->points[49], 4 / 3.0);
    EXPECT_EQ(mesh->points[48], 1 + 16 / 64.0);
    ASSERT_EQ(mesh->simplices.size(), 96);
    EXPECT_THAT(std::vector<uint32_t>(mesh->simplices.begin(), mesh->simplices.begin() + 6),
                ElementsAre(0, 1, 6, 0, 6, 5));
  }
}

}  // namespace
}  // namespace wellspace::formats
