#include "server/store/durable_log.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "core/base/status_macros.h"
#include "server/store/ballast.h"
#include "server/store/data_folder.h"
#include "server/store/folder_files.h"
#include "server/store/sqlite_records.h"
#include "server/store/store_health.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {
namespace {

// Of the ballast the write-ahead log takes so much, before it is taken over; a batch, and deletions, have the rest.
constexpr uint64_t kBallastPerLog = 4;
constexpr uint64_t kPageBytes = 4096;
constexpr uint64_t kMostBallast = uint64_t{16} << 20;
constexpr uint64_t kDiskPerBallast = 16;
constexpr int kLeastLogPages = 8;

}  // namespace

uint64_t BallastBytesFor(const std::string& folder) {
  std::error_code error;
  std::filesystem::path path = std::filesystem::absolute(folder, error);
  while (!std::filesystem::exists(path, error) && path.has_relative_path()) {
    path = path.parent_path();
  }
  const std::filesystem::space_info space = std::filesystem::space(path, error);
  return error ? kMostBallast : std::min<uint64_t>(kMostBallast, space.capacity / kDiskPerBallast);
}

absl::StatusOr<std::unique_ptr<SessionLog>> OpenDurableLog(const DurableLogOptions& options) {
  HideFolder(options.folder);
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<DataFolder> folder, DataFolder::Open(options.folder, *options.files));
  WELLSPACE_RETURN_IF_ERROR(DataFolder::CheckNotPaired(folder->paths(), *options.files));
  SessionTablesOptions tables_options = options.tables;
  tables_options.files = options.files;
  if (options.ballast_bytes > 0) {
    const auto pages = static_cast<int>(options.ballast_bytes / kBallastPerLog / kPageBytes);
    tables_options.checkpoint_pages = std::min(tables_options.checkpoint_pages, std::max(pages, kLeastLogPages));
  }
  WELLSPACE_ASSIGN_OR_RETURN(tables_options.may_be_new, folder->FindDatabase());
  WELLSPACE_RETURN_IF_ERROR(CheckLog(*options.files, folder->paths().database()));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(folder->paths().database(), tables_options));
  // The names of the write-ahead log, and of its mark.
  WELLSPACE_RETURN_IF_ERROR(options.files->SynchronizeFolder(options.folder));
  const auto ballast = std::make_shared<Ballast>(*options.files, folder->paths().ballast(), options.ballast_bytes);
  ballast->Fill().IgnoreError();  // so that the taking over may have its room
  const auto health = std::make_shared<StoreHealth>(options.on_failure, ballast);
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Files> files,
                             FolderFiles::Open(folder, health,
                                               {.files = options.files,
                                                .now = options.now,
                                                .max_written_files = options.max_written_files,
                                                .max_mesh_chunk_bytes = options.max_mesh_chunk_bytes}));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Records> records,
                             SqliteRecords::Open(std::move(folder), std::move(tables), health, ballast));
  ballast->Fill().IgnoreError();  // without room for it sessions can be read and deleted
  return std::make_unique<SessionLog>(std::move(records), std::move(files));
}

}  // namespace wellspace::server
