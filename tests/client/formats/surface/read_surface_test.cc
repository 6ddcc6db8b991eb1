// Surfaces from files of every format: triangles, markers, names, seeds, places, and errors where they stand.
#include "client/formats/surface/read_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

using Part = Surface::Part;
using Seed = Surface::Seed;

class ReadSurfaceTest : public testing::Test {
 protected:
  Surface ReadGood(const std::string& name, std::string_view content, const std::string& format = "") {
    const absl::StatusOr<Surface> surface = ReadSurface(folder_.Write(name, content), format);
    EXPECT_TRUE(surface.ok()) << surface.status();
    return surface.ok() ? *surface : Surface{};
  }

  // The message after the folder's name.
  std::string ReadBad(const std::string& name, std::string_view content, const std::string& format = "") {
    const absl::StatusOr<Surface> surface = ReadSurface(folder_.Write(name, content), format);
    EXPECT_EQ(surface.status().code(), absl::StatusCode::kInvalidArgument) << content;
    return Without(std::string(surface.status().message()));
  }

  std::string Without(const std::string& text) const {
    const std::string path = folder_.Path("");
    return text.substr(0, path.size()) == path ? text.substr(path.size()) : text;
  }

  // However much of a file is there, it is a surface or an error, and no more.
  void ExpectCutAnywhereIsNoTrouble(const std::string& name, std::string_view content) {
    for (size_t size = 0; size < content.size(); ++size) {
      const absl::StatusOr<Surface> surface = ReadSurface(folder_.Write(name, content.substr(0, size)));
      EXPECT_TRUE(surface.ok() || absl::IsInvalidArgument(surface.status())) << size << surface.status();
    }
  }

  TemporaryFolder folder_;
};

