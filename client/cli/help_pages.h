// Pages about the tool beside --help, made of the same descriptions; completions.h has the shells.
#ifndef WELLSPACE_CLIENT_CLI_HELP_PAGES_H_
#define WELLSPACE_CLIENT_CLI_HELP_PAGES_H_

#include <CLI/CLI.hpp>
#include <string>

namespace wellspace::cli {

// The manual page wellspace(1), in the macros of man(7). `version` is that of the tool.
std::string ManualPage(const CLI::App& app, const std::string& version);

// The same in Markdown, without a version: docs/cli.md, which a test holds to it.
std::string MarkdownManual(const CLI::App& app);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_HELP_PAGES_H_
