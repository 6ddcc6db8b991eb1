// The details of a server's error besides code and message.
#ifndef WELLSPACE_CLIENT_ERROR_DETAILS_H_
#define WELLSPACE_CLIENT_ERROR_DETAILS_H_

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace google::rpc {
class Status;
}

namespace wellspace::client {

// The path of the field that the server blames for an error, from the request on, such as "parameters.rho"; empty when
// it blames none.
std::string BlamedField(const absl::Status& status);

// The name of the server's ErrorReason, such as "ERROR_REASON_SESSION_NOT_FOUND"; empty for errors that are not the
// server's.
std::string ReasonOf(const absl::Status& status);

// Of an error SESSION_ELSEWHERE: the address of the server that has the session, as the server that was asked has named
// it; not checked in any way. Empty: it is not known, or another error.
std::string OwnerAddressOf(const absl::Status& status);

// The time that the server wants a client to wait before it tries again; absent: it does not say that this would help.
std::optional<absl::Duration> RetryDelayOf(const absl::Status& status);

// `status` with another message, and with all that the server has said besides.
absl::Status WithMessage(const absl::Status& status, std::string_view message);

// Adds the details to `status`, as payloads under their type URLs. REQUIRES: !status.ok().
void AddDetails(const google::rpc::Status& details, absl::Status& status);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_ERROR_DETAILS_H_
