// The points of a session, as they came.
#ifndef WELLSPACE_SERVER_STORE_POINT_STORE_H_
#define WELLSPACE_SERVER_STORE_POINT_STORE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace wellspace::server {

// Coordinates that grow at the end, in memory or in a file.
//
// Thread safety: thread-compatible; Synchronize may run beside Append and the const functions.
class PointStore {
 public:
  virtual ~PointStore() = default;

  // Whether the coordinates are in memory, and count there.
  virtual bool is_in_memory() const = 0;

  virtual uint64_t coordinate_count() const = 0;

  // Appends `coordinates`: all or, on an error or an exception, none.
  //
  // Complexity: O(size of `coordinates`).
  // Errors:     DISK_FULL; UNAVAILABLE.
  virtual absl::Status Append(std::span<const double> coordinates) = 0;

  // Takes all but the first `count` coordinates out again.
  //
  // REQUIRES:   count <= coordinate_count().
  virtual void Truncate(uint64_t count) = 0;

  // Has all appended coordinates outlive a loss of power from now on.
  //
  // Errors:     UNAVAILABLE: the contents of the disk are unknown; nothing may be written to it any more.
  virtual absl::Status Synchronize() = 0;

  // How many of `coordinates` are, to the bit, those from number `first` on: all, or those before the first that is
  // another.
  //
  // REQUIRES:   first + coordinates.size() <= coordinate_count().
  // Errors:     of this and the following: DATA_LOSS, naming the file.
  virtual absl::StatusOr<uint64_t> CountEqual(uint64_t first, std::span<const double> coordinates) const = 0;

  // CRC32C of the coordinates from number `first` on, those from `end` on excepted.
  //
  // REQUIRES:   first <= end <= coordinate_count().
  // Complexity: 0.1 ms per MiB, where the processor has an instruction for it.
  virtual absl::StatusOr<uint32_t> Checksum(uint64_t first, uint64_t end) const = 0;

  // The coordinates from number `first` on, those from `end` on excepted.
  //
  // REQUIRES:   first <= end <= coordinate_count().
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<std::vector<double>> Copy(uint64_t first, uint64_t end,
                                                   const core::RunContext& context) const = 0;
  absl::StatusOr<std::vector<double>> CopyFrom(uint64_t first, const core::RunContext& context) const {
    return Copy(first, coordinate_count(), context);
  }
};

// Coordinates in memory. They lie in blocks, so that growing never copies much, however small the pieces are.
class MemoryPoints final : public PointStore {
 public:
  bool is_in_memory() const override { return true; }
  uint64_t coordinate_count() const override { return coordinate_count_; }
  absl::Status Append(std::span<const double> coordinates) override;
  void Truncate(uint64_t count) override;
  absl::Status Synchronize() override { return absl::OkStatus(); }
  absl::StatusOr<uint64_t> CountEqual(uint64_t first, std::span<const double> coordinates) const override;
  absl::StatusOr<uint32_t> Checksum(uint64_t first, uint64_t end) const override;
  absl::StatusOr<std::vector<double>> Copy(uint64_t first, uint64_t end,
                                           const core::RunContext& context) const override;

 private:
  // Of the coordinates from number `first` on, those that lie in one block with it, `end` excepted.
  std::span<const double> PieceFrom(uint64_t first, uint64_t end) const;

  static constexpr size_t kBlockSize = size_t{1} << 17;  // coordinates: 1 MiB

  std::deque<std::vector<double>> blocks_;  // of kBlockSize coordinates; the last one may have fewer
  uint64_t coordinate_count_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POINT_STORE_H_
