// convert_mesh IN OUT [FORMAT]: reads a mesh in one format and writes it in another.
// convert_mesh --cloud IN OUT: reads a cloud, and writes it as a mesh of no simplices.
// convert_mesh --second-order IN OUT [FORMAT]: the same as the first, with elements of second order.
#include <iostream>
#include <string>
#include <utility>
#include <vector>

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
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const std::string option = arguments.empty() || !arguments[0].starts_with("--") ? "" : arguments[0];
  if (!option.empty()) {
    arguments.erase(arguments.begin());
  }
  const bool is_cloud = option == "--cloud";
  const bool is_second = option == "--second-order";
  if (arguments.size() < 2 || arguments.size() > (is_cloud ? 2 : 3) || (!option.empty() && !is_cloud && !is_second)) {
    std::cerr << "usage: convert_mesh [--second-order] IN OUT [FORMAT]\n       convert_mesh --cloud IN OUT\n";
    return 2;
  }
  const std::string format = arguments.size() == 3 ? arguments[2] : "";
  const absl::StatusOr<Mesh> mesh =
      is_cloud ? ReadCloudAsMesh(arguments[0]) : wellspace::formats::ReadMesh(arguments[0]);
  absl::Status status = mesh.status();
  if (status.ok()) {
    wellspace::formats::MeshView view = mesh->View();
    view.order = is_second ? wellspace::formats::MeshOrder::kSecond : wellspace::formats::MeshOrder::kFirst;
    status = wellspace::formats::WriteMesh(arguments[1], format, view);
  }
  if (!status.ok()) {
    std::cerr << status << "\n";
    return 1;
  }
  return 0;
}
