// The common part of painting by Cairo. Private to this folder.
#ifndef WELLSPACE_CLIENT_RENDER_CANVAS_H_
#define WELLSPACE_CLIENT_RENDER_CANVAS_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "client/formats/io/output_file.h"
#include "client/render/cairo_library.h"
#include "client/render/colour_ramp.h"
#include "client/render/picture_format.h"

namespace wellspace::render {

struct DestroyCairo {
  void operator()(cairo_surface_t* surface) const { Cairo().surface_destroy(surface); }
  void operator()(cairo_t* cairo) const { Cairo().destroy(cairo); }
};
using Surface = std::unique_ptr<cairo_surface_t, DestroyCairo>;
using Canvas = std::unique_ptr<cairo_t, DestroyCairo>;

// Of text and of frames.
inline constexpr Colour kInk = {0.15, 0.15, 0.18};

void SetColour(cairo_t* cairo, const Colour& colour, double alpha = 1);
// White.
void PaintBackground(cairo_t* cairo);
// Text whose left end is at x, centred vertically at y.
void PaintText(cairo_t* cairo, double x, double y, const std::string& text);

// The error of `status` or of the file; OK unless one of them is an error.
absl::Status CairoError(cairo_status_t status, const formats::OutputFile& file);

// Writes an image.
absl::Status WriteAsPng(cairo_surface_t* image, formats::OutputFile& file);
// Has `paint` paint on white, and writes it as SVG or PDF. In a PDF a pixel is a point.
absl::Status PaintAsVectors(PictureFormat format, double width, double height,
                            const std::function<void(cairo_t*)>& paint, formats::OutputFile& file);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_CANVAS_H_
