// DownloadMesh of parts: they add up to the mesh, in any order of calls; and what is refused.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "server/store/durable_log.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

// The arrays of a mesh, or of a part.
struct Arrays {
  std::vector<double> points;
  std::vector<double> weights;
  std::vector<uint32_t> origins;
  std::vector<int32_t> tags;
  std::vector<int32_t> regions;
  std::vector<uint32_t> simplices;
  std::vector<uint32_t> facets;
  std::vector<uint32_t> vertex_ids;
  std::vector<uint32_t> vertex_owners;
  std::vector<uint32_t> vertex_rows;
  std::vector<uint32_t> simplex_ids;
  std::vector<uint32_t> simplex_owners;
  std::vector<uint32_t> facet_ids;
};

template <typename T, typename Field>
void Append(const Field& field, std::vector<T>& values) {
  values.insert(values.end(), field.begin(), field.end());
}

Arrays ArraysOf(const Download& download) {
  Arrays arrays;
  for (const v1::MeshChunk& chunk : download.chunks) {
    Append(chunk.points(), arrays.points);
    Append(chunk.weights(), arrays.weights);
    Append(chunk.vertex_origins(), arrays.origins);
    Append(chunk.vertex_tags(), arrays.tags);
    Append(chunk.simplex_regions(), arrays.regions);
    Append(chunk.simplices(), arrays.simplices);
    Append(chunk.facets(), arrays.facets);
    Append(chunk.vertex_ids(), arrays.vertex_ids);
    Append(chunk.vertex_owners(), arrays.vertex_owners);
    Append(chunk.vertex_rows(), arrays.vertex_rows);
    Append(chunk.simplex_ids(), arrays.simplex_ids);
    Append(chunk.simplex_owners(), arrays.simplex_owners);
    Append(chunk.facet_ids(), arrays.facet_ids);
    EXPECT_TRUE(chunk.input_vertices().empty() && chunk.ridges().empty() && chunk.moved_vertices().empty());
  }
  return arrays;
}

std::string BytesOf(const std::vector<v1::MeshChunk>& chunks, size_t first = 0) {
  std::string bytes;
  for (size_t i = first; i < chunks.size(); ++i) {
    bytes += chunks[i].SerializeAsString();
  }
  return bytes;
}

// A row of `width` numbers.
template <typename T>
std::vector<T> Row(const std::vector<T>& values, uint64_t row, size_t width) {
  return {values.begin() + static_cast<ptrdiff_t>(row * width),
          values.begin() + static_cast<ptrdiff_t>((row + 1) * width)};
}

// The same of vertices, by their numbers in the whole mesh.
std::vector<uint32_t> RowInWhole(const Arrays& part, const std::vector<uint32_t>& vertices, uint64_t row,
                                 size_t width) {
  std::vector<uint32_t> named;
  for (const uint32_t vertex : Row(vertices, row, width)) {
    named.push_back(part.vertex_ids.at(vertex));
  }
  return named;
}

v1::DownloadMeshRequest PartRequest(const std::string& name, uint32_t parts, uint32_t part, uint32_t ghost_layers = 1) {
  v1::DownloadMeshRequest request;
  request.set_name(name);
  request.set_with_boundary(true);
  request.mutable_partition()->set_parts(parts);
  request.mutable_partition()->set_part(part);
  request.mutable_partition()->set_ghost_layers(ghost_layers);
  return request;
}

// Holds parts to the whole mesh.
class Union {
 public:
  Union(SessionCalls& calls, const std::string& name)
      : calls_(calls),
        name_(name),
        download_(calls.DownloadMesh(name, 0, 0, std::nullopt, /*with_boundary=*/true)),
        metadata_(download_.metadata.at(0)),
        corners_(metadata_.dimension() + 1) {
    for (v1::MeshChunk& chunk : download_.chunks) {
      chunk.clear_input_vertices();
      chunk.clear_ridges();
    }
    whole_ = ArraysOf(download_);
  }

