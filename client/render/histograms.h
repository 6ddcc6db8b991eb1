// Histograms as pictures: how good the simplices of a mesh are, all of them at a glance.
#ifndef WELLSPACE_CLIENT_RENDER_HISTOGRAMS_H_
#define WELLSPACE_CLIENT_RENDER_HISTOGRAMS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/render/picture_format.h"

namespace wellspace::render {

// Simplices by a measure: counts[i] of them have it in [low + i * width, low + (i + 1) * width).
struct Histogram {
  std::string title;
  std::string unit{};  // after the numbers of the axis
  double low = 0;
  double width = 1;
  double tick = 10;  // numbers stand at its multiples
  std::vector<uint64_t> counts{};
};

// Paints the histograms one beside the other under `caption`, counts on a logarithmic scale, so that a single simplex
// shows.
//
// Errors:     of writing; nothing is left half written.
absl::Status WriteHistograms(const std::vector<Histogram>& histograms, const std::string& caption, PictureFormat format,
                             const std::string& path);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_HISTOGRAMS_H_
