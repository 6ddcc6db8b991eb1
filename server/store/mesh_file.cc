#include "server/store/mesh_file.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpcpp/support/slice.h"
#include "proto/checksum.h"
#include "server/store/mesh_file_format.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Read, and then checked while it is in the nearest cache.
constexpr uint64_t kReadBytes = uint64_t{1} << 17;

uint64_t BytesOfChunk(const store::v1::MeshDirectory::Array& array, uint64_t chunk) {
  const uint64_t first = chunk * array.rows_per_chunk();
  return std::min(array.rows_per_chunk(), array.rows() - first) * array.row_bytes();
}

const store::v1::MeshDirectory::Array* FindArray(const store::v1::MeshDirectory& directory, int field) {
  const auto array =
      std::ranges::find(directory.arrays(), field, [](const store::v1::MeshDirectory::Array& a) { return a.field(); });
  return array == directory.arrays().end() ? nullptr : &*array;
}

// Whether chunks of the array are sent.
bool IsSent(const store::v1::MeshDirectory::Array& array, bool with_boundary) {
  return array.field() != v1::MeshChunk::kMovedVerticesFieldNumber && (with_boundary || !IsOfBoundary(array.field()));
}

uint64_t CountChunks(const store::v1::MeshDirectory& directory, bool with_boundary) {
  uint64_t count = 0;
  for (const auto& array : directory.arrays()) {
    count += IsSent(array, with_boundary) ? ChunksOf(array) : 0;
  }
  return count;
}

}  // namespace

MeshFile::MeshFile(FileSystem& files, store::v1::MeshRecord record, std::unique_ptr<FilesInUse::Use> use,
                   std::shared_ptr<ChunkBuffers> buffers)
    : MeshSnapshot(std::move(record)), files_(files), use_(std::move(use)), buffers_(std::move(buffers)) {}

uint64_t MeshFile::memory_bytes() const {
  // The directory: metadata, and four bytes for each MiB.
  return 4096 + (record().size() >> 18);
}

absl::Status MeshFile::Damaged(const std::string& what) const {
  return MakeError(v1::ERROR_REASON_FILE_DAMAGED, absl::StrCat(path(), ": ", what));
}

absl::StatusOr<std::unique_ptr<File>> MeshFile::Open() const {
  auto file = files_.Open(path(), FileSystem::Mode::kRead);
  if (!file.ok()) {
    return ErrorOfRead(file.status());
  }
  return *std::move(file);
}

absl::Status MeshFile::ReadAll(const File& file, uint64_t offset, std::span<char> bytes) const {
  const absl::StatusOr<uint64_t> count = file.ReadAt(offset, bytes);
  if (!count.ok()) {
    return ErrorOfRead(count.status());
  }
  return *count == bytes.size()
             ? absl::OkStatus()
             : Damaged(absl::StrCat("the file ends at byte ", offset + *count, ", and should have ", record().size()));
}

absl::StatusOr<std::shared_ptr<const MeshFile::Directory>> MeshFile::directory() const {
  const std::lock_guard lock(mutex_);
  if (directory_ == nullptr) {
    WELLSPACE_ASSIGN_OR_RETURN(directory_, ReadDirectory());
  }
  return directory_;
}

absl::StatusOr<std::shared_ptr<const MeshFile::Directory>> MeshFile::ReadDirectory() const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, Open());
  const absl::StatusOr<uint64_t> size = file->Size();
  if (!size.ok()) {
    return ErrorOfRead(size.status());
  }
  MeshFooter footer;
  if (*size != record().size() || *size < sizeof(footer)) {
    return Damaged(absl::StrCat("the file has ", *size, " bytes, and should have ", record().size()));
  }
  WELLSPACE_RETURN_IF_ERROR(ReadAll(*file, *size - sizeof(footer), {reinterpret_cast<char*>(&footer), sizeof(footer)}));
  if (footer.magic != kMeshMagic || footer.directory_bytes > *size - sizeof(footer)) {
    return Damaged("the end is not that of a mesh file");
  }
  if (footer.format != kMeshFormat) {
    return Damaged(
        absl::StrCat("the format is of version ", footer.format, "; this program knows version ", kMeshFormat));
  }
  std::string bytes(footer.directory_bytes, '\0');
  const uint64_t offset = *size - sizeof(footer) - bytes.size();
  WELLSPACE_RETURN_IF_ERROR(ReadAll(*file, offset, bytes));
  const uint32_t checksum = Crc32c(bytes.data(), bytes.size());
  if (checksum != footer.directory_crc32c || ExtendCrc32c(checksum, &footer, sizeof(footer)) != record().crc32c()) {
    return Damaged("the directory at the end is not the one that was written");
  }
  auto directory = std::make_shared<Directory>();
  if (!directory->ParseFromString(bytes)) {
    return Damaged("the directory at the end cannot be read");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckDirectory(*directory, offset));
  return directory;
}

