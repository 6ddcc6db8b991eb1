// Stanford's PLY: the vertices.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/number.h"
#include "client/formats/table_columns.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kPlyAxes = 3;

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct ScalarName {
  std::string_view name;
  Scalar type;
};
constexpr std::array kScalarNames = {
    ScalarName{"char", Scalar::kInt8},      ScalarName{"int8", Scalar::kInt8},
    ScalarName{"uchar", Scalar::kUint8},    ScalarName{"uint8", Scalar::kUint8},
    ScalarName{"short", Scalar::kInt16},    ScalarName{"int16", Scalar::kInt16},
    ScalarName{"ushort", Scalar::kUint16},  ScalarName{"uint16", Scalar::kUint16},
    ScalarName{"int", Scalar::kInt32},      ScalarName{"int32", Scalar::kInt32},
    ScalarName{"uint", Scalar::kUint32},    ScalarName{"uint32", Scalar::kUint32},
    ScalarName{"float", Scalar::kFloat32},  ScalarName{"float32", Scalar::kFloat32},
    ScalarName{"double", Scalar::kFloat64}, ScalarName{"float64", Scalar::kFloat64},
};

std::optional<Scalar> ScalarOf(std::string_view name) {
  for (const ScalarName& row : kScalarNames) {
    if (row.name == name) {
      return row.type;
    }
  }
  return std::nullopt;
}

size_t BytesOf(Scalar type) {
  switch (type) {
    case Scalar::kInt8:
    case Scalar::kUint8:
      return 1;
    case Scalar::kInt16:
    case Scalar::kUint16:
      return 2;
    case Scalar::kInt32:
    case Scalar::kUint32:
    case Scalar::kFloat32:
      return 4;
    case Scalar::kFloat64:
      break;
  }
  return 8;
}

double ValueOf(std::string_view bytes, Scalar type, bool big_endian) {
  switch (type) {
    case Scalar::kInt8:
      return LoadWord<int8_t>(bytes, 0, big_endian);
    case Scalar::kUint8:
      return LoadWord<uint8_t>(bytes, 0, big_endian);
    case Scalar::kInt16:
      return LoadWord<int16_t>(bytes, 0, big_endian);
    case Scalar::kUint16:
      return LoadWord<uint16_t>(bytes, 0, big_endian);
    case Scalar::kInt32:
      return LoadWord<int32_t>(bytes, 0, big_endian);
    case Scalar::kUint32:
      return LoadWord<uint32_t>(bytes, 0, big_endian);
    case Scalar::kFloat32:
      return LoadWord<float>(bytes, 0, big_endian);
    case Scalar::kFloat64:
      break;
  }
  return LoadWord<double>(bytes, 0, big_endian);
}

