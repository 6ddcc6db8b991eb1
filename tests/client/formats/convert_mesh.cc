// convert_mesh IN OUT [FORMAT]: reads a mesh in one format and writes it in another.
// convert_mesh --cloud IN OUT: reads a cloud, and writes it as a mesh of no simplices.
#include <cstring>
#include <iostream>

#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"

namespace {

using wellspace::formats::Mesh;

absl::StatusOr<Mesh> ReadCloudAsMesh(const std::string& path) {
  absl::StatusOr<wellspace::formats::PointCloud> cloud = wellspace::formats::ReadCloud(path);
  if (!cloud.ok()) {
    return cloud.status();
  }
  return Mesh{.dimension = cloud->dimension, .points = std::move(cloud->points), .simplices = {}};
}

}  // namespace

int main(int argc, char** argv) {
  const bool is_cloud = argc == 4 && std::strcmp(argv[1], "--cloud") == 0;
  if (argc != 3 && argc != 4) {
    std::cerr << "usage: convert_mesh IN OUT [FORMAT]\n       convert_mesh --cloud IN OUT\n";
    return 2;
  }
  const char* input = argv[is_cloud ? 2 : 1];
  const char* output = argv[is_cloud ? 3 : 2];
  const char* format = argc == 4 && !is_cloud ? argv[3] : "";
  const absl::StatusOr<Mesh> mesh = is_cloud ? ReadCloudAsMesh(input) : wellspace::formats::ReadMesh(input);
  const absl::Status status = mesh.ok() ? wellspace::formats::WriteMesh(output, format, mesh->View()) : mesh.status();
  if (!status.ok()) {
    std::cerr << status << "\n";
    return 1;
  }
  return 0;
}
