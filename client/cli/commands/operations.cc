// wellspace refine, watch, jobs, cancel: the long work on a session.
#include <algorithm>
#include <cstdint>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands/commands.h"
#include "client/cli/parameter_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/cli/size_field_options.h"
#include "client/error_details.h"
#include "client/overview.h"
#include "client/printable.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

// The end of an operation, as a status.
absl::Status EndOf(const client::Operation& operation) {
  if (operation.state == client::OperationState::kSucceeded) {
    return absl::OkStatus();
  }
  return operation.error.ok() ? absl::CancelledError(absl::StrCat(operation.name, " was cancelled")) : operation.error;
}

// Follows an operation to its end on the terminal, or as lines of JSON.
absl::StatusOr<client::Operation> Follow(client::Client& client, const RemoteCommand& remote, const std::string& name,
                                         const client::CallOptions& call, bool prints_events) {
  ProgressBar bar(!remote.quiet() && !remote.json());
  std::stop_source stop;
  const std::stop_callback forward(call.stop, [&stop] { stop.request_stop(); });
  const auto on_progress = [&](const client::Progress& progress) {
    if (prints_events && remote.json()) {
      PrintJson(client::ProgressJson(progress), /*indented=*/false);
      if (!std::cout) {
        stop.request_stop();  // later lines could not be printed either
      }
    }
    bar.Update(progress);
  };
  client::CallOptions stoppable = call;
  stoppable.stop = stop.get_token();
  return client.WatchOperation(name, on_progress, std::nullopt, stoppable);
}

void PrintEnd(const RemoteCommand& remote, const client::Operation& operation, bool indented) {
  if (remote.json()) {
    PrintJson(client::OperationJson(operation), indented);
  } else if (operation.state == client::OperationState::kSucceeded && !remote.quiet()) {
    std::cout << client::Printable(operation.name) << " succeeded: " << WithThousands(operation.progress.vertices)
              << " vertices, revision " << operation.mesh_revision << "\n";
  }
}

// The work that is queued or runs on the sessions of the caller, and how much the server has to do.
absl::Status PrintJobs(const RemoteCommand& remote, client::Client& client, const client::CallOptions& call) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::ServerInfo info, client.GetServerInfo(call));
  constexpr uint64_t kAll = std::numeric_limits<uint64_t>::max();
  WELLSPACE_ASSIGN_OR_RETURN(const client::Overview overview,
                             client::GetOverview(client, {.most = kAll, .busy_alone = true}, call));
  if (remote.json()) {
    client::Json operations = client::Json::array();
    for (const client::SessionWithOperation& one : overview.sessions) {
      operations.push_back(client::OperationJson(*one.operation));
    }
    PrintJson({{"running_jobs", info.running_jobs},
               {"queued_jobs", info.queued_jobs},
               {"workers", info.workers},
               {"operations", operations}});
    return absl::OkStatus();
  }
  if (!remote.quiet()) {
    std::cout << "server: " << info.running_jobs << " jobs run on " << info.workers << " workers, " << info.queued_jobs
              << " wait\n";
  }
  constexpr char kRow[] = "%-78s %-8s %-11s %5s %13s  %s\n";
  if (!remote.quiet() && !overview.sessions.empty()) {
    std::cout << absl::StrFormat(kRow, "OPERATION", "STATE", "PHASE", "DONE", "VERTICES", "SINCE");
  }
  for (const client::SessionWithOperation& one : overview.sessions) {
    const client::Operation& operation = *one.operation;
    std::cout << absl::StrFormat(
        kRow, client::Printable(operation.name), client::StateName(operation.state),
        client::Printable(operation.progress.phase),
        absl::StrCat(static_cast<int>(100 * std::clamp(operation.progress.fraction, 0.0, 1.0)), "%"),
        WithThousands(operation.progress.vertices),
        client::TimeText(operation.start_time.value_or(operation.create_time)));
  }
  return absl::OkStatus();
}

struct OperationCommand {
  RemoteCommand remote;
  ParameterOptions parameters;
  std::string name;
  SizeFieldOptions sizes;
  formats::CloudOptions reading_sizes;
  bool no_sizes = false;
  bool restart = false;
  bool detach = false;
  std::optional<uint64_t> expected_revision;

  absl::Status SetSizes(client::Client& client, client::CallOptions& call, const Interrupt& interrupt);
  absl::StatusOr<client::Operation> Start(client::Client& client, client::CallOptions call, const Interrupt& interrupt);
  int Refine();
  int Watch() const;
  int Cancel() const;
};

