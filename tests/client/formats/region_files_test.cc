// The regions of simplices in every format that is read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/mesh_files_fixture.h"
#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Kind {
  const char* format;
  const char* file;
  int max_dimension;
  bool is_grouped;  // simplices are written by their regions
};

constexpr Kind kKinds[] = {{"msh41", "mesh.msh", 3, true},   {"msh22", "old.msh", 3, false},
                           {"medit", "mesh.mesh", 3, false}, {"vtu", "mesh.vtu", 3, false},
                           {"vtk", "mesh.vtk", 3, false},    {"npz", "mesh.npz", 6, false},
                           {"node", "mesh.node", 6, false}};

// Random vertices in random regions, one of four without simplices.
Mesh MeshOfRegions(int dimension, bool has_boundary) {
  Mesh mesh = RandomMesh(dimension, 300, 700);
  mesh.regions = {{10, "domain"}, {20, "region 7"}, {25, "nowhere"}, {30, "a name of words"}};
  std::mt19937 random(13);
  for (uint64_t i = 0; i < mesh.View().simplex_count(); ++i) {
    mesh.simplex_regions.push_back(mesh.regions[std::array{0, 1, 3}[random() % 3]].id);
  }
  if (has_boundary) {
    mesh.boundary = {{.tag = 2, .name = "xmin", .facets = 9}, {.tag = 4, .name = "rest", .facets = 31}};
    while (mesh.facets.size() < CountFacets(mesh.boundary) * dimension) {
      mesh.facets.push_back(random() % 300);
    }
    mesh.vertex_origins.assign(300, kSteinerOrigin);
    mesh.vertex_tags.assign(300, 2);
  }
  return mesh;
}

// The simplices of each region one after the other, otherwise in their order.
void GroupByRegion(Mesh& mesh) {
  const size_t corners = mesh.dimension + 1;
  Mesh grouped = mesh;
  grouped.simplices.clear();
  for (const Region& region : mesh.regions) {
    for (size_t i = 0; i < mesh.simplex_regions.size(); ++i) {
      if (mesh.simplex_regions[i] == region.id) {
        grouped.simplices.insert(grouped.simplices.end(), mesh.simplices.begin() + i * corners,
                                 mesh.simplices.begin() + (i + 1) * corners);
      }
    }
  }
  std::sort(grouped.simplex_regions.begin(), grouped.simplex_regions.end());
  mesh = grouped;
}

// A square of two triangles, each a region of its own.
Mesh Square() {
  Mesh mesh{.dimension = 2, .points = {0, 0, 1, 0, 0, 1, 1, 1}, .simplices = {0, 1, 2, 1, 3, 2}};
  mesh.simplex_regions = {7, 1};
  mesh.regions = {{1, "land"}, {7, "deep sea"}};
  return mesh;
}

// Two tetrahedra with a facet in common, and one that hangs on to them.
Mesh Tetrahedra() {
  Mesh mesh{.dimension = 3,
            .points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 2, 2, 0},
            .simplices = {0, 1, 2, 3, 1, 2, 3, 4, 1, 4, 2, 5}};
  mesh.simplex_regions = {3, 2, 9};
  mesh.regions = {{2, ""}, {3, ""}, {9, ""}};
  return mesh;
}

class RegionFilesTest : public MeshFilesFixture {};

TEST_F(RegionFilesTest, RoundTripsKeepRegions) {
  for (const Kind& kind : kKinds) {
    for (int dimension = 2; dimension <= kind.max_dimension; ++dimension) {
      for (const bool has_boundary : {false, true}) {
        SCOPED_TRACE(std::string(kind.format) + " in " + std::to_string(dimension) + "-D");
        Mesh mesh = MeshOfRegions(dimension, has_boundary);
        Write(mesh, kind.file, kind.format);
        const Mesh read = ReadGood(kind.file);
        if (kind.is_grouped) {
          GroupByRegion(mesh);
        }
        EXPECT_EQ(Bits(read.points), Bits(mesh.points));
        EXPECT_EQ(read.simplices, mesh.simplices);
        EXPECT_EQ(read.simplex_regions, mesh.simplex_regions);
        EXPECT_EQ(read.facets, mesh.facets);
        EXPECT_EQ(read.regions, mesh.regions);  // also those without simplices
      }
    }
  }
}

TEST_F(RegionFilesTest, TetrahedraOfThreeRegions) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    Mesh mesh = Tetrahedra();
    Write(mesh, kind.file, kind.format);
    if (kind.is_grouped) {
      GroupByRegion(mesh);
    }
    const Mesh read = ReadGood(kind.file);
    EXPECT_EQ(read.simplices, mesh.simplices);
    EXPECT_EQ(read.simplex_regions, mesh.simplex_regions);
    EXPECT_EQ(read.regions, mesh.regions);
  }
}

