// LAS 1.0 to 1.4 of the ASPRS: point data record formats 0 to 10.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/number.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Offsets in the header, and how long it is at least.
constexpr size_t kLasMinorVersion = 25;
constexpr size_t kLasHeaderSize = 94;
constexpr size_t kLasPointsAt = 96;
constexpr size_t kLasFormat = 104;
constexpr size_t kLasRecordBytes = 105;
constexpr size_t kLasCount = 107;
constexpr size_t kLasScale = 131;
constexpr size_t kLasOffset = 155;
constexpr size_t kLasHeaderBytes = 227;
constexpr size_t kLasLongCount = 247;  // from version 1.4 on
constexpr size_t kLasLongHeaderBytes = 375;

constexpr uint8_t kLasCompressed = 0xc0;  // bits of the format by which LAZ marks its points

// Bytes of a record at least, by its format.
constexpr std::array<size_t, 11> kLasFormatBytes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
// Where the time and the colour are; 0: there are none.
constexpr std::array<size_t, 11> kLasTimeAt = {0, 20, 0, 20, 20, 20, 22, 22, 22, 22, 22};
constexpr std::array<size_t, 11> kLasColourAt = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};
constexpr std::array<size_t, 11> kLasInfraredAt = {0, 0, 0, 0, 0, 0, 0, 0, 36, 0, 36};
constexpr uint8_t kLasFirstLongFormat = 6;

template <typename T>
T LasWord(std::string_view bytes, size_t at) {
  return LoadWord<T>(bytes.substr(at), 0, /*big_endian=*/false);
}

