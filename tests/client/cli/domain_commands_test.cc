// Domains in the plane from the outside: files in, meshes out, errors with their places.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/formats/read_mesh.h"
#include "tests/client/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace wellspace {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A square with a square hole, and a marker each.
constexpr char kFrame[] =
    "8 2 0 0\n1 0 0\n2 4 0\n3 4 4\n4 0 4\n5 1 1\n6 3 1\n7 3 3\n8 1 3\n"
    "8 1\n1 1 2 5\n2 2 3 5\n3 3 4 5\n4 4 1 5\n5 5 6 9\n6 6 7 9\n7 7 8 9\n8 8 5 9\n"
    "1\n1 2 2\n";

class DomainCommandsTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.Path(name); }

  // Meshes `text`, a file `name`; the mesh is out.msh, and the figures are returned.
  nlohmann::json Mesh(const std::string& name, std::string_view text, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"mesh",    folder_.Write(name, text), "-o", Path("out.msh"),
                                          "--stats", Path("stats.json")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? nlohmann::json::parse(folder_.Read("stats.json")) : nlohmann::json();
  }

  std::string MeshFails(const std::string& name, std::string_view text, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"mesh", folder_.Write(name, text), "-o", Path("out.msh")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult result = RunWellspace(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  }

  void ExpectValid(const std::string& domain) {
    const RunResult result =
        RunWellspace({"check", Path("out.msh"), "--cloud", Path(domain), "--rho", "1.4142135623730951"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("valid"));
  }

  TemporaryFolder folder_;
};

// Of all triangles, or of those of a region.
double AreaOf(const formats::Mesh& mesh, int32_t region = 0) {
  double area = 0;
  for (size_t t = 0; t < mesh.simplices.size(); t += 3) {
    if (region != 0 && mesh.simplex_regions.at(t / 3) != region) {
      continue;
    }
    const double* const a = &mesh.points[2 * mesh.simplices[t]];
    const double* const b = &mesh.points[2 * mesh.simplices[t + 1]];
    const double* const c = &mesh.points[2 * mesh.simplices[t + 2]];
    area += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
  }
  return area;
}

TEST_F(DomainCommandsTest, CheckHoldsADomainToAllThatIsAsked) {
  Mesh("frame.poly", kFrame, {"--size", "0.5", "--min-angle", "20"});
  const auto check = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"check", Path("out.msh")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunWellspace(arguments);
  };
  EXPECT_EQ(check({"--size", "0.5", "--min-dihedral", "20"}).exit_code, 0);
  const RunResult size = check({"--size", "0.01"});
  EXPECT_EQ(size.exit_code, 1);
  EXPECT_THAT(size.out, HasSubstr("violation"));
  EXPECT_THAT(size.out, HasSubstr("circumradius"));
  EXPECT_EQ(check({"--size-box", "0,0,4,4,0.01"}).exit_code, 1);
  EXPECT_EQ(check({"--size-field", folder_.Write("sizes.csv", "x,y,h\n0.5,0.5,0.01\n")}).exit_code, 1);
  const RunResult angle = check({"--min-dihedral", "59"});
  EXPECT_EQ(angle.exit_code, 1);
  EXPECT_THAT(angle.out, HasSubstr("smallest angle"));
  const std::string cloud = folder_.Write("cloud.csv", "0,0\n");
  EXPECT_EQ(check({"--rho", "2", "--criterion", "well-spaced"}).exit_code, 2);
  EXPECT_EQ(check({"--cloud", cloud}).exit_code, 2);
}

TEST_F(DomainCommandsTest, PolyWithAHoleAndMarkers) {
  const nlohmann::json stats = Mesh("frame.poly", kFrame, {"--size", "0.5"});
  ExpectValid("frame.poly");
  EXPECT_EQ(stats["domain"]["segments"], 8);
  EXPECT_EQ(stats["domain"]["exempt_simplices"], 0);
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh), 12, 1e-12);
  ASSERT_EQ(mesh->boundary.size(), 2u);
  EXPECT_THAT((std::vector<int32_t>{mesh->boundary[0].tag, mesh->boundary[1].tag}), ElementsAre(5, 9));
  EXPECT_EQ(mesh->boundary[1].name, "marker_9");
}

