// A mesh in a file: its arrays one behind the other, then a MeshDirectory, then a footer of 24 bytes.
//
// Footer:     "WsMesh\r\n"; the version of the format, uint32; CRC32C of the directory, uint32; its length in bytes,
//             uint64. All numbers have the lowest byte first.
#ifndef WELLSPACE_SERVER_STORE_MESH_FILE_H_
#define WELLSPACE_SERVER_STORE_MESH_FILE_H_

#include <memory>
#include <mutex>
#include <string>

#include "server/store/chunk_buffers.h"
#include "server/store/files_in_use.h"
#include "server/store/mesh_chunks.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/store_health.h"

namespace wellspace::server {

// Writes `mesh` to `path`, in `folder`, by way of a file beside it, PATH.tmp: when it returns, the file outlives a loss
// of power. Its chunks are cut for responses of at most `max_chunk_bytes`.
//
// Complexity: one pass over the mesh.
// Errors:     DISK_FULL, STORE_FAILED; CANCELLED, DEADLINE_EXCEEDED. There is no file then, or one that garbage
//             collection takes.
absl::StatusOr<store::v1::MeshRecord> WriteMeshFile(FileSystem& files, Folder& folder, StoreHealth& health,
                                                    const std::string& path, uint64_t revision, const core::Mesh& mesh,
                                                    const core::RunContext& context,
                                                    uint64_t max_chunk_bytes = kMaxResponseBytes);

// A mesh that WriteMeshFile has written. In memory it has a directory, no more: chunks are read when they are asked
// for, and checked.
//
// Thread safety: that of MeshSnapshot.
class MeshFile final : public MeshSnapshot {
 public:
  MeshFile(FileSystem& files, store::v1::MeshRecord record, std::unique_ptr<FilesInUse::Use> use,
           std::shared_ptr<ChunkBuffers> buffers = std::make_shared<ChunkBuffers>());

  uint64_t memory_bytes() const override;
  void KeepMemory(MemoryReservation memory) override { memory_ = std::move(memory); }
  void MakeObsolete() override { use_->MakeObsolete(); }
  absl::StatusOr<v1::MeshMetadata> Metadata(bool with_boundary) const override;
  absl::StatusOr<uint64_t> ChunkCount(bool with_boundary) const override;
  absl::StatusOr<grpc::ByteBuffer> SerializeChunk(uint64_t index, int field, bool with_boundary) const override;
  absl::StatusOr<core::Mesh> Load(const core::RunContext& context) const override;
  absl::StatusOr<std::shared_ptr<const core::Mesh>> Whole(const core::RunContext& context) const override;
  absl::StatusOr<uint64_t> WholeBytes() const override;
  absl::StatusOr<core::HugeVector<double>> LoadPoints(const core::RunContext& context) const override;
  absl::Status CheckSame(const core::Mesh& made) const override;

  // Reads all of it.
  //
  // Errors:     FILE_DAMAGED, naming the first fault.
  absl::Status Check() const;

 private:
  using Directory = store::v1::MeshDirectory;
  using Array = Directory::Array;

  const std::string& path() const { return use_->path(); }
  absl::Status Damaged(const std::string& what) const;
  absl::StatusOr<std::unique_ptr<File>> Open() const;
  // Read when it is first needed, and after errors again.
  absl::StatusOr<std::shared_ptr<const Directory>> directory() const;
  absl::StatusOr<std::shared_ptr<const Directory>> ReadDirectory() const;
  absl::Status CheckDirectory(const Directory& directory, uint64_t size) const;
  absl::StatusOr<std::shared_ptr<const core::Mesh>> LoadWhole(const core::RunContext& context) const;
  // Reads `bytes` from the place `offset`, all of them.
  absl::Status ReadAll(const File& file, uint64_t offset, std::span<char> bytes) const;
  // Reads a chunk, of `size` bytes, and checks it.
  absl::Status ReadChunk(const File& file, const Array& array, uint64_t chunk, char* into, uint64_t size) const;
  absl::StatusOr<std::vector<uint32_t>> ReadMoved(const File& file, const Array& moved, uint64_t first,
                                                  uint64_t end) const;
  template <typename Values>
  absl::Status LoadArray(const File& file, const Directory& directory, int field, const core::RunContext& context,
                         Values& values) const;

  FileSystem& files_;
  const std::unique_ptr<FilesInUse::Use> use_;
  const std::shared_ptr<ChunkBuffers> buffers_;
  MemoryReservation memory_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  mutable std::shared_ptr<const Directory> directory_;
  mutable std::weak_ptr<const core::Mesh> whole_;  // as long as those live who have asked for it
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MESH_FILE_H_
