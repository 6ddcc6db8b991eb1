// Several files as one surface: numbers and names of parts, places, triangles that two files have.
#include "client/formats/surface/join_surfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Part = Surface::Part;

// Triangles with these markers, one in each line from `line` on, at the height `z`; no two share a corner by number.
Surface FileOf(const std::string& file, const std::vector<int32_t>& markers, std::vector<Part> parts = {}, double z = 0,
               uint64_t line = 1) {
  Surface surface;
  surface.name = file;
  surface.format = "obj";
  surface.places.front().file = file;
  for (size_t i = 0; i < markers.size(); ++i) {
    const auto x = static_cast<double>(i);
    surface.points.insert(surface.points.end(), {x, 0, z, x + 1, 0, z, x, 1, z});
    for (uint32_t k = 0; k < 3; ++k) {
      surface.corners.push_back(static_cast<uint32_t>(3 * i) + k);
    }
    surface.places.front().triangles.Add(line + i);
  }
  surface.markers = markers;
  surface.parts = std::move(parts);
  return surface;
}

Surface Joined(Surface a, Surface b) {
  std::vector<Surface> surfaces;
  surfaces.push_back(std::move(a));
  surfaces.push_back(std::move(b));
  return JoinSurfaces(std::move(surfaces));
}

TEST(JoinSurfacesTest, OneFileStaysAsItIs) {
  std::vector<Surface> one;
  one.push_back(FileOf("a.obj", {0, 7}));
  const Surface surface = JoinSurfaces(std::move(one));
  EXPECT_EQ(surface.name, "a.obj");
  EXPECT_THAT(surface.markers, ElementsAre(0, 7));
  EXPECT_THAT(surface.parts, IsEmpty());
  EXPECT_EQ(surface.solids, Surface::SolidRule::kEvenOdd);
}

TEST(JoinSurfacesTest, FilesWithoutMarkersArePartsOfTheirName) {
  const Surface surface = Joined(FileOf("in/flange.v2.stl.gz", {0, 0}), FileOf("pipe.stl", {0}, {}, 1));
  EXPECT_EQ(surface.name, "in/flange.v2.stl.gz and 1 more");
  EXPECT_THAT(surface.markers, ElementsAre(1, 1, 2));
  EXPECT_THAT(surface.parts, ElementsAre(Part{1, "flange.v2"}, Part{2, "pipe"}));
  EXPECT_THAT(surface.corners, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_EQ(surface.solids, Surface::SolidRule::kHoles);
}

// A marker stays where it can; 4 and 5 are of files, 1 to 3 are free.
TEST(JoinSurfacesTest, MarkersAreKeptUnlessAnotherFileHasThem) {
  const Surface surface = Joined(FileOf("a.off", {5, 0, 4}), FileOf("b.off", {5, 6, 0}, {}, 1));
  EXPECT_THAT(surface.markers, ElementsAre(5, 1, 4, 3, 6, 2));
  EXPECT_THAT(surface.parts, ElementsAre(Part{1, "a"}, Part{2, "b"}, Part{3, "b_5"}));
}

TEST(JoinSurfacesTest, NumbersEndNowhere) {
  constexpr int32_t kMost = 2147483647;
  const Surface surface = Joined(FileOf("a.off", {kMost, -kMost - 1}), FileOf("b.off", {kMost, -kMost - 1}, {}, 1));
  EXPECT_THAT(surface.markers, ElementsAre(kMost, -kMost - 1, 2, 1));
}

TEST(JoinSurfacesTest, NamesOfSeveralFilesSayWhichFile) {
  const Surface surface = Joined(FileOf("a.stl", {1, 2}, {{1, "wall"}, {2, "inlet"}}),
                                 FileOf("b.stl", {1, 2}, {{1, "wall"}, {2, "outlet"}}, 1));
  EXPECT_THAT(surface.markers, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(surface.parts, ElementsAre(Part{1, "a_wall"}, Part{2, "inlet"}, Part{3, "b_wall"}, Part{4, "outlet"}));
}

TEST(JoinSurfacesTest, TrianglesOfTwoFilesAreThoseOfTheFirst) {
  Surface second = FileOf("b.stl", {0, 0, 0}, {}, -0.0, 10);
  std::swap(second.corners[3], second.corners[4]);  // seen from the other side
  second.points[2 * 9 + 2] = 1;                     // the last triangle is another one
  const Surface surface = Joined(FileOf("a.stl", {0, 0, 0}), second);
  EXPECT_THAT(surface.markers, ElementsAre(1, 1, 1, 2));
  EXPECT_THAT(surface.notes, ElementsAre("2 triangles are in several files; the parts are those of the first one"));
  EXPECT_EQ(surface.TriangleOrigin(3), "b.stl:12");
}

TEST(JoinSurfacesTest, CopiesWithinAFileStay) {
  Surface twice = FileOf("a.stl", {0, 0});
  std::copy_n(twice.points.begin(), 9, twice.points.begin() + 9);
  const Surface surface = Joined(twice, FileOf("b.stl", {0}, {}, 1));
  EXPECT_EQ(surface.triangle_count(), 3U);
}

TEST(JoinSurfacesTest, PlacesAndSeedsAreThoseOfTheFiles) {
  Surface first = FileOf("a.smesh", {1, 1}, {}, 0, 5);
  Surface second = FileOf("b.stl", {0}, {}, 1, 0);
  second.places.front().has_lines = false;
  first.seeds = {{.x = 1, .is_hole = true}};
  first.places.front().seeds.Add(9);
  second.seeds = {{.x = 2}, {.x = 3}};
  second.places.front().seeds.Add(3);
  second.places.front().seeds.Add(4);
  second.notes = {"a note"};
  second.names_points = false;
  second.cut_polygons = 2;
  const Surface surface = Joined(first, second);
  EXPECT_EQ(surface.TriangleOrigin(1), "a.smesh:6");
  EXPECT_EQ(surface.TriangleOrigin(2), "b.stl[0]");
  EXPECT_EQ(surface.SeedOrigin(0), "a.smesh:9");
  EXPECT_EQ(surface.SeedOrigin(2), "b.stl[4]");
  EXPECT_EQ(surface.seeds.size(), 3U);
  EXPECT_THAT(surface.notes, ElementsAre("b.stl: a note"));
  EXPECT_FALSE(surface.names_points);
  EXPECT_EQ(surface.cut_polygons, 2U);
}

}  // namespace
}  // namespace wellspace::formats
