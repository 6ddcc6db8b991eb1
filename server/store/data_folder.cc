#include "server/store/data_folder.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/write_ahead_log.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr std::string_view kPrefix = "sessions/";
constexpr std::string_view kPoints = ".points";
constexpr std::string_view kMesh = ".mesh";

constexpr std::string_view kHexDigits = "0123456789abcdef";
constexpr std::string_view kDigits = "0123456789";

// Names in a folder that may not be there.
absl::StatusOr<std::vector<std::string>> ListIfThere(FileSystem& files, const std::string& folder) {
  absl::StatusOr<std::vector<std::string>> names = files.List(folder);
  if (names.status().code() == absl::StatusCode::kNotFound) {
    return std::vector<std::string>();
  }
  return names;
}

bool HasOnly(std::string_view text, std::string_view digits) {
  return !text.empty() && text.find_first_not_of(digits) == std::string_view::npos;
}

// The beginning of the names of a session's files: the digits of its name; of a name that is not as the server gives
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

std::string DataPaths::points(const std::string& session, const store::v1::PointsFile& file) const {
  const std::string first = absl::StrCat(files(), "/", StemOf(session), std::string(kPoints));
  const std::string begun = file.number() == 0 && file.epoch() == 0 ? first : absl::StrCat(first, "-", file.number());
  return file.epoch() == 0 ? begun : absl::StrCat(begun, "-", file.epoch());
}

std::string DataPaths::mesh(const std::string& session, uint64_t revision, uint64_t epoch) const {
  const std::string name = absl::StrCat(files(), "/", StemOf(session), std::string(kMesh), "-", revision);
  return epoch == 0 ? name : absl::StrCat(name, "-", epoch);
}

std::optional<uint64_t> EpochOfName(const std::string& name) {
  const size_t dot = name.find('.');
  if (dot == std::string::npos) {
    return std::nullopt;
  }
  std::string_view stem(name.data(), dot);
  std::string_view end(name.data() + dot, name.size() - dot);
  if (stem.starts_with('x')) {
    stem.remove_prefix(1);
  }
  const bool is_mesh = end.starts_with(kMesh);
  if (!HasOnly(stem, kHexDigits) || !(is_mesh || end.starts_with(kPoints))) {
    return std::nullopt;
  }
  end.remove_prefix((is_mesh ? kMesh : kPoints).size());
  if (is_mesh && end.ends_with(kTemporaryEnd)) {
    end.remove_suffix(kTemporaryEnd.size());
  }
  // A revision and an epoch, each behind a hyphen.
  std::vector<uint64_t> numbers;
  while (end.starts_with('-')) {
    const std::string digits(end.substr(1, end.find('-', 1) - 1));
    if (!HasOnly(digits, kDigits) || !absl::SimpleAtoi(digits, &numbers.emplace_back())) {
      return std::nullopt;
    }
    end.remove_prefix(1 + digits.size());
  }
  if (!end.empty() || numbers.size() > 2 || (is_mesh && numbers.empty())) {
    return std::nullopt;
  }
  return numbers.size() == 2 ? numbers[1] : 0;
}

std::optional<absl::Time> FoundAt(const std::string& lost_name) {
  const size_t dot = lost_name.rfind('.');
  int64_t seconds = 0;
  if (dot == std::string::npos || !IsNameOfOurs(lost_name.substr(0, dot)) ||
      !HasOnly(std::string_view(lost_name).substr(dot + 1), kDigits) ||
      !absl::SimpleAtoi(lost_name.substr(dot + 1), &seconds)) {
    return std::nullopt;
  }
  return absl::FromUnixSeconds(seconds);
}

std::vector<std::string> FilesOf(const DataPaths& paths, const store::v1::SessionRecord& session) {
  std::vector<std::string> named;
  for (const store::v1::PointsFile& file : PointsFilesOf(session)) {
    named.push_back(paths.points(session.name(), file));
  }
  if (session.has_mesh()) {
    named.push_back(paths.mesh(session.name(), session.mesh().revision(), session.mesh().epoch()));
  }
  return named;
}

