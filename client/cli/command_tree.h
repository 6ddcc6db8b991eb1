// The commands and options of the tool, as completion and manual go through them.
#ifndef WELLSPACE_CLIENT_CLI_COMMAND_TREE_H_
#define WELLSPACE_CLIENT_CLI_COMMAND_TREE_H_

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace wellspace::cli {

struct Command {
  std::string name;  // without that of the tool: "session create"; empty: the tool itself
  const CLI::App* app;

  std::vector<const CLI::App*> Subcommands() const;
  std::vector<const CLI::Option*> Options() const;  // positional ones, too
};

// All commands, each before its subcommands.
std::vector<Command> TreeOf(const CLI::App& app);

bool IsPositional(const CLI::Option& option);
bool TakesValue(const CLI::Option& option);
bool IsFile(const CLI::Option& option);

// The names of an option with their dashes.
std::vector<std::string> NamesOf(const CLI::Option& option);

// The values of an option that has a few only; else none.
std::vector<std::string> ChoicesOf(const CLI::Option& option);

// The word for the value of an option: its type, or its choices as a|b.
std::string ValueOf(const CLI::Option& option);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_COMMAND_TREE_H_
