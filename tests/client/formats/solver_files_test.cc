// Files for solvers and viewers: .su2, .inp and .xdmf, which Wellspace does not read back, and .vtk. What the programs
// themselves read is tested by interoperability_test.py and programs_test.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "client/formats/write_mesh.h"
#include "tests/client/formats/mesh_files_fixture.h"
#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Kind {
  const char* format;
  const char* file;
};
constexpr Kind kKinds[] = {{"su2", "mesh.su2"}, {"abaqus", "mesh.inp"}, {"vtk", "mesh.vtk"}, {"xdmf", "mesh.xdmf"}};

// The unit square of two triangles, its lower side and its right one tagged, each triangle a region.
Mesh Square() {
  Mesh mesh{.dimension = 2, .points = {0, 0, 1, 0, 0, 1.5, 1, 1.5}, .simplices = {0, 1, 2, 1, 3, 2}};
  mesh.facets = {0, 1, 3, 1};
  mesh.boundary = {{.tag = 3, .name = "ymin", .facets = 1},
                   {.tag = 5, .name = "", .facets = 0},
                   {.tag = 7, .name = "far field, east", .facets = 1}};
  mesh.vertex_tags = {3, 3, 0, 7};
  mesh.vertex_origins = {0, 1, kSteinerOrigin, kCornerOrigin};
  mesh.simplex_regions = {9, 2};
  mesh.regions = {{2, "land"}, {9, ""}};
  return mesh;
}

Mesh Tetrahedron() {
  Mesh mesh{.dimension = 3, .points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, .simplices = {0, 1, 2, 3}};
  mesh.facets = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  mesh.boundary = {{.tag = 5, .name = "zmin", .facets = 1}, {.tag = 3, .name = "Zmin", .facets = 3}};
  mesh.vertex_tags = {5, 5, 5, 3};
  mesh.vertex_origins = {0, 1, 2, 3};
  mesh.regions = {{1, "domain"}};
  return mesh;
}

class SolverFilesTest : public MeshFilesFixture {};

TEST_F(SolverFilesTest, Su2) {
  const Mesh mesh = Square();
  MeshView view = mesh.View();
  view.input_vertices = 2;
  ASSERT_TRUE(WriteMesh(folder_.Path("a.su2"), "", view).ok());
  EXPECT_EQ(folder_.Read("a.su2"),
            "% The first 2 points are input points.\nNDIME= 2\nNPOIN= 4\n0 0 0\n1 0 1\n0 1.5 2\n1 1.5 3\n"
            "NELEM= 2\n5 0 1 2 0\n5 1 3 2 1\n"
            "NMARK= 2\nMARKER_TAG= ymin\nMARKER_ELEMS= 1\n3 0 1 0\n"
            "MARKER_TAG= far_field__east\nMARKER_ELEMS= 1\n3 3 1 0\n");
  Write(Tetrahedron(), "b.su2");
  EXPECT_THAT(folder_.Read("b.su2"), HasSubstr("NELEM= 1\n10 0 1 2 3 0\nNMARK= 2\nMARKER_TAG= zmin\nMARKER_ELEMS= 1\n"
                                               "5 0 2 1 0\nMARKER_TAG= Zmin_3\nMARKER_ELEMS= 3\n5 0 1 3 0\n"));
}

