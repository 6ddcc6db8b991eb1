// wellspace session: create, list, show, update and delete sessions of a server.
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands/commands.h"
#include "client/cli/face_rules.h"
#include "client/cli/options.h"
#include "client/cli/parameter_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/cli/statistics.h"
#include "client/error_details.h"
#include "client/printable.h"
#include "client/rule_names.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

std::string LabelsText(const client::Labels& labels) {
  return client::Printable(absl::StrJoin(labels, " ", absl::PairFormatter("=")));
}

std::string QualityText(const client::MeshOptions& parameters) {
  std::string text =
      absl::StrFormat("%s, rho %g", client::CriterionName(parameters.criterion), parameters.rho.value_or(0));
  if (parameters.max_circumradius.has_value()) {
    absl::StrAppendFormat(&text, ", size %g", *parameters.max_circumradius);
  }
  if (!parameters.size_boxes.empty()) {
    absl::StrAppend(&text, ", ", parameters.size_boxes.size(), " size boxes");
  }
  if (parameters.min_dihedral.value_or(0) > 0) {
    absl::StrAppendFormat(&text, ", no dihedral angle below %g\u00b0", *parameters.min_dihedral);
  }
  if (parameters.pump_weights) {
    text += ", weights";
  }
  if (parameters.keep_vertices) {
    text += ", vertices of the last mesh kept";
  }
  return text;
}

void PrintSession(const client::Session& session, bool json) {
  if (json) {
    PrintJson(client::SessionJson(session));
    return;
  }
  const auto print = [](const char* name, const std::string& value) {
    std::cout << absl::StrFormat("%-16s %s\n", name, client::Printable(value));
  };
  print("name", session.name);
  print("state", client::StateName(session.state));
  print("dimension", absl::StrCat(session.parameters.dimension));
  print("domain", session.parameters.domain_low.empty()
                      ? absl::StrFormat("of the points, and a margin of %g", session.parameters.margin)
                      : absl::StrCat(absl::StrJoin(session.parameters.domain_low, ","), " to ",
                                     absl::StrJoin(session.parameters.domain_high, ",")));
  if (session.parameters.merge_distance.value_or(0) != 0) {
    print("merged", absl::StrFormat("points up to %g apart", *session.parameters.merge_distance));
  }
  print("quality", QualityText(session.parameters));
  print("points", WithThousands(session.committed_points));
  if (session.faces.has_value()) {
    print("segments", WithThousands(session.segment_count));
    print("faces", absl::StrCat(client::FaceRuleName(*session.faces), ", ", WithThousands(session.seed_count),
                                " holes and regions",
                                session.crossings == client::CrossingRule::kSplit  ? ", crossings split"
                                : session.crossings == client::CrossingRule::kSnap ? ", snapped"
                                                                                   : ""));
  }
  if (session.surface.has_value()) {
    print("triangles", WithThousands(session.triangle_count));
    print("solids", absl::StrCat(client::SolidRuleName(session.surface->solids), ", ",
                                 WithThousands(session.seed_count), " holes and regions"));
  }
  if (session.size_count > 0) {
    print("sizes", absl::StrCat("at ", WithThousands(session.size_count), " points"));
  }
  print("vertices", WithThousands(session.vertex_count));
  print("simplices", WithThousands(session.simplex_count));
  print("stored", WithBinaryUnit(session.stored_bytes));
  print("revision", absl::StrCat(session.revision));
  print("last operation", session.last_operation.empty() ? "none" : session.last_operation);
  print("labels", LabelsText(session.labels));
  print("ttl", absl::StrFormat("%g s", absl::ToDoubleSeconds(session.ttl)));
  print("created", client::TimeText(session.create_time));
  print("expires", client::TimeText(session.expire_time));
}

// `status` with the option that the server blames under another name.
absl::Status ExplainSettings(const absl::Status& status) {
  const std::string field = client::BlamedField(status);
  const bool is_ttl = field == "ttl" || field == "session.ttl";
  const bool is_label = field.find("labels") != std::string::npos;
  return !is_ttl && !is_label
             ? status
             : client::WithMessage(status, absl::StrCat(is_ttl ? "--ttl: " : "--label: ", status.message()));
}