// Gives the session the sizes of the file, or takes those that it has. The revision that the refinement expects, if it
// expects one, is then that after this.
absl::Status OperationCommand::SetSizes(client::Client& client, client::CallOptions& call, const Interrupt& interrupt) {
  client::SizeSamples samples;
  if (sizes.IsGiven()) {
    WELLSPACE_ASSIGN_OR_RETURN(const client::Session session, client.GetSession(name, call));
    WELLSPACE_ASSIGN_OR_RETURN(const client::MeshOptions wanted, parameters.Replace(session.parameters));
    const std::optional<double> gradation = wanted.gradation;
    const Interrupt::AtOnce reading(interrupt);
    WELLSPACE_ASSIGN_OR_RETURN(const auto read,
                               sizes.Read(session.parameters.dimension, reading_sizes.skip_invalid, gradation));
    CloudReport report;
    NoteSizes(sizes, reading_sizes, remote.format(), remote.quiet(), report);
    samples = *read;
  } else if (!no_sizes) {
    return absl::OkStatus();
  }
  const absl::StatusOr<client::SizesSet> set = client.SetSizes(name, samples, call);
  if (!set.ok()) {
    return sizes.WithOrigins(set.status());
  }
  if (call.expected_revision.has_value()) {
    call.expected_revision = set->revision;
  }
  return absl::OkStatus();
}

absl::StatusOr<client::Operation> OperationCommand::Start(client::Client& client, client::CallOptions call,
                                                          const Interrupt& interrupt) {
  client::RefinementOptions refinement{.restart = restart};
  if (parameters.has_quality()) {
    WELLSPACE_ASSIGN_OR_RETURN(const client::Session session, client.GetSession(name, call));
    WELLSPACE_ASSIGN_OR_RETURN(refinement.parameters, parameters.Replace(session.parameters));
  }
  call.expected_revision = expected_revision;
  WELLSPACE_RETURN_IF_ERROR(SetSizes(client, call, interrupt));
  // Not stopped by Ctrl-C: a user that does not learn that an operation was started cannot cancel it.
  call.stop = {};
  absl::StatusOr<client::Operation> started = client.StartRefinement(name, refinement, call);
  return started.ok() ? started : parameters.Explain(started.status());
}

// Ends an operation after Ctrl-C, and waits until it has ended: the session then takes the next command. Returns what
// the command ends with.
absl::Status CancelNow(client::Client& client, const std::string& operation) {
  client::CallOptions call;
  call.timeout = absl::Seconds(10);
  if (const absl::StatusOr<client::Operation> cancelled = client.CancelOperation(operation, call); !cancelled.ok()) {
    return absl::CancelledError(
        absl::StrCat("interrupted; ", operation, " could not be cancelled: ", cancelled.status().message()));
  }
  (void)client.WatchOperation(operation, nullptr, std::nullopt, call);  // it is cancelled, whatever becomes of this
  return absl::CancelledError(absl::StrCat("interrupted; ", operation, " is cancelled, its session keeps its points"));
}

int OperationCommand::Refine() {
  if (const absl::Status status = parameters.Check(); !status.ok()) {
    return ReportError(status, remote.format());
  }
  return remote.Run([this](client::Client& client, const client::CallOptions& call,
                           const Interrupt& interrupt) -> absl::Status {
    WELLSPACE_ASSIGN_OR_RETURN(const client::Operation started, Start(client, call, interrupt));
    if (detach) {
      remote.json() ? PrintJson(client::OperationJson(started))
                    : static_cast<void>(std::cout << client::Printable(started.name) << "\n");
      return absl::OkStatus();
    }
    const absl::StatusOr<client::Operation> ended = Follow(client, remote, started.name, call, /*prints_events=*/false);
    if (!ended.ok()) {
      if (interrupt.signal() != 0) {
        return CancelNow(client, started.name);
      }
      // A server that cannot be reached may be gone, with all its work.
      const char* fate = absl::IsUnavailable(ended.status()) ? " may go on" : " goes on";
      return client::WithMessage(ended.status(), absl::StrCat(ended.status().message(), "; ", started.name, fate));
    }
    PrintEnd(remote, *ended, /*indented=*/true);
    return sizes.WithOrigins(parameters.Explain(EndOf(*ended)));
  });
}

