// The way of a Client to its server.
#ifndef WELLSPACE_CLIENT_CONNECTION_H_
#define WELLSPACE_CLIENT_CONNECTION_H_

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/client.h"
#include "client/retry_policy.h"

namespace grpc {
class Channel;
}

namespace wellspace::client {

// The calls of the service in terms of the library. See Client for each.
//
// A program's test puts its own in the place of gRPC, and hands the program a Client over it:
//
//   class FakeConnection : public client::Connection { … };  // or a mock, with MOCK_METHOD
//
//   client::Client client(std::make_shared<FakeConnection>());
//
// tests/client/client_test.cc does so. The results of a Connection reach the caller of the Client as it is: a fake
// decides about errors, events and meshes. For tests of messages on the wire, MakeConnection takes any channel.
//
// Thread safety: implementations are thread-safe.
class Connection {
 public:
  Connection() = default;
  virtual ~Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  virtual absl::Status MeshPoints(const MeshOptions& options, std::span<const double> points, MeshSink& sink,
                                  const OnProgress& on_progress, const CallOptions& call) = 0;
  virtual absl::StatusOr<MeshEstimate> EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                                    const CallOptions& call) = 0;
  virtual absl::StatusOr<ServerInfo> GetServerInfo(const CallOptions& call) = 0;
  virtual absl::StatusOr<Health> CheckHealth(const std::string& service, const CallOptions& call) = 0;

  virtual absl::StatusOr<Session> CreateSession(const SessionOptions& options, const CallOptions& call) = 0;
  virtual absl::StatusOr<Session> GetSession(const std::string& session, const CallOptions& call) = 0;
  virtual absl::StatusOr<SessionPage> ListSessions(const Labels& labels, const PageOptions& page,
                                                   const CallOptions& call) = 0;
  virtual absl::StatusOr<Session> UpdateSession(const std::string& session, const SessionUpdate& change,
                                                const CallOptions& call) = 0;
  virtual absl::Status DeleteSession(const std::string& session, const CallOptions& call) = 0;
  virtual absl::StatusOr<Uploaded> UploadPoints(const std::string& session, PointSource& source,
                                                std::optional<uint64_t> offset, const OnPoints& on_points,
                                                const CallOptions& call) = 0;
  virtual absl::StatusOr<PointsLeft> RemovePoints(const std::string& session, std::span<const uint64_t> points,
                                                  const CallOptions& call) = 0;
  virtual absl::StatusOr<AddedSegments> AddSegments(const std::string& session, const Features& features,
                                                    const std::optional<FeatureOffset>& offset,
                                                    const CallOptions& call) = 0;
  virtual absl::StatusOr<AddedTriangles> AddTriangles(const std::string& session, const SurfaceFeatures& surface,
                                                      const std::optional<SurfaceOffset>& offset,
                                                      const CallOptions& call) = 0;
  virtual absl::StatusOr<SizesSet> SetSizes(const std::string& session, const SizeSamples& samples,
                                            const CallOptions& call) = 0;
  virtual absl::StatusOr<SizesSet> SetVertexSizes(const std::string& session, const VertexSizes& sizes,
                                                  const CallOptions& call) = 0;
  virtual absl::Status DownloadMesh(const std::string& session, MeshSink& sink, std::optional<uint64_t> revision,
                                    const OnChunks& on_chunks, const CallOptions& call) = 0;
  virtual absl::Status DownloadPart(const std::string& session, const PartOptions& part, MeshSink& sink,
                                    std::optional<uint64_t> revision, const OnChunks& on_chunks,
                                    const CallOptions& call) = 0;
  virtual absl::Status UpdateMesh(const std::string& session, Mesh& mesh, const OnChunks& on_chunks,
                                  const CallOptions& call) = 0;

  virtual absl::StatusOr<Operation> StartRefinement(const std::string& session, const RefinementOptions& refinement,
                                                    const CallOptions& call) = 0;
  virtual absl::StatusOr<Operation> GetOperation(const std::string& operation, const CallOptions& call) = 0;
  virtual absl::StatusOr<OperationPage> ListOperations(const std::string& session, const PageOptions& page,
                                                       const CallOptions& call) = 0;
  virtual absl::StatusOr<Operation> CancelOperation(const std::string& operation, const CallOptions& call) = 0;
  virtual absl::StatusOr<Operation> WatchOperation(const std::string& operation, const OnProgress& on_progress,
                                                   std::optional<uint64_t> after_sequence, const CallOptions& call) = 0;

  virtual absl::Status ApproximateNearestNeighbors(const std::string& session, std::span<const uint32_t> vertices,
                                                   const OnDistances& on_distances, const CallOptions& call) = 0;
  virtual absl::Status ClippedVoronoiCells(const std::string& session, std::span<const uint32_t> vertices, double beta,
                                           const OnCells& on_cells, const CallOptions& call) = 0;
  virtual absl::Status VoronoiCells(const std::string& session, std::span<const uint32_t> vertices,
                                    const OnCells& on_cells, const CallOptions& call) = 0;
  virtual absl::StatusOr<Located> Locate(const std::string& session, std::span<const double> points,
                                         const LocateOptions& options, const CallOptions& call) = 0;
  virtual absl::StatusOr<TransferredValues> TransferValues(const std::string& session, std::span<const double> values,
                                                           const TransferOptions& options, const CallOptions& call) = 0;
  virtual absl::StatusOr<AddedVertices> AddVertices(const std::string& session, std::span<const double> points,
                                                    std::span<const uint32_t> near, const OnAdded& on_added,
                                                    const CallOptions& call) = 0;

  virtual absl::StatusOr<OwnedOperationPage> ListAllOperations(const OperationFilter& filter, const PageOptions& page,
                                                               const CallOptions& call) = 0;
  virtual absl::StatusOr<Operation> CancelAnyOperation(const std::string& operation, const CallOptions& call) = 0;
  virtual absl::StatusOr<absl::Duration> DrainServer(const CallOptions& call) = 0;
  virtual absl::StatusOr<UsagePage> GetUsage(const UsageFilter& filter, const PageOptions& page,
                                             const CallOptions& call) = 0;
};

// Opens a channel to a server that another one has named as the owner of a session. `address` is HOST:PORT.
using OpenChannelTo = std::function<absl::StatusOr<std::shared_ptr<grpc::Channel>>(const std::string& address)>;

// A connection over `channel`, for example that of an embedded server. Without `open` it goes to no other server.
std::shared_ptr<Connection> MakeConnection(std::shared_ptr<grpc::Channel> channel, const RetryPolicy& policy = {},
                                           OpenChannelTo open = nullptr);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_CONNECTION_H_
