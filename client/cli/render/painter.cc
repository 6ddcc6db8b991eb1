#include "client/cli/render/painter.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/render/canvas.h"
#include "client/cli/render/colour_ramp.h"
#include "client/formats/output_file.h"
#include "core/base/status_macros.h"

namespace wellspace::render {
namespace {

using formats::OutputFile;

// PNG is painted larger by this and averaged: neighbours then meet without the light seams of antialiased edges.
constexpr int kSupersampling = 2;

// Where things are, in pixels of the picture; y downwards.
struct Layout {
  double width;
  double height;
  double margin;
  double font_size;
  double scale;  // pixels for a unit of the scene
  double left;   // of the scene
  double top;
  double legend_left;
  double legend_top;
  double legend_width;
  double legend_height;
};

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
  layout.legend_left = width - layout.margin - legend_space;
  layout.legend_width = 1.4 * layout.font_size;
  layout.legend_height = std::min(0.6 * layout.height, layout.height - 2 * layout.margin - 4 * layout.font_size);
  layout.legend_top = (layout.height - layout.legend_height) / 2 + 1.5 * layout.font_size;
  return layout;
}

// Fills the triangles and draws their edges, which fade as the triangles get too small to show them.
void PaintFacets(cairo_t* cairo, const Scene& scene, const Layout& layout, bool stroke_small) {
  constexpr double kInvisible = 1.2;  // pixels that a triangle is high
  constexpr double kClear = 9;
  constexpr double kLineWidth = 0.7;
  cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_width(cairo, kLineWidth);
  for (const Facet& facet : scene.facets) {
    double x[3];
    double y[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = layout.left + facet.corners[i][0] * layout.scale;
      y[i] = layout.top + (scene.height - facet.corners[i][1]) * layout.scale;
    }
    double longest = 0;
    for (int i = 0; i < 3; ++i) {
      longest = std::max(longest, std::hypot(x[i] - x[(i + 1) % 3], y[i] - y[(i + 1) % 3]));
    }
    const double twice_area = std::abs((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]));
    const double height = longest > 0 ? twice_area / longest : 0;
    const Colour colour = Shaded(RampColour(facet.angle_deg / scene.best_angle_deg), facet.shade);
    cairo_move_to(cairo, x[0], y[0]);
    cairo_line_to(cairo, x[1], y[1]);
    cairo_line_to(cairo, x[2], y[2]);
    cairo_close_path(cairo);
    SetColour(cairo, colour);
    const bool edges_show = longest > kClear && height > kInvisible;
    if (!edges_show && !stroke_small) {
      cairo_fill(cairo);
      continue;
    }
    cairo_fill_preserve(cairo);
    if (edges_show) {
      const double strength = std::clamp((height - kInvisible) / (kClear - kInvisible), 0.0, 1.0);
      SetColour(cairo, Shaded(colour, 0.35), 0.15 + 0.55 * strength);
    }
    cairo_stroke(cairo);
  }
}

void PaintLegend(cairo_t* cairo, const Scene& scene, const Layout& layout) {
  const double bottom = layout.legend_top + layout.legend_height;
  constexpr int kSteps = 128;
  cairo_set_antialias(cairo, CAIRO_ANTIALIAS_NONE);
  for (int step = 0; step < kSteps; ++step) {
    const double from = bottom - layout.legend_height * (step + 1) / kSteps;
    SetColour(cairo, RampColour((step + 0.5) / kSteps));
    // A pixel more, under the next step, so that no seam is left.
    cairo_rectangle(cairo, layout.legend_left, from, layout.legend_width, layout.legend_height / kSteps + 1);
    cairo_fill(cairo);
  }
  cairo_set_antialias(cairo, CAIRO_ANTIALIAS_DEFAULT);
  const Colour ink = {0.15, 0.15, 0.18};
  SetColour(cairo, ink);
  cairo_set_line_width(cairo, 1);
  cairo_rectangle(cairo, layout.legend_left, layout.legend_top, layout.legend_width, layout.legend_height);
  cairo_stroke(cairo);

  cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo, layout.font_size);
  const double right = layout.legend_left + layout.legend_width;
  const double tick = 0.35 * layout.font_size;
  constexpr int kDegreesPerTick = 10;
  for (int degrees = 0; degrees <= scene.best_angle_deg; degrees += kDegreesPerTick) {
    const double y = bottom - layout.legend_height * degrees / scene.best_angle_deg;
    cairo_move_to(cairo, right, y);
    cairo_line_to(cairo, right + tick, y);
    cairo_stroke(cairo);
    PaintText(cairo, right + 2 * tick, y, absl::StrCat(degrees, "\u00b0"));
  }
  // One word a line, above the bar.
  const std::vector<std::string> words = [&scene] {
    std::vector<std::string> lines(1);
    for (const char c : scene.legend) {
      if (c == ' ') {
        lines.emplace_back();
      } else {
        lines.back() += c;
      }
    }
    return lines;
  }();
  for (size_t line = 0; line < words.size(); ++line) {
    const double above = 1.2 * layout.font_size * static_cast<double>(words.size() - line);
    PaintText(cairo, layout.legend_left, layout.legend_top - above, words[line]);
  }
}

