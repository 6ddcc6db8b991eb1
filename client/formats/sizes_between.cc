#include "client/formats/sizes_between.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kMostPoints = 10'000'000;

absl::Status TooMany() {
  return absl::InvalidArgumentError(
      absl::StrCat("sizes to interpolate between the vertices are at more than ", kMostPoints,
                   " points; lower the gradation, or have sizes grow from the vertices alone"));
}

using Corners = std::array<uint32_t, kMaxDimension + 1>;

class EdgeHalver {
 public:
  EdgeHalver(double growth, double radius_of_size, SizesBetween& sized)
      : dimension_(static_cast<size_t>(sized.dimension)), sized_(sized) {
    // The mean distance of a place from the corners, weighted by its barycentric coordinates, is at most the radius of
    // the ball around the simplex: by so much sizes may grow on the way.
    const double ball = std::sqrt(dimension_ / (2.0 * static_cast<double>(dimension_ + 1)));  // per longest edge
    longest_per_size_ = kAboveInterpolated * radius_of_size / (growth * ball);
  }

  // How many points come of halving the edges of a simplex, at least.
  double LeastPoints(const Corners& simplex) const {
    double most = 0;
    for (size_t i = 0; i <= dimension_; ++i) {
      most = std::max(most, sized_.sizes[simplex[i]]);
    }
    // No simplex with edges of at most this length is larger than the regular one. As many meet in a point, on average,
    // as the orders of its corners at most.
    const double longest = longest_per_size_ * most;
    double times = ParallelotopeOf(simplex);
    double orders = 1;
    for (size_t k = 1; k <= dimension_; ++k) {
      times /= longest * std::sqrt(0.5);
      orders *= static_cast<double>(k + 1);
    }
    return times / std::sqrt(static_cast<double>(dimension_ + 1)) / orders;
  }

  absl::Status Halve(const Corners& simplex) {
    std::vector<Corners> pending = {simplex};
    while (!pending.empty()) {
      const Corners corners = pending.back();
      pending.pop_back();
      double least = std::numeric_limits<double>::infinity();
      for (size_t i = 0; i <= dimension_; ++i) {
        least = std::min(least, sized_.sizes[corners[i]]);
      }
      const auto [i, j, length] = LongestEdge(corners);
      if (!(length > longest_per_size_ * least)) {
        continue;
      }
      const uint32_t middle = MiddleOf(corners[i], corners[j]);
      if (sized_.sizes.size() > kMostPoints) {
        return TooMany();
      }
      for (const size_t replaced : {i, j}) {
        pending.push_back(corners);
        pending.back()[replaced] = middle;
      }
    }
    return absl::OkStatus();
  }

 private:
  struct Edge {
    size_t i;
    size_t j;
    double length;
  };

  // The absolute determinant of the edges from the first corner.
  double ParallelotopeOf(const Corners& simplex) const {
    std::array<std::array<double, kMaxDimension>, kMaxDimension> rows{};
    for (size_t i = 0; i < dimension_; ++i) {
      for (size_t axis = 0; axis < dimension_; ++axis) {
        rows[i][axis] =
            sized_.points[simplex[i + 1] * dimension_ + axis] - sized_.points[simplex[0] * dimension_ + axis];
      }
    }
    double product = 1;
    for (size_t k = 0; k < dimension_; ++k) {
      size_t pivot = k;
      for (size_t i = k + 1; i < dimension_; ++i) {
        pivot = std::abs(rows[i][k]) > std::abs(rows[pivot][k]) ? i : pivot;
      }
      std::swap(rows[k], rows[pivot]);
      product *= std::abs(rows[k][k]);
      for (size_t i = k + 1; i < dimension_ && rows[k][k] != 0; ++i) {
        const double factor = rows[i][k] / rows[k][k];
        for (size_t axis = k; axis < dimension_; ++axis) {
          rows[i][axis] -= factor * rows[k][axis];
        }
      }
    }
    return product;
  }

  double LengthOf(uint32_t a, uint32_t b) const {
    double length = 0;
    for (size_t axis = 0; axis < dimension_; ++axis) {
      length = std::hypot(length, sized_.points[a * dimension_ + axis] - sized_.points[b * dimension_ + axis]);
    }
    return length;
  }

  Edge LongestEdge(const Corners& corners) const {
    Edge longest{0, 1, -1};
    for (size_t i = 0; i <= dimension_; ++i) {
      for (size_t j = i + 1; j <= dimension_; ++j) {
        if (const double length = LengthOf(corners[i], corners[j]); length > longest.length) {
          longest = {i, j, length};
        }
      }
    }
    return longest;
  }

  // Simplices that share an edge share its middle.
  uint32_t MiddleOf(uint32_t a, uint32_t b) {
    const uint64_t edge = uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    const auto [at, is_new] = middles_.try_emplace(edge, static_cast<uint32_t>(sized_.sizes.size()));
    if (is_new) {
      for (size_t axis = 0; axis < dimension_; ++axis) {
        sized_.points.push_back(0.5 * sized_.points[a * dimension_ + axis] +
                                0.5 * sized_.points[b * dimension_ + axis]);
      }
      sized_.sizes.push_back(0.5 * sized_.sizes[a] + 0.5 * sized_.sizes[b]);
      sized_.rows.push_back(sized_.rows[std::min(a, b)]);
    }
    return at->second;
  }

  const size_t dimension_;
  SizesBetween& sized_;
  double longest_per_size_ = 0;
  std::unordered_map<uint64_t, uint32_t> middles_;  // by edge
};

}  // namespace

absl::Status AddSizesBetween(std::span<const uint32_t> simplices, const std::vector<bool>& is_left_out, double growth,
                             double radius_of_size, SizesBetween& sized) {
  EdgeHalver halver(growth, radius_of_size, sized);
  const auto width = static_cast<size_t>(sized.dimension) + 1;
  const auto for_each = [&](const auto& f) {
    for (size_t s = 0; s + width <= simplices.size(); s += width) {
      Corners corners{};
      std::copy_n(simplices.begin() + static_cast<std::ptrdiff_t>(s), width, corners.begin());
      if (std::any_of(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(width),
                      [&](uint32_t v) { return is_left_out[v]; })) {
        continue;
      }
      if (absl::Status status = f(corners); !status.ok()) {
        return status;
      }
    }
    return absl::OkStatus();
  };
  double least = 0;
  if (absl::Status status = for_each([&](const Corners& corners) {
        least += halver.LeastPoints(corners);
        return least > kMostPoints ? TooMany() : absl::OkStatus();
      });
      !status.ok()) {
    return status;
  }
  return for_each([&](const Corners& corners) { return halver.Halve(corners); });
}

}  // namespace wellspace::formats
