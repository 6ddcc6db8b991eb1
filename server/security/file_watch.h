// Files that may be replaced while the server runs.
#ifndef WELLSPACE_SERVER_SECURITY_FILE_WATCH_H_
#define WELLSPACE_SERVER_SECURITY_FILE_WATCH_H_

#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace wellspace::server {

// The content of a file of at most 16 MiB.
//
// Errors:     NOT_FOUND, PERMISSION_DENIED and so on by errno; INVALID_ARGUMENT: it is no regular file, or too large.
//             All name the path.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// Notices when files change: another inode behind the path, another size, or another time of modification. Symbolic
// links are followed, so that swapping the link to a folder is noticed, too.
//
// Thread safety: thread-compatible. `on_change` runs on a thread of its own.
class FileWatch {
 public:
  // Notes the state of the files. Changes after this are noticed, so that contents read before Start do not stay stale.
  explicit FileWatch(std::vector<std::string> paths);
  // Waits for on_change if it runs.
  ~FileWatch();
  FileWatch(const FileWatch&) = delete;
  FileWatch& operator=(const FileWatch&) = delete;

  // From now on looks at the files every `interval`, and calls `on_change` when one or several have changed. To be
  // called once.
  void Start(absl::Duration interval, std::function<void()> on_change);

 private:
  struct Mark;

  std::vector<Mark> Look() const;
  void Run(std::stop_token stop, absl::Duration interval, const std::function<void()>& on_change);

  const std::vector<std::string> paths_;
  std::vector<Mark> marks_;  // of paths_, as last seen; the thread's once it runs
  std::mutex mutex_;         // guards nothing: the condition wants one
  std::condition_variable_any stopped_;
  std::jthread thread_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SECURITY_FILE_WATCH_H_
