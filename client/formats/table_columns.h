// Rows of a table, and which of its columns hold coordinates.
#ifndef WELLSPACE_CLIENT_FORMATS_TABLE_COLUMNS_H_
#define WELLSPACE_CLIENT_FORMATS_TABLE_COLUMNS_H_

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace wellspace::formats {

// All fields of a row; see FieldSplitter.
std::vector<std::string> FieldsOf(std::string_view line, char separator);

// The separator of the fields of a row: ';' before ',' before a tab beside commas, which are in numbers then, before
// blanks.
char SeparatorOf(std::string_view line);

// The meaning of the names of columns.
struct NamedColumns {
  std::vector<size_t>
      columns;          // that hold x, y and, if it is there, z, counted from 0; empty if the names do not say it
  std::string problem;  // why not every column can be taken for a coordinate either; may be empty
};

// Finds names such as x y z, lon lat altitude, easting northing, POINT_X, Points:0, "X [m]", in any case.
NamedColumns FindCoordinates(const std::vector<std::string>& names);

// The column that `wanted` gives by name, in any case, or by number from 1, counted from 0. `names` is empty where
// columns have none.
//
// Errors:     INVALID_ARGUMENT "OPTION: …" if there is no such column, or more than one.
absl::StatusOr<size_t> ResolveColumn(std::string_view option, const std::string& wanted,
                                     const std::vector<std::string>& names, size_t count);

// The columns that `wanted` gives by name, in any case, or by number from 1, counted from 0; see ResolveColumn.
//
// Errors:     INVALID_ARGUMENT "--columns …": unless they are 2 to 6, and `dimension` if that is not 0, different, and
//             there.
absl::StatusOr<std::vector<size_t>> ResolveColumns(const std::vector<std::string>& wanted,
                                                   const std::vector<std::string>& names, size_t count, int dimension);

// "columns 2 (lon) and 3 (lat)", of columns counted from 0.
std::string ColumnsText(const std::vector<size_t>& columns, const std::vector<std::string>& names);

// "--columns 1,2": the first `count` of `columns`, for a message.
std::string ColumnsOption(const std::vector<size_t>& columns, size_t count);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_TABLE_COLUMNS_H_
