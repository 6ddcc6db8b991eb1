#include "client/cli/remote_command.h"

#include <charconv>
#include <iostream>
#include <memory>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client/cli/options.h"
#include "client/error_details.h"

namespace wellspace::cli {

void AddOutput(CLI::App& command, OutputFormat& format) {
  command
      .add_option_function<std::string>(
          "--output",
          [&format](const std::string& name) { format = name == "json" ? OutputFormat::kJson : OutputFormat::kText; },
          "How results and errors are printed; default: text")
      ->check(CLI::IsMember({"text", "json"}));
}

void PrintJson(const client::Json& json, bool indented) {
  std::cout << client::JsonText(json, indented) << "\n" << std::flush;
}

// The server knows points by their index; the author of the file knows them by their line.
absl::Status WithOrigins(const absl::Status& status, uint64_t first_index, uint64_t count,
                         const std::function<std::string(uint64_t)>& origin) {
  constexpr std::string_view kPoint = "points[";
  std::string message(status.message());
  std::string first_origin;
  for (size_t at = message.find(kPoint); at != std::string::npos; at = message.find(kPoint, at)) {
    at += kPoint.size();
    uint64_t point = 0;
    const char* end = message.data() + message.size();
    const std::from_chars_result result = std::from_chars(message.data() + at, end, point);
    if (result.ec != std::errc() || result.ptr == end || *result.ptr != ']' || point < first_index ||
        point - first_index >= count) {
      continue;
    }
    if (first_origin.empty()) {
      first_origin = origin(point - first_index);
    } else {
      message.insert(result.ptr + 1 - message.data(), absl::StrCat(" (", origin(point - first_index), ")"));
    }
  }
  return client::WithMessage(status, first_origin.empty() ? message : absl::StrCat(first_origin, ": ", message));
}

absl::Status WithPlaces(const absl::Status& status, std::string_view what, uint64_t first_index, uint64_t count,
                        const std::function<std::string(uint64_t)>& origin) {
  std::string message(status.message());
  for (size_t at = message.find(what); at != std::string::npos; at = message.find(what, at)) {
    at += what.size();
    uint64_t index = 0;
    const char* const end = message.data() + message.size();
    const std::from_chars_result result = std::from_chars(message.data() + at, end, index);
    if (result.ec == std::errc() && result.ptr != end && *result.ptr == ']' && index >= first_index &&
        index - first_index < count) {
      message.insert(result.ptr + 1 - message.data(), absl::StrCat(" (", origin(index - first_index), ")"));
    }
  }
  return client::WithMessage(status, message);
}

absl::Status WithOrigins(const absl::Status& status, const formats::PointCloud& cloud) {
  return WithOrigins(status, 0, cloud.size(), [&cloud](uint64_t point) { return cloud.Origin(point); });
}

void RemoteCommand::AddTo(CLI::App& command, Needs needs) {
  const CLI::App* parent = command.get_parent();
  const bool is_nested = parent != nullptr && parent->get_parent() != nullptr;
  name_ = absl::StrCat(is_nested ? absl::StrCat(parent->get_name(), " ") : "", command.get_name());
  needs_ = needs;
  AddServer(command, server_);
  AddNumber(command, "--timeout", timeout_seconds_, "Give up after so many seconds; default: never")
      ->check(AboveZero());
  AddOutput(command, format_);
  command.add_flag("-q,--quiet", quiet_, "Print errors and results only");
}

absl::Duration RemoteCommand::timeout() const {
  return timeout_seconds_ > 0 ? absl::Seconds(timeout_seconds_) : absl::InfiniteDuration();
}

void RemoteCommand::AddFilesTo(formats::FilePlan& files) const {
  files.Reads("--tls-ca", server_.connect.tls_ca);
  files.Reads("--tls-cert", server_.connect.tls_certificate);
  files.Reads("--tls-key", server_.connect.tls_key);
  files.Reads("--token-file", server_.connect.token_file);
}

absl::Status RemoteCommand::Explain(const absl::Status& status) const {
  if (status.code() == absl::StatusCode::kDeadlineExceeded && timeout_seconds_ > 0) {
    return absl::DeadlineExceededError(absl::StrCat("--timeout: ", timeout_seconds_, " seconds passed"));
  }
  return status;
}

int RemoteCommand::Run(const Work& work) const {
  if (needs_ == Needs::kLastingServer && server_.address.empty()) {
    return ReportError(
        absl::InvalidArgumentError(absl::StrCat(
            name_,
            ": needs a server: give --server HOST:PORT, or set WELLSPACE_SERVER. Without one a server runs inside this "
            "process and ends with it, and its sessions would end, too")),
        format_);
  }
  Interrupt interrupt;
  absl::StatusOr<std::unique_ptr<ServerLink>> link = ServerLink::Open(server_);
  if (!link.ok()) {
    // Nothing was called yet: it is the options that are wrong.
    return ReportError(
        absl::IsFailedPrecondition(link.status()) ? absl::InvalidArgumentError(link.status().message()) : link.status(),
        format_);
  }
  client::CallOptions call;
  call.timeout = timeout();
  call.stop = interrupt.token();
  const absl::Status status = work((*link)->client(), call, interrupt);
  if (status.ok()) {
    return kExitOk;
  }
  const int exit_code = ReportError((*link)->Explain(Explain(status)), format_);
  return interrupt.signal() != 0 ? kExitSignal + interrupt.signal() : exit_code;
}

}  // namespace wellspace::cli
