#include "client/formats/vtk/vtk_legacy.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/names.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Of numbers that are skipped: cells with their vertices.
constexpr uint64_t kVtkMaxNumbers = uint64_t{1} << 40;

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
constexpr const VtkType& kVtkInt = kVtkTypes[6];
constexpr const VtkType& kVtkByte = kVtkTypes[3];

bool IsWholeVtkType(const VtkType& type) { return type.name != "float" && type.name != "double"; }

constexpr std::array<std::string_view, 6> kVtkCellSections = {"VERTICES",        "LINES", "POLYGONS",
                                                              "TRIANGLE_STRIPS", "CELLS", "CELL_TYPES"};

constexpr std::array<std::string_view, 5> kVtkDatasets = {"POLYDATA", "UNSTRUCTURED_GRID", "STRUCTURED_GRID",
                                                          "STRUCTURED_POINTS", "RECTILINEAR_GRID"};

absl::string_view VtkText(std::string_view text) { return {text.data(), text.size()}; }

}  // namespace

absl::Status VtkLegacyReader::ReadSections() {
  WELLSPACE_RETURN_IF_ERROR(ReadHeader());
  while (!IsDone() && !ends_early_ && NextKeyword()) {
    WELLSPACE_RETURN_IF_ERROR(ReadSection());
  }
  WELLSPACE_RETURN_IF_ERROR(reader_.status());
  return has_points_ ? absl::OkStatus() : reader_.Error("the file ends; expected \"POINTS\"");
}

// The only lines: words follow them.
absl::Status VtkLegacyReader::ReadHeader() {
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

bool VtkLegacyReader::NextWord(std::string_view& word) {
  if (std::exchange(has_pending_, false)) {
    word = pending_;
    return true;
  }
  while (!line_.Next(word) || word.empty()) {
    std::string_view line;
    if (!reader_.Next(line)) {
      return false;
    }
    line_ = FieldSplitter(line, ' ');
  }
  return true;
}

bool VtkLegacyReader::NextKeyword() {
  std::string_view word;
  if (!NextWord(word)) {
    return false;
  }
  constexpr size_t kShown = 40;
  word_ = word;
  keyword_ = absl::CHexEscape(absl::AsciiStrToUpper(word_.substr(0, kShown)));
  return true;
}

bool VtkLegacyReader::TakeWordIf(std::string_view keyword) {
  FieldSplitter rest = line_;
  std::string_view word;
  // Behind the line there may be bytes, which are no words.
  if (!is_ascii_ && !has_pending_ && !rest.Next(word) && !reader_.NextStartsWith(keyword)) {
    return false;
  }
  if (!NextWord(word)) {
    return false;
  }
  if (absl::EqualsIgnoreCase(VtkText(word), VtkText(keyword))) {
    return true;
  }
  if (word.data() != pending_.data()) {
    pending_ = word;
  }
  has_pending_ = true;
  return false;
}

std::string VtkLegacyReader::TakeName() {
  std::string_view word;
  return NextWord(word) ? std::string(word) : std::string();
}

absl::Status VtkLegacyReader::TakeCount(uint64_t limit, uint64_t& count) {
  std::string_view word;
  return NextWord(word) && ParseUnsigned(word, limit, count)
             ? absl::OkStatus()
             : reader_.EndError(absl::StrCat("expected a whole number of at most ", limit, " after ", keyword_,
                                             ", got ", Quote(word)));
}

absl::Status VtkLegacyReader::TakeType(const VtkType*& type) {
  const std::string word = TakeName();
  const std::string name = absl::AsciiStrToLower(word);
  for (const VtkType& candidate : kVtkTypes) {
    if (candidate.name == name) {
      type = &candidate;
      return absl::OkStatus();
    }
  }
  return reader_.EndError(
      absl::StrCat("expected a type of numbers, such as float, double, int or unsigned_char, got ", Quote(word)));
}

absl::Status VtkLegacyReader::ReadSection() {
  if (keyword_ == "DATASET") {
    return ReadDataset();
  }
  if (keyword_ == "POINTS") {
    return ReadPoints();
  }
  if (keyword_ == "DIMENSIONS" || keyword_ == "ORIGIN" || keyword_ == "SPACING" || keyword_ == "ASPECT_RATIO" ||
      keyword_ == "X_COORDINATES" || keyword_ == "Y_COORDINATES" || keyword_ == "Z_COORDINATES") {
    return ReadGridPart();
  }
  if (keyword_ == "METADATA") {
    return SkipMetadata();
  }
  if (keyword_ == "POINT_DATA" || keyword_ == "CELL_DATA") {
    of_ = keyword_ == "POINT_DATA" ? Data::Of::kPoints : Data::Of::kCells;
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, data_count_));
    return of_ == Data::Of::kPoints && data_count_ != point_count_
               ? reader_.Error(absl::StrCat("expected data of ", point_count_, " points, got ", data_count_))
               : absl::OkStatus();
  }
  const bool are_cells =
      std::find(kVtkCellSections.begin(), kVtkCellSections.end(), keyword_) != kVtkCellSections.end();
  return are_cells ? ReadCells() : ReadData();
}

