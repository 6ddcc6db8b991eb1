// PCD of the Point Cloud Library: https://pointclouds.org/documentation/tutorials/pcd_file_format.html.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/lzf.h"
#include "client/formats/io/number.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kPcdMaxFields = 1024;
constexpr uint64_t kPcdMaxFieldCount = 1 << 16;
constexpr uint64_t kPcdMaxRecordBytes = 1 << 20;

// One of the fields of a point: `count` numbers of a type.
struct PcdField {
  std::string name;
  char type = 'F';  // F, or I and U: signed and unsigned
  uint64_t size = 4;
  uint64_t count = 1;

  uint64_t bytes() const { return size * count; }
  // Three bytes of a colour in one number.
  bool is_colour() const { return (name == "rgb" || name == "rgba") && size == 4 && count == 1; }
};

double PcdNumber(std::string_view bytes, char type) {
  constexpr bool kBigEndian = false;
  switch (bytes.size() * 256 + static_cast<uint8_t>(type)) {
    case 256 + 'I':
      return LoadWord<int8_t>(bytes, 0, kBigEndian);
    case 256 + 'U':
      return LoadWord<uint8_t>(bytes, 0, kBigEndian);
    case 512 + 'I':
      return LoadWord<int16_t>(bytes, 0, kBigEndian);
    case 512 + 'U':
      return LoadWord<uint16_t>(bytes, 0, kBigEndian);
    case 1024 + 'I':
      return LoadWord<int32_t>(bytes, 0, kBigEndian);
    case 1024 + 'U':
      return LoadWord<uint32_t>(bytes, 0, kBigEndian);
    case 1024 + 'F':
      return LoadWord<float>(bytes, 0, kBigEndian);
    case 2048 + 'I':
      return static_cast<double>(LoadWord<int64_t>(bytes, 0, kBigEndian));
    case 2048 + 'U':
      return static_cast<double>(LoadWord<uint64_t>(bytes, 0, kBigEndian));
    default:
      return LoadWord<double>(bytes, 0, kBigEndian);
  }
}

