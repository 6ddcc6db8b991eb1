// ADCIRC's fort.14 and SMS's .2dm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "client/formats/hydro/facet_chains.h"
#include "client/formats/mesh_or_cloud.h"
#include "client/formats/read_cloud.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/mesh_files_fixture.h"
#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class HydroFilesTest : public MeshFilesFixture {
 protected:
  MeshOrCloud ReadEither(const std::string& name) {
    const absl::StatusOr<MeshOrCloud> read = ReadMeshOrCloud(folder_.Path(name), {.keep_attributes = true});
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *read : MeshOrCloud{};
  }
  std::string Bad(const std::string& name, const std::string& text) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write(name, text));
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
    return std::string(mesh.status().message()).substr(folder_.Path("").size());
  }
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
};

// A square with a square hole, as SMS and OceanMesh2D write it: remarks behind the numbers, the island not closed.
constexpr char kGrid[] =
    "# a bay, 2026\n  8   8 ! NE NP\n"
    "1 0.0 0.0 5.0\n2 9.0 0 5.5\n3 9.0 9.0 1.0D+01\n4 0 9 -1\n5 3 3 2\n6 6 3 2\n7 6 6 2\n8 3 6 2\n"
    "1 3 1 2 6\n2 3 1 6 5\n3 3 2 3 7\n4 3 2 7 6\n5 3 3 4 8\n6 3 3 8 7\n7 3 4 1 5\n8 3 4 5 8\n"
    "1 = Number of open boundaries\n2 = Total number of open boundary nodes\n"
    "2 = Number of nodes for open boundary 1\n4\n1\n"
    "2 = Number of land boundaries\n8 = Total number of land boundary nodes\n"
    "4 0 = Number of nodes for land boundary 1\n1\n2\n3\n4\n"
    "4 21 = Number of nodes for land boundary 2\n5\n8\n7\n6\n";

TEST_F(HydroFilesTest, AdcircAsItsProgramsWriteIt) {
  folder_.Write("fort.14", kGrid);
  const MeshOrCloud read = ReadEither("fort.14");
  ASSERT_TRUE(read.is_mesh);
  EXPECT_EQ(read.format, "adcirc");
  EXPECT_EQ(read.mesh.dimension, 2);
  EXPECT_EQ(read.mesh.points.size(), 16);
  EXPECT_THAT(std::vector<uint32_t>(read.mesh.simplices.begin(), read.mesh.simplices.begin() + 6),
              ElementsAre(0, 1, 5, 0, 5, 4));
  EXPECT_THAT(read.mesh.boundary,
              ElementsAre(BoundaryPart{1, "open", 1}, BoundaryPart{2, "land 0", 3}, BoundaryPart{3, "island 21", 4}));
  EXPECT_THAT(read.mesh.facets, ElementsAre(3, 0, 0, 1, 1, 2, 2, 3, 4, 7, 7, 6, 6, 5, 5, 4));
  ASSERT_EQ(read.attributes.size(), 1);
  EXPECT_EQ(read.attributes[0], (Attribute{"depth", {5, 5.5, 10, -1, 2, 2, 2, 2}}));
  EXPECT_THAT(read.notes, IsEmpty());

  // There and back: tags, names, depths and the types of boundaries.
  std::vector<std::string> notes;
  ASSERT_TRUE(WriteMesh(folder_.Path("b.grd"), "", read.View(), {}, &notes).ok());
  EXPECT_THAT(notes, IsEmpty());
  EXPECT_EQ(folder_.Read("b.grd"),
            "wellspace\n8 8\n1 0 0 5\n2 9 0 5.5\n3 9 9 10\n4 0 9 -1\n5 3 3 2\n6 6 3 2\n7 6 6 2\n8 3 6 2\n"
            "1 3 1 2 6\n2 3 1 6 5\n3 3 2 3 7\n4 3 2 7 6\n5 3 3 4 8\n6 3 3 8 7\n7 3 4 1 5\n8 3 4 5 8\n"
            "1 = Number of open boundaries\n2 = Total number of open boundary nodes\n2 0 = part 1: open\n4\n1\n"
            "2 = Number of land boundaries\n9 = Total number of land boundary nodes\n"
            "4 0 = part 2: land 0\n1\n2\n3\n4\n5 21 = part 3: island 21\n5\n8\n7\n6\n5\n");
  const MeshOrCloud again = ReadEither("b.grd");
  EXPECT_EQ(again.mesh.points, read.mesh.points);
  EXPECT_EQ(again.mesh.simplices, read.mesh.simplices);
  EXPECT_EQ(again.mesh.boundary, read.mesh.boundary);
  EXPECT_EQ(again.mesh.facets, read.mesh.facets);
  EXPECT_EQ(again.attributes, read.attributes);

  // Without boundaries, and with barriers, of which the front is read.
  const std::string grid = kGrid;
  folder_.Write("a.gr3", grid.substr(0, grid.find("1 = Number")));
  EXPECT_THAT(ReadEither("a.gr3").mesh.boundary, IsEmpty());
  folder_.Write("a.14", Replaced(Replaced(grid, "4 21 =", "4 24 ="), "\n5\n8\n7\n6\n",
                                 "\n5 1 2.5 1 1\n8 4 2.5 1 1\n7 3 2.5 1 1\n6 2 2.5 1 1\n"));
  EXPECT_THAT(ReadEither("a.14").mesh.boundary[2], (BoundaryPart{3, "type 24", 3}));
  EXPECT_THAT(ReadEither("a.14").notes, ElementsAre(HasSubstr("of 1 barrier only the front is read")));
}

