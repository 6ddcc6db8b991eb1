// Wavefront's OBJ: the vertices.
#include <algorithm>
#include <array>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/number.h"
#include "client/formats/obj_lines.h"

namespace wellspace::formats {
namespace {

constexpr int kObjAxes = 3;

}  // namespace

absl::Status ReadObj(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  ObjLines lines(reader);
  FieldSplitter fields("", ' ');
  std::string_view word;
  uint64_t number = 0;
  uint64_t faces = 0;
  const auto error = [&](std::string_view message) { return LineError(cloud.name, number, message); };
  while (lines.NextWord(word, fields, number)) {
    if (word != "v") {
      faces += word == "f" ? 1 : 0;
      continue;
    }
    std::array<double, kObjAxes> point{};
    bool is_invalid = false;
    int count = 0;
    std::string_view field;
    while (count < kObjAxes && fields.Next(field)) {
      if (absl::Status status = TakeCoordinate(field, options.skip_invalid, point[count], is_invalid); !status.ok()) {
        return error(absl::StrCat("coordinate ", count + 1, ": ", status.message()));
      }
      ++count;
    }
    const int expected = cloud.dimension != 0 ? cloud.dimension : options.dimension;
    if (count < kMinDimension || (expected != 0 && count != expected)) {
      return error(expected != 0 ? DimensionError(expected, count)
                                 : absl::StrCat("expected 2 or 3 coordinates, got ", count));
    }
    cloud.dimension = count;
    AddPoint({point.data(), static_cast<size_t>(count)}, is_invalid, number, cloud);
  }
  NoteFaces(faces, cloud);
  return lines.status();
}

}  // namespace wellspace::formats