// A part of a grid whose points are told by its axes. These come with its last part.
absl::Status VtkLegacyReader::ReadGridPart() {
  const bool is_image = dataset_ == "STRUCTURED_POINTS";
  if (keyword_ == "DIMENSIONS") {
    for (int axis = 0; axis < 3; ++axis) {
      uint64_t count = 0;
      WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, count));
      grid_.extent.last[axis] = static_cast<int64_t>(count) - 1;
    }
    grid_.has_dimensions = true;
  } else if (const size_t axis = keyword_[0] - 'X'; keyword_ == "ORIGIN" || keyword_ == "SPACING" || axis > 2) {
    std::array<double, 3>& numbers = keyword_ == "ORIGIN" ? grid_.image.origin : grid_.image.spacing;
    (keyword_ == "ORIGIN" ? grid_.has_origin : grid_.has_spacing) = true;
    for (double& number : numbers) {
      const std::string word = TakeName();
      if (absl::Status status = ParseFinite(word, number); !status.ok()) {
        return reader_.EndError(absl::StrCat("three numbers after ", keyword_, ": ", status.message()));
      }
    }
  } else {
    const VtkType* type = nullptr;
    uint64_t count = 0;
    Columns numbers(1);
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, count));
    WELLSPACE_RETURN_IF_ERROR(TakeType(type));
    WELLSPACE_RETURN_IF_ERROR(ReadArray(1, count, *type, &numbers));
    grid_.axes[axis] = std::move(numbers[0]);
    grid_.axes_read |= 1U << axis;
  }
  const bool is_whole = grid_.has_dimensions && (is_image ? grid_.has_origin && grid_.has_spacing
                                                          : dataset_ == "RECTILINEAR_GRID" && grid_.axes_read == 7);
  return is_whole && !has_points_ ? MakeGridPoints() : absl::OkStatus();
}

absl::Status VtkLegacyReader::MakeGridPoints() {
  constexpr uint64_t kMostUnseen = uint64_t{1} << 26;  // of a pipe, or a compressed file
  const std::optional<uint64_t> size = reader_.file_size();
  const uint64_t most = size.has_value() ? std::min(MostGridPoints(*size), kMaxCount) : kMostUnseen;
  const std::optional<uint64_t> count = grid_.extent.PointCount(most);
  if (!count.has_value()) {
    return reader_.Error(absl::StrCat("expected DIMENSIONS of at most ", most, " points of a file of this size"));
  }
  const auto add = [&columns = Coordinates()](double x, double y, double z) {
    columns[0].push_back(x);
    columns[1].push_back(y);
    columns[2].push_back(z);
  };
  if (dataset_ == "STRUCTURED_POINTS" && *count > 0) {  // without points along one axis the others need no look
    grid_.image.ForEachPoint(grid_.extent, add);
  } else if (dataset_ != "STRUCTURED_POINTS") {
    for (size_t axis = 0; axis < 3; ++axis) {
      if (grid_.axes[axis].size() != grid_.extent.PointsAlong(static_cast<int>(axis))) {
        return reader_.Error(absl::StrCat("expected ", grid_.extent.PointsAlong(static_cast<int>(axis)),
                                          " coordinates along axis ", axis, ", as DIMENSIONS says, got ",
                                          grid_.axes[axis].size()));
      }
    }
    ForEachRectilinearPoint(grid_.axes, add);
  }
  point_count_ = *count;
  has_points_ = true;
  return absl::OkStatus();
}

