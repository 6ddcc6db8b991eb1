// ESRI's grid in ascii, as ArcGIS and GDAL write it.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/io/open_input.h"
#include "client/formats/raster/raster_sizes.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class EsriGridReader {
 public:
  EsriGridReader(LineReader& reader, SizedPoints& sized) : reader_(reader), fields_(reader), sized_(sized) {}

  absl::Status Read() {
    std::string_view field;
    WELLSPACE_RETURN_IF_ERROR(ReadHeader(field));
    WELLSPACE_ASSIGN_OR_RETURN(const RasterFrame frame, Frame());
    WELLSPACE_RETURN_IF_ERROR(CheckFrame(reader_.name(), frame));
    const auto nodata = header_.find("nodata_value");
    RasterSizes cells(frame, nodata == header_.end() ? std::nullopt : std::optional(nodata->second), sized_);
    const uint64_t count = frame.columns * frame.rows;
    while (!field.empty()) {
      double value = 0;
      if (!ReadOrNan(field, value)) {
        return reader_.Error(absl::StrCat("a cell: ", CoordinateError(field).message()));
      }
      if (cells.count() == count) {
        return reader_.Error(absl::StrCat("expected ", count, " cells, as the header says, got more"));
      }
      cells.Add(value);
      field = fields_.Next(field) ? field : std::string_view();
    }
    if (!reader_.status().ok() || cells.count() < count) {
      return reader_.EndError(absl::StrCat("the file ends; expected ", count, " cells, got ", cells.count()));
    }
    cells.Finish();
    return reader_.Finish();
  }

 private:
  static constexpr std::array<std::string_view, 10> kKeys = {
      "ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "dx", "dy", "nodata_value"};

  // Words and their numbers, up to the first field that is no word.
  absl::Status ReadHeader(std::string_view& field) {
    while (fields_.Next(field) && absl::ascii_isalpha(static_cast<unsigned char>(field[0])) && !IsNumber(field)) {
      const std::string key = absl::AsciiStrToLower(absl::string_view(field.data(), field.size()));
      if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
        return reader_.Error(absl::StrCat(
            "expected a word of the header of an ESRI grid, such as ncols, or a number, got ", Quote(field)));
      }
      double value = 0;
      // NODATA_value may be nan.
      WELLSPACE_RETURN_IF_ERROR(fields_.NextCoordinate(key, key == "nodata_value", value));
      if (!header_.emplace(key, value).second) {
        return reader_.Error(absl::StrCat("expected ", key, " once, got it again"));
      }
    }
    field = reader_.status().ok() && !field.empty() ? field : std::string_view();
    return reader_.status();
  }

  // One of two words of the header.
  absl::StatusOr<double> Either(const char* first, const char* second, bool& is_first) {
    const auto one = header_.find(first);
    const auto other = header_.find(second);
    if ((one == header_.end()) == (other == header_.end())) {
      return reader_.Error(absl::StrCat("expected either ", first, " or ", second, " in the header"));
    }
    is_first = one != header_.end();
    return is_first ? one->second : other->second;
  }

  absl::StatusOr<uint64_t> CountOf(const char* key) {
    const auto at = header_.find(key);
    const double value = at == header_.end() ? 0 : at->second;
    if (!(value >= 1 && value <= static_cast<double>(kMaxCount)) ||
        value != static_cast<double>(static_cast<uint64_t>(value))) {
      return reader_.Error(absl::StrCat("expected ", key, " in the header, a whole number from 1 on"));
    }
    return static_cast<uint64_t>(value);
  }

  absl::StatusOr<RasterFrame> Frame() {
    RasterFrame frame;
    WELLSPACE_ASSIGN_OR_RETURN(frame.columns, CountOf("ncols"));
    WELLSPACE_ASSIGN_OR_RETURN(frame.rows, CountOf("nrows"));
    bool is_size = false;
    bool is_corner = false;
    WELLSPACE_ASSIGN_OR_RETURN(frame.width, Either("cellsize", "dx", is_size));
    WELLSPACE_ASSIGN_OR_RETURN(frame.height, Either("cellsize", "dy", is_size));
    WELLSPACE_ASSIGN_OR_RETURN(frame.x, Either("xllcorner", "xllcenter", is_corner));
    frame.x += is_corner ? frame.width / 2 : 0;
    WELLSPACE_ASSIGN_OR_RETURN(frame.y, Either("yllcorner", "yllcenter", is_corner));
    // The header names the lower left cell.
    frame.y += (is_corner ? frame.height / 2 : 0) + static_cast<double>(frame.rows - 1) * frame.height;
    return frame;
  }

  LineReader& reader_;
  FieldReader fields_;
  SizedPoints& sized_;
  std::map<std::string, double> header_;  // by words in lower case
};

}  // namespace

absl::Status ReadEsriGrid(const std::string& path, SizedPoints& sized) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  sized.cloud.name = file.name();
  LineReader reader(std::move(file));
  return EsriGridReader(reader, sized).Read();
}

}  // namespace wellspace::formats