absl::Status MeshFile::CheckDirectory(const Directory& directory, uint64_t size) const {
  uint64_t end = 0;
  for (const Array& array : directory.arrays()) {
    const bool is_sound = array.row_bytes() > 0 && array.rows_per_chunk() > 0 && array.offset() == end &&
                          array.rows() <= (size - end) / array.row_bytes() &&
                          array.rows_per_chunk() * array.row_bytes() <= kMaxSentBytes &&
                          static_cast<uint64_t>(array.crc32c_size()) == ChunksOf(array);
    if (!is_sound) {
      return Damaged(absl::StrCat("the directory is wrong about array ", array.field()));
    }
    end += array.rows() * array.row_bytes();
  }
  const v1::MeshMetadata& metadata = directory.metadata();
  const bool is_of_record = end == size && metadata.vertex_count() == record().vertices() &&
                            metadata.simplex_count() == record().simplices() &&
                            metadata.revision() == record().revision();
  return is_of_record ? absl::OkStatus() : Damaged("the directory is of another mesh");
}

absl::StatusOr<v1::MeshMetadata> MeshFile::Metadata(bool with_boundary) const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  v1::MeshMetadata metadata = whole->metadata();
  metadata.set_chunk_count(CountChunks(*whole, with_boundary));
  if (!with_boundary) {
    ClearBoundary(metadata);
  }
  return metadata;
}

absl::StatusOr<uint64_t> MeshFile::ChunkCount(bool with_boundary) const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  return CountChunks(*whole, with_boundary);
}

absl::Status MeshFile::ReadChunk(const File& file, const Array& array, uint64_t chunk, char* into,
                                 uint64_t size) const {
  const uint64_t offset = array.offset() + chunk * array.rows_per_chunk() * array.row_bytes();
  uint32_t checksum = 0;
  for (uint64_t done = 0; done < size; done += kReadBytes) {
    const uint64_t count = std::min(kReadBytes, size - done);
    WELLSPACE_RETURN_IF_ERROR(ReadAll(file, offset + done, {into + done, count}));
    checksum = ExtendCrc32c(checksum, into + done, count);
  }
  return checksum == array.crc32c(static_cast<int>(chunk))
             ? absl::OkStatus()
             : Damaged(absl::StrCat("chunk ", chunk, " of array ", array.field(), ", the bytes from ", offset, " to ",
                                    offset + size, ", is not the one that was written"));
}

// The piece in which the first of them may be is found by bisection; they ascend.
absl::StatusOr<std::vector<uint32_t>> MeshFile::ReadMoved(const File& file, const Array& moved, uint64_t first,
                                                          uint64_t end) const {
  std::vector<uint32_t> piece;
  const auto read = [&](uint64_t chunk) {
    piece.resize(BytesOfChunk(moved, chunk) / sizeof(uint32_t));
    return ReadChunk(file, moved, chunk, reinterpret_cast<char*>(piece.data()), piece.size() * sizeof(uint32_t));
  };
  uint64_t low = 0;
  uint64_t high = ChunksOf(moved);
  while (high - low > 1) {
    const uint64_t middle = low + (high - low) / 2;
    WELLSPACE_RETURN_IF_ERROR(read(middle));
    (piece.front() <= first ? low : high) = middle;
  }
  std::vector<uint32_t> found;
  for (uint64_t chunk = low; chunk < ChunksOf(moved); ++chunk) {
    WELLSPACE_RETURN_IF_ERROR(read(chunk));
    const auto begin = std::ranges::lower_bound(piece, first);
    const auto last = std::lower_bound(begin, piece.end(), end);
    found.insert(found.end(), begin, last);
    if (last != piece.end()) {
      break;
    }
  }
  return found;
}

