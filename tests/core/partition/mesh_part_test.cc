// Parts of meshes, compared with sets of vertices.
#include "core/partition/mesh_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "tests/support/meshes.h"

namespace wellspace::core {
namespace {

using test::KuhnGrid;
using test::TestMesh;
using ::testing::HasSubstr;

using Corners = std::vector<uint32_t>;

Corners RowOf(std::span<const uint32_t> rows, size_t i, size_t size) {
  return {rows.begin() + i * size, rows.begin() + (i + 1) * size};
}

// The facets of one simplex alone.
std::vector<uint32_t> OuterFacets(const TestMesh& mesh) {
  std::map<Corners, std::pair<int, Corners>> counts;
  const size_t row = mesh.dimension + 1;
  for (size_t s = 0; s < mesh.SimplexCount(); ++s) {
    const Corners corners = RowOf(mesh.simplices, s, row);
    for (size_t slot = 0; slot < row; ++slot) {
      Corners facet = corners;
      facet.erase(facet.begin() + slot);
      Corners sorted = facet;
      std::sort(sorted.begin(), sorted.end());
      auto& [count, given] = counts[sorted];
      ++count;
      given = facet;
    }
  }
  std::vector<uint32_t> facets;
  for (const auto& [sorted, entry] : counts) {
    if (entry.first == 1) {
      facets.insert(facets.end(), entry.second.begin(), entry.second.end());
    }
  }
  return facets;
}

struct Case {
  int dimension;
  uint32_t cells;
  uint32_t parts;
  uint32_t layers;
};

class MeshPartTest : public testing::TestWithParam<Case> {
 protected:
  MeshPartTest() : mesh_(KuhnGrid(GetParam().dimension, GetParam().cells)), facets_(OuterFacets(mesh_)) {
    std::mt19937 random(7);  // no partition that makes sense: parts in many pieces
    for (size_t s = 0; s < mesh_.SimplexCount(); ++s) {
      part_of_.push_back(random() % GetParam().parts);
    }
  }

  PartitionedMesh View() const {
    return {mesh_.dimension, mesh_.VertexCount() + 1, mesh_.simplices, facets_, part_of_};  // one vertex is of none
  }

  TestMesh mesh_;
  std::vector<uint32_t> facets_;
  std::vector<uint32_t> part_of_;
};

TEST_P(MeshPartTest, EverythingIsOwnedOnceByTheLowestPart) {
  const RunContext context;
  const absl::StatusOr<PartOwners> owners = FindOwners(View(), context);
  ASSERT_TRUE(owners.ok()) << owners.status();
  const size_t row = mesh_.dimension + 1;
  std::vector<uint32_t> lowest(mesh_.VertexCount() + 1, GetParam().parts);
  for (size_t i = 0; i < mesh_.simplices.size(); ++i) {
    lowest[mesh_.simplices[i]] = std::min(lowest[mesh_.simplices[i]], part_of_[i / row]);
  }
  lowest.back() = 0;
  EXPECT_TRUE(std::equal(lowest.begin(), lowest.end(), owners->of_vertices.begin(), owners->of_vertices.end()));
  // Rows: sorted by owners, then by numbers.
  std::vector<uint32_t> order(lowest.size());
  for (uint32_t v = 0; v < order.size(); ++v) {
    order[owners->rows[v]] = v;
  }
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return std::pair(lowest[a], a) < std::pair(lowest[b], b);
  }));
}

TEST_P(MeshPartTest, PartsAddUpToTheMesh) {
  const RunContext context;
  const absl::StatusOr<PartOwners> owners = FindOwners(View(), context);
  ASSERT_TRUE(owners.ok()) << owners.status();
  const size_t row = mesh_.dimension + 1;
  std::vector<int> vertices(mesh_.VertexCount() + 1, 0);
  std::vector<int> simplices(mesh_.SimplexCount(), 0);
  std::vector<int> facets(facets_.size() / mesh_.dimension, 0);
  for (uint32_t part = 0; part < GetParam().parts; ++part) {
    const absl::StatusOr<MeshPart> taken = TakePart(View(), *owners, part, GetParam().layers, context);
    ASSERT_TRUE(taken.ok()) << taken.status();
    for (uint64_t v = 0; v < taken->own_vertices; ++v) {
      ++vertices[taken->vertices[v]];
    }
    for (uint64_t s = 0; s < taken->own_simplices; ++s) {
      ++simplices[taken->simplices[s]];
      EXPECT_EQ(part_of_[taken->simplices[s]], part);
    }
    for (const uint32_t f : taken->facets) {
      ++facets[f];
    }
    ASSERT_EQ(taken->simplex_corners.size(), taken->simplices.size() * row);
    for (size_t i = 0; i < taken->simplex_corners.size(); ++i) {
      ASSERT_EQ(taken->vertices.at(taken->simplex_corners[i]),
                mesh_.simplices[taken->simplices[i / row] * row + i % row]);
    }
    ASSERT_EQ(taken->facet_corners.size(), taken->facets.size() * mesh_.dimension);
    for (size_t i = 0; i < taken->facet_corners.size(); ++i) {
      ASSERT_EQ(taken->vertices.at(taken->facet_corners[i]),
                facets_[taken->facets[i / mesh_.dimension] * mesh_.dimension + i % mesh_.dimension]);
    }
  }
  EXPECT_THAT(vertices, testing::Each(1));
  EXPECT_THAT(simplices, testing::Each(1));
  EXPECT_THAT(facets, testing::Each(1));
}

