#include "server/services/sessions/upload_points_call.h"

#include <mutex>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/retry_with_room.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The interval and the number of an upload's looks whether the session is free: a second in all.
constexpr absl::Duration kUploadRetryDelay = absl::Milliseconds(50);
constexpr int kAttempts = 20;

// Points wait for their commit until they are as many: less costs more of the disk, and more is lost with a connection.
constexpr uint64_t kCommittedBytes = uint64_t{16} << 20;

}  // namespace

void UploadPointsCall::OnBegin() {
  const auto reserve = [this] {
    WELLSPACE_ASSIGN_OR_RETURN(memory_, environment().memory.Reserve(kMessageBytes, "an upload"));
    return absl::OkStatus();
  };
  ReserveThen(kMessageBytes, reserve, [this] { ReadNext(); });
}

void UploadPointsCall::OnRequest(grpc::ByteBuffer* bytes) {
  v1::UploadPointsRequest request;
  if (absl::Status status = Parse(bytes, &request); !status.ok()) {
    End(std::move(status));
  } else if (upload_ != nullptr) {
    Take(request);
  } else {
    first_ = std::move(request);
    TryToBegin();
  }
}

absl::Status UploadPointsCall::Parse(grpc::ByteBuffer* bytes, v1::UploadPointsRequest* request) {
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, request));
  if (!session_.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), request->name()));
    WELLSPACE_RETURN_IF_ERROR(ExpectedRevisionOf(*request).status());
    session_.emplace(std::move(session));
  }
  return absl::OkStatus();
}

void UploadPointsCall::TryToBegin() {
  upload_ = UploadUse::Begin(session_->session_ptr());
  if (upload_ != nullptr) {
    const v1::UploadPointsRequest first = std::exchange(first_, v1::UploadPointsRequest());
    if (absl::Status status = CheckPrefix(first); !status.ok()) {
      End(std::move(status));
    } else {
      Take(first);
    }
  } else if (++attempts_ < kAttempts) {
    environment().log.debug("call={} waits for another upload", id());
    environment().background.PostAfter(kUploadRetryDelay, WeakCall(&UploadPointsCall::TryAgain));
  } else {
    End(MakeError(v1::ERROR_REASON_SESSION_BUSY,
                  absl::StrCat("another upload to ", session_->session().name(),
                               " is under way; wait for its end, and then go on after its points")));
  }
}

void UploadPointsCall::TryAgain() {
  std::lock_guard lock(mutex_);
  if (!ending()) {
    TryToBegin();
  }
}

absl::Status UploadPointsCall::CheckPrefix(const v1::UploadPointsRequest& first) const {
  if (!first.has_checked_crc32c()) {
    return absl::OkStatus();
  }
  if (first.checked_from() > first.point_offset()) {
    return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                     absl::StrCat("checked_from is ", first.checked_from(), "; at most point_offset, which is ",
                                  first.point_offset(), ", is accepted"),
                     "checked_from");
  }
  return session_->session().CheckPrefix(
      {.first = first.checked_from(), .end = first.point_offset(), .crc32c = first.checked_crc32c()});
}

void UploadPointsCall::Take(const v1::UploadPointsRequest& request) {
  // The revision is checked for the first message alone: later ones come after changes by this call's own commits.
  const uint64_t expected_revision = std::exchange(is_first_, false) ? request.expected_revision() : 0;
  const google::protobuf::RepeatedField<double>& coordinates = request.points().coordinates();
  Session& session = session_->session();
  coordinate_count_ += coordinates.size();
  environment().observability.work().OnPoints(coordinates.size() / session.dimension());
  const std::span<const double> points(coordinates.data(), static_cast<size_t>(coordinates.size()));
  // Points are in memory only where sessions have no more to give up than earlier meshes: that is quick.
  absl::Status status = RunGuarded([&] {
    return RetryWithRoom(environment().memory, points.size_bytes(),
                         [&] { return session.Append(request.point_offset(), points, expected_revision); });
  });
  if (!status.ok()) {
    End(std::move(status));
  } else {
    GoOn();
  }
}

void UploadPointsCall::GoOn() {
  const uint64_t waiting = session_->session().UncommittedBytes();
  if (waiting >= kCommittedBytes && !is_committing_) {
    is_committing_ = true;
    Commit(&UploadPointsCall::OnCommitted);
  }
  is_reading_ = waiting < 2 * kCommittedBytes;
  if (is_reading_) {
    ReadNext();
  }
}

void UploadPointsCall::Commit(void (UploadPointsCall::*then)(absl::Status)) {
  environment().blocking.Run(session_->session().name(), [self = SharedAs<UploadPointsCall>(), then] {
    absl::Status status = RunGuarded([&] { return self->session_->session().CommitPoints(); });
    std::lock_guard lock(self->mutex_);
    if (!self->ending()) {
      (self.get()->*then)(std::move(status));
    }
  });
}

void UploadPointsCall::OnCommitted(absl::Status status) {
  is_committing_ = false;
  if (!status.ok()) {
    End(std::move(status));
  } else if (!is_reading_) {
    GoOn();
  }
}

void UploadPointsCall::OnLastCommitted(absl::Status status) {
  if (status.ok()) {
    v1::UploadPointsResponse response;
    const std::shared_ptr<const SessionState> state = session_->session().state();
    response.set_committed_points(state->record.points());
    response.set_revision(state->record.revision());
    *response_ = Serialize(response);
  }
  End(std::move(status));
}

void UploadPointsCall::OnRequestsEnd() {
  if (!session_.has_value()) {
    End(MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                  "the stream ended before any request; send the name of the session first", "name"));
  } else if (session_->session().UncommittedBytes() > 0) {
    is_reading_ = true;  // there is nothing more to read
    Commit(&UploadPointsCall::OnLastCommitted);
  } else {
    OnLastCommitted(absl::OkStatus());
  }
}

void UploadPointsCall::OnEnd() {
  std::shared_ptr<UploadUse> upload = std::move(upload_);
  if (upload != nullptr && session_->session().UncommittedBytes() > 0) {
    // Received points are committed, and only then another upload may go on.
    environment().blocking.Run(session_->session().name(),
                               [self = SharedAs<UploadPointsCall>(), upload = std::move(upload)]() mutable {
                                 (void)RunGuarded([&] { return self->session_->session().CommitPoints(); });
                                 upload = nullptr;
                               });
  }
  first_.Clear();
  memory_.Release();
}

LogFields UploadPointsCall::Figures() const {
  LogFields figures;
  if (session_.has_value()) {
    const Session& session = session_->session();
    figures.Add("session", session.name()).Add("points", coordinate_count_ / session.dimension());
  }
  return figures;
}

}  // namespace wellspace::server
