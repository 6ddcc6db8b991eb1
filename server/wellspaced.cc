// wellspaced: serves wellspace.v1 until SIGTERM or SIGINT.
//
//     wellspaced hash-token TENANT < TOKEN >> TOKENS
// makes a line for --token-file;
//     wellspaced check-data DIR
//     wellspaced back-up DIR TO
// check and copy the folder of a server, also while it serves;
//     wellspaced --store postgresql://… move-data [--back] DIR
// moves its records into a database that several servers share, or back.
//     wellspaced --check-config
// prints the options in force, and where they come from, and does not serve.
//
// Exit codes: 0 stopped by a signal, 1 cannot serve, or the folder is not whole, 2 wrong options or no token; of
// --check-config 0 it could serve, 1 it could not.
#include <malloc.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "server/base/descriptor_limit.h"
#include "server/base/options.h"
#include "server/base/resources.h"
#include "server/base/service_manager.h"
#include "server/base/version.h"
#include "server/limit_flags.h"
#include "server/log/grpc_log.h"
#include "server/log/log.h"
#include "server/log/log_fields.h"
#include "server/log/log_writer.h"
#include "server/option_sources.h"
#include "server/security/tokens.h"
#include "server/server.h"
#include "server/store/back_up.h"
#include "server/store/check_data.h"
#include "server/store/durable_log.h"
#include "server/store/move_data.h"
#include "server/store/postgres_options.h"
#include "server/store/shared_log.h"

