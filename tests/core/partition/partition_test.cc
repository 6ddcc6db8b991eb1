// Partitions of meshes: even, small cuts, the same each time, and no worse than the program gpmetis.
#include "core/partition/partition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::core {
namespace {

using test::KuhnGrid;
using test::TestMesh;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

DualGraph GraphOf(const TestMesh& mesh) {
  const RunContext context;
  absl::StatusOr<DualGraph> graph = FindDualGraph(mesh.dimension, mesh.simplices, context);
  EXPECT_TRUE(graph.ok()) << graph.status();
  return *std::move(graph);
}

HugeVector<uint32_t> PartsOf(const DualGraph& graph, const PartitionOptions& options) {
  const RunContext context;
  absl::StatusOr<HugeVector<uint32_t>> parts = Partition(graph, options, context);
  EXPECT_TRUE(parts.ok()) << parts.status();
  return *std::move(parts);
}

std::vector<uint64_t> SizesOf(const HugeVector<uint32_t>& part_of, uint32_t parts) {
  std::vector<uint64_t> sizes(parts, 0);
  for (const uint32_t part : part_of) {
    ++sizes.at(part);
  }
  return sizes;
}

// By comparison of all pairs.
std::vector<std::vector<int32_t>> NeighboursByAllPairs(const TestMesh& mesh) {
  std::vector<std::set<uint32_t>> corners;
  const size_t row = mesh.dimension + 1;
  for (size_t s = 0; s < mesh.SimplexCount(); ++s) {
    corners.emplace_back(mesh.simplices.begin() + s * row, mesh.simplices.begin() + (s + 1) * row);
  }
  std::vector<std::vector<int32_t>> neighbours(corners.size());
  for (size_t a = 0; a < corners.size(); ++a) {
    for (size_t b = 0; b < corners.size(); ++b) {
      std::vector<uint32_t> common;
      std::set_intersection(corners[a].begin(), corners[a].end(), corners[b].begin(), corners[b].end(),
                            std::back_inserter(common));
      if (a != b && common.size() == static_cast<size_t>(mesh.dimension)) {
        neighbours[a].push_back(static_cast<int32_t>(b));
      }
    }
  }
  return neighbours;
}

class DualGraphTest : public testing::TestWithParam<int> {};

TEST_P(DualGraphTest, HasTheNeighboursThatAllPairsHave) {
  const int dimension = GetParam();
  const TestMesh mesh = KuhnGrid(dimension, dimension <= 3 ? 3 : 1);
  const DualGraph graph = GraphOf(mesh);
  const std::vector<std::vector<int32_t>> expected = NeighboursByAllPairs(mesh);
  ASSERT_EQ(graph.simplex_count(), expected.size());
  for (size_t s = 0; s < expected.size(); ++s) {
    EXPECT_EQ(
        std::vector<int32_t>(graph.neighbours.begin() + graph.first[s], graph.neighbours.begin() + graph.first[s + 1]),
        expected[s]);
  }
}

INSTANTIATE_TEST_SUITE_P(Dimensions, DualGraphTest, testing::Values(2, 3, 4, 5));

TEST(DualGraphTest, RefusesAFacetOfThreeSimplices) {
  const RunContext context;
  const std::vector<uint32_t> simplices = {0, 1, 2, 0, 1, 3, 1, 0, 4};
  EXPECT_THAT(FindDualGraph(2, simplices, context).status().ToString(),
              HasSubstr("simplices 0, 1 and 2 have a facet in common"));
}

class PartitionTest : public testing::TestWithParam<uint32_t> {};

TEST_P(PartitionTest, PartsAreEvenAndNoneIsEmpty) {
  const uint32_t parts = GetParam();
  const DualGraph graph = GraphOf(KuhnGrid(3, 6));  // 1 296
  const HugeVector<uint32_t> part_of = PartsOf(graph, {.parts = parts});
  const std::vector<uint64_t> sizes = SizesOf(part_of, parts);
  const double mean = 1296.0 / parts;
  EXPECT_GE(*std::min_element(sizes.begin(), sizes.end()), 1u);
  EXPECT_LE(static_cast<double>(*std::max_element(sizes.begin(), sizes.end())),
            std::max((1 + kMostImbalance) * mean, std::ceil(mean) + 1));
  EXPECT_EQ(part_of, PartsOf(graph, {.parts = parts}));
}

INSTANTIATE_TEST_SUITE_P(Counts, PartitionTest, testing::Values(1, 2, 3, 8, 64, 500, 1295, 1296));

TEST(PartitionTest, PartsHangTogetherWhereThatIsAskedFor) {
  const DualGraph graph = GraphOf(KuhnGrid(2, 20));
  constexpr uint32_t kParts = 7;
  const HugeVector<uint32_t> part_of = PartsOf(graph, {.parts = kParts, .contiguous = true});
  std::vector<int> pieces(kParts, 0);
  std::vector<bool> seen(part_of.size(), false);
  for (uint32_t s = 0; s < part_of.size(); ++s) {
    if (seen[s]) {
      continue;
    }
    ++pieces[part_of[s]];
    std::vector<uint32_t> open = {s};
    seen[s] = true;
    while (!open.empty()) {
      const uint32_t at = open.back();
      open.pop_back();
      for (int32_t i = graph.first[at]; i < graph.first[at + 1]; ++i) {
        const auto other = static_cast<uint32_t>(graph.neighbours[i]);
        if (!seen[other] && part_of[other] == part_of[s]) {
          seen[other] = true;
          open.push_back(other);
        }
      }
    }
  }
  EXPECT_THAT(pieces, testing::Each(1));
}

// The same library, with its own defaults: so this tells whether the graph is right.
TEST(PartitionTest, CutsAsFewFacetsAsGpmetis) {
  const DualGraph graph = GraphOf(KuhnGrid(3, 12));  // 10 368
  TemporaryFolder folder;
  const std::string file = folder.Path("mesh.graph");
  {
    std::ofstream out(file);
    out << graph.simplex_count() << " " << graph.neighbours.size() / 2 << "\n";
    for (uint64_t s = 0; s < graph.simplex_count(); ++s) {
      for (int32_t i = graph.first[s]; i < graph.first[s + 1]; ++i) {
        out << graph.neighbours[i] + 1 << " ";
      }
      out << "\n";
    }
  }
  for (const uint32_t parts : {2u, 8u, 32u}) {
    ASSERT_EQ(std::system(absl::StrCat("gpmetis ", file, " ", parts, " >", file, ".log").c_str()), 0);
    HugeVector<uint32_t> theirs;
    std::ifstream in(absl::StrCat(file, ".part.", parts));
    for (uint32_t part = 0; in >> part;) {
      theirs.push_back(part);
    }
    ASSERT_EQ(theirs.size(), graph.simplex_count());
    EXPECT_LE(static_cast<double>(CountCut(graph, PartsOf(graph, {.parts = parts}))),
              1.05 * static_cast<double>(CountCut(graph, theirs)))
        << parts;
  }
}

TEST(PartitionTest, RefusesNumbersOfPartsThatTheMeshCannotHave) {
  const DualGraph graph = GraphOf(KuhnGrid(2, 1));
  const RunContext context;
  EXPECT_THAT(Partition(graph, {.parts = 0}, context).status().ToString(),
              HasSubstr("parts: 0 is not a number from 1"));
  EXPECT_THAT(Partition(graph, {.parts = 3}, context).status().ToString(),
              HasSubstr("parts: 3 parts of a mesh of 2 simplices"));
  EXPECT_THAT(Partition(graph, {.parts = kMaxParts + 1}, context).status().ToString(), HasSubstr("parts: 1048577"));
  EXPECT_THAT(PartsOf(graph, {.parts = 2}), testing::UnorderedElementsAre(0, 1));
}

TEST(PartitionTest, ACancelEndsItAtOnce) {
  const DualGraph graph = GraphOf(KuhnGrid(3, 40));  // 384 000: METIS takes longer than the test may
  RunContext context;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    context.Cancel();
  });
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status status = Partition(graph, {.parts = 4096}, context).status();
  const auto taken = std::chrono::steady_clock::now() - begin;
  canceller.join();
  EXPECT_TRUE(absl::IsCancelled(status)) << status;
  EXPECT_LT(taken, std::chrono::milliseconds(1000));
}

