// STL, in ascii and in binary: the corners of its triangles.
#include <string>
#include <unordered_set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/point_rows.h"
#include "client/formats/stl_parts.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Adds each corner whose place no other has had.
absl::Status AddCorners(StlParts& parts, PointRows& rows, PointCloud& cloud) {
  std::unordered_set<StlPoint, StlHash> seen;
  while (true) {
    WELLSPACE_ASSIGN_OR_RETURN(const StlParts::Part part, parts.Next());
    if (part == StlParts::Part::kEnd) {
      NoteFaces(parts.facets(), cloud);
      return absl::OkStatus();
    }
    if (part != StlParts::Part::kVertex || !seen.insert(parts.point()).second) {  // NaN is equal to nothing
      continue;
    }
    const absl::StatusOr<bool> is_added = rows.Add(parts.point());
    if (!is_added.ok()) {
      return parts.is_text() ? is_added.status() : parts.Error(std::string(is_added.status().message()));
    }
    if (*is_added && parts.is_text()) {
      cloud.lines.Add(parts.line_number());
    } else if (*is_added) {
      cloud.rows.Add(parts.vertex());
    }
  }
}

}  // namespace

absl::Status ReadStl(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  WELLSPACE_ASSIGN_OR_RETURN(const bool is_text, IsStlText(file));
  absl::StatusOr<PointRows> rows = PointRows::Create({"x", "y", "z"}, options, cloud);
  if (!rows.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(cloud.name, ": ", rows.status().message()));
  }
  LineReader reader(std::move(file));
  StlParts parts(reader, is_text, options.skip_invalid ? InvalidValue::kSkip : InvalidValue::kTell);
  WELLSPACE_RETURN_IF_ERROR(AddCorners(parts, *rows, cloud));
  return reader.Finish();
}

}  // namespace wellspace::formats
