#include "proto/checksum.h"

#include <array>
#include <bit>
#include <boost/crc.hpp>
#include <cstring>

#if defined(__x86_64__)
#include <nmmintrin.h>
#endif

namespace wellspace {

// Arrays in memory are checksummed as they are: the byte order of the wire.
static_assert(std::endian::native == std::endian::little);

#if defined(__x86_64__)
namespace {

constexpr uint32_t kPolynomial = 0x82F63B78;  // of RFC 3720, the lowest bit first

// A linear map of checksums, by the images of single bits.
using Map = std::array<uint32_t, 32>;

constexpr uint32_t Apply(const Map& map, uint32_t crc) {
  uint32_t result = 0;
  for (int bit = 0; bit < 32; ++bit) {
    result ^= (crc >> bit & 1) != 0 ? map[bit] : 0;
  }
  return result;
}

// A checksum after 2^exponent zero bits.
constexpr Map ZeroBits(int exponent) {
  Map map = {kPolynomial};
  for (int bit = 1; bit < 32; ++bit) {
    map[bit] = uint32_t{1} << (bit - 1);
  }
  for (; exponent > 0; --exponent) {
    Map squared = {};
    for (int bit = 0; bit < 32; ++bit) {
      squared[bit] = Apply(map, map[bit]);
    }
    map = squared;
  }
  return map;
}

// A map by the images of single bytes.
class ByteMap {
 public:
  explicit constexpr ByteMap(const Map& map) {
    for (int byte = 0; byte < 4; ++byte) {
      for (uint32_t value = 0; value < 256; ++value) {
        table_[byte][value] = Apply(map, value << (8 * byte));
      }
    }
  }

  uint32_t operator()(uint32_t crc) const {
    return table_[0][crc & 0xFF] ^ table_[1][crc >> 8 & 0xFF] ^ table_[2][crc >> 16 & 0xFF] ^ table_[3][crc >> 24];
  }

 private:
  std::array<std::array<uint32_t, 256>, 4> table_ = {};
};

constexpr size_t kLaneBytes = 4096;
constexpr ByteMap kSkipLane(ZeroBits(15));      // kLaneBytes zero bytes
constexpr ByteMap kSkipTwoLanes(ZeroBits(16));  // twice as many

uint64_t WordAt(const char* bytes) {
  uint64_t word;
  std::memcpy(&word, bytes, sizeof(word));
  return word;
}

// The instruction takes eight bytes, and three cycles until the next can go on from it: three lanes at once keep it
// busy. A checksum is linear: that of a block is the exclusive or of those of its lanes, each followed by zeros in the
// place of the lanes behind it.
__attribute__((target("sse4.2"))) uint32_t ExtendBySse42(uint32_t before, const void* data, size_t size) {
  const char* bytes = static_cast<const char*>(data);
  uint64_t crc = ~before;
  for (; size >= 3 * kLaneBytes; bytes += 3 * kLaneBytes, size -= 3 * kLaneBytes) {
    uint64_t second = 0;
    uint64_t third = 0;
    for (size_t i = 0; i < kLaneBytes; i += sizeof(uint64_t)) {
      crc = _mm_crc32_u64(crc, WordAt(bytes + i));
      second = _mm_crc32_u64(second, WordAt(bytes + kLaneBytes + i));
      third = _mm_crc32_u64(third, WordAt(bytes + 2 * kLaneBytes + i));
    }
    crc = kSkipTwoLanes(static_cast<uint32_t>(crc)) ^ kSkipLane(static_cast<uint32_t>(second)) ^ third;
  }
  for (; size >= sizeof(uint64_t); bytes += sizeof(uint64_t), size -= sizeof(uint64_t)) {
    crc = _mm_crc32_u64(crc, WordAt(bytes));
  }
  auto rest = static_cast<uint32_t>(crc);
  for (; size > 0; ++bytes, --size) {
    rest = _mm_crc32_u8(rest, static_cast<unsigned char>(*bytes));
  }
  return ~rest;
}

}  // namespace
#endif

uint32_t Crc32c(const void* data, size_t size) { return ExtendCrc32c(0, data, size); }

uint32_t ExtendCrc32c(uint32_t crc, const void* data, size_t size) {
#if defined(__x86_64__)
  static const bool has_sse42 = __builtin_cpu_supports("sse4.2");
  if (has_sse42) {
    return ExtendBySse42(crc, data, size);
  }
#endif
  return ExtendPortableCrc32c(crc, data, size);
}

uint32_t PortableCrc32c(const void* data, size_t size) { return ExtendPortableCrc32c(0, data, size); }

uint32_t ExtendPortableCrc32c(uint32_t crc, const void* data, size_t size) {
  uint32_t remainder = 0;  // before these bytes, as Boost has it: its lowest bit first
  for (int bit = 0; bit < 32; ++bit) {
    remainder |= (~crc >> bit & 1u) << (31 - bit);
  }
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> sum(remainder);
  sum.process_bytes(data, size);
  return sum.checksum();
}

}  // namespace wellspace