TEST_F(DomainCommandsTest, PartsHaveTheNamesThatAreGiven) {
  Mesh("frame.poly", kFrame, {"--names", "9=the hole", "--names", "5=wall", "--region-names", "1=steel"});
  ExpectValid("frame.poly");
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->boundary.size(), 2u);
  EXPECT_EQ(mesh->boundary[0].name, "wall");
  EXPECT_EQ(mesh->boundary[1].name, "the hole");
  ASSERT_EQ(mesh->regions.size(), 1u);
  EXPECT_EQ(mesh->regions[0].name, "steel");

  for (const auto& [option, value, message] : {std::tuple("--names", "inlet", "expected NUMBER=NAME"),
                                               {"--names", "9999999999=a", "expected NUMBER=NAME"},
                                               {"--names", "5=", "names.markers[5]: expected a name"},
                                               {"--region-names", "5=domain", "names.regions[5]"}}) {
    EXPECT_THAT(MeshFails("frame.poly", kFrame, {option, value}), HasSubstr(message));
  }
  EXPECT_THAT(MeshFails("frame.poly", kFrame, {"--names", "5=a", "--names", "5=b"}), HasSubstr("5 has a name already"));
  EXPECT_THAT(MeshFails("cloud.csv", "0,0\n1,0\n0,1\n", {"--names", "5=a"}), HasSubstr("--names: IN has points alone"));
}

TEST_F(DomainCommandsTest, GeoJsonHasIslandsInLakes) {
  const auto square = [](double low, double high) {
    return absl::StrFormat("[[%g,%g],[%g,%g],[%g,%g],[%g,%g],[%g,%g]]", low, low, high, low, high, high, low, high, low,
                           low);
  };
  Mesh("lakes.geojson", absl::StrCat(R"({"type":"MultiPolygon","coordinates":[[)", square(0, 9), ",", square(1, 8),
                                     "],[", square(2, 7), "]]}"));
  ExpectValid("lakes.geojson");
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh), 81 - 49 + 25, 1e-10);
}

// A feature with a square, and with a property r if it is above 0.
std::string SquareFeature(double x0, double y0, double x1, double y1, int r = 0) {
  return absl::StrFormat(R"({"type": "Feature", "properties": {%s}, "geometry": {"type": "Polygon",)"
                         R"( "coordinates": [[[%g,%g],[%g,%g],[%g,%g],[%g,%g],[%g,%g]]]}})",
                         r > 0 ? absl::StrFormat("\"r\": %d", r) : "", x0, y0, x1, y0, x1, y1, x0, y1, x0, y0);
}

std::string FeaturesText(const std::vector<std::string>& features) {
  return absl::StrCat(R"({"type": "FeatureCollection", "features": [)", absl::StrJoin(features, ","), "]}");
}

