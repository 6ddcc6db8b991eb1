#include "client/formats/vtk/vtk_xml.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "absl/strings/numbers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/number.h"
#include "client/formats/point_rows.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kMaxDepth = 64;
constexpr uint64_t kMaxComponents = 64;  // of data of a point or a cell

// As files call them.
constexpr std::array<std::pair<std::string_view, VtkCompressor>, 4> kCompressors = {
    {{"", VtkCompressor::kNone},
     {"vtkZLibDataCompressor", VtkCompressor::kZlib},
     {"vtkLZ4DataCompressor", VtkCompressor::kLz4},
     {"vtkLZMADataCompressor", VtkCompressor::kLzma}}};

}  // namespace

VtkXmlReader::VtkXmlReader(std::string_view document, std::string name, std::string kind)
    : xml_(document, name), name_(std::move(name)), kind_(std::move(kind)) {
  FindAppended(document);
}

// Arrays refer to appended data behind them, and may be bytes, which are no elements: that is looked for first.
void VtkXmlReader::FindAppended(std::string_view document) {
  if (document.find("<AppendedData") == std::string_view::npos) {
    return;
  }
  XmlScanner scanner(document, name_);
  for (XmlScanner::Piece piece = scanner.Next(); piece != XmlScanner::Piece::kEnd && piece != XmlScanner::Piece::kError;
       piece = scanner.Next()) {
    if (piece == XmlScanner::Piece::kStartTag && scanner.value() == "AppendedData") {
      is_appended_base64_ = scanner.Attribute("encoding") != "raw";
      const size_t mark = document.find_first_not_of(kXmlSpace, scanner.position());
      has_appended_ = mark != std::string_view::npos && document[mark] == '_';
      appended_ = has_appended_ ? document.substr(mark + 1) : std::string_view();
      return;
    }
  }
}

absl::Status VtkXmlReader::ReadElements() {
  while (!is_at_appended_) {
    switch (xml_.Next()) {
      case XmlScanner::Piece::kError:
        return xml_.status();
      case XmlScanner::Piece::kEnd:
        if (!path_.empty()) {
          return xml_.Error(absl::StrCat("the file ends inside element ", Quote(path_.back())));
        }
        is_at_appended_ = true;
        break;
      case XmlScanner::Piece::kText:
        break;
      case XmlScanner::Piece::kStartTag:
        if (path_.size() == kMaxDepth) {
          return xml_.Error(absl::StrCat("expected elements at most ", kMaxDepth, " deep"));
        }
        path_.emplace_back(xml_.value());
        WELLSPACE_RETURN_IF_ERROR(StartElement());
        break;
      case XmlScanner::Piece::kEndTag:
        WELLSPACE_RETURN_IF_ERROR(EndElement());
        break;
    }
  }
  return pieces_ > 0 ? absl::OkStatus()
                     : FileError(absl::StrCat("expected one <Piece> or more of a file of ", kind_, ", got none"));
}

absl::Status VtkXmlReader::EndElement() {
  if (path_.empty() || path_.back() != xml_.value()) {
    return xml_.Error(absl::StrCat("expected the end of ", path_.empty() ? "no element" : Quote(path_.back()),
                                   ", got that of ", Quote(xml_.value())));
  }
  const bool is_piece = path_.back() == "Piece";
  path_.pop_back();
  return is_piece ? EndPiece() : absl::OkStatus();
}

// REQUIRES:   the start tag's name is the last of path_.
absl::Status VtkXmlReader::StartElement() {
  const std::string& element = path_.back();
  if (path_.size() == 1) {
    return StartFile();
  }
  if (element == "AppendedData") {
    is_at_appended_ = path_.size() == 2;
    return is_at_appended_ ? absl::OkStatus() : xml_.Error("expected <AppendedData> right inside <VTKFile>");
  }
  if (element == "Piece") {
    return StartPiece();
  }
  if (element == kind_ && path_.size() == 2) {
    return StartDataset();
  }
  const std::string parent = path_[path_.size() - 2];
  return element == "DataArray" ? ReadDataArray(parent) : absl::OkStatus();
}

