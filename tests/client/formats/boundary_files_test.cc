// The boundary of a mesh in every format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <span>
#include <string>
#include <vector>

#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/mesh_files_fixture.h"
#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Kind {
  const char* format;
  const char* file;
  int max_dimension;
};

constexpr Kind kKinds[] = {{"msh41", "mesh.msh", 3}, {"msh22", "old.msh", 3}, {"medit", "mesh.mesh", 3},
                           {"vtu", "mesh.vtu", 3},   {"vtk", "mesh.vtk", 3},  {"npz", "mesh.npz", 6},
                           {"node", "mesh.node", 6}};

// Random numbers for everything; three parts, one of them empty.
Mesh MeshWithBoundary(int dimension) {
  constexpr uint64_t kVertices = 300;
  Mesh mesh = RandomMesh(dimension, kVertices, 700);
  std::mt19937 random(11);
  mesh.boundary = {{.tag = 2, .name = "xmin", .facets = 7},
                   {.tag = 3, .name = "hole", .facets = 0},
                   {.tag = 40, .name = "rest", .facets = 120}};
  while (mesh.facets.size() < CountFacets(mesh.boundary) * dimension) {
    mesh.facets.push_back(random() % kVertices);
  }
  for (uint32_t v = 0; v < mesh.View().vertex_count(); ++v) {
    mesh.vertex_origins.push_back(v % 3 == 0 ? v : kCornerOrigin + v % 3);
    mesh.vertex_tags.push_back(v % 2 == 0 ? 0 : 40);
  }
  mesh.regions = {{.id = 9, .name = "water"}};
  return mesh;
}

// The unit square, as the mesher would have it.
Mesh Square() {
  return {.dimension = 2,
          .points = {0, 0, 1, 0, 0, 1, 1, 1},
          .simplices = {0, 1, 2, 1, 3, 2},
          .weights = {},
          .vertex_origins = {0, kCornerOrigin, kSteinerOrigin, kRepairOrigin},
          .vertex_tags = {1, 2, 1, 2},
          .facets = {2, 0, 1, 3, 0, 1, 3, 2},
          .boundary = {{1, "xmin", 1}, {2, "xmax", 1}, {3, "ymin", 1}, {4, "ymax", 1}},
          .regions = {{1, "domain"}}};
}

class BoundaryFilesTest : public MeshFilesFixture {};

TEST_F(BoundaryFilesTest, RoundTripsKeepFacetsAndTags) {
  for (const Kind& kind : kKinds) {
    for (int dimension = 2; dimension <= kind.max_dimension; ++dimension) {
      SCOPED_TRACE(std::string(kind.format) + " in " + std::to_string(dimension) + "-D");
      const Mesh mesh = MeshWithBoundary(dimension);
      Write(mesh, kind.file, kind.format);
      const Mesh read = ReadGood(kind.file);
      EXPECT_EQ(Bits(read.points), Bits(mesh.points));
      EXPECT_EQ(read.simplices, mesh.simplices);
      EXPECT_EQ(read.facets, mesh.facets);
      EXPECT_EQ(read.boundary, mesh.boundary);  // also parts without facets
    }
  }
}

// Formats without a place for ridges leave them out.
TEST_F(BoundaryFilesTest, RoundTripsKeepRidgesWhereThereIsAPlace) {
  Mesh mesh = MeshWithBoundary(3);
  mesh.ridges = {7, 8, 8, 299, 0, 7};
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    Write(mesh, kind.file, kind.format);
    const Mesh read = ReadGood(kind.file);
    const bool has_place = kind.format == std::string("npz") || kind.format == std::string("medit");
    EXPECT_EQ(read.ridges, has_place ? mesh.ridges : std::vector<uint32_t>());
    EXPECT_EQ(read.facets, mesh.facets);
    EXPECT_EQ(read.boundary, mesh.boundary);
    const auto writer = CreateMesh(folder_.Path(kind.file), kind.format, mesh.View().Shape());
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE((*writer)->AddPoints(mesh.points).ok());
    ASSERT_TRUE((*writer)->AddVertexOrigins(mesh.vertex_origins).ok());
    ASSERT_TRUE((*writer)->AddVertexTags(mesh.vertex_tags).ok());
    ASSERT_TRUE((*writer)->AddSimplices(mesh.simplices).ok());
    ASSERT_TRUE((*writer)->AddFacets(mesh.facets).ok());
    EXPECT_EQ((*writer)->Commit().code(), has_place ? absl::StatusCode::kInternal : absl::StatusCode::kOk)
        << "without the ridges that were announced";
  }
}