// The same rings in another format are the same domain.
TEST_F(DomainCommandsTest, OtherFormatsOfRingsMakeTheMeshOfGeoJson) {
  const std::string polygon = R"({"type":"Polygon","coordinates":[[[0,0],[9,0],[9,9],[0,9],[0,0]],)"
                              R"([[3,3],[6,3],[6,6],[3,6],[3,3]]]})";
  const std::string json = folder_.Write("a.geojson", polygon);
  ASSERT_EQ(RunWellspace({"mesh", json, "-o", Path("json.npz"), "--size", "1"}).exit_code, 0);
  folder_.Write("a.ndjson", polygon + "\n");
  folder_.Write("a.wkt", "POLYGON((0 0,9 0,9 9,0 9,0 0),(3 3,6 3,6 6,3 6,3 3))\n");
  for (const char* name : {"a.ndjson", "a.wkt"}) {
    SCOPED_TRACE(name);
    const RunResult result = RunWellspace({"mesh", Path(name), "-o", Path("other.npz"), "--size", "1"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(folder_.Read("other.npz"), folder_.Read("json.npz"));
    const RunResult check = RunWellspace({"check", Path("json.npz"), "--cloud", Path(name)});
    EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  }
  EXPECT_EQ(RunWellspace({"mesh", "-", "--input-format", "wkt", "-o", Path("in.npz"), "--size", "1"},
                         {.input = folder_.Read("a.wkt"), .environment = {}})
                .exit_code,
            0);
}

// A grid of ADCIRC's to another one: the boundaries are the domain.
TEST_F(DomainCommandsTest, AGridIsMeshedAnew) {
  folder_.Write("a.wkt", "POLYGON((0 0,9 0,9 9,0 9,0 0),(3 3,6 3,6 6,3 6,3 3))\n");
  ASSERT_EQ(RunWellspace({"mesh", Path("a.wkt"), "-o", Path("a.14")}).exit_code, 0);
  const RunResult finer = RunWellspace({"mesh", Path("a.14"), "--segments", "--size", "0.5", "-o", Path("b.14")});
  ASSERT_EQ(finer.exit_code, 0) << finer.err;
  const RunResult check = RunWellspace({"check", Path("b.14"), "--cloud", Path("a.14"), "--segments", "--size", "0.5"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  // Without --segments it has points.
  ASSERT_EQ(RunWellspace({"mesh", Path("a.14"), "-o", Path("box.14")}).exit_code, 0);
  EXPECT_THAT(RunWellspace({"info", Path("box.14")}).out, HasSubstr("boundary             4 ymax"));
}

TEST_F(DomainCommandsTest, CheckTakesEachStretchOfASegmentByItself) {
  Mesh("notch.geojson", R"({"type": "Polygon", "coordinates":
      [[[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]], [[0, 1], [3, 2], [0, 3], [0, 1]]]})");
  ExpectValid("notch.geojson");
  Mesh("zone.geojson", FeaturesText({SquareFeature(0, 0, 10, 10), SquareFeature(0, 1, 3, 4)}));
  ExpectValid("zone.geojson");
}

TEST_F(DomainCommandsTest, FeaturesAreUnited) {
  // A zone in a city, one on its border, and one feature that fills the hole of another.
  Mesh("zone.geojson", FeaturesText({SquareFeature(0, 0, 10, 10), SquareFeature(3, 3, 6, 6)}));
  ExpectValid("zone.geojson");
  EXPECT_NEAR(AreaOf(*formats::ReadMesh(Path("out.msh"))), 100, 1e-9);
  Mesh("zone.geojson", FeaturesText({SquareFeature(0, 0, 10, 10), SquareFeature(0, 1, 3, 4)}));
  ExpectValid("zone.geojson");
  EXPECT_NEAR(AreaOf(*formats::ReadMesh(Path("out.msh"))), 100, 1e-9);
  // Features that cross, and a region each: the smaller one has the common part.
  const std::string text = FeaturesText({SquareFeature(0, 0, 10, 10, 1), SquareFeature(8, 8, 12, 12, 2)});
  Mesh("cross.geojson", text, {"--split-crossings", "--region-property", "r"});
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh, 1), 96, 1e-9);
  EXPECT_NEAR(AreaOf(*mesh, 2), 16, 1e-9);
  const RunResult check =
      RunWellspace({"check", Path("out.msh"), "--cloud", Path("cross.geojson"), "--region-property", "r"});
  EXPECT_EQ(check.exit_code, 0) << check.out;
  // Within a feature rings turn inside to outside, and over all of them if that is asked for.
  Mesh("parts.geojson", R"({"type": "Feature", "properties": {}, "geometry": {"type": "MultiPolygon", "coordinates":
      [[[[0,0],[9,0],[9,9],[0,9]]], [[[1,1],[2,1],[2,2],[1,2]]]]}})");
  EXPECT_NEAR(AreaOf(*formats::ReadMesh(Path("out.msh"))), 80, 1e-9);
  Mesh("cross.geojson", text, {"--split-crossings", "--faces", "even-odd"});
  EXPECT_NEAR(AreaOf(*formats::ReadMesh(Path("out.msh"))), 100 + 16 - 8, 1e-9);
}