absl::Status VtkXmlReader::StartPiece() {
  if (std::find(path_.begin(), path_.end() - 1, "Piece") != path_.end() - 1) {
    return xml_.Error("expected one <Piece> beside the other, got one inside of another");
  }
  ++pieces_;
  uint64_t points = 0;
  uint64_t cells = 0;
  if (kind_ == "StructuredGrid" || kind_ == "RectilinearGrid" || kind_ == "ImageData") {
    WELLSPACE_RETURN_IF_ERROR(TakeExtent(points, cells));
    AddPiece(points, cells, 0);
    return absl::OkStatus();
  }
  if (!ParseUnsigned(xml_.Attribute("NumberOfPoints"), kMaxCount - point_count_, points)) {
    return xml_.Error("expected NumberOfPoints below 2^32 in <Piece>");
  }
  const bool has_cells = kind_ == "UnstructuredGrid";
  if (has_cells && !ParseUnsigned(xml_.Attribute("NumberOfCells"), kMaxCount - cell_count_, cells)) {
    return xml_.Error("expected NumberOfPoints and NumberOfCells below 2^32 in <Piece>");
  }
  for (const char* kind : {"NumberOfLines", "NumberOfStrips", "NumberOfPolys"}) {
    uint64_t of_kind = 0;
    if (!has_cells && ParseUnsigned(xml_.Attribute(kind), kMaxCount, of_kind)) {
      cells += of_kind;
    }
  }
  uint64_t vertex_cells = 0;
  if (!has_cells && !ParseUnsigned(xml_.Attribute("NumberOfVerts"), kMaxCount, vertex_cells)) {
    vertex_cells = 0;  // it may be left out
  }
  AddPiece(points, cells, vertex_cells);
  return absl::OkStatus();
}

void VtkXmlReader::AddPiece(uint64_t points, uint64_t cells, uint64_t vertex_cells) {
  first_point_ = point_count_;
  point_count_ += points;
  cell_count_ += cells;
  first_cell_ = end_cell_;
  end_cell_ += cells + vertex_cells;
}

// "0 3 0 4 0 0": the first and the last point of each axis.
absl::Status VtkXmlReader::TakeExtent(uint64_t& points, uint64_t& cells) {
  constexpr int64_t kLimit = std::numeric_limits<int32_t>::max();
  FieldSplitter fields(xml_.Attribute("Extent"), ' ');
  cells = 1;
  for (int axis = 0; axis < 3; ++axis) {
    for (int64_t* end : {&extent_.first[axis], &extent_.last[axis]}) {
      std::string_view field;
      fields.Next(field);
      if (!absl::SimpleAtoi(absl::string_view(field.data(), field.size()), end) || *end < -kLimit || *end > kLimit) {
        extent_.last[axis] = extent_.first[axis] - 1;
        break;
      }
    }
    if (extent_.last[axis] < extent_.first[axis]) {
      return xml_.Error("expected Extent in <Piece>, six whole numbers, of each axis first the lower one");
    }
  }
  const std::optional<uint64_t> count = extent_.PointCount(kMaxCount - point_count_);
  if (!count.has_value()) {
    return xml_.Error("expected an Extent of fewer than 2^32 points in <Piece>");
  }
  points = *count;
  for (int axis = 0; axis < 3; ++axis) {
    cells *= std::max<uint64_t>(extent_.PointsAlong(axis) - 1, 1);
  }
  return absl::OkStatus();
}

absl::Status VtkXmlReader::StartFile() {
  if (path_.back() != "VTKFile" || xml_.Attribute("type") != kind_) {
    return xml_.Error(absl::StrCat("expected <VTKFile type=\"", kind_, "\" ...>"));
  }
  const std::string_view order = xml_.Attribute("byte_order");
  if (!order.empty() && order != "LittleEndian" && order != "BigEndian") {
    return xml_.Error(absl::StrCat("expected byte_order LittleEndian or BigEndian, got ", Quote(order)));
  }
  encoding_.big_endian = order == "BigEndian";
  const std::string_view header = xml_.Attribute("header_type");
  if (!header.empty() && header != "UInt32" && header != "UInt64") {
    return xml_.Error(absl::StrCat("expected header_type UInt32 or UInt64, got ", Quote(header)));
  }
  encoding_.header_word_bytes = header == "UInt64" ? 8 : 4;
  const std::string_view compressor = xml_.Attribute("compressor");
  const auto at = std::find_if(kCompressors.begin(), kCompressors.end(),
                               [compressor](const auto& one) { return one.first == compressor; });
  if (at == kCompressors.end()) {
    return xml_.Error(
        absl::StrCat("expected compressor vtkZLibDataCompressor, vtkLZ4DataCompressor, "
                     "vtkLZMADataCompressor or none, got ",
                     Quote(compressor)));
  }
  encoding_.compressor = at->second;
  return absl::OkStatus();
}

absl::Status VtkXmlReader::ReadPoints(std::vector<double>& coordinates) {
  if (xml_.Attribute("NumberOfComponents") != "3") {
    return xml_.Error(absl::StrCat("expected NumberOfComponents 3 for the points, got ",
                                   Quote(xml_.Attribute("NumberOfComponents"))));
  }
  return ReadArray<double>(coordinates);
}

