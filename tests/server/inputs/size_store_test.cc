// Sizes at points come out of store and records as they came in.
#include "server/inputs/size_store.h"

#include <memory>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

// Samples in several chunks, so many that they take several records.
std::shared_ptr<const core::SizeSamples> TakenSamples() {
  SizeStore store;
  for (int from = 0; from < 60'000; from += 20'000) {
    v1::SizeSamples chunk;
    for (int i = from; i < from + 20'000; ++i) {
      chunk.add_points(i);
      chunk.add_points(-i);
      chunk.add_sizes(1 + i);
    }
    store.Append(&chunk);
  }
  EXPECT_EQ(store.count(), 60'000u);
  EXPECT_GE(store.bytes(), 60'000 * 3 * sizeof(double));
  std::shared_ptr<const core::SizeSamples> samples = store.Take(core::RunContext());
  EXPECT_EQ(store.count(), 0u);
  EXPECT_EQ(store.bytes(), 0u);
  return samples;
}

TEST(SizeStore, SamplesComeOutAsTheyCameAndThroughRecordsThatAreMadeInTurn) {
  const std::shared_ptr<const core::SizeSamples> samples = TakenSamples();
  ASSERT_NE(samples, nullptr);
  ASSERT_EQ(samples->sizes.size(), 60'000u);
  EXPECT_EQ(samples->points[2 * 45'678 + 1], -45'678);
  EXPECT_EQ(samples->sizes[45'678], 45'679);
  const StoredSizes stored = RecordsOf(3, samples, 2);
  EXPECT_EQ(stored.number, 3u);
  EXPECT_TRUE(stored.parts.empty()) << "none is there before it is written";
  EXPECT_EQ(stored.in_turn.count, 4u);
  EXPECT_EQ(stored.in_turn.bytes, samples->bytes());
  std::vector<store::v1::SizesRecord> parts;
  for (size_t i = 0; i < stored.in_turn.count; ++i) {
    parts.push_back(stored.in_turn.make(i));
  }
  const std::shared_ptr<const core::SizeSamples> again = SamplesOf(std::move(parts));
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(*again, *samples);
}

TEST(SizeStore, SizesOfVerticesGetTheirPoints) {
  SizeStore store;
  EXPECT_EQ(store.Take(core::RunContext()), nullptr);
  v1::VertexSizes sizes;
  sizes.add_sizes(2);
  sizes.add_sizes(3);
  store.Append(&sizes);
  store.SetPoints(std::vector<double>{1, 2, 3, 4});
  EXPECT_GE(store.bytes(), 6 * sizeof(double));
  const std::shared_ptr<const core::SizeSamples> samples = store.Take(core::RunContext());
  ASSERT_NE(samples, nullptr);
  EXPECT_EQ(samples->points, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(samples->sizes, (std::vector<double>{2, 3}));
}

TEST(SizeStore, OfACancelledRunThereAreNone) {
  SizeStore store;
  v1::SizeSamples chunk;
  chunk.add_points(0);
  chunk.add_points(0);
  chunk.add_sizes(1);
  store.Append(&chunk);
  core::RunContext context;
  context.Cancel();
  EXPECT_EQ(store.Take(context), nullptr);
}

}  // namespace
}  // namespace wellspace::server
