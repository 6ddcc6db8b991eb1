// The points of a session, as they came.
#ifndef WELLSPACE_SERVER_SESSIONS_POINT_STORE_H_
#define WELLSPACE_SERVER_SESSIONS_POINT_STORE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace wellspace::server {

// Coordinates that grow at the end. They lie in blocks, so that growing never copies much, however small the pieces
// are.
//
// Thread safety: thread-compatible.
class PointStore {
 public:
  // Complexity: O(size of `coordinates`).
  void Append(std::span<const double> coordinates);

  // How many of `coordinates` are, to the bit, those from number `first` on: all, or those before the first that is
  // another.
  //
  // REQUIRES:   first + coordinates.size() <= coordinate_count().
  uint64_t CountEqual(uint64_t first, std::span<const double> coordinates) const;

  // CRC32C of the coordinates from number `first` on, those from `end` on excepted.
  //
  // REQUIRES:   first <= end <= coordinate_count().
  // Complexity: 0.1 ms per MiB, where the processor has an instruction for it.
  uint32_t Checksum(uint64_t first, uint64_t end) const;

  // The coordinate number `index`.
  double at(uint64_t index) const { return blocks_[index / kBlockSize][index % kBlockSize]; }

  uint64_t coordinate_count() const { return coordinate_count_; }

  // The coordinates from number `first` on, those from `end` on excepted.
  //
  // REQUIRES:   first <= end <= coordinate_count().
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::vector<double>> Copy(uint64_t first, uint64_t end, const core::RunContext& context) const;
  absl::StatusOr<std::vector<double>> CopyFrom(uint64_t first, const core::RunContext& context) const {
    return Copy(first, coordinate_count_, context);
  }

 private:
  // Of the coordinates from number `first` on, those that lie in one block with it, `end` excepted.
  std::span<const double> PieceFrom(uint64_t first, uint64_t end) const;

  static constexpr size_t kBlockSize = size_t{1} << 17;  // coordinates: 1 MiB

  std::deque<std::vector<double>> blocks_;  // of kBlockSize coordinates; the last one may have fewer
  uint64_t coordinate_count_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_POINT_STORE_H_
