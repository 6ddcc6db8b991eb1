// Meshes in files against meshes in memory; a flipped bit anywhere is found.
#include "server/store/mesh_file.h"

#include <algorithm>
#include <filesystem>
#include <thread>
#include <tuple>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/memory_mesh.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

class MeshFileTest : public ::testing::Test {
 protected:
  std::shared_ptr<MeshFile> Keep(const core::Mesh& mesh, uint64_t max_chunk_bytes = kMaxResponseBytes) {
    auto use = in_use_->Take(path_, /*is_written=*/true);
    const auto record =
        WriteMeshFile(PosixFileSystem(), *written_, health_, path_, 5, mesh, core::RunContext(), max_chunk_bytes);
    EXPECT_TRUE(record.ok()) << record.status();
    return std::make_shared<MeshFile>(PosixFileSystem(), *record, std::move(use));
  }

  // As it is found after a restart.
  std::shared_ptr<MeshFile> Find(const store::v1::MeshRecord& record) {
    return std::make_shared<MeshFile>(PosixFileSystem(), record, in_use_->Take(path_, /*is_written=*/false));
  }

  const TestFolder folder_;
  const std::string path_ = folder_.path() + "/a.mesh-5";
  const std::unique_ptr<Folder> written_ = *PosixFileSystem().OpenFolder(folder_.path());
  StoreHealth health_{nullptr};
  const std::shared_ptr<FilesInUse> in_use_ = std::make_shared<FilesInUse>(PosixFileSystem());
};

class MeshFileOf : public MeshFileTest,
                   public ::testing::WithParamInterface<std::tuple<int, uint32_t, bool, bool, bool>> {};

TEST_P(MeshFileOf, IsToDownloadsWhatMemoryIs) {
  const auto [dimension, vertices, has_weights, has_moved, has_regions] = GetParam();
  const core::Mesh mesh = MakeMesh({.dimension = dimension,
                                    .vertices = vertices,
                                    .simplices = vertices * 6,
                                    .has_weights = has_weights,
                                    .has_moved = has_moved,
                                    .has_regions = has_regions});
  const auto kept = Keep(mesh);
  const auto found = Find(kept->record());
  const MemoryMesh memory(5, mesh);
  for (const bool with_boundary : {false, true}) {
    const auto expected = DownloadOf(memory, with_boundary);
    ASSERT_TRUE(expected.ok());
    for (const auto& file : {kept, found}) {
      const auto download = DownloadOf(*file, with_boundary);
      ASSERT_TRUE(download.ok()) << download.status();
      EXPECT_TRUE(*download == *expected) << with_boundary;
    }
  }
  EXPECT_EQ(found->record().vertices(), mesh.vertex_count());
  EXPECT_EQ(found->record().simplices(), mesh.simplex_count());
  EXPECT_THAT(found->record().domain_high(), ::testing::ElementsAreArray(mesh.domain_high));
  EXPECT_EQ(found->revision(), 5u);
  EXPECT_TRUE(found->Check().ok());
  EXPECT_LT(found->memory_bytes(), 8192u) << "a mesh in a file takes no memory";
  EXPECT_FALSE(std::filesystem::exists(path_ + ".tmp"));
}

TEST_P(MeshFileOf, IsWholeWhatWasWritten) {
  const auto [dimension, vertices, has_weights, has_moved, has_regions] = GetParam();
  const core::Mesh mesh = MakeMesh({.dimension = dimension,
                                    .vertices = vertices,
                                    .simplices = vertices * 6,
                                    .has_weights = has_weights,
                                    .has_moved = has_moved,
                                    .has_regions = has_regions});
  const auto whole = Keep(mesh, /*max_chunk_bytes=*/2000)->Whole(core::RunContext());
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ((*whole)->points, mesh.points);
  EXPECT_EQ((*whole)->weights, mesh.weights);
  EXPECT_EQ((*whole)->simplices, mesh.simplices);
  EXPECT_EQ((*whole)->input_vertex, mesh.input_vertex);
  EXPECT_EQ((*whole)->moved_vertices, mesh.moved_vertices);
  EXPECT_EQ((*whole)->vertex_origins, mesh.vertex_origins);
  EXPECT_EQ((*whole)->vertex_tags, mesh.vertex_tags);
  EXPECT_EQ((*whole)->simplex_regions, mesh.simplex_regions);
  EXPECT_EQ((*whole)->facets, mesh.facets);
  EXPECT_EQ((*whole)->boundary, mesh.boundary);
  EXPECT_EQ((*whole)->regions, mesh.regions);
}