absl::StatusOr<grpc::ByteBuffer> MeshFile::SerializeChunk(uint64_t index, int field, bool with_boundary) const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  auto array = whole->arrays().begin();
  uint64_t chunk = index;
  while (!IsSent(*array, with_boundary) || chunk >= ChunksOf(*array)) {
    chunk -= IsSent(*array, with_boundary) ? ChunksOf(*array) : 0;
    ++array;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, Open());
  std::vector<uint32_t> moved_here;
  const Array* moved = FindArray(*whole, v1::MeshChunk::kMovedVerticesFieldNumber);
  if (array->field() == v1::MeshChunk::kPointsFieldNumber && moved != nullptr && moved->rows() > 0) {
    const uint64_t first = chunk * array->rows_per_chunk();
    WELLSPACE_ASSIGN_OR_RETURN(moved_here, ReadMoved(*file, *moved, first, first + array->rows_per_chunk()));
  }
  const uint64_t size = BytesOfChunk(*array, chunk);
  ChunkBuffers::Buffer buffer = buffers_->Take(size);
  WELLSPACE_RETURN_IF_ERROR(ReadChunk(*file, *array, chunk, buffer.bytes.get(), size));
  const std::array<grpc::Slice, 2> slices = {
      grpc::Slice(ChunkHead(field, index, array->crc32c(static_cast<int>(chunk)), moved_here, array->field(), size)),
      buffers_->MakeSlice(std::move(buffer), size)};
  return grpc::ByteBuffer(slices.data(), slices.size());
}

template <typename Values>
absl::Status MeshFile::LoadArray(const File& file, const Directory& whole, int field, const core::RunContext& context,
                                 Values& values) const {
  const Array* array = FindArray(whole, field);
  if (array == nullptr) {
    return absl::OkStatus();
  }
  values.resize(array->rows() * array->row_bytes() / sizeof(values[0]));
  char* into = reinterpret_cast<char*>(values.data());
  for (uint64_t chunk = 0; chunk < ChunksOf(*array); ++chunk) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const uint64_t size = BytesOfChunk(*array, chunk);
    WELLSPACE_RETURN_IF_ERROR(ReadChunk(file, *array, chunk, into, size));
    into += size;
  }
  return absl::OkStatus();
}

absl::StatusOr<core::Mesh> MeshFile::Load(const core::RunContext& context) const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, Open());
  const v1::MeshMetadata& metadata = whole->metadata();
  core::Mesh mesh;
  mesh.dimension = metadata.dimension();
  mesh.domain_low.assign(record().domain_low().begin(), record().domain_low().end());
  mesh.domain_high.assign(record().domain_high().begin(), record().domain_high().end());
  // The other figures are made anew.
  mesh.statistics.max_radius_edge = metadata.statistics().max_radius_edge();
  mesh.statistics.min_angle_deg = metadata.statistics().min_angle_deg();
  WELLSPACE_RETURN_IF_ERROR(LoadArray(*file, *whole, v1::MeshChunk::kPointsFieldNumber, context, mesh.points));
  WELLSPACE_RETURN_IF_ERROR(LoadArray(*file, *whole, v1::MeshChunk::kWeightsFieldNumber, context, mesh.weights));
  WELLSPACE_RETURN_IF_ERROR(LoadArray(*file, *whole, v1::MeshChunk::kSimplicesFieldNumber, context, mesh.simplices));
  return mesh;
}