// The sides of elements are numbered as the manuals of Abaqus and CalculiX have it.
TEST_F(SolverFilesTest, Abaqus) {
  const Mesh mesh = Square();
  MeshView view = mesh.View();
  view.input_vertices = 2;
  ASSERT_TRUE(WriteMesh(folder_.Path("a.inp"), "", view).ok());
  EXPECT_EQ(folder_.Read("a.inp"),
            "*HEADING\n4 nodes, 2 triangles\n*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1.5\n4, 1, 1.5\n"
            "*ELEMENT, TYPE=CPS3\n1, 1, 2, 3\n2, 2, 4, 3\n*NSET, NSET=input, GENERATE\n1, 2, 1\n"
            "*ELSET, ELSET=land\n2\n*ELSET, ELSET=region_9\n1\n"
            "*NSET, NSET=ymin\n1, 2\n*SURFACE, NAME=ymin, TYPE=ELEMENT\n1, S1\n"
            "*NSET, NSET=far_field__east\n2, 4\n*SURFACE, NAME=far_field__east, TYPE=ELEMENT\n2, S1\n");
  Write(Tetrahedron(), "b.inp");
  EXPECT_THAT(folder_.Read("b.inp"),
              HasSubstr("*ELEMENT, TYPE=C3D4, ELSET=domain\n1, 1, 2, 3, 4\n"
                        "*NSET, NSET=zmin\n1, 2, 3\n*SURFACE, NAME=zmin, TYPE=ELEMENT\n1, S1\n"
                        "*NSET, NSET=Zmin_3\n1, 2, 3, 4\n*SURFACE, NAME=Zmin_3, TYPE=ELEMENT\n1, S2\n1, S4\n1, S3\n"));
}

// CalculiX reads 20 characters of a number: of the 21 of "8.708810636114117e-05" it took 8.7 for the coordinate.
TEST_F(SolverFilesTest, AbaqusHasNoNumberOfMoreThanTwentyCharacters) {
  Mesh mesh = Square();
  mesh.points = {-8.708810636114117e-05, 0, 1, 8.708810636114117e-05, -1.2345678901234567e-105, 1.5, 1, 1.5};
  std::vector<std::string> notes;
  ASSERT_TRUE(WriteMesh(folder_.Path("a.inp"), "", mesh.View(), {}, &notes).ok());
  EXPECT_THAT(folder_.Read("a.inp"), HasSubstr("*NODE\n1, -8.70881063611412e-5, 0\n2, 1, 8.708810636114117e-5\n"
                                               "3, -12345678901235e-118, 1.5\n4, 1, 1.5\n"));
  EXPECT_THAT(notes, Contains(HasSubstr("read 20 characters of a number: coordinates of 2 vertices are rounded")));
}

// Three vertices a unit in the last place apart, where the characters do not tell that: CalculiX would get a flat
// element.
TEST_F(SolverFilesTest, AbaqusRefusesElementsThatRoundingWouldTurnOver) {
  const double x = -8.708810636114117e-05;
  const double below = std::nextafter(x, -1);
  Mesh mesh{.dimension = 2, .points = {x, x, below, x, below, below}, .simplices = {0, 2, 1}};
  EXPECT_THAT(std::string(WriteMesh(folder_.Path("a.inp"), "", mesh.View()).message()),
              HasSubstr("a.inp: Abaqus and CalculiX read 20 characters of a number, and element 1 would lose its "
                        "orientation by them"));
  EXPECT_EQ(folder_.FileCount(), 0);
  // A flat one has none to lose.
  mesh.simplices = {0, 1, 1};
  EXPECT_TRUE(WriteMesh(folder_.Path("a.inp"), "", mesh.View()).ok());
}

TEST_F(SolverFilesTest, LabelsThatAreNotTheNamesAreToldOf) {
  for (const char* name : {"a.su2", "a.inp"}) {
    std::vector<std::string> notes;
    ASSERT_TRUE(WriteMesh(folder_.Path(name), "", Square().View(), {}, &notes).ok());
    EXPECT_THAT(notes, Contains(HasSubstr("1 name is another, \"far_field__east\" for \"far field, east\"")));
  }
}

// Without tags of vertices all simplices may have facets; sixteen numbers are a line.
TEST_F(SolverFilesTest, AbaqusOfAFanWithoutTagsOfVertices) {
  Mesh mesh{.dimension = 2, .points = {0, 0}, .simplices = {}};
  mesh.boundary = {{.tag = 1, .name = "rim", .facets = 20}};
  for (uint32_t i = 1; i <= 21; ++i) {
    mesh.points.insert(mesh.points.end(), {1.0 + i, 1.0 * i * i});
  }
  for (uint32_t i = 1; i <= 20; ++i) {
    mesh.simplices.insert(mesh.simplices.end(), {0, i, i + 1});
    mesh.facets.insert(mesh.facets.end(), {i + 1, i});
  }
  Write(mesh, "a.inp");
  EXPECT_THAT(folder_.Read("a.inp"),
              HasSubstr("*NSET, NSET=rim\n2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17\n18, 19, 20, 21, 22\n"
                        "*SURFACE, NAME=rim, TYPE=ELEMENT\n1, S2\n2, S2\n3, S2\n"));
}

