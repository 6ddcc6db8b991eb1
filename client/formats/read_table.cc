// CSV, XYZ, ASC and PTS: one point a line.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/number.h"
#include "client/formats/table_columns.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The coordinate that a field holds; from kMaxDimension on, the attribute.
constexpr int kSkipped = -1;

// The columns that hold coordinates where nothing says which.
enum class Unnamed { kAll, kFirstThree };

constexpr std::string_view kCloudCompare = "//";

// Reads rows of one table into a cloud.
class TableReader {
 public:
  TableReader(LineReader& reader, const CloudOptions& options, Unnamed unnamed, PointCloud& cloud)
      : reader_(reader), options_(options), unnamed_(unnamed), cloud_(cloud) {}

  // One line with content. The first may be a header.
  absl::Status ReadLine(std::string_view line);
  // Takes a line that says how many points come next, if it is such a line.
  bool TakeCount(std::string_view line);
  // To be called before the next count and at the end of the file: as many points as the last count says have come.
  absl::Status CheckCount() const;
  // Whether a count may come next, and whether as many points have come as the last one says.
  bool may_take_count() const { return rows() == 0 || expected_rows_; }
  bool is_complete() const { return expected_rows_ && *expected_rows_ == rows(); }

 private:
  bool TakeHeader(std::string_view line);
  void TakeCommentedNames(std::string_view names, size_t fields);
  absl::Status Begin(std::string_view line);
  absl::Status Choose(std::string_view line, size_t fields, std::vector<size_t>& columns);
  absl::Status CheckNumbers(std::string_view line, const std::vector<size_t>& columns) const;
  absl::Status FieldError(size_t field, std::string_view text, const absl::Status& status) const;
  absl::Status CheckDimension(const std::vector<size_t>& columns) const;
  void NoteColumns(const std::vector<size_t>& columns, size_t fields);
  absl::Status ReadRow(std::string_view line);
  void TakeAttribute(std::string_view text, size_t field);
  void AddAttributes();
  absl::Status CountError(size_t fields, size_t coordinates) const;
  uint64_t rows() const { return cloud_.size() + cloud_.skipped; }
  std::string_view Row(std::string_view line) const { return separator_ == '\t' ? reader_.whole_line() : line; }

  LineReader& reader_;
  const CloudOptions& options_;
  const Unnamed unnamed_;
  PointCloud& cloud_;
  char separator_ = '\0';           // not known yet
  std::vector<std::string> names_;  // empty: no header
  uint64_t header_line_ = 0;
  bool has_begun_ = false;
  uint64_t first_row_ = 0;                // its line
  std::vector<int> coordinate_of_field_;  // of every field of a row
  std::vector<double> attributes_;        // of the row
  bool has_skipped_columns_ = false;
  bool may_be_counted_ = false;
  std::optional<uint64_t> expected_rows_;  // as the last count says
  uint64_t count_line_ = 0;
};

// Takes the names of the columns off the first line; false if it has none.
bool TableReader::TakeHeader(std::string_view line) {
  const bool has_tab = line.find('\t') != std::string_view::npos;
  char separator = SeparatorOf(line);
  if (separator == ' ' && has_tab) {
    separator = '\t';
  }
  std::vector<std::string> names = FieldsOf(separator == '\t' ? reader_.whole_line() : line, separator);
  const auto named = std::count_if(names.begin(), names.end(), [](const std::string& name) { return !name.empty(); });
  const bool are_names = std::all_of(names.begin(), names.end(),
                                     [](const std::string& name) { return name.empty() || IsColumnName(name); });
  if (named < kMinDimension || (!are_names && FindCoordinates(names).columns.empty())) {
    return false;
  }
  names_ = std::move(names);
  separator_ = separator == ' ' ? '\0' : separator;
  header_line_ = reader_.line_number();
  return true;
}

// Takes names from a comment if they say which columns are coordinates, or if the user may have named some, of `fields`
// columns unless that is 0.
void TableReader::TakeCommentedNames(std::string_view text, size_t fields) {
  for (const char separator : {SeparatorOf(text), '\t'}) {
    std::vector<std::string> names = FieldsOf(TrimBlanks(text), separator);
    const bool are_useful = !FindCoordinates(names).columns.empty() || !options_.columns.empty();
    if (are_useful && (fields == 0 || names.size() == fields)) {
      names_ = std::move(names);
      header_line_ = 0;
      return;
    }
  }
}