TEST_F(HydroFilesTest, AdcircErrors) {
  const auto bad = [this](const std::string& from, const std::string& to) {
    return Bad("a.14", Replaced(kGrid, from, to));
  };
  EXPECT_EQ(Bad("a.14", ""), "a.14:1: expected a title, got an empty file");
  EXPECT_THAT(bad("  8   8", "8"), HasSubstr("a.14:2: expected the number of nodes, a whole number of at most "));
  EXPECT_THAT(bad("8   8", "8 4000000000"), HasSubstr("a.14:11: expected node 9, as they follow each other, got 1"));
  EXPECT_THAT(bad("3 9.0 9.0", "4 9.0 9.0"), EndsWith("a.14:5: expected node 3, as they follow each other, got 4"));
  EXPECT_THAT(bad("2 9.0 0", "2 nan 0"), HasSubstr("a.14:4: x of a node: expected a finite number, got \"nan\""));
  EXPECT_THAT(bad("2 9.0 0 5.5", "2 9.0 0"), HasSubstr("a.14:4: depth of a node: expected a "));
  EXPECT_THAT(bad("1 3 1 2 6", "1 4 1 2 6 5"),
              EndsWith("a.14:11: expected triangles, of 3 nodes, got an element of 4"));
  EXPECT_THAT(bad("1 3 1 2 6", "1 3 1 2 9"),
              HasSubstr("a.14:11: expected a node from 1 on, a whole number of at most 8"));
  EXPECT_THAT(bad("1 3 1 2 6", "1 3 1 2 0"), EndsWith("a.14:11: expected a node from 1 on, got 0"));
  EXPECT_THAT(bad("4 21 =", "4 = 21"), HasSubstr("expected the type of a boundary, a whole number, got \"=\""));
  EXPECT_THAT(bad("\n6\n", "\n"), HasSubstr("the file ends; expected a node of a boundary"));
  const std::string grid = kGrid;
  for (size_t size = 0; size < grid.size(); ++size) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write("a.14", grid.substr(0, size)));
    EXPECT_TRUE(mesh.ok() || absl::IsInvalidArgument(mesh.status())) << size << mesh.status();
  }
}

TEST_F(HydroFilesTest, AdcircAsPoints) {
  const std::string quads = Replaced(kGrid, "1 3 1 2 6", "1 4 1 2 6 5");
  const absl::StatusOr<PointCloud> cloud = ReadCloud(folder_.Write("a.14", quads), {.keep_attributes = true});
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->dimension, 2);
  EXPECT_EQ(cloud->size(), 8);
  EXPECT_EQ(cloud->attributes[0].name, "depth");
  const absl::StatusOr<PointCloud> deep = ReadCloud(folder_.Path("a.14"), {.columns = {"x", "y", "depth"}});
  ASSERT_TRUE(deep.ok()) << deep.status();
  EXPECT_EQ(deep->dimension, 3);
  const absl::StatusOr<PointCloud> skipped =
      ReadCloud(folder_.Write("a.14", Replaced(quads, "2 9.0 0", "2 nan 0")), {.skip_invalid = true});
  ASSERT_TRUE(skipped.ok()) << skipped.status();
  EXPECT_EQ(skipped->size(), 7);
}

// As SMS writes it: nodes of any numbers, strings on several cards, materials.
constexpr char k2dm[] =
    "MESH2D\nMESHNAME \"bay\"\nNUM_MATERIALS_PER_ELEM 1\nE3T 1 10 20 30 7\nE3T 2 10 30 40 5\n"
    "ND 10 0.0 0.0 1.5\nND 20 1.0 0 -2e0\nND 30 1 1 0\nND 40 0 1 0\nNS 10 20\nNS -30\nNS 30 40 -10 12\n"
    "BEGPARAMDEF\nGM \"x\"\n";

