// Uploads of domains to sessions from the outside, with a server of the test's making.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/cli/process.h"
#include "tests/client/cli/session_fixture.h"

namespace wellspace {
namespace {

using client::MakeError;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kTriangle[] = "3 2 0 0\n1 0 0\n2 9 0\n3 0 9\n3 1\n1 1 2 5\n2 2 3 5\n3 3 1 6\n1\n1 1 1\n";

class DomainUploadTest : public SessionCommandsTest {
 protected:
  DomainUploadTest() {
    server_.sessions.get = [this](const v1::GetSessionRequest&, v1::GetSessionResponse& response) {
      *response.mutable_session() = MakeSession();
      response.mutable_session()->set_segment_count(7);
      response.mutable_session()->set_seed_count(2);
      response.mutable_session()->set_vertex_count(vertices_);
      return grpc::Status::OK;
    };
    server_.sessions.upload = [this](grpc::ServerContext&, auto& reader, v1::UploadPointsResponse& response) {
      v1::UploadPointsRequest request;
      uint64_t end = 0;
      while (reader.Read(&request)) {
        const auto points = static_cast<uint64_t>(request.points().coordinates_size()) / 2;
        first_point_ = points == 0 ? first_point_ : request.point_offset();
        end = std::max(end, request.point_offset() + points);
        expected_.push_back(request.expected_revision());
      }
      response.set_committed_points(std::max<uint64_t>(1237, end));
      response.set_revision(5);
      return grpc::Status::OK;
    };
    server_.sessions.add_segments = [this](grpc::ServerContext&, auto& reader, v1::AddSegmentsResponse& response) {
      v1::AddSegmentsRequest request;
      requests_.clear();
      while (reader.Read(&request)) {
        requests_.push_back(request);
      }
      response.set_segment_count(10);
      response.set_seed_count(3);
      response.set_revision(6);
      return error_;
    };
  }

  uint64_t vertices_ = 0;
  uint64_t first_point_ = 0;
  std::vector<uint64_t> expected_;
  std::vector<v1::AddSegmentsRequest> requests_;
  grpc::Status error_;
};

TEST_F(DomainUploadTest, SegmentsFollowThePoints) {
  const std::string triangle = folder_.Write("triangle.poly", kTriangle);
  const RunResult text = Run({"upload", "one", triangle, "--expected-revision", "2"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out, "sessions/one: 1,237 points, 10 segments, revision 6\n");
  EXPECT_EQ(first_point_, 1234u);
  EXPECT_EQ(expected_.front(), 2u);
  ASSERT_EQ(requests_.size(), 2u);
  EXPECT_EQ(requests_[0].name(), kSession);
  EXPECT_EQ(requests_[0].segment_offset(), 7u);
  EXPECT_EQ(requests_[0].expected_revision(), 5u) << "that of the points";
  EXPECT_THAT(requests_[0].segments().ends(), ElementsAre(1234, 1235, 1235, 1236, 1236, 1234));
  EXPECT_THAT(requests_[0].segments().markers(), ElementsAre(5, 5, 6));
  EXPECT_EQ(requests_[1].seed_offset(), 2u);
  EXPECT_EQ(requests_[1].faces().faces(), v1::FACE_RULE_HOLES);
  ASSERT_EQ(requests_[1].faces().seeds_size(), 1);
  EXPECT_TRUE(requests_[1].faces().seeds(0).hole());

  const RunResult split = Run({"upload", "one", triangle, "--faces", "even-odd", "--split-crossings", "--offset", "5",
                               "--segment-offset", "3", "--seed-offset", "1", "--output", "json"});
  ASSERT_EQ(split.exit_code, 0) << split.err;
  EXPECT_EQ(json::parse(split.out), json::parse(R"({"session": "sessions/one", "committed_points": 1237,
      "segment_count": 10, "seed_count": 3, "revision": 6})"));
  EXPECT_EQ(requests_[0].segment_offset(), 3u);
  EXPECT_THAT(requests_[0].segments().ends(), ElementsAre(5, 6, 6, 7, 7, 5));
  EXPECT_EQ(requests_[1].seed_offset(), 1u);
  EXPECT_EQ(requests_[1].faces().faces(), v1::FACE_RULE_EVEN_ODD);
  EXPECT_EQ(requests_[1].faces().crossings(), v1::CROSSING_RULE_SPLIT);
}

TEST_F(DomainUploadTest, PolygonsHaveTheSegmentsOfTheirFile) {
  const std::string land = folder_.Write(
      "land.geojson", R"({"type": "Feature", "properties": {"r": 7}, "geometry": {"type": "MultiPolygon", "coordinates":
          [[[[0, 0], [1, 0], [1, 1], [0, 0]]], [[[2, 0], [3, 0], [3, 1], [2, 1], [2, 0]]]]}})");
  const RunResult uploaded = Run({"upload", "one", land, "--region-property", "r"});
  ASSERT_EQ(uploaded.exit_code, 0) << uploaded.err;
  ASSERT_EQ(requests_.size(), 2u);
  ASSERT_EQ(requests_[1].faces().seeds_size(), 2);
  EXPECT_EQ(requests_[1].faces().seeds(0).polygon().first(), 7u) << "after those of the session";
  EXPECT_EQ(requests_[1].faces().seeds(0).polygon().count(), 3u);
  EXPECT_EQ(requests_[1].faces().seeds(1).polygon().first(), 10u);
  EXPECT_EQ(requests_[1].faces().seeds(1).polygon().count(), 4u);
}

TEST_F(DomainUploadTest, ARepeatedFirstUploadBeginsWithTheFirstSegment) {
  ASSERT_EQ(Run({"upload", "one", folder_.Write("triangle.poly", kTriangle), "--offset", "0"}).exit_code, 0);
  EXPECT_EQ(requests_[0].segment_offset(), 0u);
  EXPECT_EQ(requests_[1].seed_offset(), 0u);
}

TEST_F(DomainUploadTest, ErrorsNameTheLinesOfSegments) {
  error_ = MakeError(grpc::StatusCode::INVALID_ARGUMENT, "segments[8] and segments[6] cross, as does seeds[2]",
                     "ERROR_REASON_INVALID_SEGMENTS");
  const RunResult result = Run({"upload", "one", folder_.Write("triangle.poly", kTriangle)});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("triangle.poly:7)"));
  EXPECT_THAT(result.err, HasSubstr("segments[6] cross")) << "it is of another file";
  EXPECT_THAT(result.err, HasSubstr("seeds[2] ("));
}

