#include "client/render/colour_ramp.h"

#include <algorithm>
#include <array>

namespace wellspace::render {
namespace {

// Knots of "viridis" by S. van der Walt and N. Smith (CC0), at even distances.
constexpr std::array<Colour, 11> kKnots = {{{0.267, 0.005, 0.329},
                                            {0.283, 0.141, 0.458},
                                            {0.254, 0.265, 0.530},
                                            {0.207, 0.372, 0.553},
                                            {0.164, 0.471, 0.558},
                                            {0.128, 0.567, 0.551},
                                            {0.135, 0.659, 0.518},
                                            {0.267, 0.749, 0.441},
                                            {0.478, 0.821, 0.318},
                                            {0.741, 0.873, 0.150},
                                            {0.993, 0.906, 0.144}}};

// M. Okabe and K. Ito, "Color universal design", 2008: distinct for colour-blind readers too.
constexpr std::array<Colour, 8> kCategories = {{{0.337, 0.706, 0.914},
                                                {0.902, 0.624, 0.000},
                                                {0.000, 0.620, 0.451},
                                                {0.941, 0.894, 0.259},
                                                {0.800, 0.475, 0.655},
                                                {0.000, 0.447, 0.698},
                                                {0.835, 0.369, 0.000},
                                                {0.650, 0.650, 0.650}}};
constexpr std::array<double, 3> kCategoryShades = {1, 0.72, 0.5};

}  // namespace

Colour RampColour(double t) {
  const double position = std::clamp(t, 0.0, 1.0) * (kKnots.size() - 1);
  const size_t knot = std::min(static_cast<size_t>(position), kKnots.size() - 2);
  const double weight = position - static_cast<double>(knot);
  const auto mix = [weight](double a, double b) { return a + weight * (b - a); };
  const Colour& a = kKnots[knot];
  const Colour& b = kKnots[knot + 1];
  return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue)};
}

Colour CategoryColour(size_t index) {
  const size_t round = index / kCategories.size();
  return Shaded(kCategories[index % kCategories.size()], kCategoryShades[round % kCategoryShades.size()]);
}

Colour Shaded(const Colour& colour, double factor) {
  const auto scale = [factor](double c) { return std::clamp(c * factor, 0.0, 1.0); };
  return {scale(colour.red), scale(colour.green), scale(colour.blue)};
}

}  // namespace wellspace::render
