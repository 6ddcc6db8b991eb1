// Pages hold the data of their mesh and nothing that runs; meshes that cannot be shown are refused.
#include "client/viewer/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/vtk/vtk_array.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::viewer {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Two tetrahedra of two regions, with names and numbers of every kind.
formats::Mesh TwoTetrahedra() {
  return {.dimension = 3,
          .points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0.1},
          .simplices = {0, 1, 2, 3, 1, 4, 2, 3},
          .facets = {0, 2, 1, 1, 2, 4, 0, 1, 3},
          .boundary = {{.tag = -4, .name = "bottom", .facets = 2}, {.tag = 7, .name = "", .facets = 1}},
          .simplex_regions = {9, -2},
          .regions = {{.id = -2, .name = "rock"}, {.id = 9, .name = "water"}}};
}

class PageTest : public testing::Test {
 protected:
  std::string PageOf(const formats::MeshView& mesh, const PageOptions& options = {.name = "a.npz"}) {
    absl::StatusOr<formats::OutputFile> file = formats::OutputFile::Create(folder_.Path("page.html"));
    EXPECT_TRUE(file.ok()) << file.status();
    WritePage(mesh, options, *file);
    const absl::Status status = file->Commit();
    EXPECT_TRUE(status.ok()) << status;
    return folder_.Read("page.html");
  }

  TemporaryFolder folder_;
};

// The text of the page's element `id`.
std::string ElementOf(const std::string& page, const std::string& id) {
  const std::string start = "id=\"" + id + "\">";
  const size_t from = page.find(start);
  EXPECT_NE(from, std::string::npos) << id;
  if (from == std::string::npos) {
    return "";
  }
  return page.substr(from + start.size(), page.find("</script>", from) - from - start.size());
}

template <typename T>
std::vector<T> ArrayOf(const std::string& page, const std::string& id) {
  const absl::StatusOr<std::string> bytes = formats::DecodeBase64(ElementOf(page, id));
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  std::vector<T> values(bytes->size() / sizeof(T));
  std::memcpy(values.data(), bytes->data(), values.size() * sizeof(T));
  return values;
}

TEST_F(PageTest, HasTheMesh) {
  const formats::Mesh mesh = TwoTetrahedra();
  const std::vector<formats::Attribute> attributes = {{"height", {0, -1.5, 1e-320, 3, 4}}};
  formats::MeshView view = mesh.View();
  view.attributes = attributes;
  const std::vector<formats::Attribute> simplex_attributes = {{"pressure", {2.5, -0.0}}};
  view.simplex_attributes = simplex_attributes;
  const std::vector<double> weights = {1, 2, 3, 4, 5};
  view.weights = weights;
  const std::string page = PageOf(view, {.name = "a.npz", .up = 1});
  EXPECT_EQ(
      ElementOf(page, "mesh"),
      R"({"boundary":[{"facets":2,"name":"bottom","tag":-4},{"facets":1,"name":"","tag":7}],)"
      R"("dimension":3,"fields":["height","weights"],"format":1,"has_simplex_regions":true,"name":"a.npz",)"
      R"("regions":[{"id":-2,"name":"rock"},{"id":9,"name":"water"}],"simplex_fields":["pressure"],"simplices":2,)"
      R"("up":1,"vertices":5})");
  EXPECT_EQ(ArrayOf<double>(page, "mesh-points"), mesh.points);
  EXPECT_EQ(ArrayOf<uint32_t>(page, "mesh-simplices"), mesh.simplices);
  EXPECT_EQ(ArrayOf<uint32_t>(page, "mesh-facets"), mesh.facets);
  EXPECT_EQ(ArrayOf<uint32_t>(page, "mesh-regions"), (std::vector<uint32_t>{1, 0}));
  EXPECT_EQ(ArrayOf<double>(page, "mesh-field0"), attributes[0].values);
  EXPECT_EQ(ArrayOf<double>(page, "mesh-field1"), weights);
  EXPECT_EQ(ArrayOf<double>(page, "mesh-simplex-field0"), simplex_attributes[0].values);
}

