#include "server/store/memory_mesh.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "server/wire/convert.h"

namespace wellspace::server {
namespace {

constexpr size_t kCopyBlock = size_t{1} << 20;  // numbers copied between two looks at the context
// Copies have room for this part more, so that a small update does not move them again. Pages that are never touched
// take no memory.
constexpr size_t kSpareShare = 64;

template <typename T>
absl::StatusOr<core::HugeVector<T>> Copy(const core::HugeVector<T>& values, const core::RunContext& context) {
  core::HugeVector<T> copy;
  copy.reserve(values.size() + values.size() / kSpareShare);
  for (size_t begin = 0; begin < values.size(); begin += kCopyBlock) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const T* first = values.data() + begin;
    copy.insert(copy.end(), first, first + std::min(kCopyBlock, values.size() - begin));
  }
  return copy;
}

}  // namespace

store::v1::MeshRecord RecordOf(uint64_t revision, const core::Mesh& mesh) {
  store::v1::MeshRecord record;
  record.set_revision(revision);
  record.set_vertices(mesh.vertex_count());
  record.set_simplices(mesh.simplex_count());
  record.mutable_domain_low()->Assign(mesh.domain_low.begin(), mesh.domain_low.end());
  record.mutable_domain_high()->Assign(mesh.domain_high.begin(), mesh.domain_high.end());
  return record;
}

MemoryMesh::MemoryMesh(uint64_t revision, core::Mesh mesh)
    : MeshSnapshot(RecordOf(revision, mesh)), chunks_(std::make_shared<MeshChunks>(std::move(mesh))) {}

absl::StatusOr<v1::MeshMetadata> MemoryMesh::Metadata(bool with_boundary) const {
  v1::MeshMetadata metadata = MetadataToProto(chunks_->mesh(), chunks_->count(with_boundary), with_boundary);
  metadata.set_revision(revision());
  return metadata;
}

absl::StatusOr<grpc::ByteBuffer> MemoryMesh::SerializeChunk(uint64_t index, int field, bool with_boundary) const {
  return server::SerializeChunk(chunks_, index, field, with_boundary);
}

absl::StatusOr<core::Mesh> MemoryMesh::Load(const core::RunContext& context) const {
  const core::Mesh& mesh = chunks_->mesh();
  core::Mesh copy;
  copy.dimension = mesh.dimension;
  copy.domain_low = mesh.domain_low;
  copy.domain_high = mesh.domain_high;
  copy.statistics = mesh.statistics;
  WELLSPACE_ASSIGN_OR_RETURN(copy.points, Copy(mesh.points, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.weights, Copy(mesh.weights, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.simplices, Copy(mesh.simplices, context));
  // With these Update changes what has changed, and makes them anew without.
  WELLSPACE_ASSIGN_OR_RETURN(copy.input_vertex, Copy(mesh.input_vertex, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.vertex_origins, Copy(mesh.vertex_origins, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.vertex_tags, Copy(mesh.vertex_tags, context));
  WELLSPACE_ASSIGN_OR_RETURN(copy.facets, Copy(mesh.facets, context));
  copy.boundary = mesh.boundary;
  copy.regions = mesh.regions;
  return copy;
}

absl::StatusOr<std::shared_ptr<const core::Mesh>> MemoryMesh::Whole(const core::RunContext& /*context*/) const {
  return std::shared_ptr<const core::Mesh>(chunks_, &chunks_->mesh());
}

absl::StatusOr<core::HugeVector<double>> MemoryMesh::LoadPoints(const core::RunContext& context) const {
  return Copy(chunks_->mesh().points, context);
}

absl::Status MemoryMesh::CheckSame(const core::Mesh& made) const {
  const core::Mesh& mesh = chunks_->mesh();
  const bool is_same =
      std::ranges::equal(mesh.points, made.points) && std::ranges::equal(mesh.simplices, made.simplices) &&
      std::ranges::equal(mesh.weights, made.weights) && std::ranges::equal(mesh.facets, made.facets) &&
      std::ranges::equal(mesh.ridges, made.ridges) && std::ranges::equal(mesh.simplex_regions, made.simplex_regions);
  return is_same ? absl::OkStatus() : OtherMesh();
}

}  // namespace wellspace::server
