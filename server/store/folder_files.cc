#include "server/store/folder_files.h"

#include <utility>

#include "core/base/status_macros.h"
#include "server/store/joined_points.h"
#include "server/store/mesh_file.h"
#include "server/store/point_file.h"

namespace wellspace::server {
namespace {

// Whether files may be removed. Not after a failure: the change that was under way may have been written down, and name
// files that its owner believes to be obsolete. Not during a back-up: its copy of the rows names old files. Nor
// when it is not known whether there is one, as without descriptors.
bool MayRemove(const StoreHealth& health, const DataPaths& paths, FileSystem& files) {
  const auto may_be_locked = [](const auto& lock) {
    return lock.status().code() == absl::StatusCode::kAborted ||
           lock.status().code() == absl::StatusCode::kResourceExhausted;
  };
  return health.Check().ok() && !may_be_locked(files.Lock(paths.back_up_lock())) &&
         !may_be_locked(files.LockFolder(paths.files()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<FolderFiles>> FolderFiles::Open(std::shared_ptr<DataFolder> folder,
                                                               std::shared_ptr<StoreHealth> health,
                                                               const FolderFilesOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Folder> files_folder, options.files->OpenFolder(folder->paths().files()));
  return std::unique_ptr<FolderFiles>(
      new FolderFiles(std::move(folder), std::move(health), options, std::move(files_folder)));
}

FolderFiles::FolderFiles(std::shared_ptr<DataFolder> folder, std::shared_ptr<StoreHealth> health,
                         const FolderFilesOptions& options, std::unique_ptr<Folder> files_folder)
    : files_(*options.files),
      now_(options.now),
      max_mesh_chunk_bytes_(options.max_mesh_chunk_bytes),
      folder_(std::move(folder)),
      health_(std::move(health)),
      in_use_(std::make_shared<FilesInUse>(files_, [health = health_, paths = folder_->paths(),
                                                    files = &files_] { return MayRemove(*health, paths, *files); })),
      written_(std::make_shared<WrittenFiles>(std::move(files_folder), options.max_written_files)) {}

void FolderFiles::NoteOwn(uint64_t epoch) {
  const std::lock_guard lock(mutex_);
  own_epochs_.insert(epoch);
}

std::unique_ptr<PointStore> FolderFiles::OpenPoints(SessionPoints points) {
  NoteOwn(points.next.epoch());
  // A file that no change names yet is not garbage, and that of a deleted session stays for calls that still have it:
  // they are to find that the session is gone, and no damage.
  const auto open = [&](const store::v1::PointsFile& file, bool is_written,
                        std::vector<store::v1::StepRecord::Points> committed) {
    std::string path = paths().points(points.session, file);
    std::unique_ptr<FilesInUse::Use> use = in_use_->Take(path, is_written && committed.empty());
    return std::make_unique<PointFile>(files_, health_, is_written ? written_ : nullptr, std::move(path),
                                       points.dimension, std::move(committed), std::move(use));
  };
  return JoinPoints(points, open);
}

void FolderFiles::DropPoints(const std::string& session, const store::v1::PointsFile& file) {
  in_use_->Remove(paths().points(session, file));
}

absl::StatusOr<std::shared_ptr<MeshSnapshot>> FolderFiles::KeepMesh(const std::string& session, uint64_t revision,
                                                                    uint64_t epoch, core::Mesh mesh,
                                                                    const core::RunContext& context) {
  NoteOwn(epoch);
  const std::string path = paths().mesh(session, revision, epoch);
  std::unique_ptr<FilesInUse::Use> use = in_use_->Take(path, /*is_written=*/true);
  // RemoveGarbage is to leave the file alone that has this name first, too.
  const std::unique_ptr<FilesInUse::Use> writing =
      in_use_->Take(path + std::string(kTemporaryEnd), /*is_written=*/true);
  WELLSPACE_ASSIGN_OR_RETURN(
      store::v1::MeshRecord record,
      WriteMeshFile(files_, written_->folder(), *health_, path, revision, mesh, context, max_mesh_chunk_bytes_));
  record.set_epoch(epoch);
  return std::make_shared<MeshFile>(files_, std::move(record), std::move(use), buffers_);
}

std::shared_ptr<MeshSnapshot> FolderFiles::FindMesh(const store::v1::SessionRecord& record) {
  if (!record.has_mesh()) {
    return nullptr;
  }
  const std::string path = paths().mesh(record.name(), record.mesh().revision(), record.mesh().epoch());
  return std::make_shared<MeshFile>(files_, record.mesh(), in_use_->Take(path, /*is_written=*/false), buffers_);
}

void FolderFiles::RemoveAll(const store::v1::SessionRecord& deleted) {
  for (const std::string& path : FilesOf(paths(), deleted)) {
    in_use_->Remove(path);
  }
}

absl::StatusOr<Garbage> FolderFiles::RemoveGarbage(const ReadCensus& read) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  const auto is_own = [this](uint64_t epoch) {
    const std::lock_guard lock(mutex_);
    return own_epochs_.contains(epoch);
  };
  return folder_->RemoveGarbage(*in_use_, is_own, read, now_());
}

}  // namespace wellspace::server
