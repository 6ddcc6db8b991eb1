#include "server/wire/errors.h"

#include <exception>
#include <new>
#include <string_view>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/types/optional.h"
#include "core/mesh_parameters.h"
#include "google/rpc/error_details.pb.h"
#include "server/log/log_fields.h"

namespace wellspace::server {
namespace {

constexpr int kRetrySeconds = 1;

// A message may repeat what the client sent. It goes out three times, as trailing metadata, of which clients take 8
// KiB.
constexpr size_t kMaxErrorMessageBytes = 1024;

// Marks the status of a MEMORY_LIMIT; its value is kMayRetry or empty.
constexpr char kMemoryLimitPayload[] = "wellspace.v1/MEMORY_LIMIT";
constexpr char kMayRetry[] = "retry";

absl::string_view ToAbsl(std::string_view text) { return {text.data(), text.size()}; }

grpc::StatusCode CodeOf(v1::ErrorReason reason) {
  switch (reason) {
    case v1::ERROR_REASON_EMPTY_REQUEST:
    case v1::ERROR_REASON_PARAMETERS_MISSING:
    case v1::ERROR_REASON_PARAMETERS_REPEATED:
    case v1::ERROR_REASON_INVALID_PARAMETERS:
    case v1::ERROR_REASON_INVALID_CHUNK_SHAPE:
    case v1::ERROR_REASON_INVALID_POINTS:
    case v1::ERROR_REASON_INVALID_SEGMENTS:
    case v1::ERROR_REASON_MALFORMED_REQUEST:
    case v1::ERROR_REASON_REQUEST_ID_REUSED:
    case v1::ERROR_REASON_INVALID_REQUEST:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case v1::ERROR_REASON_TOO_MANY_POINTS:
    case v1::ERROR_REASON_MESH_TOO_LARGE:
    case v1::ERROR_REASON_DEMANDS_TOO_FINE:
    case v1::ERROR_REASON_QUEUE_FULL:
    case v1::ERROR_REASON_OUT_OF_MEMORY:
    case v1::ERROR_REASON_MEMORY_LIMIT:
    case v1::ERROR_REASON_QUOTA_EXCEEDED:
    case v1::ERROR_REASON_TOO_MANY_SESSIONS:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case v1::ERROR_REASON_SERVER_STOPPING:
      return grpc::StatusCode::UNAVAILABLE;
    case v1::ERROR_REASON_SESSION_NOT_FOUND:
    case v1::ERROR_REASON_OPERATION_NOT_FOUND:
      return grpc::StatusCode::NOT_FOUND;
    case v1::ERROR_REASON_SESSION_BUSY:
    case v1::ERROR_REASON_MESH_NOT_READY:
    case v1::ERROR_REASON_UPLOAD_MISMATCH:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case v1::ERROR_REASON_REVISION_MISMATCH:
      return grpc::StatusCode::ABORTED;
    case v1::ERROR_REASON_UPLOAD_GAP:
    case v1::ERROR_REASON_CHUNK_OUT_OF_RANGE:
    case v1::ERROR_REASON_VERTEX_OUT_OF_RANGE:
      return grpc::StatusCode::OUT_OF_RANGE;
    case v1::ERROR_REASON_UNAUTHENTICATED:
      return grpc::StatusCode::UNAUTHENTICATED;
    case v1::ERROR_REASON_READER_STALLED:
    case v1::ERROR_REASON_SENDER_STALLED:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    default:
      return grpc::StatusCode::INTERNAL;
  }
}

bool PassesWithTime(v1::ErrorReason reason) {
  return reason == v1::ERROR_REASON_QUEUE_FULL || reason == v1::ERROR_REASON_OUT_OF_MEMORY ||
         reason == v1::ERROR_REASON_QUOTA_EXCEEDED || reason == v1::ERROR_REASON_SERVER_STOPPING;
}

grpc::Status Make(grpc::StatusCode code, v1::ErrorReason reason, const std::string& whole_message,
                  const std::string& field, bool may_retry) {
  const std::string message = CutText(whole_message, kMaxErrorMessageBytes);
  google::rpc::Status details;
  details.set_code(code);
  details.set_message(message);
  google::rpc::ErrorInfo info;
  info.set_reason(v1::ErrorReason_Name(reason));
  info.set_domain(kErrorDomain);
  details.add_details()->PackFrom(info);
  if (!field.empty()) {
    google::rpc::BadRequest bad_request;
    google::rpc::BadRequest::FieldViolation* violation = bad_request.add_field_violations();
    violation->set_field(field);
    violation->set_description(message);
    details.add_details()->PackFrom(bad_request);
  }
  if (may_retry) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(kRetrySeconds);
    details.add_details()->PackFrom(retry);
  }
  return grpc::Status(code, message, details.SerializeAsString());
}

}  // namespace

