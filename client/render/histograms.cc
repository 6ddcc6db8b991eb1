#include "client/render/histograms.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "client/formats/io/output_file.h"
#include "client/render/cairo_library.h"
#include "client/render/canvas.h"
#include "client/render/colour_ramp.h"
#include "core/base/status_macros.h"

namespace wellspace::render {
namespace {

using formats::OutputFile;

// Pixels.
constexpr int kPanelWidth = 520;
constexpr int kHeight = 400;
constexpr double kTop = 90;
constexpr double kBottom = 50;
constexpr double kLeft = 70;
constexpr double kRight = 20;
constexpr double kFontSize = 14;
constexpr double kTickLength = 5;
// The axis of counts begins here: a bar of one has a height.
constexpr double kLeastCount = 0.5;

struct Panel {
  double left;
  double right;
  double top;
  double bottom;
  double most;  // the count at the top

  double HeightOf(double count) const {
    return (bottom - top) * std::log(count / kLeastCount) / std::log(most / kLeastCount);
  }
};

// Text centred at x, or with its right end there.
void PaintTextAt(cairo_t* cairo, double x, double y, const std::string& text, double share) {
  cairo_text_extents_t extents;
  Cairo().text_extents(cairo, text.c_str(), &extents);
  PaintText(cairo, x - share * extents.x_advance, y, text);
}

void PaintLine(cairo_t* cairo, double x, double y, double to_x, double to_y) {
  Cairo().move_to(cairo, x, y);
  Cairo().line_to(cairo, to_x, to_y);
  Cairo().stroke(cairo);
}

void PaintAxes(cairo_t* cairo, const Histogram& histogram, const Panel& panel) {
  SetColour(cairo, kInk);
  Cairo().set_line_width(cairo, 1);
  PaintLine(cairo, panel.left, panel.bottom, panel.right, panel.bottom);
  PaintLine(cairo, panel.left, panel.bottom, panel.left, panel.top);
  PaintTextAt(cairo, (panel.left + panel.right) / 2, panel.top - 1.4 * kFontSize, histogram.title, 0.5);
  const double high = histogram.low + histogram.width * static_cast<double>(histogram.counts.size());
  for (double at = std::ceil(histogram.low / histogram.tick) * histogram.tick; at <= high; at += histogram.tick) {
    const double x = panel.left + (panel.right - panel.left) * (at - histogram.low) / (high - histogram.low);
    PaintLine(cairo, x, panel.bottom, x, panel.bottom + kTickLength);
    PaintTextAt(cairo, x, panel.bottom + kTickLength + kFontSize, absl::StrFormat("%g%s", at, histogram.unit), 0.5);
  }
  for (double count = 1; count <= panel.most; count *= 10) {
    const double y = panel.bottom - panel.HeightOf(count);
    PaintLine(cairo, panel.left - kTickLength, y, panel.left, y);
    PaintTextAt(cairo, panel.left - 2 * kTickLength, y, absl::StrFormat("%.0f", count), 1);
  }
}

void PaintBars(cairo_t* cairo, const Histogram& histogram, const Panel& panel) {
  const double width = (panel.right - panel.left) / static_cast<double>(histogram.counts.size());
  SetColour(cairo, RampColour(0.45));
  for (size_t i = 0; i < histogram.counts.size(); ++i) {
    if (histogram.counts[i] > 0) {
      const double height = panel.HeightOf(static_cast<double>(histogram.counts[i]));
      Cairo().rectangle(cairo, panel.left + width * static_cast<double>(i), panel.bottom - height, width, height);
      Cairo().fill(cairo);
    }
  }
}

void PaintAll(cairo_t* cairo, const std::vector<Histogram>& histograms, const std::string& caption) {
  Cairo().select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  Cairo().set_font_size(cairo, kFontSize);
  SetColour(cairo, kInk);
  PaintText(cairo, kLeft, 2 * kFontSize, caption);
  // One scale for all.
  uint64_t most = 1;
  for (const Histogram& histogram : histograms) {
    for (const uint64_t count : histogram.counts) {
      most = std::max(most, count);
    }
  }
  double left = 0;
  for (const Histogram& histogram : histograms) {
    const Panel panel = {.left = left + kLeft,
                         .right = left + kPanelWidth - kRight,
                         .top = kTop,
                         .bottom = kHeight - kBottom,
                         .most = 1.5 * static_cast<double>(most)};
    PaintBars(cairo, histogram, panel);
    PaintAxes(cairo, histogram, panel);
    left += kPanelWidth;
  }
}

}  // namespace

absl::Status WriteHistograms(const std::vector<Histogram>& histograms, const std::string& caption, PictureFormat format,
                             const std::string& path) {
  WELLSPACE_RETURN_IF_ERROR(LoadCairo());
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path));
  const int width = kPanelWidth * static_cast<int>(histograms.size());
  absl::Status status;
  if (format != PictureFormat::kPng) {
    status = PaintAsVectors(
        format, width, kHeight, [&](cairo_t* cairo) { PaintAll(cairo, histograms, caption); }, file);
  } else {
    const Surface picture(Cairo().image_surface_create(CAIRO_FORMAT_RGB24, width, kHeight));
    const Canvas canvas(Cairo().create(picture.get()));
    PaintBackground(canvas.get());
    PaintAll(canvas.get(), histograms, caption);
    const cairo_status_t painted = Cairo().status(canvas.get());
    status = painted == CAIRO_STATUS_SUCCESS ? WriteAsPng(picture.get(), file) : CairoError(painted, file);
  }
  return status.ok() ? file.Commit() : status;
}

}  // namespace wellspace::render
