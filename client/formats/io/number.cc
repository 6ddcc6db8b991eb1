#include "client/formats/io/number.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

std::string_view WithoutQuotes(std::string_view field) {
  const bool is_quoted = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return is_quoted ? field.substr(1, field.size() - 2) : field;
}

bool IsBlank(char c) { return c == ' ' || c == '\t'; }

enum class NumberKind { kFinite, kNotFinite, kTooLarge, kNone };

NumberKind Parse(std::string_view text, double& value) {
  std::string_view digits = text;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') {
    digits.remove_prefix(1);
  }
  const char* end = digits.data() + digits.size();
  const std::from_chars_result result = std::from_chars(digits.data(), end, value);
  if (result.ptr != end || result.ec == std::errc::invalid_argument) {
    return NumberKind::kNone;
  }
  if (result.ec == std::errc::result_out_of_range) {
    // from_chars does not say on which side of the range; strtod does.
    value = std::strtod(std::string(digits).c_str(), nullptr);
    return std::isinf(value) ? NumberKind::kTooLarge : NumberKind::kFinite;
  }
  return std::isfinite(value) ? NumberKind::kFinite : NumberKind::kNotFinite;
}

}  // namespace

std::string Quote(std::string_view text) {
  constexpr size_t kShown = 40;
  const std::string_view shown = text.substr(0, kShown);
  return absl::StrCat("\"", absl::CHexEscape({shown.data(), shown.size()}), text.size() > kShown ? "..." : "", "\"");
}

absl::Status LineError(std::string_view name, uint64_t line, std::string_view message) {
  return absl::InvalidArgumentError(absl::StrCat(absl::string_view(name.data(), name.size()), ":", line, ": ",
                                                 absl::string_view(message.data(), message.size())));
}

bool IsNumber(std::string_view text) {
  double value;
  return Parse(text, value) != NumberKind::kNone;
}

absl::Status ParseFinite(std::string_view text, double& value) {
  switch (Parse(text, value)) {
    case NumberKind::kFinite:
      return absl::OkStatus();
    case NumberKind::kNotFinite:
      return absl::InvalidArgumentError(absl::StrCat("expected a finite number, got ", Quote(text)));
    case NumberKind::kTooLarge:
      return absl::InvalidArgumentError(
          absl::StrCat("expected a number of magnitude below 1.8e308, got ", Quote(text)));
    case NumberKind::kNone:
      break;
  }
  return absl::InvalidArgumentError(absl::StrCat("expected a number, got ", Quote(text)));
}

bool ParseUnsigned(std::string_view text, uint64_t limit, uint64_t& value) {
  const char* end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, value);
  return result.ec == std::errc() && result.ptr == end && value <= limit;
}

void AppendNumber(double value, std::string& text) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof(buffer), value).ptr);
}

void AppendNumber(uint64_t value, std::string& text) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof(buffer), value).ptr);
}

std::string_view TrimBlanks(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) {
    text.remove_prefix(1);
  }
  while (!text.empty() && IsBlank(text.back())) {
    text.remove_suffix(1);
  }
  return text;
}

FieldSplitter::FieldSplitter(std::string_view line, char separator)
    : rest_(separator == '\t' ? line : TrimBlanks(line)), separator_(separator), more_(!rest_.empty()) {}

// Behind the quotes that the field starts with; 0 if it has none, or if they do not end.
size_t FieldSplitter::EndOfQuotes() const {
  size_t at = 0;
  while (at < rest_.size() && IsBlank(rest_[at]) && rest_[at] != separator_) {
    ++at;
  }
  if (at == rest_.size() || rest_[at] != '"') {
    return 0;
  }
  for (++at; at < rest_.size(); ++at) {
    if (rest_[at] == '"') {
      if (at + 1 == rest_.size() || rest_[at + 1] != '"') {
        return at + 1;
      }
      ++at;  // two stand for one
    }
  }
  return 0;
}

bool FieldSplitter::Next(std::string_view& field) {
  if (!more_) {
    return false;
  }
  size_t end = !rest_.empty() && (rest_[0] == '"' || IsBlank(rest_[0])) ? EndOfQuotes() : 0;
  if (separator_ == ' ') {
    while (end < rest_.size() && !IsBlank(rest_[end])) {
      ++end;
    }
    field = WithoutQuotes(rest_.substr(0, end));
    while (end < rest_.size() && IsBlank(rest_[end])) {
      ++end;
    }
    rest_.remove_prefix(end);
    more_ = !rest_.empty();
    return true;
  }
  while (end < rest_.size() && rest_[end] != separator_) {
    ++end;
  }
  field = WithoutQuotes(TrimBlanks(rest_.substr(0, end)));
  more_ = end < rest_.size();
  rest_.remove_prefix(more_ ? end + 1 : end);
  return true;
}

}  // namespace wellspace::formats
