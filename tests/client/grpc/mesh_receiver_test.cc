// A mesh from its chunks, whole and continued; damaged, early and missing chunks are refused.
#include "client/grpc/mesh_receiver.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The answer of a server: the unit square as two triangles, one input point at its origin.
struct Answer {
  v1::MeshMetadata metadata;
  std::vector<v1::MeshChunk> chunks;
};

void Sign(v1::MeshChunk& chunk) {
  if (!chunk.points().empty()) {
    chunk.set_crc32c(Crc32c(chunk.points().data(), chunk.points_size() * sizeof(double)));
  } else if (!chunk.weights().empty()) {
    chunk.set_crc32c(Crc32c(chunk.weights().data(), chunk.weights_size() * sizeof(double)));
  } else if (!chunk.simplices().empty()) {
    chunk.set_crc32c(Crc32c(chunk.simplices().data(), chunk.simplices_size() * sizeof(uint32_t)));
  } else {
    chunk.set_crc32c(Crc32c(chunk.input_vertices().data(), chunk.input_vertices_size() * sizeof(uint32_t)));
  }
}

Answer GoodAnswer() {
  Answer answer;
  v1::MeshMetadata& metadata = answer.metadata;
  metadata.set_dimension(2);
  for (int axis = 0; axis < 2; ++axis) {
    metadata.mutable_domain()->add_low(0);
    metadata.mutable_domain()->add_high(1);
  }
  metadata.set_vertex_count(4);
  metadata.set_simplex_count(2);
  metadata.set_input_point_count(1);
  metadata.set_chunk_count(4);
  metadata.mutable_statistics()->set_vertices(4);
  metadata.mutable_statistics()->mutable_seconds()->set_refinement(0.25);
  metadata.mutable_statistics()->mutable_counters()->set_cuts(12);
  answer.chunks.resize(4);
  for (int i = 0; i < 4; ++i) {
    answer.chunks[i].set_index(i);
  }
  const std::vector<double> first = {0, 0, 1, 0};
  const std::vector<double> second = {0, 1, 1, 1};
  const std::vector<uint32_t> simplices = {0, 1, 2, 1, 3, 2};
  answer.chunks[0].mutable_points()->Assign(first.begin(), first.end());
  answer.chunks[1].mutable_points()->Assign(second.begin(), second.end());
  answer.chunks[2].mutable_simplices()->Assign(simplices.begin(), simplices.end());
  answer.chunks[3].add_input_vertices(0);
  for (v1::MeshChunk& chunk : answer.chunks) {
    Sign(chunk);
  }
  return answer;
}

// The same as a regular triangulation: a chunk of weights after the points.
Answer WeightedAnswer() {
  Answer answer = GoodAnswer();
  answer.metadata.set_has_weights(true);
  answer.metadata.set_chunk_count(5);
  answer.metadata.mutable_statistics()->set_triangulation(v1::TRIANGULATION_REGULAR);
  answer.metadata.mutable_statistics()->mutable_slivers()->set_weighted_vertices(2);
  v1::MeshChunk chunk;
  for (const double weight : {0.0, 0.125, 0.0, 0.25}) {
    chunk.add_weights(weight);
  }
  Sign(chunk);
  answer.chunks.insert(answer.chunks.begin() + 2, chunk);
  for (uint64_t i = 0; i < answer.chunks.size(); ++i) {
    answer.chunks[i].set_index(i);
  }
  return answer;
}

