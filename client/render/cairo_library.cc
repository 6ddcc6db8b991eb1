#include "client/render/cairo_library.h"

#include <dlfcn.h>

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

namespace wellspace::render {
namespace {

absl::Status MissingCairo() {
  const char* reason = dlerror();
  return absl::FailedPreconditionError(
      absl::StrCat("pictures want the library Cairo, version 1.16 or later, which cannot be loaded: ",
                   reason != nullptr ? reason : "no reason is known", "; Debian has it in the package libcairo2"));
}

absl::StatusOr<CairoLibrary> Load() {
  void* const library = dlopen("libcairo.so.2", RTLD_LAZY | RTLD_LOCAL);  // it stays until the process ends
  if (library == nullptr) {
    return MissingCairo();
  }
  CairoLibrary cairo;
#define WELLSPACE_LOAD(name)                                                           \
  cairo.name = reinterpret_cast<decltype(cairo.name)>(dlsym(library, "cairo_" #name)); \
  if (cairo.name == nullptr) {                                                         \
    return MissingCairo();                                                             \
  }
  WELLSPACE_CAIRO_FUNCTIONS(WELLSPACE_LOAD)
#undef WELLSPACE_LOAD
  return cairo;
}

const absl::StatusOr<CairoLibrary>& Loaded() {
  static const auto* const loaded = new absl::StatusOr<CairoLibrary>(Load());
  return *loaded;
}

}  // namespace

absl::Status LoadCairo() { return Loaded().status(); }

const CairoLibrary& Cairo() { return *Loaded(); }

}  // namespace wellspace::render