TEST_F(DomainCommandsTest, CheckKnowsTheFaces) {
  const std::string text = FeaturesText({SquareFeature(0, 0, 10, 10, 1), SquareFeature(3, 3, 6, 6, 2)});
  Mesh("zone.geojson", text, {"--faces", "holes"});
  const auto check = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"check", Path("out.msh"), "--cloud", Path("zone.geojson")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunWellspace(arguments);
  };
  EXPECT_EQ(check({"--faces", "holes"}).exit_code, 0);
  EXPECT_EQ(check({}).exit_code, 0);
  const RunResult even_odd = check({"--faces", "even-odd"});
  EXPECT_EQ(even_odd.exit_code, 1);
  EXPECT_THAT(even_odd.out, HasSubstr("an even number of rings surrounds it"));
  // Regions, too, if it is told where they are.
  EXPECT_THAT(check({"--faces", "holes", "--region-property", "r"}).out, HasSubstr("the mesh has no regions"));
  Mesh("zone.geojson", text, {"--faces", "holes", "--region-property", "r"});
  EXPECT_EQ(check({"--faces", "holes", "--region-property", "r"}).exit_code, 0);
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh, 1), 91, 1e-9);
  EXPECT_NEAR(AreaOf(*mesh, 2), 9, 1e-9);
  folder_.Write("zone.geojson", FeaturesText({SquareFeature(0, 0, 10, 10, 2), SquareFeature(3, 3, 6, 6, 1)}));
  const RunResult other = check({"--faces", "holes", "--region-property", "r"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.out, AllOf(HasSubstr("its region is"), HasSubstr("zone.geojson:1: features[")));
}

TEST_F(DomainCommandsTest, CheckFindsWhatIsMissing) {
  const std::string two = FeaturesText({SquareFeature(0, 0, 1, 1), SquareFeature(2, 0, 3, 1)});
  Mesh("one.geojson", FeaturesText({SquareFeature(0, 0, 1, 1)}));
  const RunResult missing = RunWellspace({"check", Path("out.msh"), "--cloud", folder_.Write("two.geojson", two)});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.out, AllOf(HasSubstr("has no triangles"), HasSubstr("two.geojson:1: features[1]")));
  const RunResult filled = RunWellspace(
      {"check", Path("out.msh"), "--cloud", folder_.Write("half.geojson", R"({"type": "Polygon", "coordinates":
                        [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], [[0.5, 0.5], [0.75, 0.5], [0.75, 0.75], [0.5, 0.5]]]})")});
  EXPECT_EQ(filled.exit_code, 1);
  EXPECT_THAT(filled.out, HasSubstr("segments[4]"));
}

// A square is no box, though its sides are that of one: the tags of its facets tell.
TEST_F(DomainCommandsTest, ASquareIsCheckedAsADomain) {
  Mesh("square.csv", "x,y\n0,0\n1,0\n1,1\n0,1\n0,0\n", {"--segments", "--faces", "holes"});
  EXPECT_EQ(RunWellspace({"check", Path("out.msh"), "--rho", "2"}).exit_code, 0);
  EXPECT_EQ(RunWellspace({"check", Path("out.msh"), "--cloud", Path("square.csv")}).exit_code, 2);
  EXPECT_EQ(RunWellspace({"check", Path("out.msh"), "--cloud", Path("square.csv"), "--segments", "--faces", "holes"})
                .exit_code,
            0);
  const std::string line = folder_.Write("line.csv", "x,y\n0,0.5\n1,0.5\n");
  const RunResult other =
      RunWellspace({"check", Path("out.msh"), "--cloud", line, "--segments", "--domain", "0,0,1,1"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.out, HasSubstr("segments[0]"));
  const std::string cloud = folder_.Write("cloud.csv", "0,0\n");
  EXPECT_THAT(RunWellspace({"check", Path("out.msh"), "--cloud", cloud, "--faces", "holes"}).err, HasSubstr("--faces"));
}

TEST_F(DomainCommandsTest, APolygonThatARiverCutsIsOneRegion) {
  const std::string river =
      R"({"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": [[3, 0], [3, 10]]}})";
  Mesh("river.geojson", FeaturesText({SquareFeature(0, 0, 10, 10, 7), river, SquareFeature(10, 0, 20, 10, 8)}),
       {"--region-property", "r"});
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh, 7), 100, 1e-9);
  EXPECT_NEAR(AreaOf(*mesh, 8), 100, 1e-9);
  EXPECT_EQ(
      RunWellspace({"check", Path("out.msh"), "--cloud", Path("river.geojson"), "--region-property", "r"}).exit_code,
      0);
}

