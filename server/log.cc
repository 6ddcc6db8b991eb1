#include "server/log.h"

#include <optional>
#include <string_view>

#include "server/log_fields.h"
#include "spdlog/async_logger.h"
#include "spdlog/pattern_formatter.h"
#include "spdlog/sinks/stdout_sinks.h"

namespace wellspace::server {
namespace {

class JsonFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    head_.format(message, line);
    const std::string_view payload(message.payload.data(), message.payload.size());
    std::optional<std::string> members = ToJsonMembers(payload);
    if (!members.has_value()) {
      members = "\"message\":" + JsonString(payload);
    }
    *members += "}\n";
    line.append(members->data(), members->data() + members->size());
  }

  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonFormatter>(); }

 private:
  spdlog::pattern_formatter head_{R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",)", spdlog::pattern_time_type::utc,
                                  ""};
};

}  // namespace

std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format) {
  if (format == LogFormat::kJson) {
    return std::make_unique<JsonFormatter>();
  }
  return std::make_unique<spdlog::pattern_formatter>("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
}

std::shared_ptr<spdlog::logger> MakeLogger(const std::string& level, LogFormat format,
                                           const std::shared_ptr<spdlog::details::thread_pool>& writer) {
  auto log = std::make_shared<spdlog::async_logger>("wellspaced", std::make_shared<spdlog::sinks::stderr_sink_mt>(),
                                                    writer, spdlog::async_overflow_policy::overrun_oldest);
  log->set_level(spdlog::level::from_str(level));
  log->flush_on(spdlog::level::info);
  log->set_formatter(MakeLogFormatter(format));
  return log;
}

}  // namespace wellspace::server
