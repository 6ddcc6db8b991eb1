#include "client/formats/table_columns.h"

#include <algorithm>
#include <array>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kNamedAxes = 3;
constexpr size_t kNone = static_cast<size_t>(-1);

// Names that go together; the first that has both x and y is taken.
enum Family { kCartesian, kProjected, kProjectedShort, kGeographic, kIndexed, kFamilies };

struct Meaning {
  int family;  // kFamilies: a height, which goes with any but x and y
  size_t axis;
};

template <size_t N>
bool IsOneOf(std::string_view word, const std::array<std::string_view, N>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

constexpr std::array<std::string_view, 13> kPointWords = {"point",      "points",      "pt",      "coord",    "coords",
                                                          "coordinate", "coordinates", "pos",     "position", "vertex",
                                                          "node",       "center",      "centroid"};
constexpr std::array<std::string_view, 14> kUnitWords = {
    "m", "mm", "cm", "km", "ft", "us", "deg", "dd", "degrees", "meter", "meters", "metre", "metres", "wgs84"};

// Names that are never a coordinate's; where one is, its neighbours without known names are not trusted either.
constexpr std::array<std::string_view, 20> kOtherWords = {
    "id",  "fid", "index", "idx",  "objectid",  "gid",   "name",      "label",    "number",         "pointid",
    "rgb", "red", "green", "blue", "intensity", "alpha", "timestamp", "timestep", "classification", "class"};

// Words of the name in lower case, without the text in brackets after them.
std::vector<std::string> WordsOf(std::string_view name) {
  std::vector<std::string> words;
  bool in_word = false;
  for (const char c : name.substr(0, name.find_first_of("[("))) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_part = absl::ascii_isalnum(byte) || byte >= 0x80;
    if (is_part && !in_word) {
      words.emplace_back();
    }
    in_word = is_part;
    if (is_part) {
      words.back() += static_cast<char>(absl::ascii_tolower(byte));
    }
  }
  return words;
}

std::optional<Meaning> MeaningOfWord(std::string_view word, bool is_of_point) {
  constexpr std::array<std::string_view, 5> kLongitudes = {"lon", "long", "longitude", "lng", "longitud"};
  constexpr std::array<std::string_view, 3> kLatitudes = {"lat", "latitude", "latitud"};
  constexpr std::array<std::string_view, 3> kEastings = {"east", "easting", "eastings"};
  constexpr std::array<std::string_view, 3> kNorthings = {"north", "northing", "northings"};
  constexpr std::array<std::string_view, 9> kHeights = {"alt",    "altitude", "elev",  "elevation", "ele",
                                                        "height", "hgt",      "depth", "h"};
  if (word.size() == 1 && word[0] >= 'x' && word[0] <= 'z') {
    return Meaning{kCartesian, static_cast<size_t>(word[0] - 'x')};
  }
  if (is_of_point && word.size() == 1 && word[0] >= '0' && word[0] <= '2') {
    return Meaning{kIndexed, static_cast<size_t>(word[0] - '0')};
  }
  if (IsOneOf(word, kLongitudes) || IsOneOf(word, kLatitudes)) {
    return Meaning{kGeographic, IsOneOf(word, kLatitudes) ? size_t{1} : size_t{0}};
  }
  if (IsOneOf(word, kEastings) || IsOneOf(word, kNorthings)) {
    return Meaning{kProjected, IsOneOf(word, kNorthings) ? size_t{1} : size_t{0}};
  }
  if (word == "e" || word == "n") {
    return Meaning{kProjectedShort, word == "n" ? size_t{1} : size_t{0}};
  }
  return IsOneOf(word, kHeights) ? std::make_optional(Meaning{kFamilies, 2}) : std::nullopt;
}

std::optional<Meaning> MeaningOf(std::string_view name) {
  std::vector<std::string> words = WordsOf(name);
  bool is_of_point = false;
  std::string left;
  for (std::string& word : words) {
    // "xcoord", "coordx".
    for (const std::string_view point : kPointWords) {
      const size_t size = point.size();
      if (word.size() != size + 1) {
        continue;
      }
      if (std::string_view(word).substr(1) == point || std::string_view(word).substr(0, size) == point) {
        const char axis = std::string_view(word).substr(1) == point ? word[0] : word.back();
        if (axis >= 'x' && axis <= 'z') {
          word = std::string(1, axis);
        }
      }
    }
    if (IsOneOf(word, kPointWords)) {
      is_of_point = true;
    } else if (!left.empty() && IsOneOf(word, kUnitWords)) {
      continue;
    } else if (left.empty()) {
      left = word;
    } else {
      return std::nullopt;
    }
  }
  return MeaningOfWord(left, is_of_point);
}

std::string NameOr(const std::vector<std::string>& names, size_t column) {
  return column < names.size() && !names[column].empty() ? absl::StrCat(" ", Quote(names[column])) : "";
}

// `line` without the text between double quotes.
std::string Unquoted(std::string_view line) {
  std::string text;
  bool is_quoted = false;
  for (const char c : line) {
    is_quoted ^= c == '"';
    if (!is_quoted) {
      text += c;
    }
  }
  return is_quoted ? std::string(line) : text;
}

}  // namespace

