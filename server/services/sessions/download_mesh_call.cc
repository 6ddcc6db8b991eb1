#include "server/services/sessions/download_mesh_call.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/jobs/job_size.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Before a call asks again whose mesh another one cuts, or that found the queue full, at most: so thousands of calls
// that wait cost next to nothing.
constexpr absl::Duration kMostRetryDelay = absl::Milliseconds(500);

}  // namespace

void DownloadMeshCall::OnBegin() {
  if (absl::Status status = Find(); !status.ok()) {
    End(std::move(status));
  } else if (request_.has_partition()) {
    WantPart();
  } else {
    WriteNext();
  }
}

void DownloadMeshCall::OnEnd() {
  if (job_ != nullptr) {
    environment().jobs.Cancel(job_);  // it uses the session until its end
  } else {
    use_.reset();
  }
}

absl::Status DownloadMeshCall::CheckRequest() const {
  WELLSPACE_RETURN_IF_ERROR(RevisionFromProto(request_.has_revision(), request_.revision(), "revision").status());
  WELLSPACE_RETURN_IF_ERROR(
      RevisionFromProto(request_.has_since_revision(), request_.since_revision(), "since_revision").status());
  if (!request_.has_partition()) {
    return absl::OkStatus();
  }
  if (IsDelta()) {
    return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                     "partition and since_revision exclude each other: there are no differences of parts", "partition");
  }
  return CheckPartition(request_.partition());
}

absl::Status DownloadMeshCall::Find() {
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(&bytes_, &request_));
  WELLSPACE_RETURN_IF_ERROR(CheckRequest());
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request_.name()));
  std::shared_ptr<const MeshSnapshot> mesh = session->meshes().last();
  if (mesh == nullptr) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat(session->name(), " has no mesh yet; refine it first"));
  }
  mesh_ = std::move(mesh);
  next_chunk_ = request_.next_chunk();
  if (request_.has_partition()) {
    WELLSPACE_RETURN_IF_ERROR(CheckPartitionOf(mesh_->record().simplices(), request_.partition()));
    WELLSPACE_RETURN_IF_ERROR(CheckRevision(mesh_->revision()));
    use_.emplace(std::move(session));
    return absl::OkStatus();
  }
  if (IsDelta()) {
    WELLSPACE_RETURN_IF_ERROR(FindDeltas(*session));
  }
  WELLSPACE_RETURN_IF_ERROR(CheckRevision(deltas_.empty() ? mesh_->revision() : deltas_[0]->revision()));
  WELLSPACE_RETURN_IF_ERROR(environment().sessions.ErrorOfFile(*session, BeginPart()));
  WELLSPACE_RETURN_IF_ERROR(CheckNextChunk());
  // The client has it, or differences that lead to it, from now on: those of later meshes from it are of use.
  session->meshes().deltas().NoteDownload(mesh_->revision());
  use_.emplace(std::move(session));
  return absl::OkStatus();
}

core::PartitionOptions DownloadMeshCall::Partition() const {
  return {.parts = request_.partition().parts(), .contiguous = request_.partition().contiguous()};
}

void DownloadMeshCall::WantPart() {
  const SessionMeshes& meshes = use_->session().meshes();
  const bool is_cut = meshes.HasCut(*mesh_, Partition());
  if (!is_cut && meshes.IsCutting()) {
    TryLater();
    return;
  }
  absl::StatusOr<std::shared_ptr<Job>> job = environment().jobs.Submit(
      {.tenant = caller().tenant,
       .is_small = IsSmallPart(is_cut, mesh_->record().simplices()),
       .work = [self = SharedAs<DownloadMeshCall>()](Job& running) { self->TakePartIn(running); }});
  if (job.ok()) {
    job_ = *std::move(job);
  } else {
    environment().log.debug("call={} waits for a place in the queue", id());
    TryLater();  // all ranks of a solver ask at once
  }
}

void DownloadMeshCall::TryLater() {
  environment().background.PostAfter(retry_delay_, WeakCall(&DownloadMeshCall::TryAgain));
  retry_delay_ = std::min(2 * retry_delay_, kMostRetryDelay);
}

void DownloadMeshCall::TryAgain() {
  std::lock_guard lock(mutex_);
  if (!ending()) {
    WantPart();
  }
}