// The same with its boundary: two parts and an empty one, the second of two regions for the second triangle.
Answer AnswerWithBoundary() {
  Answer answer = GoodAnswer();
  v1::MeshMetadata& metadata = answer.metadata;
  const auto add_part = [&metadata](int32_t tag, const char* name, uint64_t facets) {
    v1::BoundaryPart& part = *metadata.add_boundary();
    part.set_tag(tag);
    part.set_name(name);
    part.set_facet_count(facets);
  };
  add_part(1, "xmin", 1);
  add_part(2, "none", 0);
  add_part(7, "rest", 3);
  for (const int32_t id : {1, 4}) {
    v1::Region& region = *metadata.add_regions();
    region.set_id(id);
    region.set_name("region");
  }
  metadata.set_facet_count(4);
  metadata.set_has_simplex_regions(true);
  metadata.set_has_vertex_marks(true);
  metadata.set_chunk_count(8);
  std::vector<v1::MeshChunk> chunks(4);
  for (const uint32_t origin : {0u, kCornerOrigin, kSteinerOrigin, kRepairOrigin}) {
    chunks[0].add_vertex_origins(origin);
  }
  chunks[0].set_crc32c(Crc32c(chunks[0].vertex_origins().data(), 4 * sizeof(uint32_t)));
  for (const int32_t tag : {1, 7, 0, 7}) {
    chunks[1].add_vertex_tags(tag);
  }
  chunks[1].set_crc32c(Crc32c(chunks[1].vertex_tags().data(), 4 * sizeof(int32_t)));
  for (const int32_t id : {1, 4}) {
    chunks[2].add_simplex_regions(id);
  }
  chunks[2].set_crc32c(Crc32c(chunks[2].simplex_regions().data(), 2 * sizeof(int32_t)));
  for (const uint32_t vertex : {2, 0, 0, 1, 1, 3, 3, 2}) {
    chunks[3].add_facets(vertex);
  }
  chunks[3].set_crc32c(Crc32c(chunks[3].facets().data(), 8 * sizeof(uint32_t)));
  answer.chunks.insert(answer.chunks.begin() + 2, chunks.begin(), chunks.begin() + 3);
  answer.chunks.push_back(chunks[3]);
  for (uint64_t i = 0; i < answer.chunks.size(); ++i) {
    answer.chunks[i].set_index(i);
  }
  return answer;
}

constexpr MeshReceiver::Expectation kOnePointIn2D = {.dimension = 2, .input_points = 1};

absl::StatusOr<Mesh> Assemble(const Answer& answer, const MeshReceiver::Expectation& expectation = kOnePointIn2D) {
  MeshCollector collector;
  MeshReceiver receiver(collector, expectation);
  if (absl::Status status = receiver.SetMetadata(answer.metadata); !status.ok()) {
    return status;
  }
  for (const v1::MeshChunk& chunk : answer.chunks) {
    if (absl::Status status = receiver.AddChunk(chunk); !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = receiver.Finish(); !status.ok()) {
    return status;
  }
  return std::move(collector.mesh());
}

TEST(MeshReceiver, AssemblesAMesh) {
  const absl::StatusOr<Mesh> mesh = Assemble(GoodAnswer());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->dimension, 2);
  EXPECT_THAT(mesh->domain_low, ElementsAre(0, 0));
  EXPECT_THAT(mesh->domain_high, ElementsAre(1, 1));
  EXPECT_THAT(mesh->points, ElementsAre(0, 0, 1, 0, 0, 1, 1, 1));
  EXPECT_THAT(mesh->simplices, ElementsAre(0, 1, 2, 1, 3, 2));
  EXPECT_THAT(mesh->input_vertex, ElementsAre(0));
  EXPECT_EQ(mesh->statistics.vertices, 4u);
  EXPECT_EQ(mesh->statistics.seconds.at("refinement"), 0.25);
  EXPECT_EQ(mesh->statistics.seconds.size(), 5u);
  EXPECT_TRUE(mesh->weights.empty());
  EXPECT_FALSE(mesh->statistics.slivers.has_value());
  EXPECT_EQ(mesh->statistics.counters.at("cuts"), 12u);
  EXPECT_EQ(mesh->statistics.counters.count("tree_leaves"), 1u);
}