grpc::Status MakeError(v1::ErrorReason reason, const std::string& message, const std::string& field) {
  return MakeError(CodeOf(reason), reason, message, field);
}

grpc::Status MakeError(grpc::StatusCode code, v1::ErrorReason reason, const std::string& message,
                       const std::string& field) {
  return Make(code, reason, message, field, PassesWithTime(reason));
}

absl::Status MemoryLimitError(const std::string& message, bool may_retry) {
  absl::Status status = absl::ResourceExhaustedError(message);
  status.SetPayload(kMemoryLimitPayload, absl::Cord(may_retry ? kMayRetry : ""));
  return status;
}

grpc::Status FromCoreStatus(const absl::Status& status) {
  const std::string message(status.message());
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return grpc::Status::OK;
    case absl::StatusCode::kInvalidArgument:
      for (const auto& [what, field] :
           {std::pair("segments", "segments.ends"), {"seeds[", "faces.seeds"}, {"faces:", "faces.faces"}}) {
        if (message.rfind(what, 0) == 0) {
          return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS, message, field);
        }
      }
      return MakeError(v1::ERROR_REASON_INVALID_POINTS, message, "points.coordinates");
    case absl::StatusCode::kResourceExhausted:
      if (const absl::optional<absl::Cord> payload = status.GetPayload(kMemoryLimitPayload); payload.has_value()) {
        return Make(CodeOf(v1::ERROR_REASON_MEMORY_LIMIT), v1::ERROR_REASON_MEMORY_LIMIT, message, "",
                    *payload == kMayRetry);
      }
      if (status.GetPayload(ToAbsl(core::kDemandsTooFine)).has_value()) {
        return MakeError(v1::ERROR_REASON_DEMANDS_TOO_FINE, message,
                         absl::StrCat("parameters.", message.substr(0, message.find(':'))));
      }
      return MakeError(v1::ERROR_REASON_MESH_TOO_LARGE, message);
    case absl::StatusCode::kFailedPrecondition:
      return MakeError(v1::ERROR_REASON_MESH_NOT_READY, message);
    case absl::StatusCode::kCancelled:
      return grpc::Status(grpc::StatusCode::CANCELLED, message);
    case absl::StatusCode::kDeadlineExceeded:
      return grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, message);
    default:
      return MakeError(v1::ERROR_REASON_INTERNAL, absl::StrCat("internal error: ", message));
  }
}

google::rpc::Status StatusToProto(const grpc::Status& status) {
  google::rpc::Status message;
  if (!message.ParseFromString(status.error_details())) {
    message.Clear();
  }
  message.set_code(status.error_code());
  message.set_message(status.error_message());
  return message;
}

grpc::Status RunGuarded(const std::function<grpc::Status()>& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return MakeError(v1::ERROR_REASON_OUT_OF_MEMORY, "the server has not enough memory for this job");
  } catch (const std::exception& exception) {
    return MakeError(v1::ERROR_REASON_INTERNAL, absl::StrCat("internal error: ", exception.what()));
  }
}

}  // namespace wellspace::server
