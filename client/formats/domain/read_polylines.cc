// Polylines as a table: a point a line.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/domain/polyline.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/table_columns.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kNone = static_cast<size_t>(-1);
constexpr size_t kAxes = 2;

// Names of the column that tells polylines apart; the first that a table has is taken.
constexpr std::array<std::string_view, 9> kIdNames = {"polyline", "line",    "ring", "path", "part",
                                                      "shape",    "feature", "id",   "fid"};

class PolylineReader {
 public:
  PolylineReader(InputFile& file, const DomainOptions& options, PlanarDomain& domain)
      : reader_(std::move(file)), options_(options), domain_(domain) {}

  absl::Status Read();

 private:
  bool Next(std::string_view& line, bool& is_break);
  absl::Status ReadRow(std::string_view line);
  // Decides with the first line which columns there are; `is_header` if it names them.
  absl::Status Begin(std::string_view line, bool& is_header);
  absl::Status ChooseCoordinates(size_t count);
  absl::Status ChooseId(size_t count);
  void NoteColumns(size_t count);
  absl::Status TakeId(std::string_view id);
  absl::Status EndPolyline();
  std::string_view Row(std::string_view line) const { return separator_ == '\t' ? whole_line_ : line; }

  LineReader reader_;
  std::string_view whole_line_;  // the last one, with the blanks around it
  const DomainOptions& options_;
  PlanarDomain& domain_;
  char separator_ = '\0';  // not known yet
  std::vector<std::string> names_;
  uint64_t first_line_ = 0;      // with content
  size_t field_count_ = 0;       // of that line
  std::vector<size_t> columns_;  // of x and y
  size_t id_column_ = kNone;
  std::string id_;                                      // of the polyline that is read
  std::unordered_map<std::string, uint64_t> id_lines_;  // where each one began
  std::vector<double> positions_;                       // of the polyline
  LineIndex lines_;
};

// The next line that has content or ends a polyline.
bool PolylineReader::Next(std::string_view& line, bool& is_break) {
  while (reader_.Next(line)) {
    const size_t comment = CommentStart(line);
    whole_line_ = line.substr(0, comment);
    line = TrimBlanks(whole_line_);
    is_break = (line.empty() && comment == std::string_view::npos) || (!line.empty() && line[0] == '>');
    if (is_break || !line.empty()) {
      return true;
    }
  }
  return false;
}

absl::Status PolylineReader::Read() {
  bool is_break = false;
  for (std::string_view line; Next(line, is_break);) {
    absl::Status status;
    if (is_break) {
      status = id_column_ == kNone ? EndPolyline() : absl::OkStatus();
    } else if (bool is_header = false; columns_.empty()) {
      status = Begin(line, is_header);
      if (status.ok() && !is_header) {
        status = ReadRow(line);
      }
    } else {
      status = ReadRow(line);
    }
    if (!status.ok()) {
      return status;
    }
  }
  if (!reader_.status().ok()) {
    return reader_.status();
  }
  WELLSPACE_RETURN_IF_ERROR(EndPolyline());
  domain_.markers.resize(domain_.segment_count());
  return reader_.Finish();
}

absl::Status PolylineReader::Begin(std::string_view line, bool& is_header) {
  separator_ = SeparatorOf(line);
  const std::vector<std::string> fields = FieldsOf(Row(line), separator_);
  const auto may_be_name = [](const std::string& field) { return field.empty() || IsColumnName(field); };
  is_header = std::all_of(fields.begin(), fields.end(), may_be_name) || !FindCoordinates(fields).columns.empty();
  first_line_ = reader_.line_number();
  field_count_ = fields.size();
  if (is_header) {
    names_ = fields;
  }
  WELLSPACE_RETURN_IF_ERROR(ChooseCoordinates(fields.size()));
  WELLSPACE_RETURN_IF_ERROR(ChooseId(fields.size()));
  NoteColumns(fields.size());
  return absl::OkStatus();
}

