// STL: its triangles, over the corners that are equal.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/stl_parts.h"
#include "client/formats/surface/surface_builder.h"
#include "client/formats/surface/surface_readers.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Floats of this many times the size of the surface are so coarse that it shows.
constexpr double kFarOff = 1e5;

class StlSurfaceReader {
 public:
  StlSurfaceReader(StlParts& parts, Surface& surface) : parts_(parts), surface_(surface), builder_(surface) {}

  absl::Status Read() {
    while (true) {
      WELLSPACE_ASSIGN_OR_RETURN(const StlParts::Part part, parts_.Next());
      switch (part) {
        case StlParts::Part::kEnd:
          return is_open_ ? parts_.Error("the file ends inside a facet; expected \"endfacet\"") : absl::OkStatus();
        case StlParts::Part::kSolid:
          marker_ = builder_.MarkerOf(parts_.solid());
          break;
        case StlParts::Part::kEndSolid:
          marker_ = 0;
          break;
        case StlParts::Part::kFacet:
          if (is_open_) {
            return parts_.Error("expected \"endfacet\" before the next facet");
          }
          is_open_ = true;
          count_ = 0;
          place_ = parts_.is_text() ? parts_.line_number() : parts_.facets() - 1;
          break;
        case StlParts::Part::kVertex:
          WELLSPACE_RETURN_IF_ERROR(TakeVertex());
          break;
        case StlParts::Part::kEndFacet:
          WELLSPACE_RETURN_IF_ERROR(EndFacet());
          break;
      }
    }
  }

 private:
  absl::Status TakeVertex() {
    if (!is_open_ || count_ == corners_.size()) {
      return parts_.Error(is_open_ ? "expected three vertices in a facet, got a fourth"
                                   : "expected \"facet\" before a vertex");
    }
    const StlPoint& point = parts_.point();
    for (size_t axis = 0; axis < point.size(); ++axis) {
      if (!std::isfinite(point[axis])) {
        return parts_.Error(absl::StrCat("coordinate ", axis + 1, ": expected a finite number, got ", point[axis]));
      }
    }
    const auto [at, is_new] = number_of_.try_emplace(point, static_cast<uint32_t>(surface_.point_count()));
    if (is_new) {
      if (surface_.point_count() == kMaxCount) {
        return parts_.Error(absl::StrCat("expected at most ", kMaxCount, " different corners, got more"));
      }
      surface_.points.insert(surface_.points.end(), point.begin(), point.end());
    }
    corners_[count_++] = at->second;
    return absl::OkStatus();
  }

  absl::Status EndFacet() {
    if (!is_open_ || count_ != corners_.size()) {
      return parts_.Error(is_open_ ? absl::StrCat("expected three vertices in a facet, got ", count_)
                                   : "expected \"facet\" before \"endfacet\"");
    }
    is_open_ = false;
    if (absl::Status status = builder_.AddPolygon(corners_, marker_, place_); !status.ok()) {
      return parts_.Error(std::string(status.message()));
    }
    return absl::OkStatus();
  }

  StlParts& parts_;
  Surface& surface_;
  SurfaceBuilder builder_;
  std::unordered_map<StlPoint, uint32_t, StlHash> number_of_;
  int32_t marker_ = 0;
  bool is_open_ = false;  // a facet
  std::array<uint32_t, 3> corners_{};
  size_t count_ = 0;
  uint64_t place_ = 0;  // of the facet
};

// Says if coordinates are so far from 0 that floats, which a file in binary has, are coarse.
void NoteFloats(Surface& surface) {
  double largest = 0;
  std::array<double, 3> low{};
  std::array<double, 3> high{};
  for (size_t i = 0; i < surface.points.size(); ++i) {
    const double x = surface.points[i];
    largest = std::max(largest, std::abs(x));
    low[i % 3] = i < 3 ? x : std::min(low[i % 3], x);
    high[i % 3] = i < 3 ? x : std::max(high[i % 3], x);
  }
  double size = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    size = std::max(size, high[axis] - low[axis]);
  }
  if (largest > kFarOff * size) {
    surface.notes.push_back(absl::StrCat(
        surface.name, ": its coordinates are up to ", largest, ", and it is ", size,
        " in size; STL in binary has them as floats, of seven digits: move it to the origin before it is written"));
  }
}

}  // namespace

absl::Status ReadStlSurface(InputFile& file, Surface& surface) {
  WELLSPACE_ASSIGN_OR_RETURN(const bool is_text, IsStlText(file));
  surface.names_points = false;
  surface.places.front().has_lines = is_text;
  LineReader reader(std::move(file));
  StlParts parts(reader, is_text, InvalidValue::kRefuse);
  WELLSPACE_RETURN_IF_ERROR(StlSurfaceReader(parts, surface).Read());
  if (!is_text) {
    NoteFloats(surface);
  }
  return reader.Finish();
}

}  // namespace wellspace::formats
