#include "client/formats/coordinate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

// A longer word names no column, and a longer number was written by no program.
constexpr size_t kMaxNameBytes = 200;

bool IsDigit(char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)); }

// Code points from UTF-8; 0xFFFD for bytes that are none.
class CodePoints {
 public:
  explicit CodePoints(std::string_view text) : rest_(text) {}

  bool Next(uint32_t& point) {
    if (rest_.empty()) {
      return false;
    }
    const auto lead = static_cast<uint8_t>(rest_[0]);
    const size_t size = lead < 0x80 ? 1 : lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
    point = size == 1 ? lead : lead & (0xFF >> (size + 1));
    bool good = lead < 0x80 || (lead >= 0xC2 && lead < 0xF5 && rest_.size() >= size);
    for (size_t i = 1; good && i < size; ++i) {
      const auto byte = static_cast<uint8_t>(rest_[i]);
      good = (byte & 0xC0) == 0x80;
      point = point << 6 | (byte & 0x3F);
    }
    if (!good) {
      point = 0xFFFD;
    }
    rest_.remove_prefix(good ? size : 1);
    return true;
  }

 private:
  std::string_view rest_;
};

// Hyphens and dashes, the minus sign, their small and wide forms.
bool IsMinusLike(uint32_t point) {
  return (point >= 0x2010 && point <= 0x2015) || point == 0x2212 || point == 0xFE63 || point == 0xFF0D;
}

bool IsWideBlank(uint32_t point) {
  return point == 0xA0 || (point >= 0x2000 && point <= 0x200B) || point == 0x202F || point == 0x3000;
}

bool IsLetter(uint32_t point) {
  if (point < 0x80) {
    return absl::ascii_isalpha(static_cast<unsigned char>(point));
  }
  if ((point >= 0x660 && point <= 0x669) || (point >= 0xFF10 && point <= 0xFF19)) {
    return false;  // digits
  }
  // From 0x2000 on there are marks and symbols, then letters again.
  return point >= 0xC0 && point != 0xD7 && point != 0xF7 && (point < 0x2000 || point >= 0x2C00) && point != 0xFFFD &&
         !IsMinusLike(point) && !IsWideBlank(point);
}

// Whether `text`, of digits and one comma or more, might be a number with commas in its thousands.
bool IsGroupedByThousands(std::string_view text) {
  text = text.substr(0, text.find('.'));
  size_t digits = 0;
  bool is_first = true;
  for (const char c : text) {
    if (IsDigit(c)) {
      ++digits;
    } else if (c != '+' && c != '-') {
      if (is_first ? digits == 0 || digits > 3 : digits != 3) {
        return false;
      }
      is_first = false;
      digits = 0;
    }
  }
  return !is_first && digits == 3;
}

std::string HintOfCommas(std::string_view text) {
  const auto commas = std::count(text.begin(), text.end(), ',');
  const bool is_plain =
      std::all_of(text.begin(), text.end(), [](char c) { return IsDigit(c) || absl::StrContains(",.+-eEdD", c); });
  if (commas == 0 || !is_plain) {
    return "";
  }
  const bool is_grouped = IsGroupedByThousands(text);
  if (commas > 1 || text.find('.') != std::string_view::npos) {
    return is_grouped ? " (commas between thousands? expected none)" : "";
  }
  return is_grouped ? " (a decimal comma, or one between thousands? expected a point, or none)"
                    : " (a decimal comma? expected a point)";
}

// A guess at `text`, which is no number; empty when there is nothing to say.
std::string Hint(std::string_view text) {
  const bool has_digit = std::any_of(text.begin(), text.end(), IsDigit);
  if (!text.empty() && text.find_first_not_of('*') == std::string_view::npos) {
    return " (a number too wide for its field, as Fortran writes it?)";
  }
  if (text == "ncols") {
    return " (a grid of heights? expected one point a line)";
  }
  CodePoints points(text);
  for (uint32_t point = 0; points.Next(point);) {
    if (point < 0x20 || point == 0x7F || point == 0xFFFD) {
      return " (is it a text file?)";
    }
    if (has_digit && IsMinusLike(point)) {
      return " (a dash or a minus sign that is not ASCII? expected -)";
    }
    if (has_digit && (IsWideBlank(point) || point == '\'' || point == 0x2019)) {
      return " (a mark between thousands? expected none)";
    }
    if (point >= 0x80) {
      return has_digit ? " (expected digits of ASCII)" : "";
    }
  }
  if (has_digit && text.find_first_of(" \t") != std::string_view::npos) {
    return " (decimal commas, or another separator between the columns?)";
  }
  return has_digit ? HintOfCommas(text) : "";
}

