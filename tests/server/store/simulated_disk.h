// A disk in memory that loses power, fills up and breaks.
#ifndef WELLSPACE_TESTS_SERVER_STORE_SIMULATED_DISK_H_
#define WELLSPACE_TESTS_SERVER_STORE_SIMULATED_DISK_H_

#include <sqlite3.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/store/file_system.h"

namespace wellspace::server {

// Knows of each file the bytes and the size that were synchronised, and what has been written since; of each folder the
// names that were synchronised, and those that came or went since. SQLite works on it by a VFS of its own, which has no
// shared memory: databases are opened with exclusive locks.
//
// Thread safety: none; one thread uses it, and all that works on it.
class SimulatedDisk {
 public:
  // The data that a Restart loses.
  enum class Loss {
    kProcess,  // only the process died: all is as it was last written, and may still be lost
    kAll,      // nothing that was not synchronised
    kSome,     // of that any part: writes torn at sectors, sizes without bytes, names in any order
  };
  enum class Fault {
    kNoSpace,     // nothing is done, and the disk is full; reads go on
    kNoRoom,      // as kNoSpace, but of writes alone
    kBroken,      // nothing is done, and the disk is broken
    kForbidden,   // files cannot be opened, for want of permission
    kShortWrite,  // half of a write is done, then the disk is full; others as kNoSpace
  };

  SimulatedDisk();
  ~SimulatedDisk();
  SimulatedDisk(const SimulatedDisk&) = delete;
  SimulatedDisk& operator=(const SimulatedDisk&) = delete;

  FileSystem& files();
  const char* vfs() const { return vfs_name_.c_str(); }

  // Operations are writes, synchronisations, changes of names and sizes, opens and, if asked for, reads.
  uint64_t operations() const { return operations_; }
  void CountReads() { counts_reads_ = true; }
  // The operation of this number, counted from 0 on, and all after it do nothing, and fail.
  void DieAt(uint64_t operation) { dies_at_ = operation; }
  bool is_dead() const { return dies_at_.has_value() && operations_ > *dies_at_; }
  // `count` operations from this one on fail.
  void FailAt(uint64_t operation, Fault fault, uint64_t count = 1);
  // Files have so many bytes together at most from now on: a write that would make one longer finds the disk full.
  void LimitBytes(uint64_t bytes) { most_bytes_ = bytes; }
  uint64_t UsedBytes() const;
  bool has_failed() const { return has_failed_; }
  // The operation that died or failed.
  const std::string& failed_operation() const { return failed_operation_; }
  // From now on files and folders whose paths end so, or so and numbers behind hyphens, are not synchronised, though it
  // is said, as long as `is_planted` returns true; null: always.
  void OmitSynchronize(const std::string& end, std::function<bool()> is_planted = nullptr) {
    omitted_.push_back({end, std::move(is_planted)});
  }

  // Makes the disk the one that the machine finds when it is started again. Ends DieAt and FailAt.
  void Restart(Loss loss, uint64_t seed);
  // As new.
  void Clear();

  std::vector<std::string> List(const std::string& folder) const;
  bool Has(const std::string& path) const { return names_.contains(path); }
  // Flips a bit of the file, for good.
  void Flip(const std::string& path, uint64_t byte, int bit);
  uint64_t SizeOf(const std::string& path) const;

 private:
  friend class SimulatedFile;
  friend class SimulatedFiles;
  friend struct SimulatedVfs;

  struct Change {
    bool is_truncation = false;
    uint64_t offset = 0;  // of a truncation, the size
    std::string bytes{};
  };
  struct Inode {
    std::string content;
    std::string durable;
    std::vector<Change> changes;  // since
  };
  // Null: a folder.
  using Entry = std::shared_ptr<Inode>;
  // A name that comes, or goes; of a rename, both together.
  struct NameChange {
    std::string folder;
    std::vector<std::pair<std::string, std::optional<Entry>>> entries;
  };

  // To be called at the beginning of each operation.
  absl::Status Begin(const std::string& what, const std::string& path, bool is_read = false);
  absl::StatusOr<Entry> Open(const std::string& path, FileSystem::Mode mode);
  absl::Status Write(Inode& inode, const std::string& path, uint64_t offset, std::span<const char> bytes);
  absl::Status Truncate(Inode& inode, const std::string& path, uint64_t size);
  absl::Status Synchronize(Inode& inode, const std::string& path);
  absl::Status SynchronizeFolder(const std::string& folder);
  absl::Status Remove(const std::string& path);
  absl::Status Rename(const std::string& from, const std::string& to);
  absl::Status Link(const std::string& from, const std::string& to);
  absl::Status CreateFolder(const std::string& folder);
  void ChangeNames(NameChange change);
  static void Apply(const NameChange& change, std::map<std::string, Entry>& names);
  // Whether a change that was not synchronised is there all the same.
  using Draw = std::function<bool()>;
  static void Lose(Inode& inode, const Draw& is_kept);
  bool IsOmitted(const std::string& path) const;

  std::unique_ptr<FileSystem> files_;
  std::string vfs_name_;
  sqlite3_vfs vfs_{};

  std::map<std::string, Entry> names_;          // by path
  std::map<std::string, Entry> durable_names_;  // by path
  std::vector<NameChange> name_changes_;        // since
  std::set<std::string> locks_;                 // paths

  uint64_t operations_ = 0;
  bool counts_reads_ = false;
  std::optional<uint64_t> dies_at_;
  uint64_t fails_at_ = 0;
  uint64_t fail_count_ = 0;
  Fault fault_ = Fault::kNoSpace;
  uint64_t most_bytes_ = UINT64_MAX;
  bool has_failed_ = false;
  bool is_short_write_ = false;  // of the operation that has just begun
  std::string failed_operation_;
  struct Omitted {
    std::string end;
    std::function<bool()> is_planted;
  };
  std::vector<Omitted> omitted_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_SIMULATED_DISK_H_