namespace wellspace::server {
namespace {

constexpr int kExitWrongOptions = 2;
// Blocks from this size on, larger than messages, go back to the system when they are freed: --max-memory counts what
// is resident.
constexpr int kReturnedBytes = 2 * kMaxResponseBytes;
constexpr absl::Duration kMaxGrace = absl::Hours(24);
constexpr absl::Duration kLeastLease = absl::Seconds(1);
constexpr absl::Duration kMostLease = absl::Minutes(10);

struct Flags {
  ServerOptions server;
  std::string log_level = "info";
  std::string log_format = "text";
  std::string data;           // the folder of the session log; empty: sessions end with the process
  PostgresOptions store;      // of its records, in the place of a database in the folder; no address: none
  bool is_ephemeral = false;  // sessions end with the process, whatever stands above
  bool checks_configuration = false;
  std::string hash_for_tenant;  // makes a line of tokens and does not serve
  bool hashes_for_admin = false;
  std::string checked_folder;  // checks it and does not serve
  std::string copied_folder;   // copies it to the next and does not serve
  std::string copy;
  std::string moved_folder;  // moves its records to the store, or back, and does not serve
  bool moves_back = false;
};

void DeclareSecurity(CLI::App& app, SecurityOptions& security) {
  app.add_option("--tls-cert", security.tls.certificate, "Certificates of this server in PEM, its own first")
      ->type_name("FILE");
  app.add_option("--tls-key", security.tls.key, "Private key of this server in PEM")->type_name("FILE");
  app.add_option("--tls-client-ca", security.tls.client_ca,
                 "Authorities, in PEM, whose client certificates are demanded; the common name is the tenant")
      ->type_name("FILE");
  app.add_flag("--tls-require-client-cert", security.tls.require_client_certificate,
               "Break off connections without a client certificate in the handshake already");
  app.add_option("--token-file", security.token_file,
                 "Lines TENANT sha256:HEX, one for each token, and `admin` behind those of operators; `wellspaced "
                 "hash-token` makes them")
      ->type_name("FILE");
  app.add_flag("--insecure-remote", security.insecure_remote,
               "Allow to listen in plain text, or without authentication, where other machines can connect");
}

void DeclareStore(CLI::App& app, Flags& flags) {
  app.add_option("--data", flags.data,
                 "Folder in which sessions are kept, so that they outlive this process; default: none, and they end "
                 "with it")
      ->type_name("DIR");
  app.add_option("--store", flags.store.address,
                 "PostgreSQL database that servers share: it has the records of sessions, and the folder of --data, "
                 "which they share, too, points and meshes; default: the records are in that folder, of one server")
      ->type_name("postgresql://…")
      ->check([](const std::string& address) -> std::string {
        const absl::Status status = ShownPostgresAddress(address).status();
        return status.ok() ? "" : std::string(status.message());
      });
  app.add_option("--replica", flags.store.owner,
                 "Name of this server among those that share a --store; default: that of the machine")
      ->type_name("NAME");
  app.add_option("--advertise", flags.server.advertise,
                 "Address by which clients reach this server, told to those that ask another one of the --store for "
                 "its sessions; default: that of --listen, by the name of the machine where it listens everywhere")
      ->type_name("HOST:PORT");
  AddSeconds(app, "--lease", flags.store.lease, kLeastLease, kMostLease,
             "Time after which others take over the sessions of a server that is not heard of at the --store");
  app.add_flag("--ephemeral", flags.is_ephemeral, "Keep no session, also where the file of options has a folder");
}

void Declare(CLI::App& app, Flags& flags) {
  app.set_version_flag("--version", std::string("wellspaced ") + kVersion);
  app.add_option("--listen", flags.server.listen, "Address to listen on; port 0 takes a free one")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  DeclareSecurity(app, flags.server.security);
  DeclareLimits(app, flags.server.service);
  DeclareConnections(app, flags.server.connections);
  DeclareStore(app, flags);
  AddSeconds(app, "--grace", flags.server.service.grace, absl::ZeroDuration(), kMaxGrace,
             "Time that running work gets to end after SIGTERM or SIGINT");
  app.add_option("--log-level", flags.log_level, "What to log on standard error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app.add_option("--log-format", flags.log_format, "How to log: a line of text or a JSON object each")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_option("--metrics-listen", flags.server.observability.metrics_listen,
                 "Address of an HTTP listener with /metrics for Prometheus, and the probes /livez and /readyz; "
                 "default: none")
      ->type_name("HOST:PORT");
  app.add_option("--admin-listen", flags.server.observability.admin_listen,
                 "Address, on the loopback, of a gRPC listener with channelz; default: none")
      ->type_name("HOST:PORT");
  DeclareConfigFile(app);
  app.add_flag(
         "--check-config", flags.checks_configuration,
         "Print the options in force and where each comes from, check them and the files that they name, and exit")
      ->configurable(false);
  DeclareVariables(app);
  CLI::App& hash = *app.add_subcommand("hash-token",
                                       "Print the line of --token-file for the token that is read from standard input");
  hash.add_option("tenant", flags.hash_for_tenant, "Tenant whose calls show the token")->required();
  hash.add_flag("--admin", flags.hashes_for_admin, "Calls with the token may administer the server: `wellspace admin`");
  app.add_subcommand("check-data", "Check every byte of a folder of --data, also while a server serves it")
      ->add_option("folder", flags.checked_folder, "The folder")
      ->type_name("DIR")
      ->required();
  CLI::App& back_up =
      *app.add_subcommand("back-up", "Copy a folder of --data, also while a server serves it, and check the copy");
  back_up.add_option("folder", flags.copied_folder, "The folder")->type_name("DIR")->required();
  back_up.add_option("to", flags.copy, "New or empty folder, with which a server can be started")
      ->type_name("DIR")
      ->required();
  CLI::App& move = *app.add_subcommand(
      "move-data", "Move the records of a folder of --data into the database of --store, or back; no server may run");
  move.fallthrough();
  move.add_option("folder", flags.moved_folder, "The folder, whose points and meshes stay where they are")
      ->type_name("DIR")
      ->required();
  move.add_flag("--back", flags.moves_back, "Move them from the database of --store into one in the folder");
}

// Whether sessions are shared with other servers.
bool IsShared(const Flags& flags) { return !flags.store.address.empty() && !flags.is_ephemeral; }

// The log's line about a server that has just started: its addresses and its limits, given or not.
LogFields StartOf(const Flags& flags, const Server& server) {
  const ServiceOptions& service = flags.server.service;
  const ConnectionOptions& connections = flags.server.connections;
  const SecurityOptions& security = flags.server.security;
  const auto count = [](auto number) { return static_cast<uint64_t>(number); };
  LogFields fields;
  fields.Add("event", "started").Add("version", kVersion).Add("listen", server.address());
  fields.Add("tls", security.tls.enabled() ? "yes" : "no");
  fields.Add("client_certificates", security.tls.client_ca.empty() ? "no" : "yes");
  fields.Add("tokens", security.token_file.empty() ? "no" : "yes");
  fields.Add("workers", count(service.workers)).Add("small_workers", count(service.small_workers));
  fields.Add("max_threads", count(service.max_threads));
  fields.Add("max_queued", count(service.max_queued_jobs)).Add("keep_queued", count(service.keep_queued));
  fields.Add("max_jobs_per_tenant", count(service.max_jobs_per_tenant));
  fields.Add("max_memory_bytes", service.max_memory_bytes);
  fields.Add("max_points", service.max_points).Add("max_vertices", service.max_vertices);
  fields.Add("max_points_per_tenant", service.max_points_per_tenant);
  fields.Add("max_stored_bytes_per_tenant", service.max_stored_bytes_per_tenant);
  fields.Add("max_sessions", service.max_sessions).Add("max_sessions_per_tenant", service.max_sessions_per_tenant);
  fields.Add("default_ttl_seconds", absl::ToDoubleSeconds(service.default_ttl));
  fields.Add("max_ttl_seconds", absl::ToDoubleSeconds(service.max_ttl));
  fields.Add("stall_limit_seconds", absl::ToDoubleSeconds(service.stall_limit));
  fields.Add("upload_stall_limit_seconds", absl::ToDoubleSeconds(service.upload_stall_limit));
  fields.Add("handshake_timeout_seconds", absl::ToDoubleSeconds(connections.handshake_timeout));
  fields.Add("max_connection_idle_seconds", absl::ToDoubleSeconds(connections.max_idle));
  fields.Add("max_streams", count(connections.calls.max_streams));
  fields.Add("max_calls", count(connections.calls.max_calls));
  fields.Add("data", flags.is_ephemeral ? "" : flags.data);
  if (IsShared(flags)) {
    fields.Add("store", ShownPostgresAddress(flags.store.address).value_or(""));
    fields.Add("replica", flags.store.owner).Add("lease_seconds", absl::ToDoubleSeconds(flags.store.lease));
  }
  return fields.Add("grace_seconds", absl::ToDoubleSeconds(flags.server.service.grace));
}

// The exit code after text was printed to standard output: not 0 if it got lost.
int ExitOfPrinted(const std::string& what) {
  std::cout << std::flush;
  if (!std::cout) {
    std::cerr << "wellspaced: " << what << " could not be written to standard output" << std::endl;
    return 1;
  }
  return 0;
}

int HashToken(const Flags& flags) {
  std::string token;
  std::getline(std::cin, token);
  const absl::StatusOr<std::string> line = MakeTokenLine(flags.hash_for_tenant, token, flags.hashes_for_admin);
  if (!line.ok()) {
    std::cerr << "wellspaced: " << line.status().message() << std::endl;
    return kExitWrongOptions;
  }
  std::cout << *line << "\n";
  return ExitOfPrinted("the line");
}

// Prints the findings about a folder. The exit code is not 0 unless it is whole.
int Report(const std::string& folder, const absl::StatusOr<DataReport>& report) {
  if (!report.ok()) {
    std::cerr << "wellspaced: " << folder << ": " << report.status().message() << std::endl;
    return 1;
  }
  for (const std::string& problem : report->problems) {
    std::cerr << "wellspaced: " << problem << std::endl;
  }
  for (const std::string& unknown : report->unknown) {
    std::cerr << "wellspaced: " << unknown << ": not of a server, and left as it is" << std::endl;
  }
  std::cout << folder << ": " << (report->is_whole() ? "whole" : "damaged") << "; " << report->sessions << " sessions, "
            << report->operations << " operations, " << report->points << " points, " << report->meshes << " meshes, "
            << report->file_bytes << " bytes of files\n";
  const int exit = ExitOfPrinted("the report");
  return report->is_whole() ? exit : 1;
}

// Moves the records of a folder, and says where they are.
int MoveData(const Flags& flags) {
  const std::string& folder = flags.moved_folder;
  if (flags.store.address.empty()) {
    std::cerr << "wellspaced: move-data wants --store, too: the database to move to, or from with --back" << std::endl;
    return kExitWrongOptions;
  }
  const absl::Status moved = flags.moves_back ? MoveToFolder(flags.store, folder) : MoveToPostgres(folder, flags.store);
  const std::string shown = ShownPostgresAddress(flags.store.address).value_or("");
  if (!moved.ok()) {
    std::cerr << "wellspaced: " << folder << ", " << shown << ": " << moved.message() << std::endl;
    return 1;
  }
  if (flags.moves_back) {
    return Report(folder, CheckData(folder));
  }
  std::cout << folder << ": moved; its records are in " << shown << "\n";
  return ExitOfPrinted("the report");
}

// Whether what belongs to --store is there, too.
absl::Status CheckStore(const Flags& flags) {
  if (!flags.moved_folder.empty()) {
    return absl::OkStatus();
  }
  return IsShared(flags) && flags.data.empty()
             ? absl::InvalidArgumentError(
                   "--store wants --data, too: the folder of points and meshes, which all servers of the store share")
             : absl::OkStatus();
}

// Prints the options in force. The exit code is 0 if a server could start with them, as far as that can be told
// without listening or opening the folder of sessions.
int CheckConfiguration(const CLI::App& app, const Flags& flags, int argc, const char* const* argv) {
  std::cout << DescribeOptions(app, argc, argv);
  const int exit = ExitOfPrinted("the options");
  const absl::Status status =
      Server::Check(flags.server, MakeLogger("off", LogFormat::kText, std::make_shared<LogWriter>(STDERR_FILENO)));
  if (!status.ok()) {
    std::cerr << "wellspaced: " << status.message() << std::endl;
    return 1;
  }
  return exit;
}

// The session log that the flags ask for; null: none. The process ends when it fails: the contents of the disk are
// unknown then, and the next start finds them out.
absl::StatusOr<std::unique_ptr<SessionLog>> OpenSessionLog(const Flags& flags,
                                                           const std::shared_ptr<spdlog::logger>& log) {
  if (flags.data.empty() || flags.is_ephemeral) {
    return nullptr;
  }
  const auto on_failure = [log](const absl::Status& cause) {
    log->critical(LogFields().Add("event", "store_failed").Add("error", std::string(cause.message())).text());
    log->flush();
    _exit(1);
  };
  if (IsShared(flags)) {
    return OpenSharedLog({.folder = flags.data,
                          .database = flags.store,
                          .on_failure = on_failure,
                          .max_written_files = MaxWrittenFiles(DescriptorLimit())});
  }
  return OpenDurableLog({.folder = flags.data,
                         .on_failure = on_failure,
                         .ballast_bytes = BallastBytesFor(flags.data),
                         .max_written_files = MaxWrittenFiles(DescriptorLimit())});
}

// SIGTERM and SIGINT, blocked in this thread and all that it starts later, to be waited for.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&set_);
    sigaddset(&set_, SIGTERM);
    sigaddset(&set_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }

