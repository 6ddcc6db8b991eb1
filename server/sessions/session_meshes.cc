#include "server/sessions/session_meshes.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Whether a cut is one with these options.
auto IsCutWith(const core::PartitionOptions& options) {
  return [&options](const MeshCut& cut) {
    return cut.options.parts == options.parts && cut.options.contiguous == options.contiguous;
  };
}

template <typename Product>
uint64_t BytesOf(const std::vector<Product>& products) {
  uint64_t bytes = 0;
  for (const Product& one : products) {
    bytes += one->memory.bytes();
  }
  return bytes;
}

}  // namespace

SessionMeshes::SessionMeshes(Options options) : options_(std::move(options)) {}

std::shared_ptr<MeshSnapshot> SessionMeshes::last() const {
  absl::MutexLock lock(&mutex_);
  return last_;
}

bool SessionMeshes::IsRead() const {
  absl::MutexLock lock(&mutex_);
  return last_.use_count() > 1;
}

absl::StatusOr<std::shared_ptr<const MeshSnapshot>> SessionMeshes::Kept(uint64_t revision) const {
  WELLSPACE_RETURN_IF_ERROR(options_.check());
  absl::MutexLock lock(&mutex_);
  for (const std::shared_ptr<MeshSnapshot>& mesh : {last_, earlier_}) {
    if (mesh != nullptr && mesh->revision() == revision) {
      return mesh;
    }
  }
  return MakeError(
      v1::ERROR_REASON_MESH_NOT_KEPT,
      absl::StrCat("the mesh of revision ", revision, " is not kept; ", options_.session, " has that of revision ",
                   last_->revision(),
                   earlier_ == nullptr ? " alone" : absl::StrCat(" and that of ", earlier_->revision()),
                   ". Of earlier ones that which was downloaded, or located points in, last is kept, while memory "
                   "allows it"),
      "start.from_revision");
}

void SessionMeshes::Restore(std::shared_ptr<MeshSnapshot> mesh) {
  absl::MutexLock lock(&mutex_);
  last_ = std::move(mesh);
}

SessionMeshes::Dropped SessionMeshes::Replace(std::shared_ptr<MeshSnapshot> mesh, MeshDeltas::Delta delta,
                                              uint64_t epoch) {
  Dropped dropped;
  dropped.deltas = deltas_.Advance(std::move(delta), mesh->loaded_bytes());
  absl::MutexLock lock(&mutex_);
  dropped.located = locator_.Drop();
  dropped.cuts = cuts_.Drop();
  const std::shared_ptr<MeshSnapshot> before = std::exchange(last_, std::move(mesh));
  if (before == nullptr) {
    return dropped;
  }
  before->MakeObsolete();
  // A file that another owner has made may go when the folder is cleared up, since no record names it any more.
  const uint64_t maker = before->record().epoch();
  if (WasAskedFor(*before) && (maker == 0 || maker == epoch)) {
    dropped.earlier = std::exchange(earlier_, before);
    dropped.located = earlier_locator_.Replace(std::move(dropped.located));
  } else {
    dropped.earlier = before;
  }
  return dropped;
}

bool SessionMeshes::WasAskedFor(const MeshSnapshot& mesh) const {
  const uint64_t revision = mesh.revision();
  return deltas_.WasDownloaded(revision) || locator_.WasAskedFor(revision) || cuts_.WasAskedFor(revision);
}

