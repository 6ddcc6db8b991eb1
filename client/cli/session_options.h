// The common part of the commands about sessions.
#ifndef WELLSPACE_CLIENT_CLI_SESSION_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_SESSION_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/client.h"

namespace wellspace::cli {

// SESSION, "sessions/{session}" or its last part only; `session` gets the whole name.
CLI::Option* AddSession(CLI::App& command, std::string& session);
// SESSION..., one or more.
void AddSessions(CLI::App& command, std::vector<std::string>& sessions);

// OPERATION: the name of an operation, or that of a session, for its last one. See FindOperation.
CLI::Option* AddOperation(CLI::App& command, std::string& name);

// The operation that `name` means.
// Errors:     FAILED_PRECONDITION when the session has had none yet; as of GetSession.
absl::StatusOr<std::string> FindOperation(client::Client& client, const std::string& name,
                                          const client::CallOptions& call);

// --label KEY=VALUE, as often as needed.
CLI::Option* AddLabels(CLI::App& command, client::Labels& labels, const std::string& description);

// --expected-revision.
void AddExpectedRevision(CLI::App& command, std::optional<uint64_t>& revision);

// The numbers of vertices in a file, separated by blanks, commas or ends of lines; "-" is standard input; '#' starts a
// comment.
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …".
absl::StatusOr<std::vector<uint32_t>> ReadVertices(const std::string& path);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SESSION_OPTIONS_H_