TEST_P(MeshFileOf, LoadsWhatUpdateNeeds) {
  const auto [dimension, vertices, has_weights, has_moved, has_regions] = GetParam();
  const core::Mesh mesh = MakeMesh({.dimension = dimension,
                                    .vertices = vertices,
                                    .simplices = vertices * 6,
                                    .has_weights = has_weights,
                                    .has_moved = has_moved,
                                    .has_regions = has_regions});
  const auto loaded = Keep(mesh)->Load(core::RunContext());
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(loaded->dimension, dimension);
  EXPECT_EQ(loaded->domain_low, mesh.domain_low);
  EXPECT_EQ(loaded->domain_high, mesh.domain_high);
  EXPECT_TRUE(loaded->points == mesh.points);
  EXPECT_TRUE(loaded->weights == mesh.weights);
  EXPECT_TRUE(loaded->simplices == mesh.simplices);
  EXPECT_EQ(loaded->statistics.max_radius_edge, mesh.statistics.max_radius_edge);
  EXPECT_EQ(loaded->statistics.min_angle_deg, mesh.statistics.min_angle_deg);
}

// The largest have several chunks of each array, and several pieces of moved vertices.
INSTANTIATE_TEST_SUITE_P(Meshes, MeshFileOf,
                         ::testing::Combine(::testing::Values(2, 3), ::testing::Values(3u, 1000u, 150'000u),
                                            ::testing::Bool(), ::testing::Bool(), ::testing::Bool()));

TEST_F(MeshFileTest, KnowsTheSameMesh) {
  const MeshShape shape{.dimension = 2, .vertices = 100, .simplices = 150, .has_weights = true, .has_regions = true};
  const auto file = Keep(MakeMesh(shape));
  EXPECT_TRUE(file->CheckSame(MakeMesh(shape)).ok());
  const auto expect_other = [&](const char* what, const auto& change) {
    core::Mesh other = MakeMesh(shape);
    change(other);
    EXPECT_EQ(file->CheckSame(other).code(), absl::StatusCode::kInternal) << what;
  };
  expect_other("points", [](core::Mesh& mesh) { mesh.points.back() += 1; });
  expect_other("weights", [](core::Mesh& mesh) { mesh.weights[3] += 1; });
  expect_other("no weights", [](core::Mesh& mesh) { mesh.weights.clear(); });
  expect_other("simplices", [](core::Mesh& mesh) { mesh.simplices[7] ^= 1; });
  expect_other("fewer simplices", [](core::Mesh& mesh) { mesh.simplices.resize(mesh.simplices.size() - 3); });
  expect_other("facets", [](core::Mesh& mesh) { mesh.facets[0] ^= 1; });
  expect_other("regions", [](core::Mesh& mesh) { mesh.simplex_regions[0] ^= 1; });
}

// Of every byte of the file: its contents are not read when it is another than was written.
TEST_F(MeshFileTest, AFlippedBitAnywhereIsFoundAndNamed) {
  const auto kept = Keep(MakeMesh({.vertices = 12, .simplices = 9, .has_weights = true, .has_moved = true}), 128);
  const uint64_t size = std::filesystem::file_size(path_);
  EXPECT_EQ(size, kept->record().size());
  for (uint64_t byte = 0; byte < size; ++byte) {
    FlipBit(path_, byte, static_cast<int>(byte % 8));
    const absl::Status status = Find(kept->record())->Check();
    EXPECT_EQ(ReasonOf(status), "FILE_DAMAGED") << byte;
    EXPECT_THAT(std::string(status.message()), HasSubstr(path_ + ": ")) << byte;
    FlipBit(path_, byte, static_cast<int>(byte % 8));
  }
  EXPECT_TRUE(Find(kept->record())->Check().ok());
}

TEST_F(MeshFileTest, ADamagedChunkCostsThatChunkAlone) {
  const auto kept = Keep(MakeMesh({.vertices = 1000, .simplices = 1000}), 1000);
  ASSERT_GT(*kept->ChunkCount(true), 10u);
  FlipBit(path_, 100, 3);
  const absl::Status damaged = kept->SerializeChunk(0, 2, false).status();
  EXPECT_EQ(ReasonOf(damaged), "FILE_DAMAGED");
  EXPECT_EQ(damaged.message(),
            path_ + ": chunk 0 of array 3, the bytes from 0 to 936, is not the one that was written");
  EXPECT_TRUE(kept->SerializeChunk(1, 2, false).ok());
  EXPECT_EQ(ReasonOf(kept->Load(core::RunContext()).status()), "FILE_DAMAGED");
}

TEST_F(MeshFileTest, AFileThatIsMissingShortOrLongIsDamaged) {
  const store::v1::MeshRecord record = Keep(MakeMesh({}))->record();
  const std::string bytes = BytesOfFile(path_);
  for (const uint64_t size : {uint64_t{0}, uint64_t{10}, record.size() - 1, record.size() + 1}) {
    std::filesystem::resize_file(path_, size);
    const auto file = Find(record);
    EXPECT_EQ(ReasonOf(file->Metadata(false).status()), "FILE_DAMAGED") << size;
    WriteFile(path_, bytes);
    EXPECT_TRUE(file->Metadata(false).ok()) << "an error is not remembered";
  }
  std::filesystem::remove(path_);
  const absl::Status missing = Find(record)->ChunkCount(true).status();
  EXPECT_EQ(ReasonOf(missing), "FILE_DAMAGED");
  EXPECT_THAT(std::string(missing.message()), HasSubstr("No such file"));
}

TEST_F(MeshFileTest, AnObsoleteFileGoesWithItsLastReader) {
  auto kept = Keep(MakeMesh({}));
  auto found = Find(kept->record());
  kept->MakeObsolete();
  kept.reset();
  EXPECT_TRUE(std::filesystem::exists(path_));
  EXPECT_TRUE(found->Check().ok()) << "a download that is under way";
  found.reset();
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(MeshFileTest, AnObsoleteFileLeavesOneInItsPlaceAlone) {
  auto first = Keep(MakeMesh({}));
  auto second = Keep(MakeMesh({.salt = 1}));
  first->MakeObsolete();
  first.reset();
  second.reset();
  EXPECT_TRUE(std::filesystem::exists(path_));
}

TEST_F(MeshFileTest, AFileThatIsNotObsoleteStays) {
  Keep(MakeMesh({})).reset();
  EXPECT_TRUE(std::filesystem::exists(path_));
}

TEST_F(MeshFileTest, WritesOverWhatAProcessThatDiedHasLeft) {
  WriteFile(path_ + ".tmp", std::string(100'000, 'x'));
  EXPECT_TRUE(Keep(MakeMesh({}))->Check().ok());
}

TEST_F(MeshFileTest, WritingAndLoadingCanBeCancelled) {
  core::RunContext cancelled;
  cancelled.Cancel();
  const core::Mesh mesh = MakeMesh({});
  EXPECT_EQ(WriteMeshFile(PosixFileSystem(), *written_, health_, path_, 5, mesh, cancelled).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
  EXPECT_TRUE(health_.Check().ok());
  EXPECT_EQ(Keep(mesh)->Load(cancelled).status().code(), absl::StatusCode::kCancelled);
}

TEST_F(MeshFileTest, ServesManyAtOnce) {
  const auto kept = Keep(MakeMesh({.vertices = 20'000, .simplices = 50'000, .has_moved = true}), 10'000);
  const auto found = Find(kept->record());
  const auto expected = DownloadOf(*kept, true);
  std::vector<std::thread> readers;
  std::vector<int> is_same(4, 0);
  for (int& same : is_same) {
    readers.emplace_back([&] {
      const auto download = DownloadOf(*found, true);
      same = download.ok() && *download == *expected ? 1 : 0;
    });
  }
  for (std::thread& reader : readers) {
    reader.join();
  }
  EXPECT_EQ(is_same, std::vector<int>(4, 1));
}

}  // namespace
}  // namespace wellspace::server
