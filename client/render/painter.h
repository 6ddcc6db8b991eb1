// Pictures of scenes, by Cairo.
#ifndef WELLSPACE_CLIENT_RENDER_PAINTER_H_
#define WELLSPACE_CLIENT_RENDER_PAINTER_H_

#include <string>

#include "absl/status/status.h"
#include "client/render/picture_format.h"
#include "client/render/scene.h"

namespace wellspace::render {

inline constexpr int kMinWidth = 160;
inline constexpr int kMaxWidth = 8192;

// Paints `scene`, coloured by angle, with a legend, on white, `width` pixels wide and as high as the scene wants, to
// twice its width at most. "-" is not a picture's path.
//
// REQUIRES:   kMinWidth <= width <= kMaxWidth; the scene's width or height > 0.
// Errors:     of writing; nothing is left half written.
absl::Status WritePicture(const Scene& scene, int width, PictureFormat format, const std::string& path);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_PAINTER_H_