void DownloadMeshCall::TakePartIn(Job& job) {
  const WantedPart wanted{.part = request_.partition().part(),
                          .ghost_layers = request_.partition().ghost_layers(),
                          .with_boundary = request_.with_boundary()};
  std::shared_ptr<const PartSnapshot> part;
  bool is_at_work = false;
  absl::Status status = RunGuarded([&] {
    WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshCut> cut,
                               use_->session().meshes().PrepareCut(mesh_, Partition(), job, &is_at_work));
    if (!is_at_work) {
      WELLSPACE_ASSIGN_OR_RETURN(part, TakePart(*cut, *mesh_, wanted, job));
    }
    return absl::OkStatus();
  });
  status = environment().sessions.ErrorOfFile(use_->session(), status);
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
  use_->session().NoteIdle();
  std::lock_guard lock(mutex_);
  if (ending()) {
    return;
  }
  job_ = nullptr;
  if (is_at_work) {
    TryLater();
    return;
  }
  part_ = std::move(part);
  if (status.ok()) {
    status = BeginPart();
  }
  if (status.ok()) {
    status = CheckNextChunk();
  }
  if (!status.ok()) {
    End(std::move(status));
    return;
  }
  WriteNext();
}

absl::Status DownloadMeshCall::FindDeltas(const Session& session) {
  if (request_.since_revision() > mesh_->revision()) {
    return MakeError(
        v1::ERROR_REASON_INVALID_REQUEST,
        absl::StrCat("since_revision is ", request_.since_revision(), "; expected the revision of a mesh of ",
                     session.name(), ", the last of which is of revision ", mesh_->revision()),
        "since_revision");
  }
  WELLSPACE_ASSIGN_OR_RETURN(deltas_, session.meshes().deltas().Between(request_.since_revision(), mesh_->revision()));
  return absl::OkStatus();
}

absl::Status DownloadMeshCall::CheckRevision(uint64_t revision) const {
  if (request_.revision() != 0 && request_.revision() != revision) {
    return MakeError(
        absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_REVISION_MISMATCH,
        absl::StrCat(
            IsDelta() ? "the first difference is to the mesh of revision " : "the mesh of the session is of revision ",
            revision, ", not ", request_.revision(), " as asked for; download it from its first chunk"),
        "revision");
  }
  return absl::OkStatus();
}

absl::Status DownloadMeshCall::CheckNextChunk() const {
  if (next_chunk_ > chunks_) {
    return MakeError(v1::ERROR_REASON_CHUNK_OUT_OF_RANGE,
                     absl::StrCat("next_chunk is ", next_chunk_, "; the ",
                                  IsDelta()          ? "difference"
                                  : part_ != nullptr ? "part"
                                                     : "mesh",
                                  " has ", chunks_, " chunks, numbered from 0"),
                     "next_chunk");
  }
  return absl::OkStatus();
}

absl::Status DownloadMeshCall::BeginPart() {
  metadata_sent_ = false;
  if (part_ != nullptr) {
    chunks_ = part_->chunk_count();
  } else if (!IsDelta()) {
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
    End(environment().sessions.ErrorOfFile(use_->session(), response.status()));
    return std::nullopt;
  }
  return *std::move(response);
}

absl::StatusOr<v1::MeshMetadata> DownloadMeshCall::Metadata() const {
  if (part_ != nullptr) {
    return part_->metadata();
  }
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
  if (part_ != nullptr) {
    return part_->SerializeChunk(next_chunk_++, v1::DownloadMeshResponse::kChunkFieldNumber);
  }
  return mesh_->SerializeChunk(next_chunk_++, v1::DownloadMeshResponse::kChunkFieldNumber, request_.with_boundary());
}

LogFields DownloadMeshCall::Figures() const {
  LogFields figures;
  if (mesh_ != nullptr) {
    figures.Add("session", request_.name()).Add("vertices", mesh_->record().vertices()).Add("chunks", sent_chunks_);
    if (request_.has_partition()) {
      figures.Add("parts", uint64_t{request_.partition().parts()}).Add("part", uint64_t{request_.partition().part()});
    }
    if (IsDelta()) {
      figures.Add("since", request_.since_revision()).Add("deltas", uint64_t{deltas_.size()});
    }
  }
  return figures;
}

}  // namespace wellspace::server
