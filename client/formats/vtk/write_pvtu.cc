// VTK's file of the pieces of a mesh.
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/output_file.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/xml_scanner.h"
#include "client/formats/write_parts.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

std::string ArrayOf(const char* type, const std::string& name) {
  return absl::StrCat("      <PDataArray type=\"", type, "\" Name=\"", name, "\"/>\n");
}

}  // namespace

absl::Status WritePvtu(const std::string& path, const MeshShape& shape, const std::vector<std::string>& pieces,
                       std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  std::string text = absl::StrCat(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "  <PUnstructuredGrid GhostLevel=\"0\">\n"
      "    <PPoints>\n      <PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n    </PPoints>\n"
      "    <PPointData>\n",
      ArrayOf("UInt8", "input"));
  if (shape.has_weights) {
    text += ArrayOf("Float64", "weights");
  }
  if (shape.has_vertex_marks) {
    absl::StrAppend(&text, ArrayOf("Int64", kVtkOrigin), ArrayOf("Int32", kVtkBoundary));
  }
  for (const std::string& attribute : shape.attributes) {
    text += ArrayOf("Float64", XmlText(attribute));
  }
  absl::StrAppend(&text, ArrayOf("Int64", kVtkPointIds), ArrayOf("Int32", kVtkOwner), ArrayOf("Int64", kVtkRow),
                  ArrayOf("UInt8", kVtkGhosts), "    </PPointData>\n    <PCellData>\n", ArrayOf("Int32", kVtkRegion));
  if (!shape.boundary.empty()) {
    text += ArrayOf("Int32", kVtkBoundary);
  }
  absl::StrAppend(&text, ArrayOf("Int64", kVtkCellIds), ArrayOf("Int32", kVtkOwner), ArrayOf("UInt8", kVtkGhosts),
                  "    </PCellData>\n");
  for (const std::string& piece : pieces) {
    const size_t slash = piece.find_last_of('/');
    const std::string name = slash == std::string::npos ? piece : piece.substr(slash + 1);
    absl::StrAppend(&text, "    <Piece Source=\"", XmlText(name), "\"/>\n");
  }
  output.Write(text);
  output.Write("  </PUnstructuredGrid>\n</VTKFile>\n");
  return output.Commit();
}

}  // namespace wellspace::formats