std::string Replaced(std::string text, std::string_view from, std::string_view to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

template <typename T>
std::string Bytes(T value, bool swapped = false) {
  std::string bytes(sizeof(value), '\0');
  std::memcpy(bytes.data(), &value, sizeof(value));
  return swapped ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

constexpr char kStl[] =
    "solid left wall\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 0\n   vertex 0 1 0\n"
    "  endloop\n endfacet\nendsolid left wall\n"
    "SOLID\nfacet normal 0 0 -1\nouter loop\nVERTEX 1 0 0\nvertex -0 -0 0\nvertex 0 0 2\nendloop\nendfacet\nendsolid\n"
    "solid top\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 0 0 2\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
    "top\n"
    "solid left wall\nfacet normal 0 0 1\nouter loop\nvertex 0 0 2\nvertex 0 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    "endsolid\n";

TEST_F(ReadSurfaceTest, StlInAsciiHasSolidsForParts) {
  const Surface surface = ReadGood("a.stl", kStl);
  EXPECT_THAT(surface.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2));
  EXPECT_THAT(surface.corners, ElementsAre(0, 1, 2, 1, 0, 3, 1, 3, 2, 3, 0, 2));
  EXPECT_THAT(surface.markers, ElementsAre(1, 0, 2, 1));
  EXPECT_THAT(surface.parts, ElementsAre(Part{1, "left wall"}, Part{2, "top"}));
  EXPECT_FALSE(surface.names_points);
  EXPECT_EQ(surface.solids, Surface::SolidRule::kEvenOdd);
  EXPECT_EQ(surface.format, "stl");
  EXPECT_EQ(Without(surface.TriangleOrigin(0)), "a.stl:2");
  EXPECT_EQ(Without(surface.TriangleOrigin(3)), "a.stl:29");
  ExpectCutAnywhereIsNoTrouble("a.stl", kStl);
}

TEST_F(ReadSurfaceTest, StlErrors) {
  EXPECT_EQ(ReadBad("a.stl", Replaced(kStl, "   vertex 0 1 0\n", "")),
            "a.stl:7: expected three vertices in a facet, got 2");
  EXPECT_EQ(ReadBad("a.stl", Replaced(kStl, "   vertex 0 1 0\n", "vertex 0 1 0\nvertex 0 1 1\n")),
            "a.stl:7: expected three vertices in a facet, got a fourth");
  EXPECT_EQ(ReadBad("a.stl", Replaced(kStl, " endfacet\n", "")),
            "a.stl:10: expected \"endfacet\" before the next facet");
  EXPECT_EQ(ReadBad("a.stl", Replaced(kStl, " facet normal 0 0 1\n", "")),
            "a.stl:3: expected \"facet\" before a vertex");
  EXPECT_THAT(ReadBad("a.stl", Replaced(kStl, "1e0", "nan")), StartsWith("a.stl:5: expected a finite number"));
  EXPECT_THAT(ReadBad("a.stl", Replaced(kStl, "1e0", "nan")), ::testing::Not(HasSubstr("skip-invalid")));
  EXPECT_EQ(ReadBad("a.stl", "solid a\nendsolid a\n"), "a.stl: no triangles; expected at least one");
}

std::string BinaryStl(const std::vector<float>& corners, uint32_t count) {
  std::string bytes = std::string(80, 's') + Bytes(count);
  for (size_t i = 0; i < corners.size(); ++i) {
    bytes += (i % 9 == 0 ? std::string(12, '\x7e') : "") + Bytes(corners[i]) + (i % 9 == 8 ? std::string(2, '\1') : "");
  }
  return bytes;
}

TEST_F(ReadSurfaceTest, StlInBinary) {
  const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0, -0.0F, 0, 0, 0, 1, 0, 0, 0, 1};
  for (const uint32_t count : {2u, 0u}) {
    const Surface surface = ReadGood("a.stl", BinaryStl(corners, count));
    EXPECT_THAT(surface.corners, ElementsAre(0, 1, 2, 0, 2, 3));
    EXPECT_THAT(surface.markers, ElementsAre(0, 0));
    EXPECT_THAT(surface.parts, IsEmpty());
    EXPECT_EQ(Without(surface.TriangleOrigin(1)), "a.stl[1]");
  }
  EXPECT_EQ(ReadBad("a.stl", BinaryStl(corners, 4'000'000'000u)),
            "a.stl: byte 184: expected 4000000000 triangles, as the header says; the file ends in triangle 2");
  std::vector<float> infinite = corners;
  infinite[13] = 1.0F / 0.0F;
  EXPECT_EQ(ReadBad("a.stl", BinaryStl(infinite, 2)),
            "a.stl: byte 134: triangle 1, corner 1: coordinate 2: expected a finite number, got inf");
  ExpectCutAnywhereIsNoTrouble("a.stl", BinaryStl(corners, 2));
}

TEST_F(ReadSurfaceTest, FloatsFarFromTheOriginAreTold) {
  EXPECT_THAT(ReadGood("a.stl", BinaryStl({4e6, 0, 0, 4e6 + 1, 0, 0, 4e6, 1, 0}, 1)).notes,
              ElementsAre(HasSubstr("STL in binary has them as floats")));
  EXPECT_THAT(ReadGood("a.stl", BinaryStl({4e4, 0, 0, 4e4 + 1, 0, 0, 4e4, 1, 0}, 1)).notes, IsEmpty());
}

constexpr char kObj[] = R"(# a tetrahedron
mtllib x.mtl
o thing
v 0 0 0
v 1 0 0 0.5
v 0 1 0
v 0 0 1
vn 0 0 1
f 3 2 1
g wall outer
f 1/1/1 2//1 4/2
g
f -4 -1 -2
g top
usemtl x
f 2 3 \
  4
)";

TEST_F(ReadSurfaceTest, ObjHasGroupsAndObjectsForParts) {
  const Surface surface = ReadGood("a.obj", kObj);
  EXPECT_THAT(surface.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1));
  EXPECT_THAT(surface.corners, ElementsAre(2, 1, 0, 0, 1, 3, 0, 3, 2, 1, 2, 3));
  EXPECT_THAT(surface.markers, ElementsAre(1, 2, 1, 3));
  EXPECT_THAT(surface.parts, ElementsAre(Part{1, "thing"}, Part{2, "wall outer"}, Part{3, "top"}));
  EXPECT_TRUE(surface.names_points);
  EXPECT_EQ(Without(surface.TriangleOrigin(3)), "a.obj:16");
  ExpectCutAnywhereIsNoTrouble("a.obj", kObj);
}

