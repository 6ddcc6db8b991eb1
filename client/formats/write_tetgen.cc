// TetGen's and Triangle's .node and .ele.
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/number.h"
#include "client/formats/output_file.h"
#include "client/formats/registry.h"

namespace wellspace::formats {
namespace {

void WriteNodes(const MeshView& mesh, OutputFile& output) {
  std::string line;
  AppendNumber(mesh.vertex_count(), line);
  absl::StrAppend(&line, " ", mesh.dimension, " 0 0\n");
  output.Write(line);
  for (uint64_t vertex = 0; vertex < mesh.vertex_count() && output.status().ok(); ++vertex) {
    line.clear();
    AppendNumber(vertex, line);
    for (int axis = 0; axis < mesh.dimension; ++axis) {
      line += ' ';
      AppendNumber(mesh.points[vertex * mesh.dimension + axis], line);
    }
    line += '\n';
    output.Write(line);
  }
}

void WriteSimplices(const MeshView& mesh, OutputFile& output) {
  const int corners = mesh.dimension + 1;
  std::string line;
  AppendNumber(mesh.simplex_count(), line);
  absl::StrAppend(&line, " ", corners, " 0\n");
  output.Write(line);
  for (uint64_t simplex = 0; simplex < mesh.simplex_count() && output.status().ok(); ++simplex) {
    line.clear();
    AppendNumber(simplex, line);
    for (int corner = 0; corner < corners; ++corner) {
      line += ' ';
      AppendNumber(uint64_t{mesh.simplices[simplex * corners + corner]}, line);
    }
    line += '\n';
    output.Write(line);
  }
}

}  // namespace

std::string WithExtension(const std::string& path, const std::string& extension) {
  return path.substr(0, path.size() - ExtensionOf(path).size()) + extension;
}

absl::Status WriteNodeAndEle(const std::string& path, const MeshView& mesh, std::stop_token stop) {
  absl::StatusOr<OutputFile> nodes = OutputFile::Create(WithExtension(path, ".node"), stop);
  if (!nodes.ok()) {
    return nodes.status();
  }
  absl::StatusOr<OutputFile> simplices = OutputFile::Create(WithExtension(path, ".ele"), stop);
  if (!simplices.ok()) {
    return simplices.status();
  }
  WriteNodes(mesh, *nodes);
  WriteSimplices(mesh, *simplices);
  // Neither file appears before both are written.
  for (OutputFile* output : {&*nodes, &*simplices}) {
    if (absl::Status status = output->Flush(); !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = nodes->Commit(); !status.ok()) {
    return status;
  }
  return simplices->Commit();
}

}  // namespace wellspace::formats
