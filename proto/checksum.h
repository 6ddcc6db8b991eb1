// The checksum of the chunks of a mesh and of uploaded points, for their writers and readers.
#ifndef WELLSPACE_PROTO_CHECKSUM_H_
#define WELLSPACE_PROTO_CHECKSUM_H_

#include <cstddef>
#include <cstdint>

namespace wellspace {

// CRC32C of `size` bytes, as MeshChunk.crc32c defines it for arrays in memory.
//
// Threads:    thread-safe.
uint32_t Crc32c(const void* data, size_t size);

// The checksum of the bytes that `crc` is the checksum of, followed by these; 0 is that of no bytes.
uint32_t ExtendCrc32c(uint32_t crc, const void* data, size_t size);

// The same as Crc32c on a processor that has no instruction for it; a hundred times slower.
uint32_t PortableCrc32c(const void* data, size_t size);
uint32_t ExtendPortableCrc32c(uint32_t crc, const void* data, size_t size);

}  // namespace wellspace

#endif  // WELLSPACE_PROTO_CHECKSUM_H_