  void Check(uint32_t parts, uint32_t ghost_layers, bool contiguous = false) {
    vertices_.assign(metadata_.vertex_count(), 0);
    simplices_.assign(metadata_.simplex_count(), 0);
    facets_.assign(metadata_.facet_count(), 0);
    rows_.assign(metadata_.vertex_count(), 0);
    tags_.clear();
    for (uint32_t part = 0; part < parts; ++part) {
      v1::DownloadMeshRequest request = PartRequest(name_, parts, part, ghost_layers);
      request.mutable_partition()->set_contiguous(contiguous);
      const Download download = calls_.DownloadMesh(request);
      ASSERT_TRUE(download.status.ok()) << download.status.error_message();
      ASSERT_EQ(download.metadata.size(), 1u);
      CheckPart(download, parts, part);
    }
    EXPECT_THAT(vertices_, ::testing::Each(1));
    EXPECT_THAT(simplices_, ::testing::Each(1));
    EXPECT_THAT(facets_, ::testing::Each(1));
    EXPECT_THAT(rows_, ::testing::Each(1));
  }

 private:
  void CheckPart(const Download& download, uint32_t parts, uint32_t number) {
    const v1::MeshMetadata& metadata = download.metadata[0];
    const v1::MeshPartInfo& info = metadata.part();
    EXPECT_EQ(metadata.chunk_count(), download.chunks.size());
    EXPECT_EQ(metadata.revision(), metadata_.revision());
    EXPECT_EQ(info.parts(), parts);
    EXPECT_EQ(info.part(), number);
    EXPECT_EQ(info.whole_vertex_count(), metadata_.vertex_count());
    EXPECT_EQ(info.whole_simplex_count(), metadata_.simplex_count());
    EXPECT_EQ(info.whole_facet_count(), metadata_.facet_count());
    EXPECT_EQ(metadata.input_point_count(), 0u);
    EXPECT_EQ(metadata.regions_size(), metadata_.regions_size());
    const Arrays part = ArraysOf(download);
    CheckVertices(part, metadata, number);
    CheckSimplices(part, metadata, number);
    CheckFacets(part, metadata);
  }

  void CheckVertices(const Arrays& part, const v1::MeshMetadata& metadata, uint32_t number) {
    const size_t dimension = metadata_.dimension();
    ASSERT_EQ(part.vertex_ids.size(), metadata.vertex_count());
    ASSERT_EQ(part.points.size(), metadata.vertex_count() * dimension);
    ASSERT_EQ(part.weights.size(), whole_.weights.empty() ? 0 : metadata.vertex_count());
    for (uint64_t v = 0; v < metadata.vertex_count(); ++v) {
      const uint32_t id = part.vertex_ids[v];
      ASSERT_EQ(Row(part.points, v, dimension), Row(whole_.points, id, dimension));
      ASSERT_EQ(part.origins.at(v), whole_.origins[id]);
      ASSERT_EQ(part.tags.at(v), whole_.tags[id]);
      if (!whole_.weights.empty()) {
        ASSERT_EQ(part.weights[v], whole_.weights[id]);
      }
      const bool is_own = v < metadata.part().own_vertex_count();
      ASSERT_EQ(part.vertex_owners.at(v) == number, is_own);
      if (is_own) {
        ++vertices_.at(id);
        ++rows_.at(part.vertex_rows.at(v));
      }
    }
  }

  void CheckSimplices(const Arrays& part, const v1::MeshMetadata& metadata, uint32_t number) {
    ASSERT_EQ(part.simplex_ids.size(), metadata.simplex_count());
    ASSERT_EQ(part.regions.size(), whole_.regions.empty() ? 0 : metadata.simplex_count());
    for (uint64_t s = 0; s < metadata.simplex_count(); ++s) {
      const uint32_t id = part.simplex_ids[s];
      ASSERT_EQ(RowInWhole(part, part.simplices, s, corners_), Row(whole_.simplices, id, corners_));
      if (!whole_.regions.empty()) {
        ASSERT_EQ(part.regions[s], whole_.regions[id]);
      }
      const bool is_own = s < metadata.part().own_simplex_count();
      ASSERT_EQ(part.simplex_owners.at(s) == number, is_own);
      simplices_.at(id) += is_own ? 1 : 0;
    }
  }

