// The folder in which a server keeps its sessions.
//
//   lock              held by the server, whose process number it has
//   back-up.lock      held by a back-up
//   sessions.db       and -wal, -shm beside it: the database (SessionTables)
//   files/            points and meshes of sessions
//     ID.points         the points, as they came (PointFile)
//     ID.points-NUMBER  those that are left since points were removed
//     ID.mesh-REVISION  the mesh at a revision (MeshFile); with .tmp behind it, one that is being written
#ifndef WELLSPACE_SERVER_STORE_DATA_FOLDER_H_
#define WELLSPACE_SERVER_STORE_DATA_FOLDER_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
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
  // Held by a back-up: what rows name, or have named, stays meanwhile.
  std::string back_up_lock() const { return root + "/back-up.lock"; }
  std::string database() const { return root + "/sessions.db"; }
  std::string files() const { return root + "/files"; }
  // `session`: its name. `number`: that of its points file (SessionRecord.points_file).
  std::string points(const std::string& session, uint64_t number) const;
  std::string mesh(const std::string& session, uint64_t revision) const;
};

// Whether a file in files/ has a name as we give them.
bool IsNameOfOurs(const std::string& name);

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

  // Removes files with names of ours which are neither in use nor named by a session of those that `read_sessions`
  // returns. To be called at the start, and now and then.
  //
  // Errors:     those of `read_sessions`, and of a FileSystem.
  absl::StatusOr<Garbage> RemoveGarbage(
      FilesInUse& in_use, const std::function<absl::StatusOr<std::vector<store::v1::SessionRecord>>()>& read_sessions);

 private:
  DataFolder(DataPaths paths, FileSystem& files) : paths_(std::move(paths)), files_(files) {}

  const DataPaths paths_;
  FileSystem& files_;
  std::unique_ptr<FileLock> lock_;
};

// The paths of all files that `session` names, whether they are there or not.
std::vector<std::string> FilesOf(const DataPaths& paths, const store::v1::SessionRecord& session);

// The paths of what is in the folder besides what belongs there.
absl::StatusOr<std::vector<std::string>> FindUnknown(const DataPaths& paths, FileSystem& files);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_DATA_FOLDER_H_