TEST_F(ReadSurfaceTest, ObjErrors) {
  EXPECT_EQ(ReadBad("a.obj", Replaced(kObj, "-4 -1", "-5 -1")),
            "a.obj:13: expected a vertex from 1 to 4 or from -4 to -1, of those above, got \"-5\"");
  EXPECT_EQ(ReadBad("a.obj", Replaced(kObj, "f 3 2 1", "f 3 2")),
            "a.obj:9: expected a face of at least 3 corners, got 2");
  EXPECT_EQ(ReadBad("a.obj", Replaced(kObj, "v 0 1 0", "v 0 1")), "a.obj:6: expected 3 coordinates, got 2");
  EXPECT_EQ(ReadBad("a.obj", "f 1 2 3\n"),
            "a.obj:1: expected vertices before the face, got none; and the face has vertex \"1\"");
}

TEST_F(ReadSurfaceTest, OffTakesASingleNumberBehindAFaceForAMarker) {
  for (const char* word : {"OFF\n", "off ", "COFF\n"}) {
    const bool has_colours = std::string_view(word) == "COFF\n";
    const std::string colour = has_colours ? " 1 0 0 1" : "";
    const Surface surface = ReadGood("a.off", std::string(word) + "4 4 0\n0 0 0" + colour + "\n1 0 0" + colour +
                                                  "\n0 1 0" + colour + "\n# top\n0 0 1" + colour +
                                                  "\n3 2 1 0 -7\n3 0 1 3 255 0 0\n3 0 3 2\n3 1 2 3 0.5 # half\n");
    EXPECT_THAT(surface.corners, ElementsAre(2, 1, 0, 0, 1, 3, 0, 3, 2, 1, 2, 3));
    EXPECT_THAT(surface.markers, ElementsAre(-7, 0, 0, 0));
  }
  EXPECT_EQ(ReadBad("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
            "a.off:6: expected a vertex from 0 to 2, got \"3\"");
  EXPECT_EQ(ReadBad("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n"), "a.off:6: expected 3 corners, got 2");
  EXPECT_EQ(ReadBad("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
            "a.off:6: expected 2 faces, as the header says, got 1");
  EXPECT_EQ(ReadBad("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n"),
            "a.off:6: expected 4000000000 corners, got 3");
  EXPECT_THAT(ReadBad("a.off", "4OFF\n0 0 0\n"), HasSubstr("expected 3 coordinates, those of a surface, got 4"));
  EXPECT_THAT(ReadBad("a.off", "OFF\n1 0 0\nnan 0 0\n"), ::testing::Not(HasSubstr("skip-invalid")));
}

std::string Ply(const std::string& format, bool swapped, bool is_ascii) {
  std::string file =
      "ply\nformat " + format +
      " 1.0\nelement vertex 4\nproperty double x\nproperty uchar red\nproperty float y\nproperty float z\n"
      "element face 3\nproperty list uchar ushort texture\nproperty short tag\n"
      "property list uchar int vertex_indices\nelement edge 1\nproperty int a\nend_header\n";
  const double points[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  for (const auto& p : points) {
    file += is_ascii ? std::to_string(p[0]) + " 3 " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n"
                     : Bytes(p[0], swapped) + "\3" + Bytes(static_cast<float>(p[1]), swapped) +
                           Bytes(static_cast<float>(p[2]), swapped);
  }
  const std::vector<std::vector<int32_t>> faces = {{2, 1, 0}, {0, 1, 3}, {0, 1, 3, 2}};
  for (const std::vector<int32_t>& face : faces) {
    const auto tag = static_cast<int16_t>(face.size() == 4 ? -300 : 7);
    if (is_ascii) {
      file += "2 9 9 " + std::to_string(tag) + " " + std::to_string(face.size());
      for (const int32_t v : face) {
        file += " " + std::to_string(v);
      }
      file += "\n";
    } else {
      file += "\1" + Bytes(uint16_t{9}, swapped) + Bytes(tag, swapped) + static_cast<char>(face.size());
      for (const int32_t v : face) {
        file += Bytes(v, swapped);
      }
    }
  }
  return file + (is_ascii ? "1\n" : Bytes(1, swapped));
}

TEST_F(ReadSurfaceTest, PlyInAllThreeFormats) {
  const std::vector<std::string> files = {Ply("ascii", false, true), Ply("binary_little_endian", false, false),
                                          Ply("binary_big_endian", true, false)};
  for (const std::string& file : files) {
    const Surface surface = ReadGood("a.ply", file);
    EXPECT_THAT(surface.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0));
    EXPECT_THAT(surface.corners, ElementsAre(2, 1, 0, 0, 1, 3, 0, 1, 3, 0, 3, 2));
    EXPECT_THAT(surface.markers, ElementsAre(7, 7, -300, -300));
    EXPECT_EQ(surface.cut_polygons, 1u);
    EXPECT_EQ(Without(surface.TriangleOrigin(3)), &file == files.data() ? "a.ply:21" : "a.ply[2]");
    ExpectCutAnywhereIsNoTrouble("a.ply", file);
  }
}

TEST_F(ReadSurfaceTest, PlyErrors) {
  const std::string good = Ply("ascii", false, true);
  EXPECT_EQ(ReadBad("a.ply", Replaced(good, "2 9 9 7 3 2 1 0", "2 9 9 7 3 2 1 4")),
            "a.ply:19: value 3: expected a vertex from 0 to 3, got 4");
  EXPECT_EQ(ReadBad("a.ply", Replaced(good, "2 9 9 7 3 2 1 0", "2 9 9 7 3 2 1 0.5")),
            "a.ply:19: value 3: expected a vertex from 0 to 3, got 0.5");
  EXPECT_THAT(ReadBad("a.ply", Replaced(good, "2 9 9 7 3", "2 9 9 x 3")),
              HasSubstr("a.ply:19: value 2: expected a whole"));
  EXPECT_THAT(ReadBad("a.ply", Replaced(good, "vertex_indices", "corners")),
              HasSubstr("expected one list vertex_indices or vertex_index"));
  EXPECT_THAT(ReadBad("a.ply", Replaced(good, "element face 3", "element tristrips 3")),
              HasSubstr("behind it an element \"face\" in the header, got \"tristrips\""));
  EXPECT_THAT(ReadBad("a.ply", Replaced(good, "property float z", "property float w")),
              HasSubstr("expected one property x, one y and one z of element"));
  const std::string binary = Ply("binary_little_endian", false, false);
  EXPECT_THAT(ReadBad("a.ply", Replaced(binary, "element face 3", "element face 4000000000")),
              HasSubstr("expected 4000000000 rows of element \"face\""));
}

constexpr char kSmesh[] = R"(# two boxes of one shape
5 3 0 0
1  0 0 0
2  1 0 0
3  1 1 0
4  0 1 0
5  0.5 0.5 1
# facets
5 1
4  1 4 3 2   -3
3  1 2 5   2
3  2 3
   5   2
3  3 4 5
3  4 1 5   4
1
1  0.5 0.5 9
2
1  0.5 0.5 0.25   7   0.01
2  0.5 0.5 8      -2  -1
)";

TEST_F(ReadSurfaceTest, SmeshHasMarkersHolesAndRegions) {
  const Surface surface = ReadGood("a.smesh", kSmesh);
  EXPECT_EQ(surface.point_count(), 5u);
  EXPECT_THAT(surface.corners, ElementsAre(0, 3, 2, 0, 2, 1, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4));
  EXPECT_THAT(surface.markers, ElementsAre(-3, -3, 2, 2, 0, 4));
  EXPECT_THAT(surface.seeds, ElementsAre(Seed{0.5, 0.5, 9, true, 0, 0}, Seed{0.5, 0.5, 0.25, false, 7, 0.01},
                                         Seed{0.5, 0.5, 8, false, -2, 0}));
  EXPECT_EQ(surface.solids, Surface::SolidRule::kHoles);
  EXPECT_EQ(Without(surface.TriangleOrigin(1)), "a.smesh:10");
  EXPECT_EQ(Without(surface.SeedOrigin(2)), "a.smesh:20");
  ExpectCutAnywhereIsNoTrouble("a.smesh", kSmesh);
}

constexpr char kPoly[] = R"(4 3 0 0
0  0 0 0
1  1 0 0
2  0 1 0
3  0 0 1
4 1
1 0 5
3  0 2 1
1
3  0 1 3
1 0
3  0 3 2
1 0 -6
3  1 2 3
0
0
)";

