// Wavefront's OBJ: vertices and faces, and the names of groups and objects.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/obj_lines.h"
#include "client/formats/surface/surface_builder.h"
#include "client/formats/surface/surface_readers.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class ObjSurfaceReader {
 public:
  explicit ObjSurfaceReader(Surface& surface) : surface_(surface), builder_(surface) {}

  absl::Status Read(LineReader& reader) {
    ObjLines lines(reader);
    FieldSplitter fields("", ' ');
    for (std::string_view word; lines.NextWord(word, fields, line_);) {
      absl::Status status;
      if (word == "v") {
        status = ReadVertex(fields);
      } else if (word == "f") {
        status = ReadFace(fields);
      } else if (word == "g" || word == "o") {
        ReadName(fields, word == "g" ? group_ : object_);
      }
      if (!status.ok()) {
        return LineError(surface_.name, line_, std::string(status.message()));
      }
    }
    WELLSPACE_RETURN_IF_ERROR(lines.status());
    return reader.Finish();
  }

 private:
  absl::Status ReadVertex(FieldSplitter& fields) {
    constexpr size_t kAxes = 3;
    std::array<double, kAxes> point{};
    for (size_t axis = 0; axis < kAxes; ++axis) {
      std::string_view field;
      if (!fields.Next(field)) {
        return absl::InvalidArgumentError(absl::StrCat("expected 3 coordinates, got ", axis));
      }
      if (absl::Status status = TakeFinite(field, point[axis]); !status.ok()) {
        return absl::InvalidArgumentError(absl::StrCat("coordinate ", axis + 1, ": ", status.message()));
      }
    }
    if (surface_.point_count() == kMaxCount) {
      return absl::InvalidArgumentError(absl::StrCat("expected at most ", kMaxCount, " vertices, got more"));
    }
    surface_.points.insert(surface_.points.end(), point.begin(), point.end());
    return absl::OkStatus();
  }

  absl::Status ReadFace(FieldSplitter& fields) {
    corners_.clear();
    for (std::string_view field; fields.Next(field);) {
      WELLSPACE_RETURN_IF_ERROR(TakeObjVertex(field, surface_.point_count(), "face", corners_.emplace_back()));
    }
    return builder_.AddPolygon(corners_, builder_.MarkerOf(group_.empty() ? object_ : group_), line_);
  }

  // All names of a group are one.
  static void ReadName(FieldSplitter& fields, std::string& name) {
    name.clear();
    for (std::string_view field; fields.Next(field);) {
      absl::StrAppend(&name, name.empty() ? "" : " ", std::string(field));
    }
  }

  Surface& surface_;
  SurfaceBuilder builder_;
  uint64_t line_ = 0;  // the one that is read
  std::string group_;
  std::string object_;
  std::vector<uint32_t> corners_;
};

}  // namespace

absl::Status ReadObjSurface(InputFile& file, Surface& surface) {
  LineReader reader(std::move(file));
  return ObjSurfaceReader(surface).Read(reader);
}

}  // namespace wellspace::formats
