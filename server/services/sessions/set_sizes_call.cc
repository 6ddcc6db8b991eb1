#include "server/services/sessions/set_sizes_call.h"

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/retry_with_room.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void SetSizesCall::OnBegin() {
  memory_ = environment().memory.ReserveNothing();
  ReserveAndRead();
}

void SetSizesCall::ReserveAndRead() {
  ReserveThen(
      kMessageBytes + sizes_.bytes(), [this] { return ReserveFor(0); }, [this] { ReadNext(); });
}

absl::Status SetSizesCall::ReserveFor(uint64_t more) {
  const uint64_t bytes = kMessageBytes + sizes_.bytes() + more;
  return memory_.Resize(bytes) ? absl::OkStatus() : environment().memory.Refusal(bytes, "sizes at points");
}

void SetSizesCall::OnRequest(grpc::ByteBuffer* bytes) {
  if (absl::Status status = RunGuarded([&] { return Take(bytes); }); !status.ok()) {
    End(std::move(status));
  } else {
    ReserveAndRead();
  }
}

absl::Status SetSizesCall::Take(grpc::ByteBuffer* bytes) {
  v1::SetSizesRequest request;
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, &request));
  if (!session_.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request.name()));
    session_.emplace(std::move(session));
    WELLSPACE_ASSIGN_OR_RETURN(expected_revision_, ExpectedRevisionOf(request));
  }
  if (request.sizes_case() == v1::SetSizesRequest::SIZES_NOT_SET) {
    return absl::OkStatus();
  }
  if (sizes_case_ == v1::SetSizesRequest::SIZES_NOT_SET) {
    sizes_case_ = request.sizes_case();
    const v1::VertexSizes& sizes = request.vertex_sizes();
    WELLSPACE_ASSIGN_OR_RETURN(mesh_revision_, RevisionFromProto(sizes.has_mesh_revision(), sizes.mesh_revision(),
                                                                 "vertex_sizes.mesh_revision"));
  } else if (request.sizes_case() != sizes_case_) {
    return MakeError(v1::ERROR_REASON_INVALID_SIZES,
                     "there are samples as well as vertex_sizes; send either of them in all messages",
                     request.has_samples() ? "samples" : "vertex_sizes");
  }
  return TakeSamples(request);
}

absl::Status SetSizesCall::TakeSamples(v1::SetSizesRequest& request) {
  const uint64_t count = request.has_samples() ? request.samples().sizes_size() : request.vertex_sizes().sizes_size();
  if (const uint64_t all = sizes_.count() + count; all > environment().options.max_points) {
    return MakeError(v1::ERROR_REASON_TOO_MANY_POINTS,
                     absl::StrCat("there are ", all, " samples of sizes; a session of this server has at most ",
                                  environment().options.max_points));
  }
  if (request.has_samples()) {
    const int dimension = session_->session().dimension();
    WELLSPACE_RETURN_IF_ERROR(CheckSizes(request.samples(), sizes_.count(), dimension, "samples"));
    sizes_.Append(request.mutable_samples());
  } else {
    WELLSPACE_RETURN_IF_ERROR(CheckSizes(request.vertex_sizes(), sizes_.count(), "vertex_sizes"));
    sizes_.Append(request.mutable_vertex_sizes());
  }
  count_ = sizes_.count();
  return absl::OkStatus();
}

void SetSizesCall::OnRequestsEnd() {
  if (!session_.has_value()) {
    End(MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                  "the stream ended before any request; send the name of the session first", "name"));
    return;
  }
  const auto sizes = std::make_shared<SizeStore>(std::exchange(sizes_, {}));
  const bool of_vertices = sizes_case_ == v1::SetSizesRequest::kVertexSizes;
  environment().blocking.Run(session_->session().name(), [self = SharedAs<SetSizesCall>(), sizes, of_vertices] {
    absl::Status status = RunGuarded([&] { return self->Set(std::move(*sizes), of_vertices); });
    std::lock_guard lock(self->mutex_);
    if (!self->ending()) {
      if (status.ok()) {
        v1::SetSizesResponse response;
        const std::shared_ptr<const SessionState> state = self->session_->session().state();
        response.set_size_count(state->record.size_count());
        response.set_revision(state->record.revision());
        *self->response_ = Serialize(response);
      }
      self->End(std::move(status));
    }
  });
}

absl::Status SetSizesCall::Set(SizeStore sizes, bool of_vertices) {
  if (of_vertices) {
    WELLSPACE_RETURN_IF_ERROR(FindPoints(sizes));
  }
  MemoryReservation received;  // the session sets memory aside for them, as far as it had none
  {
    std::lock_guard lock(mutex_);
    received = std::move(memory_);
  }
  const std::shared_ptr<const core::SizeSamples> samples = sizes.Take(core::RunContext());
  return RetryWithRoom(environment().memory, samples == nullptr ? 0 : samples->bytes(),
                       [&] { return session_->session().SetSizes(samples, expected_revision_, &received); });
}

absl::Status SetSizesCall::FindPoints(SizeStore& sizes) {
  const Session& session = session_->session();
  const std::shared_ptr<const MeshSnapshot> mesh = session.meshes().last();
  if (mesh == nullptr) {
    return MakeError(v1::ERROR_REASON_MESH_NOT_READY,
                     absl::StrCat(session.name(), " has no mesh yet, and so no vertices; send samples with points"));
  }
  if (mesh_revision_ != 0 && mesh->revision() != mesh_revision_) {
    return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                     absl::StrCat("vertex_sizes.mesh_revision is ", mesh_revision_, ", but the mesh of ",
                                  session.name(), " is of revision ", mesh->revision()));
  }
  if (mesh->record().vertices() != sizes.count()) {
    return MakeError(v1::ERROR_REASON_INVALID_SIZES,
                     absl::StrCat("vertex_sizes.sizes: there are ", sizes.count(), ", but the mesh has ",
                                  mesh->record().vertices(), " vertices; send one for each"),
                     "vertex_sizes.sizes");
  }
  {
    std::lock_guard lock(mutex_);
    const uint64_t coordinates = sizes.count() * session.dimension();
    WELLSPACE_RETURN_IF_ERROR(ReserveFor(sizes.bytes() + 2 * coordinates * sizeof(double)));
  }
  const absl::StatusOr<core::HugeVector<double>> points = mesh->LoadPoints(core::RunContext());
  if (!points.ok()) {
    return environment().sessions.ErrorOfFile(session, points.status());
  }
  sizes.SetPoints(*points);
  return absl::OkStatus();
}

void SetSizesCall::OnEnd() {
  sizes_ = SizeStore();
  memory_.Release();
}

LogFields SetSizesCall::Figures() const {
  LogFields figures;
  if (session_.has_value()) {
    figures.Add("session", session_->session().name()).Add("sizes", count_);
  }
  return figures;
}

}  // namespace wellspace::server
