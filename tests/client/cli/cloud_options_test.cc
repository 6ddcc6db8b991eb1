// Options of the commands that read clouds: --columns, --skip-invalid, and the messages about them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/formats/read_mesh.h"
#include "tests/client/cli/process.h"
#include "tests/client/cli/session_fixture.h"

namespace wellspace {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kCities[] = "id,lat,lon\n0,0.1,10\n1,0.9,11\n2,0.2,11\n3,0.8,10.2\n";
constexpr char kHoles[] = "x,y,z\n0,0,0\n1,0,0\nNA,NA,NA\n0,1,0\n0,0,1\nnan,0,0\n";

class CloudOptionsTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.Path(name); }

  std::vector<double> PointsOf(const std::string& mesh_path, size_t coordinates) {
    const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(mesh_path);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? std::vector<double>(mesh->points.begin(), mesh->points.begin() + coordinates)
                     : std::vector<double>();
  }

  TemporaryFolder folder_;
};

TEST_F(CloudOptionsTest, MeshTakesNamedColumnsAndSaysSo) {
  const std::string cloud = folder_.Write("cities.csv", kCities);
  const RunResult mesh = RunWellspace({"mesh", cloud, "-o", Path("a.node")});
  ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_THAT(mesh.err, HasSubstr("wellspace: note: " + cloud +
                                  ": columns 3 \"lon\", 2 \"lat\" are taken as coordinates, and "
                                  "column 1 \"id\" is not"));
  EXPECT_THAT(PointsOf(Path("a.node"), 4), ElementsAre(10, 0.1, 11, 0.9));
  EXPECT_EQ(RunWellspace({"check", Path("a.node"), "--cloud", cloud}).exit_code, 0);
  EXPECT_THAT(RunWellspace({"mesh", cloud, "-o", Path("b.node"), "--quiet"}).err, IsEmpty());

  const RunResult as_json = RunWellspace({"estimate", cloud, "--output", "json"});
  EXPECT_THAT(as_json.err, IsEmpty());
  EXPECT_EQ(json::parse(as_json.out)["notes"].size(), 1u);
  EXPECT_EQ(json::parse(as_json.out)["dimension"], 2);
}