absl::Status VtkLegacyReader::ReadDataset() {
  const std::string word = TakeName();
  dataset_ = absl::AsciiStrToUpper(word);
  return std::find(kVtkDatasets.begin(), kVtkDatasets.end(), dataset_) != kVtkDatasets.end()
             ? absl::OkStatus()
             : reader_.Error(absl::StrCat("expected DATASET POLYDATA, UNSTRUCTURED_GRID, STRUCTURED_GRID, "
                                          "STRUCTURED_POINTS or RECTILINEAR_GRID, got ",
                                          Quote(word)));
}

absl::Status VtkLegacyReader::ReadPoints() {
  if (has_points_) {
    return reader_.Error("expected one list of points, got another one");
  }
  const VtkType* type = nullptr;
  WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, point_count_));
  WELLSPACE_RETURN_IF_ERROR(TakeType(type));
  WELLSPACE_RETURN_IF_ERROR(ReadArray(3, point_count_, *type, &Coordinates()));
  has_points_ = true;
  return absl::OkStatus();
}

// Lines up to a blank one; but names of components, a line each of the array before, may be blank.
absl::Status VtkLegacyReader::SkipMetadata() {
  line_ = FieldSplitter("", ' ');
  has_pending_ = false;
  uint64_t names = 0;
  for (std::string_view line; reader_.Next(line) && (names > 0 || !TrimBlanks(line).empty());) {
    names = TrimBlanks(line) == "COMPONENT_NAMES" ? components_ : names - std::min<uint64_t>(names, 1);
  }
  return reader_.status();
}

