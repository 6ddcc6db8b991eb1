// LZF, by which .pcd is compressed: M. A. Lehmann, liblzf. Private to client/formats.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_LZF_H_
#define WELLSPACE_CLIENT_FORMATS_IO_LZF_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace wellspace::formats {

// The `size` bytes that were compressed to `compressed`.
//
// Memory:     no more than `compressed` can stand for, whatever `size` is.
// Errors:     INVALID_ARGUMENT, a message without a location: they are not so many, or refer beyond the bytes there.
absl::StatusOr<std::string> InflateLzf(std::string_view compressed, uint64_t size);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_LZF_H_