absl::Status VtkXmlReader::TakeText(std::string_view& text) {
  const std::string format(xml_.Attribute("format"));
  text = {};
  if (format != "ascii" && format != "binary") {
    return xml_.Error(absl::StrCat("expected format \"ascii\", \"binary\" or \"appended\", got ", Quote(format)));
  }
  const XmlScanner::Piece piece = xml_.Next();
  if (piece == XmlScanner::Piece::kEndTag) {
    return EndElement();
  }
  if (piece == XmlScanner::Piece::kError) {
    return xml_.status();
  }
  if (piece != XmlScanner::Piece::kText) {
    return xml_.Error("expected the values of the array");
  }
  text = xml_.value();
  return absl::OkStatus();
}

absl::Status VtkXmlReader::TakeBytes(std::string& bytes) {
  const bool is_appended = xml_.Attribute("format") == "appended";
  uint64_t offset = 0;
  std::string_view text;
  if (!is_appended) {
    WELLSPACE_RETURN_IF_ERROR(TakeText(text));
  } else if (!has_appended_ || !ParseUnsigned(xml_.Attribute("offset"), appended_.size(), offset)) {
    return xml_.Error(absl::StrCat("expected the offset of an array in <AppendedData>, ",
                                   has_appended_ ? absl::StrCat("at most ", appended_.size()) : "which is not there",
                                   ", got ", Quote(xml_.Attribute("offset"))));
  }
  absl::StatusOr<std::string> decoded =
      is_appended ? DecodeAppendedVtkArray(appended_.substr(offset), is_appended_base64_, encoding_)
                  : DecodeVtkArray(text, encoding_);
  if (!decoded.ok()) {
    return xml_.Error(std::string(decoded.status().message()));
  }
  bytes = *std::move(decoded);
  return absl::OkStatus();
}

template <typename Value>
absl::Status VtkXmlReader::ReadArray(std::vector<Value>& values) {
  const std::string type(xml_.Attribute("type"));
  if (xml_.Attribute("format") == "ascii") {
    std::string_view text;
    WELLSPACE_RETURN_IF_ERROR(TakeText(text));
    return ParseAscii(text, values);
  }
  std::string bytes;
  WELLSPACE_RETURN_IF_ERROR(TakeBytes(bytes));
  if constexpr (std::is_same_v<Value, double>) {
    const size_t begin = values.size();
    if (type != "Float64" && type != "Float32") {
      return xml_.Error(absl::StrCat("expected points of type Float32 or Float64, got ", Quote(type)));
    }
    WELLSPACE_RETURN_IF_ERROR(type == "Float64" ? ConvertWords<double>(bytes, values)
                                                : ConvertWords<float>(bytes, values));
    for (size_t i = begin; i < values.size(); ++i) {
      if (!std::isfinite(values[i])) {
        return xml_.Error(absl::StrCat("expected finite numbers, got ", values[i], " as number ", i - begin));
      }
    }
    return absl::OkStatus();
  } else {
    absl::Status status;
    return ConvertWhole(bytes, type, values, status)
               ? status
               : xml_.Error(absl::StrCat("expected a type from Int8 to UInt64, got ", Quote(type)));
  }
}

template absl::Status VtkXmlReader::ReadArray<double>(std::vector<double>&);
template absl::Status VtkXmlReader::ReadArray<int64_t>(std::vector<int64_t>&);

absl::Status VtkXmlReader::ReadData(uint64_t first, uint64_t end, std::vector<DataArray>& arrays) {
  DataArray array{.name = std::string(xml_.Attribute("Name"))};
  const std::string_view components = xml_.Attribute("NumberOfComponents");
  if (!components.empty() && (!ParseUnsigned(components, kMaxComponents, array.components) || array.components == 0)) {
    return xml_.Error(
        absl::StrCat("expected NumberOfComponents from 1 to ", kMaxComponents, ", got ", Quote(components)));
  }
  // That of the pieces before goes on.
  const auto begun = std::find_if(arrays.begin(), arrays.end(), [&](const DataArray& other) {
    return first > 0 && other.name == array.name && other.components == array.components &&
           other.values.size() == first * other.components;
  });
  DataArray& whole = begun != arrays.end() ? *begun : arrays.emplace_back(std::move(array));
  WELLSPACE_RETURN_IF_ERROR(ReadAnyNumbers(whole.values));
  const uint64_t wanted = whole.components * end;
  if (xml_.Attribute("type") == "Bit" && whole.values.size() > wanted && whole.values.size() - wanted < 8) {
    whole.values.resize(wanted);  // the bits that fill the last byte
  }
  return absl::OkStatus();
}

