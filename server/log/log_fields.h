// Lines of the log made of fields, as people read them and as machines do.
#ifndef WELLSPACE_SERVER_LOG_LOG_FIELDS_H_
#define WELLSPACE_SERVER_LOG_LOG_FIELDS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace wellspace::server {

// `text`, or its beginning of `most` bytes with "…" behind it; characters of UTF-8 stay whole. REQUIRES: most >= 3.
std::string CutText(std::string_view text, size_t most);

// `text` as a JSON string, with its quotes. Bytes that are no UTF-8 become U+FFFD.
std::string JsonString(std::string_view text);

// A line `key=value key=value …`. A value that is empty, has blanks, quotes, control characters or bytes above ASCII,
// or that would pass for a number, stands as a JSON string; so no value can end the line or forge a field. Of a value
// of more than kMaxValueBytes the rest is lost, and it ends with "…": values from clients may be long.
//
// Thread safety: thread-compatible.
class LogFields {
 public:
  // Of a value, before it becomes a JSON string.
  static constexpr size_t kMaxValueBytes = 256;

  // REQUIRES:   `key` is a letter of a to z, then such letters, digits and underscores.
  LogFields& Add(std::string_view key, std::string_view value);
  LogFields& Add(std::string_view key, uint64_t value);
  // To the millionth.
  LogFields& Add(std::string_view key, double value);
  // All of `more`.
  LogFields& Add(const LogFields& more);

  const std::string& text() const { return text_; }

 private:
  void AddRaw(std::string_view key, std::string_view value);

  std::string text_;
};

// The members of a JSON object, without its braces, that say the same as `line`; nothing if `line` is not as LogFields
// writes it.
std::optional<std::string> ToJsonMembers(std::string_view line);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_LOG_LOG_FIELDS_H_
