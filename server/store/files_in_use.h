// The files that are read, or are to be named by a row soon, and so must stay.
#ifndef WELLSPACE_SERVER_STORE_FILES_IN_USE_H_
#define WELLSPACE_SERVER_STORE_FILES_IN_USE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/store/file_system.h"

namespace wellspace::server {

// Removes files when their last user is gone. A file that could not be removed is garbage, which
// DataFolder::RemoveGarbage takes.
//
// Thread safety: thread-safe.
class FilesInUse : public std::enable_shared_from_this<FilesInUse> {
 public:
  // Ends the use of a file, and removes the file if it is obsolete and this was the last use.
  class Use {
   public:
    ~Use() { files_->Release(path_); }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

    const std::string& path() const { return path_; }
    // The file goes when its last use ends, unless another has been written in its place since this use began.
    void MakeObsolete() { files_->MakeObsolete(path_, version_, ""); }
    // The same, but that the file comes to have the name `to`, which is free, instead of being removed.
    void SetAside(const std::string& to) { files_->MakeObsolete(path_, version_, to); }

   private:
    friend class FilesInUse;
    Use(std::shared_ptr<FilesInUse> files, std::string path, uint64_t version);

    const std::shared_ptr<FilesInUse> files_;
    const std::string path_;
    const uint64_t version_;
  };

  // Nothing is removed while `may_remove` says no; it may be empty.
  explicit FilesInUse(FileSystem& file_system, std::function<bool()> may_remove = nullptr)
      : file_system_(file_system), may_remove_(std::move(may_remove)) {}

  // `is_written`: a new file is about to be written in this place.
  std::unique_ptr<Use> Take(const std::string& path, bool is_written);
  // As Take of a file that is not written; null if it is in use.
  std::unique_ptr<Use> TakeUnlessUsed(const std::string& path);
  // Removes the file now, or when its last use ends.
  void Remove(const std::string& path);

 private:
  struct State {
    uint64_t uses = 0;
    uint64_t version = 0;  // grows with each file that is written in this place
    bool is_obsolete = false;
    std::string set_aside{};  // its name then; empty: it is removed
  };

  // Both with mutex_ held.
  std::unique_ptr<Use> TakeLocked(const std::string& path, bool is_written);
  void RemoveNow(const std::string& path, const std::string& set_aside = "");
  void Release(const std::string& path);
  void MakeObsolete(const std::string& path, uint64_t version, const std::string& set_aside);

  FileSystem& file_system_;
  const std::function<bool()> may_remove_;
  std::mutex mutex_;                     // held while a file is removed, so that none is written in its place meanwhile
  std::map<std::string, State> states_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_FILES_IN_USE_H_
