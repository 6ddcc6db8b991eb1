// Triangles of a surface on their way to a session.
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;

constexpr char kSession[] = "sessions/one";
constexpr size_t kTriangles = 40'000;
constexpr size_t kSeeds = 5'000;

// A strip of triangles, with a marker each.
SurfaceFeatures MakeStrip() {
  SurfaceFeatures surface;
  surface.solids = SolidRule::kHoles;
  surface.crease_angle = 40;
  surface.weld = 0;
  for (uint32_t t = 0; t < kTriangles; ++t) {
    surface.corners.insert(surface.corners.end(), {t, t + 1, t + 2});
    surface.markers.push_back(static_cast<int32_t>(t % 5) - 2);
  }
  for (size_t i = 0; i < kSeeds; ++i) {
    surface.seeds.push_back(
        {.x = 0.5 * static_cast<double>(i), .y = 1, .z = 2, .is_hole = i == 0, .region = 4, .max_volume = 3});
  }
  return surface;
}

// A session's triangles, as a server keeps them.
class FakeSurface {
 public:
  // `breaks`: calls that break off after two messages are committed.
  FakeSurface(FakeServer& server, int breaks) : breaks_left_(breaks) {
    // Of an upload before.
    surface_.corners = {7, 8, 9};
    surface_.markers = {1};
    server.sessions.get = [this](const v1::GetSessionRequest& request, v1::GetSessionResponse& response) {
      std::lock_guard lock(mutex_);
      response.mutable_session()->set_name(request.name());
      response.mutable_session()->set_triangle_count(surface_.markers.size());
      response.mutable_session()->set_seed_count(surface_.seeds.size());
      return grpc::Status::OK;
    };
    server.sessions.add_triangles = [this](grpc::ServerContext&, auto& reader, v1::AddTrianglesResponse& response) {
      std::lock_guard lock(mutex_);
      v1::AddTrianglesRequest request;
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
      response.set_triangle_count(surface_.markers.size());
      response.set_seed_count(surface_.seeds.size());
      response.set_revision(7);
      return grpc::Status::OK;
    };
  }

  const SurfaceFeatures& surface() const { return surface_; }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<uint64_t>& revisions() const { return revisions_; }

 private:
  void Take(const v1::AddTrianglesRequest& request) {
    EXPECT_LE(request.ByteSizeLong(), 1u << 20);
    ASSERT_LE(request.triangle_offset(), surface_.markers.size());
    ASSERT_LE(request.seed_offset(), surface_.seeds.size());
    const v1::TriangleChunk& chunk = request.triangles();
    for (int i = 0; i < chunk.markers_size(); ++i) {
      if (request.triangle_offset() + i >= surface_.markers.size()) {
        surface_.corners.insert(surface_.corners.end(),
                                {chunk.corners(3 * i), chunk.corners(3 * i + 1), chunk.corners(3 * i + 2)});
        surface_.markers.push_back(chunk.markers(i));
      }
    }
    for (int i = 0; i < request.surface().seeds_size(); ++i) {
      if (request.seed_offset() + i >= surface_.seeds.size()) {
        const v1::SolidSeed& seed = request.surface().seeds(i);
        surface_.seeds.push_back({seed.x(), seed.y(), seed.z(), seed.hole(), seed.region(), seed.max_volume()});
      }
    }
    if (request.has_surface()) {
      const v1::SurfaceOptions& options = request.surface();
      surface_.solids = options.solids() == v1::SOLID_RULE_HOLES ? SolidRule::kHoles
                        : options.solids() == v1::SOLID_RULE_BOX ? SolidRule::kBox
                                                                 : SolidRule::kEvenOdd;
      if (options.has_box()) {
        surface_.box = {options.box().low(0),  options.box().low(1),  options.box().low(2),
                        options.box().high(0), options.box().high(1), options.box().high(2)};
      }
      surface_.crease_angle = options.has_crease_angle() ? std::optional(options.crease_angle()) : std::nullopt;
      surface_.weld = options.has_weld() ? std::optional(options.weld()) : std::nullopt;
      surface_.min_patch = options.has_min_patch() ? std::optional(options.min_patch()) : std::nullopt;
    }
  }

