#include "client/cli/command_tree.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace wellspace::cli {
namespace {

void AddTree(const CLI::App& app, const std::string& name, std::vector<Command>& commands) {
  commands.push_back({name, &app});
  const Command command = commands.back();
  for (const CLI::App* subcommand : command.Subcommands()) {
    AddTree(*subcommand, absl::StrCat(name, name.empty() ? "" : " ", subcommand->get_name()), commands);
  }
}

}  // namespace

std::vector<const CLI::App*> Command::Subcommands() const {
  return app->get_subcommands([](const CLI::App*) { return true; });
}

std::vector<const CLI::Option*> Command::Options() const {
  return app->get_options([](const CLI::Option*) { return true; });
}

std::vector<Command> TreeOf(const CLI::App& app) {
  std::vector<Command> commands;
  AddTree(app, "", commands);
  return commands;
}

bool IsPositional(const CLI::Option& option) { return option.get_positional(); }

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

bool IsFile(const CLI::Option& option) { return option.get_type_name().compare(0, 4, "FILE") == 0; }

std::vector<std::string> NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) {
    names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    names.push_back("--" + name);
  }
  return names;
}

// CLI11 keeps them in the name of the type, "TEXT:{text,json}".
std::vector<std::string> ChoicesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t open = type.find('{');
  const size_t close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) {
    return {};
  }
  return absl::StrSplit(type.substr(open + 1, close - open - 1), ',');
}

std::string ValueOf(const CLI::Option& option) {
  const std::vector<std::string> choices = ChoicesOf(option);
  return choices.empty() ? option.get_type_name().substr(0, option.get_type_name().find(':'))
                         : absl::StrJoin(choices, "|");
}

}  // namespace wellspace::cli