// Decides with the first row which columns are coordinates.
absl::Status TableReader::Begin(std::string_view line) {
  has_begun_ = true;
  first_row_ = reader_.line_number();
  if (separator_ == '\0') {
    separator_ = SeparatorOf(line);
  } else if (separator_ == '\t' && FieldsOf(reader_.whole_line(), '\t').size() != names_.size()) {
    separator_ = ' ';  // the tabs of the header are blanks like others
    names_ = FieldsOf(absl::StrJoin(names_, " "), ' ');
  }
  const size_t fields = FieldsOf(Row(line), separator_).size();
  if (names_.empty() && !reader_.is_comment_behind()) {
    TakeCommentedNames(reader_.comment(), fields);
  }
  std::vector<size_t> columns;
  WELLSPACE_RETURN_IF_ERROR(Choose(line, names_.empty() ? fields : names_.size(), columns));
  coordinate_of_field_.assign(names_.empty() ? fields : names_.size(), kSkipped);
  for (size_t i = 0; i < columns.size(); ++i) {
    coordinate_of_field_[columns[i]] = static_cast<int>(i);
  }
  has_skipped_columns_ = columns.size() < coordinate_of_field_.size();
  for (size_t i = 0; i < names_.size() && options_.keep_attributes; ++i) {
    if (coordinate_of_field_[i] == kSkipped && !names_[i].empty()) {
      coordinate_of_field_[i] = kMaxDimension + static_cast<int>(cloud_.attributes.size());
      cloud_.attributes.push_back({.name = names_[i], .values = {}});
    }
  }
  attributes_.resize(cloud_.attributes.size());
  cloud_.dimension = static_cast<int>(columns.size());
  return absl::OkStatus();
}

absl::Status TableReader::Choose(std::string_view line, size_t fields, std::vector<size_t>& columns) {
  constexpr int kNamedAxes = 3;
  const int wanted = options_.dimension;
  if (!options_.columns.empty()) {
    absl::StatusOr<std::vector<size_t>> resolved = ResolveColumns(options_.columns, names_, fields, wanted);
    if (!resolved.ok()) {
      return reader_.Error(std::string(resolved.status().message()));
    }
    columns = *std::move(resolved);
    return absl::OkStatus();
  }
  if (!names_.empty() && wanted <= kNamedAxes) {
    NamedColumns named = FindCoordinates(names_);
    columns = std::move(named.columns);
    if (columns.empty() && !named.problem.empty()) {
      return LineError(
          cloud_.name, header_line_,
          absl::StrCat(named.problem, "; expected names such as x and y, or --columns with names or numbers"));
    }
  }
  if (columns.empty()) {
    const size_t count = unnamed_ == Unnamed::kFirstThree ? std::max(kNamedAxes, wanted) : fields;
    columns.resize(std::min(count, fields));
    std::iota(columns.begin(), columns.end(), size_t{0});
  }
  if (absl::Status status = CheckDimension(columns); !status.ok()) {
    // A text that is no number at all is the better reason.
    const absl::Status row = names_.empty() ? CheckNumbers(line, columns) : absl::OkStatus();
    return row.ok() ? status : row;
  }
  // A fourth column is an intensity or a colour more often than a coordinate, and a mesh in 4-D of it would be no help.
  if (names_.empty() && wanted == 0 && columns.size() > kNamedAxes) {
    const absl::Status row = CheckNumbers(line, columns);
    return !row.ok()
               ? row
               : reader_.Error(absl::StrCat(columns.size(), " columns without names of coordinates: expected ",
                                            ColumnsOption(columns, 2), " or ", ColumnsOption(columns, kNamedAxes),
                                            " or others that are, or --dimension ", columns.size(), " if all are"));
  }
  NoteColumns(columns, fields);
  return absl::OkStatus();
}

absl::Status TableReader::CheckNumbers(std::string_view line, const std::vector<size_t>& columns) const {
  const std::vector<std::string> fields = FieldsOf(Row(line), separator_);
  for (const size_t column : columns) {
    double value = 0;
    if (ReadCoordinate(fields[column], value) == CoordinateKind::kNone) {
      return FieldError(column, fields[column], CoordinateError(fields[column]));
    }
  }
  return absl::OkStatus();
}

absl::Status TableReader::FieldError(size_t field, std::string_view text, const absl::Status& status) const {
  const bool may_be_others = names_.empty() && options_.columns.empty() && reader_.line_number() == first_row_ &&
                             IsColumnName(text) && coordinate_of_field_.size() > kMinDimension;
  return reader_.Error(absl::StrCat("field ", field + 1, ": ", status.message(),
                                    may_be_others ? "; --columns says which columns are coordinates" : ""));
}

