// ESRI's shapefile: ESRI Shapefile Technical Description, 1998. The main file alone, which has the geometries.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/domain/geojson_features.h"
#include "client/formats/domain/geojson_geometry.h"
#include "client/formats/domain/geojson_objects.h"
#include "client/formats/io/input_file.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

enum ShapeType : int32_t {
  kNullShape = 0,
  kPointShape = 1,
  kPolyLineShape = 3,
  kPolygonShape = 5,
  kMultiPointShape = 8
};

// With Z and with M a type is 10 and 20 more.
constexpr int32_t kVariants = 10;
constexpr int32_t kMaxShape = 28;

class ShapefileReader {
 public:
  ShapefileReader(InputFile& file, const DomainOptions& options, PlanarDomain& domain)
      : file_(file), domain_(domain), features_(options, domain) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadHeader());
    while (offset_ < file_bytes_) {
      ++record_;
      WELLSPACE_RETURN_IF_ERROR(ReadRecord());
    }
    char more = 0;
    WELLSPACE_ASSIGN_OR_RETURN(const size_t got, file_.Read(&more, 1));  // also the checksum of a compressed file
    if (got > 0) {
      return Error(absl::StrCat("expected the end of the file after ", file_bytes_, " bytes, as its header says"));
    }
    features_.Finish();
    return absl::OkStatus();
  }

 private:
  static constexpr uint64_t kHeaderBytes = 100;

  absl::Status Error(std::string_view message) const {
    return absl::InvalidArgumentError(
        absl::StrCat(domain_.name, record_ == 0 ? "" : absl::StrCat(":", record_), ": ", std::string(message)));
  }

  int32_t Little(size_t at) const { return LoadWord<int32_t>(std::string_view(bytes_).substr(at), 0, false); }
  int32_t Big(size_t at) const { return LoadWord<int32_t>(std::string_view(bytes_).substr(at), 0, true); }
  double Number(size_t at) const { return LoadWord<double>(std::string_view(bytes_).substr(at), 0, false); }

  // Reads so many bytes into bytes_; memory for those that there are.
  absl::Status Take(uint64_t count) {
    constexpr uint64_t kPiece = 1 << 20;
    bytes_.clear();
    while (bytes_.size() < count) {
      const size_t had = bytes_.size();
      bytes_.resize(had + std::min(kPiece, count - had));
      WELLSPACE_ASSIGN_OR_RETURN(const size_t got, file_.Read(bytes_.data() + had, bytes_.size() - had));
      bytes_.resize(had + got);
      if (got == 0) {
        return Error(absl::StrCat("the file ends after ", offset_ + had, " bytes; expected ", count - had, " more"));
      }
    }
    offset_ += count;
    return absl::OkStatus();
  }

  absl::Status ReadHeader() {
    constexpr int32_t kFileCode = 9994;
    constexpr int32_t kVersion = 1000;
    WELLSPACE_RETURN_IF_ERROR(Take(kHeaderBytes));
    if (Big(0) != kFileCode || Little(28) != kVersion) {
      return Error(absl::StrCat("expected a shapefile, with the code ", kFileCode, " and the version ", kVersion,
                                ", got ", Big(0), " and ", Little(28)));
    }
    const int32_t words = Big(24);
    if (words < static_cast<int32_t>(kHeaderBytes / 2)) {
      return Error(absl::StrCat("expected a length of at least ", kHeaderBytes / 2, " words, got ", words));
    }
    file_bytes_ = uint64_t{2} * static_cast<uint32_t>(words);
    return absl::OkStatus();
  }

  absl::Status ReadRecord() {
    WELLSPACE_RETURN_IF_ERROR(Take(8));
    const int32_t words = Big(4);
    const uint64_t bytes = words < 0 ? 0 : uint64_t{2} * static_cast<uint32_t>(words);
    if (words < 2 || bytes > file_bytes_ - std::min(offset_, file_bytes_)) {
      return Error(absl::StrCat("expected a record of at least 2 words, within the ", file_bytes_,
                                " bytes of the file, got ", words));
    }
    WELLSPACE_RETURN_IF_ERROR(Take(bytes));
    const int32_t type = Little(0);
    if (type == kNullShape) {
      features_.CountEmpty();
      return absl::OkStatus();
    }
    const GeoJsonLevel feature{
        .line = record_, .first_segment = domain_.segment_count(), .first_place = domain_.places.size()};
    const int32_t kind = type > 0 && type <= kMaxShape ? type % kVariants : 0;
    switch (kind) {
      case kPointShape:
        WELLSPACE_RETURN_IF_ERROR(ReadPoint());
        break;
      case kMultiPointShape:
        WELLSPACE_RETURN_IF_ERROR(ReadPoints(/*has_parts=*/false, GeometryType::kMultiPoint));
        break;
      case kPolyLineShape:
        WELLSPACE_RETURN_IF_ERROR(ReadPoints(/*has_parts=*/true, GeometryType::kMultiLineString));
        break;
      case kPolygonShape:
        WELLSPACE_RETURN_IF_ERROR(ReadPoints(/*has_parts=*/true, GeometryType::kMultiPolygon));
        break;
      default:
        return Error(
            absl::StrCat("expected a shape of points (1, 8), polylines (3) or polygons (5), or 10 or 20 more "
                         "with Z or M, got the type ",
                         type));
    }
    features_.End(feature);
    return absl::OkStatus();
  }

  absl::Status ReadPoint() {
    constexpr size_t kBytes = 20;
    if (bytes_.size() < kBytes) {
      return Error(absl::StrCat("expected a point of ", kBytes, " bytes, got ", bytes_.size()));
    }
    WELLSPACE_RETURN_IF_ERROR(AddPosition(4));
    return Move(GeometryType::kPoint);
  }

  // Type, bounding box, counts of parts, if there are some, and points, the first point of each part, the points.
  absl::Status ReadPoints(bool has_parts, GeometryType type) {
    const uint64_t counts_at = 36;
    const uint64_t parts_at = counts_at + (has_parts ? 8 : 4);
    if (bytes_.size() < parts_at) {
      return Error(absl::StrCat("expected a shape of at least ", parts_at, " bytes, got ", bytes_.size()));
    }
    const int32_t parts = has_parts ? Little(counts_at) : 0;
    const int32_t points = Little(parts_at - 4);
    const uint64_t points_at = parts_at + uint64_t{4} * static_cast<uint32_t>(std::max(parts, 0));
    if (parts < 0 || points < 0 || points_at + uint64_t{16} * static_cast<uint32_t>(points) > bytes_.size()) {
      return Error(absl::StrCat("expected ", parts, " parts and ", points, " points within the ", bytes_.size(),
                                " bytes of the record, got fewer"));
    }
    WELLSPACE_RETURN_IF_ERROR(geometry_.StartArray(record_));
    int32_t done = 0;
    for (int32_t part = 0; part < (has_parts ? parts : 1); ++part) {
      const int32_t begin = has_parts ? Little(parts_at + uint64_t{4} * part) : 0;
      const int32_t end = part + 1 < parts ? Little(parts_at + uint64_t{4} * (part + 1)) : points;
      if (begin != done || end < begin || end > points) {
        return Error(absl::StrCat("part ", part, ": expected its points from ", done, " to at most ", points, ", got ",
                                  begin, " to ", end));
      }
      WELLSPACE_RETURN_IF_ERROR(ReadPart(points_at, begin, end, type));
      done = end;
    }
    if (done != points) {
      return Error(absl::StrCat("expected parts with all ", points, " points, got ", done));
    }
    WELLSPACE_RETURN_IF_ERROR(geometry_.EndArray());
    return Move(type);
  }

  // Rings are polygons of their own: an odd number of them surrounds the inside, in whichever order they come.
  absl::Status ReadPart(uint64_t points_at, int32_t begin, int32_t end, GeometryType type) {
    const int arrays = type == GeometryType::kMultiPoint ? 0 : type == GeometryType::kMultiPolygon ? 2 : 1;
    for (int i = 0; i < arrays && end > begin; ++i) {
      WELLSPACE_RETURN_IF_ERROR(geometry_.StartArray(record_));
    }
    for (int32_t point = begin; point < end; ++point) {
      WELLSPACE_RETURN_IF_ERROR(AddPosition(points_at + uint64_t{16} * static_cast<uint32_t>(point)));
    }
    for (int i = 0; i < arrays && end > begin; ++i) {
      WELLSPACE_RETURN_IF_ERROR(geometry_.EndArray());
    }
    return absl::OkStatus();
  }

  absl::Status AddPosition(uint64_t at) {
    WELLSPACE_RETURN_IF_ERROR(geometry_.StartArray(record_));
    for (const uint64_t axis : {0, 8}) {
      const double value = Number(at + axis);
      if (!std::isfinite(value)) {
        return Error(absl::StrCat("coordinates", geometry_.Path(), ": expected a finite number, got ", value));
      }
      WELLSPACE_RETURN_IF_ERROR(geometry_.AddNumber(value));
    }
    return geometry_.EndArray();
  }

  absl::Status Move(GeometryType type) {
    bool is_empty = false;
    WELLSPACE_RETURN_IF_ERROR(geometry_.MoveTo(type, {.line = record_}, domain_, is_empty));
    if (is_empty) {
      features_.CountEmpty();
    }
    return absl::OkStatus();
  }

  InputFile& file_;
  PlanarDomain& domain_;
  GeoJsonFeatures features_;
  GeoJsonGeometry geometry_;
  std::string bytes_;        // that Take has read
  uint64_t offset_ = 0;      // of the file, behind them
  uint64_t file_bytes_ = 0;  // as its header says
  uint64_t record_ = 0;      // from 1
};

}  // namespace

absl::Status ReadShapefile(InputFile& file, const DomainOptions& options, PlanarDomain& domain) {
  return ShapefileReader(file, options, domain).Read();
}

}  // namespace wellspace::formats
