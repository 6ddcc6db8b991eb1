#include "client/render/layout.h"

#include <algorithm>
#include <cmath>

namespace wellspace::render {

Layout MakeLayout(const Scene& scene, int width) {
  Layout layout;
  layout.width = width;
  layout.margin = std::round(0.02 * width);
  layout.font_size = std::clamp(width / 75.0, 8.0, 40.0);
  const double legend_space = 5.8 * layout.font_size;
  const double room = width - 3 * layout.margin - legend_space;
  const double tallest = 2.0 * width;
  layout.scale = scene.width > 0 ? room / scene.width : tallest / scene.height;
  layout.scale = std::min(layout.scale, scene.height > 0 ? tallest / scene.height : layout.scale);
  const double scene_height = scene.height * layout.scale;
  const double least_height = 16 * layout.font_size;
  layout.height = std::round(std::max(scene_height, least_height) + 2 * layout.margin);
  layout.left = layout.margin + (room - scene.width * layout.scale) / 2;
  layout.top = (layout.height - scene_height) / 2;
  layout.bottom = layout.top + scene_height;
  layout.legend_left = width - layout.margin - legend_space;
  layout.legend_width = 1.4 * layout.font_size;
  layout.legend_height = std::min(0.6 * layout.height, layout.height - 2 * layout.margin - 4 * layout.font_size);
  layout.legend_top = (layout.height - layout.legend_height) / 2 + 1.5 * layout.font_size;
  return layout;
}

}  // namespace wellspace::render
