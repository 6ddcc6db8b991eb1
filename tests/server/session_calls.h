// The calls of sessions, operations and queries, one line each.
#ifndef WELLSPACE_TESTS_SERVER_SESSION_CALLS_H_
#define WELLSPACE_TESTS_SERVER_SESSION_CALLS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "grpcpp/grpcpp.h"
#include "tests/server/service_harness.h"
#include "wellspace/v1/operations.grpc.pb.h"
#include "wellspace/v1/queries.grpc.pb.h"
#include "wellspace/v1/sessions.grpc.pb.h"

namespace wellspace::server {

// A call of WatchOperation.
class Watch {
 public:
  Watch(v1::OperationService::Stub& stub, const std::string& name, std::optional<uint64_t> after = std::nullopt,
        std::optional<absl::Duration> timeout = std::nullopt);
  // Cancels the call if Finish was not called.
  ~Watch();

  // Reads the next response, which is kept in the members below, too. False at the end of the stream.
  bool Read();
  // Reads until an event is of `phase` or a later one; false at the end of the stream.
  bool ReadUntil(v1::Phase phase);
  void Cancel() { context_.TryCancel(); }
  // Reads all that is still to come and returns the status.
  grpc::Status Finish();

  std::vector<v1::ProgressEvent> events;
  std::vector<absl::Time> times;  // of their arrival
  std::optional<v1::Operation> operation;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchOperationResponse>> stream_;
  bool finished_ = false;
};

// The messages of a download, and its end.
struct Download {
  grpc::Status status;
  std::vector<v1::MeshMetadata> metadata;
  std::vector<v1::MeshChunk> chunks;
  std::vector<v1::MeshDelta> deltas;  // parts
};

class SessionCalls {
 public:
  explicit SessionCalls(const std::shared_ptr<grpc::Channel>& channel);

  // Every call may want to have its status looked at; `*status` is where. Without, it has to be OK.
  v1::Session Create(const v1::CreateSessionRequest& request, grpc::Status* status = nullptr);
  // The unit cube as domain.
  v1::Session Create(int dimension = 3);
  v1::Session Get(const std::string& name, grpc::Status* status = nullptr);
  v1::ListSessionsResponse List(const v1::ListSessionsRequest& request, grpc::Status* status = nullptr);
  v1::Session Update(const v1::UpdateSessionRequest& request, grpc::Status* status = nullptr);
  v1::RemovePointsResponse RemovePoints(const v1::RemovePointsRequest& request, grpc::Status* status = nullptr);
  void Delete(const v1::DeleteSessionRequest& request, grpc::Status* status = nullptr);
  void Delete(const std::string& name, grpc::Status* status = nullptr);
  // One stream of these requests.
  v1::UploadPointsResponse Upload(const std::vector<v1::UploadPointsRequest>& requests, grpc::Status* status = nullptr);
  v1::UploadPointsResponse Upload(const std::string& name, uint64_t offset, const std::vector<double>& coordinates,
                                  grpc::Status* status = nullptr);

  // One stream of these requests.
  v1::AddSegmentsResponse AddSegments(const std::vector<v1::AddSegmentsRequest>& requests,
                                      grpc::Status* status = nullptr);

  // One stream of these requests.
  v1::AddTrianglesResponse AddTriangles(const std::vector<v1::AddTrianglesRequest>& requests,
                                        grpc::Status* status = nullptr);

  // One stream of these requests.
  v1::SetSizesResponse SetSizes(const std::vector<v1::SetSizesRequest>& requests, grpc::Status* status = nullptr);

  v1::Operation Start(const v1::StartRefinementRequest& request, grpc::Status* status = nullptr);
  v1::Operation Start(const std::string& name, grpc::Status* status = nullptr);
  v1::Operation GetOperation(const std::string& name, grpc::Status* status = nullptr);
  v1::ListOperationsResponse ListOperations(const v1::ListOperationsRequest& request, grpc::Status* status = nullptr);
  v1::Operation Cancel(const std::string& name, grpc::Status* status = nullptr);
  // Starts a refinement and watches it to its end.
  v1::Operation Refine(const std::string& name);
  v1::Operation Refine(const v1::StartRefinementRequest& request);

  // Downloads a mesh from `next_chunk` on. Breaks off when `stop_after` chunks have come.
  Download DownloadMesh(const std::string& name, uint64_t revision = 0, uint64_t next_chunk = 0,
                        std::optional<size_t> stop_after = std::nullopt, bool with_boundary = false);
  // Makes the download of `request`, to its end.
  Download DownloadMesh(const v1::DownloadMeshRequest& request);

  // The chunks of the last mesh with its boundary, one behind the other.
  std::string MeshBytes(const std::string& name);

  v1::SessionService::Stub& sessions() { return *sessions_; }
  v1::OperationService::Stub& operations() { return *operations_; }
  v1::QueryService::Stub& queries() { return *queries_; }

 private:
  const std::unique_ptr<v1::SessionService::Stub> sessions_;
  const std::unique_ptr<v1::OperationService::Stub> operations_;
  const std::unique_ptr<v1::QueryService::Stub> queries_;
};

// The same of one session.
class SessionClient {
 public:
  // Creates it.
  explicit SessionClient(const std::shared_ptr<grpc::Channel>& channel,
                         const v1::MeshParameters& parameters = UnitCubeParameters());

  const std::string& name() const { return name_; }
  SessionCalls& calls() { return calls_; }
  v1::QueryService::Stub& queries() { return calls_.queries(); }

  v1::Session Get() { return calls_.Get(name_); }
  // Adds points after those that the session has.
  void Upload(const std::vector<double>& coordinates);
  // Has the session refined, and waits for the end, which has to be a success.
  v1::Operation Refine();
  Download DownloadMesh(uint64_t revision = 0, uint64_t next_chunk = 0,
                        std::optional<size_t> stop_after = std::nullopt) {
    return calls_.DownloadMesh(name_, revision, next_chunk, stop_after);
  }

 private:
  SessionCalls calls_;
  std::string name_;
};

v1::UploadPointsRequest UploadRequest(const std::string& name, uint64_t offset, const std::vector<double>& coordinates);

// Samples of sizes in the plane, row by row.
v1::SetSizesRequest SizesRequest(const std::string& name, const std::vector<double>& points,
                                 const std::vector<double>& sizes);

// A square of side 4 around one of side 2, which is a hole, with two lines from one to the other: points, and a request
// with 10 segments, which have the markers 5, 9 and 0, and 2 seeds, of the hole and of region 3 on a side of the lines.
std::vector<double> FramePoints();
v1::AddSegmentsRequest FrameRequest(const std::string& name);

// The cube [-0.5, 0.5]^3: points, and a request with 12 triangles, two for each side, which have the markers 1 to 6,
// and a seed of region 4 inside.
std::vector<double> BlockPoints();
v1::AddTrianglesRequest BlockRequest(const std::string& name);

// Points of the unit cube, away from its faces.
std::vector<double> UniformPoints(size_t count, int dimension, uint64_t seed);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SESSION_CALLS_H_
