#include "tests/server/store/simulated_disk.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "tests/server/store/simulated_vfs.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kSectorBytes = 512;

std::string FolderOf(const std::string& path) {
  const size_t slash = path.rfind('/');
  return slash == 0 ? "/" : path.substr(0, slash);
}

void Put(std::string& content, uint64_t offset, std::string_view bytes) {
  if (content.size() < offset + bytes.size()) {
    content.resize(offset + bytes.size());
  }
  content.replace(offset, bytes.size(), bytes);
}

}  // namespace

class SimulatedFile final : public File {
 public:
  SimulatedFile(SimulatedDisk& disk, std::string path, SimulatedDisk::Entry inode)
      : disk_(disk), path_(std::move(path)), inode_(std::move(inode)) {}

  absl::StatusOr<uint64_t> ReadAt(uint64_t offset, std::span<char> bytes) const override {
    WELLSPACE_RETURN_IF_ERROR(disk_.Begin("read", path_, /*is_read=*/true));
    const std::string& content = inode_->content;
    if (offset >= content.size()) {
      return 0;
    }
    return content.copy(bytes.data(), bytes.size(), offset);
  }
  absl::Status WriteAt(uint64_t offset, std::span<const char> bytes) override {
    return disk_.Write(*inode_, path_, offset, bytes);
  }
  absl::Status Truncate(uint64_t size) override { return disk_.Truncate(*inode_, path_, size); }
  absl::StatusOr<uint64_t> Size() const override { return inode_->content.size(); }
  absl::Status Synchronize() override { return disk_.Synchronize(*inode_, path_); }

 private:
  SimulatedDisk& disk_;
  const std::string path_;
  const SimulatedDisk::Entry inode_;
};

class SimulatedFiles final : public FileSystem {
 public:
  explicit SimulatedFiles(SimulatedDisk& disk) : disk_(disk) {}

  absl::StatusOr<std::unique_ptr<File>> Open(const std::string& path, Mode mode) override {
    WELLSPACE_ASSIGN_OR_RETURN(SimulatedDisk::Entry inode, disk_.Open(path, mode));
    return std::make_unique<SimulatedFile>(disk_, path, std::move(inode));
  }
  absl::Status Rename(const std::string& from, const std::string& to) override { return disk_.Rename(from, to); }
  absl::Status Remove(const std::string& path) override { return disk_.Remove(path); }
  absl::Status Link(const std::string& from, const std::string& to) override { return disk_.Link(from, to); }
  absl::StatusOr<std::vector<std::string>> List(const std::string& folder) override { return disk_.List(folder); }
  absl::Status CreateFolder(const std::string& folder) override { return disk_.CreateFolder(folder); }
  absl::Status SynchronizeFolder(const std::string& folder) override { return disk_.SynchronizeFolder(folder); }
  absl::StatusOr<std::unique_ptr<FileLock>> LockFolder(const std::string& folder) override {
    WELLSPACE_RETURN_IF_ERROR(disk_.Begin("lock", folder));
    return std::make_unique<FileLock>();
  }
  absl::StatusOr<std::unique_ptr<FileLock>> Lock(const std::string& path) override {
    WELLSPACE_RETURN_IF_ERROR(disk_.Begin("lock", path));
    return std::make_unique<FileLock>();
  }

 private:
  SimulatedDisk& disk_;
};

SimulatedDisk::SimulatedDisk() : files_(std::make_unique<SimulatedFiles>(*this)) {
  vfs_name_ = absl::StrCat("simulated-", absl::Hex(reinterpret_cast<uintptr_t>(this)));
  SimulatedVfs::Register(*this);
}

SimulatedDisk::~SimulatedDisk() { sqlite3_vfs_unregister(&vfs_); }

FileSystem& SimulatedDisk::files() { return *files_; }

void SimulatedDisk::FailAt(uint64_t operation, Fault fault, uint64_t count) {
  fails_at_ = operation;
  fault_ = fault;
  fail_count_ = count;
  has_failed_ = false;
}