TEST(MeshReceiver, TellsWhichVerticesHaveMoved) {
  Answer answer = GoodAnswer();
  answer.metadata.set_moved_vertex_count(3);
  answer.chunks[0].add_moved_vertices(1);
  answer.chunks[1].add_moved_vertices(2);
  answer.chunks[1].add_moved_vertices(3);
  const absl::StatusOr<Mesh> mesh = Assemble(answer);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->moved_vertices, ElementsAre(1, 2, 3));

  Answer few = answer;
  few.metadata.set_moved_vertex_count(4);
  EXPECT_EQ(Assemble(few).status().message(), "the server's answer is damaged: 3 of 4 moved vertices");
  few.metadata.set_moved_vertex_count(2);
  EXPECT_EQ(Assemble(few).status().code(), absl::StatusCode::kDataLoss);
  // Of another chunk, and not ascending.
  Answer wrong = answer;
  wrong.chunks[0].set_moved_vertices(0, 2);
  EXPECT_EQ(Assemble(wrong).status().code(), absl::StatusCode::kDataLoss);
  wrong = answer;
  wrong.chunks[1].set_moved_vertices(1, 2);
  EXPECT_EQ(Assemble(wrong).status().code(), absl::StatusCode::kDataLoss);
}

TEST(MeshReceiver, AssemblesAMeshWithWeights) {
  const absl::StatusOr<Mesh> mesh = Assemble(WeightedAnswer());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->weights, ElementsAre(0, 0.125, 0, 0.25));
  EXPECT_EQ(mesh->statistics.triangulation, Triangulation::kRegular);
  ASSERT_TRUE(mesh->statistics.slivers.has_value());
  EXPECT_EQ(mesh->statistics.slivers->weighted_vertices, 2u);
}

struct Damage {
  std::string name;
  std::string message;  // a part of it
  std::function<void(Answer&)> spoil;
};

TEST(MeshReceiver, AssemblesTheBoundary) {
  const absl::StatusOr<Mesh> mesh = Assemble(AnswerWithBoundary());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->vertex_origins, ElementsAre(0, kCornerOrigin, kSteinerOrigin, kRepairOrigin));
  EXPECT_THAT(mesh->vertex_tags, ElementsAre(1, 7, 0, 7));
  EXPECT_THAT(mesh->simplex_regions, ElementsAre(1, 4));
  EXPECT_THAT(mesh->facets, ElementsAre(2, 0, 0, 1, 1, 3, 3, 2));
  EXPECT_THAT(mesh->boundary,
              ElementsAre(BoundaryPart{1, "xmin", 1}, BoundaryPart{2, "none", 0}, BoundaryPart{7, "rest", 3}));
  EXPECT_EQ(mesh->regions.size(), 2u);
}

// A server that knows of no boundary, as it was before there was one.
TEST(MeshReceiver, NeedsNoBoundary) {
  const absl::StatusOr<Mesh> mesh = Assemble(GoodAnswer());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->boundary.empty() && mesh->facets.empty() && mesh->vertex_tags.empty() && mesh->regions.empty());
}

// A fault in an answer with a boundary.
TEST(MeshReceiver, RefusesADamagedBoundary) {
  const auto message_of = [](const std::function<void(Answer&)>& damage) {
    Answer answer = AnswerWithBoundary();
    damage(answer);
    const absl::Status status = Assemble(answer).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    return std::string(status.message());
  };
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_boundary(2)->set_tag(1); }), HasSubstr("with the tag 1"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_boundary(2)->set_tag(0); }), HasSubstr("with the tag 0"));
  for (const char* name : {"", "a\nb", "\x7f", "\xc2\x9b", "\xe4"}) {
    const auto message = HasSubstr("names are of characters that are none of control");
    EXPECT_THAT(message_of([&](Answer& a) { a.metadata.mutable_boundary(0)->set_name(name); }), message) << name;
    EXPECT_THAT(message_of([&](Answer& a) { a.metadata.mutable_regions(0)->set_name(name); }), message) << name;
  }
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.set_facet_count(5); }), HasSubstr("4 facets, 5 in all"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_regions(1)->set_id(1); }), HasSubstr("with the id 1"));
  EXPECT_THAT(message_of([](Answer& a) { a.chunks[2].set_vertex_origins(0, kSteinerOrigin); }), HasSubstr("CRC32C"));
  EXPECT_THAT(message_of([](Answer& a) {
                a.chunks[2].set_vertex_origins(0, 1);
                a.chunks[2].set_crc32c(Crc32c(a.chunks[2].vertex_origins().data(), 16));
              }),
              HasSubstr("name input point 1 of 1"));
  EXPECT_THAT(message_of([](Answer& a) {
                a.chunks[3].set_vertex_tags(0, 3);
                a.chunks[3].set_crc32c(Crc32c(a.chunks[3].vertex_tags().data(), 16));
              }),
              HasSubstr("name the tag 3"));
  EXPECT_THAT(message_of([](Answer& a) {
                a.chunks[4].set_simplex_regions(0, 3);
                a.chunks[4].set_crc32c(Crc32c(a.chunks[4].simplex_regions().data(), 8));
              }),
              HasSubstr("name the region 3"));
  EXPECT_THAT(message_of([](Answer& a) {
                a.chunks[7].set_facets(0, 4);
                a.chunks[7].set_crc32c(Crc32c(a.chunks[7].facets().data(), 32));
              }),
              HasSubstr("facets name vertex 4 of 4"));
  EXPECT_THAT(message_of([](Answer& a) {
                a.chunks.pop_back();
                a.metadata.set_chunk_count(7);
              }),
              HasSubstr("0 of 4 facets"));
}

