#include "server/wire/hidden_folders.h"

#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <system_error>

#include "absl/strings/ascii.h"

namespace wellspace::server {
namespace {

struct HiddenFolders {
  std::mutex mutex;
  std::set<std::string, std::greater<>> folders;  // without a slash at the end; those within others before these
};

HiddenFolders& Hidden() {
  static HiddenFolders hidden;
  return hidden;
}

// Whether the character may be of the name of a file that goes on.
bool IsOfName(char c) { return absl::ascii_isalnum(c) || c == '_' || c == '-' || c == '.' || c == '/'; }

std::string CutFolder(const std::string& folder, std::string_view message) {
  std::string text;
  for (size_t at = 0; at < message.size();) {
    const size_t found = message.find(folder, at);
    const size_t end = found + folder.size();
    if (found == std::string_view::npos) {
      return text.append(message.substr(at));
    }
    text.append(message.substr(at, found - at));
    const bool is_whole = found == 0 || !IsOfName(message[found - 1]);
    if (is_whole && end < message.size() && message[end] == '/') {
      at = end + 1;
    } else if (is_whole && (end == message.size() || !IsOfName(message[end]))) {
      text.append("the folder of sessions");
      at = end;
    } else {
      text.push_back(message[found]);
      at = found + 1;
    }
  }
  return text;
}

}  // namespace

void HideFolder(const std::string& folder) {
  std::error_code error;
  const std::string absolute = std::filesystem::absolute(folder, error).lexically_normal().string();
  HiddenFolders& hidden = Hidden();
  const std::lock_guard lock(hidden.mutex);
  for (std::string path : {folder, absolute}) {
    while (path.ends_with('/')) {
      path.pop_back();
    }
    if (path.starts_with('/')) {
      hidden.folders.insert(path);
    }
  }
}

std::string WithoutFolders(std::string_view message) {
  std::string text(message.substr(0, message.find(kDatabaseSays)));
  HiddenFolders& hidden = Hidden();
  const std::lock_guard lock(hidden.mutex);
  for (const std::string& folder : hidden.folders) {
    text = CutFolder(folder, text);
  }
  return text;
}

}  // namespace wellspace::server
