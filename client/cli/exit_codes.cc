#include "client/cli/exit_codes.h"

#include <iostream>
#include <string>

#include "client/json/json.h"
#include "client/printable.h"

namespace wellspace::cli {

const char kExitCodesHelp[] =
    "Exit codes:\n"
    "  0    done; `check`: the mesh is valid; `info`: the surface has no faults\n"
    "  1    `check` found a violation, `info` faults of a surface, or the work failed\n"
    "  2    wrong usage, or a file or a session that is not there or not valid\n"
    "  3    the server cannot be reached, or stopped\n"
    "  4    a limit of vertices, memory or disk was reached, or output could not be written\n"
    "  5    --timeout passed\n"
    "  6    the server wants other credentials, or its certificate is not trusted\n"
    "  7    the session is in another state, or at another revision, than the command needs\n"
    "  130  interrupted by Ctrl-C (143 by SIGTERM, 129 by SIGHUP); the work is cancelled, no file is left half "
    "written\n";

int ExitCodeOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kExitOk;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kOutOfRange:
      return kExitBadInput;
    case absl::StatusCode::kUnavailable:
      return kExitUnavailable;
    case absl::StatusCode::kResourceExhausted:
      return kExitExhausted;
    case absl::StatusCode::kDeadlineExceeded:
      return kExitTimeout;
    case absl::StatusCode::kUnauthenticated:
      return kExitUnauthenticated;
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kAborted:
      return kExitConflict;
    default:
      return kExitFailed;
  }
}

int ReportError(const absl::Status& status, OutputFormat format) {
  const std::string code = absl::StatusCodeToString(status.code());
  if (format == OutputFormat::kText) {
    std::cerr << "wellspace: " << client::Printable(std::string(status.message())) << " [" << code << "]\n";
    return ExitCodeOf(status);
  }
  std::cerr << client::JsonText({{"error", client::ErrorJson(status)}}, /*indented=*/false) << "\n";
  return ExitCodeOf(status);
}

}  // namespace wellspace::cli