absl::Status TableReader::CheckDimension(const std::vector<size_t>& columns) const {
  const int wanted = options_.dimension;
  const size_t count = columns.size();
  const bool has_others = names_.size() > count;
  const std::string taken = !names_.empty() && (has_others || count > static_cast<size_t>(wanted))
                                ? absl::StrCat(" (", ColumnsText(columns, names_), ")")
                                : "";
  if (wanted != 0 && count != static_cast<size_t>(wanted)) {
    return reader_.Error(
        absl::StrCat("expected ", wanted, " coordinates, got ", count, taken,
                     count > static_cast<size_t>(wanted)
                         ? absl::StrCat("; ", ColumnsOption(columns, wanted), " takes ", wanted, " of them")
                     : has_others ? "; --columns takes others"
                                  : ""));
  }
  if (count < kMinDimension || count > kMaxDimension) {
    return reader_.Error(absl::StrCat(
        "expected ", kMinDimension, " to ", kMaxDimension, " coordinates, got ", count,
        separator_ == ' ' ? "" : absl::StrCat(" (fields are separated by ", Quote(std::string(1, separator_)), ")"),
        count > kMaxDimension ? absl::StrCat("; ", ColumnsOption(columns, 3), " takes three of them") : ""));
  }
  return absl::OkStatus();
}

// Says which columns were taken, unless there is no doubt.
void TableReader::NoteColumns(const std::vector<size_t>& columns, size_t fields) {
  std::vector<size_t> left;
  for (size_t field = 0; field < fields; ++field) {
    if (std::find(columns.begin(), columns.end(), field) == columns.end()) {
      left.push_back(field);
    }
  }
  const bool in_order = std::is_sorted(columns.begin(), columns.end());
  const bool are_known = names_.empty() ? fields <= 3 : !FindCoordinates(names_).columns.empty() && columns.size() <= 3;
  if (left.empty() && in_order && (are_known || (names_.empty() && options_.dimension != 0))) {
    return;
  }
  const bool are_words = header_line_ != 0 && FindCoordinates(names_).columns.empty();
  cloud_.notes.push_back(absl::StrCat(
      cloud_.name, ": ", are_words ? absl::StrCat("line ", header_line_, " is taken for a header; ") : "",
      ColumnsText(columns, names_), columns.size() == 1 ? " is" : " are", " taken as coordinates",
      left.empty() ? "" : absl::StrCat(", and ", ColumnsText(left, names_), left.size() == 1 ? " is" : " are", " not"),
      "; --columns takes others"));
}

absl::Status TableReader::CountError(size_t fields, size_t coordinates) const {
  const size_t expected = coordinate_of_field_.size();
  if (!has_skipped_columns_ || coordinates < static_cast<size_t>(cloud_.dimension)) {
    const bool are_twice = separator_ == ',' && fields == 2 * expected;
    return reader_.Error(absl::StrCat("expected ", cloud_.dimension, " coordinates, got ",
                                      has_skipped_columns_ ? coordinates : fields,
                                      are_twice ? " (decimal commas? expected points)" : ""));
  }
  return reader_.Error(absl::StrCat("expected ", expected, " fields, as line ",
                                    header_line_ != 0 ? header_line_ : first_row_, " has, got ", fields));
}

// A column with a word in it is none of numbers: it is given up.
void TableReader::TakeAttribute(std::string_view text, size_t field) {
  const int attribute = coordinate_of_field_[field] - kMaxDimension;
  double& value = attributes_[attribute];
  if (!ReadOrNan(text, value)) {
    coordinate_of_field_[field] = kSkipped;
    cloud_.attributes[attribute].values = {};
  }
}

void TableReader::AddAttributes() {
  for (const int place : coordinate_of_field_) {
    if (place >= kMaxDimension) {
      cloud_.attributes[place - kMaxDimension].values.push_back(attributes_[place - kMaxDimension]);
    }
  }
}

