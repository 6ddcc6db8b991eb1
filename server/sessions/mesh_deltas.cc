#include "server/sessions/mesh_deltas.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void MeshDeltas::NoteDownload(uint64_t revision) {
  std::lock_guard lock(mutex_);
  downloaded_ = std::max(downloaded_, revision);
}

bool MeshDeltas::WasDownloaded(uint64_t revision) const {
  std::lock_guard lock(mutex_);
  return downloaded_ == revision;
}

bool MeshDeltas::IsWanted(uint64_t revision) const {
  std::lock_guard lock(mutex_);
  return downloaded_ == revision || (!deltas_.empty() && deltas_.back()->revision() == revision);
}

std::vector<MeshDeltas::Delta> MeshDeltas::Advance(Delta delta, uint64_t mesh_bytes) {
  std::vector<Delta> dropped;
  std::lock_guard lock(mutex_);
  const auto drop_first = [&] {
    memory_bytes_ -= deltas_.front()->memory_bytes();
    dropped.push_back(std::move(deltas_.front()));
    deltas_.pop_front();
  };
  const bool goes_on = delta != nullptr && !deltas_.empty() && deltas_.back()->revision() == delta->base_revision();
  while (!goes_on && !deltas_.empty()) {
    drop_first();
  }
  if (delta == nullptr) {
    return dropped;
  }
  memory_bytes_ += delta->memory_bytes();
  deltas_.push_back(std::move(delta));
  while (deltas_.size() > kMost || memory_bytes_ > mesh_bytes) {
    drop_first();
  }
  return dropped;
}

absl::StatusOr<std::vector<MeshDeltas::Delta>> MeshDeltas::Between(uint64_t since, uint64_t revision) const {
  std::vector<Delta> chain;
  if (since == revision) {
    return chain;
  }
  std::lock_guard lock(mutex_);
  const auto first = std::ranges::find(deltas_, since, [](const Delta& delta) { return delta->base_revision(); });
  const auto last =
      std::find_if(first, deltas_.end(), [&](const Delta& delta) { return delta->revision() == revision; });
  if (last != deltas_.end()) {
    chain.assign(first, last + 1);
    return chain;
  }
  std::string kept;
  for (const Delta& delta : deltas_) {
    absl::StrAppend(&kept, kept.empty() ? "" : ", ", delta->base_revision());
  }
  return MakeError(
      v1::ERROR_REASON_DELTA_NOT_KEPT,
      absl::StrCat("what has changed since the mesh of revision ", since, " is not kept; ",
                   kept.empty() ? "nor is anything since other meshes" : absl::StrCat("it is since revisions ", kept),
                   ". Download the whole mesh, without since_revision"),
      "since_revision");
}

uint64_t MeshDeltas::memory_bytes() const {
  std::lock_guard lock(mutex_);
  return memory_bytes_;
}

std::vector<MeshDeltas::Delta> MeshDeltas::GiveUp() {
  std::lock_guard lock(mutex_);
  memory_bytes_ = 0;
  std::vector<Delta> given_up(deltas_.begin(), deltas_.end());
  deltas_.clear();
  return given_up;
}

}  // namespace wellspace::server