TEST_F(DomainCommandsTest, PolylinesInABox) {
  const nlohmann::json stats =
      Mesh("lines.csv", "x,y\n0.1,0.1\n0.9,0.8\n\n0.1,0.7\n0.5,0.9\n", {"--segments", "--domain", "0,0,1,1"});
  EXPECT_EQ(stats["domain"]["segments"], 6);
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh), 1, 1e-14);
  EXPECT_EQ(mesh->boundary.size(), 5u);  // the sides of the box, and segments without a marker
}

TEST_F(DomainCommandsTest, CrossingsAreNamedByTheirLines) {
  constexpr char kCross[] = "4 2 0 0\n1 0 0\n2 2 2\n3 0 2\n4 2 0\n4 0\n1 1 2\n2 3 4\n3 1 3\n4 2 4\n";
  EXPECT_THAT(MeshFails("cross.poly", kCross),
              AllOf(HasSubstr("segments[0]"), HasSubstr("cross.poly:7"), HasSubstr("cross.poly:8"), HasSubstr("(1, 1)"),
                    HasSubstr("or be split there by --split-crossings")));
  const nlohmann::json stats = Mesh("cross.poly", kCross, {"--split-crossings"});
  EXPECT_EQ(stats["domain"]["crossings"], 1);
}

TEST_F(DomainCommandsTest, PointsTooNearToASegmentAreSnappedTo) {
  // The last point is 1e-17 above the middle of the first segment, and a part of the hole's ring.
  const std::string near =
      "7 2 0 0\n1 0 0\n2 2 0\n3 2 2\n4 0 2\n5 0.5 0.5\n6 1.5 0.5\n7 1 1e-17\n"
      "7 0\n1 1 2\n2 2 3\n3 3 4\n4 4 1\n5 5 6\n6 6 7\n7 7 5\n1\n1 1 0.3\n";
  EXPECT_THAT(MeshFails("near.poly", near),
              AllOf(HasSubstr("segments[0]"), HasSubstr("or have the segment led through it by --snap")));
  EXPECT_THAT(MeshFails("near.poly", near, {"--snap", "none"}), HasSubstr("segments[0]"));
  const nlohmann::json stats = Mesh("near.poly", near, {"--snap"});
  EXPECT_EQ(stats["domain"]["near_points"], 1);
  EXPECT_EQ(stats["domain"]["crossings"], 0);
  constexpr char kCross[] = "4 2 0 0\n1 0 0\n2 2 2\n3 0 2\n4 2 0\n4 0\n1 1 2\n2 3 4\n3 1 3\n4 2 4\n";
  EXPECT_THAT(MeshFails("cross.poly", kCross, {"--snap"}), HasSubstr("cross at (1, 1)"));
}

