#include "server/sessions/session_locator.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace wellspace::server {
namespace {

absl::StatusOr<std::shared_ptr<const LocatedMesh>> MakeLocated(const MeshSnapshot& mesh, Lasts lasts, Job& job) {
  const auto dimension = static_cast<int>(mesh.record().domain_low_size());
  const uint64_t bytes = mesh.loaded_bytes() + core::MeshLocator::BytesFor(dimension, mesh.record().simplices());
  auto located = std::make_shared<LocatedMesh>();
  const absl::Status made = job.RunApart([&](core::RunContext& context) -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(bytes));
    WELLSPACE_ASSIGN_OR_RETURN(core::Mesh loaded, mesh.Load(context));
    WELLSPACE_ASSIGN_OR_RETURN(located->locator, core::MeshLocator::Create(std::move(loaded), context));
    return absl::OkStatus();
  });
  WELLSPACE_RETURN_IF_ERROR(made);
  located->revision = mesh.revision();
  located->vertices = mesh.record().vertices();
  located->memory = job.TakeMemory(bytes);
  located->memory.MakeLasting(lasts);
  return located;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const LocatedMesh>> SessionLocator::Prepare(const LastMesh& last_mesh, Lasts lasts,
                                                                           Job& job) {
  std::lock_guard making(making_mutex_);
  // After the wait: there may be another mesh by now.
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshSnapshot> mesh, last_mesh());
  std::shared_ptr<const LocatedMesh> before;  // is freed without mutex_, and before another takes memory
  {
    std::lock_guard lock(mutex_);
    asked_for_ = std::max(asked_for_, mesh->revision());
    if (kept_ != nullptr && kept_->revision == mesh->revision()) {
      return kept_;
    }
    before = std::exchange(kept_, nullptr);
  }
  before = nullptr;
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<const LocatedMesh> located, MakeLocated(*mesh, lasts, job));
  std::lock_guard lock(mutex_);
  kept_ = located;
  return located;
}

std::shared_ptr<const LocatedMesh> SessionLocator::Replace(std::shared_ptr<const LocatedMesh> located) {
  std::lock_guard lock(mutex_);
  return std::exchange(kept_, std::move(located));
}

bool SessionLocator::WasAskedFor(uint64_t revision) const {
  std::lock_guard lock(mutex_);
  return asked_for_ == revision;
}

bool SessionLocator::Has(uint64_t revision) const {
  std::lock_guard lock(mutex_);
  return kept_ != nullptr && kept_->revision == revision;
}

uint64_t SessionLocator::SpareBytes() const {
  std::lock_guard lock(mutex_);
  return IsSpareLocked() ? kept_->memory.bytes() : 0;
}

std::shared_ptr<const LocatedMesh> SessionLocator::GiveUp() {
  std::lock_guard lock(mutex_);
  return IsSpareLocked() ? std::exchange(kept_, nullptr) : nullptr;
}

}  // namespace wellspace::server
