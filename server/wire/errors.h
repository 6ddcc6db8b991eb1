// The one place where errors become the status of a call.
#ifndef WELLSPACE_SERVER_WIRE_ERRORS_H_
#define WELLSPACE_SERVER_WIRE_ERRORS_H_

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"
#include "wellspace/v1/errors.pb.h"

namespace wellspace::server {

// The `domain` of the ErrorInfo of every error.
inline constexpr char kErrorDomain[] = "wellspace.v1";

// Makes the error that errors.proto describes: code and ErrorInfo by `reason`, a BadRequest when `field` (the path of
// the field from the request message on) is given, a RetryInfo for reasons that pass with time.
//
// REQUIRES:   reason != ERROR_REASON_UNSPECIFIED.
// Threads:    thread-safe.
grpc::Status MakeError(v1::ErrorReason reason, const std::string& message, const std::string& field = "");
// The same for a reason that comes with more than one code.
grpc::Status MakeError(grpc::StatusCode code, v1::ErrorReason reason, const std::string& message,
                       const std::string& field);

// A RESOURCE_EXHAUSTED that FromCoreStatus makes a MEMORY_LIMIT, with RetryInfo if asking again may help.
absl::Status MemoryLimitError(const std::string& message, bool may_retry);

// The status of a run that the core ended with `status`. The parameters were validated before, so that an
// INVALID_ARGUMENT is about the points.
grpc::Status FromCoreStatus(const absl::Status& status);

// `status` as a message, as it would reach a client.
google::rpc::Status StatusToProto(const grpc::Status& status);

// Runs `work` and returns its status; an exception that escapes it becomes OUT_OF_MEMORY or INTERNAL.
grpc::Status RunGuarded(const std::function<grpc::Status()>& work);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_WIRE_ERRORS_H_
