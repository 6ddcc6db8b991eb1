#include "server/services/queries/locate_call.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/mesh_locator.h"
#include "core/simplex/locator.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Of one call: its answer is then within the 4 MiB that clients of gRPC take.
constexpr int kMostLocated = 32'768;

// Refuses points that are no numbers. `offset`: the number from which errors count, here and below.
absl::Status CheckFinite(std::span<const double> points, int dimension, uint64_t offset) {
  const auto wrong = std::ranges::find_if(points, [](double x) { return !std::isfinite(x); });
  if (wrong == points.end()) {
    return absl::OkStatus();
  }
  const auto place = static_cast<uint64_t>(wrong - points.begin());
  return MakeError(v1::ERROR_REASON_INVALID_POINTS,
                   absl::StrCat("points[", offset + place / dimension, "]: coordinate ", place % dimension, " is ",
                                *wrong, "; a finite number is needed"),
                   "points");
}

// Refuses points in no simplex.
absl::Status CheckInside(const core::LocatedPoints& located, uint64_t offset) {
  const auto outside = std::ranges::find(located.simplices, core::kNoSimplex);
  if (outside == located.simplices.end()) {
    return absl::OkStatus();
  }
  return MakeError(v1::ERROR_REASON_INVALID_POINTS,
                   absl::StrCat("points[", offset + (outside - located.simplices.begin()),
                                "] lies in no simplex: outside the domain, or in a hole; give points of the mesh, or "
                                "set allow_outside"),
                   "points");
}

void Fill(const core::LocatedPoints& located, v1::LocateResponse& response) {
  response.mutable_simplices()->Assign(located.simplices.begin(), located.simplices.end());
  response.mutable_vertices()->Assign(located.vertices.begin(), located.vertices.end());
  response.mutable_coordinates()->Assign(located.coordinates.begin(), located.coordinates.end());
}

}  // namespace

void LocateCall::OnBegin() {
  if (absl::Status status = Submit(); !status.ok()) {
    End(std::move(status));
  }
}

absl::Status LocateCall::Submit() {
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request_->name()));
  const int dimension = session->dimension();
  if (request_->points_size() % dimension != 0) {
    return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                     absl::StrCat("there are ", request_->points_size(), " coordinates; expected a multiple of the ",
                                  "dimension ", dimension),
                     "points");
  }
  count_ = request_->points_size() / dimension;
  if (count_ > kMostLocated) {
    return MakeError(
        v1::ERROR_REASON_INVALID_REQUEST,
        absl::StrCat("there are ", count_, " points; a call locates at most ", kMostLocated, ": make several"),
        "points");
  }
  points_.assign(request_->points().begin(), request_->points().end());
  offset_ = request_->point_offset();
  WELLSPACE_RETURN_IF_ERROR(CheckFinite(points_, dimension, offset_));
  WELLSPACE_ASSIGN_OR_RETURN(revision_, RevisionFromProto(request_->has_revision(), request_->revision(), "revision"));
  allow_outside_ = request_->allow_outside();
  const bool is_small = session->meshes().HasLocator(revision_);
  use_.emplace(std::move(session));
  WELLSPACE_ASSIGN_OR_RETURN(
      job_, environment().jobs.Submit({.tenant = caller().tenant,
                                       .is_small = is_small,
                                       .work = [self = SharedAs<LocateCall>()](Job& job) { self->Locate(job); }}));
  return absl::OkStatus();
}

void LocateCall::Locate(Job& job) {
  core::LocatedPoints located;
  uint64_t revision = 0;
  uint64_t vertices = 0;
  absl::Status status = RunGuarded([&] {
    WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const LocatedMesh> mesh,
                               use_->session().meshes().PrepareLocator(revision_, job));
    WELLSPACE_ASSIGN_OR_RETURN(located, mesh->locator->Locate(points_, job.context()));
    revision = mesh->revision;
    vertices = mesh->vertices;
    return allow_outside_ ? absl::OkStatus() : CheckInside(located, offset_);
  });
  status = environment().sessions.ErrorOfFile(use_->session(), status);
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
  use_->session().NoteIdle();
  std::lock_guard lock(mutex_);
  if (ending()) {
    return;
  }
  if (status.ok()) {
    Fill(located, *response_);
    response_->set_revision(revision);
    response_->set_vertex_count(vertices);
  }
  End(std::move(status));
}

void LocateCall::OnEnd() {
  if (job_ != nullptr) {
    environment().jobs.Cancel(job_);
  }
}

LogFields LocateCall::Figures() const {
  LogFields figures;
  figures.Add("session", request_->name()).Add("points", count_);
  return figures;
}

}  // namespace wellspace::server
