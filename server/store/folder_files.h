// Points and meshes as files in a folder.
#ifndef WELLSPACE_SERVER_STORE_FOLDER_FILES_H_
#define WELLSPACE_SERVER_STORE_FOLDER_FILES_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/base/options.h"
#include "server/store/chunk_buffers.h"
#include "server/store/data_folder.h"
#include "server/store/file_system.h"
#include "server/store/files.h"
#include "server/store/files_in_use.h"
#include "server/store/store_health.h"
#include "server/store/written_files.h"

namespace wellspace::server {

struct FolderFilesOptions {
  FileSystem* files = &PosixFileSystem();  // outlives the points and meshes, too
  absl::Time (*now)() = &absl::Now;        // the clock by which files in lost/ have their day
  uint64_t max_written_files = 256;        // open at once until they are synchronised; more uploads end with DISK_FULL
  uint64_t max_mesh_chunk_bytes = kMaxResponseBytes;  // other ones: for tests
};

// The files of a data folder.
//
// Thread safety: that of Files.
// Invariants: a file is synchronised before a record may name it.
class FolderFiles final : public Files {
 public:
  // Errors:     those of FileSystem::OpenFolder.
  static absl::StatusOr<std::unique_ptr<FolderFiles>> Open(std::shared_ptr<DataFolder> folder,
                                                           std::shared_ptr<StoreHealth> health,
                                                           const FolderFilesOptions& options);

  std::unique_ptr<PointStore> OpenPoints(SessionPoints points) override;
  void DropPoints(const std::string& session, const store::v1::PointsFile& file) override;
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& session, uint64_t revision, uint64_t epoch,
                                                         core::Mesh mesh, const core::RunContext& context) override;
  std::shared_ptr<MeshSnapshot> FindMesh(const store::v1::SessionRecord& record) override;
  void RemoveAll(const store::v1::SessionRecord& deleted) override;
  absl::StatusOr<Garbage> RemoveGarbage(const ReadCensus& read) override;

 private:
  FolderFiles(std::shared_ptr<DataFolder> folder, std::shared_ptr<StoreHealth> health,
              const FolderFilesOptions& options, std::unique_ptr<Folder> files_folder);

  const DataPaths& paths() const { return folder_->paths(); }
  // From now on files of this epoch are decided here.
  void NoteOwn(uint64_t epoch);

  FileSystem& files_;
  absl::Time (*const now_)();
  const uint64_t max_mesh_chunk_bytes_;
  const std::shared_ptr<DataFolder> folder_;
  const std::shared_ptr<StoreHealth> health_;
  const std::shared_ptr<FilesInUse> in_use_;
  const std::shared_ptr<WrittenFiles> written_;
  const std::shared_ptr<ChunkBuffers> buffers_ = std::make_shared<ChunkBuffers>();
  std::mutex mutex_;
  std::set<uint64_t> own_epochs_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_FOLDER_FILES_H_
