// Files of meshes of second order. What other programs find in them is the business of second_order_test.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stop_token>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/formats/read_cloud.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/mesh_files_fixture.h"
#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

struct Kind {
  const char* format;
  const char* file;
};
constexpr Kind kKinds[] = {{"vtu", "m.vtu"},     {"vtkhdf", "m.vtkhdf"}, {"vtk", "m.vtk"},
                           {"xdmf", "m.xdmf"},   {"npz", "m.npz"},       {"msh41", "m.msh"},
                           {"msh22", "m.msh22"}, {"abaqus", "m.inp"},    {"node", "m.node"}};

// Two triangles, whose common edge is inside between vertices of the boundary: nodes 4 to 8 are the middles of 01, 02,
// 12, 13 and 23.
Mesh Square() {
  Mesh mesh{.dimension = 2, .points = {0, 0, 2, 0, 0, 4, 2, 4}, .simplices = {0, 1, 2, 1, 3, 2}};
  mesh.facets = {0, 1, 1, 3, 3, 2, 2, 0};
  mesh.boundary = {{.tag = 3, .name = "ymin", .facets = 1}, {.tag = 7, .name = "rest", .facets = 3}};
  mesh.vertex_tags = {3, 3, 7, 7};
  mesh.vertex_origins = {0, 1, kSteinerOrigin, kCornerOrigin};
  mesh.regions = {{1, "domain"}};
  return mesh;
}

// Nodes 4 to 9 are the middles of 01, 02, 03, 12, 13 and 23.
Mesh Tetrahedron() {
  Mesh mesh{.dimension = 3, .points = {0, 0, 0, 2, 0, 0, 0, 4, 0, 0, 0, 8}, .simplices = {0, 1, 2, 3}};
  mesh.facets = {0, 2, 1, 1, 2, 3};
  mesh.boundary = {{.tag = 5, .name = "zmin", .facets = 1}, {.tag = 6, .name = "slope", .facets = 1}};
  mesh.vertex_tags = {5, 5, 5, 6};
  mesh.vertex_origins = {0, 1, 2, 3};
  mesh.regions = {{1, "domain"}};
  return mesh;
}

class SecondOrderFilesTest : public MeshFilesFixture {
 protected:
  absl::Status WriteSecond(MeshView view, const std::string& name, const std::string& format = "",
                           std::stop_token stop = {}) {
    view.order = MeshOrder::kSecond;
    notes_.clear();
    return WriteMesh(folder_.Path(name), format, view, std::move(stop), &notes_);
  }

  std::vector<std::string> notes_;  // of the last file
};

TEST_F(SecondOrderFilesTest, Abaqus) {
  ASSERT_TRUE(WriteSecond(Square().View(), "a.inp").ok());
  EXPECT_EQ(folder_.Read("a.inp"),
            "*HEADING\n9 nodes, 2 triangles\n*NODE\n1, 0, 0\n2, 2, 0\n3, 0, 4\n4, 2, 4\n5, 1, 0\n6, 0, 2\n7, 1, 2\n"
            "8, 2, 2\n9, 1, 4\n*ELEMENT, TYPE=CPS6, ELSET=domain\n1, 1, 2, 3, 5, 7, 6\n2, 2, 4, 3, 8, 9, 7\n"
            "*NSET, NSET=ymin\n1, 2, 5\n*SURFACE, NAME=ymin, TYPE=ELEMENT\n1, S1\n"
            "*NSET, NSET=rest\n1, 2, 3, 4, 6, 8, 9\n*SURFACE, NAME=rest, TYPE=ELEMENT\n2, S1\n2, S2\n1, S3\n");
  ASSERT_TRUE(WriteSecond(Tetrahedron().View(), "b.inp").ok());
  EXPECT_THAT(folder_.Read("b.inp"),
              HasSubstr("5, 1, 0, 0\n6, 0, 2, 0\n7, 0, 0, 4\n8, 1, 2, 0\n9, 1, 0, 4\n10, 0, 2, 4\n"
                        "*ELEMENT, TYPE=C3D10, ELSET=domain\n1, 1, 2, 3, 4, 5, 8, 6, 7, 9, 10\n"
                        "*NSET, NSET=zmin\n1, 2, 3, 5, 6, 8\n*SURFACE, NAME=zmin, TYPE=ELEMENT\n1, S1\n"
                        "*NSET, NSET=slope\n2, 3, 4, 8, 9, 10\n*SURFACE, NAME=slope, TYPE=ELEMENT\n1, S3\n"));
}