absl::Status PolylineReader::ChooseCoordinates(size_t count) {
  if (!options_.columns.empty()) {
    absl::StatusOr<std::vector<size_t>> columns = ResolveColumns(options_.columns, names_, count, kAxes);
    if (!columns.ok()) {
      return reader_.Error(std::string(columns.status().message()));
    }
    columns_ = *std::move(columns);
    return absl::OkStatus();
  }
  columns_ = FindCoordinates(names_).columns;
  columns_.resize(std::min(columns_.size(), kAxes));
  if (columns_.empty() && count == kAxes) {
    columns_ = {0, 1};
  }
  if (columns_.empty()) {
    return reader_.Error(absl::StrCat(
        "expected two columns, or a header with names such as x, y and id, or --columns with names or numbers, got ",
        count, count == 1 ? " column" : " columns", names_.empty() ? " without names" : " without such names"));
  }
  return absl::OkStatus();
}

absl::Status PolylineReader::ChooseId(size_t count) {
  if (!options_.id_column.empty()) {
    const absl::StatusOr<size_t> column = ResolveColumn("--id-column", options_.id_column, names_, count);
    if (!column.ok()) {
      return reader_.Error(std::string(column.status().message()));
    }
    id_column_ = *column;
  } else {
    for (const std::string_view wanted : kIdNames) {
      const auto at = std::find_if(names_.begin(), names_.end(), [wanted](const std::string& name) {
        return absl::AsciiStrToLower(name) == std::string(wanted);
      });
      if (at != names_.end()) {
        id_column_ = at - names_.begin();
        break;
      }
    }
  }
  if (std::find(columns_.begin(), columns_.end(), id_column_) != columns_.end()) {
    return reader_.Error(
        absl::StrCat("column ", id_column_ + 1, " is taken for a coordinate; expected another one for --id-column"));
  }
  return absl::OkStatus();
}

void PolylineReader::NoteColumns(size_t count) {
  std::vector<size_t> left;
  for (size_t column = 0; column < count; ++column) {
    if (column != id_column_ && std::find(columns_.begin(), columns_.end(), column) == columns_.end()) {
      left.push_back(column);
    }
  }
  if (!left.empty()) {
    domain_.notes.push_back(
        absl::StrCat(domain_.name, ": ", ColumnsText(left, names_), left.size() == 1 ? " is" : " are", " not used"));
  }
}

absl::Status PolylineReader::ReadRow(std::string_view line) {
  FieldSplitter fields(Row(line), separator_);
  std::array<double, kAxes> point{};
  std::array<bool, kAxes> has{};
  bool has_id = id_column_ == kNone;
  size_t column = 0;
  for (std::string_view field; fields.Next(field); ++column) {
    if (column == id_column_) {
      has_id = true;
      WELLSPACE_RETURN_IF_ERROR(TakeId(field));
    }
    for (size_t axis = 0; axis < kAxes; ++axis) {
      if (column != columns_[axis]) {
        continue;
      }
      has[axis] = true;
      if (absl::Status status = TakeFinite(field, point[axis]); !status.ok()) {
        return reader_.Error(absl::StrCat("field ", column + 1, ": ", status.message()));
      }
    }
  }
  if (!has[0] || !has[1] || !has_id) {
    return reader_.Error(absl::StrCat("expected ",
                                      std::max({columns_[0], columns_[1], id_column_ == kNone ? 0 : id_column_}) + 1,
                                      " fields, got ", column));
  }
  if (column > field_count_) {
    return reader_.Error(
        absl::StrCat("expected ", field_count_, " fields, as line ", first_line_, " has, got ", column));
  }
  positions_.insert(positions_.end(), point.begin(), point.end());
  lines_.Add(reader_.line_number());
  return absl::OkStatus();
}

// Begins another polyline if the id is another one.
absl::Status PolylineReader::TakeId(std::string_view id) {
  if (!positions_.empty() && id == id_) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(EndPolyline());
  id_ = id;
  const auto [at, is_new] = id_lines_.try_emplace(id_, reader_.line_number());
  if (!is_new) {
    return reader_.Error(absl::StrCat("polyline ", Quote(id), " began in line ", at->second,
                                      " and has ended; expected the points of each polyline one after the other"));
  }
  return absl::OkStatus();
}

absl::Status PolylineReader::EndPolyline() {
  if (positions_.empty()) {
    return absl::OkStatus();
  }
  const absl::Status status = AddPolyline(positions_, &lines_, /*is_ring=*/false, domain_);
  positions_.clear();
  lines_ = {};
  return status.ok() ? status : reader_.Error(std::string(status.message()));
}

}  // namespace

absl::Status ReadPolylines(InputFile& file, const DomainOptions& options, PlanarDomain& domain) {
  return PolylineReader(file, options, domain).Read();
}

}  // namespace wellspace::formats