class MeshReceiverRefuses : public ::testing::TestWithParam<Damage> {};

TEST_P(MeshReceiverRefuses, ADamagedAnswer) {
  Answer answer = GoodAnswer();
  GetParam().spoil(answer);
  const absl::StatusOr<Mesh> mesh = Assemble(answer);
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(mesh.status().message()), HasSubstr(GetParam().message));
}

constexpr uint64_t kHuge = std::numeric_limits<uint64_t>::max();

INSTANTIATE_TEST_SUITE_P(
    All, MeshReceiverRefuses,
    ::testing::Values(
        Damage{"Dimension", "dimension 3", [](Answer& a) { a.metadata.set_dimension(3); }},
        Damage{"DomainShort", "1 low", [](Answer& a) { a.metadata.mutable_domain()->mutable_low()->RemoveLast(); }},
        Damage{"NoDomain", "0 low", [](Answer& a) { a.metadata.clear_domain(); }},
        Damage{"VertexCountHuge", "more than can be", [](Answer& a) { a.metadata.set_vertex_count(kHuge); }},
        Damage{"SimplexCountHuge", "more than can be", [](Answer& a) { a.metadata.set_simplex_count(kHuge); }},
        Damage{"InputCount", "1 were sent", [](Answer& a) { a.metadata.set_input_point_count(2); }},
        Damage{"ChunkCountHuge", "chunks", [](Answer& a) { a.metadata.set_chunk_count(kHuge); }},
        Damage{"VertexCountHigh", "simplices after 4 of 5 points", [](Answer& a) { a.metadata.set_vertex_count(5); }},
        Damage{"VertexCountLow", "more than the announced 3", [](Answer& a) { a.metadata.set_vertex_count(3); }},
        Damage{"SimplexCountHigh", "input vertices after 2 of 3 simplices", [](Answer& a) { a.metadata.set_simplex_count(3); }},
        Damage{"SimplexCountLow", "more than the announced 1", [](Answer& a) { a.metadata.set_simplex_count(1); }},
        Damage{"ChunkMissing", "3 of 4 chunks", [](Answer& a) { a.chunks.pop_back(); }},
        Damage{"ChunkTwice", "where chunk", [](Answer& a) { a.chunks[2] = a.chunks[1]; }},
        Damage{"ChunkTooMany", "chunk 4", [](Answer& a) { a.chunks.emplace_back(a.chunks[3]).set_index(4); }},
        Damage{"ChunksSwapped", "where chunk 0", [](Answer& a) { std::swap(a.chunks[0], a.chunks[1]); }},
        Damage{"ArraysSwapped", "simplices after 2 of 4 points",
               [](Answer& a) {
                 std::swap(a.chunks[1], a.chunks[2]);
                 a.chunks[1].set_index(1);
                 a.chunks[2].set_index(2);
               }},
        Damage{"ChunkEmpty", "0 arrays", [](Answer& a) { a.chunks[3].clear_input_vertices(); }},
        Damage{"TwoArrays", "2 arrays", [](Answer& a) { a.chunks[0].add_simplices(0); }},
        Damage{"BitFlippedInPoints", "CRC32C", [](Answer& a) { a.chunks[0].set_points(0, -0.0); }},
        Damage{"BitFlippedInSimplices", "CRC32C", [](Answer& a) { a.chunks[2].set_simplices(0, 1); }},
        Damage{"BitFlippedInInputVertices", "CRC32C", [](Answer& a) { a.chunks[3].set_input_vertices(0, 1); }},
        Damage{"BitFlippedInChecksum", "CRC32C", [](Answer& a) { a.chunks[1].set_crc32c(a.chunks[1].crc32c() ^ 1); }},
        Damage{"RaggedPoints", "no multiple of 2",
               [](Answer& a) {
                 a.chunks[0].mutable_points()->RemoveLast();
                 Sign(a.chunks[0]);
               }},
        Damage{"RaggedSimplices", "no multiple of 3",
               [](Answer& a) {
                 a.chunks[2].mutable_simplices()->RemoveLast();
                 Sign(a.chunks[2]);
               }},
        Damage{"SimplexOfNoVertex", "name vertex 4 of 4",
               [](Answer& a) {
                 a.chunks[2].set_simplices(3, 4);
                 Sign(a.chunks[2]);
               }},
        Damage{"WeightsMissing", "simplices after 0 of 4 weights",
               [](Answer& a) {
                 a = WeightedAnswer();
                 a.metadata.set_chunk_count(4);
                 a.chunks.erase(a.chunks.begin() + 2);
                 a.chunks[2].set_index(2);
               }},
        Damage{"WeightsNotAnnounced", "more than the announced 0 weights",
               [](Answer& a) {
                 a = WeightedAnswer();
                 a.metadata.set_has_weights(false);
               }},
        Damage{"WeightsFew", "simplices after 3 of 4 weights",
               [](Answer& a) {
                 a = WeightedAnswer();
                 a.chunks[2].mutable_weights()->RemoveLast();
                 Sign(a.chunks[2]);
               }},
        Damage{"BitFlippedInWeights", "CRC32C",
               [](Answer& a) {
                 a = WeightedAnswer();
                 a.chunks[2].set_weights(0, -0.0);
               }},
        Damage{"InputOfNoVertex", "name vertex 4294967294 of 4",
               [](Answer& a) {
                 a.chunks[3].set_input_vertices(0, 0xFFFFFFFEu);
                 Sign(a.chunks[3]);
               }}),
    [](const auto& test) { return test.param.name; });