// Other tests have the bytes of such files.
TEST_F(RegionFilesTest, OneRegionIsKeptAndSimplicesNeedNone) {
  for (const Kind& kind : kKinds) {
    for (const bool has_boundary : {false, true}) {
      for (const Region& region : {Region{1, "domain"}, Region{7, "deep sea"}, Region{-3, ""}}) {
        SCOPED_TRACE(std::string(kind.format) + " " + std::to_string(region.id));
        Mesh mesh = MeshOfRegions(2, has_boundary);
        mesh.simplex_regions.clear();
        mesh.regions = {region};
        Write(mesh, kind.file, kind.format);
        EXPECT_THAT(ReadGood(kind.file).simplex_regions, IsEmpty());
        EXPECT_THAT(ReadGood(kind.file).regions, ElementsAre(region));
      }
    }
  }
}

TEST_F(RegionFilesTest, TheSquareAsText) {
  Write(Square(), "a.mesh");
  EXPECT_THAT(folder_.Read("a.mesh"), HasSubstr("\nTriangles\n2\n1 2 3 7\n2 4 3 1\nEnd\n"));
  Write(Square(), "a.node");
  EXPECT_EQ(folder_.Read("a.ele"), "# region 1: land\n# region 7: deep sea\n2 3 1\n0 0 1 2 7\n1 1 3 2 1\n");
  Write(Square(), "a.msh", "msh22");
  EXPECT_THAT(folder_.Read("a.msh"), HasSubstr("$PhysicalNames\n2\n2 1 \"land\"\n2 7 \"deep sea\"\n$EndPhysicalNames"));
  EXPECT_THAT(folder_.Read("a.msh"), HasSubstr("$Elements\n2\n1 2 2 7 7 1 2 3\n2 2 2 1 1 2 4 3\n$EndElements"));
}

// Gmsh counts groups by their dimensions: a region with the number of a part of the boundary keeps its own.
TEST_F(RegionFilesTest, RegionWithTheNumberOfAPartKeepsItInMsh) {
  Mesh mesh = Square();
  mesh.facets = {0, 1, 2, 0};
  mesh.boundary = {{1, "south", 1}, {2, "west", 1}};
  for (const char* format : {"msh22", "msh41"}) {
    SCOPED_TRACE(format);
    Write(mesh, "a.msh", format);
    const Mesh read = ReadGood("a.msh");
    EXPECT_THAT(read.regions, ElementsAre(Region{1, "land"}, Region{7, "deep sea"}));
    EXPECT_THAT(folder_.Read("a.msh"), HasSubstr("$PhysicalNames\n4\n1 1 \"south\"\n1 2 \"west\"\n2 1 \"land\"\n"));
    EXPECT_EQ(read.boundary, mesh.boundary);
  }
}

// Adds everything in small pieces, but for the last `missing` regions.
absl::Status WriteInPieces(MeshWriter& writer, const Mesh& mesh, size_t missing) {
  constexpr size_t kRows = 7;
  absl::Status status;
  const auto in_pieces = [&status](auto rest, size_t row, auto add) {
    while (!rest.empty() && status.ok()) {
      const size_t taken = std::min(kRows * row, rest.size());
      status = add(rest.first(taken));
      rest = rest.subspan(taken);
    }
  };
  in_pieces(std::span(mesh.points), mesh.dimension, [&](auto piece) { return writer.AddPoints(piece); });
  in_pieces(std::span(mesh.vertex_origins), 1, [&](auto piece) { return writer.AddVertexOrigins(piece); });
  in_pieces(std::span(mesh.vertex_tags), 1, [&](auto piece) { return writer.AddVertexTags(piece); });
  in_pieces(std::span(mesh.simplex_regions).first(mesh.simplex_regions.size() - missing), 1,
            [&](auto piece) { return writer.AddSimplexRegions(piece); });
  in_pieces(std::span(mesh.simplices), mesh.dimension + 1, [&](auto piece) { return writer.AddSimplices(piece); });
  in_pieces(std::span(mesh.facets), mesh.dimension, [&](auto piece) { return writer.AddFacets(piece); });
  return status;
}

TEST_F(RegionFilesTest, PiecesMakeTheSameFileAndMissingRegionsNone) {
  const Mesh mesh = MeshOfRegions(3, true);
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    Write(mesh, kind.file, kind.format);
    const std::string whole = folder_.Read(kind.file);
    for (const size_t missing : {1, 0}) {
      folder_.Write(kind.file, "old");
      const auto writer = CreateMesh(folder_.Path(kind.file), kind.format, mesh.View().Shape());
      ASSERT_TRUE(writer.ok()) << writer.status();
      WriteInPieces(**writer, mesh, missing).IgnoreError();  // some notice it here
      EXPECT_EQ((*writer)->Commit().code(), missing == 0 ? absl::StatusCode::kOk : absl::StatusCode::kInternal);
      EXPECT_EQ(folder_.Read(kind.file), missing == 0 ? whole : "old");
    }
  }
}

// A pipe, in which no place can be sought, gets the same bytes.
TEST_F(RegionFilesTest, PipesGetTheSameBytes) {
  const Mesh mesh = MeshOfRegions(2, true);
  const std::string pipe = folder_.Path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const char* format : {"msh41", "msh22", "medit", "vtu", "vtk"}) {
    SCOPED_TRACE(format);
    Write(mesh, "whole", format);
    std::string got;
    std::thread reader([&] { got = folder_.Read("pipe"); });
    Write(mesh, "pipe", format);
    reader.join();
    EXPECT_EQ(got, folder_.Read("whole"));
  }
}

