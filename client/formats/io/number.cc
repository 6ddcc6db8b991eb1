#include "client/formats/io/number.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

std::string_view WithoutQuotes(std::string_view field) {
  const bool is_quoted = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return is_quoted ? field.substr(1, field.size() - 2) : field;
}

bool IsBlank(char c) { return c == ' ' || c == '\t'; }

// A number as 0.d1d2d3... times ten to the power of `exponent`.
struct Decimal {
  bool is_negative = false;
  std::string digits;  // no zero at either end, unless it is all there is
  int exponent = 0;
};

// With the fewest digits that tell the number, or with so many.
Decimal ToDecimal(double value, int digits) {
  char buffer[32];
  char* const last = buffer + sizeof(buffer);
  const char* end = digits == 0 ? std::to_chars(buffer, last, value, std::chars_format::scientific).ptr
                                : std::to_chars(buffer, last, value, std::chars_format::scientific, digits - 1).ptr;
  std::string_view text(buffer, end - buffer);
  Decimal decimal{.is_negative = text.front() == '-', .digits = {}, .exponent = 0};
  text.remove_prefix(decimal.is_negative ? 1 : 0);
  const size_t mark = text.find('e');
  const std::string_view power = text.substr(mark + (text[mark + 1] == '+' ? 2 : 1));
  std::from_chars(power.data(), power.data() + power.size(), decimal.exponent);
  ++decimal.exponent;
  for (const char c : text.substr(0, mark)) {
    decimal.digits += c == '.' ? "" : std::string(1, c);
  }
  decimal.digits.resize(std::max<size_t>(decimal.digits.find_last_not_of('0') + 1, 1));
  return decimal;
}

// The shortest of the forms 123.4, .01234, 1.234e-9 and 1234e-12, which C, Fortran and Python read alike.
std::string ShortestForm(const Decimal& decimal) {
  const auto& [is_negative, digits, exponent] = decimal;
  const int count = static_cast<int>(digits.size());
  std::string best = absl::StrCat(digits, "e", exponent - count);
  const auto choose = [&best](std::string form) {
    if (form.size() <= best.size()) {
      best = std::move(form);
    }
  };
  choose(absl::StrCat(digits.substr(0, 1), count > 1 ? "." : "", digits.substr(1), "e", exponent - 1));
  constexpr int kMaxZeros = 20;
  if (exponent > 0 && exponent < count) {
    choose(absl::StrCat(digits.substr(0, exponent), ".", digits.substr(exponent)));
  } else if (exponent >= count && exponent - count < kMaxZeros) {
    choose(absl::StrCat(digits, std::string(exponent - count, '0')));
  } else if (exponent <= 0 && -exponent < kMaxZeros) {
    choose(absl::StrCat(".", std::string(-exponent, '0'), digits));
  }
  return is_negative ? absl::StrCat("-", best) : best;
}

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

bool IsRoundedWhole(std::string_view text, double value) {
  constexpr double kAllWhole = 9007199254740992;  // doubles up to here have all whole numbers
  if (!(std::abs(value) >= kAllWhole) || !std::isfinite(value)) {
    return false;
  }
  text.remove_prefix(!text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0);
  text.remove_prefix(std::min(text.find_first_not_of('0'), text.size()));
  if (text.find_first_not_of("0123456789") != std::string_view::npos) {
    return false;
  }
  char buffer[320];
  const char* const end =
      std::to_chars(buffer, buffer + sizeof(buffer), std::abs(value), std::chars_format::fixed, 0).ptr;
  return text != std::string_view(buffer, static_cast<size_t>(end - buffer));
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

double AppendNumberWithin(double value, size_t width, std::string& text) {
  const size_t begin = text.size();
  AppendNumber(value, text);
  if (text.size() - begin <= width) {
    return value;
  }
  text.resize(begin);
  const Decimal exact = ToDecimal(value, 0);
  std::string form = ShortestForm(exact);
  for (int digits = static_cast<int>(exact.digits.size()) - 1; form.size() > width; --digits) {
    form = ShortestForm(ToDecimal(value, digits));
    if (double rounded = 0; form.size() <= width && !ParseFinite(form, rounded).ok()) {
      Decimal cut = exact;  // towards zero: rounded up, it is beyond the largest double
      cut.digits.resize(digits);
      form = ShortestForm(cut);
    }
  }
  text += form;
  double read = 0;
  ParseFinite(form, read).IgnoreError();  // it is finite
  return read;
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
