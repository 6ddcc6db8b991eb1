// convert_mesh IN OUT: reads a mesh in one format and writes it in another.
#include <iostream>

#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: convert_mesh IN OUT\n";
    return 2;
  }
  const absl::StatusOr<wellspace::formats::Mesh> mesh = wellspace::formats::ReadMesh(argv[1]);
  const absl::Status status = mesh.ok() ? wellspace::formats::WriteMesh(argv[2], "", mesh->View()) : mesh.status();
  if (!status.ok()) {
    std::cerr << status << "\n";
    return 1;
  }
  return 0;
}
