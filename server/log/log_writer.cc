#include "server/log/log_writer.h"

#include <limits.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

namespace wellspace::server {
namespace {

// The interval at which a thread that waits for a reader looks whether it is still wanted.
constexpr int kWantedLookMs = 100;

}  // namespace

struct LogWriter::State {
  State(int descriptor_in, size_t max_bytes_in) : descriptor(descriptor_in), max_bytes(max_bytes_in) {}

  void Run();
  // Writes all of `bytes`, as far as the descriptor ever takes them. Without the lock.
  void WriteAll(std::string_view bytes);
  bool IsAbandoned() const {
    std::lock_guard lock(mutex);
    return abandoned;
  }

  const int descriptor;
  const size_t max_bytes;
  mutable std::mutex mutex;
  std::condition_variable changed;
  // Guarded by mutex.
  std::deque<std::string> lines;
  size_t bytes = 0;  // of `lines`
  size_t lost = 0;
  bool stopping = false;   // when all lines are written, the thread is to end
  bool abandoned = false;  // or at once
  bool ended = false;
  bool writing = false;
};

void LogWriter::State::Run() {
  std::unique_lock lock(mutex);
  while (!abandoned) {
    changed.wait(lock, [this] { return !lines.empty() || stopping; });
    if (lines.empty()) {
      break;
    }
    const std::string line = std::move(lines.front());
    lines.pop_front();
    bytes -= line.size();
    writing = true;
    lock.unlock();
    WriteAll(line);
    lock.lock();
    writing = false;
    changed.notify_all();
  }
  ended = true;
  changed.notify_all();
}

void LogWriter::State::WriteAll(std::string_view rest) {
  while (!rest.empty()) {
    pollfd poll_descriptor = {.fd = descriptor, .events = POLLOUT, .revents = 0};
    const int is_ready = poll(&poll_descriptor, 1, kWantedLookMs);
    if (IsAbandoned()) {
      return;
    }
    if (is_ready == 0) {
      continue;
    }
    // So much a pipe takes at once when it says that it can be written to.
    const ssize_t written = write(descriptor, rest.data(), std::min<size_t>(rest.size(), PIPE_BUF));
    if (written > 0) {
      rest.remove_prefix(static_cast<size_t>(written));
    } else if (errno != EINTR && errno != EAGAIN) {
      return;  // a full disk, or a pipe that nothing reads any more: this line is lost
    }
  }
}

LogWriter::LogWriter(int descriptor, size_t max_bytes) : state_(std::make_shared<State>(descriptor, max_bytes)) {
  std::thread([state = state_] { state->Run(); }).detach();
}

LogWriter::~LogWriter() {
  std::unique_lock lock(state_->mutex);
  state_->stopping = true;
  state_->changed.notify_all();
  state_->changed.wait_for(lock, absl::ToChronoNanoseconds(kFarewell), [this] { return state_->ended; });
  state_->abandoned = true;
}

void LogWriter::Write(std::string line) {
  std::lock_guard lock(state_->mutex);
  state_->bytes += line.size();
  state_->lines.push_back(std::move(line));
  while (state_->bytes > state_->max_bytes) {
    state_->bytes -= state_->lines.front().size();
    state_->lines.pop_front();
    ++state_->lost;
  }
  state_->changed.notify_all();
}

void LogWriter::Flush() {
  std::unique_lock lock(state_->mutex);
  state_->changed.wait_for(lock, absl::ToChronoNanoseconds(kFarewell),
                           [this] { return state_->lines.empty() && !state_->writing; });
}

size_t LogWriter::WaitingBytes() const {
  std::lock_guard lock(state_->mutex);
  return state_->bytes;
}

size_t LogWriter::LostLines() const {
  std::lock_guard lock(state_->mutex);
  return state_->lost;
}

}  // namespace wellspace::server
