// One session of a ServiceHarness on the client's side, meshes and all.
#ifndef WELLSPACE_TESTS_SERVER_SESSION_CLIENT_H_
#define WELLSPACE_TESTS_SERVER_SESSION_CLIENT_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grpcpp/grpcpp.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "wellspace/v1/queries.grpc.pb.h"

namespace wellspace::server {

// A mesh of `simplex_count` simplices in 3-D, which no geometry would allow: the arrays are as long as they would be, and have something
// else in every row.
core::Mesh MakeLargeMesh(uint64_t simplex_count);

// What a download brought.
struct Download {
  grpc::Status status;
  std::vector<v1::MeshMetadata> metadata;
  std::vector<v1::MeshChunk> chunks;
};

class SessionClient {
 public:
  // Creates a session.
  explicit SessionClient(const std::shared_ptr<grpc::Channel>& channel,
                         const v1::MeshParameters& parameters = UnitCubeParameters());

  const std::string& name() const { return name_; }
  SessionCalls& calls() { return calls_; }
  v1::QueryService::Stub& queries() { return *queries_; }

  v1::Session Get() { return calls_.Get(name_); }
  // Adds points after those that the session has.
  void Upload(const std::vector<double>& coordinates);
  // Has the session refined, and waits for the end.
  v1::Operation Refine();

  // Downloads the mesh from `next_chunk` on. Breaks off when `stop_after` chunks have come.
  Download DownloadMesh(uint64_t revision = 0, uint64_t next_chunk = 0,
                        std::optional<size_t> stop_after = std::nullopt);

 private:
  SessionCalls calls_;
  const std::unique_ptr<v1::QueryService::Stub> queries_;
  std::string name_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SESSION_CLIENT_H_
