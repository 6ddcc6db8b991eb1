// The Connection over gRPC. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_GRPC_CONNECTION_H_
#define WELLSPACE_CLIENT_GRPC_GRPC_CONNECTION_H_

#include <functional>
#include <memory>
#include <string>

#include "client/connection.h"
#include "client/grpc/mesh_receiver.h"
#include "client/grpc/retry.h"
#include "client/grpc/servers.h"

namespace wellspace::client {

using AttemptAt = std::function<absl::Status(const Server& server, Attempt& attempt)>;
using FillSizesRequest = std::function<size_t(size_t first, v1::SetSizesRequest& request)>;

class GrpcConnection final : public Connection {
 public:
  GrpcConnection(const std::shared_ptr<grpc::Channel>& channel, const RetryPolicy& policy, OpenChannelTo open);

  // meshing.cc
  absl::Status MeshPoints(const MeshOptions& options, std::span<const double> points, MeshSink& sink,
                          const OnProgress& on_progress, const CallOptions& call) override;
  absl::StatusOr<MeshEstimate> EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                            const CallOptions& call) override;
  absl::StatusOr<ServerInfo> GetServerInfo(const CallOptions& call) override;
  absl::StatusOr<Health> CheckHealth(const std::string& service, const CallOptions& call) override;

  // sessions.cc
  absl::StatusOr<Session> CreateSession(const SessionOptions& options, const CallOptions& call) override;
  absl::StatusOr<Session> GetSession(const std::string& session, const CallOptions& call) override;
  absl::StatusOr<SessionPage> ListSessions(const Labels& labels, const PageOptions& page,
                                           const CallOptions& call) override;
  absl::StatusOr<Session> UpdateSession(const std::string& session, const SessionUpdate& change,
                                        const CallOptions& call) override;
  absl::Status DeleteSession(const std::string& session, const CallOptions& call) override;
  absl::StatusOr<PointsLeft> RemovePoints(const std::string& session, std::span<const uint64_t> points,
                                          const CallOptions& call) override;

  // add_features.cc
  absl::StatusOr<AddedSegments> AddSegments(const std::string& session, const Features& features,
                                            const std::optional<FeatureOffset>& offset,
                                            const CallOptions& call) override;
  absl::StatusOr<AddedTriangles> AddTriangles(const std::string& session, const SurfaceFeatures& surface,
                                              const std::optional<SurfaceOffset>& offset,
                                              const CallOptions& call) override;

  // transfers.cc
  absl::StatusOr<Uploaded> UploadPoints(const std::string& session, PointSource& source, std::optional<uint64_t> offset,
                                        const OnPoints& on_points, const CallOptions& call) override;
  absl::StatusOr<SizesSet> SetSizes(const std::string& session, const SizeSamples& samples,
                                    const CallOptions& call) override;
  absl::StatusOr<SizesSet> SetVertexSizes(const std::string& session, const VertexSizes& sizes,
                                          const CallOptions& call) override;
  absl::Status DownloadMesh(const std::string& session, MeshSink& sink, std::optional<uint64_t> revision,
                            const OnChunks& on_chunks, const CallOptions& call) override;
  absl::Status DownloadPart(const std::string& session, const PartOptions& part, MeshSink& sink,
                            std::optional<uint64_t> revision, const OnChunks& on_chunks,
                            const CallOptions& call) override;

  // updates.cc
  absl::Status UpdateMesh(const std::string& session, Mesh& mesh, const OnChunks& on_chunks,
                          const CallOptions& call) override;

  // operations.cc
  absl::StatusOr<Operation> StartRefinement(const std::string& session, const RefinementOptions& refinement,
                                            const CallOptions& call) override;
  absl::StatusOr<Operation> GetOperation(const std::string& operation, const CallOptions& call) override;
  absl::StatusOr<OperationPage> ListOperations(const std::string& session, const PageOptions& page,
                                               const CallOptions& call) override;
  absl::StatusOr<Operation> CancelOperation(const std::string& operation, const CallOptions& call) override;
  absl::StatusOr<Operation> WatchOperation(const std::string& operation, const OnProgress& on_progress,
                                           std::optional<uint64_t> after_sequence, const CallOptions& call) override;

