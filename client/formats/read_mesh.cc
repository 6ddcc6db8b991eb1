#include "client/formats/read_mesh.h"

#include <span>
#include <vector>

#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/registry.h"
#include "client/formats/tetgen/tetgen.h"

namespace wellspace::formats {
namespace {

using MeshReader = absl::StatusOr<Mesh> (*)(const std::string&, const MeshNumbers&);

std::span<const Format<MeshReader>> MeshReaders() {
  static const std::vector<Format<MeshReader>> readers = {
      {"vtu", {".vtu"}, ReadVtu},
      {"vtk", {".vtk"}, ReadVtk},
      {"vtp", {".vtp"}, ReadVtpMesh},
      {"npz", {".npz"}, ReadNpz},
      {"msh", {".msh"}, ReadMsh},
      {"medit", {".mesh"}, ReadMedit},
      {"adcirc", {".14", ".grd", ".gr3"}, ReadAdcirc},
      {"2dm", {".2dm"}, Read2dm},
      {"node", {".node", ".ele"}, ReadNodeAndEle},
  };
  return readers;
}

}  // namespace

absl::StatusOr<Mesh> ReadMesh(const std::string& path, SimplexData data) {
  const auto row = FindFormat(MeshReaders(), path, path == kStandardStream ? "vtu" : "");
  if (!row.ok()) {
    return row.status();
  }
  return (*row)->handler(path, {.of_simplices = data == SimplexData::kKeep});
}

std::string MeshFormatOf(const std::string& path) {
  const auto row = FindFormat(MeshReaders(), path, path == kStandardStream ? "vtu" : "");
  return row.ok() ? (*row)->name : std::string();
}

std::vector<std::string> FilesOfMeshRead(const std::string& path) {
  const auto row = FindFormat(MeshReaders(), path, path == kStandardStream ? "vtu" : "");
  if (row.ok() && (*row)->handler == ReadNodeAndEle) {
    return TetgenFilesOf(path);
  }
  return {path};
}

}  // namespace wellspace::formats
