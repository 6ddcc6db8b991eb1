#include "server/store/delta_snapshot.h"

#include <string>

#include "proto/checksum.h"
#include "server/wire/convert.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {
namespace {

// Tags, lengths and index around the values of a part, generously.
constexpr uint64_t kPartEnvelopeBytes = 256;
// A number of up to 64 bits, as protocol buffers write it.
constexpr uint64_t kMostVarintBytes = 10;

// Cuts a delta into responses.
class PartWriter {
 public:
  PartWriter(uint64_t max_bytes, std::vector<grpc::Slice>& parts)
      : max_bytes_(max_bytes - kPartEnvelopeBytes), parts_(parts) {}

  // The part to which a value of at most `bytes` goes.
  v1::MeshDelta& PartFor(uint64_t bytes) {
    if (bytes_ + bytes > max_bytes_) {
      End();
    }
    bytes_ += bytes;
    return *response_.mutable_delta();
  }

  // Ends the part that was begun, if there is any.
  void End() {
    if (bytes_ == 0) {
      return;
    }
    response_.mutable_delta()->set_index(parts_.size());
    parts_.emplace_back(response_.SerializeAsString());
    response_.Clear();
    bytes_ = 0;
  }

  // Appends `values` to the array that `field` gives of a part.
  template <typename Values, typename Field>
  void Add(const Values& values, Field field) {
    for (const auto& value : values) {
      field(PartFor(sizeof(value)))->Add(value);
    }
  }

  // The same of ascending numbers, each as the number of those between it and the one before.
  template <typename Field>
  void AddList(const core::HugeVector<uint32_t>& numbers, Field field) {
    uint32_t least = 0;
    for (const uint32_t number : numbers) {
      field(PartFor(kMostVarintBytes))->Add(number - least);
      least = number + 1;
    }
  }

  template <typename Field>
  void AddRuns(const core::HugeVector<core::RowRun>& runs, Field field) {
    uint64_t expected = 0;
    for (const core::RowRun& run : runs) {
      v1::KeptRows& rows = *field(PartFor(3 * kMostVarintBytes));
      rows.add_skipped(static_cast<int64_t>(run.begin - expected));
      rows.add_kept(run.kept);
      rows.add_added(run.added);
      expected = run.begin + run.kept;
    }
  }

 private:
  const uint64_t max_bytes_;
  std::vector<grpc::Slice>& parts_;
  v1::DownloadMeshResponse response_;  // that is being filled
  uint64_t bytes_ = 0;                 // of it, at most
};

void WritePlain(const core::MeshDelta& delta, PartWriter& writer) {
  using Part = v1::MeshDelta;
  writer.AddList(delta.points.changed, [](Part& part) { return part.mutable_changed_points(); });
  writer.Add(delta.points.values, [](Part& part) { return part.mutable_points(); });
  writer.AddList(delta.weights.changed, [](Part& part) { return part.mutable_changed_weights(); });
  writer.Add(delta.weights.values, [](Part& part) { return part.mutable_weights(); });
  writer.AddRuns(delta.kept_simplices.runs, [](Part& part) { return part.mutable_kept_simplices(); });
  writer.Add(delta.kept_simplices.added, [](Part& part) { return part.mutable_simplices(); });
  writer.AddList(delta.input_vertex.changed, [](Part& part) { return part.mutable_changed_input_vertices(); });
  writer.Add(delta.input_vertex.values, [](Part& part) { return part.mutable_input_vertices(); });
  writer.AddList(delta.moved_vertices, [](Part& part) { return part.mutable_moved_vertices(); });
  writer.End();
}

void WriteBoundary(const core::MeshDelta& delta, PartWriter& writer) {
  using Part = v1::MeshDelta;
  writer.AddList(delta.vertex_origins.changed, [](Part& part) { return part.mutable_changed_vertex_origins(); });
  writer.Add(delta.vertex_origins.values, [](Part& part) { return part.mutable_vertex_origins(); });
  writer.AddList(delta.vertex_tags.changed, [](Part& part) { return part.mutable_changed_vertex_tags(); });
  writer.Add(delta.vertex_tags.values, [](Part& part) { return part.mutable_vertex_tags(); });
  writer.AddList(delta.simplex_regions.changed, [](Part& part) { return part.mutable_changed_simplex_regions(); });
  writer.Add(delta.simplex_regions.values, [](Part& part) { return part.mutable_simplex_regions(); });
  writer.AddRuns(delta.kept_facets.runs, [](Part& part) { return part.mutable_kept_facets(); });
  writer.Add(delta.kept_facets.added, [](Part& part) { return part.mutable_facets(); });
  writer.AddRuns(delta.kept_ridges.runs, [](Part& part) { return part.mutable_kept_ridges(); });
  writer.Add(delta.kept_ridges.added, [](Part& part) { return part.mutable_ridges(); });
  writer.End();
}

v1::MeshChecksums ChecksumsOf(const core::Mesh& mesh) {
  const auto checksum = [](const auto& values) { return Crc32c(values.data(), values.size() * sizeof(values[0])); };
  v1::MeshChecksums checksums;
  checksums.set_points(checksum(mesh.points));
  checksums.set_weights(checksum(mesh.weights));
  checksums.set_simplices(checksum(mesh.simplices));
  checksums.set_input_vertices(checksum(mesh.input_vertex));
  checksums.set_vertex_origins(checksum(mesh.vertex_origins));
  checksums.set_vertex_tags(checksum(mesh.vertex_tags));
  checksums.set_simplex_regions(checksum(mesh.simplex_regions));
  checksums.set_facets(checksum(mesh.facets));
  checksums.set_ridges(checksum(mesh.ridges));
  return checksums;
}

}  // namespace

DeltaSnapshot::DeltaSnapshot(uint64_t base_revision, uint64_t revision, const core::MeshDelta& delta,
                             const core::Mesh& next, uint64_t max_bytes)
    : base_revision_(base_revision), revision_(revision) {
  PartWriter writer(max_bytes, parts_);
  WritePlain(delta, writer);
  plain_parts_ = parts_.size();
  WriteBoundary(delta, writer);
  v1::MeshMetadata metadata = MetadataToProto(next, parts_.size(), /*with_boundary=*/true);
  metadata.set_revision(revision);
  metadata.mutable_delta()->set_base_revision(base_revision);
  *metadata.mutable_delta()->mutable_checksums() = ChecksumsOf(next);
  metadata_ = metadata.SerializeAsString();
  memory_bytes_ = sizeof(*this) + metadata_.capacity();
  for (const grpc::Slice& part : parts_) {
    memory_bytes_ += sizeof(part) + part.size();
  }
}

v1::MeshMetadata DeltaSnapshot::Metadata(bool with_boundary) const {
  v1::MeshMetadata metadata;
  metadata.ParseFromString(metadata_);  // the constructor has made it
  metadata.set_chunk_count(PartCount(with_boundary));
  if (!with_boundary) {
    ClearBoundary(metadata);
    v1::MeshChecksums& checksums = *metadata.mutable_delta()->mutable_checksums();
    checksums.clear_vertex_origins();
    checksums.clear_vertex_tags();
    checksums.clear_simplex_regions();
    checksums.clear_facets();
    checksums.clear_ridges();
  }
  return metadata;
}

}  // namespace wellspace::server
