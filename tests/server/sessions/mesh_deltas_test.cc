// The differences between its meshes that a session keeps.
#include "server/sessions/mesh_deltas.h"

#include <memory>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr uint64_t kMuch = uint64_t{1} << 40;  // bytes

// One of a few bytes.
MeshDeltas::Delta DeltaOf(uint64_t base_revision, uint64_t revision) {
  core::Mesh mesh;
  mesh.dimension = 2;
  return std::make_shared<DeltaSnapshot>(base_revision, revision, core::MeshDelta{.dimension = 2}, mesh);
}

std::vector<uint64_t> RevisionsOf(const absl::StatusOr<std::vector<MeshDeltas::Delta>>& chain) {
  EXPECT_TRUE(chain.ok()) << chain.status();
  std::vector<uint64_t> revisions;
  for (const MeshDeltas::Delta& delta : *chain) {
    revisions.push_back(delta->revision());
  }
  return revisions;
}

TEST(MeshDeltas, LeadFromOneMeshToTheNext) {
  MeshDeltas deltas;
  EXPECT_THAT(RevisionsOf(deltas.Between(3, 3)), IsEmpty());
  EXPECT_THAT(deltas.Advance(DeltaOf(3, 5), kMuch), IsEmpty());
  EXPECT_THAT(deltas.Advance(DeltaOf(5, 6), kMuch), IsEmpty());
  EXPECT_THAT(deltas.Advance(DeltaOf(6, 9), kMuch), IsEmpty());
  EXPECT_EQ(RevisionsOf(deltas.Between(3, 9)), (std::vector<uint64_t>{5, 6, 9}));
  EXPECT_EQ(RevisionsOf(deltas.Between(5, 9)), (std::vector<uint64_t>{6, 9}));
  // For a download that found the mesh before the last one came.
  EXPECT_EQ(RevisionsOf(deltas.Between(3, 6)), (std::vector<uint64_t>{5, 6}));
}

TEST(MeshDeltas, AnErrorSaysWhichAreKept) {
  MeshDeltas deltas;
  const absl::Status none = deltas.Between(2, 9).status();
  EXPECT_EQ(DetailsOf(none).reason, "DELTA_NOT_KEPT");
  EXPECT_EQ(DetailsOf(none).field, "since_revision");
  EXPECT_EQ(none.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(none.message()), HasSubstr("nor is anything since other meshes"));
  (void)deltas.Advance(DeltaOf(3, 5), kMuch);
  (void)deltas.Advance(DeltaOf(5, 9), kMuch);
  for (const uint64_t since : {2, 4, 6}) {
    const std::string message(deltas.Between(since, 9).status().message());
    EXPECT_THAT(message, HasSubstr("revision " + std::to_string(since) + " is not kept; it is since revisions 3, 5"));
    EXPECT_THAT(message, HasSubstr("Download the whole mesh"));
  }
}

TEST(MeshDeltas, AMeshThatNoneLeadsToEndsTheChain) {
  MeshDeltas deltas;
  (void)deltas.Advance(DeltaOf(3, 5), kMuch);
  EXPECT_THAT(deltas.Advance(nullptr, kMuch), SizeIs(1));
  EXPECT_EQ(deltas.memory_bytes(), 0);
  EXPECT_FALSE(deltas.Between(3, 5).ok());
  (void)deltas.Advance(DeltaOf(7, 8), kMuch);
  EXPECT_THAT(deltas.Advance(DeltaOf(10, 11), kMuch), SizeIs(1)) << "it does not begin where the last one ends";
  EXPECT_EQ(RevisionsOf(deltas.Between(10, 11)), (std::vector<uint64_t>{11}));
}

TEST(MeshDeltas, TheOldestGiveWay) {
  MeshDeltas deltas;
  for (uint64_t revision = 1; revision <= MeshDeltas::kMost; ++revision) {
    EXPECT_THAT(deltas.Advance(DeltaOf(revision, revision + 1), kMuch), IsEmpty());
  }
  const uint64_t last = MeshDeltas::kMost + 2;
  EXPECT_THAT(deltas.Advance(DeltaOf(last - 1, last), kMuch), SizeIs(1));
  EXPECT_FALSE(deltas.Between(1, last).ok());
  EXPECT_THAT(RevisionsOf(deltas.Between(2, last)), SizeIs(MeshDeltas::kMost));
  // As many as have no more bytes than the mesh.
  const uint64_t bytes = DeltaOf(last, last + 1)->memory_bytes();
  (void)deltas.Advance(DeltaOf(last, last + 1), 3 * bytes);
  EXPECT_EQ(deltas.memory_bytes(), 3 * bytes);
  EXPECT_THAT(RevisionsOf(deltas.Between(last - 2, last + 1)), SizeIs(3));
}

TEST(MeshDeltas, AreWantedOfMeshesThatWereDownloaded) {
  MeshDeltas deltas;
  EXPECT_FALSE(deltas.IsWanted(3));
  deltas.NoteDownload(3);
  EXPECT_TRUE(deltas.IsWanted(3));
  EXPECT_FALSE(deltas.IsWanted(5));
  (void)deltas.Advance(DeltaOf(3, 5), kMuch);
  EXPECT_TRUE(deltas.IsWanted(5)) << "clients with the mesh of revision 3 get there";
  deltas.NoteDownload(3);
  EXPECT_TRUE(deltas.IsWanted(5));
  EXPECT_FALSE(deltas.IsWanted(6));
}

TEST(MeshDeltas, GiveUpTheirMemory) {
  MeshDeltas deltas;
  (void)deltas.Advance(DeltaOf(3, 5), kMuch);
  (void)deltas.Advance(DeltaOf(5, 6), kMuch);
  EXPECT_GT(deltas.memory_bytes(), 0);
  EXPECT_THAT(deltas.GiveUp(), SizeIs(2));
  EXPECT_EQ(deltas.memory_bytes(), 0);
  EXPECT_FALSE(deltas.Between(3, 6).ok());
  EXPECT_FALSE(deltas.IsWanted(6));
}

}  // namespace
}  // namespace wellspace::server
