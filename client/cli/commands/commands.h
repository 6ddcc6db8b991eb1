// The commands of the tool. Each function adds one to `app`, or a few that belong together; when one is run, it sets
// `exit_code`.
#ifndef WELLSPACE_CLIENT_CLI_COMMANDS_COMMANDS_H_
#define WELLSPACE_CLIENT_CLI_COMMANDS_COMMANDS_H_

#include <CLI/CLI.hpp>

namespace wellspace::cli {

// REQUIRES, for each: `exit_code` outlives `app`.
void AddMeshCommand(CLI::App& app, int& exit_code);
void AddEstimateCommand(CLI::App& app, int& exit_code);
void AddSessionCommands(CLI::App& app, int& exit_code);    // session create, list, show, update, delete
void AddTransferCommands(CLI::App& app, int& exit_code);   // upload, download
void AddOperationCommands(CLI::App& app, int& exit_code);  // refine, watch, jobs, cancel
void AddQueryCommands(CLI::App& app, int& exit_code);      // cells, add
void AddConvertCommand(CLI::App& app, int& exit_code);
void AddInfoCommand(CLI::App& app, int& exit_code);
void AddCheckCommand(CLI::App& app, int& exit_code);
void AddPartitionCommand(CLI::App& app, int& exit_code);
void AddRenderCommand(CLI::App& app, int& exit_code);
void AddViewCommand(CLI::App& app, int& exit_code);
void AddConsoleCommand(CLI::App& app, int& exit_code);
void AddServerCommands(CLI::App& app, int& exit_code);      // server info, health
void AddAdminCommands(CLI::App& app, int& exit_code);       // admin operations, cancel, drain, usage
void AddCompletionCommands(CLI::App& app, int& exit_code);  // completion bash, manual

// All of them.
void AddCommands(CLI::App& app, int& exit_code);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_COMMANDS_COMMANDS_H_
