#include "proto/checksum.h"

#include <bit>
#include <boost/crc.hpp>

namespace wellspace {

// Arrays in memory are checksummed as they are: the byte order of the wire.
static_assert(std::endian::native == std::endian::little);

uint32_t Crc32c(const void* data, size_t size) {
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> crc;
  crc.process_bytes(data, size);
  return crc.checksum();
}

}  // namespace wellspace
