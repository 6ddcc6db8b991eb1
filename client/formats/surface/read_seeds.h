// Seeds of solids from a table.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_READ_SEEDS_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_READ_SEEDS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/cloud.h"
#include "client/formats/surface/surface.h"

namespace wellspace::formats {

struct SolidSeeds {
  std::string name;  // of the file, as messages say it
  std::vector<Surface::Seed> seeds;
  LineIndex places;

  // "seeds.csv:17". REQUIRES: seed < seeds.size().
  std::string Origin(uint64_t seed) const;
};

// Reads lines "x,y,z,region" or "x,y,z,region,max-volume" from `path`; a region is a number, or "hole". Blanks around
// fields do not matter, '#' begins a comment, and a first line whose x is no number is a header. "-" is standard input.
//
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …": another number of fields, a number that is none
//             or not finite, a volume that is not above 0, one of a hole; a file without seeds.
absl::StatusOr<SolidSeeds> ReadSolidSeeds(const std::string& path);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_READ_SEEDS_H_
