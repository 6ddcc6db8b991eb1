// The ballast takes room, gives it up, and is never half there.
#include "server/store/ballast.h"

#include <string>

#include "gtest/gtest.h"
#include "tests/server/store/simulated_disk.h"

namespace wellspace::server {
namespace {

constexpr char kPath[] = "/data/ballast";
constexpr uint64_t kBytes = 200'000;

class BallastTest : public ::testing::Test {
 protected:
  BallastTest() { EXPECT_TRUE(disk_.files().CreateFolder("/data").ok()); }

  SimulatedDisk disk_;
};

TEST_F(BallastTest, TakesUpRoomUntilItIsGivenUp) {
  Ballast ballast(disk_.files(), kPath, kBytes);
  EXPECT_FALSE(ballast.GiveUp()) << "there is none yet";
  ASSERT_TRUE(ballast.Fill().ok());
  EXPECT_EQ(disk_.SizeOf(kPath), kBytes);
  const uint64_t operations = disk_.operations();
  ASSERT_TRUE(ballast.Fill().ok());
  EXPECT_EQ(disk_.operations(), operations) << "costs nothing when it is whole";
  EXPECT_TRUE(ballast.GiveUp());
  EXPECT_EQ(disk_.SizeOf(kPath), 0u);
  EXPECT_FALSE(ballast.GiveUp());
  ASSERT_TRUE(ballast.Fill().ok());
  EXPECT_EQ(disk_.SizeOf(kPath), kBytes);
}

TEST_F(BallastTest, WithoutRoomForAllOfItItTakesNone) {
  Ballast ballast(disk_.files(), kPath, kBytes);
  disk_.LimitBytes(kBytes - 1);
  EXPECT_EQ(ballast.Fill().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(disk_.UsedBytes(), 0u);
  EXPECT_FALSE(ballast.GiveUp());
  disk_.LimitBytes(kBytes);
  EXPECT_TRUE(ballast.Fill().ok());
}

TEST_F(BallastTest, IsFoundAndMadeAsLargeAsItShouldBe) {
  for (const uint64_t before : {kBytes, kBytes / 2, 2 * kBytes}) {
    ASSERT_TRUE(Ballast(disk_.files(), kPath, before).Fill().ok());
    Ballast ballast(disk_.files(), kPath, kBytes);
    ASSERT_TRUE(ballast.Fill().ok());
    EXPECT_EQ(disk_.SizeOf(kPath), kBytes) << before;
  }
}

TEST_F(BallastTest, OfNoBytesHoldsNothingBack) {
  Ballast ballast(disk_.files(), kPath, 0);
  disk_.LimitBytes(0);
  EXPECT_TRUE(ballast.Fill().ok());
  EXPECT_FALSE(ballast.GiveUp());
  EXPECT_FALSE(disk_.Has(kPath));
}

}  // namespace
}  // namespace wellspace::server
