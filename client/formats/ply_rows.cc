#include "client/formats/ply_rows.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

struct ScalarName {
  std::string_view name;
  PlyScalar type;
};
constexpr std::array kScalarNames = {
    ScalarName{"char", PlyScalar::kInt8},      ScalarName{"int8", PlyScalar::kInt8},
    ScalarName{"uchar", PlyScalar::kUint8},    ScalarName{"uint8", PlyScalar::kUint8},
    ScalarName{"short", PlyScalar::kInt16},    ScalarName{"int16", PlyScalar::kInt16},
    ScalarName{"ushort", PlyScalar::kUint16},  ScalarName{"uint16", PlyScalar::kUint16},
    ScalarName{"int", PlyScalar::kInt32},      ScalarName{"int32", PlyScalar::kInt32},
    ScalarName{"uint", PlyScalar::kUint32},    ScalarName{"uint32", PlyScalar::kUint32},
    ScalarName{"float", PlyScalar::kFloat32},  ScalarName{"float32", PlyScalar::kFloat32},
    ScalarName{"double", PlyScalar::kFloat64}, ScalarName{"float64", PlyScalar::kFloat64},
};

std::optional<PlyScalar> ScalarOf(std::string_view name) {
  for (const ScalarName& row : kScalarNames) {
    if (row.name == name) {
      return row.type;
    }
  }
  return std::nullopt;
}

size_t BytesOf(PlyScalar type) {
  switch (type) {
    case PlyScalar::kInt8:
    case PlyScalar::kUint8:
      return 1;
    case PlyScalar::kInt16:
    case PlyScalar::kUint16:
      return 2;
    case PlyScalar::kInt32:
    case PlyScalar::kUint32:
    case PlyScalar::kFloat32:
      return 4;
    case PlyScalar::kFloat64:
      break;
  }
  return 8;
}

double ValueOf(std::string_view bytes, PlyScalar type, bool big_endian) {
  switch (type) {
    case PlyScalar::kInt8:
      return LoadWord<int8_t>(bytes, 0, big_endian);
    case PlyScalar::kUint8:
      return LoadWord<uint8_t>(bytes, 0, big_endian);
    case PlyScalar::kInt16:
      return LoadWord<int16_t>(bytes, 0, big_endian);
    case PlyScalar::kUint16:
      return LoadWord<uint16_t>(bytes, 0, big_endian);
    case PlyScalar::kInt32:
      return LoadWord<int32_t>(bytes, 0, big_endian);
    case PlyScalar::kUint32:
      return LoadWord<uint32_t>(bytes, 0, big_endian);
    case PlyScalar::kFloat32:
      return LoadWord<float>(bytes, 0, big_endian);
    case PlyScalar::kFloat64:
      break;
  }
  return LoadWord<double>(bytes, 0, big_endian);
}

}  // namespace

PlyElement* PlyRows::Find(std::string_view name) {
  const auto at = std::find_if(elements_.begin(), elements_.end(),
                               [name](const PlyElement& element) { return element.name == name; });
  return at == elements_.end() ? nullptr : &*at;
}

