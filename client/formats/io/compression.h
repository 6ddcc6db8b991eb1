// Blocks that were compressed as a whole, and the common part of writers and readers of deflate.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_COMPRESSION_H_
#define WELLSPACE_CLIENT_FORMATS_IO_COMPRESSION_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace wellspace::formats {

// Fast, and within a few percent of the smallest on coordinates, which hardly compress.
inline constexpr int kCompressionLevel = 1;

// zlib never makes more than about 1032 bytes of one.
inline constexpr uint64_t kMaxExpansion = 1040;

// The `size` bytes that were compressed to `compressed`: by zlib, as a stream of xz, as a block of LZ4.
//
// Memory:     no more than `compressed` can stand for, whatever `size` is; for xz 256 MiB beside it.
// Errors:     INVALID_ARGUMENT, a message without a location: they are not so many, or damaged.
absl::StatusOr<std::string> InflateZlib(std::string_view compressed, uint64_t size);
absl::StatusOr<std::string> InflateXz(std::string_view compressed, uint64_t size);
absl::StatusOr<std::string> InflateLz4(std::string_view compressed, uint64_t size);

// The error of each: bytes are not `size` ones that were compressed `by` it.
absl::Status NotCompressedBy(const char* by, uint64_t size);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_COMPRESSION_H_
