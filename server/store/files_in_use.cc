#include "server/store/files_in_use.h"

#include <utility>

namespace wellspace::server {

FilesInUse::Use::Use(std::shared_ptr<FilesInUse> files, std::string path, uint64_t version)
    : files_(std::move(files)), path_(std::move(path)), version_(version) {}

std::unique_ptr<FilesInUse::Use> FilesInUse::Take(const std::string& path, bool is_written) {
  const std::lock_guard lock(mutex_);
  return TakeLocked(path, is_written);
}

std::unique_ptr<FilesInUse::Use> FilesInUse::TakeUnlessUsed(const std::string& path) {
  const std::lock_guard lock(mutex_);
  return states_.contains(path) ? nullptr : TakeLocked(path, /*is_written=*/false);
}

std::unique_ptr<FilesInUse::Use> FilesInUse::TakeLocked(const std::string& path, bool is_written) {
  State& state = states_[path];
  ++state.uses;
  if (is_written) {
    ++state.version;
    state.is_obsolete = false;
    state.set_aside.clear();
  }
  return std::unique_ptr<Use>(new Use(shared_from_this(), path, state.version));
}

void FilesInUse::Remove(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if (const auto state = states_.find(path); state != states_.end()) {
    state->second.is_obsolete = true;
    state->second.set_aside.clear();
  } else {
    RemoveNow(path);
  }
}

void FilesInUse::RemoveNow(const std::string& path, const std::string& set_aside) {
  if (!may_remove_ || may_remove_()) {
    (set_aside.empty() ? file_system_.Remove(path) : file_system_.Rename(path, set_aside)).IgnoreError();
  }
}

void FilesInUse::Release(const std::string& path) {
  const std::lock_guard lock(mutex_);
  const auto state = states_.find(path);
  if (--state->second.uses > 0) {
    return;
  }
  if (state->second.is_obsolete) {
    RemoveNow(path, state->second.set_aside);
  }
  states_.erase(state);
}

void FilesInUse::MakeObsolete(const std::string& path, uint64_t version, const std::string& set_aside) {
  const std::lock_guard lock(mutex_);
  if (State& state = states_.at(path); state.version == version && !state.is_obsolete) {
    state.is_obsolete = true;
    state.set_aside = set_aside;
  }
}

}  // namespace wellspace::server
