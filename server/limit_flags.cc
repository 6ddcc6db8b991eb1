#include "server/limit_flags.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <sstream>
#include <string_view>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/option_sources.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kMany = std::numeric_limits<int64_t>::max();

// A file that is no text must not pass for a short one: CLI11 reads nothing behind a zero byte, and takes lines that
// end with a carriage return alone for one line, which is a comment if the first is one.
void CheckText(std::string_view text) {
  size_t line = 1;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool ends_line = byte == '\r' && i + 1 < text.size() && text[i + 1] == '\n';
    if ((byte < ' ' && byte != '\n' && byte != '\t' && !ends_line) || byte == 0x7f) {
      throw CLI::ConfigError(absl::StrFormat(
          "--config: line %d has the byte 0x%02x; expected TOML, text in UTF-8 whose lines end with a line feed", line,
          byte));
    }
    line += byte == '\n' ? 1 : 0;
  }
}

// CLI11's reader of TOML, with errors that name the key: values are checked after the file is read, where CLI11 knows
// only the option.
class TomlFile final : public CLI::ConfigBase {
 public:
  explicit TomlFile(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    std::ostringstream content;
    content << input.rdbuf();
    if (input.bad()) {
      throw CLI::ConfigError("--config: the file cannot be read");
    }
    CheckText(content.str());
    std::istringstream text(content.str());
    std::vector<CLI::ConfigItem> keys = ConfigBase::from_config(text);
    for (const CLI::ConfigItem& item : keys) {
      const CLI::Option* option = item.parents.empty() ? app_.get_option_no_throw("--" + item.name) : nullptr;
      if (option == nullptr || !option->get_configurable()) {
        throw CLI::ConfigError(
            absl::StrCat("--config: ", item.fullname(), " is no key; keys are the options without --"));
      }
    }
    // The environment comes before the file; CLI11 would take the file's value and look at no variable.
    keys.erase(
        std::remove_if(keys.begin(), keys.end(), [this](const CLI::ConfigItem& item) { return IsInVariable(item); }),
        keys.end());
    return keys;
  }

 private:
  bool IsInVariable(const CLI::ConfigItem& item) const {
    const std::string variable = app_.get_option("--" + item.name)->get_envname();
    return !variable.empty() && !ValueOf(variable).empty();
  }

  const CLI::App& app_;
};

template <typename T>
void AddCount(CLI::App& app, const std::string& name, T& value, uint64_t least, uint64_t most,
              const std::string& description) {
  app.add_option(name, value, description)
      ->check(CLI::Range(static_cast<T>(least), static_cast<T>(most)))
      ->capture_default_str();
}

// A number of bytes, perhaps with a unit; false: it is none.
bool ParseBytes(const std::string& text, uint64_t& bytes) {
  try {
    std::string plain = text;
    return CLI::AsSizeValue(/*kb_is_1000=*/false)(plain).empty() && absl::SimpleAtoi(plain, &bytes);
  } catch (const CLI::ValidationError&) {  // an unknown unit
    return false;
  }
}

// An amount of memory: 0, or at least kMinMemoryBytes.
uint64_t ParseMemory(const std::string& text) {
  uint64_t bytes = 0;
  const bool is_size = ParseBytes(text, bytes);
  if (!is_size || (bytes != 0 && bytes < kMinMemoryBytes)) {
    throw CLI::ValidationError("--max-memory", absl::StrCat(text, " is no limit of memory; 0 (none) is, or at least ",
                                                            kMinMemoryBytes >> 20, "MB, as 512MB or 12GB"));
  }
  return bytes;
}

}  // namespace

CLI::Option* AddSeconds(CLI::App& app, const std::string& name, absl::Duration& value, absl::Duration least,
                        absl::Duration most, const std::string& description) {
  const auto parse = [name, &value, least, most](const std::string& text) {
    double seconds = 0;
    // The comparison lets no NaN pass.
    if (!absl::SimpleAtod(text, &seconds) || !(absl::Seconds(seconds) >= least && absl::Seconds(seconds) <= most) ||
        seconds != seconds) {
      throw CLI::ValidationError(name, absl::StrCat(text, " is no number of seconds from ",
                                                    absl::ToDoubleSeconds(least), " to ", absl::ToDoubleSeconds(most)));
    }
    value = absl::Seconds(seconds);
  };
  return app.add_option_function<std::string>(name, parse, description)
      ->type_name("SECONDS")
      ->default_str(absl::StrCat(absl::ToDoubleSeconds(value)));
}

