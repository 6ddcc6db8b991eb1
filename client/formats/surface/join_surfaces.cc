#include "client/formats/surface/join_surfaces.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/open_input.h"

namespace wellspace::formats {
namespace {

// "flange" of "parts/flange.stl.gz".
std::string StemOf(const std::string& file) {
  const std::string name = WithoutGzip(file.substr(file.rfind('/') + 1));
  const size_t dot = name.rfind('.');
  return dot == 0 ? name : name.substr(0, dot);
}

// Numbers and names of parts, file after file.
class PartNumbering {
 public:
  explicit PartNumbering(const std::vector<Surface>& surfaces) {
    for (const Surface& surface : surfaces) {
      for (const int32_t marker : surface.markers) {
        of_files_.insert(marker);
      }
      for (const Surface::Part& part : surface.parts) {
        of_files_.insert(part.marker);
        ++files_with_name_[part.name];
      }
    }
  }

  // Gives the markers of `surface` their new numbers and names.
  void Number(Surface& surface) {
    std::map<int32_t, std::optional<std::string>> names;  // of the markers of this file
    for (const int32_t marker : surface.markers) {
      names.try_emplace(marker);
    }
    for (const Surface::Part& part : surface.parts) {
      names[part.marker] = part.name;
    }
    const std::string stem = StemOf(surface.places.front().file);
    std::map<int32_t, int32_t> numbers;
    surface.parts.clear();
    std::set<int32_t> of_file;
    for (const auto& [marker, name] : names) {
      const bool is_kept = marker != 0 && !taken_.contains(marker);
      const int32_t number = is_kept ? marker : NextFree();
      numbers[marker] = number;
      of_file.insert(number);
      if (name.has_value()) {
        surface.parts.push_back({number, files_with_name_[*name] > 1 ? absl::StrCat(stem, "_", *name) : *name});
      } else if (marker == 0) {
        surface.parts.push_back({number, stem});
      } else if (!is_kept) {
        surface.parts.push_back({number, absl::StrCat(stem, "_", marker)});
      }
    }
    taken_.merge(of_file);
    for (int32_t& marker : surface.markers) {
      marker = numbers[marker];
    }
  }

 private:
  int32_t NextFree() {
    do {
      ++last_free_;
    } while (of_files_.contains(last_free_));
    return last_free_;
  }

  std::set<int32_t> of_files_;
  int32_t last_free_ = 0;
  std::map<std::string, int> files_with_name_;
  std::set<int32_t> taken_;
};

using Corner = std::array<double, 3>;
using Corners = std::array<Corner, 3>;

// The corners of a triangle in an order of their own; -0 is 0.
Corners CornersOf(const Surface& surface, uint64_t triangle) {
  Corners corners;
  for (size_t k = 0; k < 3; ++k) {
    for (size_t axis = 0; axis < 3; ++axis) {
      corners[k][axis] = surface.points[3 * size_t{surface.corners[3 * triangle + k]} + axis] + 0.0;
    }
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

// For each triangle of `surface`, whether it is among those of the files before.
std::vector<bool> FindCopies(const Surface& surface, const absl::flat_hash_set<Corners>& before) {
  std::vector<bool> is_copy(surface.triangle_count());
  for (uint64_t triangle = 0; triangle < is_copy.size(); ++triangle) {
    is_copy[triangle] = before.contains(CornersOf(surface, triangle));
  }
  return is_copy;
}

// Appends the triangles of `surface` that are no copies.
void Append(const Surface& surface, const std::vector<bool>& is_copy, Surface& joined) {
  const auto first = static_cast<uint32_t>(joined.point_count());
  joined.points.insert(joined.points.end(), surface.points.begin(), surface.points.end());
  const Surface::Places& from = surface.places.front();
  Surface::Places& places = joined.places.emplace_back();
  places.file = from.file;
  places.has_lines = from.has_lines;
  places.seeds = from.seeds;
  for (uint64_t triangle = 0; triangle < surface.triangle_count(); ++triangle) {
    if (!is_copy[triangle]) {
      for (size_t k = 0; k < 3; ++k) {
        joined.corners.push_back(first + surface.corners[3 * triangle + k]);
      }
      joined.markers.push_back(surface.markers[triangle]);
      places.triangles.Add(from.triangles.LineOf(triangle));
    }
  }
  joined.parts.insert(joined.parts.end(), surface.parts.begin(), surface.parts.end());
  joined.seeds.insert(joined.seeds.end(), surface.seeds.begin(), surface.seeds.end());
  joined.names_points = joined.names_points && surface.names_points;
  joined.cut_polygons += surface.cut_polygons;
  for (const std::string& note : surface.notes) {
    joined.notes.push_back(absl::StrCat(surface.name, ": ", note));
  }
}

}  // namespace

Surface JoinSurfaces(std::vector<Surface> surfaces) {
  if (surfaces.size() == 1) {
    return std::move(surfaces.front());
  }
  PartNumbering numbering(surfaces);
  Surface joined;
  joined.name = absl::StrCat(surfaces.front().name, " and ", surfaces.size() - 1, " more");
  joined.format = surfaces.front().format;
  joined.solids = Surface::SolidRule::kHoles;
  joined.places.clear();
  absl::flat_hash_set<Corners> before;  // the triangles of the files before
  uint64_t copies = 0;
  for (Surface& surface : surfaces) {
    numbering.Number(surface);
    const std::vector<bool> is_copy = FindCopies(surface, before);
    copies += std::count(is_copy.begin(), is_copy.end(), true);
    Append(surface, is_copy, joined);
    for (uint64_t triangle = 0; triangle < surface.triangle_count(); ++triangle) {
      before.insert(CornersOf(surface, triangle));
    }
    surface = {};
  }
  std::sort(joined.parts.begin(), joined.parts.end(),
            [](const Surface::Part& a, const Surface::Part& b) { return a.marker < b.marker; });
  if (copies > 0) {
    joined.notes.push_back(absl::StrCat(copies, copies == 1 ? " triangle is" : " triangles are",
                                        " in several files; the parts are those of the first one"));
  }
  return joined;
}

}  // namespace wellspace::formats