// Averages squares of kSupersampling x kSupersampling pixels. Both images are CAIRO_FORMAT_RGB24.
void Average(cairo_surface_t* large, cairo_surface_t* small) {
  cairo_surface_flush(large);
  cairo_surface_flush(small);
  const uint8_t* from = cairo_image_surface_get_data(large);
  uint8_t* to = cairo_image_surface_get_data(small);
  const int from_stride = cairo_image_surface_get_stride(large);
  const int to_stride = cairo_image_surface_get_stride(small);
  constexpr int kChannels = 4;
  for (int y = 0; y < cairo_image_surface_get_height(small); ++y) {
    for (int x = 0; x < cairo_image_surface_get_width(small) * kChannels; ++x) {
      int sum = 0;
      for (int dy = 0; dy < kSupersampling; ++dy) {
        for (int dx = 0; dx < kSupersampling; ++dx) {
          const int column = (x / kChannels * kSupersampling + dx) * kChannels + x % kChannels;
          sum += from[static_cast<ptrdiff_t>(y * kSupersampling + dy) * from_stride + column];
        }
      }
      constexpr int kSamples = kSupersampling * kSupersampling;
      to[static_cast<ptrdiff_t>(y) * to_stride + x] = static_cast<uint8_t>((sum + kSamples / 2) / kSamples);
    }
  }
  cairo_surface_mark_dirty(small);
}

absl::Status WritePng(const Scene& scene, const Layout& layout, OutputFile& file) {
  const int width = static_cast<int>(layout.width);
  const int height = static_cast<int>(layout.height);
  const Surface picture(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  const Canvas canvas(cairo_create(picture.get()));
  {
    const Surface large(
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, width * kSupersampling, height * kSupersampling));
    const Canvas painting(cairo_create(large.get()));
    PaintBackground(painting.get());
    cairo_scale(painting.get(), kSupersampling, kSupersampling);
    cairo_set_antialias(painting.get(), CAIRO_ANTIALIAS_NONE);
    PaintFacets(painting.get(), scene, layout, /*stroke_small=*/false);
    for (const cairo_status_t status : {cairo_status(painting.get()), cairo_status(canvas.get())}) {
      if (status != CAIRO_STATUS_SUCCESS) {
        return CairoError(status, file);
      }
    }
    Average(large.get(), picture.get());
  }
  PaintLegend(canvas.get(), scene, layout);
  return WriteAsPng(picture.get(), file);
}

absl::Status WriteSvg(const Scene& scene, const Layout& layout, OutputFile& file) {
  return PaintAsSvg(
      layout.width, layout.height,
      [&](cairo_t* cairo) {
        PaintFacets(cairo, scene, layout, /*stroke_small=*/true);
        PaintLegend(cairo, scene, layout);
      },
      file);
}

}  // namespace

absl::Status WritePicture(const Scene& scene, int width, PictureFormat format, const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path));
  const Layout layout = MakeLayout(scene, width);
  const absl::Status painted =
      format == PictureFormat::kPng ? WritePng(scene, layout, file) : WriteSvg(scene, layout, file);
  return painted.ok() ? file.Commit() : painted;
}

}  // namespace wellspace::render