absl::Status TableReader::ReadRow(std::string_view line) {
  std::array<double, kMaxDimension> point;
  FieldSplitter fields(Row(line), separator_);
  std::string_view field;
  bool is_invalid = false;
  size_t count = 0;
  size_t index = 0;
  size_t used = 0;  // fields, without empty ones behind the last column
  std::fill(attributes_.begin(), attributes_.end(), std::numeric_limits<double>::quiet_NaN());
  while (fields.Next(field)) {
    const size_t place = index++;
    if (place >= coordinate_of_field_.size()) {
      used = field.empty() ? used : index;
      continue;
    }
    used = index;
    const int coordinate = coordinate_of_field_[place];
    if (coordinate == kSkipped) {
      continue;
    }
    if (coordinate >= kMaxDimension) {
      TakeAttribute(field, place);
      continue;
    }
    ++count;
    double& value = point[coordinate];
    const char* end = field.data() + field.size();
    const std::from_chars_result plain = std::from_chars(field.data(), end, value);
    if (plain.ec == std::errc() && plain.ptr == end && std::isfinite(value)) {
      continue;  // as nearly all are
    }
    if (absl::Status status = TakeCoordinate(field, options_.skip_invalid, value, is_invalid); !status.ok()) {
      return FieldError(place, field, status);
    }
  }
  // Where separators tell the fields apart, the last ones may be missing if they are no coordinates.
  const bool is_too_short = separator_ == ' ' && used < coordinate_of_field_.size();
  if (count != static_cast<size_t>(cloud_.dimension) || used > coordinate_of_field_.size() || is_too_short) {
    return CountError(used, count);
  }
  AddPoint({point.data(), static_cast<size_t>(cloud_.dimension)}, is_invalid, reader_.line_number(), cloud_);
  if (!is_invalid) {
    AddAttributes();
  }
  return absl::OkStatus();
}

absl::Status TableReader::ReadLine(std::string_view line) {
  if (line.substr(0, kCloudCompare.size()) == kCloudCompare) {
    if (!has_begun_ && names_.empty()) {
      TakeCommentedNames(line.substr(kCloudCompare.size()), 0);
      may_be_counted_ = true;
    }
    return absl::OkStatus();  // a comment otherwise
  }
  if (!has_begun_) {
    // CloudCompare may write the number of points between its header and them.
    if (may_be_counted_ && !expected_rows_ && TakeCount(line)) {
      return absl::OkStatus();
    }
    if (names_.empty() && TakeHeader(line)) {
      return absl::OkStatus();
    }
    WELLSPACE_RETURN_IF_ERROR(Begin(line));
  }
  return ReadRow(line);
}

bool TableReader::TakeCount(std::string_view line) {
  uint64_t count = 0;
  if (!ParseUnsigned(line, kMaxCount, count)) {
    return false;
  }
  expected_rows_ = rows() + count;
  count_line_ = reader_.line_number();
  return true;
}

absl::Status TableReader::CheckCount() const {
  if (!reader_.status().ok() || !expected_rows_ || *expected_rows_ == rows()) {
    return reader_.status();
  }
  return reader_.Error(
      absl::StrCat("expected ", *expected_rows_, " points up to here, as line ", count_line_, " says, got ", rows()));
}

// The rest of an XYZ file as in chemistry, whose first line said `count`.
class MoleculeReader {
 public:
  MoleculeReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read(uint64_t count) {
    const uint64_t count_line = reader_.line_number();
    std::string_view line;
    if (reader_.Next(line)) {  // a comment, whatever it says
      comment_fields_ = FieldsOf(line, ' ');
    }
    while (reader_.NextContent(line)) {
      if (rows() == count) {
        return reader_.Error(absl::StrCat("expected the end of the file after ", count, " points, as line ", count_line,
                                          " says, got ", Quote(line)));
      }
      WELLSPACE_RETURN_IF_ERROR(ReadAtom(line, count_line + 1));
    }
    if (reader_.status().ok() && rows() != count) {
      return reader_.Error(absl::StrCat("expected ", count, " points, as line ", count_line, " says, got ", rows()));
    }
    return reader_.status();
  }

 private:
  uint64_t rows() const { return cloud_.size() + cloud_.skipped; }

  // Chooses the fields with coordinates, by the first line, which has a symbol or not.
  absl::Status Choose(size_t fields, bool has_symbol) {
    constexpr size_t kNamedAxes = 3;
    if (!options_.columns.empty()) {
      absl::StatusOr<std::vector<size_t>> resolved = ResolveColumns(options_.columns, {}, fields, options_.dimension);
      if (!resolved.ok()) {
        return reader_.Error(std::string(resolved.status().message()));
      }
      columns_ = *std::move(resolved);
    } else {
      const size_t numbers = fields - (has_symbol ? 1 : 0);
      columns_.resize(std::min(numbers, std::max<size_t>(kNamedAxes, options_.dimension)));
      std::iota(columns_.begin(), columns_.end(), size_t{0});
    }
    const size_t wanted = options_.dimension;
    if (wanted != 0 ? columns_.size() != wanted : columns_.size() < kMinDimension) {
      return reader_.Error(DimensionError(options_.dimension, columns_.size()));
    }
    cloud_.dimension = static_cast<int>(columns_.size());
    return absl::OkStatus();
  }

