// Gmsh's MSH and INRIA's MEDIT.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/random_mesh.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

struct Kind {
  const char* format;
  const char* file;
};
constexpr Kind kKinds[] = {{"msh41", "mesh.msh"}, {"msh22", "old.msh"}, {"medit", "mesh.mesh"}};

class ExchangeFilesTest : public testing::Test {
 protected:
  Mesh ReadGood(const std::string& name, std::string_view content) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write(name, content));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? *mesh : Mesh{};
  }

  // The message after the folder's name.
  std::string ReadBad(const std::string& name, std::string_view content) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write(name, content));
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
    return std::string(mesh.status().message()).substr(folder_.Path("").size());
  }

  TemporaryFolder folder_;
};

TEST_F(ExchangeFilesTest, RoundTripsKeepEveryBit) {
  for (const Kind& kind : kKinds) {
    for (const int dimension : {2, 3}) {
      for (const bool has_weights : {false, true}) {
        Mesh mesh = RandomMesh(dimension, 3000, 6000);
        if (has_weights) {
          mesh.weights.assign(mesh.points.begin(), mesh.points.begin() + 3000);
        }
        const std::string path = folder_.Path(kind.file);
        const absl::Status written = WriteMesh(path, kind.format, mesh.View());
        if (has_weights && std::string(kind.format) == "medit") {
          EXPECT_EQ(written.code(), absl::StatusCode::kInvalidArgument);
          EXPECT_THAT(std::string(written.message()), HasSubstr("medit has no place for the weights of a mesh"));
          EXPECT_EQ(CheckMeshOutput(path, kind.format, dimension, /*may_have_weights=*/true), written);
          continue;
        }
        ASSERT_TRUE(written.ok()) << written;
        const absl::StatusOr<Mesh> read = ReadMesh(path);
        ASSERT_TRUE(read.ok()) << read.status();
        EXPECT_EQ(read->dimension, dimension);
        EXPECT_EQ(Bits(read->points), Bits(mesh.points));
        EXPECT_EQ(read->simplices, mesh.simplices);
        EXPECT_EQ(Bits(read->weights), Bits(mesh.weights));
      }
    }
  }
}

TEST_F(ExchangeFilesTest, PiecesMakeTheSameFileAndMissingRowsNone) {
  const Mesh mesh = RandomMesh(3, 1000, 2000);
  for (const Kind& kind : kKinds) {
    const std::string path = folder_.Path(kind.file);
    ASSERT_TRUE(WriteMesh(path, kind.format, mesh.View()).ok());
    const std::string whole = folder_.Read(kind.file);
    for (const bool is_complete : {false, true}) {
      const auto writer = CreateMesh(path, kind.format, mesh.View().Shape());
      ASSERT_TRUE(writer.ok()) << writer.status();
      ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).first(30)).ok());
      ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).subspan(30)).ok());
      ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).first(44)).ok());
      if (is_complete) {
        ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).subspan(44)).ok());
      }
      EXPECT_EQ((*writer)->Commit().code(), is_complete ? absl::StatusCode::kOk : absl::StatusCode::kInternal);
      EXPECT_EQ(folder_.Read(kind.file), whole);
    }
    std::stop_source source;
    source.request_stop();
    EXPECT_EQ(WriteMesh(path, kind.format, mesh.View(), source.get_token()).code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(folder_.Read(kind.file), whole);
    const absl::Status high = WriteMesh(path, kind.format, RandomMesh(4, 10, 10).View());
    EXPECT_EQ(high.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(high.message()), HasSubstr("holds meshes up to 3-D, and this one is 4-D"));
  }
  EXPECT_EQ(folder_.FileCount(), 3);
}

TEST_F(ExchangeFilesTest, CutAnywhereIsRefused) {
  Mesh mesh = RandomMesh(2, 5, 3);
  for (const Kind& kind : kKinds) {
    ASSERT_TRUE(WriteMesh(folder_.Path(kind.file), kind.format, mesh.View()).ok());
    const std::string good = folder_.Read(kind.file);
    // Behind the simplices stand only marks, which are not read.
    const size_t last = kind.format == std::string("medit") ? good.find("\nEnd") : good.find("$EndElements");
    for (size_t size = 0; size < last - 1; ++size) {
      EXPECT_THAT(ReadBad(kind.file, good.substr(0, size)), HasSubstr(kind.file)) << size;
    }
  }
}

