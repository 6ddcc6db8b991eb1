// The common part of commands that talk to a server: which server, how long, and how results are printed.
#ifndef WELLSPACE_CLIENT_CLI_REMOTE_COMMAND_H_
#define WELLSPACE_CLIENT_CLI_REMOTE_COMMAND_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/server_link.h"
#include "client/client.h"
#include "client/formats/cloud.h"
#include "client/formats/file_plan.h"
#include "client/json/json.h"

namespace wellspace::cli {

// --output text or json.
void AddOutput(CLI::App& command, OutputFormat& format);

// Prints `json` on standard output, in one line or indented.
void PrintJson(const client::Json& json, bool indented = true);

// `status`, with the file and the line of each point that the server names by its index; those of the file are `count`
// from `first_index` on, and `origin` tells where each was read.
absl::Status WithOrigins(const absl::Status& status, uint64_t first_index, uint64_t count,
                         const std::function<std::string(uint64_t)>& origin);
absl::Status WithOrigins(const absl::Status& status, const formats::PointCloud& cloud);
// The same for what the server names as `what`, "segments[" for example; the place comes behind each.
absl::Status WithPlaces(const absl::Status& status, std::string_view what, uint64_t first_index, uint64_t count,
                        const std::function<std::string(uint64_t)>& origin);

// Thread safety: thread-compatible.
class RemoteCommand {
 public:
  // Whether the server in the tool's own process will do.
  enum class Needs { kAnyServer, kLastingServer };

  // Adds --server and its kin, --timeout, --output and --quiet. REQUIRES: this outlives `command`.
  void AddTo(CLI::App& command, Needs needs);

  const std::string& address() const { return server_.address; }
  bool quiet() const { return quiet_; }
  bool json() const { return format_ == OutputFormat::kJson; }
  OutputFormat format() const { return format_; }
  absl::Duration timeout() const;

  // Adds the files of credentials.
  void AddFilesTo(formats::FilePlan& files) const;

  using Work = std::function<absl::Status(client::Client&, const client::CallOptions&, const Interrupt&)>;
  // Opens the server and does `work`, whose call options have the deadline and stop at Ctrl-C. Returns the exit code,
  // errors reported.
  int Run(const Work& work) const;

 private:
  absl::Status Explain(const absl::Status& status) const;

  std::string name_;  // of the command
  Needs needs_ = Needs::kAnyServer;
  ServerChoice server_;
  double timeout_seconds_ = 0;  // 0: none
  OutputFormat format_ = OutputFormat::kText;
  bool quiet_ = false;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_REMOTE_COMMAND_H_
