// GeoTIFF, OGC 19-008r4, of one band: its first image.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/compression.h"
#include "client/formats/io/number.h"
#include "client/formats/io/open_input.h"
#include "client/formats/raster/raster_sizes.h"
#include "client/formats/raster/tiff_blocks.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

enum TiffTag : uint16_t {
  kWidth = 256,
  kHeight = 257,
  kBits = 258,
  kCompression = 259,
  kStripOffsets = 273,
  kSamplesOfPixel = 277,
  kRowsOfStrip = 278,
  kStripBytes = 279,
  kPredictor = 317,
  kTileWidth = 322,
  kTileHeight = 323,
  kTileOffsets = 324,
  kTileBytes = 325,
  kSampleFormat = 339,
  kPixelScale = 33550,
  kTiePoints = 33922,
  kTransformation = 34264,
  kGeoKeys = 34735,
  kNoData = 42113,
};

class GeoTiffReader {
 public:
  GeoTiffReader(std::string_view bytes, SizedPoints& sized) : bytes_(bytes), sized_(sized) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadDirectory());
    WELLSPACE_ASSIGN_OR_RETURN(const RasterFrame frame, Frame());
    WELLSPACE_RETURN_IF_ERROR(CheckFrame(sized_.cloud.name, frame));
    WELLSPACE_RETURN_IF_ERROR(ReadLayout());
    if (frame.columns * frame.rows / kMaxExpansion > bytes_.size()) {
      return Error(absl::StrCat("expected at most ", kMaxExpansion, " cells for each byte of the file, got ",
                                frame.columns * frame.rows, " cells in ", bytes_.size(), " bytes"));
    }
    return ReadBlocks(frame);
  }

 private:
  struct Entry {
    uint16_t type = 0;
    uint64_t count = 0;
    uint64_t offset = 0;  // of the first value
  };

  absl::Status Error(std::string_view message) const {
    return absl::InvalidArgumentError(absl::StrCat(sized_.cloud.name, ": ", std::string(message)));
  }

  bool Has(uint64_t offset, uint64_t size) const { return offset <= bytes_.size() && size <= bytes_.size() - offset; }

  // REQUIRES:   Has(offset, sizeof(Word)).
  template <typename Word>
  Word Load(uint64_t offset) const {
    return LoadWord<Word>(bytes_.substr(offset), 0, layout_.big_endian);
  }

  // Of the types that have values here: how many bytes.
  static uint64_t BytesOf(uint16_t type) {
    switch (type) {
      case 1:  // BYTE
      case 2:  // ASCII
        return 1;
      case 3:  // SHORT
        return 2;
      case 4:   // LONG
      case 11:  // FLOAT
        return 4;
      case 12:  // DOUBLE
        return 8;
      default:
        return 0;
    }
  }

  absl::Status ReadDirectory() {
    constexpr uint64_t kEntryBytes = 12;
    const std::string_view order = bytes_.substr(0, 2);
    layout_.big_endian = order == "MM";
    if (!Has(0, 8) || (order != "II" && order != "MM")) {
      return Error("expected a TIFF, which starts with II or MM");
    }
    if (const auto version = Load<uint16_t>(2); version != 42) {
      return Error(absl::StrCat("expected a TIFF of the version 42, got ", version,
                                version == 43 ? "; gdal_translate -co BIGTIFF=NO writes another" : ""));
    }
    const uint64_t at = Load<uint32_t>(4);
    const uint64_t entries = Has(at, 2) ? Load<uint16_t>(at) : 0;
    if (entries == 0 || !Has(at + 2, entries * kEntryBytes)) {
      return Error(
          absl::StrCat("expected a directory within the ", bytes_.size(), " bytes of the file, got byte ", at));
    }
    for (uint64_t i = 0; i < entries; ++i) {
      const uint64_t entry = at + 2 + i * kEntryBytes;
      const auto type = Load<uint16_t>(entry + 2);
      const uint64_t count = Load<uint32_t>(entry + 4);
      const uint64_t size = count * BytesOf(type);
      const uint64_t offset = size <= 4 ? entry + 8 : Load<uint32_t>(entry + 8);
      if (size > 0 && Has(offset, size)) {
        entries_[Load<uint16_t>(entry)] = {type, count, offset};
      }
    }
    return absl::OkStatus();
  }

  // The values of a tag; empty without it.
  std::vector<double> Values(uint16_t tag) const {
    std::vector<double> values;
    const auto found = entries_.find(tag);
    const Entry entry = found == entries_.end() ? Entry{} : found->second;
    for (uint64_t i = 0; i < entry.count; ++i) {
      const uint64_t at = entry.offset + i * BytesOf(entry.type);
      values.push_back(entry.type == 3    ? Load<uint16_t>(at)
                       : entry.type == 4  ? Load<uint32_t>(at)
                       : entry.type == 11 ? Load<float>(at)
                       : entry.type == 12 ? Load<double>(at)
                                          : static_cast<uint8_t>(bytes_[at]));
    }
    return values;
  }

  // The only whole number of a tag, or the first of several; `other` without it.
  uint64_t Whole(uint16_t tag, uint64_t other) const {
    const std::vector<double> values = Values(tag);
    return values.empty() || !(values[0] >= 0 && values[0] <= static_cast<double>(kMaxCount))
               ? other
               : static_cast<uint64_t>(values[0]);
  }

  absl::Status ReadLayout() {
    layout_.bits = Whole(kBits, 1);
    layout_.format = Whole(kSampleFormat, 1);
    layout_.compression = Whole(kCompression, 1);
    layout_.predictor = Whole(kPredictor, 1);
    if (const uint64_t bands = Whole(kSamplesOfPixel, 1); bands != 1) {
      return Error(absl::StrCat("expected one band, got ", bands, "; gdal_translate -b 1 takes one"));
    }
    const absl::Status status = CheckLayout(layout_);
    return status.ok() ? status : Error({status.message().data(), status.message().size()});
  }

  // Whether places are those of centres of cells, not of corners: GTRasterTypeGeoKey.
  bool AreCentres() const {
    constexpr double kRasterType = 1025;
    constexpr double kPixelIsPoint = 2;
    const std::vector<double> keys = Values(kGeoKeys);
    for (size_t i = 4; i + 3 < keys.size(); i += 4) {
      if (keys[i] == kRasterType) {
        return keys[i + 3] == kPixelIsPoint;
      }
    }
    return false;
  }

  // The first tie point with the scale, or a transformation without rotation.
  absl::StatusOr<RasterFrame> Frame() const {
    RasterFrame frame{.columns = Whole(kWidth, 0), .rows = Whole(kHeight, 0)};
    const std::vector<double> scale = Values(kPixelScale);
    const std::vector<double> tie = Values(kTiePoints);
    const std::vector<double> matrix = Values(kTransformation);
    const double half = AreCentres() ? 0 : 0.5;
    if (scale.size() >= 2 && tie.size() >= 6) {
      frame.width = scale[0];
      frame.height = scale[1];
      frame.x = tie[3] + (half - tie[0]) * scale[0];
      frame.y = tie[4] - (half - tie[1]) * scale[1];
      return frame;
    }
    if (matrix.size() < 16 || matrix[1] != 0 || matrix[4] != 0) {
      return Error(
          "expected a tie point (tag 33922) with a scale (33550), or a transformation (34264) that rotates "
          "nothing: without them a TIFF has no place; gdalwarp writes another");
    }
    frame.width = matrix[0];
    frame.height = -matrix[5];
    frame.x = matrix[3] + half * matrix[0];
    frame.y = matrix[7] + half * matrix[5];
    return frame;
  }

  // A text, as GDAL has it; of 32 bits in the place of 64 where samples are.
  std::optional<double> NoData() const {
    const auto found = entries_.find(kNoData);
    if (found == entries_.end() || found->second.type != 2) {
      return std::nullopt;
    }
    std::string text(bytes_.substr(found->second.offset, found->second.count));
    text.resize(std::min(text.find('\0'), text.size()));
    double value = 0;
    if (!absl::SimpleAtod(std::string(absl::StripAsciiWhitespace(text)), &value)) {
      return std::nullopt;
    }
    constexpr double kLargest = std::numeric_limits<float>::max();
    return layout_.format == 3 && layout_.bits == 32
               ? static_cast<double>(static_cast<float>(std::clamp(value, -kLargest, kLargest)))
               : value;
  }

  absl::Status ReadBlocks(const RasterFrame& frame) {
    const bool has_tiles = entries_.contains(kTileOffsets);
    const uint64_t width = has_tiles ? Whole(kTileWidth, 0) : frame.columns;
    const uint64_t height = has_tiles ? Whole(kTileHeight, 0) : std::min(Whole(kRowsOfStrip, frame.rows), frame.rows);
    const std::vector<double> offsets = Values(has_tiles ? kTileOffsets : kStripOffsets);
    const std::vector<double> sizes = Values(has_tiles ? kTileBytes : kStripBytes);
    if (width == 0 || height == 0 || width * height / kMaxExpansion > bytes_.size()) {
      return Error(
          absl::StrCat("expected blocks of the raster, got some of ", width, " columns and ", height, " rows"));
    }
    const uint64_t across = (frame.columns + width - 1) / width;
    const uint64_t down = (frame.rows + height - 1) / height;
    if (offsets.size() != across * down || sizes.size() != offsets.size()) {
      return Error(absl::StrCat("expected offsets and sizes of ", across * down, " blocks, got ", offsets.size(),
                                " and ", sizes.size()));
    }
    RasterSizes cells(frame, NoData(), sized_);
    for (uint64_t band = 0; band < down; ++band) {
      // The last strip has the rows that are left; tiles are whole.
      const uint64_t rows = std::min(height, frame.rows - band * height);
      std::vector<double> values(rows * frame.columns, std::numeric_limits<double>::quiet_NaN());
      for (uint64_t i = 0; i < across; ++i) {
        const uint64_t block = band * across + i;
        const auto size = static_cast<uint64_t>(sizes[block]);
        if (size == 0) {
          continue;  // as GDAL leaves blocks out that have no data
        }
        const auto offset = static_cast<uint64_t>(offsets[block]);
        if (!Has(offset, size)) {
          return Error(absl::StrCat("block ", block, ": expected bytes ", offset, " to ", offset + size,
                                    " within the file, which has ", bytes_.size()));
        }
        const auto samples = TiffSamples(bytes_.substr(offset, size), has_tiles ? height : rows, width, layout_);
        if (!samples.ok()) {
          return Error(absl::StrCat("block ", block, " ", samples.status().message()));
        }
        for (uint64_t row = 0; row < rows; ++row) {
          const uint64_t columns = std::min(width, frame.columns - i * width);
          std::copy_n(samples->begin() + static_cast<ptrdiff_t>(row * width), columns,
                      values.begin() + static_cast<ptrdiff_t>(row * frame.columns + i * width));
        }
      }
      for (const double value : values) {
        cells.Add(value);
      }
    }
    cells.Finish();
    return absl::OkStatus();
  }

  const std::string_view bytes_;
  SizedPoints& sized_;
  TiffLayout layout_;
  std::map<uint16_t, Entry> entries_;
};

}  // namespace

absl::Status ReadGeoTiff(const std::string& path, SizedPoints& sized) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  sized.cloud.name = file.name();
  WELLSPACE_ASSIGN_OR_RETURN(const std::string bytes, file.ReadAll());
  return GeoTiffReader(bytes, sized).Read();
}

}  // namespace wellspace::formats
