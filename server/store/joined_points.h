// The points of a session that lie in several files, one behind the other.
#ifndef WELLSPACE_SERVER_STORE_JOINED_POINTS_H_
#define WELLSPACE_SERVER_STORE_JOINED_POINTS_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "server/store/files.h"
#include "server/store/point_store.h"

namespace wellspace::server {

// Each owner that appends to a session begins a file of its own: the files of others stay as they are.
//
// Thread safety: that of PointStore.
class JoinedPoints final : public PointStore {
 public:
  // REQUIRES:   there is one at least. Points are appended to the last one.
  explicit JoinedPoints(std::vector<std::unique_ptr<PointStore>> parts);

  bool is_in_memory() const override { return parts_.back()->is_in_memory(); }
  uint64_t coordinate_count() const override { return first_of_last_ + parts_.back()->coordinate_count(); }
  absl::Status Append(std::span<const double> coordinates) override { return parts_.back()->Append(coordinates); }
  // REQUIRES:   `count` includes all points of the parts before the last.
  void Truncate(uint64_t count) override { parts_.back()->Truncate(count - first_of_last_); }
  absl::Status Synchronize() override { return parts_.back()->Synchronize(); }
  absl::StatusOr<uint64_t> CountEqual(uint64_t first, std::span<const double> coordinates) const override;
  absl::StatusOr<uint32_t> Checksum(uint64_t first, uint64_t end) const override;
  absl::StatusOr<std::vector<double>> Copy(uint64_t first, uint64_t end,
                                           const core::RunContext& context) const override;

 private:
  // Hands these coordinates, part by part, to `take`, which gets the part and the place in it, one after the
  // other, until it says that this was enough.
  using Take = std::function<absl::StatusOr<bool>(const PointStore& part, uint64_t first, uint64_t end)>;
  absl::Status ForParts(uint64_t first, uint64_t end, const Take& take) const;

  const std::vector<std::unique_ptr<PointStore>> parts_;
  uint64_t first_of_last_ = 0;  // coordinates before the last part
};

// The points of `points`, whose files `open` opens, each with those that are in it; `is_written`: points are appended.
using OpenPointsFile = std::function<std::unique_ptr<PointStore>(const store::v1::PointsFile& file, bool is_written,
                                                                 std::vector<store::v1::StepRecord::Points> committed)>;
std::unique_ptr<PointStore> JoinPoints(const SessionPoints& points, const OpenPointsFile& open);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_JOINED_POINTS_H_
