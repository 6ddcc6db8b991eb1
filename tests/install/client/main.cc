// consumer HOST:PORT CLOUD MESH: has the server mesh the cloud into a file, and reads the file.
#include <wellspace/client/client.h>
#include <wellspace/client/files/mesh_file.h>
#include <wellspace/client/formats/read_cloud.h>
#include <wellspace/client/formats/read_mesh.h>

#include <iostream>
#include <string>

namespace {

using namespace wellspace;

absl::StatusOr<formats::Mesh> MeshRemotely(const std::string& address, const std::string& cloud_path,
                                           const std::string& mesh_path) {
  const absl::StatusOr<formats::PointCloud> cloud = formats::ReadCloud(cloud_path, {});
  if (!cloud.ok()) return cloud.status();
  absl::StatusOr<client::Client> client = client::Connect(address);
  if (!client.ok()) return client.status();
  client::MeshOptions options;
  options.dimension = cloud->dimension;
  client::MeshFile file(mesh_path);
  if (absl::Status status = client->MeshPoints(options, cloud->points, file); !status.ok()) return status;
  return formats::ReadMesh(mesh_path);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const absl::StatusOr<formats::Mesh> mesh = MeshRemotely(argv[1], argv[2], argv[3]);
  if (!mesh.ok()) {
    std::cerr << mesh.status() << "\n";
    return 1;
  }
  std::cout << mesh->View().vertex_count() << " vertices\n";
  return 0;
}
