#include "client/printable.h"

#include <cstddef>
#include <cstdint>

#include "absl/strings/str_format.h"

namespace wellspace::client {
namespace {

// How many bytes the character of UTF-8 at the begin of `text` has; 0: they are none, or those of a control character.
size_t BytesOfCharacter(std::string_view text) {
  const auto byte = [text](size_t at) { return static_cast<uint8_t>(text[at]); };
  const uint8_t first = byte(0);
  if (first < 0x80) {
    return first < 0x20 || first == 0x7f ? 0 : 1;
  }
  const size_t bytes = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < bytes) {
    return 0;
  }
  for (size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) {
      return 0;
    }
  }
  const uint8_t second = byte(1);
  const bool is_control = first == 0xc2 && second < 0xa0;
  // Too long a form, half of a pair of UTF-16, or beyond Unicode.
  const bool is_wrong = (first == 0xe0 && second < 0xa0) || (first == 0xed && second >= 0xa0) ||
                        (first == 0xf0 && second < 0x90) || (first == 0xf4 && second >= 0x90);
  return is_control || is_wrong ? 0 : bytes;
}

}  // namespace

std::string Printable(std::string_view text) {
  std::string printable;
  while (!text.empty()) {
    size_t bytes = BytesOfCharacter(text);
    if (bytes == 0) {
      absl::StrAppendFormat(&printable, "\\x%02x", static_cast<uint8_t>(text[0]));
      bytes = 1;
    } else {
      printable.append(text.substr(0, bytes));
    }
    text.remove_prefix(bytes);
  }
  return printable;
}

}  // namespace wellspace::client
