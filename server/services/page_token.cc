#include "server/services/page_token.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "proto/checksum.h"

namespace wellspace::server {
namespace {

constexpr size_t kChecksumDigits = 8;
constexpr size_t kBytes = sizeof(uint64_t);

}  // namespace

// The position and a checksum of it and the list. Who forges one comes to another place of the same list.
std::string MakePageToken(const std::string& list, const std::string& position) {
  const std::string digits = absl::BytesToHexString(position);
  const std::string checked = absl::StrCat(digits, list);
  return absl::StrCat(digits, absl::Hex(Crc32c(checked.data(), checked.size()), absl::kZeroPad8));
}

std::optional<std::string> ReadPageToken(const std::string& list, const std::string& token) {
  if (token.size() < kChecksumDigits || token.size() % 2 != 0 ||
      !std::all_of(token.begin(), token.end(), [](unsigned char c) { return absl::ascii_isxdigit(c); })) {
    return std::nullopt;
  }
  const std::string position = absl::HexStringToBytes(token.substr(0, token.size() - kChecksumDigits));
  return MakePageToken(list, position) == token ? std::optional(position) : std::nullopt;
}

std::string PositionOf(uint64_t number) {
  std::string bytes(kBytes, '\0');
  for (size_t i = 0; i < kBytes; ++i) {
    bytes[i] = static_cast<char>(number >> (8 * (kBytes - 1 - i)));
  }
  return bytes;
}

std::optional<uint64_t> NumberAt(const std::string& position) {
  if (position.size() != kBytes) {
    return std::nullopt;
  }
  uint64_t number = 0;
  for (const char byte : position) {
    number = number << 8 | static_cast<unsigned char>(byte);
  }
  return number;
}

}  // namespace wellspace::server
