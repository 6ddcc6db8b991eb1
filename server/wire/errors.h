// Errors: the details that a status has besides its code, and the one place where it becomes the status of a call.
#ifndef WELLSPACE_SERVER_WIRE_ERRORS_H_
#define WELLSPACE_SERVER_WIRE_ERRORS_H_

#include <functional>
#include <string_view>

#include "absl/status/status.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "wellspace/v1/errors.pb.h"

namespace wellspace::server {

// The `domain` of the ErrorInfo of every error.
inline constexpr char kErrorDomain[] = "wellspace.v1";

// Makes the error that errors.proto describes. The status carries its reason, its field (the path of the field from the
// request message on, if one is to blame) and, for reasons that pass with time, that the call may be repeated.
//
// REQUIRES:   reason != ERROR_REASON_UNSPECIFIED.
// Guarantees: the code is the one of the reason.
// Threads:    thread-safe.
absl::Status MakeError(v1::ErrorReason reason, std::string_view message, std::string_view field = "");
// The same for a reason that comes with more than one code.
absl::Status MakeError(absl::StatusCode code, v1::ErrorReason reason, std::string_view message, std::string_view field);
// An error of the core about an input with a surface: seeds are those of solids, which its message does not say.
absl::Status OfSurface(const absl::Status& status);
// A MEMORY_LIMIT, which passes with time or does not.
absl::Status MemoryLimitError(std::string_view message, bool may_retry);
bool IsMemoryLimit(const absl::Status& status);
// A SESSION_ELSEWHERE of the session with this id. `address`: where the server is that has it; empty: unknown.
absl::Status SessionElsewhereError(std::string_view message, std::string_view session, std::string_view address);
bool IsElsewhereError(const absl::Status& status);
// Of such a status the id, and the address; both are empty where one is not known.
struct SessionOwnerOf {
  std::string session;
  std::string address;
};
SessionOwnerOf OwnerOf(const absl::Status& status);

// The status of a call that ended with `status`: with ErrorInfo, BadRequest where there is a field, and RetryInfo where
// the call may be repeated. To be called where a status leaves the server, nowhere else.
//
// A status without a reason is the core's. The parameters were validated before, so that its INVALID_ARGUMENT is about
// points, segments, faces, triangles or sizes at points. CANCELLED and DEADLINE_EXCEEDED have no reason.
grpc::Status ToGrpcStatus(const absl::Status& status);

// `status` as a message, as it would reach a client.
google::rpc::Status StatusToProto(const absl::Status& status);

// Runs `work` and returns its status; an exception that escapes it becomes OUT_OF_MEMORY or INTERNAL.
absl::Status RunGuarded(const std::function<absl::Status()>& work);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_WIRE_ERRORS_H_