class LasReader {
 public:
  LasReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadHeader());
    absl::StatusOr<PointRows> rows = PointRows::Create(Names(), options_, cloud_);
    if (!rows.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": ", rows.status().message()));
    }
    std::string record(record_bytes_, '\0');
    uint64_t withheld = 0;
    for (uint64_t point = 0; point < count_; ++point) {
      if (reader_.Take(record.data(), record.size()) != record.size()) {
        if (!reader_.status().ok() || !options_.skip_invalid) {
          return EndError(absl::StrCat("expected ", count_, " points of ", record_bytes_,
                                       " bytes, as the header says, got ", point,
                                       ", which --skip-invalid takes alone"));
        }
        cloud_.skipped += count_ - point;
        cloud_.notes.push_back(
            absl::StrCat(cloud_.name, ": the file ends after ", point, " of ", count_, " points, as its header says"));
        break;
      }
      if (IsWithheld(record)) {
        ++withheld;
        continue;
      }
      Decode(record);
      const absl::StatusOr<bool> is_added = rows->Add(row_);
      if (!is_added.ok()) {
        return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", reader_.offset() - record.size(),
                                                       ": point ", point, ": ", is_added.status().message()));
      }
      if (*is_added) {
        cloud_.rows.Add(point);
      }
    }
    if (withheld > 0) {
      cloud_.notes.push_back(absl::StrCat(cloud_.name, ": ", withheld, withheld == 1 ? " point is" : " points are",
                                          " left out, which the file marks as withheld"));
    }
    return reader_.status();
  }

 private:
  absl::Status ReadHeader() {
    std::string header(kLasHeaderBytes, '\0');
    header.resize(reader_.Take(header.data(), header.size()));
    if (header.substr(0, 4) != "LASF") {
      return reader_.status().ok() ? ByteError(0, absl::StrCat("expected \"LASF\" at the start of a file of LAS, got ",
                                                               Quote(header.substr(0, 4))))
                                   : reader_.status();
    }
    if (header.size() < kLasHeaderBytes) {
      return EndError(absl::StrCat("expected a header of at least ", kLasHeaderBytes, " bytes"));
    }
    const auto minor = LasWord<uint8_t>(header, kLasMinorVersion);
    const auto major = LasWord<uint8_t>(header, kLasMinorVersion - 1);
    if (major != 1 || minor > 4) {
      return ByteError(kLasMinorVersion - 1, absl::StrCat("expected version 1.0 to 1.4, got ", major, ".", minor));
    }
    const auto header_bytes = LasWord<uint16_t>(header, kLasHeaderSize);
    const auto points_at = LasWord<uint32_t>(header, kLasPointsAt);
    if (header_bytes < (minor == 4 ? kLasLongHeaderBytes : kLasHeaderBytes) || points_at < header_bytes) {
      return ByteError(
          kLasHeaderSize,
          absl::StrCat("expected a header of at least ", minor == 4 ? kLasLongHeaderBytes : kLasHeaderBytes,
                       " bytes and points behind it, got ", header_bytes, ", and points from byte ", points_at, " on"));
    }
    WELLSPACE_RETURN_IF_ERROR(ReadFormat(header));
    WELLSPACE_RETURN_IF_ERROR(SkipTo(header_bytes, header));
    count_ = LasWord<uint32_t>(header, kLasCount);
    if (minor == 4 && LasWord<uint64_t>(header, kLasLongCount) != 0) {
      count_ = LasWord<uint64_t>(header, kLasLongCount);
    }
    if (count_ > kMaxCount) {
      return ByteError(kLasCount, absl::StrCat("expected fewer than 2^32 points, got ", count_));
    }
    for (size_t axis = 0; axis < 3; ++axis) {
      scale_[axis] = LasWord<double>(header, kLasScale + axis * sizeof(double));
      offset_[axis] = LasWord<double>(header, kLasOffset + axis * sizeof(double));
      // With a scale of 0 all points would be one.
      if (count_ > 0 && (!std::isfinite(scale_[axis]) || scale_[axis] == 0 || !std::isfinite(offset_[axis]))) {
        return ByteError(kLasScale + axis * sizeof(double),
                         absl::StrCat("expected a finite scale other than 0 and a finite offset of coordinate ",
                                      axis + 1, ", got ", scale_[axis], " and ", offset_[axis]));
      }
    }
    std::string records;  // of variable length: they are skipped
    return SkipTo(points_at, records);
  }

  absl::Status ReadFormat(const std::string& header) {
    format_ = LasWord<uint8_t>(header, kLasFormat);
    record_bytes_ = LasWord<uint16_t>(header, kLasRecordBytes);
    if ((format_ & kLasCompressed) != 0) {
      return ByteError(
          kLasFormat,
          "the points are compressed (LAZ), which is not read; expected LAS, as laszip -i IN -o OUT.las or "
          "pdal translate IN OUT.las make it");
    }
    if (format_ >= kLasFormatBytes.size()) {
      return ByteError(kLasFormat, absl::StrCat("expected a point format from 0 to 10, got ", format_));
    }
    if (record_bytes_ < kLasFormatBytes[format_]) {
      return ByteError(kLasRecordBytes, absl::StrCat("expected points of at least ", kLasFormatBytes[format_],
                                                     " bytes in format ", format_, ", got ", record_bytes_));
    }
    return absl::OkStatus();
  }

  // Reads up to byte `end` of the file, and keeps as much as fits into a header.
  absl::Status SkipTo(uint64_t end, std::string& kept) {
    char block[1 << 12];
    while (reader_.offset() < end) {
      const size_t size = std::min<uint64_t>(end - reader_.offset(), sizeof(block));
      if (reader_.Take(block, size) != size) {
        return EndError(absl::StrCat("expected points, or more of the header, from byte ", end, " on"));
      }
      if (kept.size() < kLasLongHeaderBytes) {
        kept.append(block, size);
      }
    }
    return absl::OkStatus();
  }

  bool is_long() const { return format_ >= kLasFirstLongFormat; }

  std::vector<std::string> Names() const {
    std::vector<std::string> names = {"x",
                                      "y",
                                      "z",
                                      "intensity",
                                      "return_number",
                                      "number_of_returns",
                                      "classification",
                                      "scan_angle",
                                      "user_data",
                                      "point_source_id"};
    if (kLasTimeAt[format_] != 0) {
      names.emplace_back("gps_time");
    }
    if (kLasColourAt[format_] != 0) {
      names.insert(names.end(), {"red", "green", "blue"});
    }
    if (kLasInfraredAt[format_] != 0) {
      names.emplace_back("nir");
    }
    return names;
  }

  // "Should not be included in processing."
  bool IsWithheld(std::string_view record) const {
    const auto flags = LasWord<uint8_t>(record, 15);
    return (flags & (is_long() ? 0x04 : 0x80)) != 0;
  }

  void Decode(std::string_view record) {
    row_.clear();
    for (size_t axis = 0; axis < 3; ++axis) {
      row_.push_back(LasWord<int32_t>(record, axis * sizeof(int32_t)) * scale_[axis] + offset_[axis]);
    }
    const auto returns = LasWord<uint8_t>(record, 14);
    row_.push_back(LasWord<uint16_t>(record, 12));
    row_.push_back(is_long() ? returns & 0x0f : returns & 0x07);
    row_.push_back(is_long() ? returns >> 4 : returns >> 3 & 0x07);
    if (is_long()) {
      constexpr double kDegreesOfUnit = 0.006;
      row_.push_back(LasWord<uint8_t>(record, 16));
      row_.push_back(LasWord<int16_t>(record, 18) * kDegreesOfUnit);
      row_.push_back(LasWord<uint8_t>(record, 17));
      row_.push_back(LasWord<uint16_t>(record, 20));
    } else {
      row_.push_back(LasWord<uint8_t>(record, 15) & 0x1f);
      row_.push_back(LasWord<int8_t>(record, 16));
      row_.push_back(LasWord<uint8_t>(record, 17));
      row_.push_back(LasWord<uint16_t>(record, 18));
    }
    if (const size_t at = kLasTimeAt[format_]; at != 0) {
      row_.push_back(LasWord<double>(record, at));
    }
    for (size_t channel = 0; channel < 3 && kLasColourAt[format_] != 0; ++channel) {
      row_.push_back(LasWord<uint16_t>(record, kLasColourAt[format_] + channel * sizeof(uint16_t)));
    }
    if (const size_t at = kLasInfraredAt[format_]; at != 0) {
      row_.push_back(LasWord<uint16_t>(record, at));
    }
  }

  absl::Status ByteError(uint64_t byte, const std::string& message) const {
    return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", byte, ": ", message));
  }

  absl::Status EndError(const std::string& message) const {
    return reader_.status().ok() ? ByteError(reader_.offset(), message + "; the file ends") : reader_.status();
  }

  LineReader& reader_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  uint8_t format_ = 0;
  uint16_t record_bytes_ = 0;
  uint64_t count_ = 0;
  std::array<double, 3> scale_{};
  std::array<double, 3> offset_{};
  std::vector<double> row_;
};

}  // namespace

absl::Status ReadLas(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return LasReader(reader, options, cloud).Read();
}

}  // namespace wellspace::formats
