// The formats of pictures.
#ifndef WELLSPACE_CLIENT_RENDER_PICTURE_FORMAT_H_
#define WELLSPACE_CLIENT_RENDER_PICTURE_FORMAT_H_

#include <string>

#include "absl/status/statusor.h"

namespace wellspace::render {

enum class PictureFormat { kPng, kSvg, kPdf };

// PNG, SVG or PDF, by the extension of `path`. Errors: INVALID_ARGUMENT for any other one.
absl::StatusOr<PictureFormat> PictureFormatOf(const std::string& path);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_PICTURE_FORMAT_H_