// "CELLS n size", or from version 5.0 on also "CELLS offsets connectivity" and arrays with these names.
absl::Status VtkLegacyReader::ReadCells() {
  const std::string section = keyword_;
  uint64_t count = 0;
  uint64_t size = 0;
  WELLSPACE_RETURN_IF_ERROR(TakeCount(kVtkMaxNumbers, count));
  Columns offsets(1);
  Columns numbers(1);
  if (section == "CELL_TYPES") {
    const bool is_wanted = WantsCells(section, count);
    WELLSPACE_RETURN_IF_ERROR(ReadArray(1, count, kVtkInt, is_wanted ? &numbers : nullptr));
    return is_wanted ? UseCells(section, count, {}, numbers[0]) : absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(TakeCount(kVtkMaxNumbers, size));
  if (!TakeWordIf("OFFSETS")) {
    const bool is_wanted = WantsCells(section, count);
    if (!is_wanted && IsDone()) {
      return absl::OkStatus();
    }
    WELLSPACE_RETURN_IF_ERROR(ReadArray(1, size, kVtkInt, is_wanted ? &numbers : nullptr));
    return is_wanted ? UseCells(section, count, {}, numbers[0]) : absl::OkStatus();
  }
  const uint64_t cells = count == 0 ? 0 : count - 1;
  const bool is_wanted = WantsCells(section, cells);
  if (!is_wanted && IsDone()) {
    return absl::OkStatus();
  }
  const VtkType* type = nullptr;
  WELLSPACE_RETURN_IF_ERROR(TakeType(type));
  WELLSPACE_RETURN_IF_ERROR(ReadArray(1, count, *type, is_wanted ? &offsets : nullptr));
  if (!NextKeyword() || keyword_ != "CONNECTIVITY") {
    return reader_.EndError("expected \"CONNECTIVITY\"");
  }
  WELLSPACE_RETURN_IF_ERROR(TakeType(type));
  WELLSPACE_RETURN_IF_ERROR(ReadArray(1, size, *type, is_wanted ? &numbers : nullptr));
  return is_wanted ? UseCells(section, cells, offsets[0], numbers[0]) : absl::OkStatus();
}

absl::Status VtkLegacyReader::ReadData() {
  if (keyword_ == "FIELD") {
    return ReadField();
  }
  Data data{.of = of_, .name = TakeName(), .components = 1, .rows = data_count_};
  if (keyword_ == "LOOKUP_TABLE") {  // colours, of four bytes or four numbers
    uint64_t size = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, size));
    return ReadArray(4, size, is_ascii_ ? kVtkTypes.back() : kVtkByte, nullptr);
  }
  if (keyword_ == "COLOR_SCALARS") {
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kVtkMaxComponents, data.components));
    return ReadNamed(data, is_ascii_ ? kVtkTypes.back() : kVtkByte);
  }
  if (keyword_ == "SCALARS") {
    return ReadScalars(std::move(data));
  }
  if (keyword_ == "VECTORS" || keyword_ == "NORMALS") {
    data.components = 3;
  } else if (keyword_ == "TENSORS" || keyword_ == "TENSORS6") {
    data.components = keyword_ == "TENSORS" ? 9 : 6;
  } else if (keyword_ == "TEXTURE_COORDINATES") {
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kVtkMaxComponents, data.components));
  } else if (keyword_ != "GLOBAL_IDS" && keyword_ != "PEDIGREE_IDS") {
    return reader_.Error(
        absl::StrCat("expected the start of a section, such as POINTS or POINT_DATA, got ", Quote(word_)));
  }
  const VtkType* type = nullptr;
  WELLSPACE_RETURN_IF_ERROR(TakeType(type));
  return ReadNamed(data, *type);
}

// The type, on its line the number of components if it is not 1, and mostly the name of a table of colours.
absl::Status VtkLegacyReader::ReadScalars(Data data) {
  const VtkType* type = nullptr;
  WELLSPACE_RETURN_IF_ERROR(TakeType(type));
  FieldSplitter rest = line_;
  std::string_view word;
  if (rest.Next(word) && !absl::EqualsIgnoreCase(VtkText(word), "LOOKUP_TABLE")) {
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kVtkMaxComponents, data.components));
  }
  if (TakeWordIf("LOOKUP_TABLE")) {
    TakeName();
  }
  return ReadNamed(data, *type);
}

// "FIELD name arrays", then "name components rows type" and the numbers of each.
absl::Status VtkLegacyReader::ReadField() {
  uint64_t arrays = 0;
  TakeName();
  WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, arrays));
  for (uint64_t i = 0; i < arrays && !ends_early_; ++i) {
    if (!NextKeyword()) {
      return reader_.EndError(absl::StrCat("expected ", arrays, " arrays, as the field says, got ", i));
    }
    if (keyword_ == "METADATA") {
      WELLSPACE_RETURN_IF_ERROR(SkipMetadata());
      --i;
      continue;
    }
    Data data{.of = of_, .name = word_};
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, data.components));
    WELLSPACE_RETURN_IF_ERROR(TakeCount(kMaxCount, data.rows));
    if (TakeWordIf("string")) {
      components_ = data.components;
      WELLSPACE_RETURN_IF_ERROR(SkipTexts(data.components * data.rows));
      continue;
    }
    const VtkType* type = nullptr;
    WELLSPACE_RETURN_IF_ERROR(TakeType(type));
    WELLSPACE_RETURN_IF_ERROR(ReadNamed(data, *type));
  }
  return absl::OkStatus();
}