absl::StatusOr<std::vector<std::string>> FindUnknown(const DataPaths& paths, FileSystem& files) {
  static constexpr std::array<std::string_view, 12> kKnown = {"lock",
                                                              "back-up.lock",
                                                              "ballast",
                                                              "files",
                                                              "lost",
                                                              "store",
                                                              "sessions.db",
                                                              "sessions.db-journal",
                                                              "sessions.db-shm",
                                                              "sessions.db-wal",
                                                              "sessions.db-mark",
                                                              "sessions.db.moved"};
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
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> lost, ListIfThere(files, paths.lost()));
  for (const std::string& name : lost) {
    if (!FoundAt(name).has_value()) {
      unknown.push_back(absl::StrCat(paths.lost(), "/", name));
    }
  }
  std::ranges::sort(unknown);
  return unknown;
}

absl::StatusOr<std::unique_ptr<DataFolder>> DataFolder::Open(const std::string& root, FileSystem& files) {
  std::unique_ptr<DataFolder> folder(new DataFolder(DataPaths{root}, files));
  WELLSPACE_RETURN_IF_ERROR(WithAdvice(files.CreateFolder(root)));
  auto folder_lock = files.LockFolder(root);
  auto lock = files.Lock(folder->paths_.lock());
  for (const absl::Status& status : {lock.status(), folder_lock.status()}) {
    if (status.code() == absl::StatusCode::kAborted) {
      const std::string holder(status.message());
      return absl::FailedPreconditionError(
          absl::StrCat(root, holder.empty() ? std::string(": another process") : ": process " + holder,
                       " has this folder in use; stop it first, or name another folder"));
    }
    if (!status.ok()) {
      return WithAdvice(status);
    }
  }
  folder->folder_lock_ = *std::move(folder_lock);
  folder->lock_ = *std::move(lock);
  WELLSPACE_RETURN_IF_ERROR(MakeFiles(folder->paths_, files));
  return folder;
}

absl::StatusOr<std::unique_ptr<DataFolder>> DataFolder::OpenShared(const std::string& root, FileSystem& files) {
  std::unique_ptr<DataFolder> folder(new DataFolder(DataPaths{root}, files));
  WELLSPACE_RETURN_IF_ERROR(WithAdvice(files.CreateFolder(root)));
  WELLSPACE_RETURN_IF_ERROR(MakeFiles(folder->paths_, files));
  return folder;
}

absl::Status DataFolder::MakeFiles(const DataPaths& paths, FileSystem& files) {
  WELLSPACE_RETURN_IF_ERROR(WithAdvice(files.CreateFolder(paths.files())));
  // The name of the folder itself; the names in it are synchronised once the database is there. Folders above it may be
  // closed to this user, who has then not made it either.
  const std::filesystem::path path(paths.root);
  const std::string parent = (path.has_filename() ? path : path.parent_path()).parent_path().string();
  const absl::Status named = files.SynchronizeFolder(parent.empty() ? "." : parent);
  return named.code() == absl::StatusCode::kPermissionDenied ? absl::OkStatus() : named;
}

absl::StatusOr<bool> DataFolder::FindDatabase() {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<std::string> names, files_.List(paths_.files()));
  std::erase_if(names, [](const std::string& name) { return !IsNameOfOurs(name); });
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> root, files_.List(paths_.root));
  const auto size_of = [&](const std::string& path) -> absl::StatusOr<uint64_t> {
    if (std::ranges::none_of(root, [&](const std::string& name) { return path.ends_with("/" + name); })) {
      return 0;
    }
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, files_.Open(path, FileSystem::Mode::kRead));
    return file->Size();
  };
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t size, size_of(paths_.database()));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t log_size, size_of(LogPathOf(paths_.database())));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t mark_size, size_of(MarkPathOf(paths_.database())));
  // The mark is made after the tables, the log after the database.
  const bool may_be_new = names.empty() && mark_size == 0;
  if (size > 0) {
    return may_be_new;
  }
  if (!may_be_new || log_size > 0) {
    const std::string there = names.empty()
                                  ? (log_size > 0 ? LogPathOf(paths_.database()) : MarkPathOf(paths_.database()))
                                  : absl::StrCat("files of sessions in ", paths_.files(), " (", names.size(), ")");
    return MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                     absl::StrCat(paths_.database(),
                                  ": the database is missing or empty, and there is what belongs to "
                                  "one: ",
                                  there, "; put the database back, or restore a back-up"));
  }
  // Its name is there before anything that belongs to it, also after a loss of power.
  WELLSPACE_RETURN_IF_ERROR(files_.Open(paths_.database(), FileSystem::Mode::kCreateOrWrite).status());
  WELLSPACE_RETURN_IF_ERROR(files_.SynchronizeFolder(paths_.root));
  return true;
}