// Six million triangles in four regions, 24 MB of regions alone.
TEST_F(RegionFilesTest, ManySimplicesAreWrittenInBoundedMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers keep memory that was given back";
#endif
  constexpr uint64_t kPieces = 1500;
  constexpr uint64_t kRows = 1 << 12;
  MeshShape shape{.dimension = 2, .vertex_count = 3, .simplex_count = kPieces * kRows, .input_vertices = 3};
  shape.has_simplex_regions = true;
  shape.regions = {{1, ""}, {2, ""}, {3, ""}, {4, ""}};
  const auto peak_kib = [] {
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const std::vector<uint32_t> simplices(3 * kRows, 1);
  const long before = peak_kib();
  for (const char* name : {"mesh.vtkhdf", "mesh.vtu", "mesh.npz", "mesh.msh"}) {
    const auto writer = CreateMesh(folder_.Path(name), "", shape);
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE((*writer)->AddPoints(std::vector<double>{0, 0, 1, 0, 0, 1}).ok());
    for (uint64_t i = 0; i < kPieces; ++i) {
      ASSERT_TRUE((*writer)->AddSimplexRegions(std::vector<int32_t>(kRows, static_cast<int32_t>(i % 4 + 1))).ok());
    }
    for (uint64_t i = 0; i < kPieces; ++i) {
      ASSERT_TRUE((*writer)->AddSimplices(simplices).ok());
    }
    ASSERT_TRUE((*writer)->Commit().ok());
  }
  EXPECT_LT(peak_kib() - before, 20'000);
}

TEST_F(RegionFilesTest, UnknownRegionIsRefused) {
  Mesh mesh = Square();
  mesh.regions.pop_back();
  EXPECT_THAT(std::string(WriteMesh(folder_.Path("a.msh"), "", mesh.View()).message()), HasSubstr("region 7"));
  EXPECT_EQ(folder_.FileCount(), 0);
}

// Attributes are regions if all of them are whole numbers; otherwise they are something else, which is skipped.
TEST_F(RegionFilesTest, AttributesOfTriangle) {
  folder_.Write("a.node", "4 2 0 0\n0 0 0\n1 1 0\n2 0 1\n3 1 1\n");
  folder_.Write("a.ele", "# regions: x y, 5 sea\n2 3 1\n0 0 1 2 5\n1 1 3 2 -3.0\n");
  EXPECT_THAT(ReadGood("a.node").simplex_regions, ElementsAre(5, -3));
  EXPECT_THAT(ReadGood("a.node").regions, ElementsAre(Region{-3, ""}, Region{5, "sea"}));
  for (const char* other : {"0.5", "x", "1e10"}) {
    folder_.Write("a.ele", std::string("2 3 2\n0 0 1 2 5 0\n1 1 3 2 ") + other + " 0\n");
    EXPECT_THAT(ReadGood("a.node").simplex_regions, IsEmpty()) << other;
  }
}

// Gmsh's own files have entities of any numbers, and groups only where the user made some.
TEST_F(RegionFilesTest, MshOfGmshWithOneGroup) {
  folder_.Write("a.msh",
                "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 8 \"sea\"\n$EndPhysicalNames\n"
                "$Entities\n0 0 2 0\n31 0 0 0 1 1 0 0 0\n32 0 0 0 1 1 0 1 8 0\n$EndEntities\n"
                "$Nodes\n1 4 1 4\n2 31 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n$EndNodes\n"
                "$Elements\n2 2 1 2\n2 31 2 1\n1 1 2 3\n2 32 2 1\n2 2 4 3\n$EndElements\n");
  EXPECT_THAT(ReadGood("a.msh").simplex_regions, ElementsAre(0, 8));
  EXPECT_THAT(ReadGood("a.msh").regions, ElementsAre(Region{0, ""}, Region{8, "sea"}));
}

TEST_F(RegionFilesTest, Errors) {
  Write(Square(), "a.mesh");
  EXPECT_THAT(ReadBadWith("a.mesh", "1 2 3 7", "1 2 3 x"),
              HasSubstr("a.mesh:11: expected the reference of one of the triangles"));
  Write(Square(), "a.vtu");
  const std::string array = "<DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">";
  folder_.Write("a.vtu",
                "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"0\" "
                "NumberOfCells=\"0\"><CellData>" +
                    array +
                    "1 2</DataArray></CellData></Piece>"
                    "</UnstructuredGrid></VTKFile>");
  EXPECT_THAT(ReadBad("a.vtu"), HasSubstr("expected a region for each of 0 cells, got 2"));
}

TEST_F(RegionFilesTest, CutAnywhereIsNoTrouble) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    ExpectCutAnywhereIsNoTrouble(Square(), kind.file, kind.format);
  }
}

}  // namespace
}  // namespace wellspace::formats
