#include "server/services/queries/query_call.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "core/input/mesh_parameters.h"
#include "server/base/options.h"
#include "server/jobs/job_size.h"
#include "server/services/resource_names.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// A batch is full when it has as many bytes: answers of one more look leave it within kMaxResponseBytes, cells in 6-D
// excepted.
constexpr uint64_t kFullBatchBytes = kMaxResponseBytes / 4 * 3;

// Before a job comes again that found the queue full, or the structure being built by another.
constexpr absl::Duration kQueryRetryDelay = absl::Milliseconds(50);

// Vertices of one look at the structure, by dimension: about a millisecond. Cells grow sixfold with each dimension.
constexpr std::array<uint64_t, core::kMaxDimension + 1> kVerticesPerLook = {0, 0, 512, 128, 16, 2, 1};

}  // namespace

void QueryCall::OnBegin() {
  // The request as bytes and as numbers; batches that wait, one that is made, and one that is written.
  const uint64_t bytes = 2 * bytes_.Length() + (kBatchesAhead + 3) * kMaxResponseBytes;
  const auto reserve = [this, bytes] {
    WELLSPACE_ASSIGN_OR_RETURN(memory_, environment().memory.Reserve(bytes, "the batches of a query"));
    return absl::OkStatus();
  };
  ReserveThen(bytes, reserve, [this] {
    if (absl::Status status = Find(); !status.ok()) {
      End(std::move(status));
      return;
    }
    WorkAhead();
  });
}

absl::Status QueryCall::Find() {
  WELLSPACE_ASSIGN_OR_RETURN(request_, parse_(&bytes_));
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request_.session));
  use_.emplace(std::move(session));
  return absl::OkStatus();
}

void QueryCall::WorkAhead() {
  if (work_ != Work::kIdle || ready_.size() > kBatchesAhead / 2) {
    return;
  }
  const Session::Size size = use_->session().GetSize(0);
  absl::StatusOr<std::shared_ptr<Job>> job =
      environment().jobs.Submit({.tenant = caller().tenant,
                                 .is_small = IsSmallAddition(0, size.vertices, size.replayed_steps),
                                 .of_call = memory_.bytes(),
                                 .work = [self = SharedAs<QueryCall>()](Job& running) { self->MakeBatches(running); }});
  if (job.ok()) {
    work_ = Work::kUnderWay;
    job_ = *std::move(job);
  } else if (job_ == nullptr) {
    End(std::move(job).status());
  } else {
    environment().log.debug("call={} the queue is full", id());
    work_ = Work::kRefused;
    environment().background.PostAfter(kQueryRetryDelay, WeakCall(&QueryCall::TryAgain));
  }
}

void QueryCall::TryAgain() {
  std::lock_guard lock(mutex_);
  if (!ending()) {
    work_ = Work::kIdle;
    WorkAhead();
  }
}

void QueryCall::MakeBatches(Job& job) {
  bool has_room = true;
  while (has_room) {
    grpc::ByteBuffer batch;
    bool is_at_work = false;
    absl::Status status = RunGuarded([&] {
      absl::Status filled = FillBatch(job, &is_at_work);
      if (filled.ok() && request_.query->batch_bytes() > 0) {
        batch = request_.query->TakeBatch();
      }
      return filled;
    });
    std::lock_guard lock(mutex_);
    if (ending()) {
      return;
    }
    if (is_at_work) {  // the filled batches stay
      environment().log.debug("call={} waits for the structure", id());
      work_ = Work::kRefused;
      environment().background.PostAfter(kQueryRetryDelay, WeakCall(&QueryCall::TryAgain));
      return;
    }
    if (!status.ok()) {
      End(std::move(status));
      return;
    }
    if (batch.Valid()) {
      ready_.push_back(std::move(batch));
    }
    has_room = next_ < *count_ && ready_.size() < kBatchesAhead;
    if (!has_room) {
      work_ = next_ < *count_ ? Work::kIdle : Work::kDone;
    }
    WriteNext();
  }
}

absl::Status QueryCall::FillBatch(Job& job, bool* is_at_work) {
  Session& session = use_->session();
  if (!structure_.has_value()) {
    structure_.emplace(use_->session_ptr());
  }
  do {
    WELLSPACE_RETURN_IF_ERROR(job.context().Check());
    WELLSPACE_RETURN_IF_ERROR(session.PrepareStructure(0, environment().create_mesher, job, is_at_work));
    WELLSPACE_RETURN_IF_ERROR(session.Query(&version_, [this](const core::Mesher& mesher) { return Ask(mesher); }));
  } while (next_ < *count_ && request_.query->batch_bytes() < kFullBatchBytes);
  return absl::OkStatus();
}

absl::Status QueryCall::Ask(const core::Mesher& mesher) {
  const std::vector<uint32_t>& vertices = request_.vertices;
  if (!count_.has_value()) {
    const uint64_t vertex_count = mesher.vertex_count();
    const auto missing =
        std::find_if(vertices.begin(), vertices.end(), [&](uint32_t vertex) { return vertex >= vertex_count; });
    if (missing != vertices.end()) {
      const auto index = missing - vertices.begin();
      return MakeError(v1::ERROR_REASON_VERTEX_OUT_OF_RANGE,
                       absl::StrCat("vertices[", index, "] is ", *missing, "; there are ", vertex_count,
                                    " vertices, numbered from 0"),
                       absl::StrCat("vertices[", index, "]"));
    }
    count_ = vertices.empty() ? vertex_count : vertices.size();
  }
  const uint64_t size = std::min(kVerticesPerLook[mesher.dimension()], *count_ - next_);
  std::vector<uint32_t> some(size);
  if (vertices.empty()) {
    std::iota(some.begin(), some.end(), static_cast<uint32_t>(next_));
  } else {
    std::copy_n(vertices.begin() + static_cast<std::ptrdiff_t>(next_), size, some.begin());
  }
  WELLSPACE_RETURN_IF_ERROR(request_.query->Ask(mesher, some));
  next_ += size;
  environment().observability.work().OnCells(size);
  return absl::OkStatus();
}

std::optional<grpc::ByteBuffer> QueryCall::NextResponse() {
  if (ready_.empty()) {
    if (work_ == Work::kDone) {
      End(absl::OkStatus());
    }
    return std::nullopt;
  }
  grpc::ByteBuffer batch = std::move(ready_.front());
  ready_.pop_front();
  environment().log.debug("call={} batch={}", id(), batches_);
  ++batches_;
  WorkAhead();
  return batch;
}

void QueryCall::OnEnd() {
  ready_.clear();
  if (job_ != nullptr) {
    environment().jobs.Cancel(job_);
  }
}

LogFields QueryCall::Figures() const {
  LogFields figures;
  figures.Add("session", request_.session).Add("batches", batches_);
  return figures;
}

}  // namespace wellspace::server
