// CSV and XYZ: one point a line.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/number.h"

namespace wellspace::formats {
namespace {

// Which coordinate a field holds.
constexpr int kSkipped = -1;

// Reads rows of one table into a cloud.
class TableReader {
 public:
  TableReader(LineReader& reader, int dimension, PointCloud& cloud)
      : reader_(reader), wanted_dimension_(dimension), cloud_(cloud) {}

  void set_separator(char separator) { separator_ = separator; }
  // Columns after the third are skipped, or after as many as the cloud must have if these are more.
  void SkipColumnsAfterThird() { columns_ = std::max(3, wanted_dimension_); }

  bool IsHeader(std::string_view line) const {
    FieldSplitter fields(line, separator_);
    std::string_view field;
    while (fields.Next(field)) {
      if (IsNumber(field)) {
        return false;
      }
    }
    return true;
  }

  // Takes the columns called x, y and z when there are an x and a y, unless more dimensions are wanted than have such
  // names; otherwise all of them.
  void UseHeader(std::string_view line) {
    constexpr int kNames = 3;
    std::vector<int> coordinates;
    std::array<bool, kNames> seen{};
    FieldSplitter fields(line, separator_);
    std::string_view field;
    while (fields.Next(field)) {
      const char name = field.size() == 1 ? absl::ascii_tolower(field[0]) : '\0';
      const bool is_coordinate = name >= 'x' && name <= 'z' && !seen[name - 'x'];
      coordinates.push_back(is_coordinate ? name - 'x' : kSkipped);
      if (is_coordinate) {
        seen[name - 'x'] = true;
      }
    }
    if (seen[0] && seen[1] && wanted_dimension_ <= kNames) {
      coordinate_of_field_ = std::move(coordinates);
      named_dimension_ = seen[2] ? 3 : 2;
    }
  }

  absl::Status ReadRow(std::string_view line) {
    std::array<double, kMaxDimension> point{};
    int count = 0;
    FieldSplitter fields(line, separator_);
    std::string_view field;
    for (size_t index = 0; fields.Next(field); ++index) {
      const int coordinate = CoordinateOf(index);
      if (coordinate == kSkipped) {
        continue;
      }
      ++count;
      if (coordinate < kMaxDimension) {
        if (absl::Status status = ParseFinite(field, point[coordinate]); !status.ok()) {
          return reader_.Error(absl::StrCat("field ", index + 1, ": ", status.message()));
        }
      }
    }
    if (cloud_.dimension == 0) {
      if (absl::Status status = SetDimension(named_dimension_ != 0 ? named_dimension_ : count); !status.ok()) {
        return status;
      }
    }
    if (count != cloud_.dimension) {
      return reader_.Error(absl::StrCat("expected ", cloud_.dimension, " coordinates, got ", count));
    }
    cloud_.points.insert(cloud_.points.end(), point.begin(), point.begin() + count);
    cloud_.lines.Add(reader_.line_number());
    return absl::OkStatus();
  }

 private:
  int CoordinateOf(size_t field) const {
    if (coordinate_of_field_.empty()) {
      return field >= columns_ ? kSkipped : static_cast<int>(field);
    }
    return field < coordinate_of_field_.size() ? coordinate_of_field_[field] : kSkipped;
  }

  absl::Status SetDimension(int count) {
    if (wanted_dimension_ != 0 && count != wanted_dimension_) {
      return reader_.Error(absl::StrCat("expected ", wanted_dimension_, " coordinates, got ", count));
    }
    if (count < kMinDimension || count > kMaxDimension) {
      return reader_.Error(absl::StrCat(
          "expected ", kMinDimension, " to ", kMaxDimension, " coordinates, got ", count,
          separator_ == ' ' ? "" : absl::StrCat(" (fields are separated by \"", std::string(1, separator_), "\")")));
    }
    cloud_.dimension = count;
    return absl::OkStatus();
  }

  LineReader& reader_;
  const int wanted_dimension_;
  PointCloud& cloud_;
  char separator_ = ' ';
  size_t columns_ = std::numeric_limits<int>::max();  // that are read, when no header names them
  std::vector<int> coordinate_of_field_;              // empty: field i holds coordinate i
  int named_dimension_ = 0;                           // coordinates that the header names; 0: none
};

char SeparatorOf(std::string_view line) {
  for (const char separator : {';', ','}) {
    if (line.find(separator) != std::string_view::npos) {
      return separator;
    }
  }
  return ' ';
}

// The rest of an XYZ file as in chemistry, whose first line said `count`.
absl::Status ReadMolecule(LineReader& reader, uint64_t count, TableReader& table, PointCloud& cloud) {
  const uint64_t count_line = reader.line_number();
  std::string_view line;
  reader.Next(line);  // a comment, whatever it says
  while (reader.NextContent(line)) {
    if (cloud.size() == count) {
      return reader.Error(absl::StrCat("expected the end of the file after ", count, " points, as line ", count_line,
                                       " says, got ", Quote(line)));
    }
    std::string_view symbol;
    FieldSplitter(line, ' ').Next(symbol);
    if (!IsNumber(symbol)) {
      line.remove_prefix(symbol.size());
    }
    if (absl::Status status = table.ReadRow(line); !status.ok()) {
      return status;
    }
  }
  if (reader.status().ok() && cloud.size() != count) {
    return reader.Error(absl::StrCat("expected ", count, " points, as line ", count_line, " says, got ", cloud.size()));
  }
  return reader.status();
}

}  // namespace

absl::Status ReadCsv(LineReader& reader, int dimension, PointCloud& cloud) {
  TableReader table(reader, dimension, cloud);
  std::string_view line;
  bool first = true;
  while (reader.NextContent(line)) {
    if (first) {
      first = false;
      table.set_separator(SeparatorOf(line));
      if (table.IsHeader(line)) {
        table.UseHeader(line);
        continue;
      }
    }
    if (absl::Status status = table.ReadRow(line); !status.ok()) {
      return status;
    }
  }
  return reader.status();
}

absl::Status ReadXyz(LineReader& reader, int dimension, PointCloud& cloud) {
  TableReader table(reader, dimension, cloud);
  table.SkipColumnsAfterThird();
  std::string_view line;
  bool first = true;
  while (reader.NextContent(line)) {
    uint64_t count = 0;
    if (first && ParseUnsigned(line, UINT64_MAX, count)) {
      return ReadMolecule(reader, count, table, cloud);
    }
    first = false;
    if (absl::Status status = table.ReadRow(line); !status.ok()) {
      return status;
    }
  }
  return reader.status();
}

}  // namespace wellspace::formats
