// Lines of the log on their way to a file descriptor that may not take them.
#ifndef WELLSPACE_SERVER_LOG_LOG_WRITER_H_
#define WELLSPACE_SERVER_LOG_LOG_WRITER_H_

#include <cstddef>
#include <memory>
#include <string>

#include "absl/time/time.h"

namespace wellspace::server {

// A queue of lines, bounded by their bytes, and the thread that writes them.
//
// The descriptor may be a pipe whose reader has stopped reading: a write to it then never ends. So neither does anyone
// who writes here wait for it, nor the destructor for longer than kFarewell.
//
// Thread safety: thread-safe.
class LogWriter {
 public:
  // Of the lines that wait. A line of a call has some 300 bytes.
  static constexpr size_t kMaxBytes = size_t{4} << 20;
  // The time that the destructor leaves for the lines that wait.
  static constexpr absl::Duration kFarewell = absl::Seconds(1);

  // REQUIRES:   `descriptor` stays open as long as the process lives.
  explicit LogWriter(int descriptor, size_t max_bytes = kMaxBytes);
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  // Takes `line`, with its end. Lines are written in their order; of those that wait, the oldest are lost as long as
  // they have more than `max_bytes` in all.
  void Write(std::string line);

  // Waits until no line waits, but no longer than kFarewell.
  void Flush();

  // Bytes of the lines that wait.
  size_t WaitingBytes() const;
  // Lines that were lost so far.
  size_t LostLines() const;

 private:
  struct State;

  // Shared with the thread, which may be left behind in a write that never ends.
  const std::shared_ptr<State> state_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_LOG_LOG_WRITER_H_
