// Points in memory come back as they came, and the last can be taken back.
#include "server/store/point_store.h"

#include <numeric>
#include <vector>

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

TEST(MemoryPoints, GivesBackWhatCameInAnyPieces) {
  std::vector<double> all(500'000);
  std::iota(all.begin(), all.end(), 0.0);
  MemoryPoints store;
  size_t at = 0;
  for (size_t piece = 0; at < all.size(); piece = piece * 3 + 1) {  // 0, 1, 4, … beyond a block
    const size_t count = std::min(piece, all.size() - at);
    ASSERT_TRUE(store.Append({all.data() + at, count}).ok());
    at += count;
  }
  EXPECT_EQ(store.coordinate_count(), all.size());
  const core::RunContext context;
  for (const size_t first : {size_t{0}, size_t{1}, size_t{131'071}, size_t{131'072}, size_t{400'001}, all.size()}) {
    const auto copy = store.CopyFrom(first, context);
    ASSERT_TRUE(copy.ok());
    EXPECT_EQ(*copy, std::vector<double>(all.begin() + static_cast<std::ptrdiff_t>(first), all.end())) << first;
  }
}

TEST(MemoryPoints, TheLastCanBeTakenOutAgain) {
  std::vector<double> all(300'000);
  std::iota(all.begin(), all.end(), 0.0);
  for (const size_t left : {size_t{0}, size_t{1}, size_t{131'071}, size_t{131'072}, size_t{131'073}, all.size()}) {
    MemoryPoints store;
    ASSERT_TRUE(store.Append(all).ok());
    store.Truncate(left);
    ASSERT_EQ(store.coordinate_count(), left);
    ASSERT_TRUE(store.Append(std::vector<double>{-1, -2}).ok());
    EXPECT_EQ(store.CountEqual(0, std::span(all).first(left)).value(), left);
    EXPECT_EQ(store.CopyFrom(left, core::RunContext()).value(), std::vector<double>({-1, -2})) << left;
  }
}

TEST(MemoryPoints, CopyingCanBeCancelled) {
  MemoryPoints store;
  ASSERT_TRUE(store.Append(std::vector<double>(10, 1.0)).ok());
  core::RunContext context;
  context.Cancel();
  EXPECT_EQ(store.CopyFrom(0, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::server
