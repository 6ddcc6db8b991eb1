// The sources of options: the command line, the environment, the file of --config, and defaults, in this order.
#ifndef WELLSPACE_SERVER_OPTION_SOURCES_H_
#define WELLSPACE_SERVER_OPTION_SOURCES_H_

#include <string>
#include <string_view>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"

namespace wellspace::server {

// Variables with this prefix are ours.
inline constexpr std::string_view kVariablePrefix = "WELLSPACED_";

// The variable of an option: WELLSPACED_MAX_MEMORY for --max-memory.
std::string VariableOf(std::string_view option);

// The value of a variable; empty: it is not set, or is empty, which means the same here.
std::string ValueOf(const std::string& variable);

// Has each option of `app` that a file may set be set by its variable, too, and --config by WELLSPACED_CONFIG. To be
// called when all options are declared.
void DeclareVariables(CLI::App& app);

// Errors:     INVALID_ARGUMENT: `environment`, a list as of `environ`, has a variable with the prefix that is none of
//             an option; the message names it and the nearest, and repeats no value, which may be a secret.
absl::Status CheckVariables(const CLI::App& app, const char* const* environment);

// The variable whose value an error of parsing is about; empty: the error is about no variable. `count` and `arguments`
// are those of main.
std::string VariableBehind(const CLI::App& app, std::string_view error, int count, const char* const* arguments);

// The options in force after parsing, one line of TOML each, with its source as a comment: the lines are a file for
// --config. Options that have no value are comments. A password in an address, as in scheme://user:password@host, is
// shown as ***.
std::string DescribeOptions(const CLI::App& app, int count, const char* const* arguments);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_OPTION_SOURCES_H_
