// Colours of qualities.
#ifndef WELLSPACE_CLIENT_CLI_RENDER_COLOUR_RAMP_H_
#define WELLSPACE_CLIENT_CLI_RENDER_COLOUR_RAMP_H_

namespace wellspace::render {

struct Colour {
  double red = 0;
  double green = 0;
  double blue = 0;
};

// The colour of `t` in [0, 1] on a ramp whose lightness grows evenly: dark violet, blue, green, yellow. Other `t` are
// clamped.
Colour RampColour(double t);

// `colour`, darker or lighter by `factor`.
Colour Shaded(const Colour& colour, double factor);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_CLI_RENDER_COLOUR_RAMP_H_