TEST_F(ExchangeFilesTest, MarksOfInputPoints) {
  const Mesh mesh{.dimension = 2, .points = {0, 0, 1, 0, 0, 1.5}, .simplices = {0, 1, 2}};
  MeshView view = mesh.View();
  view.input_vertices = 2;
  ASSERT_TRUE(WriteMesh(folder_.Path("a.mesh"), "", view).ok());
  EXPECT_EQ(folder_.Read("a.mesh"),
            "MeshVersionFormatted 2\nDimension 2\nVertices\n3\n0 0 1\n1 0 1\n0 1.5 0\nTriangles\n1\n1 2 3 1\nEnd\n");
  ASSERT_TRUE(WriteMesh(folder_.Path("a.msh"), "msh22", view).ok());
  EXPECT_EQ(folder_.Read("a.msh"),
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1.5 0\n$EndNodes\n"
            "$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n"
            "$NodeData\n1\n\"input\"\n1\n0\n4\n0\n1\n3\n0\n1 1\n2 1\n3 0\n$EndNodeData\n");
}

// Nodes in two blocks, one with parameters, in any order; elements of the boundary; sections that are none of ours.
constexpr char kMsh41[] =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n$EndPhysicalNames\n"
    "$Nodes\n2 4 7 30\n2 1 1 1\n30\n0 0 1.5 0.5 0.5\n3 1 0 3\n7\n9\n8\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n"
    "$Elements\n3 4 1 4\n0 1 15 1\n1 7\n2 1 2 2\n2 7 8 9\n3 7 9 30\n3 1 4 1\n4 7 9 8 30\n$EndElements\n"
    "$NodeData\n1\n\"weights\"\n1\n0\n3\n0\n1\n4\n9 2\n7 1\n30 4\n8 3\n$EndNodeData\n";

TEST_F(ExchangeFilesTest, MshAsGmshWritesIt) {
  const Mesh mesh = ReadGood("a.msh", kMsh41);
  EXPECT_EQ(mesh.dimension, 3);
  EXPECT_THAT(mesh.points, ElementsAre(0, 0, 1.5, 0, 0, 0, 1, 0, 0, 0, 1, 0));
  EXPECT_THAT(mesh.simplices, ElementsAre(1, 2, 3, 0));
  EXPECT_THAT(mesh.weights, ElementsAre(4, 1, 2, 3));
}

// Bytes of version 2.2: a node each of 4 + 24 bytes, blocks of elements of one type.
std::string BinaryMsh22() {
  const auto bytes = [](auto... values) {
    std::string text;
    (text.append(reinterpret_cast<const char*>(&values), sizeof(values)), ...);
    return text;
  };
  return "$MeshFormat\n2.2 1 8\n" + bytes(int32_t{1}) + "\n$EndMeshFormat\n$PhysicalNames\n1\n2 7 \"sea\"\n" +
         "$EndPhysicalNames\n$Nodes\n3\n" + bytes(int32_t{5}, 0.0, 0.0, 0.0) + bytes(int32_t{2}, 1.0, 0.0, 0.0) +
         bytes(int32_t{9}, 0.0, 1.5, 0.0) + "\n$EndNodes\n$Elements\n3\n" + bytes(int32_t{1}, int32_t{2}, int32_t{2}) +
         bytes(int32_t{1}, int32_t{4}, int32_t{1}, int32_t{5}, int32_t{2}) +
         bytes(int32_t{2}, int32_t{3}, int32_t{1}, int32_t{2}, int32_t{9}) + bytes(int32_t{2}, int32_t{1}, int32_t{2}) +
         bytes(int32_t{3}, int32_t{7}, int32_t{1}, int32_t{5}, int32_t{2}, int32_t{9}) + "\n$EndElements\n" +
         "$NodeData\n1\n\"weights\"\n1\n0\n3\n0\n1\n3\n" + bytes(int32_t{9}, 4.0) + bytes(int32_t{5}, 1.0) +
         bytes(int32_t{2}, 2.0) + "\n$EndNodeData\n";
}

