#include "client/formats/io/compression.h"

#include <lzma.h>
#include <zlib.h>

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

// The bytes after a length of LZ4 that is the largest of its four bits: bytes to be added, the last one below 255.
bool TakeLength(std::string_view bytes, size_t& at, uint64_t& length) {
  constexpr uint64_t kLongest = 15;
  uint8_t more = length == kLongest ? 255 : 0;
  while (more == 255) {
    if (at == bytes.size()) {
      return false;
    }
    more = static_cast<uint8_t>(bytes[at++]);
    length += more;
  }
  return true;
}

}  // namespace

absl::Status NotCompressedBy(const char* by, uint64_t size) {
  return absl::InvalidArgumentError(absl::StrCat("does not decompress to ", size, " bytes by ", by));
}

absl::StatusOr<std::string> InflateZlib(std::string_view compressed, uint64_t size) {
  if (size / kMaxExpansion > compressed.size()) {
    return absl::InvalidArgumentError(absl::StrCat("cannot become ", size, " bytes out of ", compressed.size()));
  }
  std::string bytes(size, '\0');
  uLongf produced = size;
  const int result = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &produced,
                                reinterpret_cast<const Bytef*>(compressed.data()), compressed.size());
  return result == Z_OK && produced == size ? absl::StatusOr<std::string>(std::move(bytes))
                                            : NotCompressedBy("zlib", size);
}

absl::StatusOr<std::string> InflateXz(std::string_view compressed, uint64_t size) {
  constexpr uint64_t kMemory = uint64_t{256} << 20;
  constexpr uint64_t kPiece = 1 << 16;
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, kMemory, /*flags=*/0) != LZMA_OK) {
    return absl::ResourceExhaustedError("liblzma could not start to decompress a block");
  }
  stream.next_in = reinterpret_cast<const uint8_t*>(compressed.data());
  stream.avail_in = compressed.size();
  std::string bytes;
  lzma_ret result = LZMA_OK;
  // One byte more than there should be, so that it shows.
  while (result == LZMA_OK && bytes.size() <= size) {
    const size_t had = bytes.size();
    bytes.resize(std::min(had + std::max<uint64_t>(kPiece, had), size + 1));
    stream.next_out = reinterpret_cast<uint8_t*>(bytes.data()) + had;
    stream.avail_out = bytes.size() - had;
    result = lzma_code(&stream, LZMA_FINISH);
    bytes.resize(bytes.size() - stream.avail_out);
  }
  const bool is_all = result == LZMA_STREAM_END && stream.avail_in == 0 && bytes.size() == size;
  lzma_end(&stream);
  return is_all ? absl::StatusOr<std::string>(std::move(bytes)) : NotCompressedBy("xz", size);
}

absl::StatusOr<std::string> InflateLz4(std::string_view compressed, uint64_t size) {
  constexpr uint64_t kLeastMatch = 4;
  std::string bytes;
  for (size_t at = 0; at < compressed.size();) {
    const auto token = static_cast<uint8_t>(compressed[at++]);
    uint64_t literals = token >> 4;
    if (!TakeLength(compressed, at, literals) || literals > compressed.size() - at || literals > size - bytes.size()) {
      return NotCompressedBy("LZ4", size);
    }
    bytes.append(compressed.substr(at, literals));
    at += literals;
    if (at == compressed.size()) {
      break;  // the last sequence has literals alone
    }
    if (compressed.size() - at < 2) {
      return NotCompressedBy("LZ4", size);
    }
    const size_t distance = static_cast<uint8_t>(compressed[at]) | size_t{static_cast<uint8_t>(compressed[at + 1])}
                                                                       << 8;
    at += 2;
    uint64_t length = token & 15;
    if (!TakeLength(compressed, at, length) || distance == 0 || distance > bytes.size() ||
        length + kLeastMatch > size - bytes.size()) {
      return NotCompressedBy("LZ4", size);
    }
    // Byte by byte: the bytes referred to may go on in those being written.
    for (uint64_t i = 0; i < length + kLeastMatch; ++i) {
      bytes += bytes[bytes.size() - distance];
    }
  }
  return bytes.size() == size ? absl::StatusOr<std::string>(std::move(bytes)) : NotCompressedBy("LZ4", size);
}

}  // namespace wellspace::formats