TEST_F(DomainCommandsTest, SegmentsAreSnappedAndPointsMergedAcrossAGap) {
  // Two wards whose border was drawn twice, 0.001 apart, with a corner more on one side.
  const std::string wards = R"({"type": "FeatureCollection", "features": [
      {"type": "Feature", "properties": {"r": 1}, "geometry": {"type": "Polygon", "coordinates":
          [[[0, 0], [5, 0], [5, 10], [0, 10]]]}},
      {"type": "Feature", "properties": {"r": 2}, "geometry": {"type": "Polygon", "coordinates":
          [[[5.001, 0], [10, 0], [10, 10], [5.001, 10], [5.0004, 4]]]}}]})";
  const nlohmann::json apart = Mesh("wards.geojson", wards, {"--min-angle", "20"});
  EXPECT_EQ(apart["merged_points"], 0);
  for (const std::vector<std::string>& lengths : std::vector<std::vector<std::string>>{
           {"--merge", "0.01", "--snap", "0.01"}, {"--merge", "0.1%", "--snap", "0.1%"}}) {
    std::vector<std::string> options = lengths;
    options.insert(options.end(), {"--region-property", "r"});
    const nlohmann::json stats = Mesh("wards.geojson", wards, options);
    EXPECT_EQ(stats["merged_points"], 2);
    EXPECT_EQ(stats["domain"]["near_points"], 1);
    EXPECT_LT(stats["vertices"], 200);
    const auto mesh = formats::ReadMesh(Path("out.msh"));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_NEAR(AreaOf(*mesh), 100, 1e-9);
    EXPECT_NEAR(AreaOf(*mesh, 1), 50 + 0.5 * 10 * 0.0004, 1e-9);
    std::vector<std::string> check = {"check", Path("out.msh"), "--cloud", Path("wards.geojson")};
    check.insert(check.end(), options.begin(), options.end());
    const RunResult result = RunWellspace(check);
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_EQ(RunWellspace({"check", Path("out.msh"), "--cloud", Path("wards.geojson")}).exit_code, 1);
  }
  EXPECT_THAT(MeshFails("wards.geojson", wards, {"--snap=-1"}), HasSubstr("--snap"));
  EXPECT_THAT(MeshFails("wards.geojson", wards, {"--merge", "101%"}), HasSubstr("0.1%"));
}

TEST_F(DomainCommandsTest, CornersThatDoublesCannotServeAreOne) {
  // The second triangle has a corner that is that of the first but for its last bit.
  const std::string twins = FeaturesText({R"({"type": "Feature", "properties": {}, "geometry": {"type": "Polygon",
           "coordinates": [[[0, 0], [0.3, 0], [0.3, 0.3]]]}})",
                                          R"({"type": "Feature", "properties": {}, "geometry": {"type": "Polygon",
           "coordinates": [[[0.30000000000000004, 0.3], [0.6, 0.3], [0.6, 0.6]]]}})"});
  const nlohmann::json stats = Mesh("twins.geojson", twins);
  EXPECT_EQ(stats["merged_points"], 1);
  EXPECT_EQ(stats["vertices"], 5);
  ExpectValid("twins.geojson");
}

