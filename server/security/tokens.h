// The bearer tokens that a server takes, of which it keeps only hashes.
#ifndef WELLSPACE_SERVER_SECURITY_TOKENS_H_
#define WELLSPACE_SERVER_SECURITY_TOKENS_H_

#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "absl/status/statusor.h"

namespace wellspace::server {

// Whether `name` can name a tenant: 1 to 64 letters, digits, '.', '_', '@' and '-' of ASCII, the first a letter or a
// digit. Such a name forges nothing in a log.
bool IsTenantName(std::string_view name);

// Who makes a call.
struct Caller {
  std::string tenant = "default";  // a name as IsTenantName wants it
  bool is_admin = false;           // may call AdminService
};

// The table of tokens, each with its tenant.
//
// Tokens are looked up by their SHA-256, without salt: they are random and at least kMinTokenLength long, so that no
// list of likely tokens exists, and a call costs one hash however many tokens there are.
//
// Thread safety: immutable.
class TokenTable {
 public:
  static constexpr size_t kMinTokenLength = 32;
  static constexpr size_t kMaxTokenLength = 4096;

  // Reads lines "TENANT sha256:HEX", with "admin" behind it for a token that is an admin's. Empty lines, and all after
  // a '#', are ignored; a tenant may have several tokens.
  //
  // Errors:     INVALID_ARGUMENT, with the number of the line and what would be accepted, when a line is none of these,
  //             a token comes twice, or there is none at all.
  static absl::StatusOr<TokenTable> Parse(std::string_view text);

  // Who has `token`, or none when the token is unknown.
  std::optional<Caller> CallerOf(std::string_view token) const;

  size_t size() const { return callers_.size(); }

 private:
  std::unordered_map<std::string, Caller> callers_;  // by the SHA-256 of the token, 32 bytes
};

// The line of TokenTable for `token`, without an end of line.
//
// Errors:     INVALID_ARGUMENT: `tenant` is no name of one; `token` has characters other than the visible ones of
//             ASCII, or fewer than kMinTokenLength or more than kMaxTokenLength of them. The message does not have the
//             token.
absl::StatusOr<std::string> MakeTokenLine(std::string_view tenant, std::string_view token, bool is_admin = false);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SECURITY_TOKENS_H_
