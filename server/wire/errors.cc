#include "server/wire/errors.h"

#include <exception>
#include <new>
#include <string>
#include <string_view>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/types/optional.h"
#include "core/input/mesh_parameters.h"
#include "google/rpc/error_details.pb.h"
#include "server/log/log_fields.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {
namespace {

constexpr int kRetrySeconds = 1;

// A message may repeat text of the client. It goes out three times, as trailing metadata, of which clients take 8
// KiB.
constexpr size_t kMaxErrorMessageBytes = 1024;

// Payloads of a status: the name of its ErrorReason, the path of the field to blame, that the call may be repeated, and
// the address of the server that has the session.
constexpr char kReason[] = "wellspace.v1/reason";
constexpr char kField[] = "wellspace.v1/field";
constexpr char kMayRetry[] = "wellspace.v1/may_retry";
constexpr char kAddress[] = "wellspace.v1/address";
constexpr char kSession[] = "wellspace.v1/session";

absl::string_view ToAbsl(std::string_view text) { return {text.data(), text.size()}; }

absl::StatusCode CodeOf(v1::ErrorReason reason) {
  switch (reason) {
    case v1::ERROR_REASON_EMPTY_REQUEST:
    case v1::ERROR_REASON_PARAMETERS_MISSING:
    case v1::ERROR_REASON_PARAMETERS_REPEATED:
    case v1::ERROR_REASON_INVALID_PARAMETERS:
    case v1::ERROR_REASON_INVALID_CHUNK_SHAPE:
    case v1::ERROR_REASON_INVALID_POINTS:
    case v1::ERROR_REASON_INVALID_SEGMENTS:
    case v1::ERROR_REASON_INVALID_TRIANGLES:
    case v1::ERROR_REASON_INVALID_SIZES:
    case v1::ERROR_REASON_MALFORMED_REQUEST:
    case v1::ERROR_REASON_REQUEST_ID_REUSED:
    case v1::ERROR_REASON_INVALID_REQUEST:
      return absl::StatusCode::kInvalidArgument;
    case v1::ERROR_REASON_TOO_MANY_POINTS:
    case v1::ERROR_REASON_MESH_TOO_LARGE:
    case v1::ERROR_REASON_DEMANDS_TOO_FINE:
    case v1::ERROR_REASON_QUEUE_FULL:
    case v1::ERROR_REASON_OUT_OF_MEMORY:
    case v1::ERROR_REASON_MEMORY_LIMIT:
    case v1::ERROR_REASON_QUOTA_EXCEEDED:
    case v1::ERROR_REASON_STORAGE_QUOTA_EXCEEDED:
    case v1::ERROR_REASON_TOO_MANY_SESSIONS:
    case v1::ERROR_REASON_DISK_FULL:
      return absl::StatusCode::kResourceExhausted;
    case v1::ERROR_REASON_SERVER_STOPPING:
    case v1::ERROR_REASON_STORE_FAILED:
    case v1::ERROR_REASON_SESSION_ELSEWHERE:
      return absl::StatusCode::kUnavailable;
    case v1::ERROR_REASON_FILE_DAMAGED:
      return absl::StatusCode::kDataLoss;
    case v1::ERROR_REASON_SESSION_NOT_FOUND:
    case v1::ERROR_REASON_OPERATION_NOT_FOUND:
      return absl::StatusCode::kNotFound;
    case v1::ERROR_REASON_SESSION_BUSY:
    case v1::ERROR_REASON_MESH_NOT_READY:
    case v1::ERROR_REASON_UPLOAD_MISMATCH:
    case v1::ERROR_REASON_DOMAIN_FIXED:
    case v1::ERROR_REASON_WORK_CRASHED:
    case v1::ERROR_REASON_DELTA_NOT_KEPT:
    case v1::ERROR_REASON_MESH_NOT_KEPT:
      return absl::StatusCode::kFailedPrecondition;
    case v1::ERROR_REASON_REVISION_MISMATCH:
      return absl::StatusCode::kAborted;
    case v1::ERROR_REASON_UPLOAD_GAP:
    case v1::ERROR_REASON_CHUNK_OUT_OF_RANGE:
    case v1::ERROR_REASON_VERTEX_OUT_OF_RANGE:
      return absl::StatusCode::kOutOfRange;
    case v1::ERROR_REASON_UNAUTHENTICATED:
      return absl::StatusCode::kUnauthenticated;
    case v1::ERROR_REASON_ADMIN_ONLY:
      return absl::StatusCode::kPermissionDenied;
    case v1::ERROR_REASON_READER_STALLED:
    case v1::ERROR_REASON_SENDER_STALLED:
      return absl::StatusCode::kDeadlineExceeded;
    default:
      return absl::StatusCode::kInternal;
  }
}

bool PassesWithTime(v1::ErrorReason reason) {
  return reason == v1::ERROR_REASON_QUEUE_FULL || reason == v1::ERROR_REASON_OUT_OF_MEMORY ||
         reason == v1::ERROR_REASON_QUOTA_EXCEEDED || reason == v1::ERROR_REASON_SERVER_STOPPING ||
         reason == v1::ERROR_REASON_DISK_FULL || reason == v1::ERROR_REASON_STORE_FAILED ||
         reason == v1::ERROR_REASON_SESSION_ELSEWHERE;
}

absl::Status Make(absl::StatusCode code, v1::ErrorReason reason, std::string_view message, std::string_view field,
                  bool may_retry) {
  absl::Status status(code, ToAbsl(message));
  status.SetPayload(kReason, absl::Cord(v1::ErrorReason_Name(reason)));
  if (!field.empty()) {
    status.SetPayload(kField, absl::Cord(ToAbsl(field)));
  }
  if (may_retry) {
    status.SetPayload(kMayRetry, absl::Cord());
  }
  return status;
}

// The beginning of the core's errors about sizes at points.
constexpr char kSizes[] = "size_samples.";

// An error of the core, with the reason that it has for clients; CANCELLED and DEADLINE_EXCEEDED have none.
absl::Status FromCore(const absl::Status& status) {
  const std::string message(status.message());
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
      for (const auto& [what, field] : {std::pair("segments", "segments.ends"),
                                        {"markers:", "segments.markers"},
                                        {"seeds[", "faces.seeds"},
                                        {"faces:", "faces.faces"},
                                        {"periodic_axes:", "segments.ends"}}) {
        if (message.rfind(what, 0) == 0) {
          return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS, message, field);
        }
      }
      for (const auto& [what, field] : {std::pair("triangles", "triangles.corners"),
                                        {"surface:", "triangles.corners"},
                                        {"solids:", "surface.solids"},
                                        {"crease_angle:", "surface.crease_angle"},
                                        {"weld:", "surface.weld"},
                                        {"min_patch:", "surface.min_patch"},
                                        {"resolution:", "surface.resolution"},
                                        {"box:", "surface.box"},
                                        {"keep_points:", "surface.keep_points"}}) {
        if (message.rfind(what, 0) == 0) {
          return MakeError(v1::ERROR_REASON_INVALID_TRIANGLES, message, field);
        }
      }
      if (message.rfind(kSizes, 0) == 0) {
        return MakeError(v1::ERROR_REASON_INVALID_SIZES, message, "size_samples.points");
      }
      return MakeError(v1::ERROR_REASON_INVALID_POINTS, message, "points.coordinates");
    case absl::StatusCode::kResourceExhausted:
      if (status.GetPayload(ToAbsl(core::kDemandsTooFine)).has_value()) {
        return MakeError(
            v1::ERROR_REASON_DEMANDS_TOO_FINE, message,
            absl::StrCat(message.rfind(kSizes, 0) == 0 ? "" : "parameters.", message.substr(0, message.find(':'))));
      }
      return MakeError(v1::ERROR_REASON_MESH_TOO_LARGE, message);
    case absl::StatusCode::kFailedPrecondition:
      return MakeError(v1::ERROR_REASON_MESH_NOT_READY, message);
    case absl::StatusCode::kUnimplemented:  // of what this input does not have
      return MakeError(v1::ERROR_REASON_INVALID_REQUEST, message);
    case absl::StatusCode::kCancelled:
    case absl::StatusCode::kDeadlineExceeded:
      return status;
    default:
      return MakeError(v1::ERROR_REASON_INTERNAL, absl::StrCat("internal error: ", message));
  }
}