TEST(MeshReceiver, RefusesAChunkBeforeTheMetadata) {
  MeshCollector collector;
  MeshReceiver receiver(collector, kOnePointIn2D);
  EXPECT_EQ(receiver.AddChunk(GoodAnswer().chunks[0]).code(), absl::StatusCode::kDataLoss);
}

INSTANTIATE_TEST_SUITE_P(
    Numbers, MeshReceiverRefuses,
    ::testing::Values(
        Damage{"PointThatIsNoNumber", "a coordinate of a vertex is nan",
               [](Answer& a) {
                 a.chunks[1].set_points(1, std::numeric_limits<double>::quiet_NaN());
                 Sign(a.chunks[1]);
               }},
        Damage{"PointThatIsInfinite", "a coordinate of a vertex is -inf",
               [](Answer& a) {
                 a.chunks[0].set_points(0, -std::numeric_limits<double>::infinity());
                 Sign(a.chunks[0]);
               }},
        Damage{"WeightNegative", "the weight of a vertex is -1",
               [](Answer& a) {
                 a = WeightedAnswer();
                 a.chunks[2].set_weights(0, -1);
                 Sign(a.chunks[2]);
               }},
        Damage{"DomainThatIsNoNumber", "a domain from nan",
               [](Answer& a) { a.metadata.mutable_domain()->set_low(0, std::numeric_limits<double>::quiet_NaN()); }},
        Damage{"DomainInverted", "along axis 1", [](Answer& a) { a.metadata.mutable_domain()->set_high(1, -1e9); }},
        Damage{"SliverOfNoVertex", "slivers name vertex 4 of 4",
               [](Answer& a) {
                 a.metadata.mutable_statistics()->mutable_slivers()->add_flattest_left()->add_vertices(4);
               }}),
    [](const auto& test) { return test.param.name; });

