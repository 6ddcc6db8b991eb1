#include "client/render/canvas.h"

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"
#include "client/formats/registry.h"
#include "client/render/cairo_library.h"
#include "client/render/picture_format.h"

namespace wellspace::render {
namespace {

using formats::OutputFile;

cairo_status_t WriteToFile(void* closure, const unsigned char* data, unsigned int length) {
  OutputFile& file = *static_cast<OutputFile*>(closure);
  file.Write({reinterpret_cast<const char*>(data), length});
  return file.status().ok() ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

}  // namespace

void SetColour(cairo_t* cairo, const Colour& colour, double alpha) {
  Cairo().set_source_rgba(cairo, colour.red, colour.green, colour.blue, alpha);
}

void PaintBackground(cairo_t* cairo) {
  Cairo().set_source_rgb(cairo, 1, 1, 1);
  Cairo().paint(cairo);
}

void PaintText(cairo_t* cairo, double x, double y, const std::string& text) {
  cairo_font_extents_t extents;
  Cairo().font_extents(cairo, &extents);
  Cairo().move_to(cairo, x, y + (extents.ascent - extents.descent) / 2);
  Cairo().show_text(cairo, text.c_str());
}

absl::Status CairoError(cairo_status_t status, const OutputFile& file) {
  if (!file.status().ok()) {
    return file.status();
  }
  switch (status) {
    case CAIRO_STATUS_SUCCESS:
      return absl::OkStatus();
    case CAIRO_STATUS_NO_MEMORY:
      return absl::ResourceExhaustedError("not enough memory for the picture; expected a smaller width");
    default:
      return absl::InternalError(absl::StrCat("Cairo: ", Cairo().status_to_string(status)));
  }
}

absl::Status WriteAsPng(cairo_surface_t* image, OutputFile& file) {
  return CairoError(Cairo().surface_write_to_png_stream(image, WriteToFile, &file), file);
}

absl::Status PaintAsVectors(PictureFormat format, double width, double height,
                            const std::function<void(cairo_t*)>& paint, OutputFile& file) {
  const bool is_pdf = format == PictureFormat::kPdf;
  const Surface picture(is_pdf ? Cairo().pdf_surface_create_for_stream(WriteToFile, &file, width, height)
                               : Cairo().svg_surface_create_for_stream(WriteToFile, &file, width, height));
  if (is_pdf) {
    Cairo().pdf_surface_set_metadata(picture.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");  // the same bits at any time
  } else {
    Cairo().svg_surface_set_document_unit(picture.get(), CAIRO_SVG_UNIT_PX);
  }
  const Canvas canvas(Cairo().create(picture.get()));
  PaintBackground(canvas.get());
  paint(canvas.get());
  const cairo_status_t painted = Cairo().status(canvas.get());
  Cairo().surface_finish(picture.get());
  return CairoError(painted != CAIRO_STATUS_SUCCESS ? painted : Cairo().surface_status(picture.get()), file);
}

absl::StatusOr<PictureFormat> PictureFormatOf(const std::string& path) {
  const std::string extension = formats::ExtensionOf(path);
  if (extension == ".png") {
    return PictureFormat::kPng;
  }
  if (extension == ".svg") {
    return PictureFormat::kSvg;
  }
  if (extension == ".pdf") {
    return PictureFormat::kPdf;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": expected a picture .png, .svg or .pdf, got the extension ", formats::Quote(extension)));
}

}  // namespace wellspace::render