TEST_F(HydroFilesTest, MeshOf2dm) {
  folder_.Write("a.2dm", k2dm);
  const MeshOrCloud read = ReadEither("a.2dm");
  ASSERT_TRUE(read.is_mesh);
  EXPECT_THAT(read.mesh.points, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
  EXPECT_THAT(read.mesh.simplices, ElementsAre(0, 1, 2, 0, 2, 3));
  EXPECT_THAT(read.mesh.simplex_regions, ElementsAre(7, 5));
  EXPECT_THAT(read.mesh.boundary, ElementsAre(BoundaryPart{1, "", 2}, BoundaryPart{12, "", 2}));
  EXPECT_THAT(read.mesh.facets, ElementsAre(0, 1, 1, 2, 2, 3, 3, 0));
  EXPECT_EQ(read.attributes[0], (Attribute{"elevation", {1.5, -2, 0, 0}}));
  std::vector<std::string> notes;
  ASSERT_TRUE(WriteMesh(folder_.Path("b.2dm"), "", read.View(), {}, &notes).ok());
  EXPECT_THAT(notes, IsEmpty());
  EXPECT_EQ(folder_.Read("b.2dm"),
            "MESH2D\nND 1 0 0 1.5\nND 2 1 0 -2\nND 3 1 1 0\nND 4 0 1 0\nE3T 1 1 2 3 7\nE3T 2 1 3 4 5\n"
            "NS 1 2 -3 1\nNS 3 4 -1 12\n");
  // Elevations in one format are depths in the other: the sign changes.
  ASSERT_TRUE(WriteMesh(folder_.Path("b.14"), "", read.View(), {}, &notes).ok());
  EXPECT_THAT(notes, ElementsAre(HasSubstr("no place for regions")));
  EXPECT_THAT(folder_.Read("b.14"), HasSubstr("\n1 0 0 -1.5\n2 1 0 2\n3 1 1 0\n"));
}

TEST_F(HydroFilesTest, ErrorsOf2dm) {
  const auto bad = [this](const std::string& from, const std::string& to) {
    return Bad("a.2dm", Replaced(k2dm, from, to));
  };
  EXPECT_EQ(Bad("a.2dm", ""), "a.2dm:1: expected \"MESH2D\" at the start of the file");
  EXPECT_THAT(bad("E3T 2", "E4Q 2"), EndsWith("a.2dm:5: expected E3T and no other elements, got \"E4Q\""));
  EXPECT_THAT(bad("10 30 40 5", "10 30 41 5"), EndsWith("a.2dm:5: expected the number of a node, got 41"));
  EXPECT_THAT(bad("10 30 40 5", "10 30 40 five"),
              EndsWith("a.2dm:5: expected the material of an element, a whole number, got \"five\""));
  EXPECT_THAT(bad("ND 20 1.0", "ND 20 inf"), HasSubstr("a.2dm:7: x of a node: expected a finite number, got \"inf\""));
  EXPECT_THAT(bad("ND 20", "ND 10"), EndsWith("a.2dm: expected one node of every number, got two of 10"));
  EXPECT_THAT(bad("NS 10 20", "NS 10 x"), HasSubstr("a.2dm:10: expected the number of a node, the last of a string"));
  EXPECT_THAT(bad("NS 10 20", "NS 10 99"), EndsWith("a.2dm:10: expected the number of a node, got 99"));
  const absl::StatusOr<PointCloud> points = ReadCloud(folder_.Write("a.2dm", Replaced(k2dm, "E3T 2", "E4Q 2")));
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(points->size(), 4);
  const std::string text = k2dm;
  for (size_t size = 0; size < text.size(); ++size) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write("a.2dm", text.substr(0, size)));
    EXPECT_TRUE(mesh.ok() || absl::IsInvalidArgument(mesh.status())) << size << mesh.status();
  }
}

