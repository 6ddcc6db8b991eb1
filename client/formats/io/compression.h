// What all writers and readers of deflate in formats of meshes share.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_COMPRESSION_H_
#define WELLSPACE_CLIENT_FORMATS_IO_COMPRESSION_H_

#include <cstdint>

namespace wellspace::formats {

// Fast, and within a few percent of the smallest on coordinates, which hardly compress.
inline constexpr int kCompressionLevel = 1;

// zlib never makes more than about 1032 bytes of one.
inline constexpr uint64_t kMaxExpansion = 1040;

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_COMPRESSION_H_
