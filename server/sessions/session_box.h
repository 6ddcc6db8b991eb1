// The box that the points of a session, and its sizes at points, have to be in.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_BOX_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_BOX_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "core/geometry/criterion.h"

namespace wellspace::server {

// That of the mesh; before there is one, that of the parameters. If none was given it is open, and grows with the
// points: both corners are empty. A view.
struct SessionBox {
  std::span<const double> low;
  std::span<const double> high;

  bool IsOpen() const { return low.empty(); }
};

// Refuses points that no mesh in `box` has. `coordinates` are whole points of `dimension`; an error counts them from
// `first` on.
//
// Complexity: O(coordinates).
// Errors:     INVALID_POINTS, naming the first coordinate that is outside, or is no finite number.
absl::Status CheckPoints(const SessionBox& box, int dimension, uint64_t first, std::span<const double> coordinates);

// Refuses sizes at points outside. Where the box is open all pass: the refinement, which will know it, looks again.
//
// Complexity: O(samples).
// Errors:     INVALID_SIZES, naming the first coordinate that is outside.
absl::Status CheckSamples(const SessionBox& box, int dimension, const core::SizeSamples& samples);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_BOX_H_
