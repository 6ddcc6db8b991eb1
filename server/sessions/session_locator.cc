#include "server/sessions/session_locator.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace wellspace::server {

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

}  // namespace wellspace::server