struct SessionCommand {
  RemoteCommand remote;
  ParameterOptions parameters;
  std::string session;
  std::vector<std::string> sessions;
  client::Labels labels;
  bool clear_labels = false;
  double ttl_seconds = 0;  // 0: not given
  uint64_t limit = 0;      // 0: none
  std::optional<uint64_t> expected_revision;

  std::optional<absl::Duration> Ttl() const {
    return ttl_seconds > 0 ? std::make_optional(absl::Seconds(ttl_seconds)) : std::nullopt;
  }

  int Create();
  int List();
  int Show();
  int Update();
  int Delete();
};

int SessionCommand::Create() {
  absl::Status status = parameters.Check();
  if (status.ok() && parameters.dimension() == 0) {
    status = absl::InvalidArgumentError("--dimension: is required; expected 2 to 6, or --domain");
  }
  const absl::StatusOr<client::MeshOptions> options = status.ok() ? parameters.For(parameters.dimension()) : status;
  if (!options.ok()) {
    return ReportError(options.status(), remote.format());
  }
  return remote.Run([&](client::Client& client, const client::CallOptions& call, const Interrupt&) {
    const absl::StatusOr<client::Session> created =
        client.CreateSession({.parameters = *options, .labels = labels, .ttl = Ttl()}, call);
    if (!created.ok()) {
      return ExplainSettings(parameters.Explain(created.status()));
    }
    if (remote.json()) {
      PrintJson(client::SessionJson(*created));
    } else {
      std::cout << client::Printable(created->name) << "\n";
    }
    return absl::OkStatus();
  });
}

int SessionCommand::List() {
  return remote.Run([&](client::Client& client, const client::CallOptions& call, const Interrupt&) -> absl::Status {
    client::Json json = client::Json::array();
    client::PageOptions page;
    uint64_t listed = 0;
    do {
      constexpr uint64_t kLargestPage = 1000;
      if (limit != 0) {
        page.page_size = static_cast<int>(std::min(limit - listed, kLargestPage));
      }
      WELLSPACE_ASSIGN_OR_RETURN(const client::SessionPage result, client.ListSessions(labels, page, call));
      if (page.page_token.empty() && !remote.json() && !remote.quiet()) {
        std::cout << absl::StrFormat("%-44s %-9s %12s %12s  %-20s  %s\n", "NAME", "STATE", "POINTS", "VERTICES",
                                     "EXPIRES", "LABELS");
      }
      for (const client::Session& one : result.sessions) {
        ++listed;
        if (remote.json()) {
          json.push_back(client::SessionJson(one));
        } else {
          std::cout << absl::StrFormat("%-44s %-9s %12s %12s  %-20s  %s\n", client::Printable(one.name),
                                       client::StateName(one.state), WithThousands(one.committed_points),
                                       WithThousands(one.vertex_count), client::TimeText(one.expire_time),
                                       LabelsText(one.labels));
        }
      }
      page.page_token = result.next_page_token;
    } while (!page.page_token.empty() && (limit == 0 || listed < limit));
    if (remote.json()) {
      PrintJson(json);
    }
    return absl::OkStatus();
  });
}

int SessionCommand::Show() {
  return remote.Run([&](client::Client& client, const client::CallOptions& call, const Interrupt&) {
    const absl::StatusOr<client::Session> found = client.GetSession(session, call);
    if (found.ok()) {
      PrintSession(*found, remote.json());
    }
    return found.status();
  });
}

int SessionCommand::Update() {
  client::SessionUpdate change;
  change.ttl = Ttl();
  if (!labels.empty() || clear_labels) {
    change.labels = labels;
  }
  if (!change.ttl.has_value() && !change.labels.has_value()) {
    return ReportError(absl::InvalidArgumentError("nothing to change; expected --ttl, --label or --clear-labels"),
                       remote.format());
  }
  return remote.Run([&](client::Client& client, client::CallOptions call, const Interrupt&) {
    call.expected_revision = expected_revision;
    const absl::StatusOr<client::Session> updated = client.UpdateSession(session, change, call);
    if (updated.ok() && (remote.json() || !remote.quiet())) {
      PrintSession(*updated, remote.json());
    }
    return ExplainSettings(updated.status());
  });
}