// Gmsh has the middles of 23 and 13 last, in this order.
TEST_F(SecondOrderFilesTest, Gmsh) {
  ASSERT_TRUE(WriteSecond(Square().View(), "a.msh", "msh22").ok());
  EXPECT_THAT(folder_.Read("a.msh"),
              HasSubstr("$Elements\n6\n1 9 2 1 1 1 2 3 5 7 6\n2 9 2 1 1 2 4 3 8 9 7\n3 8 2 3 3 1 2 5\n"
                        "4 8 2 7 7 2 4 8\n5 8 2 7 7 4 3 9\n6 8 2 7 7 3 1 6\n$EndElements\n"));
  ASSERT_TRUE(WriteSecond(Tetrahedron().View(), "b.msh", "msh22").ok());
  EXPECT_THAT(folder_.Read("b.msh"), HasSubstr("$Elements\n3\n1 11 2 1 1 1 2 3 4 5 8 6 7 10 9\n"
                                               "2 9 2 5 5 1 3 2 6 8 5\n3 9 2 6 6 2 3 4 8 10 9\n$EndElements\n"));
  EXPECT_THAT(folder_.Read("b.msh"), HasSubstr("$NodeData\n1\n\"input\"\n1\n0\n4\n0\n1\n10\n0\n"));
}

// As TetGen 1.5 writes it with -o2, and Triangle: the first middle is opposite of the first corner.
TEST_F(SecondOrderFilesTest, TetGenAndTriangle) {
  ASSERT_TRUE(WriteSecond(Tetrahedron().View(), "a.node").ok());
  EXPECT_THAT(folder_.Read("a.ele"), HasSubstr("\n1 10 1\n0 0 1 2 3 9 6 4 7 8 5 1\n"));
  EXPECT_THAT(folder_.Read("a.face"), HasSubstr("\n2 1\n0 0 2 1 7 4 5 5\n1 1 2 3 9 8 7 6\n"));
  EXPECT_THAT(folder_.Read("a.node"), HasSubstr("\n3 0 0 8 6\n4 1 0 0 5\n5 0 2 0 5\n6 0 0 4 0\n7 1 2 0 5\n"
                                                "8 1 0 4 6\n9 0 2 4 6\n"));
  EXPECT_EQ(folder_.FileCount(), 3);  // no .poly: its points would be the middles of its facets, too
  ASSERT_TRUE(WriteSecond(Square().View(), "b.node").ok());
  EXPECT_THAT(folder_.Read("b.ele"), HasSubstr("\n2 6 1\n0 0 1 2 6 5 4 1\n1 1 3 2 8 6 7 1\n"));
  EXPECT_THAT(folder_.Read("b.edge"), HasSubstr("\n4 1\n0 0 1 3\n1 1 3 7\n2 3 2 7\n3 2 0 7\n"));
  EXPECT_THAT(folder_.Read("b.node"), HasSubstr("\n4 1 0 3\n5 0 2 7\n6 1 2 0\n7 2 2 7\n8 1 4 7\n"));
  EXPECT_EQ(folder_.FileCount(), 6);
}

