// What a mesh is made of: points, and what bounds it beside the box.
#ifndef WELLSPACE_CORE_INPUT_H_
#define WELLSPACE_CORE_INPUT_H_

#include <optional>
#include <span>
#include <vector>

#include "core/features/features.h"

namespace wellspace::core {

// Points, n x dimension, row-major; with features, which are for 2-D alone, they bound a domain in the plane, and
// without they are a cloud in a box. What it refers to has to outlive it. Points alone are an Input as they are.
struct Input {
  Input(std::span<const double> the_points) : points(the_points) {}     // NOLINT(google-explicit-constructor)
  Input(const std::vector<double>& the_points) : points(the_points) {}  // NOLINT(google-explicit-constructor)
  Input(std::span<const double> the_points, const Features& the_features)
      : points(the_points), features(the_features) {}

  std::span<const double> points;
  std::optional<Features> features;  // none: a cloud
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_H_
