// VTK's legacy format, ascii and binary, versions 1.0 to 5.1: the points and their data.
// https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kVtkMaxComponents = 64;
// Of numbers that are skipped: cells with their vertices.
constexpr uint64_t kVtkMaxNumbers = uint64_t{1} << 40;

struct VtkType {
  std::string_view name;
  size_t bytes;  // 0: a bit
  double (*value)(std::string_view bytes);
};

template <typename T>
double VtkValue(std::string_view bytes) {
  return static_cast<double>(LoadWord<T>(bytes, 0, /*big_endian=*/true));
}

constexpr std::array kVtkTypes = {
    VtkType{"bit", 0, nullptr},
    VtkType{"char", 1, VtkValue<int8_t>},
    VtkType{"signed_char", 1, VtkValue<int8_t>},
    VtkType{"unsigned_char", 1, VtkValue<uint8_t>},
    VtkType{"short", 2, VtkValue<int16_t>},
    VtkType{"unsigned_short", 2, VtkValue<uint16_t>},
    VtkType{"int", 4, VtkValue<int32_t>},
    VtkType{"unsigned_int", 4, VtkValue<uint32_t>},
    VtkType{"long", 8, VtkValue<int64_t>},
    VtkType{"unsigned_long", 8, VtkValue<uint64_t>},
    VtkType{"vtktypeint64", 8, VtkValue<int64_t>},
    VtkType{"vtktypeuint64", 8, VtkValue<uint64_t>},
    VtkType{"vtkidtype", 4, VtkValue<int32_t>},
    VtkType{"float", 4, VtkValue<float>},
    VtkType{"double", 8, VtkValue<double>},
};

