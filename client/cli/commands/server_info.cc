// wellspace server info: who is there?
#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/server_link.h"

namespace wellspace::cli {
namespace {

int PrintServerInfo(const ServerChoice& choice) {
  absl::StatusOr<std::unique_ptr<ServerLink>> link = ServerLink::Open(choice);
  if (!link.ok()) {
    return ReportError(link.status());
  }
  const absl::StatusOr<client::ServerInfo> info = (*link)->client().GetServerInfo();
  if (!info.ok()) {
    return ReportError((*link)->Explain(info.status()));
  }
  const auto print = [](const char* name, const std::string& value) {
    std::cout << absl::StrFormat("%-14s %s\n", name, value);
  };
  print("server", choice.address.empty() ? "embedded" : choice.address);
  print("version", info->version);
  print("dimensions", absl::StrJoin(info->dimensions, ", "));
  print("max points", WithThousands(info->max_points));
  print("max vertices", WithThousands(info->max_vertices));
  print("workers", std::to_string(info->workers));
  print("running jobs", std::to_string(info->running_jobs));
  print("queued jobs", std::to_string(info->queued_jobs));
  return kExitOk;
}

}  // namespace

void AddServerCommand(CLI::App& app, int& exit_code) {
  CLI::App* server = app.add_subcommand("server", "Ask a server about itself");
  server->require_subcommand(1);
  CLI::App* info = server->add_subcommand("info", "Print version, limits and load");
  info->footer(kExitCodesHelp);
  const auto choice = std::make_shared<ServerChoice>();
  AddServer(*info, *choice);
  info->callback([choice, &exit_code] { exit_code = PrintServerInfo(*choice); });
}

}  // namespace wellspace::cli