// Real numbers have the mean of the ends, NaN where an end has none; sums of huge ones do not overflow.
TEST_F(SecondOrderFilesTest, DataOfVertices) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kMax = std::numeric_limits<double>::max();
  const Mesh mesh{.dimension = 2, .points = {kMax, 0, kMax, 0.5, 0, 1}, .simplices = {0, 1, 2}, .weights = {1, 2, 4}};
  const std::vector<Attribute> attributes = {{"depth", {1, 3, kNan}}, {"id", {0, 1, 2}}};
  MeshView view = mesh.View();
  view.attributes = attributes;
  view.input_vertices = 2;
  ASSERT_TRUE(WriteSecond(view, "a.vtk").ok());
  const absl::StatusOr<PointCloud> points = ReadCloud(folder_.Path("a.vtk"), {.keep_attributes = true});
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(Bits(points->points), Bits({kMax, 0, kMax, 0.5, 0, 1, kMax, 0.25, kMax / 2, 0.5, kMax / 2, 0.75}));
  std::vector<std::string> names;
  for (const Attribute& attribute : points->attributes) {
    names.push_back(attribute.name);
    if (attribute.name == "depth") {
      EXPECT_EQ(std::vector<double>(attribute.values.begin(), attribute.values.begin() + 2),
                (std::vector<double>{1, 3}));
      EXPECT_EQ(attribute.values[3], 2);
      EXPECT_TRUE(std::isnan(attribute.values[2]) && std::isnan(attribute.values[4]) &&
                  std::isnan(attribute.values[5]));
    } else if (attribute.name == "weights") {
      EXPECT_EQ(attribute.values, (std::vector<double>{1, 2, 4, 1.5, 2.5, 3}));
    } else if (attribute.name == "input") {
      EXPECT_EQ(attribute.values, (std::vector<double>{1, 1, 0, 0, 0, 0}));
    }
  }
  for (const char* name : {"depth", "id", "weights", "input"}) {
    EXPECT_THAT(names, Contains(name));
  }
}

// Origins and tags as .vtk has them: the edge between the vertices 1 and 2, both at the boundary, is inside.
TEST_F(SecondOrderFilesTest, OriginsAndTagsOfMiddles) {
  ASSERT_TRUE(WriteSecond(Square().View(), "a.vtk").ok());
  const absl::StatusOr<PointCloud> points = ReadCloud(folder_.Path("a.vtk"), {.keep_attributes = true});
  ASSERT_TRUE(points.ok()) << points.status();
  bool has_both = false;
  for (const Attribute& attribute : points->attributes) {
    if (attribute.name == "origin") {
      EXPECT_EQ(attribute.values, (std::vector<double>{0, 1, -1, -3, -4, -4, -4, -4, -4}));
    } else if (attribute.name == "boundary") {
      EXPECT_EQ(attribute.values, (std::vector<double>{3, 3, 7, 7, 3, 7, 0, 7, 7}));
      has_both = true;
    }
  }
  EXPECT_TRUE(has_both);
}

TEST_F(SecondOrderFilesTest, PiecesMakeTheSameFileAndMissingRowsNone) {
  for (const int dimension : {2, 3}) {
    const Mesh mesh = RandomMesh(dimension, 1000, 20000);
    const size_t row = dimension + 1;
    for (const Kind& kind : kKinds) {
      if (kind.format == std::string("abaqus")) {
        continue;  // rounding turns over simplices of random numbers
      }
      SCOPED_TRACE(kind.format);
      ASSERT_TRUE(WriteSecond(mesh.View(), kind.file, kind.format).ok());
      const std::string whole = folder_.Read(kind.file);
      const int files = folder_.FileCount();
      for (const bool is_complete : {false, true}) {
        folder_.Write(kind.file, "old");
        MeshShape shape = mesh.View().Shape();
        shape.order = MeshOrder::kSecond;
        const auto writer = CreateMesh(folder_.Path(kind.file), kind.format, shape);
        ASSERT_TRUE(writer.ok()) << writer.status();
        ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).first(30 * dimension)).ok());
        ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).subspan(30 * dimension)).ok());
        ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).first(44 * row)).ok());
        if (is_complete) {
          ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).subspan(44 * row)).ok());
        }
        EXPECT_EQ((*writer)->Commit().code(), is_complete ? absl::StatusCode::kOk : absl::StatusCode::kInternal);
        EXPECT_EQ(folder_.Read(kind.file), is_complete ? whole : "old");
      }
      std::stop_source source;
      source.request_stop();
      EXPECT_EQ(WriteSecond(mesh.View(), kind.file, kind.format, source.get_token()).code(),
                absl::StatusCode::kCancelled);
      EXPECT_EQ(folder_.FileCount(), files);
    }
  }
}