TEST_F(BoundaryFilesTest, RidgesOfMeditAreEdgesOfTheFile) {
  Mesh mesh = MeshWithBoundary(3);
  mesh.ridges = {7, 8, 8, 299, 0, 7};
  Write(mesh, "mesh.mesh");
  EXPECT_THAT(folder_.Read("mesh.mesh"), HasSubstr("Edges\n3\n8 9 0\n9 300 0\n1 8 0\nRidges\n3\n1\n2\n3\nEnd\n"));
  EXPECT_THAT(ReadBadWith("mesh.mesh", "Ridges\n3\n1\n2\n3\n", "Ridges\n2\n1\n4\n"),
              HasSubstr("Ridges: number 2 of them: expected an edge from 1 to 3, got 4"));
  Write(mesh, "mesh.mesh");
  EXPECT_THAT(ReadBadWith("mesh.mesh", "Ridges\n3\n1\n2\n3\n", "Ridges\n1\n0\n"), HasSubstr("got 0"));
  Write(mesh, "mesh.mesh");
  EXPECT_THAT(ReadBadWith("mesh.mesh", "Ridges\n3\n1\n2\n3\n", "Ridges\n4\n1\n2\n3\n"),
              HasSubstr("the number of an edge"));
}

// A mesh that is told nothing of gives the file that it always gave: other tests have these to the byte.
TEST_F(BoundaryFilesTest, NoBoundaryIsNoBoundary) {
  for (const Kind& kind : kKinds) {
    Mesh mesh = RandomMesh(2, 300, 700);
    Write(mesh, kind.file, kind.format);
    EXPECT_TRUE(ReadGood(kind.file).boundary.empty());
  }
  EXPECT_EQ(folder_.FileCount(), 8) << "of the pair two, and no more";
}

TEST_F(BoundaryFilesTest, PiecesMakeTheSameFileAndMissingFacetsNone) {
  const Mesh mesh = MeshWithBoundary(3);
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    Write(mesh, kind.file, kind.format);
    const std::string whole = folder_.Read(kind.file);
    for (const bool is_complete : {false, true}) {
      const auto writer = CreateMesh(folder_.Path(kind.file), kind.format, mesh.View().Shape());
      ASSERT_TRUE(writer.ok()) << writer.status();
      MeshWriter& rows = **writer;
      const auto in_pieces = [](const auto& values, size_t row, auto add) {
        std::span rest(values);
        for (size_t size = row; !rest.empty(); size += row) {
          const size_t taken = std::min(size, rest.size());
          ASSERT_TRUE(add(rest.first(taken)).ok());
          rest = rest.subspan(taken);
        }
      };
      in_pieces(mesh.points, 3, [&](auto piece) { return rows.AddPoints(piece); });
      in_pieces(mesh.vertex_origins, 1, [&](auto piece) { return rows.AddVertexOrigins(piece); });
      in_pieces(mesh.vertex_tags, 1, [&](auto piece) { return rows.AddVertexTags(piece); });
      in_pieces(mesh.simplices, 4, [&](auto piece) { return rows.AddSimplices(piece); });
      in_pieces(std::span(mesh.facets).first(mesh.facets.size() - (is_complete ? 0 : 3)), 3,
                [&](auto piece) { return rows.AddFacets(piece); });
      EXPECT_EQ(rows.Commit().code(), is_complete ? absl::StatusCode::kOk : absl::StatusCode::kInternal);
      EXPECT_EQ(folder_.Read(kind.file), whole);
    }
  }
}

TEST_F(BoundaryFilesTest, TheSquareAsText) {
  Write(Square(), "a.mesh");
  EXPECT_EQ(folder_.Read("a.mesh"),
            "MeshVersionFormatted 2\nDimension 2\nVertices\n4\n0 0 0\n1 0 0\n0 1 0\n1 1 0\nTriangles\n2\n1 2 3 1\n"
            "2 4 3 1\nEdges\n4\n3 1 1\n2 4 2\n1 2 3\n4 3 4\nEnd\n"
            "# part 1: xmin\n# part 2: xmax\n# part 3: ymin\n# part 4: ymax\n# region 1: domain\n");
  Write(Square(), "a.msh", "msh22");
  const std::string msh = folder_.Read("a.msh");
  EXPECT_EQ(
      msh.substr(0, msh.find("$NodeData")),
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n1 1 \"xmin\"\n1 2 \"xmax\"\n1 3 \"ymin\"\n"
      "1 4 \"ymax\"\n2 1 \"domain\"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n$EndNodes\n"
      "$Elements\n6\n1 2 2 1 1 1 2 3\n2 2 2 1 1 2 4 3\n3 1 2 1 1 3 1\n4 1 2 2 2 2 4\n5 1 2 3 3 1 2\n"
      "6 1 2 4 4 4 3\n$EndElements\n");
  Write(Square(), "a.node");
  EXPECT_EQ(folder_.Read("a.node"), "4 2 0 1\n0 0 0 1\n1 1 0 2\n2 0 1 1\n3 1 1 2\n");
  EXPECT_EQ(folder_.Read("a.ele"), "# region 1: domain\n2 3 1\n0 0 1 2 1\n1 1 3 2 1\n");
  const std::string names = "# part 1: xmin\n# part 2: xmax\n# part 3: ymin\n# part 4: ymax\n";
  EXPECT_EQ(folder_.Read("a.edge"), names + "4 1\n0 2 0 1\n1 1 3 2\n2 0 1 3\n3 3 2 4\n");
  EXPECT_EQ(folder_.Read("a.poly"), names + "0 2 0 1\n4 1\n0 2 0 1\n1 1 3 2\n2 0 1 3\n3 3 2 4\n0\n");
}

