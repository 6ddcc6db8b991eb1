#include "client/render/legend.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/render/cairo_library.h"
#include "client/render/canvas.h"
#include "client/render/colour_ramp.h"

namespace wellspace::render {
namespace {

// `name`, or its beginning, if it is too long for the room of the legend.
std::string Shortened(const std::string& name) {
  constexpr size_t kLongest = 12;  // bytes
  if (name.size() <= kLongest) {
    return name;
  }
  size_t end = kLongest - 1;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) {
    --end;  // not within a character of UTF-8
  }
  return name.substr(0, end) + "\u2026";
}

void PaintRamp(cairo_t* cairo, const Scene& scene, const Layout& layout) {
  const double bottom = layout.legend_top + layout.legend_height;
  constexpr int kSteps = 128;
  Cairo().set_antialias(cairo, CAIRO_ANTIALIAS_NONE);
  for (int step = 0; step < kSteps; ++step) {
    const double from = bottom - layout.legend_height * (step + 1) / kSteps;
    SetColour(cairo, RampColour((step + 0.5) / kSteps));
    // A pixel more, under the next step, so that no seam is left.
    Cairo().rectangle(cairo, layout.legend_left, from, layout.legend_width, layout.legend_height / kSteps + 1);
    Cairo().fill(cairo);
  }
  Cairo().set_antialias(cairo, CAIRO_ANTIALIAS_DEFAULT);
  SetColour(cairo, kInk);
  Cairo().set_line_width(cairo, 1);
  Cairo().rectangle(cairo, layout.legend_left, layout.legend_top, layout.legend_width, layout.legend_height);
  Cairo().stroke(cairo);

  Cairo().select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  Cairo().set_font_size(cairo, layout.font_size);
  const double right = layout.legend_left + layout.legend_width;
  const double tick = 0.35 * layout.font_size;
  const auto mark = [&](double share, const std::string& text) {
    const double y = bottom - layout.legend_height * share;
    Cairo().move_to(cairo, right, y);
    Cairo().line_to(cairo, right + tick, y);
    Cairo().stroke(cairo);
    PaintText(cairo, right + 2 * tick, y, text);
  };
  constexpr int kDegreesPerTick = 10;
  constexpr int kTicksOfField = 5;
  for (int degrees = 0; scene.is_angle && degrees <= scene.high; degrees += kDegreesPerTick) {
    mark(degrees / scene.high, absl::StrCat(degrees, "\u00b0"));
  }
  for (int i = 0; !scene.is_angle && i < kTicksOfField; ++i) {
    const double share = i / (kTicksOfField - 1.0);
    mark(share, absl::StrFormat("%.4g", scene.low * (1 - share) + scene.high * share));
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
    PaintText(cairo, layout.legend_left, layout.legend_top - above, Shortened(words[line]));
  }
}

void PaintCategories(cairo_t* cairo, const Scene& scene, const Layout& layout) {
  const double row = 1.6 * layout.font_size;
  const auto rows = static_cast<size_t>((layout.height - 2 * layout.margin) / row);
  const bool all_fit = scene.categories.size() <= rows;
  const size_t named = all_fit ? scene.categories.size() : rows - 1;
  Cairo().select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  Cairo().set_font_size(cairo, layout.font_size);
  double y = (layout.height - static_cast<double>(all_fit ? named : rows) * row) / 2 + row / 2;
  for (size_t i = 0; i < named; ++i, y += row) {
    SetColour(cairo, CategoryColour(i));
    Cairo().rectangle(cairo, layout.legend_left, y - layout.font_size / 2, layout.font_size, layout.font_size);
    Cairo().fill(cairo);
    SetColour(cairo, kInk);
    PaintText(cairo, layout.legend_left + 1.5 * layout.font_size, y, Shortened(scene.categories[i]));
  }
  if (!all_fit) {
    SetColour(cairo, kInk);
    PaintText(cairo, layout.legend_left, y, absl::StrCat("and ", scene.categories.size() - named, " more"));
  }
}

}  // namespace

void PaintLegend(cairo_t* cairo, const Scene& scene, const Layout& layout) {
  scene.categories.empty() ? PaintRamp(cairo, scene, layout) : PaintCategories(cairo, scene, layout);
}

}  // namespace wellspace::render
