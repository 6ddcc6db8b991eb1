// wellspace convert and wellspace info, and attributes from a cloud to its mesh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "tests/client/cli/commands_fixture.h"

namespace wellspace {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// The fifth point is the first one again.
constexpr char kMeasured[] =
    "id,x,y,place,heat\n7,0,0,a,0.5\n8,1,0.1,b,\n9,0.4,0.9,c,2\n10,0.5,0.45,d,3\n11,0,0,e,4\n12,0.1,0.2,f,-1e300\n";

class FileCommandsTest : public CommandsTest {
 protected:
  nlohmann::json Info(const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"info", Path(name), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  }
};

TEST_F(FileCommandsTest, VerticesHaveTheAttributesOfTheirPoints) {
  for (const char* name : {"a.vtu", "a.vtk"}) {
    SCOPED_TRACE(name);
    Mesh(kMeasured, name);
    const absl::StatusOr<formats::PointCloud> mesh = formats::ReadCloud(Path(name), {.keep_attributes = true});
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ASSERT_EQ(mesh->attributes.size(), 5);  // input, origin, boundary
    const formats::Attribute& id = mesh->attributes[3];
    const formats::Attribute& heat = mesh->attributes[4];
    EXPECT_EQ(id.name, "id");
    EXPECT_EQ(heat.name, "heat");
    ASSERT_GT(mesh->size(), 5);
    EXPECT_THAT(std::vector<double>(id.values.begin(), id.values.begin() + 5), ElementsAre(7, 8, 9, 10, 12));
    EXPECT_EQ(heat.values[0], 0.5);
    EXPECT_TRUE(std::isnan(heat.values[1]));  // the file has none
    EXPECT_EQ(heat.values[4], -1e300);
    for (size_t vertex = 5; vertex < mesh->size(); ++vertex) {
      EXPECT_TRUE(std::isnan(id.values[vertex]) && std::isnan(heat.values[vertex])) << vertex;
    }
  }
  for (const char* flag : {"--no-attributes", "--no-boundary"}) {
    Mesh(kMeasured, "bare.vtu", {flag});
    EXPECT_THAT(folder_.Read("bare.vtu"), Not(HasSubstr("heat")));
  }
}

TEST_F(FileCommandsTest, ConvertKeepsBoundaryRegionsNamesAndAttributes) {
  Mesh(kMeasured, "a.vtu");
  const absl::StatusOr<formats::Mesh> first = formats::ReadMesh(Path("a.vtu"));
  ASSERT_TRUE(first.ok());
  Mesh(kMeasured, "named.msh");
  std::string from = "named.msh";
  for (const char* to : {"b.npz", "b.mesh", "b.node", "b.vtu", "b.msh"}) {
    SCOPED_TRACE(to);
    const RunResult result = RunWellspace({"convert", Path(from), Path(to)});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(Path(to));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->points, first->points);
    EXPECT_EQ(mesh->simplices, first->simplices);
    EXPECT_EQ(mesh->facets, first->facets);
    ASSERT_EQ(mesh->boundary.size(), 4);
    EXPECT_EQ(mesh->boundary[3].name, "ymax");
    ASSERT_EQ(mesh->regions.size(), 1);
    EXPECT_EQ(mesh->regions[0].name, "domain");
    from = to;
  }
  ASSERT_EQ(RunWellspace({"convert", Path("named.msh"), Path("c.npz")}).exit_code, 0);
  EXPECT_EQ(formats::ReadMesh(Path("c.npz"))->boundary[3].name, "ymax");
  ASSERT_EQ(RunWellspace({"convert", Path("a.vtu"), Path("c.vtu")}).exit_code, 0);
  const absl::StatusOr<formats::PointCloud> before = formats::ReadCloud(Path("a.vtu"), {.keep_attributes = true});
  const absl::StatusOr<formats::PointCloud> after = formats::ReadCloud(Path("c.vtu"), {.keep_attributes = true});
  ASSERT_TRUE(before.ok() && after.ok());
  ASSERT_EQ(before->attributes.size(), 5);
  ASSERT_EQ(after->attributes.size(), 5);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(after->attributes[i].name, before->attributes[i].name);
    for (size_t vertex = 0; vertex < before->size(); ++vertex) {
      const double value = before->attributes[i].values[vertex];
      EXPECT_TRUE(after->attributes[i].values[vertex] == value || std::isnan(value)) << i << " " << vertex;
    }
  }
  EXPECT_EQ(RunWellspace({"convert", Path("a.vtu"), Path("a.vtu")}).exit_code, 2);
  EXPECT_THAT(RunWellspace({"convert", Path("a.vtu"), Path("a.xyz")}).err, HasSubstr("no format is known"));
  EXPECT_THAT(RunWellspace({"convert", Path("none.msh"), Path("d.vtu")}).err, HasSubstr("none.msh"));
}

