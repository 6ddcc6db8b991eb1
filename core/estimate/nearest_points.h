// The two points of a fixed set that are nearest to a place.
#ifndef WELLSPACE_CORE_ESTIMATE_NEAREST_POINTS_H_
#define WELLSPACE_CORE_ESTIMATE_NEAREST_POINTS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

struct NearestTwo {
  double first_sq = std::numeric_limits<double>::infinity();
  double second_sq = std::numeric_limits<double>::infinity();
  uint32_t first = 0;
  uint32_t second = 0;
};

// Finds points near any place: boxes around runs of points in Morton order, and around pairs of boxes. A tree would
// walk through its empty leaves, of which there may be many between far points.
//
// Thread safety: thread-compatible.
template <int D>
class NearestPoints {
 public:
  // `passed_over`: numbers of points that are not to be found; a few.
  //
  // REQUIRES:   `points` outlive this, in Morton order; in any other Nearest is right, but slow.
  // Complexity: O(n).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(std::span<const Point<D>> points, std::vector<uint32_t> passed_over, const RunContext& context) {
    points_ = points;
    passed_over_ = std::move(passed_over);
    if (points_.empty()) {
      return absl::OkStatus();
    }
    HugeVector<Box<D>> runs;
    runs.reserve((points_.size() + kRun - 1) / kRun);
    for (size_t i = 0; i < points_.size(); ++i) {
      if (i % kRun == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
        runs.push_back({points_[i], points_[i]});
      } else {
        runs.back().Include({points_[i], points_[i]});
      }
    }
    levels_.push_back(std::move(runs));
    while (levels_.back().size() > 1) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      const HugeVector<Box<D>>& below = levels_.back();
      HugeVector<Box<D>> boxes;
      boxes.reserve((below.size() + 1) / 2);
      for (size_t i = 0; i < below.size(); ++i) {
        if (i % 2 == 0) {
          boxes.push_back(below[i]);
        } else {
          boxes.back().Include(below[i]);
        }
      }
      levels_.push_back(std::move(boxes));
    }
    return absl::OkStatus();
  }

  const Point<D>& operator[](size_t i) const { return points_[i]; }

  // The two points nearest to `x`, other than point number `but`. Distances are infinite where there are no such
  // points.
  //
  // Complexity: O(log n) for most clouds and places.
  // Errors:     none.
  NearestTwo Nearest(const Point<D>& x, size_t but = ~size_t{0}) const {
    return NearestWithin(x, std::numeric_limits<double>::infinity(), but);
  }

  // Nearest where two points are known, those that were nearest to a place nearby.
  NearestTwo Nearest(const Point<D>& x, const NearestTwo& nearby) const {
    double limit_sq = std::numeric_limits<double>::infinity();
    if (nearby.second_sq < limit_sq) {
      limit_sq = std::max(DistanceSq<D>(x, points_[nearby.first]), DistanceSq<D>(x, points_[nearby.second]));
      limit_sq = std::nextafter(limit_sq, std::numeric_limits<double>::infinity());
    }
    return NearestWithin(x, limit_sq, ~size_t{0});
  }

 private:
  static constexpr size_t kRun = 16;

  // REQUIRES:   two points are nearer than the limit, or it is infinite.
  NearestTwo NearestWithin(const Point<D>& x, double limit_sq, size_t but) const {
    NearestTwo result;
    if (!points_.empty()) {
      Descend(x, but, static_cast<int>(levels_.size()) - 1, 0, limit_sq, result);
    }
    return result;
  }

  void Descend(const Point<D>& x, size_t but, int level, size_t index, double limit_sq, NearestTwo& result) const {
    if (level == 0) {
      const size_t end = std::min(points_.size(), (index + 1) * kRun);
      for (size_t i = index * kRun; i < end; ++i) {
        const double d = DistanceSq<D>(x, points_[i]);
        if (d >= result.second_sq || i == but || IsPassedOver(i)) {
          continue;
        }
        if (d < result.first_sq) {
          result = {d, result.first_sq, static_cast<uint32_t>(i), result.first};
        } else {
          result.second_sq = d;
          result.second = static_cast<uint32_t>(i);
        }
      }
      return;
    }
    const HugeVector<Box<D>>& below = levels_[level - 1];
    size_t near = 2 * index;
    double near_sq = DistanceSq<D>(x, below[near]);
    size_t far = near + 1;
    double far_sq = far < below.size() ? DistanceSq<D>(x, below[far]) : std::numeric_limits<double>::infinity();
    if (far_sq < near_sq) {
      std::swap(near, far);
      std::swap(near_sq, far_sq);
    }
    if (near_sq < std::min(limit_sq, result.second_sq)) {
      Descend(x, but, level - 1, near, limit_sq, result);
    }
    if (far_sq < std::min(limit_sq, result.second_sq)) {
      Descend(x, but, level - 1, far, limit_sq, result);
    }
  }

  bool IsPassedOver(size_t i) const {
    return std::find(passed_over_.begin(), passed_over_.end(), i) != passed_over_.end();
  }

  std::span<const Point<D>> points_;
  std::vector<uint32_t> passed_over_;
  std::vector<HugeVector<Box<D>>> levels_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_NEAREST_POINTS_H_