TEST(MeshReceiver, RefusesASecondMetadata) {
  MeshCollector collector;
  MeshReceiver receiver(collector, kOnePointIn2D);
  ASSERT_TRUE(receiver.SetMetadata(GoodAnswer().metadata).ok());
  EXPECT_EQ(receiver.SetMetadata(GoodAnswer().metadata).code(), absl::StatusCode::kDataLoss);
}

TEST(MeshReceiver, RefusesAnEndWithoutAMesh) {
  MeshCollector collector;
  EXPECT_EQ(MeshReceiver(collector, kOnePointIn2D).Finish().code(), absl::StatusCode::kDataLoss);
}

// Broken off after each number of chunks in turn.
TEST(MeshReceiver, ContinuesWhereTheStreamBrokeOff) {
  const Answer answer = GoodAnswer();
  const absl::StatusOr<Mesh> whole = Assemble(answer);
  ASSERT_TRUE(whole.ok());
  for (size_t broken_at = 0; broken_at <= answer.chunks.size(); ++broken_at) {
    MeshCollector collector;
    MeshReceiver receiver(collector, {});
    ASSERT_TRUE(receiver.SetMetadata(answer.metadata).ok());
    for (size_t i = 0; i < broken_at; ++i) {
      ASSERT_TRUE(receiver.AddChunk(answer.chunks[i]).ok());
    }
    EXPECT_EQ(receiver.next_chunk(), broken_at);
    receiver.Continue();
    EXPECT_EQ(receiver.AddChunk(answer.chunks[0]).code(), absl::StatusCode::kDataLoss);
    ASSERT_TRUE(receiver.SetMetadata(answer.metadata).ok());
    for (size_t i = broken_at; i < answer.chunks.size(); ++i) {
      ASSERT_TRUE(receiver.AddChunk(answer.chunks[i]).ok());
    }
    ASSERT_TRUE(receiver.Finish().ok());
    EXPECT_EQ(collector.mesh().points, whole->points);
    EXPECT_EQ(collector.mesh().simplices, whole->simplices);
    EXPECT_EQ(collector.mesh().input_vertex, whole->input_vertex);
  }
}

// The square as part 0 of 2, which owns the first triangle and its vertices; the second is a ghost.
Answer PartAnswer() {
  Answer answer = GoodAnswer();
  v1::MeshMetadata& metadata = answer.metadata;
  metadata.set_input_point_count(0);
  metadata.set_chunk_count(8);
  v1::MeshPartInfo& part = *metadata.mutable_part();
  part.set_parts(2);
  part.set_own_vertex_count(3);
  part.set_own_simplex_count(1);
  part.set_whole_vertex_count(9);
  part.set_whole_simplex_count(5);
  answer.chunks.resize(8);
  answer.chunks[3].Clear();
  const auto fill = [&answer](int chunk, google::protobuf::RepeatedField<uint32_t>* (v1::MeshChunk::*field)(),
                              const std::vector<uint32_t>& values) {
    (answer.chunks[chunk].*field)()->Assign(values.begin(), values.end());
    answer.chunks[chunk].set_crc32c(Crc32c(values.data(), values.size() * sizeof(uint32_t)));
    answer.chunks[chunk].set_index(chunk);
  };
  fill(3, &v1::MeshChunk::mutable_vertex_ids, {0, 1, 2, 8});
  fill(4, &v1::MeshChunk::mutable_vertex_owners, {0, 0, 0, 1});
  fill(5, &v1::MeshChunk::mutable_vertex_rows, {0, 1, 2, 3});
  fill(6, &v1::MeshChunk::mutable_simplex_ids, {0, 4});
  fill(7, &v1::MeshChunk::mutable_simplex_owners, {0, 1});
  return answer;
}