struct Property {
  std::optional<Scalar> list_count;  // the type of the number of values, if it is a list
  Scalar type;
  std::string name;
  int axis = -1;       // of the coordinate that it holds, or -1
  int attribute = -1;  // of the cloud that it is, or -1
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

class PlyReader {
 public:
  PlyReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadHeader());
    WELLSPACE_RETURN_IF_ERROR(ChooseProperties(elements_.back().properties));
    KeepAttributes(elements_.back().properties);
    NoteFaces(faces_, cloud_);
    for (const Element& element : elements_) {
      const bool is_vertex = &element == &elements_.back();
      for (uint64_t row = 0; row < element.count; ++row) {
        absl::Status status = !is_ascii_  ? ReadBinary(element, row, is_vertex)
                              : is_vertex ? ReadLine(element, row)
                                          : SkipLine(element, row);
        if (!status.ok()) {
          return status;
        }
      }
    }
    return absl::OkStatus();
  }

 private:
  // Decides which properties of the vertices are coordinates.
  absl::Status ChooseProperties(std::vector<Property>& properties) {
    if (!options_.columns.empty()) {
      std::vector<std::string> names;
      for (const Property& property : properties) {
        names.push_back(property.name);
      }
      const absl::StatusOr<std::vector<size_t>> columns =
          ResolveColumns(options_.columns, names, names.size(), options_.dimension);
      if (!columns.ok()) {
        return reader_.Error(std::string(columns.status().message()));
      }
      for (size_t axis = 0; axis < columns->size(); ++axis) {
        Property& property = properties[(*columns)[axis]];
        if (property.list_count) {
          return reader_.Error(
              absl::StrCat("--columns: expected a number in each vertex, and ", Quote(property.name), " is a list"));
        }
        property.axis = static_cast<int>(axis);
      }
      cloud_.dimension = static_cast<int>(columns->size());
      return absl::OkStatus();
    }
    std::array<int, kPlyAxes> seen{};
    for (Property& property : properties) {
      const char name = property.name.size() == 1 ? absl::ascii_tolower(property.name[0]) : '\0';
      if (!property.list_count && name >= 'x' && name <= 'z') {
        property.axis = name - 'x';
        ++seen[property.axis];
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

  void KeepAttributes(std::vector<Property>& properties) {
    for (Property& property : properties) {
      if (options_.keep_attributes && property.axis < 0 && !property.list_count) {
        property.attribute = static_cast<int>(cloud_.attributes.size());
        cloud_.attributes.push_back({.name = property.name, .values = {}});
      }
    }
    attributes_.resize(cloud_.attributes.size());
  }

  void AddAttributes() {
    for (size_t i = 0; i < attributes_.size(); ++i) {
      cloud_.attributes[i].values.push_back(attributes_[i]);
    }
  }

  // The next line of the header as fields. False at the end of the file.
  bool NextFields(std::vector<std::string_view>& fields) {
    std::string_view line;
    if (!reader_.Next(line)) {
      return false;
    }
    fields.clear();
    FieldSplitter splitter(line, ' ');
    for (std::string_view field; splitter.Next(field);) {
      fields.push_back(field);
    }
    return true;
  }

  // Elements after the vertices are not kept.
  absl::Status ReadHeader() {
    std::vector<std::string_view> fields;
    if (!NextFields(fields) || fields.size() != 1 || fields[0] != "ply") {
      return reader_.EndError("expected \"ply\"");
    }
    bool has_format = false;
    bool has_vertices = false;
    while (NextFields(fields)) {
      if (fields.empty() || fields[0] == "comment" || fields[0] == "obj_info") {
        continue;
      }
      if (fields[0] == "end_header") {
        if (!has_format) {
          return reader_.Error("expected a line \"format\" before the end of the header");
        }
        return CheckElements(has_vertices);
      }
      absl::Status status;
      if (fields[0] == "format") {
        has_format = true;
        status = ReadFormat(fields);
      } else if (fields[0] == "element") {
        status = ReadElement(fields, has_vertices);
      } else if (fields[0] == "property") {
        status = ReadProperty(fields);
      } else {
        status = reader_.Error(absl::StrCat(
            "expected \"format\", \"element\", \"property\", \"comment\" or \"end_header\", got ", Quote(fields[0])));
      }
      if (!status.ok()) {
        return status;
      }
    }
    return reader_.EndError("the file ends inside its header; expected \"end_header\"");
  }

  // Every row of an element takes bytes: nothing is repeated more often than the file is long.
  absl::Status CheckElements(bool has_vertices) const {
    for (const Element& element : elements_) {
      if (element.properties.empty()) {
        return reader_.Error(absl::StrCat("expected a property of element ", Quote(element.name), ", got none"));
      }
    }
    return has_vertices ? absl::OkStatus() : reader_.Error("expected an element \"vertex\" in the header");
  }

  absl::Status ReadFormat(const std::vector<std::string_view>& fields) {
    const std::string_view format = fields.size() > 1 ? fields[1] : "";
    if (fields.size() != 3 || fields[2] != "1.0" ||
        (format != "ascii" && format != "binary_little_endian" && format != "binary_big_endian")) {
      return reader_.Error(
          absl::StrCat("expected format ascii, binary_little_endian or binary_big_endian, and version 1.0, got ",
                       Quote(format), " and ", Quote(fields.size() > 2 ? fields[2] : "")));
    }
    is_ascii_ = format == "ascii";
    is_big_endian_ = format == "binary_big_endian";
    return absl::OkStatus();
  }

  absl::Status ReadElement(const std::vector<std::string_view>& fields, bool& has_vertices) {
    Element element;
    if (fields.size() != 3 || !ParseUnsigned(fields[2], kMaxCount, element.count)) {
      return reader_.Error("expected \"element\", a name and a whole number below 2^32");
    }
    element.name = fields[1];
    faces_ += element.name == "face" || element.name == "tristrips" ? element.count : 0;
    is_kept_ = !has_vertices;
    if (is_kept_) {
      has_vertices = element.name == "vertex";
      elements_.push_back(std::move(element));
    } else if (element.name == "vertex") {
      return reader_.Error("expected one element \"vertex\", got another one");
    }
    return absl::OkStatus();
  }

  absl::Status ReadProperty(const std::vector<std::string_view>& fields) {
    const bool is_list = fields.size() > 1 && fields[1] == "list";
    const size_t type_at = is_list ? 3 : 1;
    if (elements_.empty() || fields.size() != type_at + 2) {
      return reader_.Error(
          "expected \"property\" with a type and a name, or \"property list\" with two types and a name, of an "
          "element");
    }
    for (size_t i = is_list ? 2 : 1; i <= type_at; ++i) {
      if (!ScalarOf(fields[i])) {
        return reader_.Error(absl::StrCat(
            "expected a type (char, uchar, short, ushort, int, uint, float, double, or int8, uint8, int16, "
            "uint16, int32, uint32, float32, float64), got ",
            Quote(fields[i])));
      }
    }
    Property property{
        .list_count = std::nullopt, .type = *ScalarOf(fields[type_at]), .name = std::string(fields.back())};
    if (is_list) {
      property.list_count = ScalarOf(fields[2]);
      if (*property.list_count == Scalar::kFloat32 || *property.list_count == Scalar::kFloat64) {
        return reader_.Error(absl::StrCat("expected a whole type for the length of a list, got ", Quote(fields[2])));
      }
    }
    if (is_kept_) {
      elements_.back().properties.push_back(std::move(property));
    }
    return absl::OkStatus();
  }

  absl::Status SkipLine(const Element& element, uint64_t row) {
    std::string_view line;
    return reader_.NextContent(line) ? absl::OkStatus() : EndError(element, row);
  }

  absl::Status ReadLine(const Element& element, uint64_t row) {
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return EndError(element, row);
    }
    std::array<double, kMaxDimension> point;
    bool is_invalid = false;
    FieldSplitter fields(line, ' ');
    std::string_view field;
    size_t index = 0;
    for (const Property& property : element.properties) {
      ++index;
      if (!fields.Next(field)) {
        return reader_.Error(absl::StrCat("expected more than ", index - 1, " values, as the header says"));
      }
      if (property.list_count) {
        WELLSPACE_RETURN_IF_ERROR(SkipList(fields, field, index));
      } else if (property.axis >= 0) {  // only coordinates have to be finite numbers
        const absl::Status status = TakeCoordinate(field, options_.skip_invalid, point[property.axis], is_invalid);
        if (!status.ok()) {
          return reader_.Error(absl::StrCat("value ", index, ": ", status.message()));
        }
      } else if (property.attribute >= 0 &&
                 ReadCoordinate(field, attributes_[property.attribute]) != CoordinateKind::kFinite) {
        attributes_[property.attribute] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    if (fields.Next(field)) {
      return reader_.Error(absl::StrCat("expected the end of the line, as the header says, got ", Quote(field)));
    }
    AddPoint({point.data(), static_cast<size_t>(cloud_.dimension)}, is_invalid, reader_.line_number(), cloud_);
    if (!is_invalid) {
      AddAttributes();
    }
    return absl::OkStatus();
  }

  // Skips the values of a list, whose length is `field`, value number `index`.
  absl::Status SkipList(FieldSplitter& fields, std::string_view field, size_t index) const {
    uint64_t count = 0;
    if (!ParseUnsigned(field, kMaxCount, count)) {
      return reader_.Error(
          absl::StrCat("value ", index, ": expected the length of a list, a whole number, got ", Quote(field)));
    }
    for (; count > 0; --count) {
      if (!fields.Next(field)) {
        return reader_.Error(
            absl::StrCat("expected ", count, " more values in the list that value ", index, " announces"));
      }
    }
    return absl::OkStatus();
  }

  // One scalar. False at the end of the file.
  bool Take(Scalar type, double& value) {
    char bytes[sizeof(double)];
    const size_t size = BytesOf(type);
    if (reader_.Take(bytes, size) != size) {
      return false;
    }
    value = ValueOf({bytes, size}, type, is_big_endian_);
    return true;
  }

  bool Skip(uint64_t bytes) {
    char block[1 << 12];
    while (bytes > 0) {
      const size_t size = std::min<uint64_t>(bytes, sizeof(block));
      if (reader_.Take(block, size) != size) {
        return false;
      }
      bytes -= size;
    }
    return true;
  }

  absl::Status ReadBinary(const Element& element, uint64_t row, bool is_vertex) {
    std::array<double, kMaxDimension> point;
    bool is_invalid = false;
    for (const Property& property : element.properties) {
      const uint64_t offset = reader_.offset();
      double value = 0;
      if (!Take(property.list_count.value_or(property.type), value)) {
        return EndError(element, row);
      }
      if (property.list_count) {
        if (value < 0) {
          return BinaryError(element, row, offset,
                             absl::StrCat("expected the length of a list, zero or more, got ", value));
        }
        if (!Skip(static_cast<uint64_t>(value) * BytesOf(property.type))) {
          return EndError(element, row);
        }
      } else if (property.axis >= 0) {
        if (!std::isfinite(value) && !options_.skip_invalid) {
          return BinaryError(element, row, offset,
                             absl::StrCat("coordinate ", property.axis + 1, ": expected a finite number, got ", value,
                                          std::string(kSkipInvalidHint)));
        }
        is_invalid |= !std::isfinite(value);
        point[property.axis] = value;
      } else if (property.attribute >= 0) {
        attributes_[property.attribute] = value;
      }
    }
    if (is_vertex && is_invalid) {
      ++cloud_.skipped;
    } else if (is_vertex) {
      cloud_.points.insert(cloud_.points.end(), point.begin(), point.begin() + cloud_.dimension);
      AddAttributes();
      if (options_.skip_invalid) {
        cloud_.rows.Add(row);
      }
    }
    return absl::OkStatus();
  }

  absl::Status BinaryError(const Element& element, uint64_t row, uint64_t offset, const std::string& message) const {
    return absl::InvalidArgumentError(
        absl::StrCat(cloud_.name, ": byte ", offset, ": element ", Quote(element.name), " ", row, ": ", message));
  }

  absl::Status EndError(const Element& element, uint64_t row) const {
    if (!reader_.status().ok()) {
      return reader_.status();
    }
    const std::string message = absl::StrCat("expected ", element.count, " rows of element ", Quote(element.name),
                                             ", as the header says; the file ends in row ", row);
    return is_ascii_ ? reader_.Error(message) : BinaryError(element, row, reader_.offset(), message);
  }

  LineReader& reader_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  uint64_t faces_ = 0;
  bool is_ascii_ = true;
  bool is_big_endian_ = false;
  std::vector<Element> elements_;   // up to the vertices
  bool is_kept_ = false;            // the element that the header speaks of
  std::vector<double> attributes_;  // of a vertex
};

}  // namespace

absl::Status ReadPly(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return PlyReader(reader, options, cloud).Read();
}

}  // namespace wellspace::formats