  // queries.cc
  absl::Status ApproximateNearestNeighbors(const std::string& session, std::span<const uint32_t> vertices,
                                           const OnDistances& on_distances, const CallOptions& call) override;
  absl::Status ClippedVoronoiCells(const std::string& session, std::span<const uint32_t> vertices, double beta,
                                   const OnCells& on_cells, const CallOptions& call) override;
  absl::Status VoronoiCells(const std::string& session, std::span<const uint32_t> vertices, const OnCells& on_cells,
                            const CallOptions& call) override;
  absl::StatusOr<Located> Locate(const std::string& session, std::span<const double> points,
                                 const LocateOptions& options, const CallOptions& call) override;
  absl::StatusOr<AddedVertices> AddVertices(const std::string& session, std::span<const double> points,
                                            std::span<const uint32_t> near, const OnAdded& on_added,
                                            const CallOptions& call) override;

  // transfer_values.cc
  absl::StatusOr<TransferredValues> TransferValues(const std::string& session, std::span<const double> values,
                                                   const TransferOptions& options, const CallOptions& call) override;

  // admin.cc
  absl::StatusOr<OwnedOperationPage> ListAllOperations(const OperationFilter& filter, const PageOptions& page,
                                                       const CallOptions& call) override;
  absl::StatusOr<Operation> CancelAnyOperation(const std::string& operation, const CallOptions& call) override;
  absl::StatusOr<absl::Duration> DrainServer(const CallOptions& call) override;
  absl::StatusOr<UsagePage> GetUsage(const UsageFilter& filter, const PageOptions& page,
                                     const CallOptions& call) override;

 private:
  // Makes a unary call of the first server until its status is final; the answer is in `response`.
  template <typename Stub, typename Request, typename Response>
  absl::Status Call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, const CallOptions& call, Response* response) {
    return retrier_.Run(call.timeout, call.stop, [&](Attempt& attempt) {
      CallContext context(attempt);
      return FromGrpcStatus((stub.*method)(context.get(), request, response));
    });
  }

  // Makes attempts at a call on the session of `name`, each at the server that has it as far as is known. `name`: of a
  // session, or of an operation.
  absl::Status RunOn(const std::string& name, const CallOptions& call, const AttemptAt& attempt_at);

  // A unary call so.
  template <typename Stub, typename Request, typename Response>
  absl::Status CallOn(const std::string& name, const std::unique_ptr<Stub> Server::*stub,
                      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request, const CallOptions& call, Response* response) {
    return RunOn(name, call, [&](const Server& server, Attempt& attempt) {
      CallContext context(attempt);
      return FromGrpcStatus((*(server.*stub).*method)(context.get(), request, response));
    });
  }

  // `fill` puts the sizes from a number on into a request, and returns the number after the last.
  absl::StatusOr<SizesSet> SendAllSizes(const std::string& session, size_t count, const CallOptions& call,
                                        const FillSizesRequest& fill);

  // Downloads what `request` asks for, but for the session and the place to begin, into `receiver`.
  absl::Status Download(const std::string& session, std::optional<uint64_t> revision, v1::DownloadMeshRequest& request,
                        MeshReceiver& receiver, const OnChunks& on_chunks, const CallOptions& call);

  // One request of AddVertices.
  absl::StatusOr<AddedVertices> AddSome(const v1::AddVerticesRequest& request, const CallOptions& call);

  Retrier retrier_;
  Servers servers_;
};

// One attempt at GetSession.
absl::StatusOr<v1::Session> FetchSession(const std::string& session, const Server& server, const Attempt& attempt);

// The options of the requests that a call makes one after the other: together they take no longer than it may.
class CallInParts {
 public:
  explicit CallInParts(const CallOptions& call) : part_(call), deadline_(SinceBoot() + call.timeout) {}

  // The options of the next request.
  const CallOptions& Next() {
    part_.timeout = deadline_ - SinceBoot();
    return part_;
  }

 private:
  CallOptions part_;
  const absl::Duration deadline_;
};

// The largest number of whole rows of `row` doubles that a request of less than 1 MiB holds; at least 1.
size_t RowsOfARequest(size_t row);

// The id of a call that changes something: the caller's, or a random one of 128 bits.
std::string RequestIdOf(const CallOptions& call);

// Leaves the field of a request absent where nothing is expected.
template <typename Request>
void SetExpectedRevision(const std::optional<uint64_t>& expected, Request& request) {
  if (expected.has_value()) {
    request.set_expected_revision(*expected);
  }
}

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_GRPC_CONNECTION_H_