  int Wait() {
    int received = 0;
    sigwait(&set_, &received);
    return received;
  }

  // From now on the signals end the process, as they do by default.
  void Release() { pthread_sigmask(SIG_UNBLOCK, &set_, nullptr); }

 private:
  sigset_t set_;
};

// Bounds the freed memory that is kept from the system.
void BoundHeaps(const Resources& resources) {
  mallopt(M_MMAP_THRESHOLD, kReturnedBytes);
  // Each heap keeps its freed memory. The default is eight for each processor, where no more than one can be used.
  mallopt(M_ARENA_MAX, std::max(2, resources.processors));
}

// Tells the program that started the process that it serves, and where.
void TellOfStart(const Server& server) {
  std::cout << "listening on " << server.address() << std::endl;
  const Observability& observability = server.observability();
  if (!observability.metrics_address().empty()) {
    std::cout << "metrics on " << observability.metrics_address() << std::endl;
  }
  if (!observability.admin_address().empty()) {
    std::cout << "admin on " << observability.admin_address() << std::endl;
  }
  TellServiceManager("READY=1");
}

// Parses the command line, the environment and the file of options. An exit code: the process is to end with it.
std::optional<int> Parse(CLI::App& app, int argc, char** argv) {
  // The flag is looked for here, since nothing is parsed yet when this fails.
  const bool checks = std::any_of(argv + 1, argv + argc,
                                  [](const char* argument) { return std::string_view(argument) == "--check-config"; });
  const int wrong = checks ? 1 : kExitWrongOptions;
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) {
      return ExitOfPrinted("the text");
    }
    if (const std::string variable = VariableBehind(app, error.what(), argc, argv); !variable.empty()) {
      std::cerr << "The value comes from " << variable << " in the environment." << std::endl;
    }
    return wrong;
  }
  if (const absl::Status status = CheckVariables(app, environ); !status.ok()) {
    std::cerr << "wellspaced: " << status.message() << std::endl;
    return wrong;
  }
  return std::nullopt;
}