  std::mutex mutex_;
  SurfaceFeatures surface_;
  int breaks_left_ = 0;
  std::vector<std::string> names_;
  std::vector<uint64_t> revisions_;
};

void ExpectHas(const SurfaceFeatures& held, const SurfaceFeatures& sent) {
  EXPECT_EQ(std::vector(held.corners.begin() + 3, held.corners.end()), sent.corners);
  EXPECT_EQ(std::vector(held.markers.begin() + 1, held.markers.end()), sent.markers);
  EXPECT_EQ(held.solids, sent.solids);
  EXPECT_EQ(held.crease_angle, sent.crease_angle);
  EXPECT_EQ(held.weld, sent.weld) << "0 is sent as it is";
  EXPECT_EQ(held.min_patch, sent.min_patch);
  ASSERT_EQ(held.seeds.size(), sent.seeds.size());
  for (size_t i = 0; i < held.seeds.size(); ++i) {
    EXPECT_EQ(held.seeds[i].x, sent.seeds[i].x);
    EXPECT_EQ(held.seeds[i].z, sent.seeds[i].z);
    EXPECT_EQ(held.seeds[i].is_hole, sent.seeds[i].is_hole);
    EXPECT_EQ(held.seeds[i].region, sent.seeds[i].region);
    EXPECT_EQ(held.seeds[i].max_volume, sent.seeds[i].max_volume);
  }
}

TEST(AddTriangles, SendsAllAfterWhatIsThere) {
  FakeServer server;
  FakeSurface held(server, 0);
  const SurfaceFeatures surface = MakeStrip();
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<AddedTriangles> added = server.Client().AddTriangles(kSession, surface, std::nullopt, call);
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(added->triangle_count, kTriangles + 1);
  EXPECT_EQ(added->seed_count, kSeeds);
  EXPECT_EQ(added->revision, 7u);
  ExpectHas(held.surface(), surface);
  EXPECT_THAT(held.names(), ElementsAre(kSession));
  EXPECT_THAT(held.revisions(), ElementsAre(3));
}

TEST(AddTriangles, IsRepeatedAtTheSamePlaceWhenItBreaksOff) {
  FakeServer server;
  FakeSurface held(server, 1);
  const SurfaceFeatures surface = MakeStrip();
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<AddedTriangles> added = server.Client().AddTriangles(kSession, surface, std::nullopt, call);
  ASSERT_TRUE(added.ok()) << added.status();
  ExpectHas(held.surface(), surface);
  EXPECT_THAT(held.revisions(), ElementsAre(3, 0));
  ASSERT_TRUE(server.Client().AddTriangles(kSession, surface, SurfaceOffset{1, 0}).ok());
  ExpectHas(held.surface(), surface);
}

TEST(AddTriangles, OptionsComeWithoutTriangles) {
  FakeServer server;
  FakeSurface held(server, 0);
  SurfaceFeatures rules;
  rules.solids = SolidRule::kHoles;
  rules.min_patch = 0.5;
  ASSERT_TRUE(server.Client().AddTriangles(kSession, rules).ok());
  EXPECT_EQ(held.surface().solids, SolidRule::kHoles);
  EXPECT_EQ(held.surface().min_patch, 0.5);
  EXPECT_EQ(held.surface().crease_angle, std::nullopt);
  EXPECT_EQ(held.surface().markers.size(), 1u);
  EXPECT_EQ(held.surface().box, std::nullopt);
  rules.solids = SolidRule::kBox;
  rules.box = {0, 1, 2, 3, 4, 5};
  ASSERT_TRUE(server.Client().AddTriangles(kSession, rules).ok());
  EXPECT_EQ(held.surface().solids, SolidRule::kBox);
  EXPECT_EQ(held.surface().box, rules.box);
}

TEST(AddTriangles, ErrorsOfTheServer) {
  FakeServer server;
  FakeSurface held(server, 0);
  server.sessions.add_triangles = [](grpc::ServerContext&, auto&, auto&) {
    return MakeError(grpc::StatusCode::FAILED_PRECONDITION, "refined", "ERROR_REASON_DOMAIN_FIXED");
  };
  EXPECT_EQ(ReasonOf(server.Client().AddTriangles(kSession, MakeStrip()).status()), "ERROR_REASON_DOMAIN_FIXED");
}

}  // namespace
}  // namespace wellspace::client