TEST_F(DomainUploadTest, OfARefinedSessionIsRefusedBeforeThePoints) {
  vertices_ = 9;
  const std::string triangle = folder_.Write("triangle.poly", kTriangle);
  const RunResult result = Run({"upload", "one", triangle});
  EXPECT_EQ(result.exit_code, 7);
  EXPECT_THAT(result.err, HasSubstr("before the first refinement"));
  EXPECT_TRUE(expected_.empty());
  EXPECT_EQ(Run({"upload", "one", triangle, "--offset", "0"}).exit_code, 0) << "a late repetition is the server's";
}

TEST_F(DomainUploadTest, OptionsOfDomainsWantADomain) {
  const std::string cloud = folder_.Write("cloud.csv", "1,2\n");
  for (const std::vector<std::string>& options : std::vector<std::vector<std::string>>{
           {"--faces", "holes"}, {"--split-crossings"}, {"--segment-offset", "0"}, {"--seed-offset", "0"}}) {
    std::vector<std::string> arguments = {"upload", "one", cloud};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const RunResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(options[0]));
  }
  EXPECT_EQ(Run({"upload", "one", folder_.Write("lines.csv", "1,2\n3,4\n"), "--segments"}).exit_code, 0);
  EXPECT_THAT(requests_[0].segments().ends(), ElementsAre(1234, 1235));
}

TEST_F(DomainUploadTest, ShowTellsOfSegments) {
  server_.sessions.get = [](const v1::GetSessionRequest&, v1::GetSessionResponse& response) {
    v1::Session& session = *response.mutable_session() = MakeSession();
    session.set_segment_count(1234);
    session.set_seed_count(2);
    session.set_faces(v1::FACE_RULE_EVEN_ODD);
    session.set_crossings(v1::CROSSING_RULE_SPLIT);
    return grpc::Status::OK;
  };
  const RunResult text = Run({"session", "show", "one"});
  EXPECT_THAT(text.out, AllOf(HasSubstr("1,234\n"), HasSubstr("even-odd, 2 holes and regions, crossings split\n")));
  const json session = json::parse(Run({"session", "show", "one", "--output", "json"}).out);
  EXPECT_EQ(session["segment_count"], 1234);
  EXPECT_EQ(session["seed_count"], 2);
  EXPECT_EQ(session["faces"], "even-odd");
  EXPECT_EQ(session["crossings"], "split");
}

}  // namespace
}  // namespace wellspace