absl::StatusOr<Garbage> DataFolder::RemoveGarbage(FilesInUse& in_use, const std::function<bool(uint64_t epoch)>& is_own,
                                                  const Files::ReadCensus& read, absl::Time now) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> names, files_.List(paths_.files()));
  // Uses keep files written in these places from now on: only those there before become obsolete.
  Candidates candidates;
  for (const std::string& name : names) {
    if (!IsNameOfOurs(name)) {
      continue;
    }
    if (auto use = in_use.TakeUnlessUsed(absl::StrCat(paths_.files(), "/", name))) {
      candidates.emplace(name, std::move(use));
    }
  }
  // After that, so that files that have come to be named meanwhile are seen.
  WELLSPACE_ASSIGN_OR_RETURN(const Census census, read());
  for (const store::v1::SessionRecord& session : census.sessions) {
    for (const std::string& path : FilesOf(paths_, session)) {
      candidates.erase(path.substr(paths_.files().size() + 1));
    }
  }
  std::erase_if(candidates, [&](const auto& candidate) {
    const uint64_t epoch = EpochOfName(candidate.first).value_or(0);
    return epoch >= census.oldest_epoch && !is_own(epoch);
  });
  Garbage sweep;
  WELLSPACE_ASSIGN_OR_RETURN(sweep.set_aside, SetAside(std::move(candidates), now));
  if (has_collected_.exchange(true)) {
    WELLSPACE_ASSIGN_OR_RETURN(sweep.removed, RemoveLost(now));
  }
  WELLSPACE_ASSIGN_OR_RETURN(sweep.unknown, FindUnknown(paths_, files_));
  return sweep;
}

absl::StatusOr<std::vector<Garbage::SetAside>> DataFolder::SetAside(Candidates candidates, absl::Time now) {
  std::vector<Garbage::SetAside> moved;
  if (candidates.empty()) {
    return moved;
  }
  WELLSPACE_RETURN_IF_ERROR(files_.CreateFolder(paths_.lost()));
  WELLSPACE_RETURN_IF_ERROR(files_.SynchronizeFolder(paths_.root));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> lost, files_.List(paths_.lost()));
  const std::set<std::string> taken(lost.begin(), lost.end());
  std::map<std::string, std::string> targets;  // by name
  for (const auto& [name, use] : candidates) {
    int64_t seconds = absl::ToUnixSeconds(now);
    const auto target = [&] { return absl::StrCat(name, ".", seconds); };
    while (taken.contains(target())) {
      ++seconds;
    }
    targets[name] = target();
    use->SetAside(absl::StrCat(paths_.lost(), "/", target()));
  }
  candidates.clear();
  // A back-up keeps them, or another has begun to write in their place.
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> left, files_.List(paths_.files()));
  for (const std::string& name : left) {
    targets.erase(name);
  }
  for (const auto& [name, target] : targets) {
    moved.push_back({.from = absl::StrCat(paths_.files(), "/", name), .to = absl::StrCat(paths_.lost(), "/", target)});
  }
  return moved;
}

absl::StatusOr<std::vector<std::string>> DataFolder::RemoveLost(absl::Time now) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> lost, ListIfThere(files_, paths_.lost()));
  std::vector<std::string> removed;
  for (const std::string& name : lost) {
    const std::optional<absl::Time> found = FoundAt(name);
    if (!found.has_value() || now - *found < kKeptLost) {
      continue;
    }
    removed.push_back(absl::StrCat(paths_.lost(), "/", name));
    WELLSPACE_RETURN_IF_ERROR(files_.Remove(removed.back()));
  }
  std::ranges::sort(removed);
  return removed;
}

}  // namespace wellspace::server
