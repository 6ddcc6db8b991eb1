// Chunks add up to their mesh, and CRC32C is that of RFC 3720.
#include "server/store/mesh_chunks.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/server/service_harness.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {
namespace {

// The examples of RFC 3720, appendix B.4.
TEST(Crc32c, Rfc3720Examples) {
  std::string ascending;
  for (char c = 0; c < 32; ++c) {
    ascending.push_back(c);
  }
  for (const auto crc32c : {&Crc32c, &PortableCrc32c}) {
    EXPECT_EQ(crc32c("", 0), 0u);
    EXPECT_EQ(crc32c("123456789", 9), 0xE3069283u);
    EXPECT_EQ(crc32c(std::string(32, '\0').data(), 32), 0x8A9136AAu);
    EXPECT_EQ(crc32c(std::string(32, '\xFF').data(), 32), 0x62A8AB43u);
    EXPECT_EQ(crc32c(ascending.data(), 32), 0x46DD794Eu);
  }
}

TEST(Crc32c, OfPartsIsThatOfTheWhole) {
  std::string bytes(50'000, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>(i * 7 + i / 251);
  }
  for (const auto extend : {&ExtendCrc32c, &ExtendPortableCrc32c}) {
    for (const size_t cut : {size_t{0}, size_t{1}, size_t{7}, size_t{12'288}, size_t{33'333}, bytes.size()}) {
      const uint32_t first = extend(0, bytes.data(), cut);
      EXPECT_EQ(extend(first, bytes.data() + cut, bytes.size() - cut), Crc32c(bytes.data(), bytes.size())) << cut;
    }
  }
}

TEST(Crc32c, IsTheSameOnEveryProcessor) {
  std::mt19937 generator(5);
  std::string bytes(100'000, '\0');
  for (char& byte : bytes) {
    byte = static_cast<char>(generator());
  }
  for (size_t begin = 0; begin < 16; ++begin) {  // however the bytes lie in memory
    for (size_t size = 0; size <= 64; ++size) {
      EXPECT_EQ(Crc32c(bytes.data() + begin, size), PortableCrc32c(bytes.data() + begin, size));
    }
  }
  for (const size_t size :
       {12'287, 12'288, 12'289, 24'577, 36'871, 100'000}) {  // about the blocks that are taken at once
    EXPECT_EQ(Crc32c(bytes.data(), size), PortableCrc32c(bytes.data(), size));
  }
}

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(slice.begin(), slice.end());
  }
  return bytes;
}

class MeshChunksOf : public ::testing::TestWithParam<std::tuple<int, size_t, uint64_t, bool>> {};

TEST_P(MeshChunksOf, AddUpToTheMesh) {
  const auto [dimension, point_count, max_bytes, has_weights] = GetParam();
  core::MeshParameters parameters;
  parameters.dimension = dimension;
  std::vector<double> points(point_count * dimension);
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = static_cast<double>(i) / 7;
  }
  core::Mesh mesh = MakeFakeMesh(parameters, points);
  for (uint64_t vertex = 0; has_weights && vertex < mesh.vertex_count(); ++vertex) {
    mesh.weights.push_back(static_cast<double>(vertex) / 16);
  }
  const auto chunks = std::make_shared<MeshChunks>(mesh, max_bytes);
  core::Mesh sum;
  for (uint64_t index = 0; index < chunks->count(); ++index) {
    const std::string bytes = BytesOf(SerializeChunk(chunks, index, v1::MeshPointsResponse::kChunkFieldNumber));
    v1::MeshPointsResponse response;
    ASSERT_TRUE(response.ParseFromString(bytes));
    EXPECT_EQ(response.SerializeAsString(), bytes);
    const v1::MeshChunk& chunk = response.chunk();
    EXPECT_LE(bytes.size(), max_bytes);
    EXPECT_EQ(chunk.index(), index);
    EXPECT_EQ(1, !chunk.points().empty() + !chunk.weights().empty() + !chunk.simplices().empty() +
                     !chunk.input_vertices().empty());
    EXPECT_EQ(chunk.points_size() % dimension, 0);
    EXPECT_EQ(chunk.simplices_size() % (dimension + 1), 0);
    if (!chunk.points().empty()) {
      EXPECT_TRUE(sum.weights.empty() && sum.simplices.empty());
      EXPECT_EQ(chunk.crc32c(), Crc32c(chunk.points().data(), chunk.points_size() * sizeof(double)));
    } else if (!chunk.weights().empty()) {
      EXPECT_TRUE(sum.simplices.empty());
      EXPECT_EQ(chunk.crc32c(), Crc32c(chunk.weights().data(), chunk.weights_size() * sizeof(double)));
    } else if (!chunk.simplices().empty()) {
      EXPECT_TRUE(sum.input_vertex.empty());
      EXPECT_EQ(chunk.crc32c(), Crc32c(chunk.simplices().data(), chunk.simplices_size() * sizeof(uint32_t)));
    } else {
      EXPECT_EQ(chunk.crc32c(), Crc32c(chunk.input_vertices().data(), chunk.input_vertices_size() * sizeof(uint32_t)));
    }
    sum.points.insert(sum.points.end(), chunk.points().begin(), chunk.points().end());
    sum.weights.insert(sum.weights.end(), chunk.weights().begin(), chunk.weights().end());
    sum.simplices.insert(sum.simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
    sum.input_vertex.insert(sum.input_vertex.end(), chunk.input_vertices().begin(), chunk.input_vertices().end());
  }
  EXPECT_EQ(sum.points, mesh.points);
  EXPECT_EQ(sum.weights, mesh.weights);
  EXPECT_EQ(sum.simplices, mesh.simplices);
  EXPECT_EQ(sum.input_vertex, mesh.input_vertex);
}

