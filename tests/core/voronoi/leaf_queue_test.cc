// The queue of a scan, against a list that is searched.
#include "core/voronoi/leaf_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/ids.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

class LeafQueueTest : public test::SeededTest {
 protected:
  LeafQueueTest() : SeededTest(1961) {}
};

TEST_F(LeafQueueTest, ServesNearClassesFirstAndInAClassWhoCameFirst) {
  struct Queued {
    double distance_sq;
    uint32_t leaf;
  };
  LeafQueue::Memory memory;
  for (const double scale : {1.0, 3e-140, 3e140}) {
    LeafQueue queue(memory, scale);
    // Far from the scale leaves share a class.
    const double least_sq = std::ldexp(scale * scale, -6);
    const double most_sq = std::ldexp(scale * scale, 20);
    std::vector<Queued> model;
    for (uint32_t step = 0; step < 20000; ++step) {
      if (random_.Below(9) < (step % 400 < 200 ? 7 : 3)) {
        const bool counts = random_.Below(4) != 0;
        // Often the same distance, sometimes none.
        const double distance_sq =
            random_.Below(8) == 0 ? 0 : std::ldexp(scale * scale, static_cast<int>(random_.Below(60)) - 20);
        queue.Reserve(1);
        queue.PushIf(counts, distance_sq, NodeId{step});
        if (counts) {
          model.push_back({distance_sq, step});
        }
      } else if (!model.empty()) {
        ASSERT_FALSE(queue.IsEmpty());
        const LeafQueue::Entry entry = queue.Pop();
        const auto at = std::find_if(model.begin(), model.end(),
                                     [&](const Queued& queued) { return NodeId{queued.leaf} == entry.leaf; });
        ASSERT_NE(at, model.end());
        ASSERT_EQ(at->distance_sq, entry.distance_sq);
        for (auto other = model.begin(); other != model.end(); ++other) {
          ASSERT_FALSE(other < at && other->distance_sq == entry.distance_sq) << "came before";
          ASSERT_FALSE(std::max(other->distance_sq, least_sq) < 0.25 * std::min(entry.distance_sq, most_sq))
              << "is much nearer";
        }
        model.erase(at);
      }
      ASSERT_EQ(queue.IsEmpty(), model.empty());
    }
  }
}

}  // namespace
}  // namespace wellspace::core
