// Numbers in chunks keep their order and count their memory.
#include "server/inputs/number_chunks.h"

#include <numeric>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/base/growing_array.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;

google::protobuf::RepeatedField<double> Numbers(size_t count, double first) {
  google::protobuf::RepeatedField<double> numbers;
  numbers.Resize(static_cast<int>(count), 0);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

TEST(NumberChunks, KeepsNumbersOfChunksOfEverySizeInOrder) {
  NumberChunks chunks;
  std::vector<double> expected;
  for (const size_t count : {1, 0, 3, 5000, 1, 1023, 2, 1024, 900, 900, 0, 7}) {
    google::protobuf::RepeatedField<double> numbers = Numbers(count, static_cast<double>(expected.size()));
    expected.insert(expected.end(), numbers.begin(), numbers.end());
    chunks.Append(&numbers);
    EXPECT_EQ(chunks.count(), expected.size());
    EXPECT_GE(chunks.bytes(), expected.size() * sizeof(double));
  }
  EXPECT_THAT(chunks.Copy(), ElementsAreArray(expected));
  EXPECT_THAT(chunks.Flatten(core::RunContext()), ElementsAreArray(expected));
  EXPECT_EQ(chunks.count(), 0u);
  EXPECT_EQ(chunks.bytes(), 0u);
}

// Clients may send them one by one: a chunk each would take several times as much as they do.
TEST(NumberChunks, CountsWhatItHoldsHoweverTheNumbersCome) {
  NumberChunks chunks;
  for (int i = 0; i < 100'000; ++i) {
    google::protobuf::RepeatedField<double> numbers = Numbers(1, i);
    chunks.Append(&numbers);
  }
  EXPECT_GE(chunks.bytes(), 100'000 * sizeof(double));
  EXPECT_LE(chunks.bytes(), 100'000 * sizeof(double) * 11 / 10);

  google::protobuf::RepeatedField<double> roomy = Numbers(2000, 0);
  roomy.Reserve(1 << 20);
  NumberChunks kept;
  kept.Append(&roomy);
  EXPECT_GE(kept.bytes(), sizeof(double) << 20) << "the room for more is held, too";
}

TEST(NumberChunks, OfACancelledRunNothingIsLeft) {
  NumberChunks chunks;
  google::protobuf::RepeatedField<double> numbers = Numbers(5000, 0);
  chunks.Append(&numbers);
  core::RunContext context;
  context.Cancel();
  EXPECT_TRUE(chunks.Flatten(context).empty());
  EXPECT_EQ(chunks.bytes(), 0u);
}

TEST(GrowingArray, GrowsAtItsEndAndShrinks) {
  GrowingArray<uint32_t> array;
  EXPECT_TRUE(array.empty());
  const std::vector<uint32_t> first = {1, 2, 3};
  array.Append(first.begin(), first.end());
  array.Append(4u);
  array.Resize(6, 9u);
  EXPECT_THAT(std::vector<uint32_t>(array.begin(), array.end()), ElementsAre(1, 2, 3, 4, 9, 9));
  array.Resize(2);
  array.Append(7u);
  EXPECT_THAT(std::vector<uint32_t>(array.begin(), array.end()), ElementsAre(1, 2, 7));
  for (uint32_t i = 3; i < 1'000'000; ++i) {
    array.Append(i);
  }
  EXPECT_EQ(array.size(), 1'000'000u);
  EXPECT_EQ(array[2], 7u);
  EXPECT_EQ(array[999'999], 999'999u);
}

}  // namespace
}  // namespace wellspace::server
