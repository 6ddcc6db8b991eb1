#include "client/formats/surface/read_surface.h"

#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/open_input.h"
#include "client/formats/registry.h"
#include "client/formats/surface/surface_readers.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

using SurfaceReader = absl::Status (*)(InputFile&, const std::string& path, Surface&);

// A reader that looks at no other file.
template <absl::Status (*kReader)(InputFile&, Surface&)>
absl::Status ReadAlone(InputFile& file, const std::string& /*path*/, Surface& surface) {
  return kReader(file, surface);
}

std::span<const Format<SurfaceReader>> Readers() {
  static const std::vector<Format<SurfaceReader>> readers = {
      {"stl", {".stl"}, ReadAlone<ReadStlSurface>},
      {"obj", {".obj"}, ReadAlone<ReadObjSurface>},
      {"ply", {".ply"}, ReadAlone<ReadPlySurface>},
      {"off", {".off"}, ReadAlone<ReadOffSurface>},
      {"smesh", {".smesh"}, ReadSmesh},
      {"poly", {".poly"}, ReadPolySurface},
  };
  return readers;
}

// Whether the header of points at the start of a file says that they are in 3-D.
bool IsInSpace(const std::string& path) {
  absl::StatusOr<InputFile> file = OpenInflated(path);
  if (!file.ok()) {
    return false;
  }
  LineReader reader(*std::move(file));
  NodeHeader header;
  return ReadNodeHeader(reader, header).ok() && header.dimension == 3;
}

}  // namespace

std::vector<std::string> SurfaceFormats() { return FormatNames(Readers()); }

bool IsSurfacePath(const std::string& path) {
  const std::string extension = ExtensionOf(WithoutGzip(path));
  return extension == ".stl" || extension == ".smesh" || (extension == ".poly" && IsInSpace(path));
}

absl::StatusOr<Surface> ReadSurface(const std::string& path, const std::string& format) {
  if (path == kStandardStream && format.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("<stdin>: expected to be told the format: one of ", absl::StrJoin(SurfaceFormats(), ", ")));
  }
  const auto row = FindInputFormat(Readers(), path, format);
  if (!row.ok()) {
    return row.status();
  }
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  Surface surface;
  surface.name = file.name();
  surface.places.front().file = surface.name;
  surface.format = (*row)->name;
  WELLSPACE_RETURN_IF_ERROR((*row)->handler(file, path, surface));
  if (surface.corners.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(surface.name, ": no triangles; expected at least one"));
  }
  return surface;
}

}  // namespace wellspace::formats
