// Tasks run when they are due, in order; one that waits holds up no other.
#include "server/jobs/background.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "absl/time/clock.h"
#include "gtest/gtest.h"
#include "server/jobs/blocking_threads.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

TEST(Background, RunsWhatIsDueInOrder) {
  std::vector<int> order;
  Event done;
  Background background;
  for (int i = 0; i < 100; ++i) {
    background.Post([&order, i] { order.push_back(i); });
  }
  background.Post([&done] { done.Set(); });
  ASSERT_TRUE(done.Wait());
  ASSERT_EQ(order.size(), 100u);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

TEST(Background, ALaterTaskWaitsAndHoldsUpNoOther) {
  std::vector<int> order;
  Event done;
  const absl::Time begin = absl::Now();
  Background background;
  background.PostAfter(absl::Milliseconds(20), [&] {
    order.push_back(2);
    done.Set();
  });
  background.Post([&order] { order.push_back(1); });
  ASSERT_TRUE(done.Wait());
  EXPECT_EQ(order, std::vector<int>({1, 2}));
  EXPECT_GE(absl::Now() - begin, absl::Milliseconds(20));
}

TEST(Background, TasksMayPost) {
  Event done;
  Background background;
  background.Post([&] { background.Post([&done] { done.Set(); }); });
  EXPECT_TRUE(done.Wait());
}

TEST(Background, DestructionDropsWhatIsNotDue) {
  auto held = std::make_shared<bool>(false);
  {
    Background background;
    background.PostAfter(absl::Hours(1), [held] { *held = true; });
    EXPECT_EQ(held.use_count(), 2);
  }
  EXPECT_EQ(held.use_count(), 1);
  EXPECT_FALSE(*held);
}

TEST(Background, WithoutAThreadTasksRunAsTimePasses) {
  std::vector<int> order;
  Background background(RunBy::kCaller);
  background.PostAfter(absl::Seconds(2), [&] {
    order.push_back(2);
    background.PostAfter(absl::Seconds(1), [&order] { order.push_back(3); });
  });
  background.PostAfter(absl::Seconds(9), [&order] { order.push_back(9); });
  background.Post([&order] { order.push_back(0); });
  EXPECT_TRUE(background.RunDue());
  EXPECT_FALSE(background.RunDue());
  EXPECT_EQ(order, std::vector<int>({0}));
  background.Pass(absl::Seconds(3));
  EXPECT_EQ(order, std::vector<int>({0, 2, 3}));
  EXPECT_FALSE(background.RunDue());
}

TEST(BlockingThreads, WithoutThreadsTasksRunWhenTheyAreAskedTo) {
  std::vector<int> order;
  {
    BlockingThreads blocking(0);
    blocking.Run("a", [&order] { order.push_back(1); });
    blocking.Run("a", [&order] { order.push_back(2); });
    blocking.Run("", [&order] { order.push_back(3); });
    EXPECT_TRUE(order.empty());
    EXPECT_TRUE(blocking.RunNext());
    EXPECT_TRUE(blocking.RunNext());
    EXPECT_EQ(order, std::vector<int>({1, 3})) << "those of one key wait for one another";
  }
  EXPECT_EQ(order, std::vector<int>({1, 3, 2})) << "none is dropped";
}

}  // namespace
}  // namespace wellspace::server
