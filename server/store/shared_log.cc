#include "server/store/shared_log.h"

#include <utility>

#include "core/base/status_macros.h"
#include "server/store/data_folder.h"
#include "server/store/folder_files.h"
#include "server/store/postgres_records.h"
#include "server/store/store_health.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {

absl::StatusOr<std::unique_ptr<SessionLog>> OpenSharedLog(const SharedLogOptions& options) {
  HideFolder(options.folder);
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<DataFolder> folder,
                             DataFolder::OpenShared(options.folder, PosixFileSystem()));
  const auto health = std::make_shared<StoreHealth>(options.on_failure);
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Files> files,
                             FolderFiles::Open(folder, health, {.max_written_files = options.max_written_files}));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Records> records,
                             PostgresRecords::Open(options.database, std::move(folder), health));
  return std::make_unique<SessionLog>(std::move(records), std::move(files));
}

}  // namespace wellspace::server