// Names that become the same label, that start with a digit, and that are very long.
TEST_F(SolverFilesTest, LabelsDiffer) {
  Mesh mesh = Square();
  mesh.boundary = {{.tag = 1, .name = "a b", .facets = 1}, {.tag = 2, .name = "A,b", .facets = 1}};
  mesh.regions = {{2, "1" + std::string(99, 'x')}, {9, "1" + std::string(99, 'x')}};
  Write(mesh, "a.inp");
  const std::string text = folder_.Read("a.inp");
  EXPECT_THAT(text, HasSubstr("NSET=a_b\n"));
  EXPECT_THAT(text, HasSubstr("NSET=A_b_2\n"));
  EXPECT_THAT(text, HasSubstr("ELSET=_1" + std::string(78, 'x') + "\n"));
  EXPECT_THAT(text, HasSubstr("ELSET=_1" + std::string(76, 'x') + "_9\n"));
}

TEST_F(SolverFilesTest, VtkInBytes) {
  const Mesh mesh = Square();
  MeshView view = mesh.View();
  view.input_vertices = 2;
  ASSERT_TRUE(WriteMesh(folder_.Path("a.vtk"), "", view).ok());
  const std::string text = folder_.Read("a.vtk");
  using std::string_literals::operator""s;
  EXPECT_THAT(text, StartsWith("# vtk DataFile Version 3.0\n4 vertices, 2 triangles\nBINARY\n"
                               "DATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nwellspace_names 1 52 unsigned_char\n"
                               "part 3: ymin\npart 7: far field, east\nregion 2: land\n\nPOINTS 4 double\n"));
  EXPECT_THAT(text, HasSubstr("\x3f\xf0\0\0\0\0\0\0\x3f\xf8\0\0\0\0\0\0\0\0\0\0\0\0\0\0\nCELLS 4 14\n"s
                              "\0\0\0\3\0\0\0\0\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0\1\0\0\0\3\0\0\0\2"s
                              "\0\0\0\2\0\0\0\0\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0\1\nCELL_TYPES 4\n"s
                              "\0\0\0\5\0\0\0\5\0\0\0\3\0\0\0\3\nCELL_DATA 4\nFIELD FieldData 2\nregion 1 4 int\n"s
                              "\0\0\0\x9\0\0\0\2\0\0\0\0\0\0\0\0\nboundary 1 4 int\n"s
                              "\0\0\0\0\0\0\0\0\0\0\0\3\0\0\0\7\nPOINT_DATA 4\nFIELD FieldData 3\n"s
                              "input 1 4 unsigned_char\n\1\1\0\0\norigin 1 4 int\n"s
                              "\0\0\0\0\0\0\0\1\xff\xff\xff\xff\xff\xff\xff\xfd\nboundary 1 4 int\n"s
                              "\0\0\0\3\0\0\0\3\0\0\0\0\0\0\0\7\n"s));
}

TEST_F(SolverFilesTest, XdmfNamesWhatItIsMadeOf) {
  Mesh mesh = Square();
  mesh.boundary[0].name = "y<min & \"x\"";
  Write(mesh, "a.xdmf");
  EXPECT_EQ(folder_.FileCount(), 4);
  EXPECT_THAT(folder_.Read("a.xdmf"),
              HasSubstr("<DataItem Dimensions=\"2 3\" NumberType=\"Int\" Precision=\"8\" Format=\"HDF\">"
                        "a.h5:/simplices</DataItem>"));
  EXPECT_THAT(folder_.Read("a.xdmf"), HasSubstr("<map key=\"y&lt;min &amp; &quot;x&quot;\" dim=\"1\">3</map>"
                                                "<map key=\"far field, east\" dim=\"1\">7</map>"
                                                "<map key=\"land\" dim=\"2\">2</map></main>"));
  EXPECT_THAT(folder_.Read("a_boundary.xdmf"),
              HasSubstr("<DataItem Dimensions=\"2 2\" NumberType=\"Int\" Precision=\"8\" Format=\"HDF\">"
                        "a_boundary.h5:/facets</DataItem>"));
  EXPECT_THAT(FilesOfMeshWritten("x/a.xdmf", ""),
              ElementsAre("x/a.xdmf", "x/a.h5", "x/a_boundary.xdmf", "x/a_boundary.h5"));
}

