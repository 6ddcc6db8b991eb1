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

}  // namespace

CLI::Option* AddNumber(CLI::App& command, const std::string& name, double& value, const std::string& description) {
  return command
      .add_option_function<std::string>(
          name, [name, &value](const std::string& text) { value = ParseOption(name, text); }, description)
      ->type_name("NUMBER");
}

CLI::Option* AddNumbers(CLI::App& command, const std::string& name, std::vector<double>& values,
                        const std::string& description) {
  const auto parse = [name, &values](const std::string& text) {
    values.clear();
    formats::FieldSplitter fields(text, ',');
    std::string_view field;
    while (fields.Next(field)) {
      values.push_back(ParseOption(name, field));
    }
  };
  return command.add_option_function<std::string>(name, parse, description)->type_name("NUMBER,...");
}

CLI::Option* AddServer(CLI::App& command, std::string& address) {
  return command
      .add_option("--server", address, "Server to use, HOST:PORT; without one, the same code runs in this process")
      ->envname("WELLSPACE_SERVER")
      ->type_name("ADDRESS");
}

}  // namespace wellspace::cli