  // They come part after part of the boundary, in the whole mesh and in the part.
  void CheckFacets(const Arrays& part, const v1::MeshMetadata& metadata) {
    ASSERT_EQ(part.facet_ids.size(), metadata.facet_count());
    ASSERT_EQ(metadata.boundary_size(), metadata_.boundary_size());
    uint64_t at = 0;
    uint64_t end_in_whole = 0;
    for (int i = 0; i < metadata.boundary_size(); ++i) {
      EXPECT_EQ(metadata.boundary(i).tag(), metadata_.boundary(i).tag());
      EXPECT_EQ(metadata.boundary(i).name(), metadata_.boundary(i).name());
      const uint64_t begin_in_whole = end_in_whole;
      end_in_whole += metadata_.boundary(i).facet_count();
      for (uint64_t k = 0; k < metadata.boundary(i).facet_count(); ++k, ++at) {
        const uint32_t id = part.facet_ids.at(at);
        ASSERT_TRUE(begin_in_whole <= id && id < end_in_whole);
        ASSERT_EQ(RowInWhole(part, part.facets, at, corners_ - 1), Row(whole_.facets, id, corners_ - 1));
        ++facets_.at(id);
      }
    }
    EXPECT_EQ(at, metadata.facet_count());
  }

  SessionCalls& calls_;
  const std::string name_;
  Download download_;
  const v1::MeshMetadata metadata_;
  const size_t corners_;
  Arrays whole_;
  std::vector<int> vertices_;
  std::vector<int> simplices_;
  std::vector<int> facets_;
  std::vector<int> rows_;
  std::vector<int32_t> tags_;
};

class PartDownload : public ::testing::Test {
 protected:
  explicit PartDownload(const ServiceOptions& options = {.workers = 2}, bool is_durable = false) {
    std::unique_ptr<SessionLog> log = is_durable ? OpenDurableLog({.folder = folder_.path()}).value() : nullptr;
    harness_.emplace(core::MeshPoints, options, Transport::kInProcess, FakeEstimator, core::Mesher::Create,
                     SecurityOptions(), std::move(log));
    calls_.emplace(harness_->channel());
  }
  ~PartDownload() override {
    calls_.reset();
    harness_.reset();
  }