int OperationCommand::Watch() const {
  return remote.Run([this](client::Client& client, const client::CallOptions& call, const Interrupt&) -> absl::Status {
    WELLSPACE_ASSIGN_OR_RETURN(const std::string operation, FindOperation(client, name, call));
    const absl::StatusOr<client::Operation> ended = Follow(client, remote, operation, call, /*prints_events=*/true);
    if (!std::cout) {
      return absl::OkStatus();  // told at the end, see StandardOutput
    }
    if (!ended.ok()) {
      return ended.status();
    }
    PrintEnd(remote, *ended, /*indented=*/false);
    return EndOf(*ended);
  });
}

int OperationCommand::Cancel() const {
  return remote.Run([this](client::Client& client, const client::CallOptions& call, const Interrupt&) -> absl::Status {
    WELLSPACE_ASSIGN_OR_RETURN(const std::string operation, FindOperation(client, name, call));
    if (const absl::StatusOr<client::Operation> asked = client.CancelOperation(operation, call); !asked.ok()) {
      return asked.status();
    }
    WELLSPACE_ASSIGN_OR_RETURN(const client::Operation ended,
                               client.WatchOperation(operation, nullptr, std::nullopt, call));
    if (remote.json()) {
      PrintJson(client::OperationJson(ended));
    } else if (!remote.quiet()) {
      std::cout << client::Printable(ended.name) << " " << client::StateName(ended.state) << "\n";
    }
    return absl::OkStatus();
  });
}

}  // namespace

void AddOperationCommands(CLI::App& app, int& exit_code) {
  const auto refine = std::make_shared<OperationCommand>();
  CLI::App* refine_app = app.add_subcommand(
      "refine", "Refine the mesh of a session, and wait until it is done; Ctrl-C cancels the refinement");
  refine_app->footer(kExitCodesHelp);
  AddSession(*refine_app, refine->name);
  refine->parameters.AddQualityTo(*refine_app);
  CLI::Option* field = refine->sizes.AddTo(*refine_app);
  refine_app
      ->add_flag(
          "--skip-invalid", refine->reading_sizes.skip_invalid,
          "Leave out sizes that, or a coordinate of which, are missing (empty, NA), NaN or infinite, and say how "
          "many; default: the first one is an error")
      ->needs(field);
  refine_app
      ->add_flag("--no-size-field", refine->no_sizes,
                 "The session has no sizes at points any more; without this and --size-field it keeps those it has")
      ->excludes(field);
  refine_app->add_flag("--restart", refine->restart,
                       "Make the mesh anew, from the points of the session alone: it becomes coarser where sizes have "
                       "grown, and vertices get new numbers");
  refine_app->add_flag("--detach", refine->detach,
                       "Do not wait: print the name of the operation, for watch and cancel");
  AddExpectedRevision(*refine_app, refine->expected_revision);
  refine->remote.AddTo(*refine_app, RemoteCommand::Needs::kLastingServer);
  refine_app->callback([refine, &exit_code] { exit_code = refine->Refine(); });

  const auto watch = std::make_shared<OperationCommand>();
  CLI::App* watch_app =
      app.add_subcommand("watch",
                         "Follow an operation to its end; Ctrl-C leaves it alone. As JSON: an event a "
                         "line, then the operation in one line");
  watch_app->footer(kExitCodesHelp);
  AddOperation(*watch_app, watch->name);
  watch->remote.AddTo(*watch_app, RemoteCommand::Needs::kLastingServer);
  watch_app->callback([watch, &exit_code] { exit_code = watch->Watch(); });

  const auto jobs = std::make_shared<RemoteCommand>();
  CLI::App* jobs_app = app.add_subcommand(
      "jobs", "Print the work that waits or runs on your sessions, and how much work the server has");
  jobs_app->footer(kExitCodesHelp);
  jobs->AddTo(*jobs_app, RemoteCommand::Needs::kLastingServer);
  jobs_app->callback([jobs, &exit_code] {
    exit_code = jobs->Run([&jobs](client::Client& client, const client::CallOptions& call, const Interrupt&) {
      return PrintJobs(*jobs, client, call);
    });
  });

  const auto cancel = std::make_shared<OperationCommand>();
  CLI::App* cancel_app =
      app.add_subcommand("cancel", "Cancel an operation, and wait until it has ended; its session keeps its points");
  cancel_app->footer(kExitCodesHelp);
  AddOperation(*cancel_app, cancel->name);
  cancel->remote.AddTo(*cancel_app, RemoteCommand::Needs::kLastingServer);
  cancel_app->callback([cancel, &exit_code] { exit_code = cancel->Cancel(); });
}

}  // namespace wellspace::cli
