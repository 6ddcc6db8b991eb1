#include "server/point_store.h"

#include <algorithm>

#include "core/base/status_macros.h"

namespace wellspace::server {

void PointStore::Append(std::span<const double> coordinates) {
  coordinate_count_ += coordinates.size();
  while (!coordinates.empty()) {
    if (blocks_.empty() || blocks_.back().size() == kBlockSize) {
      blocks_.emplace_back();
      if (blocks_.size() > 1) {
        blocks_.back().reserve(kBlockSize);  // the first grows as it has to: small clouds stay small
      }
    }
    std::vector<double>& block = blocks_.back();
    const size_t count = std::min(coordinates.size(), kBlockSize - block.size());
    block.insert(block.end(), coordinates.begin(), coordinates.begin() + static_cast<std::ptrdiff_t>(count));
    coordinates = coordinates.subspan(count);
  }
}

absl::StatusOr<std::vector<double>> PointStore::CopyFrom(uint64_t first, const core::RunContext& context) const {
  std::vector<double> coordinates;
  coordinates.reserve(coordinate_count_ - first);
  size_t skip = first % kBlockSize;
  for (size_t i = first / kBlockSize; i < blocks_.size(); ++i, skip = 0) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    coordinates.insert(coordinates.end(), blocks_[i].begin() + static_cast<std::ptrdiff_t>(skip), blocks_[i].end());
  }
  return coordinates;
}

}  // namespace wellspace::server
