#include "server/services/sessions/add_features_call.h"

#include <utility>

#include "core/base/status_macros.h"
#include "server/calls/wire.h"
#include "server/services/resource_names.h"
#include "server/services/session_fields.h"
#include "server/sessions/retry_with_room.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void AddFeaturesCall::OnBegin() {
  const auto reserve = [this] {
    WELLSPACE_ASSIGN_OR_RETURN(memory_, environment().memory.Reserve(kMessageBytes, what()));
    return absl::OkStatus();
  };
  ReserveThen(kMessageBytes, reserve, [this] { ReadNext(); });
}

absl::Status AddFeaturesCall::Parse(grpc::ByteBuffer* bytes, Message* message) {
  WELLSPACE_ASSIGN_OR_RETURN(*message, ParseMessage(bytes));
  if (!session_.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<Session> session, FindSession(environment(), caller(), message->name));
    WELLSPACE_RETURN_IF_ERROR(message->expected_revision.status());
    session_.emplace(std::move(session));
  } else {
    message->expected_revision = 0;  // commits of this call have changed the revision
  }
  received_ = received_ + CountsOf(message->features);
  return absl::OkStatus();
}

void AddFeaturesCall::OnRequest(grpc::ByteBuffer* bytes) {
  const auto message = std::make_shared<Message>();
  if (absl::Status status = RunGuarded([&] { return Parse(bytes, message.get()); }); !status.ok()) {
    End(std::move(status));
  } else if (environment().session_log.is_durable()) {
    environment().blocking.Run(session_->session().name(), [self = SharedAs<AddFeaturesCall>(), message] {
      absl::Status added = self->Add(*message);
      std::lock_guard lock(self->mutex_);
      self->GoOn(std::move(added));
    });
  } else {
    GoOn(Add(*message));
  }
}

absl::Status AddFeaturesCall::Add(const Message& message) {
  return RunGuarded([&] {
    return RetryWithRoom(environment().memory, FeatureBytes(CountsOf(message.features)), [&] {
      return session_->session().AddFeatures(message.features, message.offset, *message.expected_revision);
    });
  });
}

void AddFeaturesCall::GoOn(absl::Status status) {
  if (ending()) {
    return;
  }
  if (!status.ok()) {
    End(std::move(status));
  } else {
    ReadNext();
  }
}

void AddFeaturesCall::OnRequestsEnd() {
  if (!session_.has_value()) {
    End(MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                  "the stream ended before any request; send the name of the session first", "name"));
  } else {
    *response_ = Answer(session_->session().state()->record);
    End(absl::OkStatus());
  }
}

LogFields AddFeaturesCall::Figures() const {
  LogFields figures;
  if (session_.has_value()) {
    figures.Add("session", session_->session().name())
        .Add(what(), received_.segments + received_.triangles)
        .Add("seeds", received_.seeds);
  }
  return figures;
}

absl::StatusOr<AddFeaturesCall::Message> AddSegmentsCall::ParseMessage(grpc::ByteBuffer* bytes) {
  v1::AddSegmentsRequest request;
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, &request));
  Message message{.name = request.name(),
                  .offset = {.segments = request.segment_offset(), .seeds = request.seed_offset()},
                  .features = {},
                  .expected_revision = ExpectedRevisionOf(request)};
  if (request.has_segments() || !request.has_faces()) {
    message.features.mutable_segments()->Swap(request.mutable_segments());
  }
  if (request.has_faces()) {
    message.features.mutable_faces()->Swap(request.mutable_faces());
  }
  return message;
}

grpc::ByteBuffer AddSegmentsCall::Answer(const store::v1::SessionRecord& record) const {
  v1::AddSegmentsResponse response;
  response.set_segment_count(record.segments());
  response.set_seed_count(record.seeds());
  response.set_revision(record.revision());
  return Serialize(response);
}

absl::StatusOr<AddFeaturesCall::Message> AddTrianglesCall::ParseMessage(grpc::ByteBuffer* bytes) {
  v1::AddTrianglesRequest request;
  WELLSPACE_RETURN_IF_ERROR(ParseRequest(bytes, &request));
  Message message{.name = request.name(),
                  .offset = {.triangles = request.triangle_offset(), .seeds = request.seed_offset()},
                  .features = {},
                  .expected_revision = ExpectedRevisionOf(request)};
  if (request.has_triangles() || !request.has_surface()) {
    message.features.mutable_triangles()->Swap(request.mutable_triangles());
  }
  if (request.has_surface()) {
    message.features.mutable_surface()->Swap(request.mutable_surface());
  }
  return message;
}

grpc::ByteBuffer AddTrianglesCall::Answer(const store::v1::SessionRecord& record) const {
  v1::AddTrianglesResponse response;
  response.set_triangle_count(record.triangles());
  response.set_seed_count(record.seeds());
  response.set_revision(record.revision());
  return Serialize(response);
}

}  // namespace wellspace::server
