#include "client/cli/mesh_paths.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/io/open_input.h"
#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/formats/registry.h"
#include "client/formats/write_mesh.h"
#include "client/render/picture_format.h"

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

void MarkVertices(bool always, formats::Mesh& mesh) {
  const uint64_t vertices = mesh.View().vertex_count();
  const bool has_origins = mesh.vertex_origins.size() == vertices;
  if (mesh.boundary.empty() || (!has_origins && !always)) {
    mesh.vertex_origins.clear();
    mesh.vertex_tags.clear();
    return;
  }
  mesh.vertex_origins.resize(vertices, formats::kSteinerOrigin);
  mesh.vertex_tags.assign(vertices, 0);
  size_t corner = 0;
  for (const formats::BoundaryPart& part : mesh.boundary) {
    for (const size_t end = corner + part.facets * mesh.dimension; corner < end; ++corner) {
      int32_t& tag = mesh.vertex_tags[mesh.facets[corner]];
      tag = tag == 0 ? part.tag : std::min(tag, part.tag);
    }
  }
}

absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension, bool may_have_weights,
                             formats::MeshOrder order) {
  if (format.empty() && IsPicture(path)) {
    const std::string mesh = MeshPathFor(path);
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": this is a picture, not a mesh; write ",
                                                   mesh, ", of which `wellspace render ", mesh, " -o ", path,
                                                   "` makes a picture"));
  }
  return formats::CheckMeshOutput(path, format, dimension, may_have_weights, order);
}

}  // namespace wellspace::cli
