#include "client/formats/raster/tiff_blocks.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "client/formats/io/compression.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

enum TiffCompression : uint64_t { kNone = 1, kLzw = 5, kDeflate = 8, kOldDeflate = 32946, kPackBits = 32773 };
enum TiffPredictor : uint64_t { kNoPredictor = 1, kDifferences = 2, kFloatDifferences = 3 };
enum TiffFormat : uint64_t { kUnsigned = 1, kSigned = 2, kFloat = 3 };

absl::StatusOr<std::string> Decompress(std::string_view block, uint64_t size, uint64_t compression) {
  switch (compression) {
    case kLzw:
      return InflateTiffLzw(block, size);
    case kDeflate:
    case kOldDeflate:
      return InflateZlib(block, size);
    case kPackBits:
      return InflatePackBits(block, size);
    default:
      return block.size() >= size
                 ? absl::StatusOr<std::string>(std::string(block.substr(0, size)))
                 : absl::InvalidArgumentError(absl::StrCat("has ", block.size(), " bytes; expected ", size));
  }
}

// Adds to each sample of a row the one before.
template <typename Word>
void AddDifferences(std::string& bytes, uint64_t columns, bool big_endian) {
  const size_t rows = bytes.size() / sizeof(Word) / columns;
  for (size_t row = 0; row < rows; ++row) {
    Word sum = 0;
    for (size_t i = row * columns; i < (row + 1) * columns; ++i) {
      sum = static_cast<Word>(sum + LoadWord<Word>(bytes, i, big_endian));
      for (size_t k = 0; k < sizeof(Word); ++k) {
        const size_t shift = 8 * (big_endian ? sizeof(Word) - 1 - k : k);
        bytes[sizeof(Word) * i + k] = static_cast<char>(static_cast<uint64_t>(sum) >> shift & 255);
      }
    }
  }
}

// Bytes of a row are differences; they are first the highest of all samples, then the next ones.
void AddFloatDifferences(std::string& bytes, uint64_t columns, uint64_t width) {
  std::string row(columns * width, '\0');
  for (size_t begin = 0; begin < bytes.size(); begin += row.size()) {
    for (size_t i = 1; i < row.size(); ++i) {
      bytes[begin + i] =
          static_cast<char>(static_cast<uint8_t>(bytes[begin + i]) + static_cast<uint8_t>(bytes[begin + i - 1]));
    }
    for (size_t i = 0; i < row.size(); ++i) {
      row[i % columns * width + i / columns] = bytes[begin + i];
    }
    std::copy(row.begin(), row.end(), bytes.begin() + static_cast<ptrdiff_t>(begin));
  }
}

template <typename Word>
std::vector<double> Words(const std::string& bytes, bool big_endian) {
  std::vector<double> values(bytes.size() / sizeof(Word));
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<double>(LoadWord<Word>(bytes, i, big_endian));
  }
  return values;
}

// The strings that codes of LZW stand for: each is that of another code and one byte more.
class LzwStrings {
 public:
  static constexpr uint32_t kClear = 256;
  static constexpr uint32_t kEnd = 257;

  LzwStrings() {
    for (uint32_t code = 0; code < kClear; ++code) {
      last_[code] = static_cast<uint8_t>(code);
      length_[code] = 1;
    }
  }

  void Clear() {
    next_ = kFirst;
    before_ = kClear;
  }

  // How many bits the next code has: one more as soon as the code that is made next but one would want it.
  int CodeWidth() const { return next_ >= 2047 ? 12 : next_ >= 1023 ? 11 : next_ >= 511 ? 10 : 9; }

  // Appends the string of `code`, and makes a code of that of the one before and its first byte. False if there is no
  // such code, no place for another one, or if there would be more than `size` bytes.
  bool Append(uint32_t code, uint64_t size, std::string& bytes) {
    const bool has_before = before_ != kClear;
    // A code may be the one that it makes.
    const bool is_next = code == next_ && has_before;
    const uint32_t known = is_next ? before_ : code;
    if (known >= next_ || known == kEnd || (has_before && next_ == kMostCodes)) {
      return false;
    }
    const size_t begin = bytes.size();
    const uint32_t known_length = length_[known];
    if (known_length + (is_next ? 1 : 0) > size - begin) {
      return false;
    }
    bytes.resize(begin + known_length);
    for (uint32_t i = known_length, step = known; i-- > 0; step = prefix_[step]) {
      bytes[begin + i] = static_cast<char>(last_[step]);
    }
    if (is_next) {
      bytes += bytes[begin];
    }
    if (has_before) {
      prefix_[next_] = static_cast<uint16_t>(before_);
      last_[next_] = static_cast<uint8_t>(bytes[begin]);
      length_[next_] = length_[before_] + 1;
      ++next_;
    }
    before_ = code;
    return true;
  }

 private:
  static constexpr uint32_t kFirst = 258;
  static constexpr uint32_t kMostCodes = 4096;

  std::vector<uint16_t> prefix_ = std::vector<uint16_t>(kMostCodes);
  std::vector<uint8_t> last_ = std::vector<uint8_t>(kMostCodes);
  std::vector<uint32_t> length_ = std::vector<uint32_t>(kMostCodes);
  uint32_t next_ = kFirst;    // the code that is made next
  uint32_t before_ = kClear;  // the code before; kClear: none
};

}  // namespace