TEST_F(ReadSurfaceTest, PolyInSpace) {
  const Surface surface = ReadGood("a.poly", kPoly);
  EXPECT_THAT(surface.corners, ElementsAre(0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3));
  EXPECT_THAT(surface.markers, ElementsAre(5, 0, 0, -6));
  EXPECT_TRUE(IsSurfacePath(folder_.Path("a.poly")));
  EXPECT_FALSE(IsSurfacePath(folder_.Write("b.poly", "3 2\n0 0 0\n")));
  EXPECT_EQ(ReadBad("a.poly", Replaced(kPoly, "1 0 5", "2 0 5")),
            "a.poly:7: expected a facet of one polygon without holes, got 2 polygons and 0 holes; cut it into polygons "
            "without holes, or into triangles, as tetgen -p writes them to a .smesh");
  EXPECT_THAT(ReadBad("a.poly", Replaced(kPoly, "1 0 -6", "1 1 -6")), HasSubstr("got 1 polygon and 1 hole;"));
  EXPECT_EQ(ReadBad("a.poly", Replaced(kPoly, "3  0 1 3", "3  0 1 4")),
            "a.poly:10: expected a point from 0 to 3, got \"4\"");
  EXPECT_EQ(ReadBad("a.poly", Replaced(kPoly, "4 3 0 0", "4 2 0 0")),
            "a.poly:1: expected dimension 3, since a surface is one in space, got 2");
  ExpectCutAnywhereIsNoTrouble("a.poly", kPoly);
}