// Of a file that is no HDF5: that has times.
TEST_F(SolverFilesTest, PiecesMakeTheSameFileAndMissingRowsNone) {
  const Mesh mesh = RandomMesh(3, 1000, 2000);
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    Write(mesh, kind.file, kind.format);
    const std::string whole = folder_.Read(kind.file);
    const int files = folder_.FileCount();
    for (const bool is_complete : {false, true}) {
      folder_.Write(kind.file, "old");
      const auto writer = CreateMesh(folder_.Path(kind.file), kind.format, mesh.View().Shape());
      ASSERT_TRUE(writer.ok()) << writer.status();
      ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).first(30)).ok());
      ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).subspan(30)).ok());
      ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).first(44)).ok());
      if (is_complete) {
        ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).subspan(44)).ok());
      }
      EXPECT_EQ((*writer)->Commit().code(), is_complete ? absl::StatusCode::kOk : absl::StatusCode::kInternal);
      EXPECT_EQ(folder_.Read(kind.file), is_complete ? whole : "old");
    }
    std::stop_source source;
    source.request_stop();
    EXPECT_EQ(WriteMesh(folder_.Path(kind.file), kind.format, mesh.View(), source.get_token()).code(),
              absl::StatusCode::kCancelled);
    EXPECT_EQ(folder_.Read(kind.file), whole);
    EXPECT_EQ(folder_.FileCount(), files);
  }
}

TEST_F(SolverFilesTest, RefusesWhatTheyCannotHold) {
  Mesh weighted = RandomMesh(3, 10, 10);
  weighted.weights.assign(10, 1);
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    const std::string path = folder_.Path(kind.file);
    EXPECT_THAT(std::string(WriteMesh(path, "", RandomMesh(4, 10, 10).View()).message()),
                HasSubstr("holds meshes up to 3-D, and this one is 4-D; expected npz"));
    const bool has_weights = kind.format == std::string("vtk") || kind.format == std::string("xdmf");
    EXPECT_EQ(WriteMesh(path, "", weighted.View()).ok(), has_weights);
    EXPECT_EQ(CheckMeshOutput(path, "", 3, /*may_have_weights=*/true).ok(), has_weights);
  }
  EXPECT_THAT(std::string(CheckMeshOutput("-", "xdmf").message()), HasSubstr("cannot go to standard output"));
  MeshView view = weighted.View();
  view.weights = {};
  const std::vector<uint32_t> origins(10, 0x8000'0000);
  const std::vector<int32_t> tags(10);
  view.vertex_origins = origins;
  view.vertex_tags = tags;
  EXPECT_THAT(std::string(WriteMesh(folder_.Path("a.vtk"), "", view).message()),
              HasSubstr("numbers input points up to 2147483647, and got 2147483648; expected vtu or npz"));
}

TEST_F(SolverFilesTest, PipesGetTheSameBytes) {
  const Mesh mesh = Tetrahedron();
  ASSERT_EQ(mkfifo(folder_.Path("pipe").c_str(), 0600), 0);
  for (const char* format : {"su2", "abaqus", "vtk"}) {
    SCOPED_TRACE(format);
    Write(mesh, "whole", format);
    std::string got;
    std::thread reader([&] { got = folder_.Read("pipe"); });
    Write(mesh, "pipe", format);
    reader.join();
    EXPECT_EQ(got, folder_.Read("whole"));
  }
}

}  // namespace
}  // namespace wellspace::formats
