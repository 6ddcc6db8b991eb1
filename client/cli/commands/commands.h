// The commands of the tool. Each function adds one to `app`; when it is run, it sets `exit_code`.
#ifndef WELLSPACE_CLIENT_CLI_COMMANDS_COMMANDS_H_
#define WELLSPACE_CLIENT_CLI_COMMANDS_COMMANDS_H_

#include <CLI/CLI.hpp>

namespace wellspace::cli {

// REQUIRES, for each: `exit_code` outlives `app`.
void AddMeshCommand(CLI::App& app, int& exit_code);
void AddEstimateCommand(CLI::App& app, int& exit_code);
void AddCheckCommand(CLI::App& app, int& exit_code);
void AddRenderCommand(CLI::App& app, int& exit_code);
void AddServerCommand(CLI::App& app, int& exit_code);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_COMMANDS_COMMANDS_H_
