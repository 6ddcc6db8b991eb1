// Differences as they are sent.
#include "server/store/delta_snapshot.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "grpcpp/support/proto_buffer_reader.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/server/scripted_mesher.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {
namespace {

v1::DownloadMeshResponse Parsed(grpc::ByteBuffer bytes) {
  v1::DownloadMeshResponse response;
  grpc::ProtoBufferReader reader(&bytes);
  EXPECT_TRUE(response.ParseFromZeroCopyStream(&reader));
  return response;
}

class DeltaSnapshotTest : public ::testing::Test {
 protected:
  DeltaSnapshotTest() {
    base_ = MakeLargeMesh(5000);
    next_ = base_;
    for (size_t row = 0; row < next_.simplices.size(); row += 40) {
      next_.simplices[row] ^= 1;
    }
    next_.points[3] += 1;
    next_.points[30] += 1;
    next_.moved_vertices = {1, 10};
    next_.vertex_tags.assign(next_.vertex_count(), 1);
    next_.vertex_origins.assign(next_.vertex_count(), core::kSteinerOrigin);
    next_.boundary = {{.tag = 1, .name = "one", .facets = 0}};
    next_.regions = {{.id = 1, .name = "domain"}};
    delta_ = core::DiffMeshes(base_, next_, nullptr, uint64_t{1} << 40, core::RunContext()).value();
  }

  core::Mesh base_;
  core::Mesh next_;
  core::MeshDelta delta_;
};

TEST_F(DeltaSnapshotTest, PartsAddUpToTheSameHoweverTheyAreCut) {
  const DeltaSnapshot whole(3, 5, delta_, next_);
  ASSERT_EQ(whole.PartCount(/*with_boundary=*/false), 1);
  ASSERT_EQ(whole.PartCount(/*with_boundary=*/true), 2);
  constexpr uint64_t kFew = 1000;
  const DeltaSnapshot cut(3, 5, delta_, next_, kFew);
  EXPECT_GT(cut.PartCount(true), 20);
  for (const bool with_boundary : {false, true}) {
    v1::MeshDelta expected;
    v1::MeshDelta merged;
    for (const auto& [snapshot, sum] : {std::pair(&whole, &expected), {&cut, &merged}}) {
      for (uint64_t part = 0; part < snapshot->PartCount(with_boundary); ++part) {
        const v1::DownloadMeshResponse response = Parsed(snapshot->Part(part));
        EXPECT_EQ(response.delta().index(), part);
        EXPECT_TRUE(snapshot == &whole || response.ByteSizeLong() <= kFew);
        sum->MergeFrom(response.delta());
      }
      sum->clear_index();
    }
    EXPECT_EQ(merged.SerializeAsString(), expected.SerializeAsString());
    EXPECT_EQ(merged.vertex_tags_size() > 0, with_boundary);
  }
}

TEST_F(DeltaSnapshotTest, ListsHaveGapsAndRunsHaveSkips) {
  const DeltaSnapshot snapshot(3, 5, delta_, next_);
  const v1::MeshDelta delta = Parsed(snapshot.Part(0)).delta();
  EXPECT_EQ(std::vector(delta.changed_points().begin(), delta.changed_points().end()), (std::vector<uint32_t>{1, 8}));
  EXPECT_EQ(std::vector(delta.moved_vertices().begin(), delta.moved_vertices().end()), (std::vector<uint32_t>{1, 8}));
  EXPECT_EQ(delta.points_size(), 6);
  // Each row that has changed is one of the base that is passed over.
  const v1::KeptRows& kept = delta.kept_simplices();
  ASSERT_GT(kept.kept_size(), 2);
  EXPECT_EQ(kept.skipped(2), 1);
  EXPECT_EQ(kept.kept(2), 9);
  EXPECT_EQ(kept.added(2), 1);
}

TEST_F(DeltaSnapshotTest, MetadataAreThoseOfTheMeshItMakes) {
  const DeltaSnapshot snapshot(3, 5, delta_, next_);
  const v1::MeshMetadata with = snapshot.Metadata(true);
  EXPECT_EQ(with.revision(), 5);
  EXPECT_EQ(with.delta().base_revision(), 3);
  EXPECT_EQ(with.vertex_count(), next_.vertex_count());
  EXPECT_EQ(with.chunk_count(), 2);
  EXPECT_EQ(with.moved_vertex_count(), 2);
  EXPECT_EQ(with.delta().checksums().points(), Crc32c(next_.points.data(), next_.points.size() * sizeof(double)));
  EXPECT_EQ(with.delta().checksums().vertex_tags(), Crc32c(next_.vertex_tags.data(), 4 * next_.vertex_tags.size()));
  EXPECT_EQ(with.delta().checksums().weights(), 0);
  const v1::MeshMetadata without = snapshot.Metadata(false);
  EXPECT_EQ(without.chunk_count(), 1);
  EXPECT_EQ(without.boundary_size(), 0);
  EXPECT_EQ(without.delta().checksums().vertex_tags(), 0);
  EXPECT_EQ(without.delta().checksums().simplices(), with.delta().checksums().simplices());
}

// Clients know by them whether the mesh that they had was the base.
TEST_F(DeltaSnapshotTest, EachArrayHasItsChecksum) {
  next_.input_vertex.assign(20, 3);
  next_.weights.assign(next_.vertex_count(), 0.5);
  next_.simplex_regions.assign(next_.simplex_count(), 1);
  next_.facets.assign(3 * 7, 2);
  const auto checksums = [this] { return DeltaSnapshot(3, 5, delta_, next_).Metadata(true).delta().checksums(); };
  const v1::MeshChecksums before = checksums();
  const auto expect_changed = [&](const char* array, auto& values, auto of) {
    ASSERT_FALSE(values.empty()) << array;
    for (const size_t place : {size_t{0}, values.size() - 1}) {
      const auto known = values[place];
      values[place] += 1;
      const v1::MeshChecksums after = checksums();
      EXPECT_NE((after.*of)(), (before.*of)()) << array << " " << place;
      values[place] = known;
    }
    EXPECT_EQ(checksums().SerializeAsString(), before.SerializeAsString());
  };
  expect_changed("points", next_.points, &v1::MeshChecksums::points);
  expect_changed("weights", next_.weights, &v1::MeshChecksums::weights);
  expect_changed("simplices", next_.simplices, &v1::MeshChecksums::simplices);
  expect_changed("input_vertices", next_.input_vertex, &v1::MeshChecksums::input_vertices);
  expect_changed("vertex_origins", next_.vertex_origins, &v1::MeshChecksums::vertex_origins);
  expect_changed("vertex_tags", next_.vertex_tags, &v1::MeshChecksums::vertex_tags);
  expect_changed("simplex_regions", next_.simplex_regions, &v1::MeshChecksums::simplex_regions);
  expect_changed("facets", next_.facets, &v1::MeshChecksums::facets);
}

TEST_F(DeltaSnapshotTest, MemoryIsThatOfTheParts) {
  const DeltaSnapshot snapshot(3, 5, delta_, next_);
  uint64_t sent = 0;
  for (uint64_t part = 0; part < snapshot.PartCount(true); ++part) {
    sent += snapshot.Part(part).Length();
  }
  EXPECT_GE(snapshot.memory_bytes(), sent);
  EXPECT_LE(snapshot.memory_bytes(), sent + 8192);
}

}  // namespace
}  // namespace wellspace::server
