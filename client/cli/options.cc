#include "client/cli/options.h"

#include "absl/status/status.h"
#include "client/formats/number.h"

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

}  // namespace

CLI::Option* AddNumber(CLI::App& command, const std::string& name, double& value, const std::string& description) {
  return command
      .add_option_function<std::string>(
          name, [name, &value](const std::string& text) { value = ParseOption(name, text); }, description)
      ->type_name("NUMBER");
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

CLI::Option* AddServer(CLI::App& command, std::string& address) {
  return command
      .add_option("--server", address, "Server to use, HOST:PORT; without one, the same code runs in this process")
      ->envname("WELLSPACE_SERVER")
      ->type_name("ADDRESS");
}

}  // namespace wellspace::cli
