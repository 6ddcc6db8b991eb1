#include "server/upload_points_call.h"

#include <utility>

#include "server/errors.h"
#include "server/resource_names.h"
#include "server/wire.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

void UploadPointsCall::OnBegin() {
  absl::StatusOr<MemoryReservation> memory = environment().memory.Reserve(kMessageBytes, "an upload");
  if (!memory.ok()) {
    End(FromCoreStatus(memory.status()));
    return;
  }
  memory_ = *std::move(memory);
  ReadNext();
}

void UploadPointsCall::OnRequest(grpc::ByteBuffer* bytes) {
  if (grpc::Status status = Accept(bytes); !status.ok()) {
    End(std::move(status));
  } else {
    ReadNext();
  }
}

void UploadPointsCall::OnRequestsEnd() {
  if (session_ == nullptr) {
    End(MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                  "the stream ended before any request; send the name of the session first", "name"));
  } else {
    *response_ = Serialize(session_->Committed());
    End(grpc::Status::OK);
  }
}

grpc::Status UploadPointsCall::Accept(grpc::ByteBuffer* bytes) {
  v1::UploadPointsRequest request;
  if (grpc::Status status = ParseRequest(bytes, &request); !status.ok()) {
    return status;
  }
  uint64_t expected_revision = 0;
  if (session_ == nullptr) {
    if (grpc::Status status = FindSession(environment(), caller(), request.name(), &session_); !status.ok()) {
      return status;
    }
    expected_revision = request.expected_revision();
  }
  const google::protobuf::RepeatedField<double>& coordinates = request.points().coordinates();
  coordinate_count_ += coordinates.size();
  environment().observability.work().points_received += coordinates.size() / session_->dimension();
  return RunGuarded([&] {
    return session_->Append(request.point_offset(), {coordinates.data(), static_cast<size_t>(coordinates.size())},
                            expected_revision);
  });
}

LogFields UploadPointsCall::Figures() const {
  LogFields figures;
  if (session_ != nullptr) {
    figures.Add("session", session_->name()).Add("points", coordinate_count_ / session_->dimension());
  }
  return figures;
}

}  // namespace wellspace::server
