// wellspace admin operations, cancel, drain, usage: for operators of a server.
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands/commands.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/printable.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

const std::map<std::string, client::OperationState>& States() {
  static const std::map<std::string, client::OperationState> states = {
      {"queued", client::OperationState::kQueued},
      {"running", client::OperationState::kRunning},
      {"succeeded", client::OperationState::kSucceeded},
      {"failed", client::OperationState::kFailed},
      {"cancelled", client::OperationState::kCancelled}};
  return states;
}

struct AdminCommand {
  RemoteCommand remote;
  client::OperationFilter operations;
  client::UsageFilter usage;
  std::string operation;

  absl::Status ListOperations(client::Client& client, const client::CallOptions& call) const;
  absl::Status Cancel(client::Client& client, const client::CallOptions& call) const;
  absl::Status Drain(client::Client& client, const client::CallOptions& call) const;
  absl::Status TellUsage(client::Client& client, const client::CallOptions& call) const;
  int Run(absl::Status (AdminCommand::*work)(client::Client&, const client::CallOptions&) const) const {
    return remote.Run([this, work](client::Client& client, const client::CallOptions& call, const Interrupt&) {
      return (this->*work)(client, call);
    });
  }
};

// Page by page: there may be many.
absl::Status AdminCommand::ListOperations(client::Client& client, const client::CallOptions& call) const {
  constexpr char kRow[] = "%-16s %-78s %-9s %-12s  %s\n";
  client::Json all = client::Json::array();
  client::PageOptions page;
  bool has_head = remote.quiet() || remote.json();
  do {
    WELLSPACE_ASSIGN_OR_RETURN(client::OwnedOperationPage listed, client.ListAllOperations(operations, page, call));
    for (const client::OwnedOperation& one : listed.operations) {
      if (remote.json()) {
        client::Json json = client::OperationJson(one.operation);
        json["tenant"] = one.tenant;
        json["replica"] = one.replica;
        json["address"] = one.address;
        all.push_back(std::move(json));
        continue;
      }
      if (!std::exchange(has_head, true)) {
        std::cout << absl::StrFormat(kRow, "TENANT", "OPERATION", "STATE", "REPLICA", "SINCE");
      }
      std::cout << absl::StrFormat(kRow, client::Printable(one.tenant), client::Printable(one.operation.name),
                                   client::StateName(one.operation.state),
                                   one.replica.empty() ? "-" : client::Printable(one.replica),
                                   client::TimeText(one.operation.start_time.value_or(one.operation.create_time)));
    }
    page.page_token = listed.next_page_token;
  } while (!page.page_token.empty() && std::cout);
  if (remote.json()) {
    PrintJson(all);
  }
  return absl::OkStatus();
}

absl::Status AdminCommand::Cancel(client::Client& client, const client::CallOptions& call) const {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Operation asked, client.CancelAnyOperation(operation, call));
  if (remote.json()) {
    PrintJson(client::OperationJson(asked));
  } else if (!remote.quiet()) {
    const bool goes_on = asked.state == client::OperationState::kRunning;
    std::cout << client::Printable(asked.name) << " "
              << (goes_on ? "is being cancelled" : client::StateName(asked.state)) << "\n";
  }
  return absl::OkStatus();
}

absl::Status AdminCommand::Drain(client::Client& client, const client::CallOptions& call) const {
  WELLSPACE_ASSIGN_OR_RETURN(const absl::Duration grace, client.DrainServer(call));
  if (remote.json()) {
    PrintJson({{"grace_seconds", absl::ToDoubleSeconds(grace)}});
  } else if (!remote.quiet()) {
    std::cout << "the server stops; running work has " << absl::FormatDuration(grace) << "\n";
  }
  return absl::OkStatus();
}