absl::Status SimulatedDisk::Begin(const std::string& what, const std::string& path, bool is_read) {
  is_short_write_ = false;
  if (is_read && !counts_reads_ && !is_dead()) {
    return absl::OkStatus();
  }
  const uint64_t number = operations_++;
  if (dies_at_.has_value() && number >= *dies_at_) {
    if (number == *dies_at_) {
      failed_operation_ = absl::StrCat(what, " ", path);
    }
    return absl::UnavailableError(path + ": the machine has no power");
  }
  const bool is_of_reads = fault_ == Fault::kBroken || fault_ == Fault::kForbidden;
  if (number < fails_at_ || number - fails_at_ >= fail_count_ || (is_read && !is_of_reads) ||
      (fault_ == Fault::kNoRoom && what != "write") || (fault_ == Fault::kForbidden && what != "open")) {
    return absl::OkStatus();
  }
  if (!has_failed_) {
    failed_operation_ = absl::StrCat(what, " ", path);
  }
  has_failed_ = true;
  if (fault_ == Fault::kForbidden) {
    return absl::PermissionDeniedError(path + ": cannot be opened: Permission denied");
  }
  if (fault_ == Fault::kBroken) {
    return absl::UnavailableError(path + ": Input/output error");
  }
  is_short_write_ = fault_ == Fault::kShortWrite && what == "write";
  return absl::ResourceExhaustedError(path + ": No space left on device");
}

absl::StatusOr<SimulatedDisk::Entry> SimulatedDisk::Open(const std::string& path, FileSystem::Mode mode) {
  WELLSPACE_RETURN_IF_ERROR(Begin("open", path, mode == FileSystem::Mode::kRead));
  const auto found = names_.find(path);
  if (found != names_.end()) {
    return found->second;
  }
  if (mode != FileSystem::Mode::kCreateOrWrite || !names_.contains(FolderOf(path))) {
    return absl::NotFoundError(path + ": No such file or directory");
  }
  auto inode = std::make_shared<Inode>();
  ChangeNames({.folder = FolderOf(path), .entries = {{path, inode}}});
  return inode;
}

absl::Status SimulatedDisk::Write(Inode& inode, const std::string& path, uint64_t offset, std::span<const char> bytes) {
  absl::Status begun = Begin("write", path);
  const uint64_t end = offset + bytes.size();
  if (begun.ok() && end > inode.content.size() && UsedBytes() + end - inode.content.size() > most_bytes_) {
    begun = absl::ResourceExhaustedError(path + ": No space left on device");
  }
  if (!begun.ok()) {
    bytes = bytes.first(is_short_write_ ? bytes.size() / 2 : 0);
  }
  if (!bytes.empty()) {
    inode.changes.push_back({.offset = offset, .bytes = std::string(bytes.data(), bytes.size())});
    Put(inode.content, offset, inode.changes.back().bytes);
  }
  return begun;
}

uint64_t SimulatedDisk::UsedBytes() const {
  uint64_t bytes = 0;
  for (const auto& [path, inode] : names_) {
    bytes += inode == nullptr ? 0 : inode->content.size();
  }
  return bytes;
}

absl::Status SimulatedDisk::Truncate(Inode& inode, const std::string& path, uint64_t size) {
  WELLSPACE_RETURN_IF_ERROR(Begin("truncate", path));
  inode.changes.push_back({.is_truncation = true, .offset = size});
  inode.content.resize(size);
  return absl::OkStatus();
}

absl::Status SimulatedDisk::Synchronize(Inode& inode, const std::string& path) {
  if (const absl::Status begun = Begin("synchronise", path); !begun.ok()) {
    if (!is_dead()) {
      inode.changes.clear();  // the kernel takes them for written, and does not try again
    }
    return begun;
  }
  if (IsOmitted(path)) {
    return absl::OkStatus();
  }
  for (const Change& change : inode.changes) {
    if (change.is_truncation) {
      inode.durable.resize(change.offset);
    } else {
      Put(inode.durable, change.offset, change.bytes);
    }
  }
  inode.changes.clear();
  return absl::OkStatus();
}

bool SimulatedDisk::IsOmitted(const std::string& path) const {
  return std::ranges::any_of(omitted_, [&](const Omitted& omitted) {
    return (path.ends_with(omitted.end) || path.find(omitted.end + "-") != std::string::npos) &&
           (!omitted.is_planted || omitted.is_planted());
  });
}

void SimulatedDisk::ChangeNames(NameChange change) {
  Apply(change, names_);
  name_changes_.push_back(std::move(change));
}

absl::Status SimulatedDisk::SynchronizeFolder(const std::string& folder) {
  WELLSPACE_RETURN_IF_ERROR(Begin("synchronise folder", folder));
  if (IsOmitted(folder)) {
    return absl::OkStatus();
  }
  std::erase_if(name_changes_, [&](const NameChange& change) {
    if (change.folder != folder) {
      return false;
    }
    Apply(change, durable_names_);
    return true;
  });
  return absl::OkStatus();
}

absl::Status SimulatedDisk::Remove(const std::string& path) {
  WELLSPACE_RETURN_IF_ERROR(Begin("remove", path));
  if (!names_.contains(path)) {
    return absl::NotFoundError(path + ": No such file or directory");
  }
  ChangeNames({.folder = FolderOf(path), .entries = {{path, std::nullopt}}});
  return absl::OkStatus();
}

