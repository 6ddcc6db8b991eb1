// VTK's XML for unstructured grids.
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/output_file.h"
#include "client/formats/vtk_array.h"

namespace wellspace::formats {
namespace {

constexpr uint8_t kTriangle = 5;
constexpr uint8_t kTetrahedron = 10;

// Writes one data array; `add` puts its values in a VtkArrayWriter.
template <typename Add>
absl::Status WriteArray(const std::string& attributes, OutputFile& output, Add add) {
  output.Write(absl::StrCat("        <DataArray ", attributes, " format=\"binary\">\n"));
  VtkArrayWriter array;
  add(array);
  if (absl::Status status = array.Finish(output); !status.ok()) {
    return status;
  }
  output.Write("\n        </DataArray>\n");
  return output.status();
}

absl::Status WriteInputFlags(const MeshView& mesh, OutputFile& output) {
  return WriteArray("type=\"UInt8\" Name=\"input\"", output, [&mesh](VtkArrayWriter& array) {
    for (uint64_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
      array.Add<uint8_t>(vertex < mesh.input_vertices ? 1 : 0);
    }
  });
}

absl::Status WritePoints(const MeshView& mesh, OutputFile& output) {
  return WriteArray("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", output,
                    [&mesh](VtkArrayWriter& array) {
                      for (uint64_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
                        for (int axis = 0; axis < 3; ++axis) {
                          array.Add<double>(axis < mesh.dimension ? mesh.points[vertex * mesh.dimension + axis] : 0.0);
                        }
                      }
                    });
}

absl::Status WriteCells(const MeshView& mesh, OutputFile& output) {
  absl::Status status = WriteArray("type=\"Int64\" Name=\"connectivity\"", output, [&mesh](VtkArrayWriter& array) {
    for (const uint32_t vertex : mesh.simplices) {
      array.Add<int64_t>(vertex);
    }
  });
  if (!status.ok()) {
    return status;
  }
  status = WriteArray("type=\"Int64\" Name=\"offsets\"", output, [&mesh](VtkArrayWriter& array) {
    const int64_t corners = mesh.dimension + 1;
    for (uint64_t simplex = 0; simplex < mesh.simplex_count(); ++simplex) {
      array.Add<int64_t>((static_cast<int64_t>(simplex) + 1) * corners);
    }
  });
  if (!status.ok()) {
    return status;
  }
  return WriteArray("type=\"UInt8\" Name=\"types\"", output, [&mesh](VtkArrayWriter& array) {
    for (uint64_t simplex = 0; simplex < mesh.simplex_count(); ++simplex) {
      array.Add<uint8_t>(mesh.dimension == 2 ? kTriangle : kTetrahedron);
    }
  });
}

}  // namespace

absl::Status WriteVtu(const std::string& path, const MeshView& mesh, std::stop_token stop) {
  absl::StatusOr<OutputFile> output = OutputFile::Create(path, std::move(stop));
  if (!output.ok()) {
    return output.status();
  }
  output->Write(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" "
      "compressor=\"vtkZLibDataCompressor\">\n"
      "  <UnstructuredGrid>\n");
  output->Write(absl::StrCat("    <Piece NumberOfPoints=\"", mesh.vertex_count(), "\" NumberOfCells=\"",
                             mesh.simplex_count(), "\">\n      <PointData>\n"));
  if (absl::Status status = WriteInputFlags(mesh, *output); !status.ok()) {
    return status;
  }
  output->Write("      </PointData>\n      <Points>\n");
  if (absl::Status status = WritePoints(mesh, *output); !status.ok()) {
    return status;
  }
  output->Write("      </Points>\n      <Cells>\n");
  if (absl::Status status = WriteCells(mesh, *output); !status.ok()) {
    return status;
  }
  output->Write("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n");
  return output->Commit();
}

}  // namespace wellspace::formats
