// Stanford's PLY: the vertices.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/ply_rows.h"
#include "client/formats/table_columns.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kPlyAxes = 3;

class PlyReader {
 public:
  PlyReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), rows_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(rows_.ReadHeader());
    PlyElement* const vertices = rows_.Find("vertex");
    if (vertices == nullptr) {
      return reader_.Error("expected an element \"vertex\" in the header");
    }
    WELLSPACE_RETURN_IF_ERROR(rows_.CheckUpTo(*vertices));
    roles_.resize(vertices->properties.size());
    WELLSPACE_RETURN_IF_ERROR(ChooseProperties(vertices->properties));
    KeepAttributes(vertices->properties);
    uint64_t faces = 0;
    for (const PlyElement& element : rows_.elements()) {
      faces += element.name == "face" || element.name == "tristrips" ? element.count : 0;
    }
    NoteFaces(faces, cloud_);
    for (const PlyElement* element = rows_.elements().data(); element <= vertices; ++element) {
      for (uint64_t row = 0; row < element->count; ++row) {
        WELLSPACE_RETURN_IF_ERROR(element == vertices ? ReadVertex(*element, row) : rows_.SkipRow(*element, row));
      }
    }
    return absl::OkStatus();
  }

 private:
  // The meaning of a property of the vertices, if any.
  struct Role {
    int axis = -1;       // of the coordinate that it holds, or -1
    int attribute = -1;  // of the cloud that it is, or -1
  };

  // Decides which properties of the vertices are coordinates.
  absl::Status ChooseProperties(const std::vector<PlyProperty>& properties) {
    if (!options_.columns.empty()) {
      std::vector<std::string> names;
      for (const PlyProperty& property : properties) {
        names.push_back(property.name);
      }
      const absl::StatusOr<std::vector<size_t>> columns =
          ResolveColumns(options_.columns, names, names.size(), options_.dimension);
      if (!columns.ok()) {
        return reader_.Error(std::string(columns.status().message()));
      }
      for (size_t axis = 0; axis < columns->size(); ++axis) {
        const PlyProperty& property = properties[(*columns)[axis]];
        if (property.list_count) {
          return reader_.Error(
              absl::StrCat("--columns: expected a number in each vertex, and ", Quote(property.name), " is a list"));
        }
        roles_[(*columns)[axis]].axis = static_cast<int>(axis);
      }
      cloud_.dimension = static_cast<int>(columns->size());
      return absl::OkStatus();
    }
    std::array<int, kPlyAxes> seen{};
    for (size_t i = 0; i < properties.size(); ++i) {
      const PlyProperty& property = properties[i];
      const char name = property.name.size() == 1 ? absl::ascii_tolower(property.name[0]) : '\0';
      if (!property.list_count && name >= 'x' && name <= 'z') {
        roles_[i].axis = name - 'x';
        ++seen[roles_[i].axis];
      }
    }
    if (seen[0] != 1 || seen[1] != 1 || seen[2] > 1) {
      return reader_.Error(
          "expected one property x, one y and at most one z of element \"vertex\"; --columns takes others");
    }
    cloud_.dimension = 2 + seen[2];
    const int wanted = options_.dimension;
    if (wanted != 0 && wanted != cloud_.dimension) {
      return reader_.Error(absl::StrCat("expected ", wanted, " coordinates, got ", cloud_.dimension,
                                        " as properties of element \"vertex\"",
                                        wanted < cloud_.dimension ? "; --columns x,y takes 2 of them" : ""));
    }
    return absl::OkStatus();
  }

  void KeepAttributes(const std::vector<PlyProperty>& properties) {
    for (size_t i = 0; i < properties.size(); ++i) {
      if (options_.keep_attributes && roles_[i].axis < 0 && !properties[i].list_count) {
        roles_[i].attribute = static_cast<int>(cloud_.attributes.size());
        cloud_.attributes.push_back({.name = properties[i].name, .values = {}});
      }
    }
    attributes_.resize(cloud_.attributes.size());
  }

  absl::Status ReadVertex(const PlyElement& vertices, uint64_t row) {
    std::array<double, kMaxDimension> point;
    bool is_invalid = false;
    WELLSPACE_RETURN_IF_ERROR(
        rows_.ReadRow(vertices, row, [&](const PlyValue& value) { return TakeValue(value, point, is_invalid); }));
    if (is_invalid) {
      ++cloud_.skipped;
      return absl::OkStatus();
    }
    cloud_.points.insert(cloud_.points.end(), point.begin(), point.begin() + cloud_.dimension);
    if (rows_.is_ascii()) {
      cloud_.lines.Add(reader_.line_number());
    } else if (options_.skip_invalid) {
      cloud_.rows.Add(row);
    }
    for (size_t i = 0; i < attributes_.size(); ++i) {
      cloud_.attributes[i].values.push_back(attributes_[i]);
    }
    return absl::OkStatus();
  }

  // Only coordinates have to be finite numbers.
  absl::Status TakeValue(const PlyValue& value, std::array<double, kMaxDimension>& point, bool& is_invalid) {
    const Role& role = roles_[value.property];
    if (role.attribute >= 0) {
      double& attribute = attributes_[role.attribute];
      if (!rows_.is_ascii()) {
        attribute = value.number;
      } else if (ReadCoordinate(value.text, attribute) != CoordinateKind::kFinite) {
        attribute = std::numeric_limits<double>::quiet_NaN();
      }
    }
    if (role.axis < 0) {
      return absl::OkStatus();
    }
    double& coordinate = point[role.axis];
    if (rows_.is_ascii()) {
      return TakeCoordinate(value.text, options_.skip_invalid, coordinate, is_invalid);
    }
    if (!std::isfinite(value.number) && !options_.skip_invalid) {
      return absl::InvalidArgumentError(absl::StrCat("coordinate ", role.axis + 1, ": expected a finite number, got ",
                                                     value.number, std::string(kSkipInvalidHint)));
    }
    is_invalid |= !std::isfinite(value.number);
    coordinate = value.number;
    return absl::OkStatus();
  }

  LineReader& reader_;
  PlyRows rows_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  std::vector<Role> roles_;         // by property of the vertices
  std::vector<double> attributes_;  // of a vertex
};

}  // namespace

absl::Status ReadPly(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return PlyReader(reader, options, cloud).Read();
}

}  // namespace wellspace::formats
