#include "client/formats/surface/surface.h"

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

std::string OriginIn(const Surface::Places& places, uint64_t place) {
  return places.has_lines ? absl::StrCat(places.file, ":", place) : absl::StrCat(places.file, "[", place, "]");
}

// Where number `index` stands, of all that `lines` of each file have.
std::string OriginOf(const std::vector<Surface::Places>& files, LineIndex Surface::Places::*lines, uint64_t index) {
  auto file = files.begin();
  for (; index >= ((*file).*lines).size(); ++file) {
    index -= ((*file).*lines).size();
  }
  return OriginIn(*file, ((*file).*lines).LineOf(index));
}

}  // namespace

std::string Surface::TriangleOrigin(uint64_t triangle) const { return OriginOf(places, &Places::triangles, triangle); }

std::string Surface::SeedOrigin(uint64_t seed) const { return OriginOf(places, &Places::seeds, seed); }

}  // namespace wellspace::formats
