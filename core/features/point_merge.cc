#include "core/features/point_merge.h"

#include <cstddef>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/point_grid.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

class TwinMerger {
 public:
  TwinMerger(std::span<const double> points, const Features& features, double separation, const RunContext& context)
      : points_(points), features_(features), separation_(separation), context_(context) {}

  absl::StatusOr<PointMerge> Merge() {
    WELLSPACE_RETURN_IF_ERROR(MergeEqual());
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> corners, Corners());
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> suspects, Suspects(corners));
    if (!suspects.empty()) {
      WELLSPACE_RETURN_IF_ERROR(MergeNear(suspects));
    }
    return Result();
  }

 private:
  Point<2> At(uint32_t i) const { return PointAt<2>(points_, i); }

  absl::Status CheckAt(size_t step) const {
    return step % kStepsBetweenChecks == 0 ? context_.Check() : absl::OkStatus();
  }

  // Every point becomes the first that is equal to it.
  absl::Status MergeEqual() {
    const auto count = static_cast<uint32_t>(points_.size() / 2);
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0);
    const auto is_before = [&](uint32_t i, uint32_t j) { return std::pair(At(i), i) < std::pair(At(j), j); };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(order_, is_before, context_));
    becomes_.resize(count);
    for (uint32_t k = 0; k < count; ++k) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(k));
      becomes_[order_[k]] = k > 0 && At(order_[k]) == At(order_[k - 1]) ? becomes_[order_[k - 1]] : order_[k];
    }
    return absl::OkStatus();
  }

  // The corners of rings, by place.
  absl::StatusOr<std::vector<uint32_t>> Corners() {
    std::vector<bool> is_corner(becomes_.size());
    for (size_t s = 0; s < features_.segment_count(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s));
      if (!features_.is_open.empty() && features_.is_open[s] != 0) {
        continue;
      }
      for (const uint32_t end : {features_.ends[2 * s], features_.ends[2 * s + 1]}) {
        if (end < becomes_.size()) {  // others are told of later
          is_corner[becomes_[end]] = true;
        }
      }
    }
    std::vector<uint32_t> corners;
    for (size_t k = 0; k < order_.size(); ++k) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(k));
      if (is_corner[order_[k]]) {
        corners.push_back(order_[k]);
      }
    }
    order_ = {};
    return corners;
  }

  // The corners that may be near another one, by place: of corners that follow each other closely along the
  // first axis, those that do so along the second, too.
  absl::StatusOr<std::vector<uint32_t>> Suspects(const std::vector<uint32_t>& corners) const {
    std::vector<uint32_t> suspects;
    std::vector<uint32_t> column;
    for (size_t begin = 0, end = 0; begin < corners.size(); begin = end) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(begin));
      for (end = begin + 1; end < corners.size() && At(corners[end])[0] - At(corners[end - 1])[0] < separation_;
           ++end) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(end));
      }
      if (end - begin == 1) {
        continue;
      }
      column.assign(corners.begin() + static_cast<std::ptrdiff_t>(begin),
                    corners.begin() + static_cast<std::ptrdiff_t>(end));
      const auto is_lower = [&](uint32_t i, uint32_t j) { return std::tuple(At(i)[1], i) < std::tuple(At(j)[1], j); };
      WELLSPACE_RETURN_IF_ERROR(CancellableSort(column, is_lower, context_));
      const auto are_close = [&](size_t i) { return At(column[i])[1] - At(column[i - 1])[1] < separation_; };
      for (size_t i = 0; i < column.size(); ++i) {
        if ((i > 0 && are_close(i)) || (i + 1 < column.size() && are_close(i + 1))) {
          suspects.push_back(column[i]);
        }
      }
    }
    const auto is_before = [&](uint32_t i, uint32_t j) { return At(i) < At(j); };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(suspects, is_before, context_));
    return suspects;
  }

  absl::Status MergeNear(const std::vector<uint32_t>& suspects) {
    Box<2> box{At(suspects[0]), At(suspects[0])};
    for (const uint32_t i : suspects) {
      box.Include({At(i), At(i)});
    }
    PointGrid<2> grid(box, separation_);
    std::vector<uint32_t> stayed;  // by point of the grid
    size_t steps = 0;
    for (const uint32_t i : suspects) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++));
      uint32_t nearest = kNone;
      double nearest_sq = separation_ * separation_;
      grid.ForEachNear(At(i), [&](uint32_t other) {
        const double distance_sq = DistanceSq<2>(At(i), grid[other]);
        if (distance_sq < nearest_sq || (nearest != kNone && distance_sq == nearest_sq && other < nearest)) {
          nearest = other;
          nearest_sq = distance_sq;
        }
        return true;
      });
      if (nearest == kNone) {
        grid.Add(At(i));
        stayed.push_back(i);
      } else {
        becomes_[i] = stayed[nearest];
      }
    }
    return absl::OkStatus();
  }

  absl::StatusOr<PointMerge> Result() {
    for (uint32_t i = 0; i < becomes_.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i));
      becomes_[i] = becomes_[becomes_[i]];  // the first that is equal to it, and then the point that this becomes
    }
    return PointMergeOf(points_, becomes_, context_);
  }

  const std::span<const double> points_;
  const Features& features_;
  const double separation_;
  const RunContext& context_;
  std::vector<uint32_t> order_;    // points by place
  std::vector<uint32_t> becomes_;  // by point
};

}  // namespace

absl::StatusOr<PointMerge> PointMergeOf(std::span<const double> points, std::span<const uint32_t> becomes,
                                        const RunContext& context) {
  PointMerge result;
  result.place_of.resize(becomes.size(), kNone);
  for (uint32_t i = 0; i < becomes.size(); ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const uint32_t stayed = becomes[i];
    if (result.place_of[stayed] == kNone) {
      result.place_of[stayed] = static_cast<uint32_t>(result.inputs.size());
      result.inputs.push_back(stayed);
    }
    result.place_of[i] = result.place_of[stayed];
    if (stayed != i) {
      ++(PointAt<2>(points, stayed) == PointAt<2>(points, i) ? result.equal : result.merged);
    }
  }
  return result;
}

absl::StatusOr<PointMerge> MergeTwins(std::span<const double> points, const Features& features, double separation,
                                      const RunContext& context) {
  return TwinMerger(points, features, separation, context).Merge();
}

}  // namespace wellspace::core