absl::StatusOr<std::shared_ptr<const LocatedMesh>> SessionMeshes::PrepareLocator(uint64_t revision, Job& job) {
  const auto make = [&](const MeshSnapshot& found) { return MakeLocated(found, options_.lasts, job); };
  WELLSPACE_RETURN_IF_ERROR(options_.check());
  absl::StatusOr<std::shared_ptr<const MeshSnapshot>> earlier = nullptr;
  {
    absl::MutexLock lock(&mutex_);
    if (earlier_ != nullptr && earlier_->revision() == revision) {
      earlier = earlier_;
    }
  }
  if (*earlier != nullptr) {
    return earlier_locator_.Prepare([&] { return earlier; }, make);
  }
  const auto find = [&]() -> absl::StatusOr<std::shared_ptr<const MeshSnapshot>> {
    WELLSPACE_RETURN_IF_ERROR(options_.check());
    absl::MutexLock lock(&mutex_);
    if (revision != 0 && earlier_ != nullptr && revision == earlier_->revision()) {
      return earlier_;  // it was the last one before the wait
    }
    if (revision != 0 && revision != last_->revision()) {
      const std::string kept =
          earlier_ == nullptr ? "" : absl::StrCat(", and the one that is kept, of ", earlier_->revision());
      return MakeError(v1::ERROR_REASON_REVISION_MISMATCH,
                       absl::StrCat("revision is ", revision, ", but the mesh of ", options_.session,
                                    " is of revision ", last_->revision(), kept),
                       "revision");
    }
    return last_;
  };
  return locator_.Prepare(find, make);
}

bool SessionMeshes::HasLocator(uint64_t revision) const {
  const std::shared_ptr<const MeshSnapshot> mesh = last();
  return mesh != nullptr && (locator_.Find(revision == 0 ? mesh->revision() : revision) != nullptr ||
                             earlier_locator_.Find(revision) != nullptr);
}

absl::StatusOr<std::shared_ptr<const MeshCut>> SessionMeshes::PrepareCut(
    const std::shared_ptr<const MeshSnapshot>& mesh, const core::PartitionOptions& options, Job& job,
    bool* is_at_work) {
  const auto find = [&]() -> absl::StatusOr<std::shared_ptr<const MeshSnapshot>> {
    WELLSPACE_RETURN_IF_ERROR(options_.check());
    return mesh;
  };
  const auto make = [&](const MeshSnapshot& found) { return CutIntoParts(found, options, options_.lasts, job); };
  return cuts_.Prepare(find, make, IsCutWith(options), is_at_work);
}

bool SessionMeshes::HasCut(const MeshSnapshot& mesh, const core::PartitionOptions& options) const {
  return cuts_.Find(mesh.revision(), IsCutWith(options)) != nullptr;
}

bool SessionMeshes::IsEarlierSpare() const {
  return !options_.are_files && earlier_ != nullptr && earlier_.use_count() == 1;
}

uint64_t SessionMeshes::SpareBytes(Part part) const {
  uint64_t bytes = earlier_locator_.SpareBytes();
  {
    absl::MutexLock lock(&mutex_);
    bytes += IsEarlierSpare() ? earlier_->memory_bytes() : 0;
  }
  return part == Part::kEarlier ? bytes : bytes + locator_.SpareBytes() + cuts_.SpareBytes() + deltas_.memory_bytes();
}

SessionMeshes::Dropped SessionMeshes::GiveUp(Part part) {
  Dropped dropped;
  {
    absl::MutexLock lock(&mutex_);
    dropped.located = earlier_locator_.GiveUp();
    if (IsEarlierSpare()) {
      dropped.bytes = earlier_->memory_bytes();
      dropped.earlier = std::move(earlier_);
    }
  }
  if (part == Part::kAll) {
    std::ranges::move(locator_.GiveUp(), std::back_inserter(dropped.located));
    dropped.cuts = cuts_.GiveUp();
    dropped.bytes += deltas_.memory_bytes();
    dropped.deltas = deltas_.GiveUp();
  }
  dropped.bytes += BytesOf(dropped.located) + BytesOf(dropped.cuts);
  return dropped;
}

void SessionMeshes::YieldEarlier() {
  std::shared_ptr<MeshSnapshot> earlier;
  {
    absl::MutexLock lock(&mutex_);
    earlier = earlier_;
  }
  if (earlier != nullptr) {
    earlier->YieldMemory();
  }
}

}  // namespace wellspace::server
