#include "client/render/painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "client/formats/io/output_file.h"
#include "client/render/cairo_library.h"
#include "client/render/canvas.h"
#include "client/render/colour_ramp.h"
#include "client/render/layout.h"
#include "client/render/legend.h"
#include "core/base/status_macros.h"

namespace wellspace::render {
namespace {

using formats::OutputFile;

// PNG is painted larger by this and averaged: neighbours then meet without the light seams of antialiased edges.
constexpr int kSupersampling = 2;

// Grey where there is no value.
Colour ValueColour(float share) { return std::isnan(share) ? Colour{0.78, 0.78, 0.78} : RampColour(share); }

// Draws the dots of a facet. Each facet at a vertex does so, and the last of them paints over the others: what lies
// before the vertex hides its dot.
void PaintDots(cairo_t* cairo, const Facet& facet, const Layout& layout) {
  constexpr double kRadius = 2.6;
  constexpr double kFullTurn = 6.283185307179586;
  for (int i = 0; i < 3; ++i) {
    if (facet.has_dot[i]) {
      Cairo().new_sub_path(cairo);
      Cairo().arc(cairo, layout.X(facet.corners[i]), layout.Y(facet.corners[i]), kRadius, 0, kFullTurn);
    }
  }
  SetColour(cairo, {0.08, 0.08, 0.10});
  Cairo().fill(cairo);
}

// Fills the triangles and draws their edges, which fade as the triangles get too small to show them.
void PaintFacets(cairo_t* cairo, const Scene& scene, const Layout& layout, bool stroke_small) {
  constexpr double kInvisible = 1.2;  // pixels that a triangle is high
  constexpr double kClear = 9;
  constexpr double kLineWidth = 0.7;
  Cairo().set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
  Cairo().set_line_width(cairo, kLineWidth);
  for (const Facet& facet : scene.facets) {
    double x[3];
    double y[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = layout.X(facet.corners[i]);
      y[i] = layout.Y(facet.corners[i]);
    }
    double longest = 0;
    for (int i = 0; i < 3; ++i) {
      longest = std::max(longest, std::hypot(x[i] - x[(i + 1) % 3], y[i] - y[(i + 1) % 3]));
    }
    const double twice_area = std::abs((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]));
    const double height = longest > 0 ? twice_area / longest : 0;
    const Colour colour =
        Shaded(scene.categories.empty() ? ValueColour(facet.share) : CategoryColour(facet.category), facet.shade);
    Cairo().move_to(cairo, x[0], y[0]);
    Cairo().line_to(cairo, x[1], y[1]);
    Cairo().line_to(cairo, x[2], y[2]);
    Cairo().close_path(cairo);
    SetColour(cairo, colour);
    const bool edges_show = longest > kClear && height > kInvisible;
    if (!edges_show && !stroke_small) {
      Cairo().fill(cairo);
    } else {
      Cairo().fill_preserve(cairo);
      if (edges_show) {
        const double strength = std::clamp((height - kInvisible) / (kClear - kInvisible), 0.0, 1.0);
        SetColour(cairo, Shaded(colour, 0.35), 0.15 + 0.55 * strength);
      }
      Cairo().stroke(cairo);
    }
    PaintDots(cairo, facet, layout);
  }
}

// Draws the boundary over the triangles, thicker than their edges.
void PaintBoundary(cairo_t* cairo, const Scene& scene, const Layout& layout) {
  constexpr double kLineWidth = 1.6;
  const Colour ink = {0.08, 0.08, 0.10};
  SetColour(cairo, ink);
  Cairo().set_line_cap(cairo, CAIRO_LINE_CAP_ROUND);
  Cairo().set_line_width(cairo, kLineWidth);
  for (const std::array<PicturePoint, 2>& line : scene.boundary) {
    Cairo().move_to(cairo, layout.X(line[0]), layout.Y(line[0]));
    Cairo().line_to(cairo, layout.X(line[1]), layout.Y(line[1]));
    Cairo().stroke(cairo);
  }
}

// Averages squares of kSupersampling x kSupersampling pixels. Both images are CAIRO_FORMAT_RGB24.
void Average(cairo_surface_t* large, cairo_surface_t* small) {
  Cairo().surface_flush(large);
  Cairo().surface_flush(small);
  const uint8_t* from = Cairo().image_surface_get_data(large);
  uint8_t* to = Cairo().image_surface_get_data(small);
  const int from_stride = Cairo().image_surface_get_stride(large);
  const int to_stride = Cairo().image_surface_get_stride(small);
  constexpr int kChannels = 4;
  for (int y = 0; y < Cairo().image_surface_get_height(small); ++y) {
    for (int x = 0; x < Cairo().image_surface_get_width(small) * kChannels; ++x) {
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
  Cairo().surface_mark_dirty(small);
}

absl::Status WritePng(const Scene& scene, const Layout& layout, OutputFile& file) {
  const int width = static_cast<int>(layout.width);
  const int height = static_cast<int>(layout.height);
  const Surface picture(Cairo().image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  const Canvas canvas(Cairo().create(picture.get()));
  {
    const Surface large(
        Cairo().image_surface_create(CAIRO_FORMAT_RGB24, width * kSupersampling, height * kSupersampling));
    const Canvas painting(Cairo().create(large.get()));
    PaintBackground(painting.get());
    Cairo().scale(painting.get(), kSupersampling, kSupersampling);
    Cairo().set_antialias(painting.get(), CAIRO_ANTIALIAS_NONE);
    PaintFacets(painting.get(), scene, layout, /*stroke_small=*/false);
    PaintBoundary(painting.get(), scene, layout);
    for (const cairo_status_t status : {Cairo().status(painting.get()), Cairo().status(canvas.get())}) {
      if (status != CAIRO_STATUS_SUCCESS) {
        return CairoError(status, file);
      }
    }
    Average(large.get(), picture.get());
  }
  PaintLegend(canvas.get(), scene, layout);
  return WriteAsPng(picture.get(), file);
}

absl::Status WriteVectors(const Scene& scene, const Layout& layout, PictureFormat format, OutputFile& file) {
  return PaintAsVectors(
      format, layout.width, layout.height,
      [&](cairo_t* cairo) {
        PaintFacets(cairo, scene, layout, /*stroke_small=*/true);
        PaintBoundary(cairo, scene, layout);
        PaintLegend(cairo, scene, layout);
      },
      file);
}

}  // namespace

absl::Status WritePicture(const Scene& scene, int width, PictureFormat format, const std::string& path) {
  WELLSPACE_RETURN_IF_ERROR(LoadCairo());
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path));
  const Layout layout = MakeLayout(scene, width);
  const absl::Status painted =
      format == PictureFormat::kPng ? WritePng(scene, layout, file) : WriteVectors(scene, layout, format, file);
  return painted.ok() ? file.Commit() : painted;
}

}  // namespace wellspace::render