TEST_F(DomainCommandsTest, RegionsOfTrianglesFilesAreLargestAreasAndNumbersOfTheirOwn) {
  const std::string square = "4 2 0 0\n1 0 0\n2 1 0\n3 1 1\n4 0 1\n4 0\n1 1 2\n2 2 3\n3 3 4\n4 4 1\n0\n";
  const nlohmann::json stats = Mesh("area.poly", square + "1\n1 0.5 0.5 0.05\n");
  EXPECT_GE(stats["simplices"], 20);
  EXPECT_THAT(stats["notes"].dump(), AllOf(HasSubstr("as Triangle has it"), HasSubstr("0.05 region 1")));
  ExpectValid("area.poly");
  const std::string halves =
      "6 2 0 0\n1 0 0\n2 1 0\n3 2 0\n4 2 1\n5 1 1\n6 0 1\n7 0\n1 1 2\n2 2 3\n3 3 4\n4 4 5\n5 5 6\n6 6 1\n7 2 5\n0\n";
  Mesh("halves.poly", halves + "2\n1 0.5 0.5 1 -1\n2 1.5 0.5 0.25 -1\n");
  const auto mesh = formats::ReadMesh(Path("out.msh"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(AreaOf(*mesh, 1), 1, 1e-12);
  EXPECT_NEAR(AreaOf(*mesh, 2), 1, 1e-12);
  ExpectValid("halves.poly");
}

TEST_F(DomainCommandsTest, SeedsOutsideAreTold) {
  const std::string square = "4 2 0 0\n1 0 0\n2 1 0\n3 1 1\n4 0 1\n4 0\n1 1 2\n2 2 3\n3 3 4\n4 4 1\n";
  const nlohmann::json stats = Mesh("out.poly", square + "1\n1 5 5\n2\n1 0.5 0.5 1 -1\n2 7 7 2 -1\n");
  EXPECT_EQ(stats["domain"]["unused_seeds"], 2);
  EXPECT_THAT(stats["notes"].dump(), AllOf(HasSubstr("out.poly:12: the hole at (5, 5) lies outside of what is meshed"),
                                           HasSubstr("so does 1 other")));
  EXPECT_EQ(Mesh("in.poly", square + "0\n")["domain"]["unused_seeds"], 0);
}

TEST_F(DomainCommandsTest, WhatEnclosesNothingSaysSo) {
  EXPECT_THAT(MeshFails("open.poly", "3 2 0 0\n1 0 0\n2 1 0\n3 1 1\n2 0\n1 1 2\n2 2 3\n"),
              HasSubstr("enclose nothing"));
}

TEST_F(DomainCommandsTest, OptionsOfDomainsWantADomain) {
  EXPECT_THAT(MeshFails("cloud.csv", "0,0\n1,0\n0,1\n", {"--faces", "holes"}), HasSubstr("--faces"));
  EXPECT_THAT(MeshFails("cloud.csv", "0,0\n1,0\n0,1\n", {"--split-crossings"}), HasSubstr("--split-crossings"));
  EXPECT_THAT(MeshFails("cloud.csv", "0,0\n1,0\n0,1\n", {"--snap"}), HasSubstr("--snap"));
}

TEST_F(DomainCommandsTest, CheckKnowsWhatWasRefusedAtSmallAngles) {
  // A zigzag with angles of a degree, at which a bound of 30 degrees cannot be kept everywhere.
  std::string zigzag = "25 2 0 0\n";
  for (int i = 0; i < 25; ++i) {
    absl::StrAppend(&zigzag, i, " ", i * 0.00872686779075879, " ", i % 2, "\n");
  }
  absl::StrAppend(&zigzag, "24 0\n");
  for (int i = 0; i < 24; ++i) {
    absl::StrAppend(&zigzag, i, " ", i, " ", i + 1, "\n");
  }
  Mesh("zigzag.poly", zigzag + "0\n", {"--min-angle", "30", "--faces", "box"});
  const RunResult kept = RunWellspace(
      {"check", Path("out.msh"), "--cloud", Path("zigzag.poly"), "--faces", "box", "--rho", "1.0000000001"});
  EXPECT_EQ(kept.exit_code, 0) << kept.out << kept.err;
  const RunResult broken =
      RunWellspace({"check", Path("out.msh"), "--cloud", Path("zigzag.poly"), "--faces", "box", "--rho", "0.7"});
  EXPECT_EQ(broken.exit_code, 1) << "what is exempt is not everything";
}

TEST_F(DomainCommandsTest, MinAngleIsABoundOfRho) {
  const nlohmann::json stats = Mesh("frame.poly", kFrame, {"--min-angle", "28"});
  EXPECT_GE(stats["min_angle_deg"], 28 * (1 - 1e-9));
  EXPECT_THAT(MeshFails("space.csv", "0,0,0\n1,0,0\n0,1,0\n0,0,1\n", {"--min-angle", "20"}), HasSubstr("--min-angle"));
}

TEST_F(DomainCommandsTest, CheckFindsAMeshOfAnotherDomain) {
  Mesh("frame.poly", kFrame);
  std::string moved = kFrame;
  moved.replace(moved.find("1 2 2\n"), 6, "1 0.5 0.5\n");  // the hole is elsewhere
  folder_.Write("moved.poly", moved);
  const RunResult result = RunWellspace({"check", Path("out.msh"), "--cloud", Path("moved.poly")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, AllOf(HasSubstr("seeds[0] ("), HasSubstr("moved.poly:"), HasSubstr("), a hole")));
}

TEST_F(DomainCommandsTest, EstimateTakesADomain) {
  const RunResult result = RunWellspace({"estimate", folder_.Write("frame.poly", kFrame)});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

}  // namespace
}  // namespace wellspace
