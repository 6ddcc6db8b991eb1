// Stanford's PLY: vertices and faces, of which a property may be the marker.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/ply_rows.h"
#include "client/formats/surface/surface_builder.h"
#include "client/formats/surface/surface_readers.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kAxes = 3;

class PlySurfaceReader {
 public:
  PlySurfaceReader(LineReader& reader, Surface& surface)
      : reader_(reader), rows_(reader), surface_(surface), builder_(surface) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(rows_.ReadHeader());
    PlyElement* const vertices = rows_.Find("vertex");
    PlyElement* const faces = rows_.Find("face");
    if (vertices == nullptr || faces == nullptr || vertices > faces) {
      return reader_.Error(
          absl::StrCat("expected an element \"vertex\" and behind it an element \"face\" in the header",
                       rows_.Find("tristrips") != nullptr ? ", got \"tristrips\"" : ""));
    }
    WELLSPACE_RETURN_IF_ERROR(rows_.CheckUpTo(*faces));
    WELLSPACE_RETURN_IF_ERROR(ChooseVertices(*vertices));
    WELLSPACE_RETURN_IF_ERROR(ChooseFaces(*faces));
    surface_.places.front().has_lines = rows_.is_ascii();
    for (const PlyElement* element = rows_.elements().data(); element <= faces; ++element) {
      for (uint64_t row = 0; row < element->count; ++row) {
        WELLSPACE_RETURN_IF_ERROR(element == vertices ? ReadVertex(*element, row)
                                  : element == faces  ? ReadFace(*element, row)
                                                      : rows_.SkipRow(*element, row));
      }
    }
    return absl::OkStatus();
  }

 private:
  absl::Status ChooseVertices(PlyElement& vertices) {
    axis_of_.resize(vertices.properties.size());
    std::array<int, kAxes> seen{};
    for (size_t i = 0; i < vertices.properties.size(); ++i) {
      PlyProperty& property = vertices.properties[i];
      const char name = property.name.size() == 1 ? absl::ascii_tolower(property.name[0]) : '\0';
      property.is_wanted = !property.list_count && name >= 'x' && name <= 'z';
      if (property.is_wanted) {
        axis_of_[i] = static_cast<size_t>(name - 'x');
        ++seen[axis_of_[i]];
      }
    }
    return seen == std::array<int, kAxes>{1, 1, 1}
               ? absl::OkStatus()
               : reader_.Error("expected one property x, one y and one z of element \"vertex\"");
  }

  absl::Status ChooseFaces(PlyElement& faces) {
    constexpr std::array kMarkers = {"tag", "marker", "label"};
    int lists = 0;
    for (PlyProperty& property : faces.properties) {
      property.is_wanted =
          property.list_count && (property.name == "vertex_indices" || property.name == "vertex_index");
      lists += property.is_wanted ? 1 : 0;
    }
    if (lists != 1) {
      return reader_.Error("expected one list vertex_indices or vertex_index of element \"face\"");
    }
    for (const char* const name : kMarkers) {
      const auto is_marker = [name](const PlyProperty& property) {
        return !property.list_count && property.name == name;
      };
      const auto at = std::find_if(faces.properties.begin(), faces.properties.end(), is_marker);
      if (at != faces.properties.end()) {
        at->is_wanted = true;
        break;
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadVertex(const PlyElement& vertices, uint64_t row) {
    std::array<double, kAxes> point{};
    WELLSPACE_RETURN_IF_ERROR(rows_.ReadRow(vertices, row, [&](const PlyValue& value) -> absl::Status {
      double& x = point[axis_of_[value.property]];
      if (rows_.is_ascii()) {
        return TakeFinite(value.text, x);
      }
      x = value.number;
      return std::isfinite(x) ? absl::OkStatus()
                              : absl::InvalidArgumentError(absl::StrCat("coordinate ", axis_of_[value.property] + 1,
                                                                        ": expected a finite number, got ", x));
    }));
    surface_.points.insert(surface_.points.end(), point.begin(), point.end());
    return absl::OkStatus();
  }

  absl::Status ReadFace(const PlyElement& faces, uint64_t row) {
    corners_.clear();
    int32_t marker = 0;
    // A marker may stand before the corners or behind them: the polygon is cut with the last of both.
    size_t left = 0;
    for (const PlyProperty& property : faces.properties) {
      left += property.is_wanted ? 1 : 0;
    }
    return rows_.ReadRow(faces, row, [&](const PlyValue& value) -> absl::Status {
      if (faces.properties[value.property].list_count) {
        WELLSPACE_RETURN_IF_ERROR(TakeCorners(value.list));
      } else {
        WELLSPACE_RETURN_IF_ERROR(TakeMarker(value, marker));
      }
      return --left > 0 ? absl::OkStatus()
                        : builder_.AddPolygon(corners_, marker, rows_.is_ascii() ? reader_.line_number() : row);
    });
  }

  absl::Status TakeCorners(std::span<const double> list) {
    const auto count = static_cast<double>(surface_.point_count());
    for (const double corner : list) {
      if (!(corner >= 0 && corner < count && corner == std::floor(corner))) {
        return absl::InvalidArgumentError(
            count == 0 ? "expected no face, since there are no vertices"
                       : absl::StrCat("expected a vertex from 0 to ", surface_.point_count() - 1, ", got ", corner));
      }
      corners_.push_back(static_cast<uint32_t>(corner));
    }
    return absl::OkStatus();
  }

  absl::Status TakeMarker(const PlyValue& value, int32_t& marker) const {
    if (rows_.is_ascii()) {
      return ReadMarker(value.text, marker);
    }
    const double number = value.number;
    if (!(number >= std::numeric_limits<int32_t>::min() && number <= std::numeric_limits<int32_t>::max() &&
          number == std::floor(number))) {
      return absl::InvalidArgumentError(
          absl::StrCat("marker: expected a whole number from -2^31 to below 2^31, got ", number));
    }
    marker = static_cast<int32_t>(number);
    return absl::OkStatus();
  }

  LineReader& reader_;
  PlyRows rows_;
  Surface& surface_;
  SurfaceBuilder builder_;
  std::vector<size_t> axis_of_;  // by property of the vertices
  std::vector<uint32_t> corners_;
};

}  // namespace

absl::Status ReadPlySurface(InputFile& file, Surface& surface) {
  LineReader reader(std::move(file));
  WELLSPACE_RETURN_IF_ERROR(PlySurfaceReader(reader, surface).Read());
  return reader.Finish();
}

}  // namespace wellspace::formats