NamedColumns FindCoordinates(const std::vector<std::string>& names) {
  std::array<std::array<size_t, kNamedAxes>, kFamilies> found;
  for (auto& axes : found) {
    axes.fill(kNone);
  }
  size_t height = kNone;
  size_t other = kNone;  // the first that is no coordinate for sure
  size_t known = 0;
  for (size_t column = 0; column < names.size(); ++column) {
    const std::optional<Meaning> meaning = MeaningOf(names[column]);
    if (!meaning) {
      const std::vector<std::string> words = WordsOf(names[column]);
      const bool is_other =
          words.size() == 1 ? IsOneOf(words[0], kOtherWords) : !words.empty() && IsOneOf(words.back(), kOtherWords);
      other = other == kNone && is_other ? column : other;
      continue;
    }
    size_t& place = meaning->family == kFamilies ? height : found[meaning->family][meaning->axis];
    known += meaning->family == kFamilies || meaning->family == kProjectedShort ? 0 : 1;
    place = place == kNone ? column : place;
  }
  NamedColumns named;
  for (int family = 0; family < kFamilies; ++family) {
    std::array<size_t, kNamedAxes>& axes = found[family];
    if (axes[0] == kNone || axes[1] == kNone) {
      continue;
    }
    if (family == kProjected || family == kProjectedShort || family == kGeographic) {
      axes[2] = found[kCartesian][2] != kNone ? found[kCartesian][2] : height;
    }
    named.columns.assign(axes.begin(), axes.begin() + (axes[2] == kNone ? 2 : 3));
    return named;
  }
  if (other != kNone) {
    named.problem = absl::StrCat("column ", other + 1, NameOr(names, other), " is no coordinate");
  } else if (known > 0 && known < names.size()) {
    named.problem = "some of the columns have names of coordinates, but none is x and y, or the like";
  }
  return named;
}

absl::StatusOr<size_t> ResolveColumn(std::string_view option, const std::string& wanted,
                                     const std::vector<std::string>& names, size_t count) {
  const auto error = [option](const std::string& message) {
    return absl::InvalidArgumentError(absl::StrCat(std::string(option), ": ", message));
  };
  uint64_t number = 0;
  size_t column = kNone;
  if (ParseUnsigned(wanted, kMaxCount, number)) {
    column = number >= 1 && number <= count ? number - 1 : kNone;
  } else {
    const auto is_it = [&wanted](const std::string& name) {
      return absl::AsciiStrToLower(name) == absl::AsciiStrToLower(wanted);
    };
    const auto at = std::find_if(names.begin(), names.end(), is_it);
    if (at != names.end() && std::find_if(at + 1, names.end(), is_it) != names.end()) {
      return error(absl::StrCat("two columns are called ", Quote(wanted), "; expected its number"));
    }
    column = at == names.end() ? kNone : at - names.begin();
  }
  if (column != kNone) {
    return column;
  }
  std::string known;
  for (const std::string& name : names) {
    if (known.size() < 200) {
      absl::StrAppend(&known, known.empty() ? "" : ", ", Quote(name));
    }
  }
  return error(absl::StrCat("there is no column ", Quote(wanted), "; expected numbers from 1 to ", count,
                            known.empty() ? " (the columns have no names)" : absl::StrCat(", or names of ", known)));
}

absl::StatusOr<std::vector<size_t>> ResolveColumns(const std::vector<std::string>& wanted,
                                                   const std::vector<std::string>& names, size_t count, int dimension) {
  std::vector<size_t> columns;
  for (const std::string& one : wanted) {
    WELLSPACE_ASSIGN_OR_RETURN(const size_t column, ResolveColumn("--columns", one, names, count));
    if (std::find(columns.begin(), columns.end(), column) != columns.end()) {
      return absl::InvalidArgumentError(absl::StrCat("--columns: column ", Quote(one), " is given twice"));
    }
    columns.push_back(column);
  }
  if (dimension != 0 ? columns.size() != static_cast<size_t>(dimension)
                     : columns.size() < kMinDimension || columns.size() > kMaxDimension) {
    return absl::InvalidArgumentError(
        absl::StrCat("--columns: expected ",
                     dimension != 0 ? absl::StrCat(dimension) : absl::StrCat(kMinDimension, " to ", kMaxDimension),
                     " columns, one for each coordinate, got ", columns.size()));
  }
  return columns;
}

std::string ColumnsText(const std::vector<size_t>& columns, const std::vector<std::string>& names) {
  std::string text = columns.size() == 1 ? "column" : "columns";
  for (size_t i = 0; i < columns.size(); ++i) {
    absl::StrAppend(&text, i == 0 ? " " : ", ", columns[i] + 1, NameOr(names, columns[i]));
    if (text.size() > 300 && i + 1 < columns.size()) {
      absl::StrAppend(&text, " and ", columns.size() - i - 1, " more");
      break;
    }
  }
  return text;
}

std::string ColumnsOption(const std::vector<size_t>& columns, size_t count) {
  std::string text = "--columns ";
  for (size_t i = 0; i < std::min(count, columns.size()); ++i) {
    absl::StrAppend(&text, i == 0 ? "" : ",", columns[i] + 1);
  }
  return text;
}

std::vector<std::string> FieldsOf(std::string_view line, char separator) {
  std::vector<std::string> fields;
  FieldSplitter splitter(line, separator);
  for (std::string_view field; splitter.Next(field);) {
    fields.emplace_back(field);
  }
  return fields;
}

char SeparatorOf(std::string_view quoted_line) {
  const std::string line = Unquoted(quoted_line);
  if (line.find(';') != std::string_view::npos) {
    return ';';
  }
  if (line.find(',') == std::string_view::npos) {
    return ' ';
  }
  FieldSplitter splitter(line, ',');
  for (std::string_view field; splitter.Next(field);) {
    if (field.find('\t') != std::string_view::npos) {
      return '\t';
    }
  }
  return ',';
}

}  // namespace wellspace::formats
