// The diametral balls of subsegments: which points are surely in none. SpatialDomain keeps them.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SUBSEGMENT_BALLS_H_
#define WELLSPACE_CORE_REFINE_SPACE_SUBSEGMENT_BALLS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/point.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

// Balls are added and never taken away: those of subsegments that have been split since stay, so that what is surely in
// none of them may be in fewer yet. All are a little too large, for what is rounded.
//
// Thread safety: thread-compatible; const functions may run at once.
class SubsegmentBalls {
 public:
  // Forgets all balls; until the next call of Begin nothing is known.
  void Forget() {
    is_known_ = false;
    balls_.clear();
    tree_ = {};
    in_tree_ = 0;
  }
  // From now on all balls are added.
  void Begin() {
    Forget();
    is_known_ = true;
  }

  // Adds the ball over the diameter from `a` to `b`.
  //
  // Complexity: O(log balls), amortised.
  void Add(const Point<3>& a, const Point<3>& b) {
    if (!is_known_) {
      return;
    }
    balls_.push_back({Between(a, b, 0.5), (0.25 + kRoom) * DistanceSq<3>(a, b)});
    if (balls_.size() - in_tree_ > kLeastLoose + in_tree_ / 4) {
      std::vector<Box<3>> boxes;
      for (const Ball& ball : balls_) {
        boxes.push_back(CubeAround<3>(ball.centre, (1 + kRoom) * std::sqrt(ball.radius_sq)));
      }
      tree_ = BoxTree<3>(std::move(boxes));
      in_tree_ = balls_.size();
    }
  }

  // Whether `p` may be in a ball.
  //
  // Complexity: O(log balls), amortised, for most points.
  bool MayHold(const Point<3>& p) const {
    const auto holds = [&](const Ball& ball) { return DistanceSq<3>(p, ball.centre) <= ball.radius_sq; };
    bool may_hold =
        !is_known_ || std::any_of(balls_.begin() + static_cast<std::ptrdiff_t>(in_tree_), balls_.end(), holds);
    if (!may_hold) {
      tree_.ForEach([&](const Box<3>& box) { return box.Contains(p); },
                    [&](uint32_t i) {
                      may_hold = holds(balls_[i]);
                      return !may_hold;
                    });
    }
    return may_hold;
  }

  uint64_t MemoryBytes() const { return balls_.size() * sizeof(Ball) + BoxTree<3>::Bytes(in_tree_); }

 private:
  static constexpr double kRoom = 1e-6;
  static constexpr size_t kLeastLoose = 32;

  struct Ball {
    Point<3> centre{};
    double radius_sq = 0;
  };

  bool is_known_ = false;
  std::vector<Ball> balls_;
  BoxTree<3> tree_;     // of the first of them
  size_t in_tree_ = 0;  // how many
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SUBSEGMENT_BALLS_H_