absl::Status AdminCommand::TellUsage(client::Client& client, const client::CallOptions& call) const {
  constexpr char kRow[] = "%-24s %12s %18s %16s %10s %18s\n";
  client::Json all = client::Json::array();
  client::PageOptions page;
  bool has_head = remote.quiet() || remote.json();
  do {
    WELLSPACE_ASSIGN_OR_RETURN(const client::UsagePage told, client.GetUsage(usage, page, call));
    for (const client::TenantUsage& one : told.usage) {
      if (remote.json()) {
        all.push_back({{"tenant", one.tenant},
                       {"meshes", one.meshes},
                       {"vertices", one.vertices},
                       {"processor_seconds", absl::ToDoubleSeconds(one.processor_time)},
                       {"sessions", one.sessions},
                       {"stored_bytes", one.stored_bytes}});
        continue;
      }
      if (!std::exchange(has_head, true)) {
        std::cout << absl::StrFormat(kRow, "TENANT", "MESHES", "VERTICES", "PROCESSOR S", "SESSIONS", "STORED BYTES");
      }
      std::cout << absl::StrFormat(kRow, client::Printable(one.tenant), WithThousands(one.meshes),
                                   WithThousands(one.vertices),
                                   absl::StrFormat("%.1f", absl::ToDoubleSeconds(one.processor_time)),
                                   WithThousands(one.sessions), WithThousands(one.stored_bytes));
    }
    page.page_token = told.next_page_token;
  } while (!page.page_token.empty() && std::cout);
  if (remote.json()) {
    PrintJson(all);
  }
  return absl::OkStatus();
}

}  // namespace

void AddAdminCommands(CLI::App& app, int& exit_code) {
  CLI::App* admin =
      app.add_subcommand("admin", "Administer a server, with a token that its --token-file declares `admin`");
  admin->require_subcommand(1);
  admin->footer(kExitCodesHelp);
  const auto add = [&](const std::string& name, const std::string& description,
                       absl::Status (AdminCommand::*work)(client::Client&, const client::CallOptions&) const,
                       const auto& declare) {
    const auto command = std::make_shared<AdminCommand>();
    CLI::App* declared = admin->add_subcommand(name, description);
    declared->footer(kExitCodesHelp);
    declare(*declared, *command);
    command->remote.AddTo(*declared, RemoteCommand::Needs::kLastingServer);
    declared->callback([command, work, &exit_code] { exit_code = command->Run(work); });
  };
  add("operations",
      "List the operations of all tenants, and which server has them; of several servers that share a database, those "
      "of all",
      &AdminCommand::ListOperations, [](CLI::App& declared, AdminCommand& command) {
        declared.add_option("--tenant", command.operations.tenant, "Only those of this tenant")->type_name("TENANT");
        declared
            .add_option_function<std::string>(
                "--state", [&command](const std::string& state) { command.operations.state = States().at(state); },
                "Only those in this state")
            ->check(CLI::IsMember(States()));
      });
  add("cancel", "Cancel an operation, whosever it is; its session keeps its points", &AdminCommand::Cancel,
      [](CLI::App& declared, AdminCommand& command) {
        declared
            .add_option("operation", command.operation, "Name of the operation, sessions/SESSION/operations/NUMBER")
            ->type_name("OPERATION")
            ->required();
      });
  add("drain",
      "Have the server stop, as SIGTERM does: it takes no more work, and exits when what runs has ended or --grace is "
      "out",
      &AdminCommand::Drain, [](CLI::App&, AdminCommand&) {});
  add("usage", "Tell what was done for each tenant, and what its sessions keep now", &AdminCommand::TellUsage,
      [](CLI::App& declared, AdminCommand& command) {
        declared.add_option("--tenant", command.usage.tenant, "Only this tenant")->type_name("TENANT");
        declared.add_option("--since", command.usage.first_day, "First day, in UTC, whose work is counted")
            ->type_name("YYYY-MM-DD");
        declared.add_option("--until", command.usage.last_day, "Last day, in UTC, whose work is counted")
            ->type_name("YYYY-MM-DD");
      });
}

}  // namespace wellspace::cli
