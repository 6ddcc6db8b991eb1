// Text of others on a terminal.
#ifndef WELLSPACE_CLIENT_PRINTABLE_H_
#define WELLSPACE_CLIENT_PRINTABLE_H_

#include <string>
#include <string_view>

namespace wellspace::client {

// `text` with bytes that a terminal may obey, or cannot show, as \xHH: control characters of ASCII and of Latin-1
// (U+0080 to U+009F), and bytes that are no UTF-8.
//
// Guarantees: (1) the result is UTF-8 without control characters; (2) text without any is not changed.
// Complexity: O(bytes).
std::string Printable(std::string_view text);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_PRINTABLE_H_
