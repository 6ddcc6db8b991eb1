#include "client/formats/vtk/vtk_xml.h"

#include <algorithm>
#include <limits>
#include <type_traits>

#include "client/formats/coordinate.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kMaxDepth = 64;

}  // namespace

absl::Status VtkXmlReader::ReadElements() {
  while (true) {
    switch (xml_.Next()) {
      case XmlScanner::Piece::kError:
        return xml_.status();
      case XmlScanner::Piece::kEnd:
        if (!path_.empty()) {
          return xml_.Error(absl::StrCat("the file ends inside element ", Quote(path_.back())));
        }
        return pieces_ == 1 ? absl::OkStatus()
                            : FileError(absl::StrCat("expected one <Piece> of a file of ", kind_, ", got ", pieces_));
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
}

absl::Status VtkXmlReader::EndElement() {
  if (path_.empty() || path_.back() != xml_.value()) {
    return xml_.Error(absl::StrCat("expected the end of ", path_.empty() ? "no element" : Quote(path_.back()),
                                   ", got that of ", Quote(xml_.value())));
  }
  path_.pop_back();
  return absl::OkStatus();
}

// REQUIRES:   the start tag's name is the last of path_.
absl::Status VtkXmlReader::StartElement() {
  const std::string& element = path_.back();
  if (path_.size() == 1) {
    return StartFile();
  }
  if (element == "AppendedData") {
    return xml_.Error("expected arrays in ascii or inline in base64 (format \"binary\"), got appended data");
  }
  if (element == "Piece") {
    return StartPiece();
  }
  const std::string parent = path_[path_.size() - 2];
  return element == "DataArray" && pieces_ == 1 ? ReadDataArray(parent) : absl::OkStatus();
}

absl::Status VtkXmlReader::StartPiece() {
  ++pieces_;
  constexpr uint64_t kLimit = std::numeric_limits<uint32_t>::max();
  if (!ParseUnsigned(xml_.Attribute("NumberOfPoints"), kLimit, point_count_)) {
    return xml_.Error("expected NumberOfPoints below 2^32 in <Piece>");
  }
  const bool has_cells = kind_ == "UnstructuredGrid";
  if (has_cells && !ParseUnsigned(xml_.Attribute("NumberOfCells"), kLimit, cell_count_)) {
    return xml_.Error("expected NumberOfPoints and NumberOfCells below 2^32 in <Piece>");
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
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
    return xml_.Error(absl::StrCat("expected compressor vtkZLibDataCompressor or none, got ", Quote(compressor)));
  }
  encoding_.compressed = !compressor.empty();
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
    return xml_.Error(absl::StrCat("expected format \"ascii\" or \"binary\", got ", Quote(format)));
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

absl::Status VtkXmlReader::Decode(std::string_view text, std::string& bytes) {
  absl::StatusOr<std::string> decoded = DecodeVtkArray(text, encoding_);
  if (!decoded.ok()) {
    return xml_.Error(std::string(decoded.status().message()));
  }
  bytes = *std::move(decoded);
  return absl::OkStatus();
}

template <typename Value>
absl::Status VtkXmlReader::ReadArray(std::vector<Value>& values) {
  const std::string type(xml_.Attribute("type"));
  const bool is_ascii = xml_.Attribute("format") == "ascii";
  std::string_view text;
  values.clear();
  WELLSPACE_RETURN_IF_ERROR(TakeText(text));
  if (text.empty() || is_ascii) {
    return ParseAscii(text, values);
  }
  std::string bytes;
  WELLSPACE_RETURN_IF_ERROR(Decode(text, bytes));
  if constexpr (std::is_same_v<Value, double>) {
    if (type == "Float64") return ConvertWords<double>(bytes, values);
    if (type == "Float32") return ConvertWords<float>(bytes, values);
    return xml_.Error(absl::StrCat("expected points of type Float32 or Float64, got ", Quote(type)));
  } else {
    absl::Status status;
    return ConvertWhole(bytes, type, values, status)
               ? status
               : xml_.Error(absl::StrCat("expected a type from Int8 to UInt64, got ", Quote(type)));
  }
}

template absl::Status VtkXmlReader::ReadArray<double>(std::vector<double>&);
template absl::Status VtkXmlReader::ReadArray<int64_t>(std::vector<int64_t>&);

absl::Status VtkXmlReader::ReadAnyNumbers(std::vector<double>& values) {
  const std::string type(xml_.Attribute("type"));
  const bool is_ascii = xml_.Attribute("format") == "ascii";
  std::string_view text;
  values.clear();
  WELLSPACE_RETURN_IF_ERROR(TakeText(text));
  if (is_ascii) {
    size_t begin = 0;
    while ((begin = text.find_first_not_of(kXmlSpace, begin)) != std::string_view::npos) {
      const size_t end = std::min(text.find_first_of(kXmlSpace, begin), text.size());
      double value = 0;
      switch (ReadCoordinate(text.substr(begin, end - begin), value)) {
        case CoordinateKind::kFinite:
          break;
        case CoordinateKind::kInvalid:
          value = std::numeric_limits<double>::quiet_NaN();
          break;
        case CoordinateKind::kNone:
          return xml_.Error(absl::StrCat("expected a number, got ", Quote(text.substr(begin, end - begin))));
      }
      values.push_back(value);
      begin = end;
    }
    return absl::OkStatus();
  }
  if (text.empty()) {
    return absl::OkStatus();
  }
  std::string bytes;
  WELLSPACE_RETURN_IF_ERROR(Decode(text, bytes));
  if (type == "Float64") return ConvertWords<double>(bytes, values);
  if (type == "Float32") return ConvertWords<float>(bytes, values);
  absl::Status status;
  return ConvertWhole(bytes, type, values, status)
             ? status
             : xml_.Error(absl::StrCat("expected a type from Int8 to UInt64, Float32 or Float64, got ", Quote(type)));
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
  values.resize(bytes.size() / sizeof(Word));
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<Value>(LoadWord<Word>(bytes, i, encoding_.big_endian));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