// The details of an error with `reason`, for clients.
google::rpc::Status DetailsOf(const absl::Status& status, const std::string& reason) {
  google::rpc::Status details;
  details.set_code(static_cast<int>(status.code()));
  details.set_message(CutText(WithoutFolders(std::string(status.message())), kMaxErrorMessageBytes));
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  info.set_domain(kErrorDomain);
  if (const SessionOwnerOf owner = OwnerOf(status); !owner.address.empty()) {
    (*info.mutable_metadata())["address"] = owner.address;
  }
  details.add_details()->PackFrom(info);
  if (const absl::optional<absl::Cord> field = status.GetPayload(kField); field.has_value()) {
    google::rpc::BadRequest bad_request;
    google::rpc::BadRequest::FieldViolation* violation = bad_request.add_field_violations();
    violation->set_field(std::string(*field));
    violation->set_description(details.message());
    details.add_details()->PackFrom(bad_request);
  }
  if (status.GetPayload(kMayRetry).has_value()) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(kRetrySeconds);
    details.add_details()->PackFrom(retry);
  }
  return details;
}

}  // namespace

absl::Status MakeError(v1::ErrorReason reason, std::string_view message, std::string_view field) {
  return MakeError(CodeOf(reason), reason, message, field);
}

absl::Status MakeError(absl::StatusCode code, v1::ErrorReason reason, std::string_view message,
                       std::string_view field) {
  return Make(code, reason, message, field, PassesWithTime(reason));
}

