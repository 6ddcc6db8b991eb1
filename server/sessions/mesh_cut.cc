#include "server/sessions/mesh_cut.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// An error of the core, of which clients see what they can change: nothing is wrong with points.
absl::Status OfCut(const absl::Status& status) {
  const std::string message(status.message());
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
      return MakeError(v1::ERROR_REASON_INVALID_REQUEST, message, "partition");
    case absl::StatusCode::kResourceExhausted:
      return MakeError(v1::ERROR_REASON_OUT_OF_MEMORY, message);
    default:
      return status;
  }
}

// The memory that a cut keeps, and the most that making it takes; the mesh included, if it is a copy.
struct CutBytes {
  uint64_t kept = 0;
  uint64_t peak = 0;
};

absl::StatusOr<CutBytes> BytesOf(const MeshSnapshot& mesh) {
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t whole, mesh.WholeBytes());
  WELLSPACE_ASSIGN_OR_RETURN(const v1::MeshMetadata metadata, mesh.Metadata(/*with_boundary=*/true));
  const uint64_t vertices = metadata.vertex_count();
  const uint64_t simplices = metadata.simplex_count();
  const uint64_t corners = simplices * (metadata.dimension() + 1);
  const uint64_t facets = metadata.facet_count();
  const uint64_t part_of = sizeof(uint32_t) * simplices;
  const uint64_t graph = sizeof(int32_t) * (simplices + 1 + corners);
  return CutBytes{.kept = whole + part_of + sizeof(uint32_t) * (2 * vertices + facets),
                  .peak = whole + std::max({core::DualGraphBytes(metadata.dimension(), simplices),
                                            graph + core::PartitionBytes(metadata.dimension(), simplices),
                                            part_of + core::PartOwnersBytes(vertices, corners, facets)})};
}

// The partition of the mesh; the graph is freed.
absl::StatusOr<core::HugeVector<uint32_t>> Partition(const core::Mesh& mesh, const core::PartitionOptions& options,
                                                     const core::RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const core::DualGraph graph, core::FindDualGraph(mesh.dimension, mesh.simplices, context));
  return core::Partition(graph, options, context);
}

absl::Status FillCut(const MeshSnapshot& mesh, const core::RunContext& context, MeshCut& cut) {
  WELLSPACE_ASSIGN_OR_RETURN(cut.mesh, mesh.Whole(context));
  auto part_of = Partition(*cut.mesh, cut.options, context);
  if (!part_of.ok()) {
    return OfCut(part_of.status());
  }
  cut.part_of = *std::move(part_of);
  auto owners = core::FindOwners(cut.View(), context);
  if (!owners.ok()) {
    return OfCut(owners.status());
  }
  cut.owners = *std::move(owners);
  return absl::OkStatus();
}

}  // namespace

core::PartitionedMesh MeshCut::View() const {
  return {.dimension = mesh->dimension,
          .vertex_count = mesh->vertex_count(),
          .simplices = mesh->simplices,
          .facets = mesh->facets,
          .part_of = part_of};
}

absl::StatusOr<std::shared_ptr<const MeshCut>> CutIntoParts(const MeshSnapshot& mesh,
                                                            const core::PartitionOptions& options, Lasts lasts,
                                                            Job& job) {
  WELLSPACE_ASSIGN_OR_RETURN(const CutBytes bytes, BytesOf(mesh));
  auto cut = std::make_shared<MeshCut>();
  cut->revision = mesh.revision();
  cut->options = options;
  const absl::Status made = job.RunApart([&](core::RunContext& context) -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(bytes.peak));
    context.SetMemoryLender(nullptr);  // it has all; the steps below each know of their own alone
    return FillCut(mesh, context, *cut);
  });
  if (!made.ok()) {
    cut = nullptr;  // before others may have its memory
    job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
    return made;
  }
  cut->memory = job.TakeMemory(bytes.kept);
  cut->memory.MakeLasting(lasts);
  job.TakeMemory(std::numeric_limits<uint64_t>::max()).Release();
  return cut;
}

absl::StatusOr<std::shared_ptr<const PartSnapshot>> TakePart(const MeshCut& cut, const MeshSnapshot& mesh,
                                                             const WantedPart& wanted, Job& job) {
  WELLSPACE_ASSIGN_OR_RETURN(v1::MeshMetadata metadata, mesh.Metadata(wanted.with_boundary));
  std::shared_ptr<PartSnapshot> taken;
  const absl::Status made = job.RunApart([&](core::RunContext& context) -> absl::Status {
    const core::PartitionedMesh view = cut.View();
    WELLSPACE_ASSIGN_OR_RETURN(const core::PartSelection selection,
                               core::SelectPart(view, cut.owners, wanted.part, wanted.ghost_layers, context));
    WELLSPACE_RETURN_IF_ERROR(
        context.ReserveMemory(core::MeshPartBytes(view, selection) + PartSnapshot::BytesFor(*cut.mesh, selection)));
    context.SetMemoryLender(nullptr);
    WELLSPACE_ASSIGN_OR_RETURN(core::MeshPart part, core::TakePart(view, cut.owners, selection, context));
    WELLSPACE_ASSIGN_OR_RETURN(
        taken, PartSnapshot::Make(*cut.mesh, {view, cut.owners, cut.options.parts, wanted.part}, std::move(part),
                                  std::move(metadata), wanted.with_boundary, context));
    return absl::OkStatus();
  });
  WELLSPACE_RETURN_IF_ERROR(made);
  taken->KeepMemory(job.TakeMemory(taken->memory_bytes()));
  return taken;
}

}  // namespace wellspace::server