INSTANTIATE_TEST_SUITE_P(Sizes, MeshChunksOf,
                         ::testing::Combine(::testing::Values(2, 3), ::testing::Values(0, 1, 2, 3, 100, 1000),
                                            ::testing::Values(128, 200, 1000, kMaxResponseBytes), ::testing::Bool()));

// A client that asks for the boundary gets its arrays, too; any other gets the bytes that there always were.
TEST(MeshChunks, BringTheBoundaryToThoseThatAskForIt) {
  core::Mesh mesh = MakeFakeMesh(core::MeshParameters(), std::vector<double>(300, 0.5));
  core::Mesh plain = mesh;
  for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    mesh.vertex_origins.push_back(v % 2 == 0 ? v / 2 : core::kSteinerOrigin);
    mesh.vertex_tags.push_back(static_cast<int32_t>(v % 3));
    mesh.facets.insert(mesh.facets.end(), {v, 0, 1});
  }
  for (uint64_t simplex = 0; simplex < mesh.simplex_count(); ++simplex) {
    mesh.simplex_regions.push_back(static_cast<int32_t>(simplex % 5 + 1));
  }
  for (const uint64_t max_bytes : {uint64_t{128}, uint64_t{1000}, uint64_t{kMaxResponseBytes}}) {
    const auto chunks = std::make_shared<MeshChunks>(mesh, max_bytes);
    const auto plain_chunks = std::make_shared<MeshChunks>(plain, max_bytes);
    ASSERT_EQ(chunks->count(), plain_chunks->count());
    for (uint64_t index = 0; index < chunks->count(); ++index) {
      EXPECT_EQ(BytesOf(SerializeChunk(chunks, index, 2)), BytesOf(SerializeChunk(plain_chunks, index, 2)));
    }
    core::Mesh sum;
    std::vector<int> order;  // of the arrays
    for (uint64_t index = 0; index < chunks->count(/*with_boundary=*/true); ++index) {
      const std::string bytes =
          BytesOf(SerializeChunk(chunks, index, v1::DownloadMeshResponse::kChunkFieldNumber, true));
      EXPECT_LE(bytes.size(), max_bytes);
      v1::DownloadMeshResponse response;
      ASSERT_TRUE(response.ParseFromString(bytes));
      const v1::MeshChunk& chunk = response.chunk();
      EXPECT_EQ(chunk.index(), index);
      const auto take = [&](int field, const auto& values, auto& into) {
        if (!values.empty()) {
          order.push_back(field);
          into.insert(into.end(), values.begin(), values.end());
          EXPECT_EQ(chunk.crc32c(), Crc32c(values.data(), values.size() * sizeof(values[0])));
        }
      };
      take(1, chunk.points(), sum.points);
      take(2, chunk.vertex_origins(), sum.vertex_origins);
      take(3, chunk.vertex_tags(), sum.vertex_tags);
      take(4, chunk.simplex_regions(), sum.simplex_regions);
      take(5, chunk.simplices(), sum.simplices);
      take(6, chunk.input_vertices(), sum.input_vertex);
      take(7, chunk.facets(), sum.facets);
      EXPECT_EQ(order.size(), index + 1) << "one array a chunk";
    }
    EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
    EXPECT_EQ(sum.points, mesh.points);
    EXPECT_EQ(sum.vertex_origins, mesh.vertex_origins);
    EXPECT_EQ(sum.vertex_tags, mesh.vertex_tags);
    EXPECT_EQ(sum.simplex_regions, mesh.simplex_regions);
    EXPECT_EQ(sum.simplices, mesh.simplices);
    EXPECT_EQ(sum.input_vertex, mesh.input_vertex);
    EXPECT_EQ(sum.facets, mesh.facets);
  }
}

