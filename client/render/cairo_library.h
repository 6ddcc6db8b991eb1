// Cairo, loaded when a picture is painted. Private to this folder.
#ifndef WELLSPACE_CLIENT_RENDER_CAIRO_LIBRARY_H_
#define WELLSPACE_CLIENT_RENDER_CAIRO_LIBRARY_H_

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include "absl/status/status.h"

namespace wellspace::render {

// The functions of Cairo that are called, by their names without the prefix. clang-format would indent each line by
// the one before.
// clang-format off
#define WELLSPACE_CAIRO_FUNCTIONS(USE) \
  USE(arc) USE(close_path) USE(create) USE(destroy) USE(fill) USE(fill_preserve) USE(font_extents) \
  USE(image_surface_create) USE(image_surface_get_data) USE(image_surface_get_height) \
  USE(image_surface_get_stride) USE(image_surface_get_width) USE(line_to) USE(move_to) USE(new_sub_path) \
  USE(paint) USE(pdf_surface_create_for_stream) USE(pdf_surface_set_metadata) USE(rectangle) USE(scale) \
  USE(select_font_face) USE(set_antialias) USE(set_font_size) USE(set_line_cap) USE(set_line_join) \
  USE(set_line_width) USE(set_source_rgb) USE(set_source_rgba) USE(show_text) USE(status) USE(status_to_string) \
  USE(stroke) USE(surface_destroy) USE(surface_finish) USE(surface_flush) USE(surface_mark_dirty) \
  USE(surface_status) USE(surface_write_to_png_stream) USE(svg_surface_create_for_stream) \
  USE(svg_surface_set_document_unit) USE(text_extents)
// clang-format on

// Cairo with X11 and fonts is 18 libraries. If the programs were linked with it, every start would load them, and a
// wheel would contain them.
struct CairoLibrary {
#define WELLSPACE_DECLARE(name) decltype(&::cairo_##name) name = nullptr;
  WELLSPACE_CAIRO_FUNCTIONS(WELLSPACE_DECLARE)
#undef WELLSPACE_DECLARE
};

// Loads it, once. Later calls return the same.
//
// Errors:     FAILED_PRECONDITION: there is no libcairo.so.2 that can be loaded; the message has the loader's reason.
// Threads:    thread-safe.
absl::Status LoadCairo();

// REQUIRES:   LoadCairo() has returned OK.
const CairoLibrary& Cairo();

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_CAIRO_LIBRARY_H_
