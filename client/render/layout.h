// The layout of a picture: the places of its parts. Private to this folder.
#ifndef WELLSPACE_CLIENT_RENDER_LAYOUT_H_
#define WELLSPACE_CLIENT_RENDER_LAYOUT_H_

#include "client/render/scene.h"

namespace wellspace::render {

// In pixels of the picture; y downwards.
struct Layout {
  double X(const PicturePoint& point) const { return left + point[0] * scale; }
  double Y(const PicturePoint& point) const { return bottom - point[1] * scale; }

  double width;
  double height;
  double margin;
  double font_size;
  double scale;  // pixels for a unit of the scene
  double left;   // of the scene
  double top;
  double bottom;
  double legend_left;
  double legend_top;
  double legend_width;
  double legend_height;
};

// REQUIRES:   `width` is that of a picture, see WritePicture.
Layout MakeLayout(const Scene& scene, int width);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_LAYOUT_H_