void DeclareLimits(CLI::App& app, ServiceOptions& service) {
  AddCount(app, "--workers", service.workers, 1, 1024, "Jobs that run at once");
  AddCount(app, "--max-threads", service.max_threads, 1, 1024, "Most threads of one job");
  AddCount(app, "--small-workers", service.small_workers, 0, 1000,
           "Workers besides, which run small jobs alone; with 0 these wait as others do");
  AddCount(app, "--max-queued", service.max_queued_jobs, 0, 100'000, "Jobs that wait for a worker; more are refused");
  AddCount(app, "--keep-queued", service.keep_queued, 0, 100'000,
           "Refinements that wait for a worker here; what waits besides is offered to idle servers that share the "
           "--store");
  AddCount(app, "--max-jobs-per-tenant", service.max_jobs_per_tenant, 1, 100'000,
           "Jobs of one tenant that run or wait; more are refused");
  app.add_option_function<std::string>(
         "--max-memory", [&service](const std::string& text) { service.max_memory_bytes = ParseMemory(text); },
         "Most resident memory of this process, as 512MB or 12GB; work that needs more is refused; 0: no limit; "
         "default: "
         "three quarters of what the machine or the control group has")
      ->type_name("SIZE")
      ->default_str(absl::StrCat(service.max_memory_bytes));
  AddCount(app, "--max-points", service.max_points, 1, kMany, "Most points of a call or a session");
  AddCount(app, "--max-vertices", service.max_vertices, 1, core::kMaxVertices, "Most vertices of a mesh");
  AddCount(app, "--max-points-per-tenant", service.max_points_per_tenant, 1, kMany,
           "Most points of all sessions of one tenant");
  const std::string stored = "--max-stored-bytes-per-tenant";
  const auto parse_stored = [&service, stored](const std::string& text) {
    if (!ParseBytes(text, service.max_stored_bytes_per_tenant)) {
      throw CLI::ValidationError(stored, absl::StrCat(text, " is no number of bytes, as 512MB or 12GB; 0: no limit"));
    }
  };
  app.add_option_function<std::string>(stored, parse_stored,
                                       "Most bytes of points, segments, triangles, sizes and meshes that the sessions "
                                       "of one tenant keep, as 512MB or 12GB; 0: "
                                       "no limit")
      ->type_name("SIZE")
      ->default_str(absl::StrCat(service.max_stored_bytes_per_tenant));
  AddCount(app, "--max-sessions", service.max_sessions, 1, kMany, "Most sessions at a time");
  AddCount(app, "--max-sessions-per-tenant", service.max_sessions_per_tenant, 1, kMany,
           "Most sessions of one tenant at a time");
  AddSeconds(app, "--default-ttl", service.default_ttl, absl::Seconds(1), absl::Hours(24 * 3650),
             "How long a session lives without use when its client does not say");
  AddSeconds(app, "--max-ttl", service.max_ttl, absl::Seconds(1), absl::Hours(24 * 3650),
             "How long it may live without use at most");
  AddSeconds(app, "--stall-limit", service.stall_limit, absl::Milliseconds(1), absl::Hours(24),
             "How long a stream waits for a client that does not read");
  AddSeconds(app, "--upload-stall-limit", service.upload_stall_limit, absl::Milliseconds(1), absl::Hours(24),
             "How long a stream waits for the next message of a client that sends");
  app.callback([&service] {
    if (service.default_ttl > service.max_ttl) {
      throw CLI::ValidationError("--default-ttl",
                                 absl::StrCat(absl::ToDoubleSeconds(service.default_ttl), " is more than --max-ttl, ",
                                              absl::ToDoubleSeconds(service.max_ttl)));
    }
  });
}

void DeclareConnections(CLI::App& app, ConnectionOptions& connections) {
  AddSeconds(app, "--handshake-timeout", connections.handshake_timeout, absl::Seconds(1), absl::Hours(1),
             "How long a connection may take before it speaks HTTP/2, TLS included");
  AddSeconds(app, "--max-connection-idle", connections.max_idle, absl::Seconds(1), absl::Hours(24 * 14),
             "How long a connection is kept without any call");
  AddCount(app, "--max-streams", connections.calls.max_streams, 1, 1'000'000, "Calls at once on one connection");
  AddCount(app, "--max-calls", connections.calls.max_calls, 1, 10'000'000,
           "Calls at once on all connections; above it the connection with the most is closed");
}

void DeclareConfigFile(CLI::App& app) {
  app.config_formatter(std::make_shared<TomlFile>(app));
  // CLI11 looks for the file before it looks at variables, and would pass over a file that is not there.
  const std::string file = ValueOf(VariableOf("--config"));
  app.set_config("--config", file,
                 "Options in a TOML file: keys are the options without --; the command line wins, then the environment",
                 /*config_required=*/!file.empty())
      ->type_name("FILE");
  app.allow_config_extras(CLI::config_extras_mode::error);
}

}  // namespace wellspace::server
