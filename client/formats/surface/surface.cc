#include "client/formats/surface/surface.h"

#include "absl/strings/str_cat.h"

namespace wellspace::formats {

std::string Surface::TriangleOrigin(uint64_t triangle) const {
  const uint64_t place = triangle_places.LineOf(triangle);
  return has_lines ? absl::StrCat(name, ":", place) : absl::StrCat(name, "[", place, "]");
}

std::string Surface::SeedOrigin(uint64_t seed) const { return absl::StrCat(name, ":", seed_places.LineOf(seed)); }

}  // namespace wellspace::formats
