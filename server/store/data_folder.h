// The folder in which a server keeps its sessions.
//
//   lock              held by the server, whose process number it has
//   back-up.lock      held by a back-up
//   sessions.db       and -wal, -shm beside it: the database (SessionTables)
//   sessions.db-mark  how much of -wal has to be there (LogMark)
//   sessions.db.moved the database of before, since its records were moved to one elsewhere (MoveToPostgres)
//   ballast           room that is kept for deletions (Ballast)
//   store             in the place of all these, where the records are in a database elsewhere: which one (Pairing)
//   files/            points and meshes of sessions
//     ID.points-REVISION-EPOCH  points, as they came (PointFile), begun at a revision by the owner at an epoch
//     ID.mesh-REVISION-EPOCH    the mesh at a revision (MeshFile); with .tmp behind it, one that is being written
//                               Of releases without epochs: ID.points, ID.points-REVISION, ID.mesh-REVISION
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
#include "server/store/files.h"
#include "server/store/files_in_use.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// The end of the name of a file while it is written.
inline constexpr std::string_view kTemporaryEnd = ".tmp";

// The paths of files in the folder `root`.
struct DataPaths {
  std::string root;

  std::string lock() const { return root + "/lock"; }
  // Held by a back-up, as files() is: files that rows name, or have named, stay meanwhile.
  std::string back_up_lock() const { return root + "/back-up.lock"; }
  std::string database() const { return root + "/sessions.db"; }
  std::string ballast() const { return root + "/ballast"; }
  std::string pairing() const { return root + "/store"; }
  std::string files() const { return root + "/files"; }
  std::string lost() const { return root + "/lost"; }
  // `session`: its name.
  std::string points(const std::string& session, const store::v1::PointsFile& file) const;
  std::string mesh(const std::string& session, uint64_t revision, uint64_t epoch) const;
};

// The epoch in the name of a file in files/; 0: a name without one. None: the name is not as we give them.
std::optional<uint64_t> EpochOfName(const std::string& name);
inline bool IsNameOfOurs(const std::string& name) { return EpochOfName(name).has_value(); }
// When a file in lost/ was found, by its name. None: the name is not as we give them.
std::optional<absl::Time> FoundAt(const std::string& lost_name);

// A database whose records name the files of a folder.
struct Pairing {
  std::string id;        // of the database
  std::string database;  // its address, for messages
  std::string folder;    // that the database was first used with, for messages; empty: with none yet
};

// A folder, which no other process serves meanwhile, but for those that share a database elsewhere.
//
// Thread safety: thread-safe.
class DataFolder {
 public:
  // Makes the folder if it is not there yet, for this user alone.
  //
  // Errors:     FAILED_PRECONDITION: another process serves it, or it is no folder. PERMISSION_DENIED: it cannot be
  //             written to. Others of a FileSystem.
  static absl::StatusOr<std::unique_ptr<DataFolder>> Open(const std::string& root, FileSystem& files);

  // The same of a folder that several processes use at once, since their records are in a database elsewhere. Pair
  // says which.
  static absl::StatusOr<std::unique_ptr<DataFolder>> OpenShared(const std::string& root, FileSystem& files);

  const DataPaths& paths() const { return paths_; }

  // Holds the folder to the database `with`: writes down in a new one that it belongs to it.
  //
  // Errors:     FAILED_PRECONDITION: it belongs to another one, or has one of its own, or `with` has another folder; or
  //             a server that has the records in the folder has it in use. Others of a FileSystem.
  absl::Status Pair(const Pairing& with);
  // Refuses a folder that belongs to a database elsewhere.
  //
  // Errors:     FAILED_PRECONDITION, with that database.
  static absl::Status CheckNotPaired(const DataPaths& paths, FileSystem& files);

  // For a process that has opened the folder for itself: which database elsewhere it belongs to, none: its own; and the
  // change of that, at once, for moves.
  //
  // Errors:     those of a FileSystem.
  absl::StatusOr<Pairing> PairedWith() const;
  absl::Status SetPairing(const Pairing& with);

  // Looks for the database, and makes an empty one in a new folder. True where it may have no tables: it is new, or the
  // server that made it ended before it had made them.
  //
  // Errors:     FILE_DAMAGED: it is missing, or empty, and there are files of one. Others of a FileSystem.
  absl::StatusOr<bool> FindDatabase();

  // Moves files with names of ours to lost/ which no session of the census that `read` makes names, and which no owner
  // may still have named: they are not in use, and their epoch is this process's, or of an owner that is no more. Where
  // a database was lost, or an old one put in its place, they are not lost with it.
  // Removes those that have been in lost/ for kKeptLost, but not in the first call: clocks may be wrong at a start.
  //
  // Errors:     those of `read`, and of a FileSystem.
  absl::StatusOr<Garbage> RemoveGarbage(FilesInUse& in_use, const std::function<bool(uint64_t epoch)>& is_own,
                                        const Files::ReadCensus& read, absl::Time now);

  static constexpr absl::Duration kKeptLost = absl::Hours(24);

 private:
  // Makes the folder of files in the folder that is there.
  static absl::Status MakeFiles(const DataPaths& paths, FileSystem& files);

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

// The paths of files in the folder that do not belong there.
absl::StatusOr<std::vector<std::string>> FindUnknown(const DataPaths& paths, FileSystem& files);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_DATA_FOLDER_H_
