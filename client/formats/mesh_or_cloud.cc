#include "client/formats/mesh_or_cloud.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/read_mesh.h"
#include "client/formats/vtk/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Whether ReadCloud tells the attributes of points of a mesh.
bool HasPointData(const std::string& format) {
  return format == "vtu" || format == "vtk" || format == "vtp" || format == "adcirc" || format == "2dm";
}

bool IsVtkFormat(const std::string& format) { return format == "vtu" || format == "vtk" || format == "vtp"; }

// Takes the data of points of a file of such a format: columns of the mesher's own tell input points and
// origins, the rest are attributes. A file without data is a mesh all the same.
void TakePointData(const std::string& path, MeshOrCloud& read) {
  absl::StatusOr<PointCloud> cloud = ReadCloud(path, {.format = read.format, .keep_attributes = true});
  if (!cloud.ok() || cloud->size() != read.mesh.View().vertex_count()) {
    return;
  }
  for (Attribute& attribute : cloud->attributes) {
    if (attribute.name == "input") {
      read.input_vertices = std::find(attribute.values.begin(), attribute.values.end(), 0) - attribute.values.begin();
    } else if (attribute.name == kVtkOrigin) {
      for (const double origin : attribute.values) {
        const bool is_origin = origin >= SignedOrigin(kCornerOrigin) && origin < kCornerOrigin;
        read.mesh.vertex_origins.push_back(is_origin ? static_cast<uint32_t>(static_cast<int64_t>(origin))
                                                     : kSteinerOrigin);
      }
    } else if (attribute.name != kVtkBoundary && attribute.name != "weights") {
      read.attributes.push_back(std::move(attribute));
    }
  }
}

}  // namespace

absl::StatusOr<MeshOrCloud> ReadMeshOrCloud(const std::string& path, const CloudOptions& options) {
  const bool asks_for_cloud = !options.format.empty() || !options.columns.empty() || options.skip_invalid;
  const std::string mesh_format = path == kStandardStream || asks_for_cloud ? "" : MeshFormatOf(path);
  MeshOrCloud read;
  absl::Status refusal;
  if (!mesh_format.empty()) {
    absl::StatusOr<Mesh> mesh = ReadMesh(path, options.keep_attributes ? SimplexData::kKeep : SimplexData::kLeaveOut);
    if (mesh.ok()) {
      read.is_mesh = true;
      read.format = mesh_format;
      read.mesh = *std::move(mesh);
      read.notes = read.mesh.notes;
      if (HasPointData(mesh_format)) {
        TakePointData(path, read);
      } else if (const std::vector<uint32_t>& origins = read.mesh.vertex_origins; !origins.empty()) {
        const auto is_added = [](uint32_t origin) { return origin >= kCornerOrigin; };
        read.input_vertices = std::find_if(origins.begin(), origins.end(), is_added) - origins.begin();
      }
      return read;
    }
    refusal = mesh.status();
    if (!IsVtkFormat(mesh_format) && !absl::IsNotFound(refusal)) {
      // Of .node both files are there, and the other formats have meshes: points alone would be half of it.
      return absl::Status(refusal.code(),
                          absl::StrCat(refusal.message(), "; --input-format ", mesh_format, " reads the points alone"));
    }
  }
  absl::StatusOr<PointCloud> cloud = ReadCloud(path, options);
  if (!cloud.ok()) {
    return refusal.ok() ? cloud.status() : refusal;
  }
  read.format = CloudFormatOf(path, options.format);
  read.mesh.dimension = cloud->dimension;
  read.mesh.points = std::move(cloud->points);
  read.attributes = std::move(cloud->attributes);
  read.input_vertices = read.mesh.View().vertex_count();
  read.notes = std::move(cloud->notes);
  if (!refusal.ok() && IsVtkFormat(mesh_format)) {
    read.notes.insert(read.notes.begin(),
                      absl::StrCat("only points are read, since it is no mesh of simplices: ", refusal.message()));
  }
  read.skipped = cloud->skipped;
  return read;
}

}  // namespace wellspace::formats
