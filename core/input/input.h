// The input of a mesh: points, and the features that bound it beside the box.
#ifndef WELLSPACE_CORE_INPUT_INPUT_H_
#define WELLSPACE_CORE_INPUT_INPUT_H_

#include <concepts>
#include <optional>
#include <span>
#include <utility>

#include "core/features/features.h"
#include "core/features/surface_features.h"

namespace wellspace::core {

// A source of a span of doubles that needs no more words: a span, a vector, an array.
template <typename T>
concept Coordinates = std::convertible_to<const T&, std::span<const double>>;

// Points, n x dimension, row-major. Without more they are a cloud in a box; with features they make a domain in the
// plane, and with a surface one in space. Points alone are an input as they are, so that functions which take an Input
// take points.
//
// REQUIRES:   the points and features that it refers to outlive it.
struct Input {
  Input() = default;
  template <Coordinates Points>
  Input(const Points& of_cloud) : points(of_cloud) {}  // NOLINT(google-explicit-constructor)
  Input(std::span<const double> of_domain, std::optional<Features> that_bound)
      : points(of_domain), features(std::move(that_bound)) {}
  Input(std::span<const double> of_domain, const SurfaceFeatures& that_bounds)
      : points(of_domain), surface(that_bounds) {}

  std::span<const double> points;
  std::optional<Features> features;        // of a domain in the plane
  std::optional<SurfaceFeatures> surface;  // of a domain in space; at most one of the two is there
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_INPUT_H_
