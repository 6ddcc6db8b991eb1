// The folder in which a server keeps its sessions.
//
//   lock              held by the server, whose process number it has
//   back-up.lock      held by a back-up
//   sessions.db       and -wal, -shm beside it: the database (SessionTables)
//   sessions.db-mark  how much of -wal has to be there (LogMark)
//   ballast           room that is kept for deletions (Ballast)
//   files/            points and meshes of sessions
//     ID.points         the points, as they came (PointFile)
//     ID.points-NUMBER  those that are left since points were removed
//     ID.mesh-REVISION  the mesh at a revision (MeshFile); with .tmp behind it, one that is being written
//   lost/             files that no session named when they were found; they are kept here for a day
//     NAME.SECONDS      the name in files/, and when it was found, in seconds since 1970
#ifndef WELLSPACE_SERVER_STORE_DATA_FOLDER_H_
#define WELLSPACE_SERVER_STORE_DATA_FOLDER_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/store/file_system.h"
#include "server/store/files_in_use.h"
#include "server/store/session_log.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// What stands behind the name of a file while it is written.
inline constexpr std::string_view kTemporaryEnd = ".tmp";

// Where things are in the folder `root`.
struct DataPaths {
  std::string root;

  std::string lock() const { return root + "/lock"; }
  // Held by a back-up, as files() is: what rows name, or have named, stays meanwhile.
  std::string back_up_lock() const { return root + "/back-up.lock"; }
  std::string database() const { return root + "/sessions.db"; }
  std::string ballast() const { return root + "/ballast"; }
  std::string files() const { return root + "/files"; }
  std::string lost() const { return root + "/lost"; }
  // `session`: its name. `number`: that of its points file (SessionRecord.points_file).
  std::string points(const std::string& session, uint64_t number) const;
  std::string mesh(const std::string& session, uint64_t revision) const;
};

// Whether a file in files/ has a name as we give them.
bool IsNameOfOurs(const std::string& name);
// When a file in lost/ was found, by its name. None: the name is not as we give them.
std::optional<absl::Time> FoundAt(const std::string& lost_name);

// A folder, which no other process serves meanwhile.
//
// Thread safety: thread-safe.
class DataFolder {
 public:
  // Makes the folder if it is not there yet, for this user alone.
  //
  // Errors:     FAILED_PRECONDITION: another process serves it, or it is no folder. PERMISSION_DENIED: it cannot be
  //             written to. Others of a FileSystem.
  static absl::StatusOr<std::unique_ptr<DataFolder>> Open(const std::string& root, FileSystem& files);

  const DataPaths& paths() const { return paths_; }

  // Looks whether the database is there, and makes an empty one in a new folder. Whether it may be without tables: a
  // server has not come to its end of making them.
  //
  // Errors:     FILE_DAMAGED: it is missing, or empty, and there is what belongs to one. Others of a FileSystem.
  absl::StatusOr<bool> FindDatabase();

  // Moves files with names of ours to lost/ which are neither in use nor named by a session of those that
  // `read_sessions` returns. Where a database was lost, or an old one put in its place, they are not lost with it.
  // Removes those that have been in lost/ for kKeptLost, but not in the first call: clocks may be wrong at a start.
  //
  // Errors:     those of `read_sessions`, and of a FileSystem.
  absl::StatusOr<Garbage> RemoveGarbage(
      FilesInUse& in_use, const std::function<absl::StatusOr<std::vector<store::v1::SessionRecord>>()>& read_sessions,
      absl::Time now);

  static constexpr absl::Duration kKeptLost = absl::Hours(24);

 private:
  using Candidates = std::map<std::string, std::unique_ptr<FilesInUse::Use>>;  // by name

  DataFolder(DataPaths paths, FileSystem& files) : paths_(std::move(paths)), files_(files) {}

  absl::StatusOr<std::vector<Garbage::SetAside>> SetAside(Candidates candidates, absl::Time now);
  absl::StatusOr<std::vector<std::string>> RemoveLost(absl::Time now);

  const DataPaths paths_;
  FileSystem& files_;
  std::unique_ptr<FileLock> folder_lock_;  // that of `lock` goes with its name
  std::unique_ptr<FileLock> lock_;
  std::atomic<bool> has_collected_ = false;
};

// The paths of all files that `session` names, whether they are there or not.
std::vector<std::string> FilesOf(const DataPaths& paths, const store::v1::SessionRecord& session);

// The paths of what is in the folder besides what belongs there.
absl::StatusOr<std::vector<std::string>> FindUnknown(const DataPaths& paths, FileSystem& files);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_DATA_FOLDER_H_
