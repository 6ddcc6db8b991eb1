// Attributes of points on their way from files of clouds to files of meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "client/formats/attributes.h"
#include "client/formats/read_cloud.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::NanSensitiveDoubleEq;

const CloudOptions kWithAttributes = {.keep_attributes = true};
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

auto Values(std::vector<double> values) { return ::testing::Pointwise(NanSensitiveDoubleEq(), std::move(values)); }

class AttributeFilesTest : public ReadCloudTest {};

TEST_F(AttributeFilesTest, NamedColumnsOfNumbersInTables) {
  const std::string csv = "id,x,name,y,,heat\n7,1,a,2,5,0.5\n8,3,b,4,5,NA\n9,nan,c,6,5,2\n10,7,d,8,5\n";
  const PointCloud cloud = ReadGood("a.csv", csv, {.skip_invalid = true, .keep_attributes = true});
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 7, 8));
  ASSERT_EQ(cloud.attributes.size(), 2);  // names are words, and a column without a name is none
  EXPECT_EQ(cloud.attributes[0], (Attribute{"id", {7, 8, 10}}));
  EXPECT_EQ(cloud.attributes[1].name, "heat");
  EXPECT_THAT(cloud.attributes[1].values, Values({0.5, kMissing, kMissing}));
  EXPECT_THAT(ReadGood("a.csv", csv, {.skip_invalid = true}).attributes, IsEmpty());
  EXPECT_THAT(ReadGood("a.xyz", "1 2 3 4\n5 6 7 8\n", kWithAttributes).attributes, IsEmpty());
  EXPECT_THAT(ReadGood("a.csv", "x,y,late\n1,2,3\n4,5,word\n", kWithAttributes).attributes, IsEmpty());
}

TEST_F(AttributeFilesTest, PropertiesOfPly) {
  const std::string header =
      "element vertex 2\nproperty uchar red\nproperty float y\nproperty list uchar int tags\nproperty double x\n"
      "property short id\nend_header\n";
  const PointCloud text =
      ReadGood("a.ply", "ply\nformat ascii 1.0\n" + header + "255 2 1 7 1 -5\n0 4 0 3 what\n", kWithAttributes);
  EXPECT_THAT(text.points, ElementsAre(1, 2, 3, 4));
  ASSERT_EQ(text.attributes.size(), 2);
  EXPECT_EQ(text.attributes[0], (Attribute{"red", {255, 0}}));
  EXPECT_THAT(text.attributes[1].values, Values({-5, kMissing}));
  using std::string_literals::operator""s;
  const std::string row = "\xff\0\0\0\x40\0"s + "\0\0\0\0\0\0\xf0\x3f"s + "\xfb\xff"s;
  const PointCloud binary =
      ReadGood("a.ply", "ply\nformat binary_little_endian 1.0\n" + header + row + row, kWithAttributes);
  EXPECT_THAT(binary.points, ElementsAre(1, 2, 1, 2));
  EXPECT_THAT(binary.attributes, ElementsAre(Attribute{"red", {255, 255}}, Attribute{"id", {-5, -5}}));
}

TEST_F(AttributeFilesTest, NamesOfFiles) {
  const std::vector<Attribute> attributes = {{"origin", {}}, {"", {}}, {"a<b", {}}, {"a_b", {}}, {"x y", {}}};
  EXPECT_THAT(NamesToWrite(attributes), ElementsAre("origin_", "attribute", "a_b", "a_b_", "x y"));
}

// Attributes of a mesh, once written, are read as attributes of its vertices.
TEST_F(AttributeFilesTest, ComeBackFromVtuAndVtk) {
  const std::vector<double> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<uint32_t> simplices = {0, 1, 2, 3};
  const std::vector<Attribute> attributes = {{"heat %", {0.1, 2, kMissing, -4}}, {"id", {1, 2, 3, 4}}};
  MeshView mesh{.dimension = 3, .points = points, .simplices = simplices};
  mesh.attributes = attributes;
  for (const char* name : {"a.vtu", "a.vtk"}) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(HasPlaceForAttributes(name, ""));
    ASSERT_TRUE(WriteMesh(folder_.Path(name), "", mesh).ok());
    const absl::StatusOr<PointCloud> cloud = ReadCloud(folder_.Path(name), kWithAttributes);
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    EXPECT_EQ(cloud->points, points);
    ASSERT_EQ(cloud->attributes.size(), 3);
    EXPECT_EQ(cloud->attributes[0], (Attribute{"input", {0, 0, 0, 0}}));
    EXPECT_EQ(cloud->attributes[1].name, "heat %");
    EXPECT_THAT(cloud->attributes[1].values, Values(attributes[0].values));
    EXPECT_EQ(cloud->attributes[2], attributes[1]);
  }
}

TEST_F(AttributeFilesTest, OtherFormatsLeaveThemOutAndMissingValuesAreAnError) {
  const std::vector<double> points = {0, 0, 1, 0, 0, 1};
  const std::vector<uint32_t> simplices = {0, 1, 2};
  std::vector<Attribute> attributes = {{"heat", {1, 2, 3}}};
  MeshView mesh{.dimension = 2, .points = points, .simplices = simplices};
  mesh.attributes = attributes;
  for (const char* name : {"a.msh", "a.mesh", "a.node", "a.su2", "a.inp"}) {
    EXPECT_FALSE(HasPlaceForAttributes(folder_.Path(name), "")) << name;
    EXPECT_TRUE(WriteMesh(folder_.Path(name), "", mesh).ok()) << name;
  }
  attributes[0].values.pop_back();
  for (const char* name : {"b.vtu", "b.vtkhdf", "b.vtk", "b.xdmf", "b.npz"}) {
    EXPECT_EQ(WriteMesh(folder_.Path(name), "", mesh).code(), absl::StatusCode::kInternal) << name;
    EXPECT_EQ(folder_.Read(name), "") << name;
  }
}

}  // namespace
}  // namespace wellspace::formats
