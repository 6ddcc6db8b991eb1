// Room on the disk that is given up so that deletions, which free more, can be written.
#ifndef WELLSPACE_SERVER_STORE_BALLAST_H_
#define WELLSPACE_SERVER_STORE_BALLAST_H_

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "server/store/file_system.h"

namespace wellspace::server {

// A file without meaning. On a full disk it is room for a deletion's writes; while it is not whole nothing else may
// grow, so that no other takes that room.
//
// Thread safety: thread-safe.
class Ballast {
 public:
  // Of `bytes`; 0: there is none, and nothing is held back.
  Ballast(FileSystem& files, std::string path, uint64_t bytes);

  // Makes it whole, if it is not. To be called before a change that takes up room.
  //
  // Complexity: O(1) when it is whole, else O(bytes).
  // Errors:     those of a FileSystem. RESOURCE_EXHAUSTED: the disk has no room for it, and so not for anything else.
  absl::Status Fill();

  // Gives its room up. False: it has none.
  bool GiveUp();

 private:
  absl::Status Write();

  FileSystem& files_;
  const std::string path_;
  const uint64_t bytes_;
  std::mutex mutex_;  // of the file
  std::atomic<bool> is_whole_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_BALLAST_H_
