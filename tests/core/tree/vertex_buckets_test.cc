// Buckets of vertices against vectors, and what they take in memory.
#include "core/tree/vertex_buckets.h"

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
using Buckets = VertexBuckets<3, kMost>;
using Held = std::vector<std::pair<VertexId, Point<3>>>;

class VertexBucketsTest : public test::SeededTest {
 protected:
  VertexBucketsTest() : SeededTest(1978) {}
};

TEST_F(VertexBucketsTest, HoldWhatAModelHolds) {
  Buckets buckets;
  std::map<uint32_t, Held> model;
  uint32_t next = 0;
  for (int step = 0; step < 20000; ++step) {
    const auto chosen = model.empty() ? model.end() : std::next(model.begin(), random_.Below(model.size()));
    if (chosen == model.end() || random_.Below(20) == 0) {
      const uint32_t number = buckets.Add(static_cast<uint32_t>(random_.Below(kMost)));
      ASSERT_TRUE(model.emplace(number, Held{}).second) << "bucket " << number << " is in use";
    } else if (random_.Below(25) == 0) {
      Held gone;
      buckets.Dissolve(chosen->first, [&](VertexId v, const Point<3>& p) { gone.emplace_back(v, p); });
      ASSERT_EQ(gone, chosen->second);
      model.erase(chosen);
    } else if (chosen->second.size() < kMost) {
      const Point<3> p = {random_.Unit(), random_.Unit(), random_.Unit()};
      buckets.Append(chosen->first, VertexId{next}, p);
      chosen->second.emplace_back(VertexId{next++}, p);
    }
  }
  for (const auto& [number, held] : model) {
    const Buckets::Bucket& bucket = buckets[number];
    ASSERT_EQ(bucket.count, held.size());
    for (uint32_t i = 0; i < bucket.count; ++i) {
      ASSERT_EQ(std::pair(bucket.ids[i], bucket.positions[i]), held[i]);
    }
  }
}

TEST_F(VertexBucketsTest, TakeWhatTheirVerticesNeed) {
  constexpr uint32_t kCount = 1000;
  constexpr size_t kPlace = sizeof(Point<3>) + sizeof(VertexId);
  Buckets buckets;
  for (uint32_t i = 0; i < kCount; ++i) {
    buckets.Append(buckets.Add(1), VertexId{i}, {});
  }
  EXPECT_EQ(buckets.MemoryBytes(), kCount * Buckets::BytesFor(1));
  EXPECT_LE(Buckets::BytesFor(1), sizeof(Buckets::Bucket) + kMost / 8 * kPlace);
  EXPECT_EQ(Buckets::BytesFor(kMost), sizeof(Buckets::Bucket) + kMost * kPlace);
  // What is given back serves again.
  const uint64_t bytes = buckets.MemoryBytes();
  for (uint32_t i = 0; i < kCount; ++i) {
    buckets.Dissolve(i, [](VertexId, const Point<3>&) {});
  }
  for (uint32_t i = 0; i < kCount; ++i) {
    buckets.Add(1);
  }
  EXPECT_EQ(buckets.MemoryBytes(), bytes);
}

}  // namespace
}  // namespace wellspace::core