// Vertices that have moved come with their points, in whatever pieces.
TEST(MeshChunks, HaveTheMovedVerticesBesideTheirPoints) {
  core::Mesh mesh = MakeFakeMesh(core::MeshParameters(), std::vector<double>(300, 0.5));
  for (int i = 0; i < 300; ++i) {
    mesh.points.insert(mesh.points.end(), {0.5, 0.25, i / 300.0});
  }
  for (uint32_t v = 5; v < mesh.vertex_count(); v += v < 100 ? 1 : 7) {
    mesh.moved_vertices.push_back(v);
  }
  for (const uint64_t max_bytes : {uint64_t{128}, uint64_t{1000}, uint64_t{kMaxResponseBytes}}) {
    const auto chunks = std::make_shared<MeshChunks>(mesh, max_bytes);
    std::vector<uint32_t> moved;
    uint64_t vertices = 0;
    for (uint64_t index = 0; index < chunks->count(); ++index) {
      const std::string bytes = BytesOf(SerializeChunk(chunks, index, v1::DownloadMeshResponse::kChunkFieldNumber));
      EXPECT_LE(bytes.size(), max_bytes);
      v1::DownloadMeshResponse response;
      ASSERT_TRUE(response.ParseFromString(bytes));
      const uint64_t end = vertices + response.chunk().points_size() / 3;
      for (const uint32_t v : response.chunk().moved_vertices()) {
        EXPECT_TRUE(vertices <= v && v < end) << v;
        moved.push_back(v);
      }
      vertices = end;
    }
    EXPECT_EQ(vertices, mesh.vertex_count());
    EXPECT_EQ(moved, std::vector<uint32_t>(mesh.moved_vertices.begin(), mesh.moved_vertices.end()));
  }
}

TEST(MeshChunks, LargeMeshFillsItsChunks) {
  const auto chunks = std::make_shared<MeshChunks>(MakeFakeMesh(core::MeshParameters(), std::vector<double>(600'000)));
  const uint64_t bytes = 200'000 * (3 * sizeof(double) + 4 * sizeof(uint32_t) + sizeof(uint32_t));
  EXPECT_LE(chunks->count(), bytes / kMaxResponseBytes + 4);
  EXPECT_GT(SerializeChunk(chunks, 0, 1).Length(), kMaxResponseBytes - 1024u);
}

TEST(MeshChunks, AMeshLivesAsLongAsItsChunks) {
  auto chunks = std::make_shared<const MeshChunks>(MakeFakeMesh(core::MeshParameters(), std::vector<double>(300, 0.5)));
  const std::weak_ptr<const MeshChunks> watch = chunks;
  const std::string bytes = BytesOf(SerializeChunk(chunks, 0, 1));
  std::optional<grpc::ByteBuffer> on_its_way = SerializeChunk(chunks, 0, 1);
  chunks.reset();
  EXPECT_FALSE(watch.expired());
  EXPECT_EQ(BytesOf(*on_its_way), bytes);
  on_its_way.reset();
  EXPECT_TRUE(watch.expired());
}

}  // namespace
}  // namespace wellspace::server