absl::Status CheckLayout(const TiffLayout& layout) {
  const bool is_float = layout.format == kFloat;
  const bool has_bits =
      layout.bits == 32 || layout.bits == 64 || (!is_float && (layout.bits == 8 || layout.bits == 16));
  if (layout.format < kUnsigned || layout.format > kFloat || !has_bits) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected samples of 8, 16, 32 or 64 bits, floating-point ones of 32 or 64, got ", layout.bits,
                     " bits of the format ", layout.format));
  }
  constexpr std::array<uint64_t, 5> kCompressions = {kNone, kLzw, kDeflate, kOldDeflate, kPackBits};
  if (std::find(kCompressions.begin(), kCompressions.end(), layout.compression) == kCompressions.end()) {
    return absl::InvalidArgumentError(absl::StrCat("expected no compression, LZW, deflate or PackBits, got the number ",
                                                   layout.compression,
                                                   "; gdal_translate -co COMPRESS=DEFLATE writes another"));
  }
  const bool has_predictor = layout.predictor == kNoPredictor || layout.predictor == kDifferences ||
                             (layout.predictor == kFloatDifferences && is_float);
  return has_predictor ? absl::OkStatus()
                       : absl::InvalidArgumentError(absl::StrCat(
                             "expected the predictor 1 or 2, or 3 of floating-point samples, got ", layout.predictor));
}

absl::StatusOr<std::string> InflateTiffLzw(std::string_view compressed, uint64_t size) {
  LzwStrings strings;
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;  // of the bits that no code has taken
  size_t at = 0;
  while (bytes.size() < size) {
    const int width = strings.CodeWidth();
    while (count < width && at < compressed.size()) {
      bits = bits << 8 | static_cast<uint8_t>(compressed[at++]);
      count += 8;
    }
    if (count < width) {
      return NotCompressedBy("LZW", size);
    }
    count -= width;
    const uint32_t code = bits >> count & ((1u << width) - 1);
    if (code == LzwStrings::kEnd) {
      break;
    }
    if (code == LzwStrings::kClear) {
      strings.Clear();
    } else if (!strings.Append(code, size, bytes)) {
      return NotCompressedBy("LZW", size);
    }
  }
  return bytes.size() == size ? absl::StatusOr<std::string>(std::move(bytes)) : NotCompressedBy("LZW", size);
}

absl::StatusOr<std::string> InflatePackBits(std::string_view compressed, uint64_t size) {
  std::string bytes;
  for (size_t at = 0; at < compressed.size() && bytes.size() < size;) {
    const auto code = static_cast<int8_t>(compressed[at++]);
    const uint64_t length = code >= 0      ? uint64_t{1} + code
                            : code == -128 ? 0
                                           : uint64_t{1} + static_cast<uint64_t>(-code);
    const size_t taken = code >= 0 ? length : code == -128 ? 0 : 1;
    if (taken > compressed.size() - at || length > size - bytes.size()) {
      return NotCompressedBy("PackBits", size);
    }
    code >= 0 ? bytes.append(compressed.substr(at, length)) : bytes.append(length, taken == 0 ? '\0' : compressed[at]);
    at += taken;
  }
  return bytes.size() == size ? absl::StatusOr<std::string>(std::move(bytes)) : NotCompressedBy("PackBits", size);
}

absl::StatusOr<std::vector<double>> TiffSamples(std::string_view block, uint64_t rows, uint64_t columns,
                                                const TiffLayout& layout) {
  const uint64_t width = layout.bits / 8;
  bool big_endian = layout.big_endian;
  WELLSPACE_ASSIGN_OR_RETURN(std::string bytes, Decompress(block, rows * columns * width, layout.compression));
  if (layout.predictor == kFloatDifferences) {
    AddFloatDifferences(bytes, columns, width);
    big_endian = true;
  } else if (layout.predictor == kDifferences) {
    width == 1   ? AddDifferences<uint8_t>(bytes, columns, big_endian)
    : width == 2 ? AddDifferences<uint16_t>(bytes, columns, big_endian)
    : width == 4 ? AddDifferences<uint32_t>(bytes, columns, big_endian)
                 : AddDifferences<uint64_t>(bytes, columns, big_endian);
  }
  if (layout.format == kFloat) {
    return width == 4 ? Words<float>(bytes, big_endian) : Words<double>(bytes, big_endian);
  }
  if (layout.format == kSigned) {
    return width == 1   ? Words<int8_t>(bytes, big_endian)
           : width == 2 ? Words<int16_t>(bytes, big_endian)
           : width == 4 ? Words<int32_t>(bytes, big_endian)
                        : Words<int64_t>(bytes, big_endian);
  }
  return width == 1   ? Words<uint8_t>(bytes, big_endian)
         : width == 2 ? Words<uint16_t>(bytes, big_endian)
         : width == 4 ? Words<uint32_t>(bytes, big_endian)
                      : Words<uint64_t>(bytes, big_endian);
}

}  // namespace wellspace::formats
