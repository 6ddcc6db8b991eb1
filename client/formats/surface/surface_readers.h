// The readers behind ReadSurface, one for each format. Each fills a Surface but for its name and its format.
// Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_READERS_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_READERS_H_

#include <string>

#include "absl/status/status.h"
#include "client/formats/io/input_file.h"
#include "client/formats/surface/surface.h"

namespace wellspace::formats {

absl::Status ReadStlSurface(InputFile& file, Surface& surface);
absl::Status ReadObjSurface(InputFile& file, Surface& surface);
absl::Status ReadPlySurface(InputFile& file, Surface& surface);
absl::Status ReadOffSurface(InputFile& file, Surface& surface);
// `path` leads to the .node beside the file.
absl::Status ReadSmesh(InputFile& file, const std::string& path, Surface& surface);
absl::Status ReadPolySurface(InputFile& file, const std::string& path, Surface& surface);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_READERS_H_
