#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/store/data_folder.h"
#include "server/store/mesh_file.h"
#include "server/store/mesh_file_format.h"
#include "server/wire/convert.h"

namespace wellspace::server {
namespace {

// Writes one piece behind the other.
class MeshWriter {
 public:
  explicit MeshWriter(File& file) : file_(file) {}

  uint64_t offset() const { return offset_; }

  absl::Status Write(const void* data, uint64_t size) {
    WELLSPACE_RETURN_IF_ERROR(file_.WriteAt(offset_, {static_cast<const char*>(data), size}));
    offset_ += size;
    return absl::OkStatus();
  }

  // Writes an array, whose place and checksums `entry` then has. Errors of the context are in `stopped`.
  absl::Status WriteArray(const MeshArray& array, const core::RunContext& context,
                          store::v1::MeshDirectory::Array& entry, absl::Status& stopped) {
    entry.set_field(array.field);
    entry.set_offset(offset_);
    entry.set_row_bytes(array.row_bytes);
    entry.set_rows(array.rows);
    entry.set_rows_per_chunk(array.rows_per_chunk);
    for (uint64_t first = 0; first < array.rows; first += array.rows_per_chunk) {
      if (stopped = context.Check(); !stopped.ok()) {
        return stopped;
      }
      const char* data = static_cast<const char*>(array.data) + first * array.row_bytes;
      const uint64_t size = std::min(array.rows_per_chunk, array.rows - first) * array.row_bytes;
      entry.add_crc32c(Crc32c(data, size));
      WELLSPACE_RETURN_IF_ERROR(Write(data, size));
    }
    return absl::OkStatus();
  }

 private:
  File& file_;
  uint64_t offset_ = 0;
};

// Errors of the file system, or of the context, which are then in `stopped`, too.
absl::Status WriteAll(File& file, const core::Mesh& mesh, const core::RunContext& context, uint64_t max_chunk_bytes,
                      store::v1::MeshRecord& record, absl::Status& stopped) {
  WELLSPACE_RETURN_IF_ERROR(file.Truncate(0));  // bytes that a process that died has left in its place
  MeshWriter writer(file);
  store::v1::MeshDirectory directory;
  *directory.mutable_metadata() = MetadataToProto(mesh, 0, /*with_boundary=*/true);
  directory.mutable_metadata()->set_revision(record.revision());
  for (const MeshArray& array : CutMesh(mesh, max_chunk_bytes)) {
    WELLSPACE_RETURN_IF_ERROR(writer.WriteArray(array, context, *directory.add_arrays(), stopped));
  }
  const MeshArray moved{.field = v1::MeshChunk::kMovedVerticesFieldNumber,
                        .data = mesh.moved_vertices.data(),
                        .row_bytes = sizeof(mesh.moved_vertices[0]),
                        .rows = mesh.moved_vertices.size(),
                        .rows_per_chunk = kMovedPerChunk};
  WELLSPACE_RETURN_IF_ERROR(writer.WriteArray(moved, context, *directory.add_arrays(), stopped));

  const std::string bytes = directory.SerializeAsString();
  const MeshFooter footer{.magic = kMeshMagic,
                          .format = kMeshFormat,
                          .directory_crc32c = Crc32c(bytes.data(), bytes.size()),
                          .directory_bytes = bytes.size()};
  WELLSPACE_RETURN_IF_ERROR(writer.Write(bytes.data(), bytes.size()));
  WELLSPACE_RETURN_IF_ERROR(writer.Write(&footer, sizeof(footer)));
  record.set_size(writer.offset());
  record.set_crc32c(ExtendCrc32c(footer.directory_crc32c, &footer, sizeof(footer)));
  return file.Synchronize();
}

}  // namespace

absl::StatusOr<store::v1::MeshRecord> WriteMeshFile(FileSystem& files, Folder& folder, StoreHealth& health,
                                                    const std::string& path, uint64_t revision, const core::Mesh& mesh,
                                                    const core::RunContext& context, uint64_t max_chunk_bytes) {
  WELLSPACE_RETURN_IF_ERROR(health.CheckRoom());
  const std::string temporary = path + std::string(kTemporaryEnd);
  store::v1::MeshRecord record = RecordOf(revision, mesh);
  absl::Status stopped;
  absl::StatusOr<std::unique_ptr<File>> file = files.Open(temporary, FileSystem::Mode::kCreateOrWrite);
  if (!file.ok()) {
    return health.OfOpen(file.status());
  }
  // The bytes first, then the name, then the folder that has it: a name never shows bytes that may still be lost.
  absl::Status written = WriteAll(**file, mesh, context, max_chunk_bytes, record, stopped);
  file->reset();
  if (written.ok()) {
    written = files.Rename(temporary, path);
  }
  if (!written.ok()) {
    files.Remove(temporary).IgnoreError();
    return stopped.ok() ? health.OfWrite(written) : stopped;
  }
  if (const absl::Status named = folder.Synchronize(); !named.ok()) {
    return health.Fail(named);
  }
  return record;
}

}  // namespace wellspace::server