// Larger than one piece of the output.
TEST_F(PageTest, HasLongArrays) {
  formats::Mesh mesh;
  mesh.dimension = 2;
  for (uint32_t i = 0; i < 100'001; ++i) {
    mesh.points.insert(mesh.points.end(), {i * 0.1, 1.0 * (i % 2)});
  }
  for (uint32_t i = 0; i + 2 < 100'001; ++i) {
    mesh.simplices.insert(mesh.simplices.end(), {i, i + 1, i + 2});
  }
  const std::string page = PageOf(mesh.View());
  EXPECT_EQ(ArrayOf<double>(page, "mesh-points"), mesh.points);
  EXPECT_EQ(ArrayOf<uint32_t>(page, "mesh-simplices"), mesh.simplices);
  EXPECT_THAT(ElementOf(page, "mesh"), HasSubstr(R"("has_simplex_regions":false)"));
}

TEST_F(PageTest, NamesAreNeverMarkup) {
  formats::Mesh mesh = TwoTetrahedra();
  const std::string hostile = "</script><script>alert(1)</script><!--\xff\xe2\x82\n\x7f\"'&";
  mesh.boundary[0].name = hostile;
  mesh.regions[0].name = hostile;
  const std::vector<formats::Attribute> attributes = {{hostile, {0, 1, 2, 3, 4}}};
  formats::MeshView view = mesh.View();
  view.attributes = attributes;
  const std::string page = PageOf(view, {.name = hostile});
  EXPECT_THAT(page, Not(HasSubstr("alert(1)</script>")));
  const std::string text = ElementOf(page, "mesh");
  EXPECT_EQ(text.find_first_of("<\n"), std::string::npos);
  for (const char byte : text) {
    EXPECT_TRUE(byte >= ' ' && byte < '\x7f') << static_cast<int>(byte);
  }
  // Bytes that are no UTF-8 give U+FFFD.
  const nlohmann::json header = nlohmann::json::parse(text);
  EXPECT_EQ(header["name"], "</script><script>alert(1)</script><!--\ufffd\ufffd\n\x7f\"'&");
  EXPECT_EQ(header["name"], header["boundary"][0]["name"]);
  EXPECT_EQ(header["name"], header["regions"][0]["name"]);
  EXPECT_EQ(header["name"], header["fields"][0]);
}

TEST_F(PageTest, RefusesWhatItCannotShow) {
  formats::Mesh mesh = TwoTetrahedra();
  EXPECT_TRUE(CheckMesh(mesh.View()).ok());
  for (const double wrong : {1e151, -std::numeric_limits<double>::infinity(), std::nan("")}) {
    formats::Mesh broken = mesh;
    broken.points[7] = wrong;
    EXPECT_THAT(CheckMesh(broken.View()).ToString(), HasSubstr("of vertex 2"));
  }
  mesh.simplices.clear();
  EXPECT_THAT(CheckMesh(mesh.View()).ToString(), HasSubstr("INVALID_ARGUMENT: the mesh has no simplices"));
  mesh = {.dimension = 4, .points = std::vector<double>(20), .simplices = {0, 1, 2, 3, 4}};
  EXPECT_THAT(CheckMesh(mesh.View()).ToString(), HasSubstr("this one is 4-D"));
  // The bytes are not looked at.
  const std::vector<double> points(9);
  const std::span<const uint32_t> many(reinterpret_cast<const uint32_t*>(points.data()), kMaxArrayBytes / 4 + 3);
  const absl::Status large = CheckMesh({.dimension = 2, .points = points, .simplices = many});
  EXPECT_EQ(large.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(large.ToString(), HasSubstr("the triangles take 268435468 bytes; expected at most 268435456"));
}

TEST(EmptyPageTest, IsSelfContained) {
  const std::string page(EmptyPage());
  EXPECT_EQ(page.find(kMeshMark), page.rfind(kMeshMark));
  EXPECT_NE(page.find(kMeshMark), std::string::npos);
  EXPECT_LT(page.size(), 700'000u);
  EXPECT_THAT(page, HasSubstr("content=\"default-src 'none'; script-src 'sha256-"));
  EXPECT_THAT(page, HasSubstr("Permission is hereby granted, free of charge"));  // the licence of three.js
  EXPECT_THAT(page, Not(HasSubstr("<link")));
  EXPECT_THAT(page, Not(HasSubstr(" src=")));
}

}  // namespace
}  // namespace wellspace::viewer