TEST_F(SecondOrderFilesTest, AWriterStopsBeforeItsEnd) {
  const Mesh mesh = RandomMesh(3, 100, 200);
  MeshShape shape = mesh.View().Shape();
  shape.order = MeshOrder::kSecond;
  std::stop_source source;
  const auto writer = CreateMesh(folder_.Path("a.vtu"), "", shape, source.get_token());
  ASSERT_TRUE(writer.ok()) << writer.status();
  ASSERT_TRUE((*writer)->AddPoints(mesh.points).ok());
  source.request_stop();
  EXPECT_EQ((*writer)->AddSimplices(mesh.simplices).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(folder_.FileCount(), 0);
}

// What a format has no place for is left out and told, as of first order.
TEST_F(SecondOrderFilesTest, WhatHasNoPlaceIsTold) {
  Mesh mesh = Tetrahedron();
  mesh.ridges = {1, 2};
  const std::vector<Attribute> attributes = {{"heat", {1, 2, 3, 4}}};
  MeshView view = mesh.View();
  view.attributes = attributes;
  ASSERT_TRUE(WriteSecond(view, "a.msh").ok());
  EXPECT_THAT(notes_, Contains(HasSubstr("no place for attributes of vertices, which are left out: heat")));
  view.order = MeshOrder::kSecond;
  const auto writer = CreateMesh(folder_.Path("b.msh"), "", view.Shape());
  ASSERT_TRUE(writer.ok()) << writer.status();
  ASSERT_TRUE((*writer)->AddPoints(mesh.points).ok());
  ASSERT_TRUE((*writer)->AddVertexOrigins(mesh.vertex_origins).ok());
  ASSERT_TRUE((*writer)->AddVertexTags(mesh.vertex_tags).ok());
  ASSERT_TRUE((*writer)->AddAttribute(0, attributes[0].values).ok());
  ASSERT_TRUE((*writer)->AddSimplices(mesh.simplices).ok());
  ASSERT_TRUE((*writer)->AddFacets(mesh.facets).ok());
  ASSERT_TRUE((*writer)->AddRidges(mesh.ridges).ok());
  ASSERT_TRUE((*writer)->Commit().ok());
  EXPECT_EQ(folder_.Read("b.msh"), folder_.Read("a.msh"));
  EXPECT_EQ((*writer)->notes(), notes_);
}

TEST_F(SecondOrderFilesTest, RefusesWhatHasNone) {
  for (const char* name : {"a.su2", "a.mesh", "a.14", "a.2dm"}) {
    SCOPED_TRACE(name);
    const std::string message(WriteSecond(RandomMesh(2, 10, 10).View(), name).message());
    EXPECT_THAT(message, HasSubstr("has no elements of second order that its readers take; expected one of vtu, "
                                   "vtkhdf, npz, msh41, msh22, node, vtk, xdmf, abaqus, or order 1"));
    EXPECT_EQ(std::string(CheckMeshOutput(folder_.Path(name), "", 0, false, MeshOrder::kSecond).message()), message);
    EXPECT_TRUE(CheckMeshOutput(folder_.Path(name), "").ok());
  }
  EXPECT_THAT(
      std::string(WriteSecond(RandomMesh(4, 10, 10).View(), "a.npz").message()),
      HasSubstr("elements of second order are triangles and tetrahedra, and this mesh is 4-D; expected order 1"));
  const PartNumbers part;
  const Mesh square = Square();
  MeshView view = square.View();
  view.part = &part;
  EXPECT_THAT(std::string(WriteSecond(view, "a.vtu").message()), HasSubstr("parts of a mesh have elements of first"));
  EXPECT_EQ(folder_.FileCount(), 0);
}

// Readers are of first order, and say so.
TEST_F(SecondOrderFilesTest, AreNotReadBack) {
  for (const auto& [name, format, message] :
       {std::tuple("a.vtu", "", "expected only triangles (5) or only tetrahedra (10), got type 24"),
        {"a.vtk", "", "expected only triangles (5) or only tetrahedra (10), got type 24"},
        {"a.npz", "", "expected 4 columns for simplices of points with 3 coordinates, got 10"},
        {"a.ele", "", "expected 4 nodes for each of the tetrahedra, got 10"}}) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(WriteSecond(Tetrahedron().View(), name, format).ok());
    EXPECT_THAT(ReadBad(name), HasSubstr(message));
  }
}

}  // namespace
}  // namespace wellspace::formats
