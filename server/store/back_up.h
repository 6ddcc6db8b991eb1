// Copies of a folder of sessions, while a server serves it.
#ifndef WELLSPACE_SERVER_STORE_BACK_UP_H_
#define WELLSPACE_SERVER_STORE_BACK_UP_H_

#include <string>

#include "absl/status/statusor.h"
#include "server/store/check_data.h"

namespace wellspace::server {

// Copies all sessions of `folder`, as they are at one moment, to the new or empty folder `to`, and checks the copy. A
// server may serve the folder meanwhile; it removes no file until the copy is made. Meshes, which are never written
// again, are linked where both folders are on one disk, and else copied. A server that is started with `to` has these
// sessions.
//
// Complexity: O(bytes); with links, O(bytes of the database and of points), and the check.
// Errors:     FAILED_PRECONDITION: `to` is not empty, in use, or within `folder`, or another back-up of `folder` is
//             under way. FILE_DAMAGED: the write-ahead log of `folder` is. DATA_LOSS: the copy is not whole, since
//             `folder` is not. Others of CheckData, and of a FileSystem. Files copied until then are left.
absl::StatusOr<DataReport> BackUp(const std::string& folder, const std::string& to,
                                  const CheckDataOptions& options = {});

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_BACK_UP_H_