// A process may have been started so; then the kernel does not tell how another one has ended.
TEST(PartitionTest, IsTheSameWhereEndedProcessesAreIgnored) {
  const DualGraph graph = GraphOf(KuhnGrid(3, 6));
  const HugeVector<uint32_t> expected = PartsOf(graph, {.parts = 8});
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  EXPECT_EQ(PartsOf(graph, {.parts = 8}), expected);
  std::signal(SIGCHLD, before);
}

TEST(PartitionTest, MemoryIsAskedForBeforeTheWork) {
  class Refuses : public MemoryLender {
   public:
    absl::Status Reserve(uint64_t bytes) override {
      asked_ = bytes;
      return absl::ResourceExhaustedError("no");
    }
    absl::Status Allow(uint64_t) override { return absl::OkStatus(); }
    uint64_t asked_ = 0;
  } lender;
  RunContext context;
  context.SetMemoryLender(&lender);
  const TestMesh mesh = KuhnGrid(3, 4);
  const DualGraph graph = GraphOf(mesh);
  EXPECT_TRUE(absl::IsResourceExhausted(FindDualGraph(3, mesh.simplices, context).status()));
  EXPECT_EQ(lender.asked_, DualGraphBytes(3, mesh.SimplexCount()));
  EXPECT_TRUE(absl::IsResourceExhausted(Partition(graph, {.parts = 2}, context).status()));
  EXPECT_GT(lender.asked_, graph.neighbours.size() * sizeof(int32_t));
}

}  // namespace
}  // namespace wellspace::core
