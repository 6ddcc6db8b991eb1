#include "server/store/data_folder.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::server {
namespace {

constexpr std::string_view kPrefix = "sessions/";
constexpr std::string_view kPoints = ".points";
constexpr std::string_view kMesh = ".mesh-";

constexpr std::string_view kHexDigits = "0123456789abcdef";
constexpr std::string_view kDigits = "0123456789";

bool HasOnly(std::string_view text, std::string_view digits) {
  return !text.empty() && text.find_first_not_of(digits) == std::string_view::npos;
}

// What the names of a session's files begin with: the digits of its name; of a name that is not as the server gives
// them, all of it in hexadecimal behind an x.
std::string StemOf(const std::string& session) {
  if (session.starts_with(kPrefix)) {
    const std::string id = session.substr(kPrefix.size());
    if (HasOnly(id, kHexDigits)) {
      return id;
    }
  }
  return absl::StrCat("x", absl::BytesToHexString(session));
}

absl::Status WithAdvice(const absl::Status& status) {
  if (status.code() != absl::StatusCode::kPermissionDenied) {
    return status;
  }
  return absl::PermissionDeniedError(absl::StrCat(
      std::string(status.message()), "; the folder has to be writable for the user that the server runs as"));
}

}  // namespace

std::string DataPaths::points(const std::string& session, uint64_t number) const {
  const std::string first = absl::StrCat(files(), "/", StemOf(session), std::string(kPoints));
  return number == 0 ? first : absl::StrCat(first, "-", number);
}

std::string DataPaths::mesh(const std::string& session, uint64_t revision) const {
  return absl::StrCat(files(), "/", StemOf(session), std::string(kMesh), revision);
}

bool IsNameOfOurs(const std::string& name) {
  const size_t dot = name.find('.');
  if (dot == std::string::npos) {
    return false;
  }
  std::string_view stem(name.data(), dot);
  std::string_view end(name.data() + dot, name.size() - dot);
  if (stem.starts_with('x')) {
    stem.remove_prefix(1);
  }
  if (!HasOnly(stem, kHexDigits)) {
    return false;
  }
  if (end == kPoints) {
    return true;
  }
  if (end.starts_with(kPoints)) {
    end.remove_prefix(kPoints.size());
    return end.starts_with('-') && HasOnly(end.substr(1), kDigits);
  }
  if (!end.starts_with(kMesh)) {
    return false;
  }
  end.remove_prefix(kMesh.size());
  if (end.ends_with(kTemporaryEnd)) {
    end.remove_suffix(kTemporaryEnd.size());
  }
  return HasOnly(end, kDigits);
}

std::vector<std::string> FilesOf(const DataPaths& paths, const store::v1::SessionRecord& session) {
  std::vector<std::string> named;
  if (session.points() > 0) {
    named.push_back(paths.points(session.name(), session.points_file()));
  }
  if (session.has_mesh()) {
    named.push_back(paths.mesh(session.name(), session.mesh().revision()));
  }
  return named;
}

absl::StatusOr<std::vector<std::string>> FindUnknown(const DataPaths& paths, FileSystem& files) {
  static constexpr std::array<std::string_view, 7> kKnown = {
      "lock", "back-up.lock", "files", "sessions.db", "sessions.db-journal", "sessions.db-shm", "sessions.db-wal"};
  std::vector<std::string> unknown;
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> names, files.List(paths.root));
  for (const std::string& name : names) {
    if (std::ranges::find(kKnown, name) == kKnown.end()) {
      unknown.push_back(absl::StrCat(paths.root, "/", name));
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> inner, files.List(paths.files()));
  for (const std::string& name : inner) {
    if (!IsNameOfOurs(name)) {
      unknown.push_back(absl::StrCat(paths.files(), "/", name));
    }
  }
  std::ranges::sort(unknown);
  return unknown;
}

absl::StatusOr<std::unique_ptr<DataFolder>> DataFolder::Open(const std::string& root, FileSystem& files) {
  std::unique_ptr<DataFolder> folder(new DataFolder(DataPaths{root}, files));
  WELLSPACE_RETURN_IF_ERROR(WithAdvice(files.CreateFolder(root)));
  auto lock = files.Lock(folder->paths_.lock());
  if (lock.status().code() == absl::StatusCode::kAborted) {
    return absl::FailedPreconditionError(
        absl::StrCat(root, ": process ", std::string(lock.status().message()),
                     " has this folder in use; stop it first, or name another folder"));
  }
  if (!lock.ok()) {
    return WithAdvice(lock.status());
  }
  folder->lock_ = *std::move(lock);
  WELLSPACE_RETURN_IF_ERROR(WithAdvice(files.CreateFolder(folder->paths_.files())));
  WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(folder->paths_.files()));
  WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(root));
  // The name of the folder itself. Those above may be closed to this user, who has then not made it either.
  const std::filesystem::path path(root);
  const std::string parent = (path.has_filename() ? path : path.parent_path()).parent_path().string();
  if (const absl::Status named = files.SynchronizeFolder(parent.empty() ? "." : parent);
      !named.ok() && named.code() != absl::StatusCode::kPermissionDenied) {
    return named;
  }
  return folder;
}

absl::StatusOr<Garbage> DataFolder::RemoveGarbage(
    FilesInUse& in_use, const std::function<absl::StatusOr<std::vector<store::v1::SessionRecord>>()>& read_sessions) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> names, files_.List(paths_.files()));
  // Uses keep what is written in these places from now on: only what was there before becomes obsolete.
  std::map<std::string, std::unique_ptr<FilesInUse::Use>> candidates;  // by path
  for (const std::string& name : names) {
    const std::string path = absl::StrCat(paths_.files(), "/", name);
    if (IsNameOfOurs(name) && !in_use.Contains(path)) {
      candidates.emplace(path, in_use.Take(path, /*is_written=*/false));
    }
  }
  // After that, so that what has come to be named meanwhile is seen.
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<store::v1::SessionRecord> sessions, read_sessions());
  for (const store::v1::SessionRecord& session : sessions) {
    candidates.erase(paths_.points(session.name(), session.points_file()));  // points may be on their way
    candidates.erase(paths_.mesh(session.name(), session.mesh().revision()));
  }
  std::set<std::string> obsolete;
  for (const auto& [path, use] : candidates) {
    use->MakeObsolete();
    obsolete.insert(path);
  }
  candidates.clear();
  // A back-up keeps them, or another has begun to write in their place.
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> left, files_.List(paths_.files()));
  for (const std::string& name : left) {
    obsolete.erase(absl::StrCat(paths_.files(), "/", name));
  }
  Garbage sweep;
  sweep.removed.assign(obsolete.begin(), obsolete.end());
  WELLSPACE_ASSIGN_OR_RETURN(sweep.unknown, FindUnknown(paths_, files_));
  return sweep;
}

}  // namespace wellspace::server