  SessionCalls& calls() { return *calls_; }
  std::string CreateRefined(int dimension, size_t points) {
    std::string name = calls().Create(dimension).name();
    calls().Upload(name, 0, UniformPoints(points, dimension, 3));
    EXPECT_EQ(calls().Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    return name;
  }
  void ExpectRefused(const v1::DownloadMeshRequest& request, grpc::StatusCode code, const std::string& reason,
                     const std::string& field, const std::string& message) {
    const Download download = calls().DownloadMesh(request);
    EXPECT_EQ(download.status.error_code(), code) << request.ShortDebugString();
    EXPECT_EQ(DetailsOf(download.status).reason, reason) << download.status.error_message();
    EXPECT_EQ(DetailsOf(download.status).field, field) << download.status.error_message();
    EXPECT_THAT(download.status.error_message(), HasSubstr(message));
    EXPECT_TRUE(download.metadata.empty());
  }
  void ExpectInvalid(const v1::DownloadMeshRequest& request, const std::string& field, const std::string& message) {
    ExpectRefused(request, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", field, message);
  }

  TestFolder folder_;
  std::optional<ServiceHarness> harness_;
  std::optional<SessionCalls> calls_;
};

class DurablePartDownload : public PartDownload {
 protected:
  DurablePartDownload() : PartDownload({.workers = 2}, /*is_durable=*/true) {}
};

class SmallPartDownload : public PartDownload {
 protected:
  SmallPartDownload() : PartDownload({.workers = 2, .max_memory_bytes = uint64_t{144} << 20}, /*is_durable=*/true) {}
};

TEST_F(PartDownload, PartsOfACloudAddUpToTheMesh) {
  for (const int dimension : {2, 3, 4}) {
    const std::string name = CreateRefined(dimension, dimension == 4 ? 20 : 150);
    Union whole(calls(), name);
    whole.Check(1, 1);
    whole.Check(2, 0);
    whole.Check(5, 1);
    whole.Check(7, 3, /*contiguous=*/true);
  }
}

TEST_F(PartDownload, PartsOfADomainHaveItsTagsAndRegions) {
  v1::CreateSessionRequest request;
  request.mutable_parameters()->set_dimension(2);
  const std::string name = calls().Create(request).name();
  calls().Upload(name, 0, FramePoints());
  calls().AddSegments({FrameRequest(name)});
  calls().Refine(name);
  Union(calls(), name).Check(3, 1);
}

TEST_F(DurablePartDownload, PartsOfASolidAddUpToTheMeshInItsFile) {
  v1::CreateSessionRequest request;
  request.mutable_parameters()->set_dimension(3);
  request.mutable_parameters()->set_max_circumradius(0.2);
  const std::string name = calls().Create(request).name();
  calls().Upload(name, 0, BlockPoints());
  calls().AddTriangles({BlockRequest(name)});
  ASSERT_EQ(calls().Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  Union whole(calls(), name);
  whole.Check(4, 1);
  whole.Check(3, 2);
}

TEST_F(PartDownload, PartsOfARegularTriangulationHaveItsWeights) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(3);
  request.mutable_parameters()->set_min_dihedral(0);
  request.mutable_parameters()->set_pump_weights(true);
  const std::string name = calls().Create(request).name();
  calls().Upload(name, 0, UniformPoints(100, 3, 3));
  calls().Refine(name);
  Union(calls(), name).Check(3, 1);
}

TEST_F(PartDownload, WithoutTheBoundaryThereIsNoneInAPart) {
  const std::string name = CreateRefined(3, 100);
  v1::DownloadMeshRequest request = PartRequest(name, 3, 1);
  const Download with = calls().DownloadMesh(request);
  request.set_with_boundary(false);
  const Download without = calls().DownloadMesh(request);
  ASSERT_TRUE(without.status.ok()) << without.status.error_message();
  const v1::MeshMetadata& metadata = without.metadata.at(0);
  EXPECT_EQ(metadata.boundary_size() + metadata.regions_size(), 0);
  EXPECT_EQ(metadata.facet_count(), 0u);
  EXPECT_EQ(metadata.part().SerializeAsString(), with.metadata.at(0).part().SerializeAsString());
  const Arrays part = ArraysOf(without);
  EXPECT_TRUE(part.facets.empty() && part.facet_ids.empty() && part.tags.empty() && part.origins.empty());
  EXPECT_EQ(part.simplices, ArraysOf(with).simplices);
  EXPECT_EQ(part.vertex_rows, ArraysOf(with).vertex_rows);
}

TEST_F(PartDownload, EveryChunkHasItsChecksumAndTheDownloadGoesOnAtAny) {
  const std::string name = CreateRefined(2, 2000);
  v1::DownloadMeshRequest request = PartRequest(name, 4, 2);
  const Download whole = calls().DownloadMesh(request);
  ASSERT_TRUE(whole.status.ok());
  ASSERT_GE(whole.chunks.size(), 10u);
  const Arrays part = ArraysOf(whole);
  EXPECT_EQ(whole.chunks.back().crc32c(), Crc32c(part.facet_ids.data(), part.facet_ids.size() * sizeof(uint32_t)));
  request.set_revision(whole.metadata.at(0).revision());
  for (uint64_t next = 0; next <= whole.chunks.size(); ++next) {
    request.set_next_chunk(next);
    const Download rest = calls().DownloadMesh(request);
    ASSERT_TRUE(rest.status.ok()) << rest.status.error_message();
    EXPECT_EQ(rest.metadata.at(0).SerializeAsString(), whole.metadata[0].SerializeAsString());
    EXPECT_EQ(BytesOf(rest.chunks), BytesOf(whole.chunks, next));
  }
  request.set_next_chunk(whole.chunks.size() + 1);
  ExpectRefused(request, grpc::StatusCode::OUT_OF_RANGE, "CHUNK_OUT_OF_RANGE", "next_chunk", "the part has");
}

// More ranks than a tenant may have jobs, and several numbers of parts.
TEST_F(PartDownload, AllWhoAskAtOnceGetTheSameParts) {
  const std::string name = CreateRefined(2, 5000);
  constexpr uint32_t kParts = 24;
  std::vector<std::string> bytes(3 * kParts);
  std::vector<std::thread> ranks;
  for (uint32_t i = 0; i < bytes.size(); ++i) {
    ranks.emplace_back([&, i] {
      SessionCalls own(harness_->channel());
      const Download download = own.DownloadMesh(PartRequest(name, i < 2 * kParts ? kParts : 7, i % (kParts) % 7));
      EXPECT_TRUE(download.status.ok()) << download.status.error_message();
      bytes[i] = BytesOf(download.chunks);
    });
  }
  for (std::thread& rank : ranks) {
    rank.join();
  }
  for (uint32_t i = 0; i < bytes.size(); ++i) {
    const Download again = calls().DownloadMesh(PartRequest(name, i < 2 * kParts ? kParts : 7, i % (kParts) % 7));
    EXPECT_EQ(BytesOf(again.chunks), bytes[i]);
  }
}

TEST_F(PartDownload, IsOfTheMeshThatIsAskedFor) {
  const std::string name = CreateRefined(2, 100);
  v1::DownloadMeshRequest request = PartRequest(name, 2, 0);
  const uint64_t first = calls().DownloadMesh(request).metadata.at(0).revision();
  calls().Upload(name, 100, UniformPoints(50, 2, 8));
  calls().Refine(name);
  const uint64_t second = calls().DownloadMesh(request).metadata.at(0).revision();
  EXPECT_GT(second, first);
  request.set_revision(second);
  EXPECT_TRUE(calls().DownloadMesh(request).status.ok());
  request.set_revision(first);
  ExpectRefused(request, grpc::StatusCode::FAILED_PRECONDITION, "REVISION_MISMATCH", "revision", "not");
  Union(calls(), name).Check(2, 1);
}

TEST_F(PartDownload, NumbersThatCannotBeAreRefused) {
  const std::string name = CreateRefined(2, 10);
  const uint64_t simplices = calls().DownloadMesh(name).metadata.at(0).simplex_count();
  ExpectInvalid(PartRequest(name, 0, 0), "partition.parts", "partition.parts is 0; expected 1 to 1048576");
  ExpectInvalid(PartRequest(name, 3, 3), "partition.part", "the last is 2");
  ExpectInvalid(PartRequest(name, 3, 0, 17), "partition.ghost_layers", "expected 0 to 16");
  ExpectInvalid(PartRequest(name, simplices + 1, 0), "partition.parts", "each part has at least one");
  v1::DownloadMeshRequest since = PartRequest(name, 3, 0);
  since.set_since_revision(1);
  ExpectInvalid(since, "partition", "exclude each other");
  EXPECT_TRUE(calls().DownloadMesh(PartRequest(name, simplices, simplices - 1, 16)).status.ok());
  const std::string fresh = calls().Create(2).name();
  ExpectRefused(PartRequest(fresh, 1, 0), grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_READY", "", "refine it");
  ExpectRefused(PartRequest("sessions/none", 1, 0), grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND", "", "");
}

TEST_F(PartDownload, NumbersOfEverySizeEnd) {
  const std::string name = CreateRefined(2, 20);
  const v1::MeshMetadata mesh = calls().DownloadMesh(name).metadata.at(0);
  for (int exponent = 0; exponent <= 32; ++exponent) {
    for (const int64_t beside : {-1, 0, 1}) {
      const auto x = static_cast<uint32_t>((int64_t{1} << exponent) + beside);
      for (const v1::DownloadMeshRequest& request :
           {PartRequest(name, x, 0), PartRequest(name, x, x - 1), PartRequest(name, x, x), PartRequest(name, 5, x),
            PartRequest(name, 5, 1, x), PartRequest(name, 1, 0, x)}) {
        const v1::MeshPartition& partition = request.partition();
        const bool is_right = partition.parts() > 0 && partition.parts() <= mesh.simplex_count() &&
                              partition.part() < partition.parts() && partition.ghost_layers() <= 16;
        const Download download = calls().DownloadMesh(request);
        ASSERT_EQ(download.status.ok(), is_right) << request.ShortDebugString() << download.status.error_message();
        EXPECT_EQ(DetailsOf(download.status).reason, is_right ? "" : "INVALID_REQUEST");
      }
    }
    v1::DownloadMeshRequest request = PartRequest(name, 3, 2);
    request.set_next_chunk(uint64_t{1} << (2 * exponent - (exponent == 32 ? 1 : 0)));
    const Download download = calls().DownloadMesh(request);
    EXPECT_TRUE(download.status.ok() || DetailsOf(download.status).reason == "CHUNK_OUT_OF_RANGE");
  }
  EXPECT_LT(harness_->TimeUntilIdle(), absl::InfiniteDuration());
}

TEST_F(PartDownload, ACancelledOneEndsItsWork) {
  const std::string name = CreateRefined(2, 60'000);
  const Download expected = calls().DownloadMesh(PartRequest(name, 3, 0));
  for (int delay_ms = 0; delay_ms < 200; delay_ms += 10) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(delay_ms));
    const auto stream = calls().sessions().DownloadMesh(&context, PartRequest(name, 40 + delay_ms, 0));
    v1::DownloadMeshResponse response;
    while (stream->Read(&response)) {
    }
    const grpc::Status status = stream->Finish();
    EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) << status.error_message();
    EXPECT_LT(harness_->TimeUntilIdle(), absl::Seconds(1));
  }
  EXPECT_EQ(BytesOf(calls().DownloadMesh(PartRequest(name, 3, 0)).chunks), BytesOf(expected.chunks));
}

// The mesh has room, and METIS has none.
TEST(PartDownloadFailsWith, MemoryLimit) {
  TestFolder folder;
  ServiceHarness harness(FakeMesher, {.workers = 2, .max_memory_bytes = uint64_t{144} << 20}, Transport::kInProcess,
                         FakeEstimator, FixedMesher(MakeLargeMesh(400'000)), SecurityOptions(),
                         OpenDurableLog({.folder = folder.path()}).value());
  SessionCalls calls(harness.channel());
  const std::string name = calls.Create(3).name();
  ASSERT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  for (int i = 0; i < 3; ++i) {
    const Download download = calls.DownloadMesh(PartRequest(name, 4, 0));
    EXPECT_EQ(download.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(DetailsOf(download.status).reason, "MEMORY_LIMIT") << download.status.error_message();
    EXPECT_TRUE(download.metadata.empty());
  }
  EXPECT_TRUE(calls.DownloadMesh(name).status.ok());
}

// Kept cuts are spare, and come back the same.
TEST_F(SmallPartDownload, CutsAreGivenUpForOtherWork) {
  std::vector<std::string> names;
  std::vector<std::string> bytes;
  for (int i = 0; i < 12; ++i) {
    names.push_back(CreateRefined(2, 4000));
    bytes.push_back(BytesOf(calls().DownloadMesh(PartRequest(names.back(), 4, 1)).chunks));
    EXPECT_FALSE(bytes.back().empty());
  }
  for (size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(BytesOf(calls().DownloadMesh(PartRequest(names[i], 4, 1)).chunks), bytes[i]);
  }
}

}  // namespace
}  // namespace wellspace::server