// The next line of the header as fields. False at the end of the file.
bool PlyRows::NextFields(std::vector<std::string_view>& fields) {
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

absl::Status PlyRows::ReadHeader() {
  std::vector<std::string_view> fields;
  if (!NextFields(fields) || fields.size() != 1 || fields[0] != "ply") {
    return reader_.EndError("expected \"ply\"");
  }
  bool has_format = false;
  while (NextFields(fields)) {
    if (fields.empty() || fields[0] == "comment" || fields[0] == "obj_info") {
      continue;
    }
    if (fields[0] == "end_header") {
      return has_format ? absl::OkStatus() : reader_.Error("expected a line \"format\" before the end of the header");
    }
    absl::Status status;
    if (fields[0] == "format") {
      has_format = true;
      status = ReadFormat(fields);
    } else if (fields[0] == "element") {
      status = ReadElement(fields);
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

absl::Status PlyRows::CheckUpTo(const PlyElement& last) const {
  for (const PlyElement& element : elements_) {
    if (element.properties.empty()) {
      return reader_.Error(absl::StrCat("expected a property of element ", Quote(element.name), ", got none"));
    }
    if (&element == &last) {
      break;
    }
  }
  return absl::OkStatus();
}

absl::Status PlyRows::ReadFormat(const std::vector<std::string_view>& fields) {
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

absl::Status PlyRows::ReadElement(const std::vector<std::string_view>& fields) {
  PlyElement element;
  if (fields.size() != 3 || !ParseUnsigned(fields[2], kMaxCount, element.count)) {
    return reader_.Error("expected \"element\", a name and a whole number below 2^32");
  }
  element.name = fields[1];
  if (element.name == "vertex" && Find(element.name) != nullptr) {
    return reader_.Error("expected one element \"vertex\", got another one");
  }
  elements_.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status PlyRows::ReadProperty(const std::vector<std::string_view>& fields) {
  const bool is_list = fields.size() > 1 && fields[1] == "list";
  const size_t type_at = is_list ? 3 : 1;
  if (elements_.empty() || fields.size() != type_at + 2) {
    return reader_.Error(
        "expected \"property\" with a type and a name, or \"property list\" with two types and a name, of an "
        "element");
  }
  for (size_t i = is_list ? 2 : 1; i <= type_at; ++i) {
    if (!ScalarOf(fields[i])) {
      return reader_.Error(
          absl::StrCat("expected a type (char, uchar, short, ushort, int, uint, float, double, or int8, uint8, int16, "
                       "uint16, int32, uint32, float32, float64), got ",
                       Quote(fields[i])));
    }
  }
  PlyProperty property{.list_count = std::nullopt,
                       .type = *ScalarOf(fields[type_at]),
                       .name = std::string(fields.back()),
                       .is_wanted = !is_list};
  if (is_list) {
    property.list_count = ScalarOf(fields[2]);
    if (*property.list_count == PlyScalar::kFloat32 || *property.list_count == PlyScalar::kFloat64) {
      return reader_.Error(absl::StrCat("expected a whole type for the length of a list, got ", Quote(fields[2])));
    }
  }
  elements_.back().properties.push_back(std::move(property));
  return absl::OkStatus();
}

absl::Status PlyRows::ReadRow(const PlyElement& element, uint64_t row, Take take) {
  return is_ascii_ ? ReadLine(element, row, take) : ReadBinary(element, row, take);
}

absl::Status PlyRows::SkipRow(const PlyElement& element, uint64_t row) {
  if (!is_ascii_) {
    return ReadBinary(element, row, [](const PlyValue&) { return absl::OkStatus(); });
  }
  std::string_view line;
  return reader_.NextContent(line) ? absl::OkStatus() : EndError(element, row);
}

absl::Status PlyRows::ReadLine(const PlyElement& element, uint64_t row, Take take) {
  std::string_view line;
  if (!reader_.NextContent(line)) {
    return EndError(element, row);
  }
  FieldSplitter fields(line, ' ');
  std::string_view field;
  size_t index = 0;
  for (size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    ++index;
    if (!fields.Next(field)) {
      return reader_.Error(absl::StrCat("expected more than ", index - 1, " values, as the header says"));
    }
    if (property.list_count) {
      WELLSPACE_RETURN_IF_ERROR(ReadList(fields, field, index, property.is_wanted));
    }
    if (!property.is_wanted) {
      continue;
    }
    const absl::Status status = take({.property = p, .text = property.list_count ? "" : field, .list = list_});
    if (!status.ok()) {
      return reader_.Error(absl::StrCat("value ", index, ": ", status.message()));
    }
  }
  if (fields.Next(field)) {
    return reader_.Error(absl::StrCat("expected the end of the line, as the header says, got ", Quote(field)));
  }
  return absl::OkStatus();
}

// Reads the values of a list, whose length is `field`, value number `index`; or skips them.
absl::Status PlyRows::ReadList(FieldSplitter& fields, std::string_view field, size_t index, bool is_wanted) {
  uint64_t count = 0;
  if (!ParseUnsigned(field, kMaxCount, count)) {
    return reader_.Error(
        absl::StrCat("value ", index, ": expected the length of a list, a whole number, got ", Quote(field)));
  }
  list_.clear();
  for (; count > 0; --count) {
    if (!fields.Next(field)) {
      return reader_.Error(
          absl::StrCat("expected ", count, " more values in the list that value ", index, " announces"));
    }
    if (is_wanted) {
      if (const absl::Status status = TakeFinite(field, list_.emplace_back()); !status.ok()) {
        return reader_.Error(absl::StrCat("value ", index, ": ", status.message()));
      }
    }
  }
  return absl::OkStatus();
}

// One scalar. False at the end of the file.
bool PlyRows::TakeScalar(PlyScalar type, double& value) {
  char bytes[sizeof(double)];
  const size_t size = BytesOf(type);
  if (reader_.Take(bytes, size) != size) {
    return false;
  }
  value = ValueOf({bytes, size}, type, is_big_endian_);
  return true;
}

bool PlyRows::Skip(uint64_t bytes) {
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

absl::Status PlyRows::ReadBinary(const PlyElement& element, uint64_t row, Take take) {
  for (size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    const uint64_t offset = reader_.offset();
    double value = 0;
    if (!TakeScalar(property.list_count.value_or(property.type), value)) {
      return EndError(element, row);
    }
    if (property.list_count) {
      if (value < 0) {
        return BinaryError(element, row, offset,
                           absl::StrCat("expected the length of a list, zero or more, got ", value));
      }
      WELLSPACE_RETURN_IF_ERROR(ReadBinaryList(element, row, property, static_cast<uint64_t>(value)));
    }
    if (!property.is_wanted) {
      continue;
    }
    if (const absl::Status status = take({.property = p, .number = value, .list = list_}); !status.ok()) {
      return BinaryError(element, row, offset, std::string(status.message()));
    }
  }
  return absl::OkStatus();
}

// Reads `count` values, or skips them.
absl::Status PlyRows::ReadBinaryList(const PlyElement& element, uint64_t row, const PlyProperty& property,
                                     uint64_t count) {
  list_.clear();
  if (!property.is_wanted) {
    return Skip(count * BytesOf(property.type)) ? absl::OkStatus() : EndError(element, row);
  }
  for (; count > 0; --count) {
    if (!TakeScalar(property.type, list_.emplace_back())) {
      return EndError(element, row);
    }
  }
  return absl::OkStatus();
}

absl::Status PlyRows::BinaryError(const PlyElement& element, uint64_t row, uint64_t offset,
                                  const std::string& message) const {
  return absl::InvalidArgumentError(
      absl::StrCat(reader_.name(), ": byte ", offset, ": element ", Quote(element.name), " ", row, ": ", message));
}

absl::Status PlyRows::EndError(const PlyElement& element, uint64_t row) const {
  if (!reader_.status().ok()) {
    return reader_.status();
  }
  const std::string message = absl::StrCat("expected ", element.count, " rows of element ", Quote(element.name),
                                           ", as the header says; the file ends in row ", row);
  return is_ascii_ ? reader_.Error(message) : BinaryError(element, row, reader_.offset(), message);
}

}  // namespace wellspace::formats
