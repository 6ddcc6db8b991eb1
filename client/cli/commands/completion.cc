// wellspace completion, manual: help for shells and for man.
#include <iostream>
#include <memory>
#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/completions.h"
#include "client/cli/exit_codes.h"
#include "client/cli/help_pages.h"

namespace wellspace::cli {

void AddCompletionCommands(CLI::App& app, int& exit_code) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* completion =
      app.add_subcommand("completion", "Print a script that makes a shell complete the tool's words");
  completion->footer(
      "Example:\n"
      "  wellspace completion bash > ~/.local/share/bash-completion/completions/wellspace\n"
      "  wellspace completion zsh > ~/.zfunc/_wellspace            # a folder of fpath\n"
      "  wellspace completion fish > ~/.config/fish/completions/wellspace.fish\n");
  completion->add_option("SHELL", *shell, "The shell")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completion->callback([&app, shell, &exit_code] {
    std::cout << (*shell == "bash" ? BashCompletion(app) : *shell == "zsh" ? ZshCompletion(app) : FishCompletion(app));
    exit_code = kExitOk;
  });

  CLI::App* manual = app.add_subcommand("manual", "Print the manual page wellspace(1)");
  manual->footer(
      "Example:\n"
      "  wellspace manual | man -l -\n");
  const auto format = std::make_shared<std::string>("man");
  manual->add_option("--format", *format, "For man, or as Markdown; default: man")
      ->check(CLI::IsMember({"man", "markdown"}));
  manual->callback([&app, format, &exit_code] {
    std::cout << (*format == "man" ? ManualPage(app, WELLSPACE_VERSION) : MarkdownManual(app));
    exit_code = kExitOk;
  });
}

}  // namespace wellspace::cli