TEST_F(BoundaryFilesTest, FacetsOfATetrahedron) {
  Mesh mesh{.dimension = 3, .points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, .simplices = {0, 1, 2, 3}};
  mesh.vertex_tags = {5, 5, 5, 0};
  mesh.vertex_origins = {0, 1, 2, 3};
  mesh.facets = {0, 2, 1};
  mesh.boundary = {{5, "zmin", 1}};
  Write(mesh, "a.ele");
  EXPECT_EQ(folder_.Read("a.face"), "# part 5: zmin\n1 1\n0 0 2 1 5\n");
  EXPECT_EQ(folder_.Read("a.poly"), "# part 5: zmin\n0 3 0 1\n1 1\n1 0 5\n3 0 2 1\n0\n");
  EXPECT_EQ(folder_.Read("a.ele"), "1 4 0\n0 0 1 2 3\n") << "no region is known";
}

// A .edge that lies beside a .node without markers is not of this mesh.
TEST_F(BoundaryFilesTest, FacetsOfAnotherMeshAreLeftAlone) {
  Write(Square(), "a.node");
  EXPECT_EQ(ReadGood("a.node").boundary.size(), 4u);
  Mesh mesh = Square();
  mesh.boundary.clear();
  mesh.facets.clear();
  mesh.vertex_tags.clear();
  mesh.vertex_origins.clear();
  Write(mesh, "a.node");
  EXPECT_FALSE(folder_.Read("a.edge").empty());
  EXPECT_TRUE(ReadGood("a.node").boundary.empty());
}

TEST_F(BoundaryFilesTest, WhatNobodyHasTaggedIsNoBoundary) {
  folder_.Write("a.mesh",
                "MeshVersionFormatted 1\nDimension 2\nVertices 3\n0 0 0\n1 0 0\n0 1 0\nEdges 3\n1 2 0\n2 3 -7\n"
                "3 1 0\nTriangles 1\n1 2 3 0\nEnd\n");
  EXPECT_THAT(ReadGood("a.mesh").boundary, ElementsAre(BoundaryPart{-7, "", 1}));
  EXPECT_THAT(ReadGood("a.mesh").facets, ElementsAre(1, 2));
}

TEST_F(BoundaryFilesTest, Errors) {
  Write(Square(), "a.mesh");
  EXPECT_THAT(ReadBadWith("a.mesh", "3 1 1\n", "3 1 x\n"), HasSubstr("expected the reference of one of the edges"));
  Write(Square(), "a.mesh");
  EXPECT_THAT(ReadBadWith("a.mesh", "3 1 1\n", "5 1 1\n"), HasSubstr("a vertex from 1 on"));
  Write(Square(), "a.msh", "msh22");
  EXPECT_THAT(ReadBadWith("a.msh", "1 1 \"xmin\"", "1 1 xmin"), HasSubstr("its name in quotes"));
  Write(Square(), "a.msh", "msh22");
  EXPECT_THAT(ReadBadWith("a.msh", "3 1 2 1 1 3 1", "3 1 2 x 1 3 1"), HasSubstr("expected a tag, got"));
  Write(Square(), "a.vtu");
  EXPECT_THAT(ReadBadWith("a.vtu", "NumberOfCells=\"6\"", "NumberOfCells=\"5\""), HasSubstr("for each of 5 cells"));

  Write(Square(), "a.node");
  for (const auto& [content, message] :
       std::vector<std::pair<std::string, std::string>>{{"", "empty file"},
                                                        {"x\n", "number of facets"},
                                                        {"2 1\n0 2 0 1\n", "expected 2 facets"},
                                                        {"1 1\n0 4 0 1\n", "expected a node from 0 to below 4"},
                                                        {"1 1\n0 2 0 x\n", "expected a marker"},
                                                        {"1 1\n0 2 0 1\n1 2 0 1\n", "expected the end of the file"}}) {
    folder_.Write("a.edge", content);
    EXPECT_THAT(ReadBad("a.node"), HasSubstr(message)) << content;
  }
}

TEST_F(BoundaryFilesTest, CutAnywhereIsNoTrouble) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    ExpectCutAnywhereIsNoTrouble(Square(), kind.file, kind.format);
  }
}

}  // namespace
}  // namespace wellspace::formats
