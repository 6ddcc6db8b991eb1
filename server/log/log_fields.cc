#include "server/log/log_fields.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"
#include "nlohmann/json.hpp"

namespace wellspace::server {
namespace {

bool IsKey(std::string_view text) {
  return !text.empty() && absl::ascii_islower(text.front()) && std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '_';
  });
}

// Can stand without quotes.
bool IsBare(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_isgraph(c) && c != '"' && c != '\\' && c != '=';
  });
}

// As JSON writes numbers, without an exponent.
bool IsNumber(std::string_view text) {
  const auto skip_digits = [&text] {
    const size_t digits = std::find_if_not(text.begin(), text.end(), absl::ascii_isdigit) - text.begin();
    text.remove_prefix(digits);
    return digits;
  };
  if (text.starts_with('-')) {
    text.remove_prefix(1);
  }
  const bool starts_with_zero = text.starts_with('0');
  const size_t digits = skip_digits();
  if (digits == 0 || (starts_with_zero && digits > 1)) {
    return false;
  }
  if (text.starts_with('.')) {
    text.remove_prefix(1);
    if (skip_digits() == 0) {
      return false;
    }
  }
  return text.empty();
}

// The length of the JSON string at the start of `text`, quotes included; 0 if there is none. JsonString has made the
// characters between the quotes.
size_t JsonStringLength(std::string_view text) {
  if (!text.starts_with('"')) {
    return 0;
  }
  for (size_t i = 1; i < text.size(); ++i) {
    if (text[i] == '\\') {
      ++i;
    } else if (text[i] == '"') {
      return i + 1;
    }
  }
  return 0;
}

// The bytes with which a character of UTF-8 goes on.
bool IsContinuation(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }

}  // namespace

std::string CutText(std::string_view text, size_t most) {
  constexpr std::string_view kMark = "\xe2\x80\xa6";  // …
  constexpr size_t kMaxCharacterBytes = 4;
  if (text.size() <= most) {
    return std::string(text);
  }
  size_t end = most - kMark.size();
  for (size_t i = 1; i < kMaxCharacterBytes && end > 0 && IsContinuation(text[end]); ++i) {
    --end;
  }
  return std::string(text.substr(0, end)).append(kMark);
}

std::string JsonString(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', /*ensure_ascii=*/false, nlohmann::json::error_handler_t::replace);
}

void LogFields::AddRaw(std::string_view key, std::string_view value) {
  if (!text_.empty()) {
    text_ += ' ';
  }
  text_.append(key).append(1, '=').append(value);
}

LogFields& LogFields::Add(std::string_view key, std::string_view value) {
  const std::string text = CutText(value, kMaxValueBytes);
  AddRaw(key, IsBare(text) && !IsNumber(text) ? text : JsonString(text));
  return *this;
}

LogFields& LogFields::Add(std::string_view key, uint64_t value) {
  AddRaw(key, std::to_string(value));
  return *this;
}

LogFields& LogFields::Add(std::string_view key, double value) {
  AddRaw(key, absl::StrFormat("%.6f", value));
  return *this;
}

LogFields& LogFields::Add(const LogFields& more) {
  if (!text_.empty() && !more.text_.empty()) {
    text_ += ' ';
  }
  text_ += more.text_;
  return *this;
}

std::optional<std::string> ToJsonMembers(std::string_view line) {
  std::string members;
  while (true) {
    const size_t equals = line.find('=');
    if (equals == std::string_view::npos || !IsKey(line.substr(0, equals))) {
      return std::nullopt;
    }
    if (!members.empty()) {
      members += ',';
    }
    members.append(1, '"').append(line.substr(0, equals)).append("\":");
    line.remove_prefix(equals + 1);
    size_t length = JsonStringLength(line);
    if (length > 0) {
      members += line.substr(0, length);
    } else {
      length = std::min(line.find(' '), line.size());
      const std::string_view value = line.substr(0, length);
      if (!IsBare(value)) {
        return std::nullopt;
      }
      members += IsNumber(value) ? std::string(value) : JsonString(value);
    }
    line.remove_prefix(length);
    if (line.empty()) {
      return members;
    }
    if (!line.starts_with(' ')) {
      return std::nullopt;
    }
    line.remove_prefix(1);
  }
}

}  // namespace wellspace::server
