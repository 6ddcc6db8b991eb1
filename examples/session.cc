// The C++ client library: a session from its creation to a mesh on disk.
//
//   session_example HOST:PORT CLOUD MESH
//
// CLOUD is a file that `wellspace mesh` reads, MESH one that it writes. Neither the mesh nor a cloud of numpy (.npy) is
// ever in memory as a whole: they come from disk while they are sent, and go there while they arrive. A connection that
// breaks is made anew, and nothing is sent twice.
#include <iostream>
#include <memory>
#include <string>

#include "client/client.h"
#include "client/files/cloud_file.h"
#include "client/files/mesh_file.h"

namespace {

using namespace wellspace;

absl::Status MeshRemotely(const std::string& address, const std::string& cloud_path, const std::string& mesh_path) {
  const absl::StatusOr<std::unique_ptr<client::CloudFile>> cloud = client::CloudFile::Open(cloud_path);
  if (!cloud.ok()) return cloud.status();

  // TLS, certificates and tokens are ConnectOptions. The first call connects.
  absl::StatusOr<client::Client> client = client::Connect(address);
  if (!client.ok()) return client.status();

  // A domain, and the demands on its mesh. The server forgets a session that is not used for its time to live.
  client::SessionOptions options;
  options.parameters.dimension = (*cloud)->dimension();
  options.labels = {{"made-by", "session_example"}};
  options.ttl = absl::Minutes(10);
  const absl::StatusOr<client::Session> session = client->CreateSession(options);
  if (!session.ok()) return session.status();

  // Points, in any number of uploads, from a file, from memory (client::SpanSource) or from a client::PointSource of
  // your own.
  const absl::StatusOr<client::Uploaded> uploaded = client->UploadPoints(session->name, **cloud);
  if (!uploaded.ok()) return uploaded.status();

  // The work goes on in the server, whether it is watched or not.
  const absl::StatusOr<client::Operation> started = client->StartRefinement(session->name);
  if (!started.ok()) return started.status();
  const absl::StatusOr<client::Operation> ended =
      client->WatchOperation(started->name, [](const client::Progress& progress) {
        std::cerr << progress.phase << " " << static_cast<int>(100 * progress.fraction) << " %\n";
      });
  if (!ended.ok()) return ended.status();       // of the watch
  if (!ended->error.ok()) return ended->error;  // of the work

  client::MeshFile file(mesh_path);
  if (absl::Status status = client->DownloadMesh(session->name, file, ended->mesh_revision); !status.ok())
    return status;
  std::cout << file.header().vertex_count << " vertices, " << file.header().simplex_count << " simplices\n";

  return client->DeleteSession(session->name);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: " << argv[0] << " HOST:PORT CLOUD MESH\n";
    return 2;
  }
  const absl::Status status = MeshRemotely(argv[1], argv[2], argv[3]);
  if (!status.ok()) {
    std::cerr << status << "\n";
    return 1;
  }
  return 0;
}