TEST_P(MeshPartTest, GhostsAreTheSimplicesAround) {
  const RunContext context;
  const absl::StatusOr<PartOwners> owners = FindOwners(View(), context);
  ASSERT_TRUE(owners.ok());
  const size_t row = mesh_.dimension + 1;
  for (uint32_t part = 0; part < GetParam().parts; ++part) {
    const absl::StatusOr<MeshPart> taken = TakePart(View(), *owners, part, GetParam().layers, context);
    ASSERT_TRUE(taken.ok());
    std::set<uint32_t> around;
    for (uint32_t s = 0; s < part_of_.size(); ++s) {
      if (part_of_[s] == part) {
        around.insert(s);
      }
    }
    std::vector<uint32_t> expected(around.begin(), around.end());
    for (uint32_t layer = 0; layer < GetParam().layers; ++layer) {
      std::set<uint32_t> vertices;
      for (const uint32_t s : around) {
        for (const uint32_t v : RowOf(mesh_.simplices, s, row)) {
          vertices.insert(v);
        }
      }
      for (uint32_t s = 0; s < part_of_.size(); ++s) {
        const Corners corners = RowOf(mesh_.simplices, s, row);
        if (!around.contains(s) &&
            std::any_of(corners.begin(), corners.end(), [&](uint32_t v) { return vertices.contains(v); })) {
          expected.push_back(s);
        }
      }
      around.insert(expected.begin(), expected.end());
    }
    EXPECT_EQ(std::vector<uint32_t>(taken->simplices.begin(), taken->simplices.end()), expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, MeshPartTest,
                         testing::Values(Case{2, 6, 3, 0}, Case{2, 6, 5, 1}, Case{2, 9, 4, 2}, Case{3, 4, 3, 0},
                                         Case{3, 4, 6, 1}, Case{3, 3, 2, 9}, Case{4, 2, 3, 1}));

TEST(MeshPartTest, CountsInRuns) {
  EXPECT_THAT(CountInRuns(std::vector<uint64_t>{2, 0, 3, 1}, std::vector<uint32_t>{0, 1, 3, 4, 5}),
              testing::ElementsAre(2, 0, 2, 1));
  EXPECT_THAT(CountInRuns(std::vector<uint64_t>{2, 3}, {}), testing::ElementsAre(0, 0));
}

// A part takes the memory of its marks in the mesh, then what it has itself.
TEST(MeshPartTest, MemoryOfASmallPartIsSmall) {
  class Asked : public MemoryLender {
   public:
    absl::Status Reserve(uint64_t bytes) override {
      bytes_.push_back(bytes);
      return absl::OkStatus();
    }
    absl::Status Allow(uint64_t) override { return absl::OkStatus(); }
    std::vector<uint64_t> bytes_;
  } lender;
  const TestMesh mesh = KuhnGrid(3, 12);
  std::vector<uint32_t> part_of(mesh.SimplexCount(), 0);
  part_of[0] = 1;
  const PartitionedMesh view{3, mesh.VertexCount(), mesh.simplices, {}, part_of};
  RunContext context;
  const PartOwners owners = FindOwners(view, context).value();
  context.SetMemoryLender(&lender);
  ASSERT_TRUE(TakePart(view, owners, 1, 0, context).ok());
  const uint64_t marks = 2 * mesh.SimplexCount() + mesh.VertexCount();
  EXPECT_THAT(lender.bytes_, testing::ElementsAre(marks, marks + 4 * mesh.VertexCount() + 4 * (4 + 5)));
}

TEST(MeshPartTest, AFacetOfNoSimplexIsNamed) {
  const RunContext context;
  const TestMesh mesh = KuhnGrid(2, 1);
  const std::vector<uint32_t> part_of = {0, 1};
  const std::vector<uint32_t> facets = {mesh.simplices[0], mesh.simplices[1], 1, 2};
  EXPECT_THAT(FindOwners({2, 4, mesh.simplices, facets, part_of}, context).status().ToString(),
              HasSubstr("facets[1] is no facet of a simplex"));
}

}  // namespace
}  // namespace wellspace::core
