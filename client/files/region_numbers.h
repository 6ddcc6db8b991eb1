// Notes on the seeds of domains in the plane and in space.
#ifndef WELLSPACE_CLIENT_FILES_REGION_NUMBERS_H_
#define WELLSPACE_CLIENT_FILES_REGION_NUMBERS_H_

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace wellspace::client {

// The regions of attributes in the file `name`: whole numbers of 32 bits are their own; others get the lowest numbers
// above 0 that are left, in their order, which a note tells.
std::map<double, int32_t> NumberAttributes(const std::string& name, std::span<const double> attributes,
                                           std::vector<std::string>& notes);

// The regions of seeds in the file `name`, one each, by their attributes; 0 of a hole.
template <typename Seed>
std::vector<int32_t> NumberRegions(const std::string& name, const std::vector<Seed>& seeds,
                                   std::vector<std::string>& notes) {
  std::vector<double> attributes;
  for (const Seed& seed : seeds) {
    if (!seed.is_hole) {
      attributes.push_back(seed.attribute);
    }
  }
  const std::map<double, int32_t> numbers = NumberAttributes(name, attributes, notes);
  std::vector<int32_t> regions;
  for (const Seed& seed : seeds) {
    regions.push_back(seed.is_hole ? 0 : numbers.at(seed.attribute));
  }
  return regions;
}

// The note on `count` seeds that mean nothing, of which the first stands at `origin`, for the point (`place`).
std::string UnusedSeedNote(const std::string& origin, bool is_hole, const std::string& place, uint64_t count);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_FILES_REGION_NUMBERS_H_
