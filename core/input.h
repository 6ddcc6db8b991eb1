// What a mesh is made of: points, and what bounds it beside the box.
#ifndef WELLSPACE_CORE_INPUT_H_
#define WELLSPACE_CORE_INPUT_H_

#include <concepts>
#include <optional>
#include <span>
#include <utility>

#include "core/features/features.h"

namespace wellspace::core {

// What a span of doubles is made of without more words: a span, a vector, an array.
template <typename T>
concept Coordinates = std::convertible_to<const T&, std::span<const double>>;

// Points, n x dimension, row-major. Without features they are a cloud in a box; with them they make a domain in the
// plane. Points alone are an input as they are, so that functions which take an Input take points.
//
// REQUIRES:   what it refers to outlives it.
struct Input {
  Input() = default;
  template <Coordinates Points>
  Input(const Points& of_cloud) : points(of_cloud) {}  // NOLINT(google-explicit-constructor)
  Input(std::span<const double> of_domain, std::optional<Features> that_bound)
      : points(of_domain), features(std::move(that_bound)) {}

  std::span<const double> points;
  std::optional<Features> features;  // none: a cloud
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_H_