absl::Status SimulatedDisk::Rename(const std::string& from, const std::string& to) {
  WELLSPACE_RETURN_IF_ERROR(Begin("rename", from));
  const auto found = names_.find(from);
  if (found == names_.end()) {
    return absl::NotFoundError(from + ": No such file or directory");
  }
  ChangeNames({.folder = FolderOf(from), .entries = {{to, found->second}, {from, std::nullopt}}});
  return absl::OkStatus();
}

absl::Status SimulatedDisk::Link(const std::string& from, const std::string& to) {
  WELLSPACE_RETURN_IF_ERROR(Begin("link", from));
  const auto found = names_.find(from);
  if (found == names_.end()) {
    return absl::NotFoundError(from + ": No such file or directory");
  }
  ChangeNames({.folder = FolderOf(to), .entries = {{to, found->second}}});
  return absl::OkStatus();
}

absl::Status SimulatedDisk::CreateFolder(const std::string& folder) {
  if (folder == "/" || names_.contains(folder)) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(CreateFolder(FolderOf(folder)));
  WELLSPACE_RETURN_IF_ERROR(Begin("create folder", folder));
  ChangeNames({.folder = FolderOf(folder), .entries = {{folder, Entry()}}});
  return absl::OkStatus();
}

std::vector<std::string> SimulatedDisk::List(const std::string& folder) const {
  std::vector<std::string> names;
  for (const auto& [path, entry] : names_) {
    if (FolderOf(path) == folder) {
      names.push_back(path.substr(folder.size() + 1));
    }
  }
  return names;
}

void SimulatedDisk::Apply(const NameChange& change, std::map<std::string, Entry>& names) {
  for (const auto& [path, entry] : change.entries) {
    if (entry.has_value()) {
      names[path] = *entry;
    } else {
      names.erase(path);
    }
  }
}

void SimulatedDisk::Restart(Loss loss, uint64_t seed) {
  test::SplitMix64 random(seed);
  constexpr std::array kChances = {0.02, 0.2, 0.5, 0.8, 0.98};
  const double chance = kChances[random.Below(kChances.size())];
  const Draw is_kept = [&] { return loss != Loss::kAll && random.Unit() < chance; };
  dies_at_.reset();
  fail_count_ = 0;
  if (loss == Loss::kProcess) {
    return;  // the kernel goes on as if nothing had been
  }
  std::map<std::string, Entry> names = durable_names_;
  for (const NameChange& change : name_changes_) {
    if (is_kept()) {
      Apply(change, names);
    }
  }
  std::erase_if(names,
                [&](const auto& name) { return FolderOf(name.first) != "/" && !names.contains(FolderOf(name.first)); });
  names_ = std::move(names);
  for (const auto& [path, inode] : names_) {
    if (inode != nullptr) {
      Lose(*inode, is_kept);
      inode->durable = inode->content;
      inode->changes.clear();
    }
  }
  durable_names_ = names_;
  name_changes_.clear();
}

void SimulatedDisk::Lose(Inode& inode, const Draw& is_kept) {
  inode.content = inode.durable;
  for (const Change& change : inode.changes) {
    const uint64_t end = change.offset + change.bytes.size();
    if (change.is_truncation) {
      if (is_kept()) {
        inode.content.resize(change.offset);
      }
      continue;
    }
    if (inode.content.size() < end && is_kept()) {
      inode.content.resize(end);  // the size alone
    }
    for (uint64_t at = change.offset; at < end;) {
      const uint64_t count = std::min(kSectorBytes - at % kSectorBytes, end - at);
      if (is_kept()) {
        Put(inode.content, at, std::string_view(change.bytes).substr(at - change.offset, count));
      }
      at += count;
    }
  }
}

void SimulatedDisk::Clear() {
  names_.clear();
  durable_names_.clear();
  name_changes_.clear();
  omitted_.clear();
  dies_at_.reset();
  fail_count_ = 0;
  most_bytes_ = UINT64_MAX;
  operations_ = 0;
  counts_reads_ = false;
  has_failed_ = false;
}

void SimulatedDisk::Flip(const std::string& path, uint64_t byte, int bit) {
  Inode& inode = *names_.at(path);
  inode.content[byte] = static_cast<char>(inode.content[byte] ^ (1 << bit));
}

uint64_t SimulatedDisk::SizeOf(const std::string& path) const { return names_.at(path)->content.size(); }

}  // namespace wellspace::server
