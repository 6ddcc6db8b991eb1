// The format of mesh files, which their writer and their reader share.
#ifndef WELLSPACE_SERVER_STORE_MESH_FILE_FORMAT_H_
#define WELLSPACE_SERVER_STORE_MESH_FILE_FORMAT_H_

#include <array>
#include <bit>
#include <cstdint>

#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

static_assert(std::endian::native == std::endian::little, "files have the bytes of memory");

// The last bytes of a mesh file.
struct MeshFooter {
  std::array<char, 8> magic{};
  uint32_t format = 0;
  uint32_t directory_crc32c = 0;
  uint64_t directory_bytes = 0;
};
static_assert(sizeof(MeshFooter) == 24, "no gaps");

inline constexpr std::array<char, 8> kMeshMagic = {'W', 's', 'M', 'e', 's', 'h', '\r', '\n'};
inline constexpr uint32_t kMeshFormat = 1;

// Numbers of moved vertices that are read at once: few, as those of a chunk of points are looked for by bisection.
inline constexpr uint64_t kMovedPerChunk = uint64_t{1} << 14;

inline uint64_t ChunksOf(const store::v1::MeshDirectory::Array& array) {
  return (array.rows() + array.rows_per_chunk() - 1) / array.rows_per_chunk();
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MESH_FILE_FORMAT_H_
