// wellspace: meshes of point clouds from the command line.
#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <new>

#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"

int main(int argc, char** argv) {
  using namespace wellspace::cli;
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is an error of writing, which is reported
  CLI::App app("Quality simplicial meshes from point clouds", "wellspace");
  app.set_version_flag("--version", std::string("wellspace ") + WELLSPACE_VERSION);
  app.require_subcommand(1);
  app.footer(kExitCodesHelp);
  int exit_code = kExitOk;
  AddCommands(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitBadInput;
  } catch (const std::bad_alloc&) {
    std::cerr << "wellspace: out of memory\n";
    return kExitExhausted;
  }
  return exit_code;
}
