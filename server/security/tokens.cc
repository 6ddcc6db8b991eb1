#include "server/security/tokens.h"

#include <openssl/sha.h>

#include <algorithm>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace wellspace::server {
namespace {

constexpr size_t kMaxTenantLength = 64;
constexpr std::string_view kHashPrefix = "sha256:";
constexpr char kAdmin[] = "admin";
constexpr char kTenantRule[] = "1 to 64 letters, digits, '.', '_', '@' and '-', the first a letter or a digit";

absl::string_view View(std::string_view text) { return {text.data(), text.size()}; }

std::string Hash(std::string_view token) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

// The 32 bytes of "sha256:HEX"; empty when it is not that.
std::string ParseHash(std::string_view text) {
  if (!text.starts_with(kHashPrefix)) {
    return "";
  }
  text.remove_prefix(kHashPrefix.size());
  if (text.size() != 2 * SHA256_DIGEST_LENGTH ||
      !std::all_of(text.begin(), text.end(), [](unsigned char c) { return absl::ascii_isxdigit(c); })) {
    return "";
  }
  return absl::HexStringToBytes(View(text));
}

}  // namespace

bool IsTenantName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxTenantLength && absl::ascii_isalnum(name.front()) &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '@' || c == '-';
         });
}

absl::StatusOr<TokenTable> TokenTable::Parse(std::string_view text) {
  TokenTable table;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(View(text), '\n')) {
    ++number;
    const absl::string_view content = line.substr(0, line.find('#'));
    const std::vector<std::string> fields = absl::StrSplit(content, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (fields.empty()) {
      continue;
    }
    // The line itself stays out of the messages: it may be a token that was not hashed by mistake.
    const bool is_admin = fields.size() == 3 && fields[2] == kAdmin;
    const std::string digest = fields.size() == 2 || is_admin ? ParseHash(fields[1]) : "";
    if (digest.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("line ", number,
                                                     ": expected TENANT sha256:HEX with 64 hexadecimal digits, and ",
                                                     kAdmin, " behind it or nothing"));
    }
    if (!IsTenantName(fields[0])) {
      return absl::InvalidArgumentError(absl::StrCat("line ", number, ": a tenant's name is ", kTenantRule));
    }
    if (!table.callers_.emplace(digest, Caller{.tenant = fields[0], .is_admin = is_admin}).second) {
      return absl::InvalidArgumentError(absl::StrCat("line ", number, ": the same token as in a line before"));
    }
  }
  if (table.callers_.empty()) {
    return absl::InvalidArgumentError("no token; expected lines TENANT sha256:HEX");
  }
  return table;
}

std::optional<Caller> TokenTable::CallerOf(std::string_view token) const {
  if (token.size() > kMaxTokenLength) {
    return std::nullopt;
  }
  const auto found = callers_.find(Hash(token));
  return found == callers_.end() ? std::nullopt : std::optional(found->second);
}

absl::StatusOr<std::string> MakeTokenLine(std::string_view tenant, std::string_view token, bool is_admin) {
  if (!IsTenantName(tenant)) {
    return absl::InvalidArgumentError(absl::StrCat("a tenant's name is ", kTenantRule));
  }
  if (token.size() < TokenTable::kMinTokenLength || token.size() > TokenTable::kMaxTokenLength ||
      !std::all_of(token.begin(), token.end(), [](unsigned char c) { return absl::ascii_isgraph(c); })) {
    return absl::InvalidArgumentError(absl::StrCat("a token is ", TokenTable::kMinTokenLength, " to ",
                                                   TokenTable::kMaxTokenLength,
                                                   " visible characters of ASCII, made by `openssl rand -hex 32`"));
  }
  return absl::StrCat(View(tenant), " ", View(kHashPrefix), absl::BytesToHexString(Hash(token)),
                      is_admin ? absl::StrCat(" ", kAdmin) : "");
}

}  // namespace wellspace::server
