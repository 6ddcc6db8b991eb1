// The holes and regions at the end of a .poly or .smesh. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_TETGEN_POLY_SEEDS_H_
#define WELLSPACE_CLIENT_FORMATS_TETGEN_POLY_SEEDS_H_

#include <array>
#include <cstddef>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::formats {

// A hole, or a region with its numbers.
struct PolySeed {
  bool is_hole = false;
  std::array<double, 3> at{};     // as many as there are dimensions
  double attribute = 0;           // of a region
  std::optional<double> largest;  // area or volume, at least 0; none: the row has no such number
};

// Reads both parts, of which either may be missing, and the end of the file. Calls add_seed for each, where `reader` is
// still at its row.
//
// REQUIRES:   dimension is 2 or 3.
// Errors:     of the reader; INVALID_ARGUMENT at the line.
absl::Status ReadPolySeeds(LineReader& reader, size_t dimension, absl::FunctionRef<void(const PolySeed&)> add_seed);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_TETGEN_POLY_SEEDS_H_
