#include "client/cli/commands/commands.h"

namespace wellspace::cli {

void AddCommands(CLI::App& app, int& exit_code) {
  AddMeshCommand(app, exit_code);
  AddEstimateCommand(app, exit_code);
  AddSessionCommands(app, exit_code);
  AddTransferCommands(app, exit_code);
  AddOperationCommands(app, exit_code);
  AddQueryCommands(app, exit_code);
  AddConvertCommand(app, exit_code);
  AddInfoCommand(app, exit_code);
  AddCheckCommand(app, exit_code);
  AddPartitionCommand(app, exit_code);
  AddRenderCommand(app, exit_code);
  AddViewCommand(app, exit_code);
  AddConsoleCommand(app, exit_code);
  AddServerCommands(app, exit_code);
  AddAdminCommands(app, exit_code);
  AddCompletionCommands(app, exit_code);
}

}  // namespace wellspace::cli
