// Watchers are found by place: all who watch a point, and few who do not.
#include "core/refine/face_watchers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

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

  // On the face low[kD - 1] = 0 of the box about the origin of that half side; on one more in a quarter of the cases.
  Point<kD> OnFace(double half_side) {
    Point<kD> p;
    for (double& x : p) {
      x = half_side * (2 * random_.Unit() - 1);
    }
    p[kD - 1] = 0;
    if (random_.Unit() < 0.25) {
      p[0] = -half_side;
    }
    return p;
  }
  static FaceMask FacesOf(const Point<kD>& p, double half_side) {
    const auto own = static_cast<FaceMask>(1u << FaceIndex(kD - 1, false));
    return p[0] == -half_side ? static_cast<FaceMask>(own | 1u << FaceIndex(0, false)) : own;
  }
};
TYPED_TEST_SUITE(FaceWatchersTest, test::UpTo4);

TYPED_TEST(FaceWatchersTest, FindsThoseWhoReachAPoint) {
  constexpr int D = TypeParam::kValue;
  struct Watcher {
    Point<D> position;
    double reach;
  };
  // Lengths of every size: where the grid's cubes are far below one and far above.
  for (const double half_side : {1e-100, 1e-9, 1.0, 1e9}) {
    SCOPED_TRACE(half_side);
    FaceWatchers<D> watchers;
    std::map<uint32_t, Watcher> model;
    int watched = 0;
    int not_watched = 0;
    for (int step = 0; step < 3000; ++step) {
      const auto v = static_cast<uint32_t>(this->random_.Next() % 60);
      if (model.contains(v)) {
        watchers.Remove(VertexId{v});
        model.erase(v);
      } else {
        const double reach = half_side * std::exp2(-16 * this->random_.Unit());
        model[v] = {this->OnFace(half_side), reach};
        watchers.Add(VertexId{v}, model[v].position, reach);
      }
      const Point<D> x = this->OnFace(half_side);
      bool expected = false;
      for (const auto& [id, watcher] : model) {
        expected |= DistanceSq<D>(watcher.position, x) <= watcher.reach * watcher.reach;
      }
      ASSERT_EQ(watchers.IsWatched(x, this->FacesOf(x, half_side)), expected) << "step " << step;
      ++(expected ? watched : not_watched);
    }
    EXPECT_GT(watched, 100);
    EXPECT_GT(not_watched, 100);
  }
}

TYPED_TEST(FaceWatchersTest, SomeWatchAll) {
  constexpr int D = TypeParam::kValue;
  FaceWatchers<D> watchers;
  const Point<D> x = this->OnFace(1);
  const FaceMask faces = this->FacesOf(x, 1);
  watchers.Remove(VertexId{7});  // is none
  EXPECT_FALSE(watchers.IsWatched(x, faces));
  watchers.Add(VertexId{7}, this->OnFace(1), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(watchers.IsWatched(x, faces));
  EXPECT_GT(watchers.MemoryBytes(), 0);
  watchers.Remove(VertexId{7});
  EXPECT_FALSE(watchers.IsWatched(x, faces));
  watchers.Add(VertexId{7}, this->OnFace(1), std::numeric_limits<double>::infinity());
  watchers.Clear();
  EXPECT_FALSE(watchers.IsWatched(x, faces));
}

}  // namespace
}  // namespace wellspace::core
