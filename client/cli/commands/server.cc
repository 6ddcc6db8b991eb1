// wellspace server info, health: which server is there, and is it well?
#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands/commands.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/statistics.h"
#include "client/printable.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

absl::Status PrintInfo(const RemoteCommand& remote, client::Client& client, const client::CallOptions& call) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::ServerInfo info, client.GetServerInfo(call));
  const std::string server = remote.address().empty() ? "embedded" : remote.address();
  if (remote.json()) {
    client::Json json = {{"server", server}};
    json.update(client::ServerInfoJson(info));
    PrintJson(json);
    return absl::OkStatus();
  }
  const auto print = [](const char* name, const std::string& value) {
    std::cout << absl::StrFormat("%-14s %s\n", name, client::Printable(value));
  };
  const auto seconds = [](absl::Duration duration) { return absl::StrFormat("%g s", absl::ToDoubleSeconds(duration)); };
  print("server", server);
  print("version", info.version);
  print("dimensions", absl::StrJoin(info.dimensions, ", "));
  print("max points", WithThousands(info.max_points));
  print("max vertices", WithThousands(info.max_vertices));
  print("max request", WithBinaryUnit(info.max_request_bytes));
  print("max memory", info.max_memory_bytes == 0 ? "no limit" : WithBinaryUnit(info.max_memory_bytes));
  print("stored", absl::StrCat(WithBinaryUnit(info.stored_bytes), " of ",
                               info.max_stored_bytes_per_tenant == 0
                                   ? "no limit"
                                   : absl::StrCat("at most ", WithBinaryUnit(info.max_stored_bytes_per_tenant))));
  print("max sessions",
        absl::StrCat(WithThousands(info.max_sessions), ", of a tenant ", WithThousands(info.max_sessions_per_tenant)));
  print("ttl", absl::StrCat(seconds(info.default_ttl), ", at most ", seconds(info.max_ttl)));
  print("stall limit", seconds(info.stall_limit));
  print("workers", std::to_string(info.workers));
  print("running jobs", std::to_string(info.running_jobs));
  print("queued jobs", absl::StrCat(info.queued_jobs, " of at most ", info.max_queued_jobs));
  return absl::OkStatus();
}

absl::Status PrintHealth(const RemoteCommand& remote, const std::string& service, client::Client& client,
                         const client::CallOptions& call) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Health health, client.CheckHealth(service, call));
  if (remote.json()) {
    PrintJson({{"service", service}, {"status", HealthName(health)}});
  } else if (!remote.quiet()) {
    std::cout << HealthName(health) << "\n";
  }
  return health == client::Health::kServing ? absl::OkStatus() : absl::UnavailableError("the server does not serve");
}

}  // namespace

void AddServerCommands(CLI::App& app, int& exit_code) {
  CLI::App* server = app.add_subcommand("server", "Ask a server about itself");
  server->require_subcommand(1);
  server->footer(kExitCodesHelp);

  CLI::App* info = server->add_subcommand("info", "Print version, limits and load");
  info->footer(kExitCodesHelp);
  const auto info_remote = std::make_shared<RemoteCommand>();
  info_remote->AddTo(*info, RemoteCommand::Needs::kAnyServer);
  info->callback([info_remote, &exit_code] {
    exit_code = info_remote->Run([&info_remote](client::Client& client, const client::CallOptions& call,
                                                const Interrupt&) { return PrintInfo(*info_remote, client, call); });
  });

  CLI::App* health = server->add_subcommand("health", "Tell whether a server serves; exit code 3 if it does not");
  health->footer(kExitCodesHelp);
  const auto health_remote = std::make_shared<RemoteCommand>();
  const auto service = std::make_shared<std::string>();
  health->add_option("--service", *service, "Full name of one service of it, such as wellspace.v1.SessionService");
  health_remote->AddTo(*health, RemoteCommand::Needs::kAnyServer);
  health->callback([health_remote, service, &exit_code] {
    exit_code = health_remote->Run(
        [&health_remote, &service](client::Client& client, const client::CallOptions& call, const Interrupt&) {
          return PrintHealth(*health_remote, *service, client, call);
        });
  });
}

}  // namespace wellspace::cli
