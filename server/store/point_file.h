// The points of a session in a file, as they came: coordinates in IEEE 754, the lowest byte first, and nothing else.
#ifndef WELLSPACE_SERVER_STORE_POINT_FILE_H_
#define WELLSPACE_SERVER_STORE_POINT_FILE_H_

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/store/file_system.h"
#include "server/store/files_in_use.h"
#include "server/store/point_store.h"
#include "server/store/store_health.h"
#include "server/store/written_files.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// A file that grows at its end. Nothing of it is in memory, and a descriptor is kept only from Append to Synchronize:
// the kernel reports a disk error of a write in between to processes that have the file open, and may forget it else.
//
// Thread safety: that of PointStore.
// Invariants: the bytes of committed coordinates are never written again; bytes beyond coordinate_count() are garbage
//             of an upload that broke off.
class PointFile final : public PointStore {
 public:
  // `committed`: one behind the other, from point 0 on; their checksums are looked at when they are first read. `use`
  // lasts as long as this, and keeps the file; it may be null. The file is in the folder of `written`; null: it is only
  // read.
  PointFile(FileSystem& files, std::shared_ptr<StoreHealth> health, std::shared_ptr<WrittenFiles> written,
            std::string path, int dimension, std::vector<store::v1::StepRecord::Points> committed,
            std::unique_ptr<FilesInUse::Use> use = nullptr);

  bool is_in_memory() const override { return false; }
  uint64_t coordinate_count() const override { return coordinate_count_; }
  absl::Status Append(std::span<const double> coordinates) override;
  void Truncate(uint64_t count) override;
  absl::Status Synchronize() override;
  absl::StatusOr<uint64_t> CountEqual(uint64_t first, std::span<const double> coordinates) const override;
  absl::StatusOr<uint32_t> Checksum(uint64_t first, uint64_t end) const override;
  absl::StatusOr<std::vector<double>> Copy(uint64_t first, uint64_t end,
                                           const core::RunContext& context) const override;

 private:
  // Coordinates that were there when this was opened.
  struct Piece {
    uint64_t first = 0;
    uint64_t end = 0;
    uint32_t crc32c = 0;
    bool is_checked = false;
  };
  using Take = std::function<absl::Status(std::span<const double> coordinates)>;

  // The file, open, without bytes beyond the committed pieces.
  absl::StatusOr<std::shared_ptr<File>> OpenToAppend();
  absl::StatusOr<std::unique_ptr<File>> OpenToRead() const;
  // Checks those of the pieces that have some of these coordinates, and were not checked before.
  absl::Status CheckPieces(const File& file, uint64_t first, uint64_t end) const;
  // The piece that has it, or the first behind it. Wants mutex_ to be held.
  std::vector<Piece>::iterator PieceOf(uint64_t coordinate) const;
  // Hands the coordinates to `take`, a block at a time.
  absl::Status ReadBlocks(const File& file, uint64_t first, uint64_t end, const Take& take) const;
  absl::Status Read(uint64_t first, uint64_t end, const Take& take) const;

  FileSystem& files_;
  const std::shared_ptr<StoreHealth> health_;
  const std::shared_ptr<WrittenFiles> written_;
  const std::string path_;
  const std::unique_ptr<FilesInUse::Use> use_;  // or null
  uint64_t committed_count_ = 0;                // coordinates, when this was opened
  uint64_t coordinate_count_ = 0;
  bool is_cut_ = false;  // bytes beyond the committed pieces are gone

  mutable std::mutex mutex_;
  // Guarded by mutex_.
  mutable std::vector<Piece> pieces_;     // ascending
  std::shared_ptr<File> unsynchronised_;  // has been written to since it was last synchronised; or null
  uint64_t appends_ = 0;
  bool has_new_name_;  // its name may not outlive a loss of power
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POINT_FILE_H_
