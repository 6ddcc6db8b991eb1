// Segments of a domain on their way to a session.
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;

constexpr char kSession[] = "sessions/one";
constexpr size_t kSegments = 40'000;
constexpr size_t kSeeds = 5'000;

// A chain of segments, of which some in the middle are open, with a marker each.
Features MakeChain() {
  Features features;
  features.faces = FaceRule::kHoles;
  for (uint32_t s = 0; s < kSegments; ++s) {
    features.ends.insert(features.ends.end(), {s, s + 1});
    features.markers.push_back(static_cast<int32_t>(s % 5));
    features.is_open.push_back(s >= 100 && s < 300 ? 1 : 0);
    features.groups.push_back(s / 7);
  }
  for (size_t i = 0; i < kSeeds; ++i) {
    features.seeds.push_back(
        {.x = 0.5 * static_cast<double>(i), .y = 1, .is_hole = i == 0, .region = 4, .max_area = 2});
    features.seeds.back().segment_count = i % 3;
    features.seeds.back().first_segment = i % 3 == 0 ? 0 : i;
  }
  return features;
}

// A session's segments, as a server keeps them.
class FakeDomain {
 public:
  // `breaks`: calls that break off after two messages are committed.
  FakeDomain(FakeServer& server, int breaks) : breaks_left_(breaks) {
    // Of an upload before.
    features_.ends = {7, 8};
    features_.markers = {1};
    features_.is_open = {0};
    features_.groups = {0};
    server.sessions.get = [this](const v1::GetSessionRequest& request, v1::GetSessionResponse& response) {
      std::lock_guard lock(mutex_);
      response.mutable_session()->set_name(request.name());
      response.mutable_session()->set_segment_count(features_.markers.size());
      response.mutable_session()->set_seed_count(features_.seeds.size());
      return grpc::Status::OK;
    };
    server.sessions.add_segments = [this](grpc::ServerContext&, auto& reader, v1::AddSegmentsResponse& response) {
      std::lock_guard lock(mutex_);
      v1::AddSegmentsRequest request;
      for (int messages = 0; reader.Read(&request); ++messages) {
        if (messages == 0) {
          names_.push_back(request.name());
          revisions_.push_back(request.expected_revision());
        }
        if (messages == 2 && breaks_left_ > 0) {
          --breaks_left_;
          return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the connection broke");
        }
        Take(request);
      }
      response.set_segment_count(features_.markers.size());
      response.set_seed_count(features_.seeds.size());
      response.set_revision(7);
      return grpc::Status::OK;
    };
  }

  const Features& features() const { return features_; }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<uint64_t>& revisions() const { return revisions_; }

 private:
  void Take(const v1::AddSegmentsRequest& request) {
    EXPECT_LE(request.ByteSizeLong(), 1u << 20);
    ASSERT_LE(request.segment_offset(), features_.markers.size());
    ASSERT_LE(request.seed_offset(), features_.seeds.size());
    const v1::SegmentChunk& chunk = request.segments();
    for (int i = 0; i < chunk.markers_size(); ++i) {
      if (request.segment_offset() + i >= features_.markers.size()) {
        features_.ends.insert(features_.ends.end(), {chunk.ends(2 * i), chunk.ends(2 * i + 1)});
        features_.markers.push_back(chunk.markers(i));
        features_.is_open.push_back(chunk.open() ? 1 : 0);
        features_.groups.push_back(chunk.groups(i));
      }
    }
    for (int i = 0; i < request.faces().seeds_size(); ++i) {
      if (request.seed_offset() + i >= features_.seeds.size()) {
        const v1::FaceSeed& seed = request.faces().seeds(i);
        features_.seeds.push_back({seed.x(), seed.y(), seed.hole(), seed.region(), seed.max_area(),
                                   seed.polygon().first(), seed.polygon().count()});
      }
    }
    if (request.has_faces()) {
      features_.faces = request.faces().faces() == v1::FACE_RULE_HOLES ? FaceRule::kHoles : FaceRule::kBox;
    }
  }

  std::mutex mutex_;
  Features features_;
  int breaks_left_ = 0;
  std::vector<std::string> names_;
  std::vector<uint64_t> revisions_;
};

void ExpectHas(const Features& held, const Features& sent) {
  EXPECT_EQ(std::vector(held.ends.begin() + 2, held.ends.end()), sent.ends);
  EXPECT_EQ(std::vector(held.markers.begin() + 1, held.markers.end()), sent.markers);
  EXPECT_EQ(std::vector(held.is_open.begin() + 1, held.is_open.end()), sent.is_open);
  EXPECT_EQ(held.faces, sent.faces);
  ASSERT_EQ(held.seeds.size(), sent.seeds.size());
  for (size_t i = 0; i < held.seeds.size(); ++i) {
    EXPECT_EQ(held.seeds[i].x, sent.seeds[i].x);
    EXPECT_EQ(held.seeds[i].is_hole, sent.seeds[i].is_hole);
    EXPECT_EQ(held.seeds[i].max_area, sent.seeds[i].max_area);
    EXPECT_EQ(held.seeds[i].first_segment, sent.seeds[i].first_segment);
    EXPECT_EQ(held.seeds[i].segment_count, sent.seeds[i].segment_count);
  }
}

TEST(AddSegments, SendsAllAfterWhatIsThere) {
  FakeServer server;
  FakeDomain domain(server, 0);
  const Features features = MakeChain();
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<AddedSegments> added = server.Client().AddSegments(kSession, features, std::nullopt, call);
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(added->segment_count, kSegments + 1);
  EXPECT_EQ(added->seed_count, kSeeds);
  EXPECT_EQ(added->revision, 7u);
  ExpectHas(domain.features(), features);
  EXPECT_THAT(domain.names(), ElementsAre(kSession));
  EXPECT_THAT(domain.revisions(), ElementsAre(3));
}

TEST(AddSegments, IsRepeatedAtTheSamePlaceWhenItBreaksOff) {
  FakeServer server;
  FakeDomain domain(server, 1);
  const Features features = MakeChain();
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<AddedSegments> added = server.Client().AddSegments(kSession, features, std::nullopt, call);
  ASSERT_TRUE(added.ok()) << added.status();
  ExpectHas(domain.features(), features);
  EXPECT_THAT(domain.revisions(), ElementsAre(3, 0));
  ASSERT_TRUE(server.Client().AddSegments(kSession, features, FeatureOffset{1, 0}).ok());
  ExpectHas(domain.features(), features);
}

TEST(AddSegments, RulesComeWithoutSegments) {
  FakeServer server;
  FakeDomain domain(server, 0);
  Features rules;
  rules.faces = FaceRule::kHoles;
  ASSERT_TRUE(server.Client().AddSegments(kSession, rules).ok());
  EXPECT_EQ(domain.features().faces, FaceRule::kHoles);
  EXPECT_EQ(domain.features().markers.size(), 1u);
}

TEST(AddSegments, ErrorsOfTheServer) {
  FakeServer server;
  FakeDomain domain(server, 0);
  server.sessions.add_segments = [](grpc::ServerContext&, auto&, auto&) {
    return MakeError(grpc::StatusCode::FAILED_PRECONDITION, "refined", "ERROR_REASON_DOMAIN_FIXED");
  };
  EXPECT_EQ(ReasonOf(server.Client().AddSegments(kSession, MakeChain()).status()), "ERROR_REASON_DOMAIN_FIXED");
}

}  // namespace
}  // namespace wellspace::client
