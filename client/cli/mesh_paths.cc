#include "client/cli/mesh_paths.h"

#include "absl/strings/str_cat.h"
#include "client/cli/render/picture_format.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/io/open_input.h"
#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/formats/registry.h"
#include "client/formats/write_mesh.h"

namespace wellspace::cli {
namespace {

bool IsPicture(const std::string& path) { return render::PictureFormatOf(path).ok(); }

// `path` with the extension of a mesh in the place of its own.
std::string MeshPathFor(const std::string& path) {
  const std::string plain = formats::WithoutGzip(path);
  return absl::StrCat(plain.substr(0, plain.size() - formats::ExtensionOf(plain).size()), ".vtu");
}

}  // namespace

absl::StatusOr<formats::Mesh> ReadMeshInput(const std::string& path) {
  if (formats::MeshFormatOf(path).empty()) {
    const bool is_domain = formats::IsDomainPath(path);
    if (is_domain || !formats::CloudFormatOf(path, "").empty()) {
      const std::string made = MeshPathFor(path);
      return absl::InvalidArgumentError(
          absl::StrCat(path, ": this is a ", is_domain ? "domain" : "cloud", ", not a mesh; `wellspace mesh ", path,
                       " -o ", made, "` makes a mesh of it, which can be given here",
                       is_domain ? "" : absl::StrCat(", and `wellspace info ", path, "` tells what is in it")));
    }
    if (IsPicture(path)) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": this is a picture, not a mesh"));
    }
  }
  return formats::ReadMesh(path);
}

absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension, bool may_have_weights) {
  if (format.empty() && IsPicture(path)) {
    const std::string mesh = MeshPathFor(path);
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": this is a picture, not a mesh; write ",
                                                   mesh, ", of which `wellspace render ", mesh, " -o ", path,
                                                   "` makes a picture"));
  }
  return formats::CheckMeshOutput(path, format, dimension, may_have_weights);
}

}  // namespace wellspace::cli
