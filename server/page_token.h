// Where the next page of a list begins.
#ifndef WELLSPACE_SERVER_PAGE_TOKEN_H_
#define WELLSPACE_SERVER_PAGE_TOKEN_H_

#include <cstdint>
#include <optional>
#include <string>

namespace wellspace::server {

// The most that a page has.
inline constexpr int kMaxPageSize = 1000;

// A token for `position` in the list of which `list` is everything that it depends on.
std::string MakePageToken(const std::string& list, uint64_t position);

// The position of a token of the same list; nothing if it was not made for that.
std::optional<uint64_t> ReadPageToken(const std::string& list, const std::string& token);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_PAGE_TOKEN_H_