absl::Status OfSurface(const absl::Status& status) {
  const std::string message(status.message());
  return status.code() == absl::StatusCode::kInvalidArgument && message.rfind("seeds[", 0) == 0
             ? MakeError(v1::ERROR_REASON_INVALID_TRIANGLES, message, "surface.seeds")
             : status;
}

absl::Status MemoryLimitError(std::string_view message, bool may_retry) {
  return Make(CodeOf(v1::ERROR_REASON_MEMORY_LIMIT), v1::ERROR_REASON_MEMORY_LIMIT, message, "", may_retry);
}

bool IsMemoryLimit(const absl::Status& status) {
  return status.GetPayload(kReason) == absl::Cord(v1::ErrorReason_Name(v1::ERROR_REASON_MEMORY_LIMIT));
}

absl::Status SessionElsewhereError(std::string_view message, std::string_view session, std::string_view address) {
  absl::Status status = MakeError(v1::ERROR_REASON_SESSION_ELSEWHERE, message);
  if (!address.empty()) {
    status.SetPayload(kAddress, absl::Cord(ToAbsl(address)));
    status.SetPayload(kSession, absl::Cord(ToAbsl(session)));
  }
  return status;
}

bool IsElsewhereError(const absl::Status& status) {
  return status.GetPayload(kReason) == absl::Cord(v1::ErrorReason_Name(v1::ERROR_REASON_SESSION_ELSEWHERE));
}

SessionOwnerOf OwnerOf(const absl::Status& status) {
  const absl::optional<absl::Cord> address = status.GetPayload(kAddress);
  const absl::optional<absl::Cord> session = status.GetPayload(kSession);
  return address.has_value() && session.has_value()
             ? SessionOwnerOf{.session = std::string(*session), .address = std::string(*address)}
             : SessionOwnerOf();
}

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) {
    return grpc::Status::OK;
  }
  const absl::Status named = status.GetPayload(kReason).has_value() ? status : FromCore(status);
  const absl::optional<absl::Cord> reason = named.GetPayload(kReason);
  const auto code = static_cast<grpc::StatusCode>(named.code());  // the numbers are the same
  if (!reason.has_value()) {
    return grpc::Status(code, WithoutFolders(std::string(named.message())));
  }
  const google::rpc::Status details = DetailsOf(named, std::string(*reason));
  return grpc::Status(code, details.message(), details.SerializeAsString());
}

google::rpc::Status StatusToProto(const absl::Status& status) {
  const grpc::Status outside = ToGrpcStatus(status);
  google::rpc::Status message;
  if (!message.ParseFromString(outside.error_details())) {
    message.Clear();
  }
  message.set_code(outside.error_code());
  message.set_message(outside.error_message());
  return message;
}

absl::Status RunGuarded(const std::function<absl::Status()>& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return MakeError(v1::ERROR_REASON_OUT_OF_MEMORY, "the server has not enough memory for this job");
  } catch (const std::exception& exception) {
    return MakeError(v1::ERROR_REASON_INTERNAL, absl::StrCat("internal error: ", exception.what()));
  }
}

}  // namespace wellspace::server
