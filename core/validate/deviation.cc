#include "core/validate/deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <queue>
#include <vector>

#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// How many quarters are looked at: so many for each triangle, but neither fewer nor more than these.
constexpr size_t kQuartersEach = 32;
constexpr size_t kFewestQuarters = size_t{1} << 14;
constexpr size_t kMostQuarters = size_t{1} << 19;
constexpr double kCloseEnough = 1.02;
constexpr size_t kLooksBetweenChecks = 256;

// A part of a triangle.
struct Piece {
  Triangle corners;
  uint32_t of = 0;     // the triangle
  uint32_t near = 0;   // of the others, the nearest to its middle
  double at_most = 0;  // a bound on the distance

  bool operator<(const Piece& other) const { return at_most < other.at_most; }
};

class DeviationMeter {
 public:
  DeviationMeter(std::span<const Triangle> triangles, const TriangleTree& others, double resolution,
                 const RunContext& context)
      : triangles_(triangles), others_(others), resolution_(resolution), context_(context) {}

  absl::StatusOr<Deviation> Measure() {
    const size_t most = std::clamp(kQuartersEach * triangles_.size(), kFewestQuarters, kMostQuarters);
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(2 * (triangles_.size() + most) * sizeof(Piece)));
    uint32_t near = 0;
    for (uint32_t t = 0; t < triangles_.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(Look());
      for (const Point<3>& corner : triangles_[t]) {
        Sample(corner, t, near);
      }
      Add({.corners = triangles_[t], .of = t, .near = near});
      near = last_near_;
    }
    for (size_t quarters = 0; !pieces_.empty() && quarters < most; quarters += 4) {
      const Piece piece = pieces_.top();
      if (piece.at_most <= Goal()) {
        break;
      }
      pieces_.pop();
      WELLSPACE_RETURN_IF_ERROR(Look());
      Quarter(piece);
    }
    found_.at_most = std::max(Goal(), pieces_.empty() ? 0 : pieces_.top().at_most);
    return found_;
  }

 private:
  // The distance below which nothing needs a closer look.
  double Goal() const { return std::max(kCloseEnough * found_.found, found_.found + resolution_); }

  absl::Status Look() { return ++looks_ % kLooksBetweenChecks == 0 ? context_.Check() : absl::OkStatus(); }

  // The distance of a point of triangle `of`; `near` becomes the triangle nearest to it.
  double Sample(const Point<3>& p, uint32_t of, uint32_t& near) {
    const NearTriangle nearest = others_.Nearest(p, near);
    near = nearest.triangle;
    const double distance = std::sqrt(nearest.distance_sq);
    if (distance > found_.found) {
      found_.found = distance;
      found_.at = p;
      found_.triangle = of;
    }
    return distance;
  }

  void Add(Piece piece) {
    const Point<3> middle = MiddleOf(piece.corners);
    const double distance = Sample(middle, piece.of, piece.near);
    last_near_ = piece.near;
    double radius_sq = 0;
    double farthest_sq = 0;
    for (const Point<3>& corner : piece.corners) {
      radius_sq = std::max(radius_sq, DistanceSq<3>(corner, middle));
      farthest_sq = std::max(farthest_sq, others_.DistanceSqTo(piece.near, corner));
    }
    piece.at_most = std::min(distance + std::sqrt(radius_sq), std::sqrt(farthest_sq));
    if (piece.at_most > Goal()) {
      pieces_.push(piece);
    }
  }

  void Quarter(const Piece& piece) {
    const Triangle& t = piece.corners;
    const std::array<Point<3>, 3> middles = {Between(t[1], t[2], 0.5), Between(t[2], t[0], 0.5),
                                             Between(t[0], t[1], 0.5)};
    for (size_t k = 0; k < 3; ++k) {
      Add({.corners = {t[k], middles[(k + 2) % 3], middles[(k + 1) % 3]}, .of = piece.of, .near = piece.near});
    }
    Add({.corners = middles, .of = piece.of, .near = piece.near});
  }

  const std::span<const Triangle> triangles_;
  const TriangleTree& others_;
  const double resolution_;
  const RunContext& context_;
  std::priority_queue<Piece> pieces_;  // by their bounds
  Deviation found_;
  uint32_t last_near_ = 0;
  size_t looks_ = 0;
};

}  // namespace

absl::StatusOr<Deviation> MeasureDeviation(std::span<const Triangle> triangles, const TriangleTree& others,
                                           double resolution, const RunContext& context) {
  return DeviationMeter(triangles, others, resolution, context).Measure();
}

}  // namespace wellspace::core
