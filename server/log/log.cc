#include "server/log/log.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "server/log/log_fields.h"
#include "spdlog/details/log_msg.h"
#include "spdlog/pattern_formatter.h"
#include "spdlog/sinks/base_sink.h"

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

class WriterSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit WriterSink(std::shared_ptr<LogWriter> writer) : writer_(std::move(writer)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::details::log_msg bounded = message;
    bounded.payload = spdlog::string_view_t(message.payload.data(), std::min(message.payload.size(), kMaxMessageBytes));
    spdlog::memory_buf_t line;
    formatter_->format(bounded, line);
    writer_->Write(std::string(line.data(), line.size()));
  }
  void flush_() override { writer_->Flush(); }

  const std::shared_ptr<LogWriter> writer_;
};

}  // namespace

std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format) {
  if (format == LogFormat::kJson) {
    return std::make_unique<JsonFormatter>();
  }
  return std::make_unique<spdlog::pattern_formatter>("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
}

std::shared_ptr<spdlog::logger> MakeLogger(const std::string& level, LogFormat format,
                                           std::shared_ptr<LogWriter> writer) {
  auto log = std::make_shared<spdlog::logger>("wellspaced", std::make_shared<WriterSink>(std::move(writer)));
  log->set_level(spdlog::level::from_str(level));
  log->set_formatter(MakeLogFormatter(format));
  return log;
}

}  // namespace wellspace::server
