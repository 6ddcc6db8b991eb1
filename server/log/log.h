// The log of wellspaced: its lines, in text or JSON, and its logger.
#ifndef WELLSPACE_SERVER_LOG_LOG_H_
#define WELLSPACE_SERVER_LOG_LOG_H_

#include <memory>
#include <string>

#include "server/log/log_writer.h"
#include "spdlog/formatter.h"
#include "spdlog/logger.h"

namespace wellspace::server {

enum class LogFormat {
  kText,  // 2026-01-31T23:59:59.123+0000 info event=call method=MeshPoints …
  kJson,  // {"time":"2026-01-31T23:59:59.123Z","level":"info","event":"call","method":"MeshPoints",…}
};

// One line for each message. As JSON a message of LogFields gives its fields, any other the member "message".
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

// A logger that never holds up its caller: `writer` writes, and when it cannot follow, the oldest lines are lost. Of a
// message of more than kMaxMessageBytes the rest is lost.
//
// REQUIRES:   `level` is one of debug, info, warning, error and off.
inline constexpr size_t kMaxMessageBytes = 16384;
std::shared_ptr<spdlog::logger> MakeLogger(const std::string& level, LogFormat format,
                                           std::shared_ptr<LogWriter> writer);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_LOG_LOG_H_
