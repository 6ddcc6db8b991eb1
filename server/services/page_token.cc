#include "server/services/page_token.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "proto/checksum.h"

namespace wellspace::server {
namespace {

constexpr size_t kPositionDigits = 16;

}  // namespace

// The position and a checksum of it and the list. Who forges one comes to another place of the same list.
std::string MakePageToken(const std::string& list, uint64_t position) {
  const std::string digits = absl::StrCat(absl::Hex(position, absl::kZeroPad16));
  const std::string checked = absl::StrCat(digits, list);
  return absl::StrCat(digits, absl::Hex(Crc32c(checked.data(), checked.size()), absl::kZeroPad8));
}

std::optional<uint64_t> ReadPageToken(const std::string& list, const std::string& token) {
  uint64_t position = 0;
  const bool is_read = absl::SimpleHexAtoi(token.substr(0, kPositionDigits), &position);
  return is_read && MakePageToken(list, position) == token ? std::optional(position) : std::nullopt;
}

}  // namespace wellspace::server
