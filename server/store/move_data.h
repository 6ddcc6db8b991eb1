// Records of sessions that move between a folder and PostgreSQL. Points and meshes stay in the folder.
#ifndef WELLSPACE_SERVER_STORE_MOVE_DATA_H_
#define WELLSPACE_SERVER_STORE_MOVE_DATA_H_

#include <string>

#include "absl/status/status.h"
#include "server/store/postgres_options.h"

namespace wellspace::server {

// Moves all records of `folder` from its own database into PostgreSQL, which has none; servers are to be started with
// both from then on. No server may serve the folder meanwhile. The file of the folder's own database is kept beside it,
// as sessions.db.moved.
//
// Guarantees: at every moment exactly one of the two databases is taken by servers, and has all records. What was
//             interrupted is simply repeated.
// Complexity: O(bytes of records), of which those of one session are held.
// Errors:     NOT_FOUND: the folder has no database of its own. FAILED_PRECONDITION: the folder is in use, or belongs
//             to another database; this one has sessions, or the files of another folder, or servers. FILE_DAMAGED.
//             Others of a FileSystem, of SessionTables and of PostgresLink.
absl::Status MoveToPostgres(const std::string& folder, const PostgresOptions& database);

// The way back: into a database in the folder. No server may be running at the other. Its schema is kept there, under
// the name wellspace_moved_EPOCH, so that servers that stood still meanwhile find nothing that they could change.
//
// Guarantees: as above.
// Errors:     as above; FAILED_PRECONDITION: the folder is not that of the database, or servers have sessions there.
absl::Status MoveToFolder(const PostgresOptions& database, const std::string& folder);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MOVE_DATA_H_
