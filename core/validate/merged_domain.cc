#include "core/validate/merged_domain.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/point.h"

namespace wellspace::core {
namespace {

constexpr size_t kStepsBetweenLooks = 1024;

// Places by the squares of a side in which they lie.
class PlacesBySquare {
 public:
  explicit PlacesBySquare(double side) : side_(side) {}

  void Add(const Point<2>& p) { squares_[SquareOf(p)].push_back(p); }

  // The place nearest to `p` of those at a squared distance that `is_near`; of several the first that was added.
  std::optional<Point<2>> Nearest(const Point<2>& p, const std::function<bool(double)>& is_near) const {
    std::optional<Point<2>> nearest;
    double nearest_sq = std::numeric_limits<double>::infinity();
    const Point<2> own = SquareOf(p);
    for (const double x : {own[0] - 1, own[0], own[0] + 1}) {
      for (const double y : {own[1] - 1, own[1], own[1] + 1}) {
        const auto square = squares_.find(Point<2>{x, y});
        if (square == squares_.end()) {
          continue;
        }
        for (const Point<2>& q : square->second) {
          const double distance_sq = DistanceSq<2>(p, q);
          if (is_near(distance_sq) && (distance_sq < nearest_sq || (distance_sq == nearest_sq && q < *nearest))) {
            nearest = q;
            nearest_sq = distance_sq;
          }
        }
      }
    }
    return nearest;
  }

 private:
  Point<2> SquareOf(const Point<2>& p) const { return {std::floor(p[0] / side_), std::floor(p[1] / side_)}; }

  const double side_;
  absl::flat_hash_map<Point<2>, std::vector<Point<2>>> squares_;
};

void Move(std::vector<double>& points, size_t i, const Point<2>& to) {
  points[2 * i] = to[0];
  points[2 * i + 1] = to[1];
}

// Thins points out as the merge distance asks for.
absl::Status Thin(std::vector<double>& points, double distance, const RunContext& context) {
  std::vector<uint32_t> order(points.size() / 2);
  std::iota(order.begin(), order.end(), 0);
  const std::vector<double> given = points;
  const auto at = [&](uint32_t i) { return PointAt<2>(given, i); };
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      order, [&](uint32_t i, uint32_t j) { return std::pair(at(i), i) < std::pair(at(j), j); }, context));
  PlacesBySquare stayed(distance * (1 + 1e-9));
  for (size_t k = 0; k < order.size(); ++k) {
    if (k % kStepsBetweenLooks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<2> p = at(order[k]);
    if (const auto near = stayed.Nearest(p, [&](double d_sq) { return d_sq <= distance * distance; })) {
      Move(points, order[k], *near);
    } else {
      stayed.Add(p);
    }
  }
  return absl::OkStatus();
}

// The ends of ring segments.
std::vector<bool> CornersOf(size_t points, const Features& features) {
  std::vector<bool> is_corner(points);
  for (size_t s = 0; s < features.segment_count(); ++s) {
    if (features.is_open.empty() || features.is_open[s] == 0) {
      is_corner[features.ends[2 * s]] = true;
      is_corner[features.ends[2 * s + 1]] = true;
    }
  }
  return is_corner;
}

}  // namespace

absl::StatusOr<std::vector<double>> PlacesInMesh(std::span<const double> points, const Features& features,
                                                 std::span<const double> vertices, double merge_distance,
                                                 double tolerance, const RunContext& context) {
  std::vector<double> places(points.begin(), points.end());
  if (merge_distance > 0) {
    WELLSPACE_RETURN_IF_ERROR(Thin(places, merge_distance, context));
  }
  std::vector<Point<2>> known;  // vertices, by place
  for (size_t v = 0; v < vertices.size() / 2; ++v) {
    known.push_back(PointAt<2>(vertices, v));
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(known, std::less<>(), context));
  const std::vector<bool> is_corner = CornersOf(points.size() / 2, features);
  PlacesBySquare corners(tolerance);
  std::vector<size_t> others;  // corners that are no vertices
  for (size_t i = 0; i < is_corner.size(); ++i) {
    if (i % kStepsBetweenLooks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<2> p = PointAt<2>(places, i);
    if (is_corner[i] && std::binary_search(known.begin(), known.end(), p)) {
      corners.Add(p);
    } else if (is_corner[i]) {
      others.push_back(i);
    }
  }
  for (const size_t i : others) {
    const Point<2> p = PointAt<2>(places, i);
    if (const auto near = corners.Nearest(p, [&](double d_sq) { return d_sq < tolerance * tolerance; })) {
      Move(places, i, *near);
    }
  }
  return places;
}

}  // namespace wellspace::core