  absl::Status ReadAtom(std::string_view line, uint64_t comment_line) {
    fields_ = FieldsOf(line, ' ');
    constexpr size_t kNamedAxes = 3;
    // Na is sodium, where there are three coordinates behind it.
    const bool has_symbol = IsColumnName(fields_[0]) ||
                            (fields_.size() > kNamedAxes && IsMissingWord(fields_[0]) && !IsNumber(fields_[0]) &&
                             absl::ascii_isalpha(static_cast<unsigned char>(fields_[0][0])));
    if (!has_symbol && options_.columns.empty() && fields_.size() > kNamedAxes &&
        options_.dimension <= static_cast<int>(kNamedAxes)) {
      return reader_.Error(absl::StrCat("expected a symbol and three coordinates, got ", Quote(fields_[0]), " and ",
                                        fields_.size() - 1,
                                        " more fields; --columns says which are the coordinates, "
                                        "2,3,4 after an atomic number"));
    }
    if (cloud_.dimension == 0) {
      // Without symbols the file may be another list of points with their number, and the comment its first point.
      const bool is_point = !has_symbol && comment_fields_.size() == fields_.size() &&
                            std::all_of(comment_fields_.begin(), comment_fields_.end(),
                                        [](const std::string& field) { return IsNumber(field); });
      if (is_point) {
        return LineError(cloud_.name, comment_line,
                         "expected a comment, as the second line of a file in chemistry is one, got what looks like a "
                         "point; --input-format pts takes it for one");
      }
      WELLSPACE_RETURN_IF_ERROR(Choose(fields_.size(), has_symbol));
    }
    // Numbers that the user gave count the symbol.
    const size_t first = has_symbol && options_.columns.empty() ? 1 : 0;
    std::array<double, kMaxDimension> point;
    bool is_invalid = false;
    for (size_t i = 0; i < columns_.size(); ++i) {
      const size_t at = first + columns_[i];
      if (at >= fields_.size()) {
        return reader_.Error(absl::StrCat("expected ", columns_.size(), " coordinates, got ",
                                          fields_.size() - std::min(first, fields_.size())));
      }
      if (absl::Status status = TakeCoordinate(fields_[at], options_.skip_invalid, point[i], is_invalid);
          !status.ok()) {
        return reader_.Error(absl::StrCat("field ", at + 1, ": ", status.message()));
      }
    }
    AddPoint({point.data(), columns_.size()}, is_invalid, reader_.line_number(), cloud_);
    return absl::OkStatus();
  }

  LineReader& reader_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  std::vector<size_t> columns_;  // of the fields after the symbol, or of all if the user gave them
  std::vector<std::string> fields_;
  std::vector<std::string> comment_fields_;
};

absl::Status ReadTable(LineReader& reader, const CloudOptions& options, Unnamed unnamed, PointCloud& cloud,
                       std::string_view line) {
  TableReader table(reader, options, unnamed, cloud);
  do {
    WELLSPACE_RETURN_IF_ERROR(table.ReadLine(line));
  } while (reader.NextContent(line));
  return table.CheckCount();
}

}  // namespace

absl::Status ReadCsv(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  std::string_view line;
  return reader.NextContent(line) ? ReadTable(reader, options, Unnamed::kAll, cloud, line) : reader.status();
}

absl::Status ReadAsc(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  std::string_view line;
  return reader.NextContent(line) ? ReadTable(reader, options, Unnamed::kFirstThree, cloud, line) : reader.status();
}

absl::Status ReadXyz(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  std::string_view line;
  if (!reader.NextContent(line)) {
    return reader.status();
  }
  uint64_t count = 0;
  return ParseUnsigned(line, UINT64_MAX, count) ? MoleculeReader(reader, options, cloud).Read(count)
                                                : ReadTable(reader, options, Unnamed::kFirstThree, cloud, line);
}

absl::Status ReadPts(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  TableReader table(reader, options, Unnamed::kFirstThree, cloud);
  for (std::string_view line; reader.NextContent(line);) {
    if (uint64_t count = 0; table.may_take_count() && ParseUnsigned(line, kMaxCount, count)) {
      WELLSPACE_RETURN_IF_ERROR(table.CheckCount());
      table.TakeCount(line);
      continue;
    }
    if (table.is_complete()) {
      return reader.Error(
          absl::StrCat("expected the number of points that follow, or the end of the file, got ", Quote(line)));
    }
    WELLSPACE_RETURN_IF_ERROR(table.ReadLine(line));
  }
  return table.CheckCount();
}

}  // namespace wellspace::formats
