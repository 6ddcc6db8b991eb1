// The pool of the vertices of leaves, against vectors, and its memory.
#include "core/tree/leaf_vertices.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

constexpr int kMost = 32;
using VertexPool = LeafVertexPool<3, kMost>;
using Held = std::vector<std::pair<VertexId, Point<3>>>;

class LeafVertexPoolTest : public test::SeededTest {
 protected:
  LeafVertexPoolTest() : SeededTest(1978) {}
};

TEST_F(LeafVertexPoolTest, HoldsWhatAModelHolds) {
  VertexPool pool;
  std::map<uint32_t, Held> model;
  uint32_t next = 0;
  for (int step = 0; step < 20000; ++step) {
    const auto chosen = model.empty() ? model.end() : std::next(model.begin(), random_.Below(model.size()));
    if (chosen == model.end() || random_.Below(20) == 0) {
      const uint32_t number = pool.Add(static_cast<uint32_t>(random_.Below(kMost)));
      ASSERT_TRUE(model.emplace(number, Held{}).second) << "leaf " << number << " is in use";
    } else if (random_.Below(25) == 0) {
      Held gone;
      pool.Dissolve(chosen->first, [&](VertexId v, const Point<3>& p) { gone.emplace_back(v, p); });
      ASSERT_EQ(gone, chosen->second);
      model.erase(chosen);
    } else if (chosen->second.size() < kMost) {
      const Point<3> p = {random_.Unit(), random_.Unit(), random_.Unit()};
      pool.Append(chosen->first, VertexId{next}, p);
      chosen->second.emplace_back(VertexId{next++}, p);
    }
  }
  for (const auto& [number, held] : model) {
    const VertexPool::LeafVertices& leaf = pool[number];
    ASSERT_EQ(leaf.count, held.size());
    for (uint32_t i = 0; i < leaf.count; ++i) {
      ASSERT_EQ(std::pair(leaf.ids[i], leaf.positions[i]), held[i]);
    }
  }
}

TEST_F(LeafVertexPoolTest, TakeWhatTheirVerticesNeed) {
  constexpr uint32_t kCount = 1000;
  constexpr size_t kPlace = sizeof(Point<3>) + sizeof(VertexId);
  VertexPool pool;
  for (uint32_t i = 0; i < kCount; ++i) {
    pool.Append(pool.Add(1), VertexId{i}, {});
  }
  EXPECT_EQ(pool.MemoryBytes(), kCount * VertexPool::BytesFor(1));
  EXPECT_LE(VertexPool::BytesFor(1), sizeof(VertexPool::LeafVertices) + kMost / 8 * kPlace);
  EXPECT_EQ(VertexPool::BytesFor(kMost), sizeof(VertexPool::LeafVertices) + kMost * kPlace);
  // Places that are given back serve again.
  const uint64_t bytes = pool.MemoryBytes();
  for (uint32_t i = 0; i < kCount; ++i) {
    pool.Dissolve(i, [](VertexId, const Point<3>&) {});
  }
  for (uint32_t i = 0; i < kCount; ++i) {
    pool.Add(1);
  }
  EXPECT_EQ(pool.MemoryBytes(), bytes);
}

}  // namespace
}  // namespace wellspace::core
