// Folders whose records are in a database elsewhere: which one.
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/store/data_folder.h"

namespace wellspace::server {
namespace {

// Processes that begin at once have the folder for a moment each.
constexpr absl::Duration kBetweenLooks = absl::Milliseconds(20);
constexpr int kLooks = 250;
constexpr uint64_t kMostBytes = 4096;

// The file `store`: the id of the database, and its address when it was written. Empty: there is none.
absl::StatusOr<Pairing> ReadPairing(const DataPaths& paths, FileSystem& files) {
  const absl::StatusOr<std::unique_ptr<File>> file = files.Open(paths.pairing(), FileSystem::Mode::kRead);
  if (file.status().code() == absl::StatusCode::kNotFound) {
    return Pairing();
  }
  WELLSPACE_RETURN_IF_ERROR(file.status());
  std::string text(kMostBytes, '\0');
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t size, (*file)->ReadAt(0, text));
  text.resize(size);
  const std::vector<std::string> lines = absl::StrSplit(text, '\n');
  return Pairing{.id = lines[0], .database = lines.size() > 1 ? lines[1] : "", .folder = {}};
}

// Under another name first: half of it would be another database's.
absl::Status WritePairing(const DataPaths& paths, FileSystem& files, const Pairing& pairing) {
  const std::string text = absl::StrCat(pairing.id, "\n", pairing.database, "\n");
  const std::string temporary = absl::StrCat(paths.pairing(), std::string(kTemporaryEnd));
  {
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file,
                               files.Open(temporary, FileSystem::Mode::kCreateOrWrite));
    WELLSPACE_RETURN_IF_ERROR(file->Truncate(0));
    WELLSPACE_RETURN_IF_ERROR(file->WriteAt(0, text));
    WELLSPACE_RETURN_IF_ERROR(file->Synchronize());
  }
  WELLSPACE_RETURN_IF_ERROR(files.Rename(temporary, paths.pairing()));
  return files.SynchronizeFolder(paths.root);
}

}  // namespace

absl::Status DataFolder::Pair(const Pairing& with) {
  // A server with its records in the folder has it locked; it is not to begin meanwhile.
  absl::StatusOr<std::unique_ptr<FileLock>> lock = files_.LockFolder(paths_.root);
  for (int i = 0; i < kLooks && lock.status().code() == absl::StatusCode::kAborted; ++i) {
    absl::SleepFor(kBetweenLooks);
    lock = files_.LockFolder(paths_.root);
  }
  if (lock.status().code() == absl::StatusCode::kAborted) {
    return absl::FailedPreconditionError(
        absl::StrCat(paths_.root, ": another process has this folder in use; stop it first, or name another folder"));
  }
  WELLSPACE_RETURN_IF_ERROR(lock.status());
  WELLSPACE_ASSIGN_OR_RETURN(const Pairing paired, ReadPairing(paths_, files_));
  if (paired.id == with.id) {
    return absl::OkStatus();
  }
  if (!paired.id.empty()) {
    return absl::FailedPreconditionError(absl::StrCat(paths_.root, " has the files of another database, ",
                                                      paired.database,
                                                      ", as its file 'store' says; name that one, or another folder"));
  }
  if (!with.folder.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the files of the database ", with.database, " are in ", with.folder, ", and ", paths_.root,
                     " is another folder: it has no file 'store' of that one; name that folder, or a copy of it"));
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> names, files_.List(paths_.root));
  for (const std::string& name : names) {
    if (paths_.database() == absl::StrCat(paths_.root, "/", name)) {
      return absl::FailedPreconditionError(
          absl::StrCat(paths_.root, " has a database of its own, ", name,
                       "; name a new folder for the files of sessions whose records are in PostgreSQL"));
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> inner, files_.List(paths_.files()));
  if (!inner.empty()) {
    return absl::FailedPreconditionError(absl::StrCat(paths_.files(), " has files already (", inner.size(),
                                                      "), and the database ", with.database,
                                                      " is new; name a new folder"));
  }
  return WritePairing(paths_, files_, with);
}

absl::StatusOr<Pairing> DataFolder::PairedWith() const { return ReadPairing(paths_, files_); }

absl::Status DataFolder::SetPairing(const Pairing& with) {
  if (!with.id.empty()) {
    return WritePairing(paths_, files_, with);
  }
  WELLSPACE_RETURN_IF_ERROR(files_.Remove(paths_.pairing()));
  return files_.SynchronizeFolder(paths_.root);
}

absl::Status DataFolder::CheckNotPaired(const DataPaths& paths, FileSystem& files) {
  WELLSPACE_ASSIGN_OR_RETURN(const Pairing paired, ReadPairing(paths, files));
  return paired.id.empty() ? absl::OkStatus()
                           : absl::FailedPreconditionError(
                                 absl::StrCat(paths.root, ": the records of these files are in the database ",
                                              paired.database, ", as the file 'store' says; name it with --store"));
}

}  // namespace wellspace::server