absl::Status VtkXmlReader::AddColumns(const std::vector<DataArray>& arrays, uint64_t rows, const char* what,
                                      std::vector<std::string>& names,
                                      std::vector<std::vector<double>>& columns) const {
  for (const DataArray& array : arrays) {
    if (array.values.size() != array.components * rows) {
      return FileError(absl::StrCat("expected ", array.components, " values of ", Quote(array.name), " for each of ",
                                    rows, " ", what, ", got ", array.values.size()));
    }
    for (std::vector<double>& column : ColumnsOf(array.values, array.components)) {
      columns.push_back(std::move(column));
    }
    const std::vector<std::string> components = DataNames(array.name, array.components);
    names.insert(names.end(), components.begin(), components.end());
  }
  return absl::OkStatus();
}

absl::Status VtkXmlReader::ReadAnyNumbers(std::vector<double>& values) {
  const std::string type(xml_.Attribute("type"));
  if (xml_.Attribute("format") == "ascii") {
    std::string_view text;
    WELLSPACE_RETURN_IF_ERROR(TakeText(text));
    size_t begin = 0;
    while ((begin = text.find_first_not_of(kXmlSpace, begin)) != std::string_view::npos) {
      const size_t end = std::min(text.find_first_of(kXmlSpace, begin), text.size());
      double value = 0;
      if (!ReadOrNan(text.substr(begin, end - begin), value)) {
        return xml_.Error(absl::StrCat("expected a number, got ", Quote(text.substr(begin, end - begin))));
      }
      values.push_back(value);
      begin = end;
    }
    return absl::OkStatus();
  }
  std::string bytes;
  WELLSPACE_RETURN_IF_ERROR(TakeBytes(bytes));
  if (bytes.empty()) {
    return absl::OkStatus();
  }
  if (type == "Float64") return ConvertWords<double>(bytes, values);
  if (type == "Float32") return ConvertWords<float>(bytes, values);
  if (type == "Bit") {  // eight in a byte, the first as its highest bit
    for (const char byte : bytes) {
      for (int bit = 7; bit >= 0; --bit) {
        values.push_back(byte >> bit & 1);
      }
    }
    return absl::OkStatus();
  }
  absl::Status status;
  return ConvertWhole(bytes, type, values, status)
             ? status
             : xml_.Error(
                   absl::StrCat("expected Bit, a type from Int8 to UInt64, Float32 or Float64, got ", Quote(type)));
}

template <typename Value>
absl::Status VtkXmlReader::ParseAscii(std::string_view text, std::vector<Value>& values) {
  size_t begin = 0;
  while ((begin = text.find_first_not_of(kXmlSpace, begin)) != std::string_view::npos) {
    const size_t end = std::min(text.find_first_of(kXmlSpace, begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    begin = end;
    if constexpr (std::is_same_v<Value, double>) {
      double value = 0;
      if (absl::Status status = ParseFinite(word, value); !status.ok()) {
        return xml_.Error(std::string(status.message()));
      }
      values.push_back(value);
    } else {
      uint64_t value = 0;
      if (!ParseUnsigned(word, std::numeric_limits<int64_t>::max(), value)) {
        return xml_.Error(absl::StrCat("expected a whole number, got ", Quote(word)));
      }
      values.push_back(static_cast<Value>(value));
    }
  }
  return absl::OkStatus();
}

// Whether `type` is a whole one; then `status` tells how it went.
template <typename Value>
bool VtkXmlReader::ConvertWhole(const std::string& bytes, const std::string& type, std::vector<Value>& values,
                                absl::Status& status) {
  const auto convert = [&](auto word) {
    status = ConvertWords<decltype(word)>(bytes, values);
    return true;
  };
  return (type == "Int64" && convert(int64_t{})) || (type == "UInt64" && convert(uint64_t{})) ||
         (type == "Int32" && convert(int32_t{})) || (type == "UInt32" && convert(uint32_t{})) ||
         (type == "Int16" && convert(int16_t{})) || (type == "UInt16" && convert(uint16_t{})) ||
         (type == "Int8" && convert(int8_t{})) || (type == "UInt8" && convert(uint8_t{}));
}

template <typename Word, typename Value>
absl::Status VtkXmlReader::ConvertWords(const std::string& bytes, std::vector<Value>& values) {
  if (bytes.size() % sizeof(Word) != 0) {
    return xml_.Error(absl::StrCat("expected a multiple of ", sizeof(Word), " bytes, got ", bytes.size()));
  }
  const size_t words = bytes.size() / sizeof(Word);
  values.reserve(values.size() + words);
  for (size_t i = 0; i < words; ++i) {
    values.push_back(static_cast<Value>(LoadWord<Word>(bytes, i, encoding_.big_endian)));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
