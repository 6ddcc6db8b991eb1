// wellspace: meshes of point clouds and of domains in the plane and in space from the command line.
//
//     wellspace wellspaced ARGUMENTS
// is the server, `wellspaced ARGUMENTS`: in a wheel the two programs are one file, which is as large as the tool alone.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <new>
#include <string>
#include <string_view>

#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/standard_output.h"
#include "client/cli/usage.h"
#include "server/wellspaced.h"

// Libraries open descriptors when they are loaded: this runs before them.
[[gnu::section(".preinit_array"),
  gnu::used]] static void (*const hold_standard_descriptors)() = wellspace::cli::HoldStandardDescriptors;

int main(int argc, char** argv) {
  using namespace wellspace::cli;
  if (argc > 1 && std::string_view(argv[1]) == "wellspaced") {
    return wellspace::server::RunWellspaced(argc - 1, argv + 1);
  }
  std::signal(SIGPIPE, SIG_IGN);                      // a closed pipe is an error of writing, which is reported,
  std::signal(SIGXFSZ, SIG_IGN);                      // and so is the limit of a file's size
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // errors of connections are told by the commands
  CLI::App app("Quality simplicial meshes of point clouds and of domains in the plane and in space", "wellspace");
  app.set_version_flag("--version", std::string("wellspace ") + WELLSPACE_VERSION);
  app.require_subcommand(1);
  app.footer(kExitCodesHelp);
  int exit_code = kExitOk;
  AddCommands(app, exit_code);
  try {
    return RunCommandLine(app, {argv + 1, argv + argc}, exit_code);
  } catch (const std::bad_alloc&) {
    std::cerr << "wellspace: out of memory\n";
    return kExitExhausted;
  }
}
