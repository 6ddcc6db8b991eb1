#include "client/client.h"

#include "client/connection.h"
#include "core/base/status_macros.h"

namespace wellspace::client {

absl::StatusOr<Mesh> Client::MeshPoints(const MeshOptions& options, std::span<const double> points,
                                        const OnProgress& on_progress, const CallOptions& call) {
  MeshCollector collector;
  WELLSPACE_RETURN_IF_ERROR(MeshPoints(options, points, collector, on_progress, call));
  return std::move(collector.mesh());
}

absl::Status Client::MeshPoints(const MeshOptions& options, std::span<const double> points, MeshSink& sink,
                                const OnProgress& on_progress, const CallOptions& call) {
  return connection_->MeshPoints(options, points, sink, on_progress, call);
}

absl::StatusOr<MeshEstimate> Client::EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                                  const CallOptions& call) {
  return connection_->EstimateMesh(options, points, call);
}

absl::StatusOr<ServerInfo> Client::GetServerInfo(const CallOptions& call) { return connection_->GetServerInfo(call); }

absl::StatusOr<Health> Client::CheckHealth(const std::string& service, const CallOptions& call) {
  return connection_->CheckHealth(service, call);
}

absl::StatusOr<Session> Client::CreateSession(const SessionOptions& options, const CallOptions& call) {
  return connection_->CreateSession(options, call);
}

absl::StatusOr<Session> Client::GetSession(const std::string& session, const CallOptions& call) {
  return connection_->GetSession(session, call);
}

absl::StatusOr<SessionPage> Client::ListSessions(const Labels& labels, const PageOptions& page,
                                                 const CallOptions& call) {
  return connection_->ListSessions(labels, page, call);
}

absl::StatusOr<Session> Client::UpdateSession(const std::string& session, const SessionUpdate& change,
                                              const CallOptions& call) {
  return connection_->UpdateSession(session, change, call);
}

absl::Status Client::DeleteSession(const std::string& session, const CallOptions& call) {
  return connection_->DeleteSession(session, call);
}

absl::StatusOr<Uploaded> Client::UploadPoints(const std::string& session, PointSource& source,
                                              std::optional<uint64_t> offset, const OnPoints& on_points,
                                              const CallOptions& call) {
  return connection_->UploadPoints(session, source, offset, on_points, call);
}

absl::StatusOr<PointsLeft> Client::RemovePoints(const std::string& session, std::span<const uint64_t> points,
                                                const CallOptions& call) {
  return connection_->RemovePoints(session, points, call);
}

absl::StatusOr<AddedSegments> Client::AddSegments(const std::string& session, const Features& features,
                                                  const std::optional<FeatureOffset>& offset, const CallOptions& call) {
  return connection_->AddSegments(session, features, offset, call);
}

absl::StatusOr<AddedTriangles> Client::AddTriangles(const std::string& session, const SurfaceFeatures& surface,
                                                    const std::optional<SurfaceOffset>& offset,
                                                    const CallOptions& call) {
  return connection_->AddTriangles(session, surface, offset, call);
}

absl::StatusOr<SizesSet> Client::SetSizes(const std::string& session, const SizeSamples& samples,
                                          const CallOptions& call) {
  return connection_->SetSizes(session, samples, call);
}

absl::StatusOr<SizesSet> Client::SetVertexSizes(const std::string& session, const VertexSizes& sizes,
                                                const CallOptions& call) {
  return connection_->SetVertexSizes(session, sizes, call);
}

absl::Status Client::DownloadMesh(const std::string& session, MeshSink& sink, std::optional<uint64_t> revision,
                                  const OnChunks& on_chunks, const CallOptions& call) {
  return connection_->DownloadMesh(session, sink, revision, on_chunks, call);
}

absl::Status Client::DownloadPart(const std::string& session, const PartOptions& part, MeshSink& sink,
                                  std::optional<uint64_t> revision, const OnChunks& on_chunks,
                                  const CallOptions& call) {
  return connection_->DownloadPart(session, part, sink, revision, on_chunks, call);
}

absl::Status Client::UpdateMesh(const std::string& session, Mesh& mesh, const OnChunks& on_chunks,
                                const CallOptions& call) {
  return connection_->UpdateMesh(session, mesh, on_chunks, call);
}

absl::StatusOr<Operation> Client::StartRefinement(const std::string& session, const RefinementOptions& refinement,
                                                  const CallOptions& call) {
  return connection_->StartRefinement(session, refinement, call);
}

absl::StatusOr<Operation> Client::GetOperation(const std::string& operation, const CallOptions& call) {
  return connection_->GetOperation(operation, call);
}

absl::StatusOr<OperationPage> Client::ListOperations(const std::string& session, const PageOptions& page,
                                                     const CallOptions& call) {
  return connection_->ListOperations(session, page, call);
}

absl::StatusOr<Operation> Client::CancelOperation(const std::string& operation, const CallOptions& call) {
  return connection_->CancelOperation(operation, call);
}

absl::StatusOr<Operation> Client::WatchOperation(const std::string& operation, const OnProgress& on_progress,
                                                 std::optional<uint64_t> after_sequence, const CallOptions& call) {
  return connection_->WatchOperation(operation, on_progress, after_sequence, call);
}

absl::StatusOr<OwnedOperationPage> Client::ListAllOperations(const OperationFilter& filter, const PageOptions& page,
                                                             const CallOptions& call) {
  return connection_->ListAllOperations(filter, page, call);
}

absl::StatusOr<Operation> Client::CancelAnyOperation(const std::string& operation, const CallOptions& call) {
  return connection_->CancelAnyOperation(operation, call);
}

absl::StatusOr<absl::Duration> Client::DrainServer(const CallOptions& call) { return connection_->DrainServer(call); }

absl::StatusOr<UsagePage> Client::GetUsage(const UsageFilter& filter, const PageOptions& page,
                                           const CallOptions& call) {
  return connection_->GetUsage(filter, page, call);
}

absl::Status Client::ApproximateNearestNeighbors(const std::string& session, std::span<const uint32_t> vertices,
                                                 const OnDistances& on_distances, const CallOptions& call) {
  return connection_->ApproximateNearestNeighbors(session, vertices, on_distances, call);
}

absl::Status Client::ClippedVoronoiCells(const std::string& session, std::span<const uint32_t> vertices, double beta,
                                         const OnCells& on_cells, const CallOptions& call) {
  return connection_->ClippedVoronoiCells(session, vertices, beta, on_cells, call);
}

absl::Status Client::VoronoiCells(const std::string& session, std::span<const uint32_t> vertices,
                                  const OnCells& on_cells, const CallOptions& call) {
  return connection_->VoronoiCells(session, vertices, on_cells, call);
}

absl::StatusOr<Located> Client::Locate(const std::string& session, std::span<const double> points,
                                       const LocateOptions& options, const CallOptions& call) {
  return connection_->Locate(session, points, options, call);
}

absl::StatusOr<TransferredValues> Client::TransferValues(const std::string& session, std::span<const double> values,
                                                         const TransferOptions& options, const CallOptions& call) {
  return connection_->TransferValues(session, values, options, call);
}

absl::StatusOr<AddedVertices> Client::AddVertices(const std::string& session, std::span<const double> points,
                                                  std::span<const uint32_t> near, const OnAdded& on_added,
                                                  const CallOptions& call) {
  return connection_->AddVertices(session, points, near, on_added, call);
}

}  // namespace wellspace::client