TEST_F(HydroFilesTest, HeightsThatAreMissingAreTold) {
  const Mesh mesh = RandomMesh(2, 4, 1);
  std::vector<std::string> notes;
  ASSERT_TRUE(WriteMesh(folder_.Path("a.14"), "", mesh.View(), {}, &notes).ok());
  EXPECT_THAT(notes, ElementsAre(HasSubstr("is called depth or elevation: all nodes have the depth 0")));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Attribute> attributes = {{"heat", {1, 2, 3, 4}}, {"depth", {1, nan, 3, nan}}};
  MeshView view = mesh.View();
  view.attributes = attributes;
  notes.clear();
  ASSERT_TRUE(WriteMesh(folder_.Path("a.14"), "", view, {}, &notes).ok());
  EXPECT_THAT(notes, ElementsAre(HasSubstr("left out: heat"), HasSubstr("2 nodes are without a depth, which points "
                                                                        "alone have: written as -99999")));
  const absl::Status space = WriteMesh(folder_.Path("a.14"), "", RandomMesh(3, 10, 10).View());
  EXPECT_THAT(std::string(space.message()), HasSubstr("adcirc holds meshes up to 2-D, and this one is 3-D"));
}

// Edges between two regions are no boundary of ADCIRC's, but a string of .2dm.
TEST_F(HydroFilesTest, EdgesInsideAreNoBoundary) {
  Mesh mesh{.dimension = 2, .points = {0, 0, 1, 0, 1, 1, 0, 1}, .simplices = {0, 1, 2, 0, 2, 3}};
  mesh.boundary = {{.tag = 1, .name = "", .facets = 4}, {.tag = 2, .name = "fault", .facets = 1}};
  mesh.facets = {0, 1, 1, 2, 2, 3, 3, 0, 0, 2};
  std::vector<std::string> notes;
  for (const bool has_tags : {false, true}) {
    mesh.vertex_tags.assign(has_tags ? 4 : 0, 1);
    mesh.vertex_origins.assign(has_tags ? 4 : 0, kSteinerOrigin);
    notes.clear();
    ASSERT_TRUE(WriteMesh(folder_.Path("a.14"), "", mesh.View(), {}, &notes).ok());
    EXPECT_THAT(notes, ElementsAre(HasSubstr("1 edge between two triangles is left out"), HasSubstr("depth 0")));
    EXPECT_THAT(ReadGood("a.14").boundary, ElementsAre(BoundaryPart{1, "", 4}));
  }
  ASSERT_TRUE(WriteMesh(folder_.Path("a.2dm"), "", mesh.View()).ok());
  EXPECT_THAT(ReadGood("a.2dm").boundary, ElementsAre(BoundaryPart{1, "", 4}, BoundaryPart{2, "fault", 1}));
}

TEST_F(HydroFilesTest, PiecesMakeTheSameFileAndMissingRowsNone) {
  const Mesh mesh = RandomMesh(2, 1000, 2000);
  for (const char* name : {"a.14", "a.2dm"}) {
    ASSERT_TRUE(WriteMesh(folder_.Path(name), "", mesh.View()).ok());
    const std::string whole = folder_.Read(name);
    for (const bool is_complete : {false, true}) {
      const auto writer = CreateMesh(folder_.Path(name), "", mesh.View().Shape());
      ASSERT_TRUE(writer.ok()) << writer.status();
      ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).first(30)).ok());
      ASSERT_TRUE((*writer)->AddPoints(std::span(mesh.points).subspan(30)).ok());
      ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).first(33)).ok());
      if (is_complete) {
        ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).subspan(33)).ok());
      }
      EXPECT_EQ((*writer)->Commit().code(), is_complete ? absl::StatusCode::kOk : absl::StatusCode::kInternal);
      EXPECT_EQ(folder_.Read(name), whole);
    }
    std::stop_source source;
    source.request_stop();
    EXPECT_EQ(WriteMesh(folder_.Path(name), "", mesh.View(), source.get_token()).code(), absl::StatusCode::kCancelled);
  }
}

TEST(FacetChainsTest, EveryEdgeOnce) {
  EXPECT_THAT(ChainsOf({}), IsEmpty());
  const std::vector<uint32_t> open = {3, 4, 1, 2, 2, 3, 7, 8};
  EXPECT_THAT(ChainsOf(open), ElementsAre(ElementsAre(1, 2, 3, 4), ElementsAre(7, 8)));
  const std::vector<uint32_t> rings = {1, 2, 2, 3, 3, 1, 5, 6, 6, 5};
  EXPECT_THAT(ChainsOf(rings), ElementsAre(ElementsAre(1, 2, 3, 1), ElementsAre(5, 6, 5)));
  const std::vector<uint32_t> eight = {1, 2, 2, 1, 1, 3, 3, 1, 4, 4, 1, 2};
  size_t edges = 0;
  for (const std::vector<uint32_t>& chain : ChainsOf(eight)) {
    edges += chain.size() - 1;
  }
  EXPECT_EQ(edges, eight.size() / 2);
}

}  // namespace
}  // namespace wellspace::formats
