#include "server/services/queries/transfer_values_call.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/base/options.h"
#include "server/calls/wire.h"
#include "server/jobs/job_size.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kMostComponents = 64;

// Numbers of one response, which has some bytes besides.
constexpr uint64_t kValuesOfAResponse = (kMaxResponseBytes - 64) / sizeof(double);

absl::Status Invalid(const std::string& message, const std::string& field) {
  return MakeError(v1::ERROR_REASON_INVALID_REQUEST, message, field);
}

}  // namespace

void TransferValuesCall::OnBegin() {
  memory_ = environment().memory.ReserveNothing();
  ReserveAndRead();
}

void TransferValuesCall::ReserveAndRead() {
  const uint64_t bytes = kMessageBytes + values_.bytes();
  const auto reserve = [this, bytes] {
    return memory_.Resize(bytes) ? absl::OkStatus() : environment().memory.Refusal(bytes, "the values of a field");
  };
  ReserveThen(bytes - std::min(bytes, memory_.bytes()), reserve, [this] { ReadNext(); });
}

void TransferValuesCall::OnRequest(grpc::ByteBuffer* bytes) {
  if (absl::Status status = RunGuarded([&] { return Take(bytes); }); !status.ok()) {
    End(std::move(status));
  } else {
    ReserveAndRead();
  }
}

absl::Status TransferValuesCall::Take(grpc::ByteBuffer* bytes) {
  v1::TransferValuesRequest request;
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, &request));
  if (request.has_start() && use_.has_value()) {
    return Invalid("there is a start in a message that is not the first; send values alone", "start");
  }
  if (request.has_start()) {
    return TakeStart(request.start());
  }
  if (!use_.has_value()) {
    return Invalid("the first message has no start; send the name of the session first", "start");
  }
  return TakeValues(*request.mutable_values());
}

absl::Status TransferValuesCall::TakeStart(const v1::TransferValuesRequest::Start& start) {
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t from,
                             RevisionFromProto(true, start.from_revision(), "start.from_revision"));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t revision,
                             RevisionFromProto(start.has_revision(), start.revision(), "start.revision"));
  if (start.place() != v1::FIELD_PLACE_VERTICES && start.place() != v1::FIELD_PLACE_SIMPLICES) {
    return Invalid(
        absl::StrCat("start.place is ", start.place(), "; expected FIELD_PLACE_VERTICES or FIELD_PLACE_SIMPLICES"),
        "start.place");
  }
  place_ = start.place();
  components_ = start.has_components() ? start.components() : 1;
  if (components_ == 0 || components_ > kMostComponents) {
    return Invalid(absl::StrCat("start.components is ", components_, "; expected 1 to ", kMostComponents),
                   "start.components");
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), start.name()));
  is_conservative_ = start.conservative();
  if (is_conservative_ && (place_ != v1::FIELD_PLACE_SIMPLICES || session->dimension() > 3)) {
    return Invalid(absl::StrCat("start.conservative is for values of simplices, in 2-D and 3-D; they are of ",
                                place_ == v1::FIELD_PLACE_SIMPLICES ? "simplices" : "vertices", ", in ",
                                session->dimension(), "-D"),
                   "start.conservative");
  }
  WELLSPACE_ASSIGN_OR_RETURN(from_, session->meshes().Kept(from));
  onto_ = session->meshes().last();
  if (revision != 0 && revision != onto_->revision()) {
    return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                     absl::StrCat("start.revision is ", revision, ", but the mesh of ", session->name(),
                                  " is of revision ", onto_->revision()),
                     "start.revision");
  }
  use_.emplace(std::move(session));
  return absl::OkStatus();
}

absl::Status TransferValuesCall::TakeValues(v1::FieldValues& values) {
  count_ += values.values_size();
  if (count_ > wanted_count()) {
    return Invalid(absl::StrCat("there are more than ", wanted_count(), " values; the mesh of revision ",
                                from_->revision(), " has ", RowsOf(*from_), " rows of ", components_),
                   "values");
  }
  values_.Append(values.mutable_values());
  return absl::OkStatus();
}

uint64_t TransferValuesCall::RowsOf(const MeshSnapshot& mesh) const {
  return place_ == v1::FIELD_PLACE_VERTICES ? mesh.record().vertices() : mesh.record().simplices();
}

void TransferValuesCall::OnRequestsEnd() {
  if (absl::Status status = RunGuarded([&] { return Submit(); }); !status.ok()) {
    End(std::move(status));
  }
}

