// The images of points that are to be vertices of a periodic box.
#ifndef WELLSPACE_CORE_INPUT_POINT_IMAGES_H_
#define WELLSPACE_CORE_INPUT_POINT_IMAGES_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/periodic_box.h"

namespace wellspace::core {

// Points with their images behind them, so that all are sorted, compared and refused as one cloud. All is empty if no
// point has an image.
struct PointsWithImages {
  std::vector<double> points;     // n x D
  size_t given = 0;               // points that are no images, the first
  std::vector<uint32_t> sources;  // by image: the number of its point

  bool HasImages() const { return !sources.empty(); }

  // The numbers by which errors name the points, and for each image that of its point; `inputs` has those of the
  // points, and is empty if they are 0, 1, ….
  //
  // REQUIRES:   HasImages().
  // Complexity: O(n).
  std::vector<uint32_t> Names(std::span<const uint32_t> inputs) const;
};

// `points`, n x D, with the images that `box` gives them, point after point. Two points on opposite faces may be images
// of each other: duplicates are kept.
//
// Complexity: O(n).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::StatusOr<PointsWithImages> WithImages(const PeriodicBox<D>& box, std::span<const double> points,
                                            const RunContext& context);

// How many images that are.
//
// Complexity: O(n).
template <int D>
size_t CountImages(const PeriodicBox<D>& box, std::span<const double> points);

// Adds to `status`, that points are too close to each other, that images of points count, too.
absl::Status ExplainImages(const absl::Status& status);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_POINT_IMAGES_H_
