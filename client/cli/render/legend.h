// What the colours of a picture mean, written beside it. Private to this folder.
#ifndef WELLSPACE_CLIENT_CLI_RENDER_LEGEND_H_
#define WELLSPACE_CLIENT_CLI_RENDER_LEGEND_H_

#include <cairo.h>

#include "client/cli/render/layout.h"
#include "client/cli/render/scene.h"

namespace wellspace::render {

// A ramp of angles, or the names of the regions: as many as there is room for.
void PaintLegend(cairo_t* cairo, const Scene& scene, const Layout& layout);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_CLI_RENDER_LEGEND_H_