TEST_F(ReadSurfaceTest, PointsMayBeInTheNodeFileBeside) {
  folder_.Write("a.node", "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n");
  EXPECT_EQ(ReadGood("a.smesh", "0 3 0 0\n4\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n").triangle_count(), 4u);
  EXPECT_THAT(ReadBad("b.smesh", "0 3 0 0\n4\n3 0 2 1\n"), HasSubstr("0 points stand for those of the file"));
}

TEST_F(ReadSurfaceTest, SmeshErrors) {
  EXPECT_EQ(ReadBad("a.smesh", Replaced(kSmesh, "3  3 4 5", "3  3 4 6")),
            "a.smesh:14: expected a point from 1 to 5, got \"6\"");
  EXPECT_EQ(ReadBad("a.smesh", Replaced(kSmesh, "3  1 2 5   2", "3  1 2 5   2 2")),
            "a.smesh:11: expected 3 corners and a marker, got also \"2\"");
  EXPECT_THAT(ReadBad("a.smesh", Replaced(kSmesh, "# facets\n5 1", "# facets\n6 1")),
              HasSubstr("a.smesh:17: marker: expected a whole number"));
  EXPECT_THAT(ReadBad("a.smesh", Replaced(kSmesh, "1  0.5 0.5 9", "1  0.5 0.5")), HasSubstr("got no z"));
  EXPECT_THAT(ReadBad("a.smesh", Replaced(kSmesh, "   7   0.01", "")), HasSubstr("got no attribute"));
}

