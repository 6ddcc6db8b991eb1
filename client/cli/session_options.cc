#include "client/cli/session_options.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "client/cli/options.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr std::string_view kSessions = "sessions/";
constexpr std::string_view kOperations = "/operations/";

std::string WholeName(const std::string& name) {
  return name.compare(0, kSessions.size(), kSessions) == 0 ? name : absl::StrCat("sessions/", name);
}

}  // namespace

CLI::Option* AddSession(CLI::App& command, std::string& session) {
  return command
      .add_option_function<std::string>(
          "SESSION", [&session](const std::string& name) { session = WholeName(name); },
          "Name of the session, with or without sessions/")
      ->required();
}

void AddSessions(CLI::App& command, std::vector<std::string>& sessions) {
  command
      .add_option_function<std::vector<std::string>>(
          "SESSION",
          [&sessions](const std::vector<std::string>& names) {
            for (const std::string& name : names) {
              sessions.push_back(WholeName(name));
            }
          },
          "Names of sessions, with or without sessions/")
      ->required();
}

CLI::Option* AddOperation(CLI::App& command, std::string& name) {
  return command
      .add_option_function<std::string>(
          "OPERATION", [&name](const std::string& text) { name = WholeName(text); },
          "Name of the operation, or of a session, for its last operation")
      ->required();
}

absl::StatusOr<std::string> FindOperation(client::Client& client, const std::string& name,
                                          const client::CallOptions& call) {
  if (name.find(kOperations) != std::string::npos) {
    return name;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session session, client.GetSession(name, call));
  if (session.last_operation.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(name, " has had no operation yet; start one with: wellspace refine"));
  }
  return session.last_operation;
}

CLI::Option* AddLabels(CLI::App& command, client::Labels& labels, const std::string& description) {
  const auto parse = [&labels](const std::vector<std::string>& texts) {
    labels.clear();
    for (const std::string& text : texts) {
      const size_t equals = text.find('=');
      if (equals == std::string::npos || equals == 0) {
        throw CLI::ValidationError("--label", absl::StrCat("expected KEY=VALUE, got \"", text, "\""));
      }
      labels[text.substr(0, equals)] = text.substr(equals + 1);
    }
  };
  return command.add_option_function<std::vector<std::string>>("--label", parse, description)
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE");
}

void AddExpectedRevision(CLI::App& command, std::optional<uint64_t>& revision) {
  AddCount(
      command, "--expected-revision", [&revision](uint64_t value) { revision = value; },
      "Change nothing unless the session is at this revision; default: any", 1);
}

absl::StatusOr<std::vector<uint32_t>> ReadVertices(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(formats::InputFile file, formats::InputFile::Open(path));
  formats::LineReader reader(std::move(file));
  std::vector<uint32_t> vertices;
  std::string_view line;
  while (reader.NextContent(line)) {
    const bool has_commas = line.find(',') != std::string_view::npos;
    formats::FieldSplitter fields(line, has_commas ? ',' : ' ');
    std::string_view field;
    while (fields.Next(field)) {
      uint64_t vertex = 0;
      if (!formats::ParseUnsigned(field, std::numeric_limits<uint32_t>::max(), vertex)) {
        return reader.Error(absl::StrCat("expected the number of a vertex, got ", formats::Quote(field)));
      }
      vertices.push_back(static_cast<uint32_t>(vertex));
    }
  }
  if (!reader.status().ok()) {
    return reader.status();
  }
  return vertices;
}

}  // namespace wellspace::cli
