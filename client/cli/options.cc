#include "client/cli/options.h"

#include <cstdlib>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::cli {
namespace {

double ParseOption(const std::string& name, std::string_view text) {
  double value = 0;
  if (const absl::Status status = formats::ParseFinite(formats::TrimBlanks(text), value); !status.ok()) {
    throw CLI::ValidationError(name, std::string(status.message()));
  }
  return value;
}

std::vector<double> ParseList(const std::string& name, const std::string& text) {
  std::vector<double> values;
  formats::FieldSplitter fields(text, ',');
  std::string_view field;
  while (fields.Next(field)) {
    values.push_back(ParseOption(name, field));
  }
  return values;
}

constexpr char kNone[] = "none";

}  // namespace

CLI::Option* AddNumber(CLI::App& command, const std::string& name, double& value, const std::string& description) {
  return command
      .add_option_function<std::string>(
          name, [name, &value](const std::string& text) { value = ParseOption(name, text); }, description)
      ->type_name("NUMBER");
}

CLI::Option* AddNumber(CLI::App& command, const std::string& name, std::optional<double>& value,
                       const std::string& description) {
  const auto parse = [name, &value](const std::string& text) {
    value = text == kNone ? std::nullopt : std::optional(ParseOption(name, text));
  };
  return command.add_option_function<std::string>(name, parse, description)->type_name("NUMBER");
}

CLI::Validator AboveZero() {
  return CLI::Validator(
      [](std::string& text) {
        double value = 0;
        const bool is_number = formats::ParseFinite(formats::TrimBlanks(text), value).ok();
        return is_number && value > 0 ? "" : absl::StrCat("expected a number above 0, got ", formats::Quote(text));
      },
      "");
}

uint64_t ParseCount(const std::string& name, std::string_view text, uint64_t least, uint64_t most) {
  uint64_t value = 0;
  if (!formats::ParseUnsigned(text, most, value) || value < least) {
    const bool has_limit = most != std::numeric_limits<uint64_t>::max();
    throw CLI::ValidationError(
        name, absl::StrCat("expected a whole number of at least ", least,
                           has_limit ? absl::StrCat(" and at most ", most) : "", ", got ", formats::Quote(text)));
  }
  return value;
}

void AddMeshInput(CLI::App& command, std::string& path) {
  command
      .add_option("MESH", path,
                  "File of the mesh (.vtu, .vtk, .vtp, .npz, .msh, .mesh, .14, .2dm, or .node with .ele), or - for "
                  "standard input (vtu)")
      ->required()
      ->type_name("FILE");
}

CLI::Option* AddCount(CLI::App& command, const std::string& name, const std::function<void(uint64_t)>& take,
                      const std::string& description, uint64_t least, uint64_t most) {
  return command
      .add_option_function<std::string>(
          name, [=](const std::string& text) { take(ParseCount(name, text, least, most)); }, description)
      ->type_name("COUNT");
}

CLI::Option* AddNumbers(CLI::App& command, const std::string& name, std::vector<double>& values,
                        const std::string& description) {
  const auto parse = [name, &values](const std::string& text) { values = ParseList(name, text); };
  return command.add_option_function<std::string>(name, parse, description)->type_name("NUMBER,...");
}

CLI::Option* AddNumberLists(CLI::App& command, const std::string& name, std::vector<std::vector<double>>& lists,
                            const std::string& description) {
  const auto parse = [name, &lists](const std::vector<std::string>& texts) {
    lists.clear();
    for (const std::string& text : texts) {
      lists.push_back(ParseList(name, text));
    }
  };
  return command.add_option_function<std::vector<std::string>>(name, parse, description)
      ->allow_extra_args(false)
      ->type_name("NUMBER,...");
}

void AddServer(CLI::App& command, ServerChoice& choice) {
  client::ConnectOptions& connect = choice.connect;
  const auto add = [&command](const std::string& name, std::string& value, const std::string& variable,
                              const std::string& type, const std::string& description) {
    return command.add_option(name, value, description)->envname(variable)->type_name(type)->group("Server");
  };
  add("--server", choice.address, "WELLSPACE_SERVER", "ADDRESS",
      "Server to use, HOST:PORT; without one, the same code runs in this process");
  command.add_flag("--tls", connect.tls, "Use TLS, and trust the authorities that this machine trusts")
      ->envname("WELLSPACE_TLS")
      ->group("Server");
  add("--tls-ca", connect.tls_ca, "WELLSPACE_TLS_CA", "FILE", "Use TLS, and trust these authorities, in PEM");
  add("--tls-cert", connect.tls_certificate, "WELLSPACE_TLS_CERT", "FILE", "Client certificate to show, in PEM");
  add("--tls-key", connect.tls_key, "WELLSPACE_TLS_KEY", "FILE", "Private key of the client certificate, in PEM");
  add("--token-file", connect.token_file, "WELLSPACE_TOKEN_FILE", "FILE",
      "File with the token to show; the environment's WELLSPACE_TOKEN can have the token itself");
  command
      .add_flag("--insecure-remote", connect.insecure_remote,
                "Allow to send the token to another machine in plain text")
      ->group("Server");
  command
      .add_flag_callback(
          "--no-follow", [&connect] { connect.follow = false; },
          "Ask no other server than this one, also where it says that another one has the session; for servers behind "
          "a proxy")
      ->envname("WELLSPACE_NO_FOLLOW")
      ->group("Server");
  if (const char* token = std::getenv("WELLSPACE_TOKEN"); token != nullptr) {
    connect.token = token;
  }
}

}  // namespace wellspace::cli
