#include "server/services/sessions/download_mesh_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/services/resource_names.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void DownloadMeshCall::OnBegin() {
  if (absl::Status status = Find(); !status.ok()) {
    End(std::move(status));
    return;
  }
  WriteNext();
}

absl::Status DownloadMeshCall::Find() {
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(&bytes_, &request_));
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request_.name()));
  std::shared_ptr<const MeshSnapshot> mesh = session->mesh();
  if (mesh == nullptr) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat(session->name(), " has no mesh yet; refine it first"));
  }
  if (request_.revision() != 0 && request_.revision() != mesh->revision()) {
    return MakeError(absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_REVISION_MISMATCH,
                     absl::StrCat("the mesh of ", session->name(), " is of revision ", mesh->revision(), ", not ",
                                  request_.revision(), " as asked for; download it from its first chunk"),
                     "revision");
  }
  WELLSPACE_ASSIGN_OR_RETURN(chunks_, mesh->ChunkCount(request_.with_boundary()));
  if (request_.next_chunk() > chunks_) {
    return MakeError(
        v1::ERROR_REASON_CHUNK_OUT_OF_RANGE,
        absl::StrCat("next_chunk is ", request_.next_chunk(), "; the mesh has ", chunks_, " chunks, numbered from 0"),
        "next_chunk");
  }
  use_.emplace(std::move(session));
  mesh_ = std::move(mesh);
  next_chunk_ = request_.next_chunk();
  return absl::OkStatus();
}

std::optional<grpc::ByteBuffer> DownloadMeshCall::NextResponse() {
  if (metadata_sent_ && next_chunk_ == chunks_) {
    End(absl::OkStatus());
    return std::nullopt;
  }
  absl::StatusOr<grpc::ByteBuffer> response = MakeResponse();
  if (!response.ok()) {
    End(std::move(response).status());
    return std::nullopt;
  }
  return *std::move(response);
}

absl::StatusOr<grpc::ByteBuffer> DownloadMeshCall::MakeResponse() {
  const bool with_boundary = request_.with_boundary();
  if (!metadata_sent_) {
    v1::DownloadMeshResponse response;
    WELLSPACE_ASSIGN_OR_RETURN(*response.mutable_metadata(), mesh_->Metadata(with_boundary));
    metadata_sent_ = true;
    return Serialize(response);
  }
  environment().log.debug("call={} chunk={}", id(), next_chunk_);
  return mesh_->SerializeChunk(next_chunk_++, v1::DownloadMeshResponse::kChunkFieldNumber, with_boundary);
}

LogFields DownloadMeshCall::Figures() const {
  LogFields figures;
  if (mesh_ != nullptr) {
    figures.Add("session", request_.name())
        .Add("vertices", mesh_->figures().vertices)
        .Add("chunks", next_chunk_ - request_.next_chunk());
  }
  return figures;
}

}  // namespace wellspace::server
