// wellspace console: a page in a browser for everything that a server does.
#include "client/console/console.h"

#include <condition_variable>
#include <cstdint>
#include <iostream>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client/cli/browser.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/cli/remote_command.h"
#include "client/console/http_server.h"
#include "client/formats/io/output_file.h"
#include "client/formats/io/temporary_folder.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kConsoleHelp[] =
    "The page is served on the loopback of this machine, to those who know its address, which holds a secret. Without "
    "--server\n"
    "sessions end with the command. Ctrl-C ends it.\n"
    "Examples:\n"
    "  wellspace console                           # a browser opens; drop a file on the page\n"
    "  wellspace console --server mesher:7233 --tls\n";

struct ConsoleCommand {
  RemoteCommand remote;
  int port = 0;
  bool no_browser = false;

  absl::Status Serve(const client::Client& client, const client::CallOptions& call) const;
};

// A file that leads a browser to `url`: a program's arguments, unlike files, are read by all users of a machine.
absl::StatusOr<std::string> WriteRedirection(const std::string& folder, const std::string& url) {
  const std::string path = absl::StrCat(folder, "/console.html");
  WELLSPACE_ASSIGN_OR_RETURN(formats::OutputFile file, formats::OutputFile::Create(path));
  file.Write(absl::StrCat("<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">",
                          "<meta http-equiv=\"refresh\" content=\"0; url=", url, "\"><title>Wellspace</title>",
                          "<a href=\"", url, "\">Wellspace</a>\n"));
  WELLSPACE_RETURN_IF_ERROR(file.Commit());
  return path;
}

absl::Status ConsoleCommand::Serve(const client::Client& client, const client::CallOptions& call) const {
  WELLSPACE_ASSIGN_OR_RETURN(const formats::TemporaryFolder folder, formats::TemporaryFolder::Make());
  std::stop_source stop;  // of calls for the page
  console::Console pages(client, {.server = remote.address(), .folder = folder.path(), .stop = stop.get_token()});
  WELLSPACE_ASSIGN_OR_RETURN(
      const std::unique_ptr<console::HttpServer> server,
      console::HttpServer::Start({.port = port, .token = console::MakeToken(), .folder = folder.path()},
                                 [&pages](const console::HttpRequest& request) { return pages.Answer(request); }));
  bool is_open = false;
  if (!no_browser) {
    WELLSPACE_ASSIGN_OR_RETURN(const std::string redirection, WriteRedirection(folder.path(), server->url()));
    is_open = OpenInBrowser(redirection);
  }
  if (remote.json()) {
    PrintJson({{"url", server->url()}, {"opened", is_open}});
  } else {
    std::cout << server->url() << "\n"
              << (is_open || no_browser || remote.quiet() ? "" : "No browser was found: open this address in one.\n")
              << std::flush;
  }
  std::mutex mutex;
  std::condition_variable_any ended;
  std::unique_lock lock(mutex);
  const auto never = [] { return false; };
  if (call.timeout < absl::InfiniteDuration()) {
    ended.wait_for(lock, call.stop, absl::ToChronoNanoseconds(call.timeout), never);
  } else {
    ended.wait(lock, call.stop, never);
  }
  stop.request_stop();
  return absl::OkStatus();
}

}  // namespace

void AddConsoleCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<ConsoleCommand>();
  CLI::App* console = app.add_subcommand(
      "console",
      "Show sessions in a browser: drop a file to mesh it, watch and cancel the work, look at meshes, download them");
  console->footer(absl::StrCat(kConsoleHelp, "\n", kExitCodesHelp));
  console->add_option("--port", command->port, "Port of the loopback to listen on; default: a free one")
      ->check(CLI::Range(0, 65535))
      ->type_name("PORT");
  console->add_flag("--no-browser", command->no_browser, "Print the address of the page, and start no browser");
  command->remote.AddTo(*console, RemoteCommand::Needs::kAnyServer);
  console->callback([command, &exit_code] {
    exit_code = command->remote.Run([&command](client::Client& client, const client::CallOptions& call,
                                               const Interrupt&) { return command->Serve(client, call); });
  });
}

}  // namespace wellspace::cli
