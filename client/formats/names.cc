#include "client/formats/names.h"

#include <array>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

constexpr std::string_view kPartWord = "part";
constexpr std::string_view kRegionWord = "region";

absl::string_view AsAbsl(std::string_view text) { return {text.data(), text.size()}; }

bool IsHexDigit(char c) { return absl::ascii_isxdigit(static_cast<unsigned char>(c)); }

bool IsCharacter(char32_t letter) { return letter <= 0x10ffff && (letter < 0xd800 || letter > 0xdfff); }

// The characters that may stand in a line as they are.
bool IsPlainInLine(char c) { return static_cast<unsigned char>(c) >= ' ' && c != '\x7f'; }

}  // namespace

std::string PercentEncoded(std::string_view name, bool (*is_plain)(char)) {
  std::string encoded;
  for (const char c : name) {
    if (c != '%' && is_plain(c)) {
      encoded += c;
    } else {
      absl::StrAppend(&encoded, "%", absl::Hex(static_cast<uint8_t>(c), absl::kZeroPad2));
    }
  }
  return encoded;
}

std::string PercentDecoded(std::string_view name) {
  std::string decoded;
  for (size_t i = 0; i < name.size(); ++i) {
    if (name[i] == '%' && i + 2 < name.size() && IsHexDigit(name[i + 1]) && IsHexDigit(name[i + 2])) {
      decoded += static_cast<char>(std::stoi(std::string(name.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      decoded += name[i];
    }
  }
  return decoded;
}

void NameChanges::Add(std::string_view name, std::string_view written) {
  if (name != written && ++count_ == 1) {
    example_ = absl::StrCat(Quote(written), " for ", Quote(name));
  }
}

std::string NameChanges::Note(std::string_view reason) const {
  return count_ == 0 ? std::string()
                     : absl::StrCat(AsAbsl(reason), ": ", count_,
                                    count_ == 1 ? " name is another, " : " names are others, such as ", example_);
}

std::string_view CutName(std::string_view name, size_t limit) {
  if (name.size() <= limit) {
    return name;
  }
  while (limit > 0 && (static_cast<uint8_t>(name[limit]) & 0xc0) == 0x80) {
    --limit;
  }
  return name.substr(0, limit);
}

std::u32string ToUtf32(std::string_view text) {
  constexpr std::array<char32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};  // of so many bytes
  std::u32string letters;
  for (size_t i = 0; i < text.size();) {
    const auto first = static_cast<uint8_t>(text[i]);
    const size_t bytes = first < 0x80 ? 1 : first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc0 ? 2 : 0;
    char32_t letter = bytes == 1 ? first : bytes == 0 ? 0 : first & (0x7f >> bytes);
    size_t taken = 1;
    for (; taken < bytes && i + taken < text.size() && (static_cast<uint8_t>(text[i + taken]) & 0xc0) == 0x80;
         ++taken) {
      letter = letter << 6 | (static_cast<uint8_t>(text[i + taken]) & 0x3f);
    }
    const bool is_letter = taken == bytes && letter >= kLeast[bytes] && IsCharacter(letter);
    letters += is_letter ? letter : U'?';
    i += is_letter ? bytes : 1;
  }
  return letters;
}

std::string ToUtf8(std::u32string_view text) {
  std::string bytes;
  for (char32_t letter : text) {
    letter = IsCharacter(letter) ? letter : U'?';
    const int more = letter < 0x80 ? 0 : letter < 0x800 ? 1 : letter < 0x10000 ? 2 : 3;
    constexpr std::array kStarts = {0, 0xc0, 0xe0, 0xf0};
    bytes += static_cast<char>(kStarts[more] | letter >> (6 * more));
    for (int i = more - 1; i >= 0; --i) {
      bytes += static_cast<char>(0x80 | (letter >> (6 * i) & 0x3f));
    }
  }
  return bytes;
}

NameLines::NameLines(const MeshShape& shape, Of of) {
  for (size_t i = 0; of != Of::kRegions && i < shape.boundary.size(); ++i) {
    Add(kPartWord, shape.boundary[i].tag, shape.boundary[i].name);
  }
  for (size_t i = 0; of != Of::kParts && i < shape.regions.size(); ++i) {
    Add(kRegionWord, shape.regions[i].id, shape.regions[i].name);
  }
  if (of == Of::kBoth && shape.dimension == 2 && shape.simplex_count == 0 && shape.vertex_count > 0) {
    lines_.emplace_back(kFlatLine);
  }
}

void NameLines::Add(std::string_view kind, int32_t number, std::string_view name) {
  if (name.empty()) {
    return;
  }
  const std::string start = absl::StrCat(AsAbsl(kind), " ", number, ": ");
  std::string_view held = name;
  std::string encoded;
  // Blanks at the ends are not those of the name.
  for (size_t limit = kMaxNameLineBytes;; limit = held.size() - 1) {
    held = CutName(name, limit);
    encoded = PercentEncoded(held, IsPlainInLine);
    for (const bool is_last : {true, false}) {
      const size_t at = is_last ? encoded.size() - 1 : 0;
      if (!encoded.empty() && encoded[at] == ' ') {
        encoded.replace(at, 1, "%20");
      }
    }
    if (start.size() + encoded.size() <= kMaxNameLineBytes) {
      break;
    }
  }
  changes_.Add(name, held);
  lines_.push_back(start + encoded);
}

std::string NameLines::Text(std::string_view before) const {
  std::string text;
  for (const std::string& line : lines_) {
    absl::StrAppend(&text, AsAbsl(before), line, "\n");
  }
  return text;
}

std::string NameLines::ChangesNote() const {
  return changes_.Note(absl::StrCat("names are cut, so that no line has more than ", kMaxNameLineBytes, " bytes"));
}

void TakeNameLine(std::string_view line, FacetSorter* parts, RegionCollector* regions) {
  const bool is_part = line.substr(0, kPartWord.size() + 1) == absl::StrCat(AsAbsl(kPartWord), " ");
  const bool is_region = line.substr(0, kRegionWord.size() + 1) == absl::StrCat(AsAbsl(kRegionWord), " ");
  const size_t colon = line.find(": ");
  if ((!is_part && !is_region) || colon == std::string_view::npos) {
    return;
  }
  const size_t first = (is_part ? kPartWord : kRegionWord).size() + 1;
  int32_t number = 0;
  if (colon < first || !absl::SimpleAtoi(AsAbsl(line.substr(first, colon - first)), &number)) {
    return;
  }
  std::string name = PercentDecoded(line.substr(colon + 2));
  if (is_part && parts != nullptr) {
    parts->Name(number, std::move(name));
  } else if (is_region && regions != nullptr) {
    regions->Name(number, std::move(name));
  }
}

}  // namespace wellspace::formats
