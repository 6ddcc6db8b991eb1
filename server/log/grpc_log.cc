#include "server/log/grpc_log.h"

#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "grpc/support/log.h"
#include "server/log/log_fields.h"

namespace wellspace::server {
namespace {

// With this gRPC 1.51 reports, for debugging, every handshake of TLS that failed; and with the other, as an error, some
// of them once more.
constexpr std::string_view kHandshakeFailed = "Security handshake failed: ";
constexpr std::string_view kHandshakeFailedToo = "Handshake failed with fatal error ";

constexpr std::string_view kBeforeAbort = "assertion failed";

// Lives as long as the process: gRPC's threads may log until its end.
struct Target {
  std::mutex mutex;
  std::shared_ptr<spdlog::logger> log;  // guarded by mutex; null: none
};

Target& TheTarget() {
  static auto* const target = new Target;
  return *target;
}

// The least severity that GRPC_VERBOSITY asks for, above all severities for NONE.
int LeastSeverity() {
  const char* verbosity = std::getenv("GRPC_VERBOSITY");
  const std::string_view text = verbosity == nullptr ? "" : verbosity;
  const auto is = [text](const char* name) { return absl::EqualsIgnoreCase(std::string(text), name); };
  return is("DEBUG")  ? GPR_LOG_SEVERITY_DEBUG
         : is("INFO") ? GPR_LOG_SEVERITY_INFO
         : is("NONE") ? GPR_LOG_SEVERITY_ERROR + 1
                      : GPR_LOG_SEVERITY_ERROR;
}

spdlog::level::level_enum LevelOf(gpr_log_severity severity) {
  switch (severity) {
    case GPR_LOG_SEVERITY_DEBUG:
      return spdlog::level::debug;
    case GPR_LOG_SEVERITY_INFO:
      return spdlog::level::info;
    default:
      return spdlog::level::err;
  }
}

// The part of `text` between `begin` and the next `end`; empty if there is none.
std::string_view Between(std::string_view text, std::string_view begin, char end) {
  const size_t found = text.find(begin);
  if (found == std::string_view::npos) {
    return "";
  }
  text.remove_prefix(found + begin.size());
  return text.substr(0, text.find(end));
}

// `error` is "CODE:what {file:"…", target_address:"…", …}".
LogFields HandshakeFailed(std::string_view error) {
  std::string_view what = error.substr(0, error.find(" {"));
  if (const size_t colon = what.find(':'); colon != std::string_view::npos) {
    what.remove_prefix(colon + 1);
  }
  LogFields fields;
  fields.Add("event", "handshake_failed");
  if (const std::string_view peer = Between(error, "target_address:\"", '"'); !peer.empty()) {
    fields.Add("peer", peer);
  }
  return fields.Add("message", what);
}

void Log(gpr_log_func_args* line) {
  std::shared_ptr<spdlog::logger> log;
  {
    Target& target = TheTarget();
    std::lock_guard lock(target.mutex);
    log = target.log;
  }
  const std::string_view message = line->message;
  if (log == nullptr || message.starts_with(kHandshakeFailedToo)) {
    return;
  }
  if (message.starts_with(kHandshakeFailed)) {
    log->warn("{}", HandshakeFailed(message.substr(kHandshakeFailed.size())).text());
    return;
  }
  static const int least = LeastSeverity();
  if (line->severity < least) {
    return;
  }
  const std::string_view path = line->file;
  LogFields fields;
  fields.Add("event", "grpc").Add("file", path.substr(path.rfind('/') + 1)).Add("message", message);
  log->log(LevelOf(line->severity), "{}", fields.text());
  if (message.starts_with(kBeforeAbort)) {
    log->flush();  // the process ends with the next step
  }
}

}  // namespace

GrpcLog::GrpcLog(std::shared_ptr<spdlog::logger> log) {
  Target& target = TheTarget();
  std::lock_guard lock(target.mutex);
  target.log = std::move(log);
  gpr_set_log_function(Log);
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_DEBUG);
}

GrpcLog::~GrpcLog() {
  Target& target = TheTarget();
  std::lock_guard lock(target.mutex);
  target.log = nullptr;
}

}  // namespace wellspace::server