TEST_F(ReadSurfaceTest, PolygonsAreCutWhetherTheyAreConvexOrNot) {
  // An L in a slanting plane, and with a corner on one of its sides: no fan has all of it.
  const std::string l = "OFF\n7 1 0\n0 0 0\n2 0 2\n2 1 2\n1 1 1\n1 2 1\n0 2 0\n0 1 0\n";
  for (const char* face : {"6 0 1 2 3 4 5\n", "7 0 1 2 3 4 5 6\n", "7 6 5 4 3 2 1 0\n"}) {
    const Surface surface = ReadGood("a.off", l + face);
    const size_t corners = static_cast<size_t>(face[0] - '0');
    ASSERT_EQ(surface.triangle_count(), corners - 2) << face;
    double area = 0;  // in the projection along the third axis
    for (size_t t = 0; t < surface.triangle_count(); ++t) {
      const auto at = [&](size_t k, size_t axis) {
        return surface.points[3 * size_t{surface.corners[3 * t + k]} + axis];
      };
      const double own = (at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0));
      EXPECT_EQ(own > 0, face[2] == '0') << face;
      area += 0.5 * std::abs(own);
    }
    EXPECT_DOUBLE_EQ(area, 3);
    EXPECT_EQ(surface.cut_polygons, 1u);
  }
  EXPECT_THAT(ReadBad("a.off", "OFF\n4 1 0\n0 0 0\n1 1 0\n1 0 0\n0 1 0\n4 0 1 2 3\n"),
              HasSubstr("a.off:7: expected a polygon whose sides do not cross or touch each other"));
}

TEST_F(ReadSurfaceTest, LargePolygons) {
  constexpr int kCount = 5'000;
  const auto star = [](double inner) {
    std::string text = "OFF\n" + std::to_string(kCount) + " 1 0\n";
    std::string face = std::to_string(kCount);
    for (int i = 0; i < kCount; ++i) {
      const double angle = 6.283185307179586 * i / kCount;
      const double radius = i % 2 == 0 ? 1 : inner;
      text += std::to_string(radius * std::cos(angle) * 1e3) + " " + std::to_string(radius * std::sin(angle) * 1e3) +
              " 5\n";
      face += " " + std::to_string(i);
    }
    return text + face + "\n";
  };
  EXPECT_EQ(ReadGood("a.off", star(1)).triangle_count(), kCount - 2u);
  EXPECT_THAT(ReadBad("a.off", star(0.5)), HasSubstr("is convex, or has at most 1024 corners, got one of 5000"));
}

TEST_F(ReadSurfaceTest, PolygonsWithoutAnAreaAreLeftToBeCounted) {
  const std::string points = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_THAT(ReadGood("a.off", points + "4 0 1 2 2\n").corners, ElementsAre(0, 1, 2));
  EXPECT_THAT(ReadGood("a.off", points + "4 0 1 1 0\n").corners, ElementsAre(0, 1, 1));
  EXPECT_THAT(ReadGood("a.off", points + "4 0 0 0 0\n").corners, ElementsAre(0, 0, 0));
}

TEST_F(ReadSurfaceTest, FormatsByNameAndByExtension) {
  EXPECT_THAT(SurfaceFormats(), ElementsAre("stl", "obj", "ply", "off", "smesh", "poly"));
  EXPECT_EQ(ReadGood("a.any", kObj, "obj").triangle_count(), 4u);
  EXPECT_THAT(ReadBad("a.msh", kObj), HasSubstr("no format is known by the extension \".msh\"; expected one of .stl"));
  EXPECT_THAT(ReadSurface("-").status().message(), HasSubstr("expected to be told the format: one of stl, obj"));
  EXPECT_EQ(ReadSurface(folder_.Path("none.stl")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(IsSurfacePath("a.STL.gz"));
  EXPECT_TRUE(IsSurfacePath("a.smesh"));
  EXPECT_FALSE(IsSurfacePath("a.obj"));
  EXPECT_FALSE(IsSurfacePath("none.poly"));
}

}  // namespace
}  // namespace wellspace::formats