// "My%20name" as it was before.
std::string DecodedVtkName(std::string_view name) {
  std::string decoded;
  for (size_t i = 0; i < name.size(); ++i) {
    if (name[i] == '%' && i + 2 < name.size() && absl::ascii_isxdigit(static_cast<unsigned char>(name[i + 1])) &&
        absl::ascii_isxdigit(static_cast<unsigned char>(name[i + 2]))) {
      decoded += static_cast<char>(std::stoi(std::string(name.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      decoded += name[i];
    }
  }
  return decoded;
}

class VtkPointsReader {
 public:
  VtkPointsReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), fields_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadHeader());
    while (NextKeyword() && !is_done_) {
      WELLSPACE_RETURN_IF_ERROR(ReadSection());
    }
    WELLSPACE_RETURN_IF_ERROR(reader_.status());
    if (!has_points_) {
      return reader_.Error("the file ends; expected \"POINTS\"");
    }
    return AddAllRows(names_, columns_, options_, cloud_);
  }

 private:
  absl::Status ReadHeader() {
    std::string_view line;
    if (!reader_.Next(line) || line.substr(0, 22) != "# vtk DataFile Version") {
      return reader_.EndError("expected \"# vtk DataFile Version\" at the start of the file");
    }
    if (!reader_.Next(line) || !reader_.Next(line)) {  // the first is a title
      return reader_.EndError("expected a title, and \"ASCII\" or \"BINARY\"");
    }
    const std::string encoding = absl::AsciiStrToUpper(std::string(TrimBlanks(line)));
    if (encoding != "ASCII" && encoding != "BINARY") {
      return reader_.Error(absl::StrCat("expected \"ASCII\" or \"BINARY\", got ", Quote(line)));
    }
    is_ascii_ = encoding == "ASCII";
    return absl::OkStatus();
  }

  // The fields of the next line that has any, the first in upper case. False at the end of the file.
  bool NextKeyword() {
    fields_.DropLine();
    std::string_view line;
    if (is_done_ || !reader_.NextContent(line)) {
      return false;
    }
    words_.clear();
    FieldSplitter splitter(line, ' ');
    for (std::string_view word; splitter.Next(word) && words_.size() < kVtkMaxComponents;) {
      words_.emplace_back(word);
    }
    keyword_ = absl::AsciiStrToUpper(words_[0]);
    return true;
  }

  absl::Status ReadSection() {
    if (keyword_ == "DATASET") {
      const std::string kind = absl::AsciiStrToUpper(words_.size() > 1 ? words_[1] : "");
      return kind == "POLYDATA" || kind == "UNSTRUCTURED_GRID" || kind == "STRUCTURED_GRID"
                 ? absl::OkStatus()
                 : reader_.Error(absl::StrCat("expected DATASET POLYDATA, UNSTRUCTURED_GRID or STRUCTURED_GRID, got ",
                                              Quote(words_.size() > 1 ? words_[1] : "")));
    }
    if (keyword_ == "POINTS") {
      return ReadPoints();
    }
    if (keyword_ == "DIMENSIONS") {
      return absl::OkStatus();
    }
    if (keyword_ == "METADATA") {
      return SkipMetadata();
    }
    if (keyword_ == "POINT_DATA" || keyword_ == "CELL_DATA") {
      is_of_points_ = keyword_ == "POINT_DATA";
      WELLSPACE_RETURN_IF_ERROR(TakeCount(1, kMaxCount, data_count_));
      return is_of_points_ && data_count_ != point_count_
                 ? reader_.Error(absl::StrCat("expected data of ", point_count_, " points, got ", data_count_))
                 : absl::OkStatus();
    }
    for (const char* cells : {"VERTICES", "LINES", "POLYGONS", "TRIANGLE_STRIPS", "CELLS", "CELL_TYPES"}) {
      if (keyword_ == cells) {
        return SkipCells();
      }
    }
    return ReadData();
  }

  // The whole number of at most `limit` that is word number `index` of the line.
  absl::Status TakeCount(size_t index, uint64_t limit, uint64_t& count) const {
    return index < words_.size() && ParseUnsigned(words_[index], limit, count)
               ? absl::OkStatus()
               : reader_.Error(absl::StrCat("expected a whole number of at most ", limit, " as word ", index + 1,
                                            " after ", keyword_));
  }

  absl::Status TakeType(const std::string& word, const VtkType*& type) const {
    const std::string name = absl::AsciiStrToLower(word);
    for (const VtkType& candidate : kVtkTypes) {
      if (candidate.name == name) {
        type = &candidate;
        return absl::OkStatus();
      }
    }
    return reader_.Error(
        absl::StrCat("expected a type of numbers, such as float, double, int or unsigned_char, got ", Quote(word)));
  }

  std::string WordOr(size_t index, const char* other) const { return index < words_.size() ? words_[index] : other; }

  absl::Status ReadPoints() {
    if (has_points_) {
      return reader_.Error("expected one list of points, got another one");
    }
    const VtkType* type = nullptr;
    WELLSPACE_RETURN_IF_ERROR(TakeCount(1, kMaxCount, point_count_));
    WELLSPACE_RETURN_IF_ERROR(TakeType(WordOr(2, ""), type));
    WELLSPACE_RETURN_IF_ERROR(ReadArray(3, point_count_, *type, /*is_kept=*/true));
    names_ = {"x", "y", "z"};
    has_points_ = true;
    is_done_ = !options_.keep_attributes && options_.columns.empty();
    return absl::OkStatus();
  }

  // Lines up to a blank one.
  absl::Status SkipMetadata() {
    for (std::string_view line; reader_.Next(line) && !TrimBlanks(line).empty();) {
    }
    return reader_.status();
  }

  // "CELLS n size", or from version 5.0 on also "CELLS offsets connectivity" and arrays with these names.
  absl::Status SkipCells() {
    uint64_t count = 0;
    uint64_t size = 0;
    const VtkType& whole = kVtkTypes[6];
    WELLSPACE_RETURN_IF_ERROR(TakeCount(1, kVtkMaxNumbers, count));
    if (keyword_ == "CELL_TYPES") {
      return ReadArray(1, count, whole, /*is_kept=*/false);
    }
    WELLSPACE_RETURN_IF_ERROR(TakeCount(2, kVtkMaxNumbers, size));
    if (!reader_.NextStartsWith("OFFSETS")) {
      return ReadArray(1, size, whole, /*is_kept=*/false);
    }
    for (const auto& [name, numbers] : {std::pair("OFFSETS", count), std::pair("CONNECTIVITY", size)}) {
      const VtkType* type = nullptr;
      if (!NextKeyword() || keyword_ != name) {
        return reader_.EndError(absl::StrCat("expected \"", name, "\""));
      }
      WELLSPACE_RETURN_IF_ERROR(TakeType(WordOr(1, ""), type));
      WELLSPACE_RETURN_IF_ERROR(ReadArray(1, numbers, *type, /*is_kept=*/false));
    }
    return absl::OkStatus();
  }

  absl::Status ReadData() {
    if (keyword_ == "FIELD") {
      return ReadField();
    }
    if (keyword_ == "LOOKUP_TABLE") {  // colours, of four bytes or four numbers
      uint64_t size = 0;
      WELLSPACE_RETURN_IF_ERROR(TakeCount(2, kMaxCount, size));
      return ReadArray(4, size, is_ascii_ ? kVtkTypes.back() : kVtkTypes[3], /*is_kept=*/false);
    }
    if (keyword_ == "COLOR_SCALARS") {
      uint64_t components = 0;
      WELLSPACE_RETURN_IF_ERROR(TakeCount(2, kVtkMaxComponents, components));
      return ReadNamed(WordOr(1, ""), components, data_count_, is_ascii_ ? kVtkTypes.back() : kVtkTypes[3]);
    }
    uint64_t components = 1;
    size_t type_at = 2;
    if (keyword_ == "SCALARS") {
      if (words_.size() > 3) {
        WELLSPACE_RETURN_IF_ERROR(TakeCount(3, kVtkMaxComponents, components));
      }
    } else if (keyword_ == "VECTORS" || keyword_ == "NORMALS") {
      components = 3;
    } else if (keyword_ == "TENSORS" || keyword_ == "TENSORS6") {
      components = keyword_ == "TENSORS" ? 9 : 6;
    } else if (keyword_ == "TEXTURE_COORDINATES") {
      WELLSPACE_RETURN_IF_ERROR(TakeCount(2, kVtkMaxComponents, components));
      type_at = 3;
    } else if (keyword_ == "GLOBAL_IDS" || keyword_ == "PEDIGREE_IDS") {
      components = 1;
    } else {
      return reader_.Error(
          absl::StrCat("expected the start of a section, such as POINTS or POINT_DATA, got ", Quote(words_[0])));
    }
    const std::string name = WordOr(1, "");
    const VtkType* type = nullptr;
    WELLSPACE_RETURN_IF_ERROR(TakeType(WordOr(type_at, ""), type));
    if (keyword_ == "SCALARS" && reader_.NextStartsWith("LOOKUP_TABLE")) {
      std::string_view line;
      reader_.Next(line);
    }
    return ReadNamed(name, components, data_count_, *type);
  }

  // "FIELD name arrays", then "name components rows type" and the numbers of each.
  absl::Status ReadField() {
    uint64_t arrays = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeCount(2, kMaxCount, arrays));
    for (uint64_t i = 0; i < arrays; ++i) {
      if (!NextKeyword()) {
        return reader_.EndError(absl::StrCat("expected ", arrays, " arrays, as the field says, got ", i));
      }
      if (keyword_ == "METADATA") {
        WELLSPACE_RETURN_IF_ERROR(SkipMetadata());
        --i;
        continue;
      }
      uint64_t components = 0;
      uint64_t rows = 0;
      const VtkType* type = nullptr;
      WELLSPACE_RETURN_IF_ERROR(TakeCount(1, kMaxCount, components));
      WELLSPACE_RETURN_IF_ERROR(TakeCount(2, kMaxCount, rows));
      if (absl::AsciiStrToLower(WordOr(3, "")) == "string") {
        is_done_ = true;  // how long it is nothing says
        return absl::OkStatus();
      }
      WELLSPACE_RETURN_IF_ERROR(TakeType(WordOr(3, ""), type));
      const std::string name = words_[0];
      WELLSPACE_RETURN_IF_ERROR(ReadNamed(name, components, rows, *type));
    }
    return absl::OkStatus();
  }

  // An array that is kept if it is of points.
  absl::Status ReadNamed(const std::string& name, uint64_t components, uint64_t rows, const VtkType& type) {
    const bool is_kept =
        has_points_ && is_of_points_ && rows == point_count_ && components > 0 && components <= kVtkMaxComponents;
    if (is_kept) {
      const std::vector<std::string> names = DataNames(DecodedVtkName(name), components);
      names_.insert(names_.end(), names.begin(), names.end());
    }
    return ReadArray(components, rows, type, is_kept);
  }

  // Reads `rows` times `components` numbers. If they are kept, they become columns.
  absl::Status ReadArray(uint64_t components, uint64_t rows, const VtkType& type, bool is_kept) {
    const size_t first = columns_.size();
    columns_.resize(first + (is_kept ? components : 0));
    if (components != 0 && rows > kVtkMaxNumbers / components) {
      return reader_.Error(
          absl::StrCat("expected at most ", kVtkMaxNumbers, " numbers, got ", components, " times ", rows));
    }
    const uint64_t count = components * rows;
    if (type.bytes == 0 && !is_ascii_) {
      return ReadBits(count, first, is_kept ? components : 0);
    }
    std::array<char, sizeof(double)> bytes;
    for (uint64_t i = 0; i < count; ++i) {
      double value = 0;
      if (is_ascii_) {
        WELLSPACE_RETURN_IF_ERROR(NextNumber(value));
      } else if (reader_.Take(bytes.data(), type.bytes) != type.bytes) {
        return EndError(count, i);
      } else {
        value = type.value({bytes.data(), type.bytes});
      }
      if (is_kept) {
        columns_[first + i % components].push_back(value);
      }
    }
    return absl::OkStatus();
  }

  // Eight in a byte, the first as its highest bit.
  absl::Status ReadBits(uint64_t count, size_t first, uint64_t components) {
    char byte = 0;
    for (uint64_t i = 0; i < count; ++i) {
      if (i % 8 == 0 && reader_.Take(&byte, 1) != 1) {
        return EndError(count, i);
      }
      if (components > 0) {
        columns_[first + i % components].push_back(byte >> (7 - i % 8) & 1);
      }
    }
    return absl::OkStatus();
  }

  absl::Status NextNumber(double& value) {
    std::string_view field;
    if (!fields_.Next(field)) {
      return reader_.EndError("the file ends; expected a number");
    }
    switch (ReadCoordinate(field, value)) {
      case CoordinateKind::kFinite:
        return absl::OkStatus();
      case CoordinateKind::kInvalid:
        value = std::numeric_limits<double>::quiet_NaN();
        return absl::OkStatus();
      case CoordinateKind::kNone:
        break;
    }
    return reader_.Error(absl::StrCat("expected a number, got ", Quote(field)));
  }

  absl::Status EndError(uint64_t count, uint64_t taken) const {
    return reader_.status().ok() ? absl::InvalidArgumentError(
                                       absl::StrCat(cloud_.name, ": byte ", reader_.offset(), ": expected ", count,
                                                    " numbers after ", keyword_, ", got ", taken, "; the file ends"))
                                 : reader_.status();
  }

  LineReader& reader_;
  FieldReader fields_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  bool is_ascii_ = true;
  std::string keyword_;             // of the section
  std::vector<std::string> words_;  // of its line
  bool has_points_ = false;
  bool is_of_points_ = false;  // the data that come
  bool is_done_ = false;       // what follows is not looked at
  uint64_t point_count_ = 0;
  uint64_t data_count_ = 0;
  std::vector<std::string> names_;
  std::vector<std::vector<double>> columns_;  // one of each name
};

}  // namespace

absl::Status ReadVtkPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return VtkPointsReader(reader, options, cloud).Read();
}

}  // namespace wellspace::formats
