// Blocks of a TIFF, strips or tiles, as samples: TIFF 6.0, and Adobe's technical note 3 on predictors of floating-point
// numbers. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_RASTER_TIFF_BLOCKS_H_
#define WELLSPACE_CLIENT_FORMATS_RASTER_TIFF_BLOCKS_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::formats {

// The layout of samples, by the numbers of the tags.
struct TiffLayout {
  bool big_endian = false;
  uint64_t bits = 8;         // of a sample
  uint64_t format = 1;       // 1: whole, 2: whole with a sign, 3: floating-point
  uint64_t compression = 1;  // 1: none, 5: LZW, 8 and 32946: deflate, 32773: PackBits
  uint64_t predictor = 1;    // 1: none, 2: differences, 3: differences of bytes
};

// INVALID_ARGUMENT, a message without a location, unless such samples can be read.
absl::Status CheckLayout(const TiffLayout& layout);

// The samples of a block of `rows` times `columns`.
//
// REQUIRES:   CheckLayout.
// Memory:     no more than `block` can stand for.
// Errors:     INVALID_ARGUMENT, a message without a location.
absl::StatusOr<std::vector<double>> TiffSamples(std::string_view block, uint64_t rows, uint64_t columns,
                                                const TiffLayout& layout);

// The `size` bytes that were compressed to `compressed` by the LZW of TIFF, or by PackBits.
//
// Errors:     INVALID_ARGUMENT, a message without a location: they are not so many, or damaged.
absl::StatusOr<std::string> InflateTiffLzw(std::string_view compressed, uint64_t size);
absl::StatusOr<std::string> InflatePackBits(std::string_view compressed, uint64_t size);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_RASTER_TIFF_BLOCKS_H_
