#include "server/services/sessions/download_mesh_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
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
  WELLSPACE_RETURN_IF_ERROR(RevisionFromProto(request_.has_revision(), request_.revision(), "revision").status());
  WELLSPACE_RETURN_IF_ERROR(
      RevisionFromProto(request_.has_since_revision(), request_.since_revision(), "since_revision").status());
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request_.name()));
  std::shared_ptr<const MeshSnapshot> mesh = session->mesh();
  if (mesh == nullptr) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat(session->name(), " has no mesh yet; refine it first"));
  }
  mesh_ = std::move(mesh);
  // The client has it, or differences that lead to it, from now on: those of later meshes from it are of use.
  session->deltas().NoteDownload(mesh_->revision());
  if (IsDelta()) {
    WELLSPACE_RETURN_IF_ERROR(FindDeltas(*session));
  }
  next_chunk_ = request_.next_chunk();
  WELLSPACE_RETURN_IF_ERROR(BeginPart());
  WELLSPACE_RETURN_IF_ERROR(CheckContinued(deltas_.empty() ? mesh_->revision() : deltas_[0]->revision(), chunks_));
  use_.emplace(std::move(session));
  return absl::OkStatus();
}

absl::Status DownloadMeshCall::FindDeltas(const Session& session) {
  if (request_.since_revision() > mesh_->revision()) {
    return MakeError(
        v1::ERROR_REASON_INVALID_REQUEST,
        absl::StrCat("since_revision is ", request_.since_revision(), "; expected the revision of a mesh of ",
                     session.name(), ", the last of which is of revision ", mesh_->revision()),
        "since_revision");
  }
  WELLSPACE_ASSIGN_OR_RETURN(deltas_, session.deltas().Between(request_.since_revision(), mesh_->revision()));
  return absl::OkStatus();
}

absl::Status DownloadMeshCall::CheckContinued(uint64_t revision, uint64_t chunks) const {
  if (request_.revision() != 0 && request_.revision() != revision) {
    return MakeError(
        absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_REVISION_MISMATCH,
        absl::StrCat(
            IsDelta() ? "the first difference is to the mesh of revision " : "the mesh of the session is of revision ",
            revision, ", not ", request_.revision(), " as asked for; download it from its first chunk"),
        "revision");
  }
  if (request_.next_chunk() > chunks) {
    return MakeError(v1::ERROR_REASON_CHUNK_OUT_OF_RANGE,
                     absl::StrCat("next_chunk is ", request_.next_chunk(), "; the ", IsDelta() ? "difference" : "mesh",
                                  " has ", chunks, " chunks, numbered from 0"),
                     "next_chunk");
  }
  return absl::OkStatus();
}

absl::Status DownloadMeshCall::BeginPart() {
  metadata_sent_ = false;
  if (!IsDelta()) {
    WELLSPACE_ASSIGN_OR_RETURN(chunks_, mesh_->ChunkCount(request_.with_boundary()));
  } else {
    chunks_ = deltas_.empty() ? 0 : deltas_[delta_]->PartCount(request_.with_boundary());
  }
  return absl::OkStatus();
}

std::optional<grpc::ByteBuffer> DownloadMeshCall::NextResponse() {
  if (metadata_sent_ && next_chunk_ == chunks_) {
    if (delta_ + 1 >= deltas_.size()) {
      End(absl::OkStatus());
      return std::nullopt;
    }
    ++delta_;
    next_chunk_ = 0;
    if (absl::Status status = BeginPart(); !status.ok()) {
      End(std::move(status));
      return std::nullopt;
    }
  }
  absl::StatusOr<grpc::ByteBuffer> response = MakeResponse();
  if (!response.ok()) {
    End(std::move(response).status());
    return std::nullopt;
  }
  return *std::move(response);
}

absl::StatusOr<v1::MeshMetadata> DownloadMeshCall::Metadata() const {
  if (!deltas_.empty()) {
    return deltas_[delta_]->Metadata(request_.with_boundary());
  }
  WELLSPACE_ASSIGN_OR_RETURN(v1::MeshMetadata metadata, mesh_->Metadata(request_.with_boundary()));
  if (IsDelta()) {
    metadata.set_chunk_count(0);
    metadata.mutable_delta()->set_base_revision(mesh_->revision());
  }
  return metadata;
}

absl::StatusOr<grpc::ByteBuffer> DownloadMeshCall::MakeResponse() {
  if (!metadata_sent_) {
    v1::DownloadMeshResponse response;
    WELLSPACE_ASSIGN_OR_RETURN(*response.mutable_metadata(), Metadata());
    metadata_sent_ = true;
    return Serialize(response);
  }
  environment().log.debug("call={} chunk={}", id(), next_chunk_);
  ++sent_chunks_;
  if (!deltas_.empty()) {
    return deltas_[delta_]->Part(next_chunk_++);
  }
  return mesh_->SerializeChunk(next_chunk_++, v1::DownloadMeshResponse::kChunkFieldNumber, request_.with_boundary());
}

LogFields DownloadMeshCall::Figures() const {
  LogFields figures;
  if (mesh_ != nullptr) {
    figures.Add("session", request_.name()).Add("vertices", mesh_->record().vertices()).Add("chunks", sent_chunks_);
    if (IsDelta()) {
      figures.Add("since", request_.since_revision()).Add("deltas", uint64_t{deltas_.size()});
    }
  }
  return figures;
}

}  // namespace wellspace::server