// Of the mesher's own files, in one run, the same bytes as of convert.
TEST_F(FileCommandsTest, ElementsOfSecondOrder) {
  for (const char* cloud : {kPlane, kSpace}) {
    for (const std::string extension : {".npz", ".vtu", ".msh", ".inp"}) {
      SCOPED_TRACE(extension);
      Mesh(cloud, "first.npz");
      Mesh(cloud, "mesh" + extension, {"--order", "2"});
      const RunResult result =
          RunWellspace({"convert", Path("first.npz"), Path("convert" + extension), "--order", "2"});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(folder_.Read("mesh" + extension), folder_.Read("convert" + extension));
    }
  }
  const RunResult figures =
      RunWellspace({"convert", Path("first.npz"), Path("a.vtk"), "--order", "2", "--output", "json"});
  EXPECT_EQ(nlohmann::json::parse(figures.out)["order"], 2) << figures.out;
  const int files = folder_.FileCount();
  EXPECT_THAT(MeshFails("cloud.csv", kSpace, 2, {"--order", "3"}),
              HasSubstr("--order: expected a whole number of at least 1 and at most 2, got \"3\""));
  for (const char* name : {"a.su2", "a.mesh"}) {
    const RunResult refused = RunWellspace({"convert", Path("first.npz"), Path(name), "--order", "2"});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("has no elements of second order that its readers take; expected one of vtu"));
    EXPECT_THAT(RunWellspace({"mesh", Path("none.csv"), "-o", Path(name), "--order", "2"}).err,
                HasSubstr("has no elements of second order"));  // before anything is read
  }
  EXPECT_EQ(folder_.FileCount(), files);
}

// Origins of vertices come back from .npz.
TEST_F(FileCommandsTest, ConvertKeepsOriginsOfNpz) {
  Mesh(kPlane, "a.npz");
  Mesh(kPlane, "a.vtu");
  ASSERT_EQ(RunWellspace({"convert", Path("a.npz"), Path("b.vtu")}).exit_code, 0);
  EXPECT_EQ(folder_.Read("b.vtu"), folder_.Read("a.vtu"));
  ASSERT_EQ(RunWellspace({"convert", Path("b.vtu"), Path("b.npz")}).exit_code, 0);
  EXPECT_EQ(folder_.Read("b.npz"), folder_.Read("a.npz"));
}

