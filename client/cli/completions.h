// Scripts that make shells complete the tool's words, made of its own descriptions.
#ifndef WELLSPACE_CLIENT_CLI_COMPLETIONS_H_
#define WELLSPACE_CLIENT_CLI_COMPLETIONS_H_

#include <CLI/CLI.hpp>
#include <string>

namespace wellspace::cli {

// Each completes commands, options, the values of options that have few, and names of files; scripts of zsh and fish
// also show the descriptions.
std::string BashCompletion(const CLI::App& app);
std::string ZshCompletion(const CLI::App& app);
std::string FishCompletion(const CLI::App& app);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_COMPLETIONS_H_
