#include "server/services/sessions/add_segments_call.h"

#include <utility>

#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/retry_with_room.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void AddSegmentsCall::OnBegin() {
  const auto reserve = [this] {
    WELLSPACE_ASSIGN_OR_RETURN(memory_, environment().memory.Reserve(kMessageBytes, "segments"));
    return absl::OkStatus();
  };
  ReserveThen(kMessageBytes, reserve, [this] { ReadNext(); });
}

absl::Status AddSegmentsCall::Parse(grpc::ByteBuffer* bytes, v1::AddSegmentsRequest* request) {
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, request));
  if (!session_.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request->name()));
    WELLSPACE_RETURN_IF_ERROR(ExpectedRevisionOf(*request).status());
    session_.emplace(std::move(session));
  } else {
    request->clear_expected_revision();  // what the call has committed has changed the revision
  }
  segment_count_ += request->segments().ends_size() / 2;
  seed_count_ += request->faces().seeds_size();
  return absl::OkStatus();
}

void AddSegmentsCall::OnRequest(grpc::ByteBuffer* bytes) {
  const auto request = std::make_shared<v1::AddSegmentsRequest>();
  if (absl::Status status = RunGuarded([&] { return Parse(bytes, request.get()); }); !status.ok()) {
    End(std::move(status));
  } else if (environment().session_log.is_durable()) {
    environment().blocking.Run(session_->session().name(), [self = SharedAs<AddSegmentsCall>(), request] {
      absl::Status added = self->Add(*request);
      std::lock_guard lock(self->mutex_);
      self->GoOn(std::move(added));
    });
  } else {
    GoOn(Add(*request));
  }
}

absl::Status AddSegmentsCall::Add(const v1::AddSegmentsRequest& request) {
  const uint64_t bytes = FeatureStore::BytesOf(request.segments().ends_size() / 2, request.faces().seeds_size());
  return RunGuarded([&] {
    return RetryWithRoom(environment().memory, bytes,
                         [&] { return session_->session().AddSegments(request, request.expected_revision()); });
  });
}

void AddSegmentsCall::GoOn(absl::Status status) {
  if (ending()) {
    return;
  }
  if (!status.ok()) {
    End(std::move(status));
  } else {
    ReadNext();
  }
}

void AddSegmentsCall::OnRequestsEnd() {
  if (!session_.has_value()) {
    End(MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                  "the stream ended before any request; send the name of the session first", "name"));
  } else {
    v1::AddSegmentsResponse response;
    const std::shared_ptr<const SessionState> state = session_->session().state();
    response.set_segment_count(state->record.segments());
    response.set_seed_count(state->record.seeds());
    response.set_revision(state->record.revision());
    *response_ = Serialize(response);
    End(absl::OkStatus());
  }
}

LogFields AddSegmentsCall::Figures() const {
  LogFields figures;
  if (session_.has_value()) {
    figures.Add("session", session_->session().name()).Add("segments", segment_count_).Add("seeds", seed_count_);
  }
  return figures;
}

}  // namespace wellspace::server