// A line each; in binary, behind its length, whose highest two bits tell how many bytes it has itself.
absl::Status VtkLegacyReader::SkipTexts(uint64_t count) {
  line_ = FieldSplitter("", ' ');
  has_pending_ = false;
  for (uint64_t i = 0; i < count; ++i) {
    if (is_ascii_) {
      std::string_view line;
      if (!reader_.Next(line)) {
        return reader_.EndError(
            absl::StrCat("the file ends; expected ", count, " texts after ", keyword_, ", got ", i));
      }
      continue;
    }
    std::array<char, 8> word{};
    constexpr std::array<size_t, 4> kBytes = {8, 4, 2, 1};
    if (reader_.Take(word.data(), 1) != 1) {
      return EndError(count, i);
    }
    const size_t bytes = kBytes[static_cast<uint8_t>(word[0]) >> 6];
    if (reader_.Take(word.data() + 1, bytes - 1) != bytes - 1) {
      return EndError(count, i);
    }
    uint64_t length = static_cast<uint8_t>(word[0]) & 0x3f;
    for (size_t at = 1; at < bytes; ++at) {
      length = length << 8 | static_cast<uint8_t>(word[at]);
    }
    std::array<char, 256> piece;
    for (; length > 0; length -= std::min<uint64_t>(length, piece.size())) {
      const size_t size = std::min<uint64_t>(length, piece.size());
      if (reader_.Take(piece.data(), size) != size) {
        return EndError(count, i);
      }
    }
  }
  return absl::OkStatus();
}

absl::Status VtkLegacyReader::ReadNamed(const Data& data, const VtkType& type) {
  Data named = data;
  named.name = PercentDecoded(data.name);
  named.is_whole = IsWholeVtkType(type);
  const bool is_small = data.components > 0 && data.components <= kVtkMaxComponents;
  Columns* place = is_small ? Place(named) : nullptr;
  if (place != nullptr) {
    place->resize(data.components);
  }
  return ReadArray(data.components, data.rows, type, place);
}

absl::Status VtkLegacyReader::ReadArray(uint64_t components, uint64_t rows, const VtkType& type, Columns* columns) {
  if (components != 0 && rows > kVtkMaxNumbers / components) {
    return reader_.Error(
        absl::StrCat("expected at most ", kVtkMaxNumbers, " numbers, got ", components, " times ", rows));
  }
  const uint64_t count = components * rows;
  components_ = components;
  if (!is_ascii_) {
    line_ = FieldSplitter("", ' ');  // bytes start on the next one
  }
  if (type.bytes == 0 && !is_ascii_) {
    return ReadBits(count, columns);
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
    if (columns != nullptr) {
      (*columns)[i % components].push_back(value);
    }
  }
  return absl::OkStatus();
}

// Eight in a byte, the first as its highest bit.
absl::Status VtkLegacyReader::ReadBits(uint64_t count, Columns* columns) {
  char byte = 0;
  for (uint64_t i = 0; i < count; ++i) {
    if (i % 8 == 0 && reader_.Take(&byte, 1) != 1) {
      return EndError(count, i);
    }
    if (columns != nullptr) {
      (*columns)[i % columns->size()].push_back(byte >> (7 - i % 8) & 1);
    }
  }
  return absl::OkStatus();
}

absl::Status VtkLegacyReader::NextNumber(double& value) {
  std::string_view word;
  if (!NextWord(word)) {
    return reader_.EndError("the file ends; expected a number");
  }
  return ReadOrNan(word, value) ? absl::OkStatus()
                                : reader_.Error(absl::StrCat("expected a number, got ", Quote(word)));
}

absl::Status VtkLegacyReader::EndError(uint64_t count, uint64_t taken) const {
  return reader_.status().ok() ? absl::InvalidArgumentError(absl::StrCat(reader_.name(), ": byte ", reader_.offset(),
                                                                         ": expected ", count, " numbers after ",
                                                                         keyword_, ", got ", taken, "; the file ends"))
                               : reader_.status();
}

}  // namespace wellspace::formats
