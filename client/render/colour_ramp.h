// Colours of qualities, and of regions.
#ifndef WELLSPACE_CLIENT_RENDER_COLOUR_RAMP_H_
#define WELLSPACE_CLIENT_RENDER_COLOUR_RAMP_H_

#include <cstddef>

namespace wellspace::render {

struct Colour {
  double red = 0;
  double green = 0;
  double blue = 0;
};

// The colour of `t` in [0, 1] on a ramp whose lightness grows evenly: dark violet, blue, green, yellow. Other `t` are
// clamped.
Colour RampColour(double t);

// The colour of number `index` of some things without an order. The first 24 differ.
Colour CategoryColour(size_t index);

// `colour`, darker or lighter by `factor`.
Colour Shaded(const Colour& colour, double factor);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_COLOUR_RAMP_H_
