#include "server/store/back_up.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/data_folder.h"

namespace wellspace::server {
namespace {

constexpr size_t kCopyBytes = size_t{1} << 20;

// Each time, a session was deleted, or got another mesh, between the copy of the rows and that of its files.
constexpr int kMostCopies = 100;

class Copier {
 public:
  Copier(DataPaths from, DataPaths to, FileSystem& files) : from_(std::move(from)), to_(std::move(to)), files_(files) {}

  // Copies the files that these sessions name, as far as they are not there yet. NOT_FOUND: one of them is gone.
  absl::Status Copy(const std::vector<store::v1::SessionRecord>& sessions) {
    named_.clear();
    for (const store::v1::SessionRecord& session : sessions) {
      if (session.points() > 0) {
        const uint64_t size = session.points() * session.parameters().dimension() * sizeof(double);
        WELLSPACE_RETURN_IF_ERROR(CopyFile(from_.points(session.name()), to_.points(session.name()), size));
      }
      if (session.has_mesh()) {
        const uint64_t revision = session.mesh().revision();
        WELLSPACE_RETURN_IF_ERROR(LinkOrCopy(from_.mesh(session.name(), revision), to_.mesh(session.name(), revision),
                                             session.mesh().size()));
      }
    }
    return absl::OkStatus();
  }

  // Removes what an earlier round has copied, and the last one does not name.
  absl::Status RemoveOthers() {
    for (auto copied = copied_.begin(); copied != copied_.end();) {
      if (named_.contains(copied->first)) {
        ++copied;
        continue;
      }
      WELLSPACE_RETURN_IF_ERROR(files_.Remove(copied->first));
      copied = copied_.erase(copied);
    }
    return absl::OkStatus();
  }

 private:
  absl::Status LinkOrCopy(const std::string& from, const std::string& to, uint64_t size) {
    named_.insert(to);
    if (copied_.contains(to)) {
      return absl::OkStatus();
    }
    const absl::Status linked = files_.Link(from, to);
    if (linked.ok()) {
      copied_[to] = size;
      return linked;
    }
    return linked.code() == absl::StatusCode::kNotFound ? linked : CopyFile(from, to, size);
  }

  // Copies the first `size` bytes, but for those that were copied in an earlier round: they are the same.
  absl::Status CopyFile(const std::string& from, const std::string& to, uint64_t size) {
    named_.insert(to);
    uint64_t& done = copied_[to];
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> source, files_.Open(from, FileSystem::Mode::kRead));
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> target, files_.Open(to, FileSystem::Mode::kCreateOrWrite));
    std::vector<char> block(kCopyBytes);
    while (done < size) {
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

  const DataPaths from_;
  const DataPaths to_;
  FileSystem& files_;
  std::map<std::string, uint64_t> copied_;  // bytes, by path
  std::set<std::string> named_;             // paths
};

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
  FileSystem& files = *options.files;
  const DataPaths from_paths{folder};
  const DataPaths to_paths{to};
  SessionTablesOptions read_only = options.tables;
  read_only.is_read_only = true;
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(from_paths.database(), read_only));
  // Its lock keeps a server from being started with half of the copy.
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<DataFolder> target, DataFolder::Open(to, files));
  WELLSPACE_RETURN_IF_ERROR(CheckEmpty(to_paths, files));

  Copier copier(from_paths, to_paths, files);
  absl::Status copied;
  for (int round = 0; round < kMostCopies; ++round) {
    WELLSPACE_RETURN_IF_ERROR(tables->BackUp(to_paths.database(), options.tables));
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SessionTables> copy,
                               SessionTables::Open(to_paths.database(), read_only));
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<store::v1::SessionRecord> sessions, copy->ReadStates());
    copied = copier.Copy(sessions);
    if (copied.code() != absl::StatusCode::kNotFound) {
      break;
    }
  }
  if (copied.code() == absl::StatusCode::kNotFound) {
    return absl::DataLossError(absl::StrCat(std::string(copied.message()), "; check the folder that is backed up"));
  }
  WELLSPACE_RETURN_IF_ERROR(copied);
  WELLSPACE_RETURN_IF_ERROR(copier.RemoveOthers());
  WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(to_paths.files()));
  WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(to));
  WELLSPACE_ASSIGN_OR_RETURN(DataReport report, CheckData(to, options));
  if (!report.is_whole()) {
    return absl::DataLossError(absl::StrCat("the copy is not whole: ", report.problems.front()));
  }
  return report;
}

}  // namespace wellspace::server