TEST_F(CloudOptionsTest, MeshTakesTheColumnsThatAreGiven) {
  const std::string cloud = folder_.Write("plane.csv", "x,y,z\n0,0,0\n1,0.1,0\n0.2,1,0\n0.9,0.8,0\n");
  const RunResult refused = RunWellspace({"mesh", cloud, "-o", Path("a.node"), "--dimension", "2"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--columns 1,2"));
  for (const std::string columns : {"1,2", "x,y", "X, Y"}) {
    const RunResult mesh =
        RunWellspace({"mesh", cloud, "-o", Path("a.node"), "--dimension", "2", "--columns", columns, "--stats", "-"});
    ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
    EXPECT_EQ(json::parse(mesh.out)["input_points"], 4);
    EXPECT_THAT(PointsOf(Path("a.node"), 4), ElementsAre(0, 0, 1, 0.1));
    EXPECT_EQ(RunWellspace({"check", Path("a.node"), "--cloud", cloud, "--columns", columns}).exit_code, 0);
  }
  for (const std::string columns : {"", "1,,2", "1", "1,1", "1,9", "1,w"}) {
    const RunResult wrong = RunWellspace({"mesh", cloud, "-o", Path("b.node"), "--columns", columns});
    EXPECT_EQ(wrong.exit_code, 2) << columns;
    EXPECT_THAT(wrong.err, HasSubstr("--columns")) << columns;
  }
  EXPECT_EQ(RunWellspace({"check", Path("a.node"), "--cloud", cloud}).exit_code, 2);
}

TEST_F(CloudOptionsTest, SkippedPointsAreCounted) {
  const std::string cloud = folder_.Write("holes.csv", kHoles);
  const RunResult refused = RunWellspace({"mesh", cloud, "-o", Path("a.node")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("holes.csv:4: field 1: expected a number, got \"NA\"; --skip-invalid"));
  const RunResult mesh =
      RunWellspace({"mesh", cloud, "-o", Path("a.node"), "--skip-invalid", "--quiet", "--stats", Path("stats.json")});
  ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_EQ(mesh.err,
            "wellspace: note: " + cloud + ": 2 points are left out, of which a coordinate is missing or not finite\n");
  std::ifstream file(Path("stats.json"));
  const json figures = json::parse(file);
  EXPECT_EQ(figures["skipped_points"], 2);
  EXPECT_EQ(figures["input_points"], 4);
  const RunResult check =
      RunWellspace({"check", Path("a.node"), "--cloud", cloud, "--skip-invalid", "--output", "json"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_EQ(json::parse(check.out)["skipped_points"], 2);
  const RunResult none = RunWellspace({"estimate", "-", "--skip-invalid", "--output", "json"},
                                      {.input = "1,2\n3,4\n", .environment = {}, .error_descriptor = -1});
  EXPECT_EQ(json::parse(none.out)["skipped_points"], 0);
  EXPECT_FALSE(json::parse(none.out).contains("notes"));
}

TEST_F(CloudOptionsTest, FacesAreNotUsedAndThatIsSaid) {
  const std::string cloud = folder_.Write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
  const RunResult mesh = RunWellspace({"mesh", cloud, "-o", Path("a.node")});
  ASSERT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_THAT(mesh.err, HasSubstr("note: " + cloud + ": 1 face is not used, only the points\n"));
}

TEST_F(CloudOptionsTest, StandardInputIsReadAsFilesAre) {
  const auto mesh = [this](const std::string& input, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"mesh", "-", "-o", Path("a.node")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunWellspace(arguments, {.input = input, .environment = {}, .error_descriptor = -1});
  };
  EXPECT_EQ(mesh(kCities, {}).exit_code, 0);
  EXPECT_THAT(PointsOf(Path("a.node"), 2), ElementsAre(10, 0.1));
  EXPECT_EQ(mesh("4\n0 0 0 7\n1 0 0 7\n0 1 0 7\n0 0 1 7\n", {"--input-format", "pts"}).exit_code, 0);
  EXPECT_EQ(mesh("0 0 9\r1 0 9\r0 1 9\r", {"--columns", "2,1"}).exit_code, 0);
  EXPECT_THAT(PointsOf(Path("a.node"), 4), ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(mesh("0,5;1,5\n1;2\n", {}).err,
              HasSubstr("<stdin>:1: field 1: expected a number, got \"0,5\" (a decimal comma?"));
}

class SessionCloudsTest : public CloudOptionsTest {
 protected:
  SessionCloudsTest() {
    server_.sessions.get = [](const v1::GetSessionRequest&, v1::GetSessionResponse& response) {
      *response.mutable_session() = MakeSession();
      response.mutable_session()->set_committed_points(0);
      return grpc::Status::OK;
    };
    server_.sessions.upload = [this](grpc::ServerContext&, auto& reader, v1::UploadPointsResponse& response) {
      v1::UploadPointsRequest request;
      points_.clear();
      while (reader.Read(&request)) {
        points_.insert(points_.end(), request.points().coordinates().begin(), request.points().coordinates().end());
      }
      response.set_committed_points(points_.size() / 2);
      return grpc::Status::OK;
    };
  }

  RunResult Run(const std::vector<std::string>& arguments, const std::string& input) {
    return RunAt(server_, arguments, input);
  }

  client::FakeServer server_;
  std::vector<double> points_;
};

TEST_F(SessionCloudsTest, Upload) {
  const RunResult text = Run({"upload", "one", "-"}, kCities);
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.err, HasSubstr("note: <stdin>: columns 3 \"lon\", 2 \"lat\""));
  EXPECT_EQ(points_.size(), 8u);
  const RunResult as_json =
      Run({"upload", "one", "-", "--columns", "z,x", "--skip-invalid", "--output", "json"}, kHoles);
  ASSERT_EQ(as_json.exit_code, 0) << as_json.err;
  EXPECT_THAT(points_, ElementsAre(0, 0, 0, 1, 0, 0, 1, 0));
  EXPECT_EQ(json::parse(as_json.out)["skipped_points"], 2);
  EXPECT_THAT(Run({"upload", "one", "-"}, kHoles).err, HasSubstr("--columns 1,2"));
}

TEST_F(SessionCloudsTest, Add) {
  server_.queries.add = [this](const v1::AddVerticesRequest& request, v1::AddVerticesResponse& response) {
    points_.assign(request.points().begin(), request.points().end());
    response.add_vertices(8);
    return grpc::Status::OK;
  };
  const RunResult text = Run({"add", "one", "-", "--columns", "2,1"}, "1,2,3\n4,5,6\n");
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(points_, ElementsAre(2, 1, 5, 4));
  const RunResult skipped = Run({"add", "one", "-", "--skip-invalid"}, "1,2\nnan,4\n");
  EXPECT_THAT(skipped.err, HasSubstr("note: <stdin>: 1 point is left out"));
  EXPECT_THAT(points_, ElementsAre(1, 2));
}

}  // namespace
}  // namespace wellspace
