// Watched nodes are found by place: all that a point cuts off, and no others.
#include "core/refine/face_watchers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

template <typename T>
class FaceWatchersTest : public test::SeededTest {
 protected:
  static constexpr int kD = T::kValue;

  FaceWatchersTest() : SeededTest(2014) {}

  // On one of two faces of the box about the origin of that half side, or on both.
  WatchedNode<kD> OnFaces(double half_side) {
    WatchedNode<kD> node;
    for (double& x : node.centre) {
      x = half_side * (2 * random_.Unit() - 1);
    }
    const double which = random_.Unit();
    if (which < 0.6) {
      Put(node, kD - 1, half_side);
    }
    if (which > 0.4) {
      Put(node, 0, half_side);
    }
    node.radius = half_side * std::exp2(-16 * random_.Unit());
    return node;
  }

  static std::set<VertexId> Watching(const FaceWatchers<kD>& watchers, const WatchedNode<kD>& x) {
    std::set<VertexId> found;
    watchers.ForEachCutOff(x.centre, x.faces, [&](VertexId v) { found.insert(v); });
    return found;
  }

 private:
  static void Put(WatchedNode<kD>& node, int axis, double half_side) {
    node.centre[axis] = -half_side;
    node.faces = static_cast<FaceMask>(node.faces | 1u << FaceIndex(axis, false));
  }
};
TYPED_TEST_SUITE(FaceWatchersTest, test::UpTo4);

TYPED_TEST(FaceWatchersTest, FindsWhoseNodesAPointCutsOff) {
  constexpr int D = TypeParam::kValue;
  // Lengths of every size: where the grid's cubes are far below one and far above.
  for (const double half_side : {1e-100, 1e-9, 1.0, 1e9}) {
    SCOPED_TRACE(half_side);
    FaceWatchers<D> watchers;
    std::map<VertexId, std::vector<WatchedNode<D>>> model;
    int watched = 0;
    int not_watched = 0;
    for (int step = 0; step < 3000; ++step) {
      const VertexId v{static_cast<uint32_t>(this->random_.Below(60))};
      watchers.Remove(v);
      if (model.erase(v) == 0) {
        for (uint64_t i = 0; i < 1 + this->random_.Below(3); ++i) {
          model[v].push_back(this->OnFaces(half_side));
        }
        watchers.Add(v, model[v]);
      }
      const WatchedNode<D> x = this->OnFaces(half_side);
      std::set<VertexId> expected;
      for (const auto& [u, nodes] : model) {
        for (const WatchedNode<D>& node : nodes) {
          if ((node.faces & x.faces) != 0 && DistanceSq<D>(node.centre, x.centre) <= node.radius * node.radius) {
            expected.insert(u);
          }
        }
      }
      ASSERT_EQ(this->Watching(watchers, x), expected) << "step " << step;
      ++(expected.empty() ? not_watched : watched);
    }
    EXPECT_FALSE(watchers.SomeWatchAll());
    EXPECT_GT(watched, 100);
    EXPECT_GT(not_watched, 100);
  }
}

TYPED_TEST(FaceWatchersTest, SomeWatchAll) {
  constexpr int D = TypeParam::kValue;
  FaceWatchers<D> watchers;
  watchers.Remove(VertexId{7});  // is none
  EXPECT_FALSE(watchers.SomeWatchAll());
  watchers.Add(VertexId{7}, {});
  EXPECT_TRUE(watchers.SomeWatchAll());
  EXPECT_TRUE(this->Watching(watchers, this->OnFaces(1)).empty());
  EXPECT_GT(watchers.MemoryBytes(), 0);
  watchers.Remove(VertexId{7});
  EXPECT_FALSE(watchers.SomeWatchAll());
  const WatchedNode<D> node = this->OnFaces(1);
  watchers.Add(VertexId{7}, std::vector<WatchedNode<D>>{node});
  EXPECT_FALSE(watchers.SomeWatchAll());
  EXPECT_EQ(this->Watching(watchers, node), std::set<VertexId>{VertexId{7}});
  watchers.Clear();
  EXPECT_TRUE(this->Watching(watchers, node).empty());
}

}  // namespace
}  // namespace wellspace::core