TEST_F(ExchangeFilesTest, MshOfVersion22InBinary) {
  const Mesh mesh = ReadGood("a.msh", BinaryMsh22());
  EXPECT_EQ(mesh.dimension, 2);
  EXPECT_THAT(mesh.points, ElementsAre(0, 0, 1, 0, 0, 1.5));
  EXPECT_THAT(mesh.simplices, ElementsAre(0, 1, 2));
  EXPECT_THAT(mesh.regions, ElementsAre(Region{7, "sea"}));
  EXPECT_THAT(mesh.boundary, ElementsAre(BoundaryPart{3, "", 1}, BoundaryPart{4, "", 1}));
  EXPECT_THAT(mesh.weights, ElementsAre(1, 2, 4));
  const std::string good = BinaryMsh22();
  for (size_t size = 0; size + 1 < good.find("$EndElements"); ++size) {
    EXPECT_THAT(ReadBad("a.msh", good.substr(0, size)), HasSubstr("a.msh")) << size;
  }
  EXPECT_THAT(ReadBad("a.msh", Replaced(good, "$Nodes\n3", "$Nodes\nx")),
              HasSubstr("expected the number of nodes, a whole number of at most 4294967295, got \"x\""));
  EXPECT_THAT(ReadBad("a.msh", Replaced(good, "$Elements\n3", "$Elements\n1")),
              HasSubstr("expected the number of elements of a block, a whole number of at most 1, got 2"));
  const std::string data = "tests/data";
  const char* const folder = std::getenv("WELLSPACE_DATA_DIR");
  const absl::StatusOr<Mesh> of_gmsh = ReadMesh((folder == nullptr ? data : folder) + "/formats/gmsh22_binary.msh");
  ASSERT_TRUE(of_gmsh.ok()) << of_gmsh.status();
  EXPECT_EQ(of_gmsh->dimension, 2);
  EXPECT_EQ(of_gmsh->points.size(), 24);
  EXPECT_EQ(of_gmsh->simplices.size() / 3 + 12, 26);  // of 26 elements four are points, and eight lines
}

// Triangles alone, in a file that has a third coordinate for them.
TEST_F(ExchangeFilesTest, MeditOfDimension3WithTrianglesAlone) {
  const std::string text =
      "MeshVersionFormatted 2\nDimension 3\nVertices 4\n0 0 0 1\n1 0 0 1\n0 1 0 0\n1 1 0 0\n"
      "Edges 2\n1 2 7\n2 4 0\nTriangles\n2\n1 2 3 7\n2 4 3 5\nEnd\n";
  const Mesh mesh = ReadGood("a.mesh", text);
  EXPECT_EQ(mesh.dimension, 2);
  EXPECT_THAT(mesh.points, ElementsAre(0, 0, 1, 0, 0, 1, 1, 1));
  EXPECT_THAT(mesh.simplices, ElementsAre(0, 1, 2, 1, 3, 2));
  EXPECT_THAT(mesh.simplex_regions, ElementsAre(7, 5));
  EXPECT_THAT(mesh.boundary, ElementsAre(BoundaryPart{7, "", 1}));
  EXPECT_EQ(ReadBad("a.mesh", Replaced(text, "1 1 0 0", "1 1 0.5 0")),
            "a.mesh: vertex 4: expected z = 0 in a mesh of triangles without tetrahedra, got 0.5");
}