int SessionCommand::Delete() {
  return remote.Run([&](client::Client& client, client::CallOptions call, const Interrupt&) -> absl::Status {
    call.expected_revision = expected_revision;
    for (const std::string& one : sessions) {
      if (absl::Status status = client.DeleteSession(one, call); !status.ok()) {
        return client::WithMessage(status, absl::StrCat(one, ": ", status.message()));
      }
    }
    if (remote.json()) {
      PrintJson({{"deleted", sessions}});
    }
    return absl::OkStatus();
  });
}

// Adds a subcommand that runs `member`.
CLI::App* Add(CLI::App& session, const char* name, const char* description,
              const std::shared_ptr<SessionCommand>& command, int (SessionCommand::*member)(), int& exit_code) {
  CLI::App* app = session.add_subcommand(name, description);
  app->footer(kExitCodesHelp);
  app->callback([command, member, &exit_code] { exit_code = (command.get()->*member)(); });
  return app;
}

CLI::Option* AddTtl(CLI::App& app, double& seconds) {
  return AddNumber(app, "--ttl", seconds,
                   "Seconds that the session lives without any use; default: as the server likes it")
      ->check(AboveZero());
}

void AddCreate(CLI::App& session, int& exit_code) {
  const auto command = std::make_shared<SessionCommand>();
  CLI::App* app =
      Add(session, "create", "Create a session, and print its name", command, &SessionCommand::Create, exit_code);
  command->parameters.AddSpaceTo(*app);
  app->get_option("--dimension")->description("Dimension; required unless --domain tells it");
  command->parameters.AddQualityTo(*app);
  AddLabels(*app, command->labels, "Label of the session; may be given more than once");
  AddTtl(*app, command->ttl_seconds);
  command->remote.AddTo(*app, RemoteCommand::Needs::kLastingServer);
}

void AddList(CLI::App& session, int& exit_code) {
  const auto command = std::make_shared<SessionCommand>();
  CLI::App* app = Add(session, "list", "List sessions, the oldest first", command, &SessionCommand::List, exit_code);
  AddLabels(*app, command->labels, "Only sessions with this label; may be given more than once");
  AddCount(
      *app, "--limit", [command](uint64_t limit) { command->limit = limit; }, "Most sessions to list; default: all", 1);
  command->remote.AddTo(*app, RemoteCommand::Needs::kLastingServer);
}

void AddShow(CLI::App& session, int& exit_code) {
  const auto command = std::make_shared<SessionCommand>();
  CLI::App* app =
      Add(session, "show", "Show a session, and renew its lease", command, &SessionCommand::Show, exit_code);
  AddSession(*app, command->session);
  command->remote.AddTo(*app, RemoteCommand::Needs::kLastingServer);
}

void AddUpdate(CLI::App& session, int& exit_code) {
  const auto command = std::make_shared<SessionCommand>();
  CLI::App* app = Add(session, "update", "Change the labels or the time to live of a session", command,
                      &SessionCommand::Update, exit_code);
  AddSession(*app, command->session);
  CLI::Option* labels =
      AddLabels(*app, command->labels, "Label in the place of all that there are; may be given more than once");
  app->add_flag("--clear-labels", command->clear_labels, "Remove all labels")->excludes(labels);
  AddTtl(*app, command->ttl_seconds);
  AddExpectedRevision(*app, command->expected_revision);
  command->remote.AddTo(*app, RemoteCommand::Needs::kLastingServer);
}

void AddDelete(CLI::App& session, int& exit_code) {
  const auto command = std::make_shared<SessionCommand>();
  CLI::App* app = Add(session, "delete", "Delete sessions with their points and meshes", command,
                      &SessionCommand::Delete, exit_code);
  AddSessions(*app, command->sessions);
  AddExpectedRevision(*app, command->expected_revision);
  command->remote.AddTo(*app, RemoteCommand::Needs::kLastingServer);
}

}  // namespace

void AddSessionCommands(CLI::App& app, int& exit_code) {
  CLI::App* session = app.add_subcommand("session", "Create, list, show, update and delete sessions of a server");
  session->require_subcommand(1);
  session->footer(kExitCodesHelp);
  AddCreate(*session, exit_code);
  AddList(*session, exit_code);
  AddShow(*session, exit_code);
  AddUpdate(*session, exit_code);
  AddDelete(*session, exit_code);
}

}  // namespace wellspace::cli