class PcdReader {
 public:
  PcdReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadHeader());
    std::vector<std::string> names;
    for (const PcdField& field : fields_) {
      if (field.is_colour()) {
        names.insert(names.end(), {"red", "green", "blue"});
      } else if (field.name != "_") {  // padding
        const std::vector<std::string> components = ComponentNames(field.name, field.count);
        names.insert(names.end(), components.begin(), components.end());
      }
    }
    absl::StatusOr<PointRows> rows = PointRows::Create(names, options_, cloud_);
    if (!rows.ok()) {
      return reader_.Error(std::string(rows.status().message()));
    }
    rows_ = *std::move(rows);
    if (data_ == "ascii") {
      return ReadAscii();
    }
    return data_ == "binary" ? ReadBinary() : ReadCompressed();
  }

 private:
  absl::Status ReadHeader() {
    std::string_view line;
    bool is_first = true;
    while (reader_.NextContent(line)) {
      FieldSplitter splitter(line, ' ');
      std::string_view keyword;
      splitter.Next(keyword);
      std::vector<std::string_view> values;
      for (std::string_view value; splitter.Next(value);) {
        values.push_back(value);
      }
      if (keyword == "COLUMNS") {  // as versions before 0.7 call them
        keyword = "FIELDS";
      }
      if (is_first && keyword != "VERSION" && keyword != "FIELDS") {
        return reader_.Error(
            absl::StrCat("expected \"VERSION\" or \"FIELDS\" at the start of the file, got ", Quote(keyword)));
      }
      is_first = false;
      WELLSPACE_RETURN_IF_ERROR(ReadEntry(keyword, values));
      if (keyword == "DATA") {
        return CheckHeader();
      }
    }
    return reader_.EndError("the file ends inside its header; expected \"DATA\"");
  }

  absl::Status ReadEntry(std::string_view keyword, const std::vector<std::string_view>& values) {
    if (keyword == "VERSION" || keyword == "VIEWPOINT" || keyword == "HEIGHT" || keyword == "WIDTH") {
      return absl::OkStatus();  // of a cloud that is an image: its points are listed all the same
    }
    if (keyword == "DATA" && values.size() == 1 &&
        (values[0] == "ascii" || values[0] == "binary" || values[0] == "binary_compressed")) {
      data_ = values[0];
      return absl::OkStatus();
    }
    if (keyword == "DATA") {
      return reader_.Error("expected \"DATA ascii\", \"DATA binary\" or \"DATA binary_compressed\"");
    }
    if (keyword == "POINTS") {
      uint64_t count = 0;
      if (values.size() != 1 || !ParseUnsigned(values[0], kMaxCount, count)) {
        return reader_.Error("expected \"POINTS\" and a whole number below 2^32");
      }
      points_ = count;
      return absl::OkStatus();
    }
    if (keyword == "FIELDS") {
      if (!fields_.empty() || values.empty() || values.size() > kPcdMaxFields) {
        return reader_.Error(absl::StrCat("expected \"FIELDS\" once, with 1 to ", kPcdMaxFields, " names"));
      }
      for (const std::string_view value : values) {
        fields_.push_back({.name = std::string(value)});
      }
      return absl::OkStatus();
    }
    return ReadOfEveryField(keyword, values);
  }

  // SIZE, TYPE and COUNT have a value for each field.
  absl::Status ReadOfEveryField(std::string_view keyword, const std::vector<std::string_view>& values) {
    if (keyword != "SIZE" && keyword != "TYPE" && keyword != "COUNT") {
      return reader_.Error(
          absl::StrCat("expected VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS or DATA, got ",
                       Quote(keyword)));
    }
    if (values.size() != fields_.size()) {
      return reader_.Error(
          absl::StrCat("expected a value for each of ", fields_.size(), " fields, got ", values.size()));
    }
    for (size_t i = 0; i < values.size(); ++i) {
      PcdField& field = fields_[i];
      if (keyword == "TYPE") {
        if (values[i] != "F" && values[i] != "I" && values[i] != "U") {
          return reader_.Error(absl::StrCat("expected a type F, I or U, got ", Quote(values[i])));
        }
        field.type = values[i][0];
      } else if (!ParseUnsigned(values[i], kPcdMaxFieldCount, keyword == "SIZE" ? field.size : field.count) ||
                 (keyword == "SIZE" && !std::has_single_bit(field.size)) || field.size > sizeof(double) ||
                 field.count == 0) {
        return reader_.Error(keyword == "SIZE" ? absl::StrCat("expected a size of 1, 2, 4 or 8, got ", Quote(values[i]))
                                               : absl::StrCat("expected a count from 1 to ", kPcdMaxFieldCount,
                                                              ", got ", Quote(values[i])));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckHeader() {
    if (fields_.empty() || !points_.has_value()) {
      return reader_.Error("expected \"FIELDS\" and \"POINTS\" before \"DATA\"");
    }
    for (const PcdField& field : fields_) {
      if (field.type == 'F' && field.size < sizeof(float)) {
        return reader_.Error(
            absl::StrCat("expected a size of 4 or 8 of field ", Quote(field.name), " of type F, got ", field.size));
      }
      record_bytes_ += field.bytes();
    }
    return record_bytes_ <= kPcdMaxRecordBytes
               ? absl::OkStatus()
               : reader_.Error(
                     absl::StrCat("expected points of at most ", kPcdMaxRecordBytes, " bytes, got ", record_bytes_));
  }

  absl::Status ReadAscii() {
    std::string_view line;
    for (uint64_t point = 0; point < *points_; ++point) {
      if (!reader_.NextContent(line)) {
        return reader_.EndError(
            absl::StrCat("expected ", *points_, " points, as the header says; the file ends after ", point));
      }
      FieldSplitter splitter(line, ' ');
      row_.clear();
      for (const PcdField& field : fields_) {
        for (uint64_t i = 0; i < field.count; ++i) {
          WELLSPACE_RETURN_IF_ERROR(TakeValue(splitter, field));
        }
      }
      if (std::string_view rest; splitter.Next(rest)) {
        return reader_.Error(absl::StrCat("expected the end of the line, as the header says, got ", Quote(rest)));
      }
      const absl::StatusOr<bool> is_added = rows_->Add(row_);
      if (!is_added.ok()) {
        return reader_.Error(std::string(is_added.status().message()));
      }
      if (*is_added) {
        cloud_.lines.Add(reader_.line_number());
      }
    }
    return reader_.status();
  }

  absl::Status TakeValue(FieldSplitter& splitter, const PcdField& field) {
    std::string_view text;
    double value = 0;
    if (!splitter.Next(text)) {
      return reader_.Error(absl::StrCat("expected a value of field ", Quote(field.name), ", as the header says"));
    }
    if (!ReadOrNan(text, value)) {
      return reader_.Error(absl::StrCat("field ", Quote(field.name), ": ", CoordinateError(text).message()));
    }
    if (!field.is_colour()) {
      AddNumber(field, value);
    } else if (field.type == 'F') {
      AddColour(std::bit_cast<uint32_t>(static_cast<float>(value)));
    } else {
      AddColour(value >= 0 && value < 0x1p32 ? static_cast<uint32_t>(value) : 0);
    }
    return absl::OkStatus();
  }

  void AddNumber(const PcdField& field, double value) {
    if (field.name != "_") {
      row_.push_back(value);
    }
  }

  void AddColour(uint32_t colour) {
    for (const int shift : {16, 8, 0}) {
      row_.push_back(colour >> shift & 0xff);
    }
  }

  // Adds point number `point`. `bytes_of` tells the bytes of each of its fields, asked in this order.
  template <typename BytesOf>
  absl::Status AddPointOf(uint64_t point, BytesOf bytes_of) {
    row_.clear();
    for (size_t i = 0; i < fields_.size(); ++i) {
      const PcdField& field = fields_[i];
      const std::string_view bytes = bytes_of(i);
      if (field.is_colour()) {
        AddColour(LoadWord<uint32_t>(bytes, 0, /*big_endian=*/false));
        continue;
      }
      for (uint64_t k = 0; k < field.count; ++k) {
        AddNumber(field, PcdNumber(bytes.substr(k * field.size, field.size), field.type));
      }
    }
    const absl::StatusOr<bool> is_added = rows_->Add(row_);
    if (!is_added.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(cloud_.name, "[", point, "]: ", is_added.status().message()));
    }
    if (*is_added && options_.skip_invalid) {
      cloud_.rows.Add(point);
    }
    return absl::OkStatus();
  }

  absl::Status ReadBinary() {
    std::string record(record_bytes_, '\0');
    for (uint64_t point = 0; point < *points_; ++point) {
      if (reader_.Take(record.data(), record.size()) != record.size()) {
        return EndError(absl::StrCat("expected ", *points_, " points of ", record_bytes_,
                                     " bytes, as the header says; the file ends in point ", point));
      }
      size_t at = 0;
      const auto bytes_of = [&](size_t field) {
        at += field == 0 ? 0 : fields_[field - 1].bytes();
        return std::string_view(record).substr(at, fields_[field].bytes());
      };
      WELLSPACE_RETURN_IF_ERROR(AddPointOf(point, bytes_of));
    }
    return reader_.status();
  }

  // Field by field: all values of the first, then all of the second.
  absl::Status ReadCompressed() {
    char sizes[2 * sizeof(uint32_t)];
    if (reader_.Take(sizes, sizeof(sizes)) != sizeof(sizes)) {
      return EndError("expected the numbers of compressed and of all bytes");
    }
    const uint64_t begin = reader_.offset();
    const auto compressed_size = LoadWord<uint32_t>({sizes, sizeof(sizes)}, 0, /*big_endian=*/false);
    const auto size = LoadWord<uint32_t>({sizes, sizeof(sizes)}, 1, /*big_endian=*/false);
    if (size != *points_ * record_bytes_) {
      return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", begin - sizeof(uint32_t), ": expected ",
                                                     *points_, " points of ", record_bytes_,
                                                     " bytes, as the header says, got ", size, " bytes"));
    }
    std::string compressed;
    while (compressed.size() < compressed_size) {
      const size_t had = compressed.size();
      const size_t wanted = std::min<size_t>(compressed_size - had, kPcdMaxRecordBytes);
      compressed.resize(had + wanted);
      if (reader_.Take(compressed.data() + had, wanted) != wanted) {
        return EndError(
            absl::StrCat("expected ", compressed_size, " compressed bytes from byte ", begin, " on; the file ends"));
      }
    }
    const absl::StatusOr<std::string> bytes = InflateLzf(compressed, size);
    if (!bytes.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", begin, ": ", bytes.status().message()));
    }
    std::vector<uint64_t> begins = {0};
    for (const PcdField& field : fields_) {
      begins.push_back(begins.back() + field.bytes() * *points_);
    }
    for (uint64_t point = 0; point < *points_; ++point) {
      WELLSPACE_RETURN_IF_ERROR(AddPointOf(point, [&](size_t field) {
        const uint64_t width = fields_[field].bytes();
        return std::string_view(*bytes).substr(begins[field] + point * width, width);
      }));
    }
    return reader_.status();
  }

  absl::Status EndError(const std::string& message) const {
    return reader_.status().ok()
               ? absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", reader_.offset(), ": ", message))
               : reader_.status();
  }

  LineReader& reader_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  std::vector<PcdField> fields_;
  std::optional<uint64_t> points_;
  std::string data_;
  uint64_t record_bytes_ = 0;
  std::optional<PointRows> rows_;
  std::vector<double> row_;
};

}  // namespace

absl::Status ReadPcd(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return PcdReader(reader, options, cloud).Read();
}

}  // namespace wellspace::formats
