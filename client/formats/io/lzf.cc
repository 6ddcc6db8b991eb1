#include "client/formats/io/lzf.h"

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

constexpr size_t kLzfLiteralCodes = 32;  // codes below say that so many bytes, and one, follow as they are
constexpr size_t kLzfLongMatch = 7;      // then the length goes on in the next byte

}  // namespace

absl::StatusOr<std::string> InflateLzf(std::string_view compressed, uint64_t size) {
  std::string bytes;
  size_t at = 0;
  const auto error = [&](absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("LZF, compressed byte ", at, ": ", what));
  };
  while (at < compressed.size()) {
    const size_t code = static_cast<uint8_t>(compressed[at++]);
    if (code < kLzfLiteralCodes) {
      if (compressed.size() - at < code + 1) {
        return error("the data end inside a run");
      }
      bytes.append(compressed.substr(at, code + 1));
      at += code + 1;
    } else {
      size_t length = code >> 5;
      if (compressed.size() - at < (length == kLzfLongMatch ? size_t{2} : size_t{1})) {
        return error("the data end inside a reference");
      }
      if (length == kLzfLongMatch) {
        length += static_cast<uint8_t>(compressed[at++]);
      }
      const size_t distance = ((code & 0x1f) << 8 | static_cast<uint8_t>(compressed[at++])) + 1;
      if (distance > bytes.size()) {
        return error(absl::StrCat("expected a reference to one of ", bytes.size(), " bytes before, got ", distance));
      }
      // Byte by byte: the bytes referred to may go on in those being written.
      for (size_t i = 0; i < length + 2; ++i) {
        bytes += bytes[bytes.size() - distance];
      }
    }
    if (bytes.size() > size) {
      return error(absl::StrCat("expected ", size, " bytes, got more"));
    }
  }
  if (bytes.size() != size) {
    return error(absl::StrCat("expected ", size, " bytes, got ", bytes.size()));
  }
  return bytes;
}

}  // namespace wellspace::formats
