// The meaning of the colours of a picture, written beside it. Private to this folder.
#ifndef WELLSPACE_CLIENT_RENDER_LEGEND_H_
#define WELLSPACE_CLIENT_RENDER_LEGEND_H_

#include "client/render/cairo_library.h"
#include "client/render/layout.h"
#include "client/render/scene.h"

namespace wellspace::render {

// A ramp of angles, or the names of the regions or parts: as many as there is room for.
void PaintLegend(cairo_t* cairo, const Scene& scene, const Layout& layout);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_LEGEND_H_