// A number with an exponent as Fortran has it; false when `text` is none.
bool ReadFortran(std::string_view text, std::string& as_decimal) {
  const size_t letter = text.find_first_of("dDqQ");
  if (letter != std::string_view::npos) {
    as_decimal = text;
    as_decimal[letter] = 'e';
    return letter > 0 && IsNumber(as_decimal);
  }
  // Three digits leave no room for the letter.
  constexpr size_t kExponent = 4;
  if (text.size() <= kExponent || text.find('.') >= text.size() - kExponent) {
    return false;
  }
  const size_t sign = text.size() - kExponent;
  if ((text[sign] != '+' && text[sign] != '-') || (text[sign - 1] != '.' && !IsDigit(text[sign - 1])) ||
      !std::all_of(text.begin() + sign + 1, text.end(), IsDigit)) {
    return false;
  }
  as_decimal = absl::StrCat(std::string(text.substr(0, sign)), "e", std::string(text.substr(sign)));
  return IsNumber(as_decimal);
}

}  // namespace

bool IsMissingWord(std::string_view text) {
  constexpr std::array<std::string_view, 18> kWords = {"na",  "n/a",     "#n/a",    "<na>",    "null",   "none",
                                                       "nil", "missing", "nan",     "-",       "--",     "?",
                                                       "\\n", "1.#ind",  "1.#qnan", "1.#snan", "1.#inf", "no data"};
  if (text.size() > kMaxNameBytes) {
    return false;
  }
  std::string word = absl::AsciiStrToLower({text.data(), text.size()});
  if (word.size() > 2 && (word[0] == '-' || word[0] == '+')) {
    word.erase(0, 1);
  }
  return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
}

CoordinateKind ReadCoordinate(std::string_view text, double& value) {
  if (ParseFinite(text, value).ok()) {
    return CoordinateKind::kFinite;
  }
  if (text.empty() || IsNumber(text) || IsMissingWord(text)) {
    return CoordinateKind::kInvalid;
  }
  std::string decimal;
  if (text.size() > kMaxNameBytes || !ReadFortran(text, decimal)) {
    return CoordinateKind::kNone;
  }
  return ParseFinite(decimal, value).ok() ? CoordinateKind::kFinite : CoordinateKind::kInvalid;
}

bool ReadOrNan(std::string_view text, double& value) {
  const CoordinateKind kind = ReadCoordinate(text, value);
  value = kind == CoordinateKind::kInvalid ? std::numeric_limits<double>::quiet_NaN() : value;
  return kind != CoordinateKind::kNone;
}

absl::Status CoordinateError(std::string_view text) {
  double value = 0;
  const bool is_invalid = ReadCoordinate(text, value) == CoordinateKind::kInvalid;
  return absl::InvalidArgumentError(
      absl::StrCat(ParseFinite(text, value).message(), is_invalid ? std::string(kSkipInvalidHint) : Hint(text)));
}

absl::Status TakeFinite(std::string_view text, double& value) {
  switch (ReadCoordinate(text, value)) {
    case CoordinateKind::kFinite:
      return absl::OkStatus();
    case CoordinateKind::kInvalid:
      return ParseFinite(text, value);
    case CoordinateKind::kNone:
      break;
  }
  return CoordinateError(text);
}

absl::Status TakeCoordinate(std::string_view text, bool may_be_invalid, double& value) {
  const bool is_read = !text.empty() && ReadOrNan(text, value) && (may_be_invalid || !std::isnan(value));
  return is_read ? absl::OkStatus() : CoordinateError(text);
}

bool IsColumnName(std::string_view text) {
  double value = 0;
  if (text.empty() || text.size() > kMaxNameBytes || IsDigit(text[0]) ||
      ReadCoordinate(text, value) != CoordinateKind::kNone) {
    return false;
  }
  if (text.size() > 1 && std::string_view("+-.").find(text[0]) != std::string_view::npos &&
      (IsDigit(text[1]) || text[1] == '.')) {
    return false;
  }
  bool has_letter = false;
  CodePoints points(text);
  for (uint32_t point = 0; points.Next(point);) {
    if (point < 0x20 || point == 0x7F || point == 0xFFFD) {
      return false;
    }
    has_letter |= IsLetter(point);
  }
  return has_letter;
}

}  // namespace wellspace::formats
