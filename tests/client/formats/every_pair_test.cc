// From every format of meshes that is read and written to every other one: no simplex, region, tag or name is lost, but
// for losses that a note tells.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
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
};
constexpr Kind kKinds[] = {{"vtu", "a.vtu"},   {"vtk", "a.vtk"},    {"npz", "a.npz"},   {"msh41", "a.msh"},
                           {"msh22", "b.msh"}, {"medit", "a.mesh"}, {"node", "a.node"}, {"2dm", "a.2dm"}};

bool Holds(const Kind& kind, int dimension) { return dimension == 2 || kind.format != std::string_view("2dm"); }

// The content of a mesh, in an order of its own: simplices and facets with the number and the name that they have.
using Row = std::pair<std::vector<uint32_t>, std::pair<int32_t, std::string>>;
struct Content {
  std::vector<Row> simplices;
  std::vector<Row> facets;
  std::set<std::pair<int32_t, std::string>> names;  // of parts and regions, also of those without anything

  bool operator==(const Content&) const = default;
};

Content ContentOf(const Mesh& mesh) {
  Content content;
  std::map<int32_t, std::string> regions;
  for (const Region& region : mesh.regions) {
    regions[region.id] = region.name;
    content.names.emplace(region.id, "region " + region.name);
  }
  const size_t corners = mesh.dimension + 1;
  for (size_t i = 0; i * corners < mesh.simplices.size(); ++i) {
    const int32_t region = !mesh.simplex_regions.empty() ? mesh.simplex_regions[i]
                           : mesh.regions.empty()        ? 0
                                                         : mesh.regions[0].id;
    content.simplices.push_back({{mesh.simplices.begin() + i * corners, mesh.simplices.begin() + (i + 1) * corners},
                                 {region, regions[region]}});
  }
  size_t at = 0;
  for (const BoundaryPart& part : mesh.boundary) {
    content.names.emplace(part.tag, "part " + part.name);
    for (uint64_t i = 0; i < part.facets; ++i, at += mesh.dimension) {
      content.facets.push_back(
          {{mesh.facets.begin() + at, mesh.facets.begin() + at + mesh.dimension}, {part.tag, part.name}});
    }
  }
  std::sort(content.simplices.begin(), content.simplices.end());
  std::sort(content.facets.begin(), content.facets.end());
  return content;
}

// A mesh whose regions and parts share numbers, with names that a syntax might trip over.
Mesh Named(int dimension) {
  Mesh mesh = RandomMesh(dimension, 60, 120);
  mesh.regions = {{-4, "minus four"}, {1, "100% land, wet"}, {2, " blanks at the ends "}, {7, ""}, {9, "empty"}};
  mesh.boundary = {{.tag = 1, .name = "a name: of # words", .facets = 5},
                   {.tag = 2, .name = "K\xC3\xBCste <&> -- 2", .facets = 7},
                   {.tag = 3, .name = "", .facets = 4},
                   {.tag = 5, .name = "without facets", .facets = 0}};
  for (uint64_t i = 0; i < 120; ++i) {
    mesh.simplex_regions.push_back(mesh.regions[i % 4].id);
  }
  for (uint64_t i = 0; i < CountFacets(mesh.boundary) * dimension; ++i) {
    mesh.facets.push_back(static_cast<uint32_t>(i * 7 % 60));
  }
  mesh.vertex_origins.assign(60, kSteinerOrigin);
  mesh.vertex_tags.assign(60, 1);
  return mesh;
}

class EveryPairTest : public MeshFilesFixture {
 protected:
  // Writes as `wellspace convert` does, and returns the notes.
  std::vector<std::string> WriteNoted(Mesh mesh, const Kind& kind) {
    if (!mesh.boundary.empty()) {
      mesh.vertex_origins.assign(mesh.View().vertex_count(), kSteinerOrigin);
      mesh.vertex_tags.assign(mesh.View().vertex_count(), 1);
    }
    std::vector<std::string> notes;
    const absl::Status written = WriteMesh(folder_.Path(kind.file), kind.format, mesh.View(), {}, &notes);
    EXPECT_TRUE(written.ok()) << written;
    return notes;
  }

  void ExpectKeptByEveryPair(const Mesh& mesh) {
    const Content content = ContentOf(mesh);
    for (const Kind& from : kKinds) {
      for (const Kind& to : kKinds) {
        if (!Holds(from, mesh.dimension) || !Holds(to, mesh.dimension)) {
          continue;
        }
        SCOPED_TRACE(std::string(from.format) + " to " + to.format + " in " + std::to_string(mesh.dimension) + "-D");
        WriteNoted(mesh, from);
        Mesh read = ReadGood(from.file);
        EXPECT_THAT(read.notes, IsEmpty());
        WriteNoted(read, to);
        read = ReadGood(to.file);
        EXPECT_EQ(Bits(read.points), Bits(mesh.points));
        EXPECT_TRUE(ContentOf(read) == content);
      }
    }
  }
};

