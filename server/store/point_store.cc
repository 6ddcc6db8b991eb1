#include "server/store/point_store.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"

namespace wellspace::server {

absl::Status MemoryPoints::Append(std::span<const double> coordinates) {
  const uint64_t before = coordinate_count_;
  auto take_back = absl::MakeCleanup([this, before] { Truncate(before); });
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
    coordinate_count_ += count;
    coordinates = coordinates.subspan(count);
  }
  std::move(take_back).Cancel();
  return absl::OkStatus();
}

void MemoryPoints::Truncate(uint64_t count) {
  while (!blocks_.empty() && coordinate_count_ > count) {
    std::vector<double>& block = blocks_.back();
    const uint64_t excess = std::min<uint64_t>(coordinate_count_ - count, block.size());
    block.resize(block.size() - excess);
    coordinate_count_ -= excess;
    if (block.empty()) {
      blocks_.pop_back();
    }
  }
  if (!blocks_.empty() && blocks_.back().empty()) {
    blocks_.pop_back();
  }
}

std::span<const double> MemoryPoints::PieceFrom(uint64_t first, uint64_t end) const {
  const std::span<const double> block(blocks_[first / kBlockSize]);
  const uint64_t skip = first % kBlockSize;
  return block.subspan(skip, std::min<uint64_t>(end - first, block.size() - skip));
}

absl::StatusOr<std::vector<double>> MemoryPoints::Copy(uint64_t first, uint64_t end,
                                                       const core::RunContext& context) const {
  std::vector<double> coordinates;
  coordinates.reserve(end - first);
  while (first < end) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const std::span<const double> piece = PieceFrom(first, end);
    coordinates.insert(coordinates.end(), piece.begin(), piece.end());
    first += piece.size();
  }
  return coordinates;
}

absl::StatusOr<uint64_t> MemoryPoints::CountEqual(uint64_t first, std::span<const double> coordinates) const {
  uint64_t equal = 0;
  while (equal < coordinates.size()) {
    const std::span<const double> piece = PieceFrom(first + equal, first + coordinates.size());
    const std::span<const double> other = coordinates.subspan(equal, piece.size());
    if (std::memcmp(piece.data(), other.data(), piece.size_bytes()) != 0) {
      const auto is_same = [](double a, double b) { return std::memcmp(&a, &b, sizeof(a)) == 0; };
      return equal + (std::mismatch(piece.begin(), piece.end(), other.begin(), is_same).first - piece.begin());
    }
    equal += piece.size();
  }
  return equal;
}

absl::StatusOr<uint32_t> MemoryPoints::Checksum(uint64_t first, uint64_t end) const {
  uint32_t checksum = 0;
  while (first < end) {
    const std::span<const double> piece = PieceFrom(first, end);
    checksum = ExtendCrc32c(checksum, piece.data(), piece.size_bytes());
    first += piece.size();
  }
  return checksum;
}

}  // namespace wellspace::server