absl::StatusOr<Mesh> AssemblePart(const Answer& answer, const PartOptions& wanted = {.parts = 2, .part = 0}) {
  return Assemble(answer, {.part = wanted});
}

TEST(MeshReceiver, AssemblesAPart) {
  const absl::StatusOr<Mesh> mesh = AssemblePart(PartAnswer());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_TRUE(mesh->part.has_value());
  EXPECT_EQ(mesh->part->parts, 2u);
  EXPECT_EQ(mesh->part->own_vertex_count, 3u);
  EXPECT_EQ(mesh->part->whole_simplex_count, 5u);
  EXPECT_THAT(mesh->part->vertex_ids, ElementsAre(0, 1, 2, 8));
  EXPECT_THAT(mesh->part->vertex_owners, ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(mesh->part->vertex_rows, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(mesh->part->simplex_ids, ElementsAre(0, 4));
  EXPECT_THAT(mesh->part->simplex_owners, ElementsAre(0, 1));
  EXPECT_TRUE(mesh->part->facet_ids.empty());
  EXPECT_FALSE(Assemble(GoodAnswer())->part.has_value());
}

TEST(MeshReceiver, RefusesAnotherPartAndNumbersThatCannotBe) {
  EXPECT_EQ(AssemblePart(GoodAnswer()).status().code(), absl::StatusCode::kUnimplemented);
  const auto message_of = [](const std::function<void(Answer&)>& damage) {
    Answer answer = PartAnswer();
    damage(answer);
    const absl::Status status = AssemblePart(answer).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    return std::string(status.message());
  };
  const auto sign = [](v1::MeshChunk& chunk, const google::protobuf::RepeatedField<uint32_t>& values) {
    chunk.set_crc32c(Crc32c(values.data(), values.size() * sizeof(uint32_t)));
  };
  EXPECT_THAT(std::string(Assemble(PartAnswer(), {}).status().message()), HasSubstr("which was not asked for"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_part()->set_part(1); }), HasSubstr("not asked for"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_part()->set_parts(3); }), HasSubstr("not asked for"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_part()->set_own_vertex_count(5); }), HasSubstr("owns 5"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_part()->set_own_simplex_count(kHuge); }),
              HasSubstr("of the whole mesh"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_part()->set_whole_vertex_count(3); }), HasSubstr("of 3,"));
  EXPECT_THAT(message_of([](Answer& a) { a.metadata.mutable_part()->set_whole_simplex_count(kHuge); }),
              HasSubstr("of the whole mesh"));
  EXPECT_THAT(message_of([&](Answer& a) {
                a.chunks[3].set_vertex_ids(3, 9);
                sign(a.chunks[3], a.chunks[3].vertex_ids());
              }),
              HasSubstr("names the number 9 of 9"));
  EXPECT_THAT(message_of([&](Answer& a) {
                a.chunks[4].set_vertex_owners(3, 0);
                sign(a.chunks[4], a.chunks[4].vertex_owners());
              }),
              HasSubstr("has the owner 0"));
  EXPECT_THAT(message_of([&](Answer& a) {
                a.chunks[7].set_simplex_owners(1, 2);
                sign(a.chunks[7], a.chunks[7].simplex_owners());
              }),
              HasSubstr("has the owner 2"));
  EXPECT_THAT(message_of([](Answer& a) { a.chunks[6].set_simplex_ids(0, 1); }), HasSubstr("CRC32C"));
  EXPECT_THAT(message_of([](Answer& a) {
                a.chunks.pop_back();
                a.metadata.set_chunk_count(7);
              }),
              HasSubstr("0 of 2 simplex owners"));
}

TEST(MeshReceiver, RefusesToContinueAnotherMesh) {
  MeshCollector collector;
  MeshReceiver receiver(collector, kOnePointIn2D);
  v1::MeshMetadata metadata = GoodAnswer().metadata;
  ASSERT_TRUE(receiver.SetMetadata(metadata).ok());
  receiver.Continue();
  metadata.set_revision(7);
  const absl::Status status = receiver.SetMetadata(metadata);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), HasSubstr("another mesh: revision 7"));
}

}  // namespace
}  // namespace wellspace::client