absl::StatusOr<std::shared_ptr<const core::Mesh>> MeshFile::Whole(const core::RunContext& context) const {
  {
    const std::lock_guard lock(mutex_);
    if (std::shared_ptr<const core::Mesh> whole = whole_.lock(); whole != nullptr) {
      return whole;
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::shared_ptr<const core::Mesh> whole, LoadWhole(context));
  const std::lock_guard lock(mutex_);
  whole_ = whole;
  return whole;
}

absl::StatusOr<std::shared_ptr<const core::Mesh>> MeshFile::LoadWhole(const core::RunContext& context) const {
  using Chunk = v1::MeshChunk;
  WELLSPACE_ASSIGN_OR_RETURN(core::Mesh loaded, Load(context));
  auto mesh = std::make_shared<core::Mesh>(std::move(loaded));
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, Open());
  const auto load = [&](int field, auto& values) { return LoadArray(*file, *whole, field, context, values); };
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kVertexOriginsFieldNumber, mesh->vertex_origins));
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kVertexTagsFieldNumber, mesh->vertex_tags));
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kSimplexRegionsFieldNumber, mesh->simplex_regions));
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kInputVerticesFieldNumber, mesh->input_vertex));
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kFacetsFieldNumber, mesh->facets));
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kRidgesFieldNumber, mesh->ridges));
  WELLSPACE_RETURN_IF_ERROR(load(Chunk::kMovedVerticesFieldNumber, mesh->moved_vertices));
  for (const v1::BoundaryPart& part : whole->metadata().boundary()) {
    mesh->boundary.push_back({.tag = part.tag(), .name = part.name(), .facets = part.facet_count()});
  }
  for (const v1::Region& region : whole->metadata().regions()) {
    mesh->regions.push_back({.id = region.id(), .name = region.name()});
  }
  return std::shared_ptr<const core::Mesh>(std::move(mesh));
}

absl::StatusOr<uint64_t> MeshFile::WholeBytes() const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  uint64_t bytes = 0;
  for (const Array& array : whole->arrays()) {
    bytes += array.rows() * array.row_bytes();
  }
  return bytes;
}

absl::StatusOr<core::HugeVector<double>> MeshFile::LoadPoints(const core::RunContext& context) const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, Open());
  core::HugeVector<double> points;
  WELLSPACE_RETURN_IF_ERROR(LoadArray(*file, *whole, v1::MeshChunk::kPointsFieldNumber, context, points));
  return points;
}

absl::Status MeshFile::CheckSame(const core::Mesh& made) const {
  constexpr std::array kFields = {v1::MeshChunk::kPointsFieldNumber,  v1::MeshChunk::kSimplicesFieldNumber,
                                  v1::MeshChunk::kWeightsFieldNumber, v1::MeshChunk::kFacetsFieldNumber,
                                  v1::MeshChunk::kRidgesFieldNumber,  v1::MeshChunk::kSimplexRegionsFieldNumber};
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  for (const MeshArray& array : CutMesh(made)) {
    if (std::ranges::find(kFields, array.field) == kFields.end()) {
      continue;
    }
    const Array* written = FindArray(*whole, array.field);
    if (written == nullptr && array.rows == 0) {
      continue;  // earlier builds did not know it
    }
    bool is_same = written != nullptr && written->rows() == array.rows && written->row_bytes() == array.row_bytes;
    const char* data = static_cast<const char*>(array.data);
    for (uint64_t chunk = 0; is_same && chunk < ChunksOf(*written); ++chunk) {
      const uint64_t size = BytesOfChunk(*written, chunk);
      is_same = Crc32c(data, size) == written->crc32c(static_cast<int>(chunk));
      data += size;
    }
    if (!is_same) {
      return OtherMesh();
    }
  }
  return absl::OkStatus();
}

absl::Status MeshFile::Check() const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const Directory> whole, directory());
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, Open());
  std::vector<char> bytes;
  for (const Array& array : whole->arrays()) {
    for (uint64_t chunk = 0; chunk < ChunksOf(array); ++chunk) {
      bytes.resize(BytesOfChunk(array, chunk));
      WELLSPACE_RETURN_IF_ERROR(ReadChunk(*file, array, chunk, bytes.data(), bytes.size()));
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::server