// What Python makes of the arrays is the business of read_test.py.
TEST_F(FileCommandsTest, ConvertMakesArraysOfDomainsAndSurfaces) {
  folder_.Write("lake.wkt", "POLYGON ((0 0, 3 0, 1 2, 0 0))");
  folder_.Write("part.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 1\n3 0 1 2\n");
  RunResult result = RunWellspace({"convert", Path("lake.wkt"), Path("lake.npz"), "--output", "json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  nlohmann::json figures = nlohmann::json::parse(result.out);
  EXPECT_EQ(figures["kind"], "domain");
  EXPECT_EQ(figures["segments"], 3);
  EXPECT_EQ(formats::ReadCloud(Path("lake.npz"))->size(), 3);
  result = RunWellspace({"convert", Path("part.off"), Path("part.npz"), "--triangles", "--output", "json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  figures = nlohmann::json::parse(result.out);
  EXPECT_EQ(figures["kind"], "surface");
  EXPECT_EQ(figures["triangles"], 1);
  const int files = folder_.FileCount();
  for (const auto& [arguments, message] :
       {std::pair(std::vector<std::string>{"lake.wkt", "lake.vtu"},
                  "IN is a domain, which .npz has as arrays; expected a file of npz, or `wellspace mesh`"),
        {{"lake.wkt", "other.npz", "--order", "2"}, "--order is for meshes, and IN is a domain"},
        {{"part.off", "part.vtu", "--triangles"}, "IN is a surface, which .npz has as arrays"},
        {{"part.off", "other.npz", "--triangles", "--skip-invalid"}, "--skip-invalid are for points"},
        {{"part.off", "other.npz", "--faces", "holes"}, "--faces"}}) {
    std::vector<std::string> all = {"convert", Path(arguments[0]), Path(arguments[1])};
    all.insert(all.end(), arguments.begin() + 2, arguments.end());
    const RunResult refused = RunWellspace(all);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr(message));
  }
  EXPECT_EQ(folder_.FileCount(), files);
}

// Two squares with one region, or one each, whose numbers are those of markers, too.
std::string PolyWithRegions(int left, int right) {
  return "6 2 0 0\n1 0 0\n2 1 0\n3 2 0\n4 2 1\n5 1 1\n6 0 1\n7 1\n1 1 2 1\n2 2 3 1\n3 3 4 2\n4 4 5 3\n5 5 6 3\n6 6 1 "
         "4\n"
         "7 2 5 9\n0\n2\n1 .5 .5 " +
         std::to_string(left) + " -1\n2 1.5 .5 " + std::to_string(right) + " -1\n";
}

TEST_F(FileCommandsTest, RegionsKeepTheirNumbersFromFormatToFormat) {
  for (const std::vector<int>& numbers : {std::vector{7, 7}, std::vector{1, 2}}) {
    folder_.Write("a.poly", PolyWithRegions(numbers[0], numbers[1]));
    ASSERT_EQ(RunWellspace({"mesh", Path("a.poly"), "-o", Path("a.msh"), "--quiet"}).exit_code, 0);
    std::string from = "a.msh";
    for (const char* to : {"b.mesh", "b.vtu", "b.vtk", "b.npz", "b.node", "b.msh"}) {
      SCOPED_TRACE(to);
      const RunResult result = RunWellspace({"convert", Path(from), Path(to)});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(result.err, "");
      const nlohmann::json info = Info(to);
      ASSERT_EQ(info["regions"].size(), numbers[0] == numbers[1] ? 1 : 2);
      uint64_t simplices = 0;
      for (size_t i = 0; i < info["regions"].size(); ++i) {
        EXPECT_EQ(info["regions"][i]["id"], numbers[i]);
        EXPECT_EQ(info["regions"][i]["name"], "region_" + std::to_string(numbers[i]));
        simplices += info["regions"][i]["simplices"].get<uint64_t>();
      }
      EXPECT_EQ(info["simplices"], simplices);
      ASSERT_EQ(info["boundary"].size(), 5);
      EXPECT_EQ(info["boundary"][0]["name"], "marker_1");
      EXPECT_EQ(info["boundary"][4]["tag"], 9);
      from = to;
    }
  }
}

// No simplex is lost without a word.
TEST_F(FileCommandsTest, ConvertReadsMeshesOfVtkOrTellsWhatItLeavesOut) {
  const std::string start =
      "# vtk DataFile Version 3.0\ns\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n"
      "1 0 0\n1 1 0\n0 1 0\n";
  folder_.Write("a.vtk", start +
                             "CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5\n5\nCELL_DATA 2\nSCALARS region int 1\n"
                             "LOOKUP_TABLE default\n3\n4\n");
  const RunResult triangles = RunWellspace({"convert", Path("a.vtk"), Path("a.msh")});
  EXPECT_EQ(triangles.exit_code, 0);
  EXPECT_EQ(triangles.err, "");
  const nlohmann::json info = Info("a.msh");
  EXPECT_EQ(info["dimension"], 2);
  EXPECT_EQ(info["simplices"], 2);
  EXPECT_EQ(info["regions"][1]["id"], 4);
  folder_.Write("b.vtk", start + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n9\n");
  const RunResult quads = RunWellspace({"convert", Path("b.vtk"), Path("b.vtu")});
  EXPECT_EQ(quads.exit_code, 0);
  EXPECT_THAT(quads.err, HasSubstr("note: only points are read, since it is no mesh of simplices"));
  const RunResult json = RunWellspace({"convert", Path("b.vtk"), Path("b.vtu"), "--output", "json"});
  EXPECT_EQ(nlohmann::json::parse(json.out)["notes"].size(), 3);  // also that they are in the plane
  // Attributes that the other format has no place for.
  Mesh(kMeasured, "measured.vtu");
  const RunResult su2 = RunWellspace({"convert", Path("measured.vtu"), Path("measured.msh")});
  EXPECT_THAT(su2.err,
              HasSubstr("note: the format has no place for attributes of vertices, which are left out: id, heat"));
}

TEST_F(FileCommandsTest, ConvertMakesVerticesOfPoints) {
  folder_.Write("a.csv", kMeasured);
  const RunResult result = RunWellspace({"convert", Path("a.csv"), Path("a.vtu"), "--output", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out)["vertices"], 6);
  EXPECT_EQ(nlohmann::json::parse(result.out)["kind"], "cloud");
  const absl::StatusOr<formats::PointCloud> cloud = formats::ReadCloud(Path("a.vtu"), {.keep_attributes = true});
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->attributes[1], (formats::Attribute{"id", {7, 8, 9, 10, 11, 12}}));
  ASSERT_EQ(RunWellspace({"convert", Path("a.csv"), Path("b.vtu"), "--no-attributes"}).exit_code, 0);
  EXPECT_THAT(folder_.Read("b.vtu"), Not(HasSubstr("\"id\"")));
}

// A mesh of the plane is a file of points of the plane, whatever its format is, for each command that takes points.
TEST_F(FileCommandsTest, MeshesAreInputsOfPoints) {
  Mesh(kPlane, "a.vtu", {"--size", "0.3"});
  const absl::StatusOr<formats::Mesh> first = formats::ReadMesh(Path("a.vtu"));
  ASSERT_TRUE(first.ok());
  for (const char* name : {"a.vtu", "b.vtk", "b.msh", "b.mesh", "b.npz", "b.node"}) {
    SCOPED_TRACE(name);
    if (name[0] == 'b') {
      ASSERT_EQ(RunWellspace({"convert", Path("a.vtu"), Path(name)}).exit_code, 0);
    }
    const RunResult meshed = RunWellspace({"mesh", Path(name), "-o", Path("out.npz"), "--margin", "0.1"});
    ASSERT_EQ(meshed.exit_code, 0) << meshed.err;
    const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(Path("out.npz"));
    ASSERT_TRUE(mesh.ok());
    ASSERT_EQ(mesh->dimension, 2);
    ASSERT_GE(mesh->points.size(), first->points.size());
    EXPECT_TRUE(std::equal(first->points.begin(), first->points.end(), mesh->points.begin()));
    const RunResult check = RunWellspace({"check", Path("out.npz"), "--cloud", Path(name)});
    EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
    EXPECT_EQ(RunWellspace({"estimate", Path(name)}).exit_code, 0);
  }
  folder_.Write("quads.msh",
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n"
                "$Elements\n1\n1 3 2 0 1 1 2 3 4\n$EndElements\n");
  EXPECT_EQ(RunWellspace({"mesh", Path("quads.msh"), "-o", Path("out.vtu")}).exit_code, 0);
  const RunResult info = RunWellspace({"info", Path("quads.msh")});
  EXPECT_EQ(info.exit_code, 2);
  EXPECT_THAT(info.err, HasSubstr("got type 3; --input-format msh reads the points alone"));
  EXPECT_EQ(Info("quads.msh", {"--input-format", "msh"})["points"], 4);
}

TEST_F(FileCommandsTest, InfoOfAMesh) {
  Mesh(kMeasured, "a.msh");
  const nlohmann::json info = Info("a.msh");
  EXPECT_EQ(info["kind"], "mesh");
  EXPECT_EQ(info["format"], "msh");
  EXPECT_EQ(info["dimension"], 2);
  const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(Path("a.msh"));
  EXPECT_EQ(info["vertices"], mesh->points.size() / 2);
  EXPECT_EQ(info["simplices"], mesh->simplices.size() / 3);
  ASSERT_EQ(info["boundary"].size(), 4);
  EXPECT_EQ(info["boundary"][0]["name"], "xmin");
  EXPECT_EQ(info["boundary"][0]["facets"], mesh->boundary[0].facets);
  const nlohmann::json check = nlohmann::json::parse(RunWellspace({"check", Path("a.msh"), "--output", "json"}).out);
  EXPECT_EQ(info["quality"]["min_angle_deg"], check["min_angle_deg"]);
  EXPECT_EQ(info["quality"]["max_radius_edge"], check["max_radius_edge"]);
  EXPECT_LT(info["low"][0], 0);
  EXPECT_GT(info["high"][1], 0.9);
  const RunResult text = RunWellspace({"info", Path("a.msh")});
  EXPECT_THAT(text.out, HasSubstr("kind                 mesh, msh, 2-D\n"));
  EXPECT_THAT(text.out, HasSubstr("boundary             4 ymax: "));
}

TEST_F(FileCommandsTest, InfoOfACloud) {
  folder_.Write("a.csv", kMeasured);
  const nlohmann::json info = Info("a.csv");
  EXPECT_EQ(info["kind"], "cloud");
  EXPECT_EQ(info["format"], "csv");
  EXPECT_EQ(info["points"], 6);
  EXPECT_EQ(info["low"], nlohmann::json::parse("[0.0, 0.0]"));
  EXPECT_EQ(info["high"], nlohmann::json::parse("[1.0, 0.9]"));
  EXPECT_EQ(info["attributes"], nlohmann::json::parse(R"([{"name": "id", "min": 7.0, "max": 12.0, "missing": 0},
                                      {"name": "heat", "min": -1e300, "max": 4.0, "missing": 1}])"));
  EXPECT_EQ(Info("a.csv", {"--columns", "id,heat", "--skip-invalid"})["points"], 5);
  EXPECT_THAT(RunWellspace({"info", Path("a.csv")}).out, HasSubstr("attribute            id: 7 to 12\n"));
  folder_.Write("b.node", "1 2 0 0\n0 1 2\n");  // without .ele it is a cloud
  EXPECT_EQ(Info("b.node")["kind"], "cloud");
  EXPECT_EQ(RunWellspace({"info", Path("none.csv")}).exit_code, 2);
}

}  // namespace
}  // namespace wellspace
