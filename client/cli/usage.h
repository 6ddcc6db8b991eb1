// Answers to words that the tool does not understand.
#ifndef WELLSPACE_CLIENT_CLI_USAGE_H_
#define WELLSPACE_CLIENT_CLI_USAGE_H_

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/exit_codes.h"

namespace wellspace::cli {

// Parses `arguments`, those after the tool's name, and runs their command. Returns the exit code:
// `exit_code`, which the command has set; 0 after --help and --version, which it prints; or kExitBadInput for wrong
// usage, which it reports with the help to look at, as JSON if the arguments ask for that. Text that could not be
// written to standard output is an error, too, unless the command has failed for another reason.
int RunCommandLine(CLI::App& app, std::vector<std::string> arguments, const int& exit_code);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_USAGE_H_