// Runs what does not serve, if it is asked for. An exit code: the process is to end with it.
std::optional<int> RunCommand(const Flags& flags) {
  if (!flags.hash_for_tenant.empty()) {
    return HashToken(flags);
  }
  if (!flags.checked_folder.empty()) {
    return Report(flags.checked_folder, CheckData(flags.checked_folder));
  }
  if (!flags.copied_folder.empty()) {
    return Report(flags.copy, BackUp(flags.copied_folder, flags.copy));
  }
  if (!flags.moved_folder.empty()) {
    return MoveData(flags);
  }
  return std::nullopt;
}

}  // namespace

int RunWellspaced(int argc, char** argv) {
  signal(SIGXFSZ, SIG_IGN);  // a file that must not grow further is a full disk
  Flags flags;
  flags.server.listen = "127.0.0.1:7233";
  const Resources resources = ReadResources();
  flags.server.service.workers = resources.processors;
  flags.server.service.small_workers = 1;
  flags.server.service.max_threads = resources.processors;
  flags.server.service.max_memory_bytes = DefaultMaxMemory(resources);
  CLI::App app("Makes quality meshes of point clouds and planar domains, as a gRPC service.", "wellspaced");
  Declare(app, flags);
  if (const std::optional<int> exit = Parse(app, argc, argv); exit.has_value()) {
    return *exit;
  }
  if (flags.store.owner.empty()) {
    flags.store.owner = NameOfMachine();
  }
  if (const absl::Status status = CheckStore(flags); !status.ok()) {
    std::cerr << "wellspaced: " << status.message() << std::endl;
    return flags.checks_configuration ? 1 : kExitWrongOptions;
  }
  if (flags.checks_configuration) {
    return CheckConfiguration(app, flags, argc, argv);
  }
  if (const std::optional<int> exit = RunCommand(flags); exit.has_value()) {
    return *exit;
  }

  BoundHeaps(resources);
  StopSignals signals;
  signal(SIGPIPE, SIG_IGN);  // standard output or error may be a pipe whose reader has gone
  RaiseDescriptorLimit();
  const std::shared_ptr<spdlog::logger> log =
      MakeLogger(flags.log_level, flags.log_format == "json" ? LogFormat::kJson : LogFormat::kText,
                 std::make_shared<LogWriter>(STDERR_FILENO));
  const GrpcLog grpc_log(log);
  absl::StatusOr<std::unique_ptr<SessionLog>> session_log = OpenSessionLog(flags, log);
  if (!session_log.ok()) {
    const std::string store =
        IsShared(flags) ? absl::StrCat(" --store ", ShownPostgresAddress(flags.store.address).value_or("")) : "";
    std::cerr << "wellspaced: --data " << flags.data << store << ": " << session_log.status().message() << std::endl;
    return 1;
  }
  flags.server.service.begin_drain = [] { kill(getpid(), SIGTERM); };  // which this thread waits for
  absl::StatusOr<std::unique_ptr<Server>> server = Server::Start(flags.server, log, *std::move(session_log));
  if (!server.ok()) {
    std::cerr << "wellspaced: " << server.status().message() << std::endl;
    return 1;
  }
  log->info("{}", StartOf(flags, **server).text());
  TellOfStart(**server);

  const int received = signals.Wait();
  TellServiceManager("STOPPING=1");
  log->info("event=stopping signal={} grace={}", received, absl::FormatDuration(flags.server.service.grace));
  signals.Release();
  (*server)->Shutdown(flags.server.service.grace);
  *server = nullptr;  // work that has not ended is the next process's from here on
  log->info("event=stopped");
  return 0;
}

}  // namespace wellspace::server