TEST_F(ExchangeFilesTest, MshErrors) {
  const auto message = [this](const std::string& from, const std::string& to) {
    return ReadBad("a.msh", Replaced(kMsh41, from, to));
  };
  EXPECT_EQ(ReadBad("a.msh", ""), "a.msh:1: expected \"$MeshFormat\" at the start of the file");
  EXPECT_THAT(message("4.1 0 8", "3.0 0 8"),
              HasSubstr("a.msh:2: expected version 2.2 or 4.1, in ascii (0 8) or binary (1 8), got \"3.0 0 8\""));
  EXPECT_THAT(message("4.1 0 8", "2.2 1 8"), HasSubstr("expected little-endian numbers, a 1 first"));
  EXPECT_THAT(ReadBad("a.msh", std::string("$MeshFormat\n4.1 1 8\n\0\0\0\1\n$EndMeshFormat\n", 38)),
              HasSubstr("expected little-endian numbers, a 1 first, got 16777216"));
  EXPECT_THAT(message("2 4 7 30", "2 4000000000 7 30"),
              HasSubstr("expected 4000000000 nodes, as the section says, got 4"));
  EXPECT_THAT(message("3 1 0 3\n7", "3 1 0 4000000000\n7"), HasSubstr("a.msh:"));
  EXPECT_THAT(message("7\n9\n8", "7\n9\n9"), HasSubstr("expected one node of every number, got two of 9"));
  EXPECT_THAT(message("1 0 0\n0 1", "1 nan 0\n0 1"), HasSubstr("y of a node: expected a finite number, got \"nan\""));
  EXPECT_THAT(message("3 1 4 1", "3 1 11 1"),
              HasSubstr("expected elements of type 15 (point), 1 (line), 2 (triangle) or 4"));
  EXPECT_THAT(message("4 7 9 8 30", "4 7 9 8 31"), HasSubstr("a.msh:29: expected the number of a node, got 31"));
  EXPECT_THAT(message("3 4 1 4", "3 5 1 4"), HasSubstr("expected 5 elements, as the section says, got 4"));
  EXPECT_THAT(message("$EndElements", "$EndElement"),
              HasSubstr("a.msh:30: expected \"$EndElements\", got \"$EndElement\""));
  EXPECT_THAT(message("30 4\n8 3", "30 4\n9 3"), HasSubstr("expected one weight of every node, got two of node 9"));
  EXPECT_THAT(message("\n1\n4\n9 2", "\n1\n3\n9 2"), HasSubstr("expected 4 weights, once, got 3"));
  EXPECT_THAT(message("$PhysicalNames", "PhysicalNames"), HasSubstr("a.msh:4: expected the start of a section"));
  EXPECT_THAT(ReadBad("a.msh",
                      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0.5\n"
                      "$EndNodes\n$Elements\n1\n1 2 2 0 1 1 2 3\n$EndElements\n"),
              HasSubstr("a.msh: node 3: expected z = 0 in a mesh of triangles, got 0.5"));
}

constexpr char kMedit[] =
    "MeshVersionFormatted 2 # by hand\nDimension\n3\nVertices 4\n0 0 0 1\n1 0 0 1\n0 1 0 0\n0 0 1.5 0\n"
    "Corners 1\n1\nTriangles\n1\n1 2 3 7\nTetrahedra\n1\n1 2 3 4 5\nEnd\n";

TEST_F(ExchangeFilesTest, MeditByHand) {
  const Mesh mesh = ReadGood("a.mesh", kMedit);
  EXPECT_EQ(mesh.dimension, 3);
  EXPECT_THAT(mesh.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.5));
  EXPECT_THAT(mesh.simplices, ElementsAre(0, 1, 2, 3));
}

TEST_F(ExchangeFilesTest, MeditErrors) {
  const auto message = [this](const std::string& from, const std::string& to) {
    return ReadBad("a.mesh", Replaced(kMedit, from, to));
  };
  EXPECT_EQ(ReadBad("a.mesh", ""), "a.mesh:1: expected \"MeshVersionFormatted\" at the start of the file");
  EXPECT_EQ(message("\n3\nVertices", "\n4\nVertices"),
            "a.mesh:3: expected the dimension, a whole number of at most 3, got \"4\"");
  EXPECT_EQ(message("Dimension\n3\n", ""), "a.mesh:2: expected \"Dimension\", and then \"Vertices\" once");
  EXPECT_EQ(message("Vertices 4", "Vertices 4000000000"),
            "a.mesh:9: x of a vertex: expected a number, got \"Corners\"");
  EXPECT_EQ(message("1.5", "inf"), "a.mesh:8: z of a vertex: expected a finite number, got \"inf\"");
  EXPECT_EQ(message("1 2 3 4 5", "1 2 3 5 5"),
            "a.mesh:16: expected a vertex from 1 on, a whole number of at most 4, got \"5\"");
  EXPECT_EQ(message("1 2 3 4 5", "0 2 3 4 5"), "a.mesh:16: expected a vertex from 1 on, got 0");
  EXPECT_THAT(message("Corners 1\n1", "Hexahedra 0"),
              HasSubstr("a.mesh:9: expected Triangles in 2-D or Tetrahedra in 3-D"));
  EXPECT_THAT(message("Tetrahedra", "Tetras"),
              HasSubstr("a.mesh: vertex 4: expected z = 0 in a mesh of triangles without tetrahedra, got 1.5"));
  EXPECT_THAT(message("Triangles\n1\n1 2 3 7\nTetrahedra", "Tetras"),
              HasSubstr("the file ends; expected Triangles or Tetrahedra"));
  EXPECT_THAT(message("Tetrahedra\n1\n", "Tetrahedra\n4000000000\n"),
              HasSubstr("a.mesh:17: expected a vertex from 1 on, a whole number of at most 4, got \"End\""));
}

}  // namespace
}  // namespace wellspace::formats