TEST_F(EveryPairTest, KeepsSimplicesRegionsTagsAndNames) {
  for (const int dimension : {2, 3}) {
    ExpectKeptByEveryPair(Named(dimension));
  }
}

TEST_F(EveryPairTest, KeepsTheOnlyRegion) {
  for (const int dimension : {2, 3}) {
    for (const bool has_boundary : {false, true}) {
      Mesh mesh = Named(dimension);
      mesh.simplex_regions.clear();
      mesh.regions = {{7, "the one and only"}};
      if (!has_boundary) {
        mesh.boundary.clear();
        mesh.facets.clear();
        mesh.vertex_origins.clear();
        mesh.vertex_tags.clear();
      }
      ExpectKeptByEveryPair(mesh);
    }
  }
}

// In a format that cannot hold a name, another one stands, and a note says so.
TEST_F(EveryPairTest, NamesThatCannotBeKeptAreToldOf) {
  Mesh mesh = Named(2);
  mesh.boundary[0].name = std::string(700, 'x') + "\xC3\xBC";
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    const bool is_npz = kind.format == std::string("npz");  // 1024 characters
    const std::vector<std::string> notes = WriteNoted(mesh, kind);
    const size_t heights = kind.format[1] == 'd' ? 1 : 0;  // nodes of 2dm have none
    EXPECT_EQ(notes.size() - heights, is_npz ? 0 : kind.format[1] == 's' ? 2 : 1) << testing::PrintToString(notes);
    const std::string name = ReadGood(kind.file).boundary[0].name;
    EXPECT_EQ(name, mesh.boundary[0].name.substr(0, name.size()));
    EXPECT_EQ(name.size() == 702, is_npz);
  }
  mesh.boundary[0].name = "in \"quotes\"\nand lines";
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.format);
    const bool is_msh = kind.format[1] == 's';
    const std::vector<std::string> notes = WriteNoted(mesh, kind);
    const size_t heights = kind.format[1] == 'd' ? 1 : 0;
    EXPECT_EQ(notes.size() - heights, is_msh ? 2 : 0) << testing::PrintToString(notes);  // one of numbers below 0
    EXPECT_EQ(ReadGood(kind.file).boundary[0].name, is_msh ? "in _quotes__and lines" : mesh.boundary[0].name);
  }
}

// Formats that are not read back tell of the data that they leave out.
TEST_F(EveryPairTest, LossesAreToldOf) {
  Mesh mesh = Named(2);
  EXPECT_THAT(WriteNoted(mesh, {"su2", "a.su2"}),
              ElementsAre(HasSubstr("no place for regions, which are left out: minus four, 100% land, wet"),
                          HasSubstr("names are labels")));
  EXPECT_THAT(WriteNoted(mesh, {"vtkhdf", "a.vtkhdf"}), IsEmpty());
  EXPECT_THAT(WriteNoted(mesh, {"xdmf", "a.xdmf"}), IsEmpty());
  const std::vector<Attribute> attributes = {{"heat", std::vector<double>(60, 1.5)}};
  for (const char* format : {"msh41", "msh22", "medit", "node", "su2", "abaqus"}) {
    SCOPED_TRACE(format);
    Mesh plain = RandomMesh(2, 60, 1);
    plain.points.assign(120, 0.5);
    MeshView view = plain.View();
    view.attributes = attributes;
    std::vector<std::string> notes;
    ASSERT_TRUE(WriteMesh(folder_.Path("a"), format, view, {}, &notes).ok());
    EXPECT_THAT(notes, ElementsAre(HasSubstr("no place for attributes of vertices, which are left out: heat")));
  }
}

// Parts of a file that are not read.
TEST_F(EveryPairTest, WhatIsNotReadIsToldOf) {
  folder_.Write("a.msh",
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
                "$Elements\n3\n1 1 2 0 1 1 2\n2 1 2 4 1 2 3\n3 2 2 0 1 1 2 3\n$EndElements\n");
  EXPECT_THAT(ReadGood("a.msh").notes, ElementsAre(HasSubstr("1 lines of no physical group are left out")));
  folder_.Write("a.node", "3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n");
  folder_.Write("a.ele", "1 3 2\n0 0 1 2 0.5 7\n");
  EXPECT_THAT(ReadGood("a.node").notes, ElementsAre(HasSubstr("the first attributes of the triangles are left out"),
                                                    HasSubstr("only the first")));
}

}  // namespace
}  // namespace wellspace::formats
