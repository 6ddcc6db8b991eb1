// Folders of the server, and what its database says, which are not for clients to know: errors that leave the server
// have names of files without the folders. The log has the whole message.
#ifndef WELLSPACE_SERVER_WIRE_HIDDEN_FOLDERS_H_
#define WELLSPACE_SERVER_WIRE_HIDDEN_FOLDERS_H_

#include <string>
#include <string_view>

namespace wellspace::server {

// From now on WithoutFolders leaves `folder` out, as it is given here and as an absolute path. Of the root, nothing.
//
// Threads:    of this and the following: thread-safe.
void HideFolder(const std::string& folder);

// Stands in a message before what a database has said: names of machines, roles and tables.
inline constexpr std::string_view kDatabaseSays = "; the database says: ";

// `message` where "FOLDER/NAME" is "NAME", and the folder alone "the folder of sessions"; it ends before kDatabaseSays.
//
// Complexity: O(folders · bytes).
std::string WithoutFolders(std::string_view message);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_WIRE_HIDDEN_FOLDERS_H_
