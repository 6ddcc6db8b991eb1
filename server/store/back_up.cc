#include "server/store/back_up.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"
#include "server/store/data_folder.h"
#include "server/store/write_ahead_log.h"

namespace wellspace::server {
namespace {

constexpr size_t kCopyBytes = size_t{1} << 20;

// A second, in all.
constexpr int kLockAttempts = 200;
constexpr absl::Duration kBetweenLockAttempts = absl::Milliseconds(5);

// Copies the first `size` bytes.
absl::Status CopyFile(FileSystem& files, const std::string& from, const std::string& to, uint64_t size) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> source, files.Open(from, FileSystem::Mode::kRead));
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> target, files.Open(to, FileSystem::Mode::kCreateOrWrite));
  std::vector<char> block(kCopyBytes);
  for (uint64_t done = 0; done < size;) {
    const std::span<char> part(block.data(), std::min<uint64_t>(block.size(), size - done));
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t count, source->ReadAt(done, part));
    if (count < part.size()) {
      return absl::DataLossError(
          absl::StrCat(from, ": the file ends at byte ", done + count, ", and should have ", size, " at least"));
    }
    WELLSPACE_RETURN_IF_ERROR(target->WriteAt(done, part));
    done += count;
  }
  return target->Synchronize();
}

// Copies the files that `session` names.
absl::Status CopyFiles(FileSystem& files, const DataPaths& from, const DataPaths& to,
                       const store::v1::SessionRecord& session) {
  const std::vector<store::v1::PointsFile> points_files = PointsFilesOf(session);
  for (size_t i = 0; i < points_files.size(); ++i) {
    const uint64_t end = i + 1 < points_files.size() ? points_files[i + 1].first() : session.points();
    const uint64_t size = (end - points_files[i].first()) * session.parameters().dimension() * sizeof(double);
    WELLSPACE_RETURN_IF_ERROR(CopyFile(files, from.points(session.name(), points_files[i]),
                                       to.points(session.name(), points_files[i]), size));
  }
  if (!session.has_mesh()) {
    return absl::OkStatus();
  }
  const std::string source = from.mesh(session.name(), session.mesh().revision(), session.mesh().epoch());
  const std::string target = to.mesh(session.name(), session.mesh().revision(), session.mesh().epoch());
  return files.Link(source, target).ok() ? absl::OkStatus() : CopyFile(files, source, target, session.mesh().size());
}

using HeldLock = absl::StatusOr<std::unique_ptr<FileLock>>;

// A server that looks whether it is locked has it for a moment.
HeldLock LockForBackUp(const std::function<HeldLock()>& take) {
  HeldLock lock = take();
  for (int i = 0; i < kLockAttempts && lock.status().code() == absl::StatusCode::kAborted; ++i) {
    absl::SleepFor(kBetweenLockAttempts);
    lock = take();
  }
  return lock;
}

// A copy within the folder would be of the folder, and copied with it the next time.
absl::Status CheckApart(const std::string& folder, const std::string& to) {
  std::error_code error;
  const std::filesystem::path outer = std::filesystem::canonical(folder, error);
  if (error) {
    return absl::OkStatus();  // it cannot be opened either, or is not of this machine
  }
  const std::filesystem::path inner = std::filesystem::weakly_canonical(std::filesystem::absolute(to, error), error);
  const auto [end, ignored] = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  return error || end != outer.end()
             ? absl::OkStatus()
             : absl::FailedPreconditionError(
                   absl::StrCat(to, ": is within ", folder, ", the folder that is to be backed up; name another one"));
}

absl::Status CheckEmpty(const DataPaths& to, FileSystem& files) {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<std::string> names, files.List(to.root));
  std::erase_if(names, [](const std::string& name) { return name == "lock" || name == "files"; });
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> inner, files.List(to.files()));
  return names.empty() && inner.empty()
             ? absl::OkStatus()
             : absl::FailedPreconditionError(absl::StrCat(to.root, ": the folder is not empty; name a new one"));
}

}  // namespace

absl::StatusOr<DataReport> BackUp(const std::string& folder, const std::string& to, const CheckDataOptions& options) {
  WELLSPACE_RETURN_IF_ERROR(CheckApart(folder, to));
  FileSystem& files = *options.files;
  const DataPaths from_paths{folder};
  const DataPaths to_paths{to};
  WELLSPACE_RETURN_IF_ERROR(DataFolder::CheckNotPaired(from_paths, files));
  SessionTablesOptions read_only = options.tables;
  read_only.is_read_only = true;
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(from_paths.database(), read_only));
  WELLSPACE_RETURN_IF_ERROR(CheckLog(files, from_paths.database()));
  // Its lock keeps a server from being started with half of the copy.
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<DataFolder> target, DataFolder::Open(to, files));
  WELLSPACE_RETURN_IF_ERROR(CheckEmpty(to_paths, files));

  // A server removes no file from now on, so that all that the rows name stays until it is copied.
  // The lock of the file has the number of this process; that of the folder is held whatever becomes of names.
  const HeldLock has_number = LockForBackUp([&] { return files.Lock(from_paths.back_up_lock()); });
  const HeldLock keeps_files = LockForBackUp([&] { return files.LockFolder(from_paths.files()); });
  for (const absl::Status& status : {has_number.status(), keeps_files.status()}) {
    if (status.code() == absl::StatusCode::kAborted) {
      const std::string holder(status.message());
      return absl::FailedPreconditionError(absl::StrCat(folder,
                                                        holder.empty() ? ": another process" : ": process " + holder,
                                                        " is backing this folder up; wait for its end"));
    }
    WELLSPACE_RETURN_IF_ERROR(status);
  }
  WELLSPACE_RETURN_IF_ERROR(tables->BackUp(to_paths.database(), options.tables));
  {
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SessionTables> copy,
                               SessionTables::Open(to_paths.database(), read_only));
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<store::v1::SessionRecord> sessions, copy->ReadStates());
    for (const store::v1::SessionRecord& session : sessions) {
      const absl::Status copied = CopyFiles(files, from_paths, to_paths, session);
      if (copied.code() == absl::StatusCode::kNotFound) {
        return absl::DataLossError(absl::StrCat(std::string(copied.message()), "; check the folder that is backed up"));
      }
      WELLSPACE_RETURN_IF_ERROR(copied);
    }
  }
  WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(to_paths.files()));
  WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(to));
  WELLSPACE_ASSIGN_OR_RETURN(DataReport report, CheckData(to, options));
  if (!report.is_whole()) {
    return absl::DataLossError(absl::StrCat("the copy is not whole: ", report.problems.front()));
  }
  return report;
}

}  // namespace wellspace::server
