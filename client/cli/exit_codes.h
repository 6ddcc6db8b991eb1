// The exit codes of the tool.
#ifndef WELLSPACE_CLIENT_CLI_EXIT_CODES_H_
#define WELLSPACE_CLIENT_CLI_EXIT_CODES_H_

#include "absl/status/status.h"

namespace wellspace::cli {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;       // `check` or `info` found faults, or the work failed for no reason below
inline constexpr int kExitBadInput = 2;     // wrong usage, or a file that cannot be read or is not valid
inline constexpr int kExitUnavailable = 3;  // the server cannot be reached or stopped
inline constexpr int kExitExhausted = 4;    // a limit of vertices, memory or disk was reached; output not written
inline constexpr int kExitTimeout = 5;      // --timeout passed
inline constexpr int kExitUnauthenticated = 6;  // the server does not take the credentials, or its own are not trusted
inline constexpr int kExitConflict = 7;  // the session is in another state, or at another revision, than is needed
inline constexpr int kExitSignal = 128;  // plus the number of the signal: 130 for Ctrl-C

// The table above, for --help.
extern const char kExitCodesHelp[];

int ExitCodeOf(const absl::Status& status);

// The format in which results and errors are printed.
enum class OutputFormat { kText, kJson };

// Prints an error on standard error and returns its exit code. As JSON: {"error": {"code", "reason", "field",
// "message"}} in one line, without the reason and the field where the server gave none.
int ReportError(const absl::Status& status, OutputFormat format = OutputFormat::kText);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_EXIT_CODES_H_