absl::Status TransferValuesCall::Submit() {
  if (!use_.has_value()) {
    return MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                     "the stream ended before any request; send the name of the session first", "start");
  }
  if (count_ != wanted_count()) {
    return Invalid(absl::StrCat("there are ", count_, " values; expected ", wanted_count(), ": the mesh of revision ",
                                from_->revision(), " has ", RowsOf(*from_), " rows of ", components_),
                   "values");
  }
  (void)memory_.Resize(values_.bytes());  // no more than it was
  // std::function wants to be copied, values do not.
  const auto values = std::make_shared<NumberChunks>(std::exchange(values_, {}));
  const uint64_t simplices = std::max(from_->record().simplices(), onto_->record().simplices());
  WELLSPACE_ASSIGN_OR_RETURN(
      job_, environment().jobs.Submit(
                {.tenant = caller().tenant,
                 .is_small = IsSmallTransfer(simplices, components_) && !is_conservative_,
                 .held = std::move(memory_),
                 .work = [self = SharedAs<TransferValuesCall>(), values](Job& job) { self->Work(*values, job); }}));
  return absl::OkStatus();
}

void TransferValuesCall::Work(NumberChunks& values, Job& job) {
  MemoryReservation memory;  // first: it is given back when the values are freed
  core::CarriedField carried;
  absl::Status status = RunGuarded([&] {
    const std::vector<double> numbers = values.Flatten(job.context());
    WELLSPACE_RETURN_IF_ERROR(job.context().Check());
    WELLSPACE_ASSIGN_OR_RETURN(carried, Carry(numbers, job));
    return absl::OkStatus();
  });
  if (absl::IsInvalidArgument(status)) {
    status = Invalid(std::string(status.message()), "values");
  }
  status = environment().sessions.ErrorOfFile(use_->session(), status);
  memory = job.TakeMemory(carried.values.size() * sizeof(double));
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
  {
    std::lock_guard lock(mutex_);
    from_ = nullptr;  // other work may have its memory
    if (!ending() && status.ok()) {
      memory_ = std::move(memory);
      carried_ = std::move(carried);
      WriteNext();
    } else if (!ending()) {
      End(std::move(status));
    }
  }
  use_->session().NoteIdle();
}

absl::StatusOr<core::CarriedField> TransferValuesCall::Carry(const std::vector<double>& values, Job& job) {
  const int threads = use_->session().state()->parameters->threads;
  const core::CarryRun run{.context = job.context(),
                           .held_bytes = from_->loaded_bytes() + onto_->loaded_bytes(),
                           .threads = std::min(threads, environment().options.max_threads)};
  WELLSPACE_RETURN_IF_ERROR(job.context().AllowMemory(run.held_bytes));
  WELLSPACE_ASSIGN_OR_RETURN(const core::Mesh from, from_->Load(job.context()));
  WELLSPACE_ASSIGN_OR_RETURN(const core::Mesh onto, onto_->Load(job.context()));
  const auto view_of = [](const core::Mesh& mesh) {
    return core::MeshView{.dimension = mesh.dimension, .points = mesh.points, .simplices = mesh.simplices};
  };
  const core::Carrying carrying = place_ == v1::FIELD_PLACE_VERTICES ? core::Carrying::kLinear
                                  : is_conservative_                 ? core::Carrying::kMeans
                                                                     : core::Carrying::kConstant;
  return core::CarryField(carrying, {.values = values, .components = components_}, view_of(from), view_of(onto), run);
}

std::optional<grpc::ByteBuffer> TransferValuesCall::NextResponse() {
  if (!carried_.has_value()) {
    return std::nullopt;
  }
  v1::TransferValuesResponse response;
  if (!next_.has_value()) {
    next_ = 0;
    response.mutable_start()->set_revision(onto_->revision());
    response.mutable_start()->set_row_count(carried_->values.size() / components_);
    response.mutable_start()->set_outside_count(carried_->outside_count);
  } else if (*next_ < carried_->values.size()) {
    const uint64_t end = std::min<uint64_t>(carried_->values.size(), *next_ + kValuesOfAResponse);
    response.mutable_values()->mutable_values()->Assign(carried_->values.begin() + static_cast<std::ptrdiff_t>(*next_),
                                                        carried_->values.begin() + static_cast<std::ptrdiff_t>(end));
    next_ = end;
  } else {
    End(absl::OkStatus());
    return std::nullopt;
  }
  return Serialize(response);
}

void TransferValuesCall::OnEnd() {
  values_ = NumberChunks();
  carried_ = std::nullopt;
  memory_.Release();
  if (job_ != nullptr) {
    environment().jobs.Cancel(job_);
  }
}

LogFields TransferValuesCall::Figures() const {
  LogFields figures;
  if (use_.has_value()) {
    figures.Add("session", use_->session().name()).Add("values", count_);
  }
  return figures;
}

}  // namespace wellspace::server
