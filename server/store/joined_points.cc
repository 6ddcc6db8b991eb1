#include "server/store/joined_points.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/status_macros.h"
#include "proto/checksum.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kBlock = uint64_t{1} << 17;  // coordinates: 1 MiB

}  // namespace

JoinedPoints::JoinedPoints(std::vector<std::unique_ptr<PointStore>> parts) : parts_(std::move(parts)) {
  for (size_t i = 0; i + 1 < parts_.size(); ++i) {
    first_of_last_ += parts_[i]->coordinate_count();
  }
}

absl::Status JoinedPoints::ForParts(uint64_t first, uint64_t end, const Take& take) const {
  uint64_t before = 0;
  for (const std::unique_ptr<PointStore>& part : parts_) {
    const uint64_t count = part->coordinate_count();
    const uint64_t from = std::max(first, before);
    const uint64_t to = std::min(end, before + count);
    if (from < to) {
      WELLSPACE_ASSIGN_OR_RETURN(const bool goes_on, take(*part, from - before, to - before));
      if (!goes_on) {
        break;
      }
    }
    before += count;
  }
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> JoinedPoints::CountEqual(uint64_t first, std::span<const double> coordinates) const {
  uint64_t equal = 0;
  WELLSPACE_RETURN_IF_ERROR(ForParts(
      first, first + coordinates.size(),
      [&](const PointStore& part, uint64_t from, uint64_t to) -> absl::StatusOr<bool> {
        WELLSPACE_ASSIGN_OR_RETURN(const uint64_t count, part.CountEqual(from, coordinates.subspan(equal, to - from)));
        equal += count;
        return count == to - from;
      }));
  return equal;
}

absl::StatusOr<uint32_t> JoinedPoints::Checksum(uint64_t first, uint64_t end) const {
  uint32_t checksum = 0;
  bool is_first = true;
  WELLSPACE_RETURN_IF_ERROR(
      ForParts(first, end, [&](const PointStore& part, uint64_t from, uint64_t to) -> absl::StatusOr<bool> {
        if (std::exchange(is_first, false)) {
          WELLSPACE_ASSIGN_OR_RETURN(checksum, part.Checksum(from, to));
          return true;
        }
        for (; from < to; from += std::min(kBlock, to - from)) {
          WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> block,
                                     part.Copy(from, from + std::min(kBlock, to - from), core::RunContext()));
          checksum = ExtendCrc32c(checksum, block.data(), block.size() * sizeof(double));
        }
        return true;
      }));
  return checksum;
}

absl::StatusOr<std::vector<double>> JoinedPoints::Copy(uint64_t first, uint64_t end,
                                                       const core::RunContext& context) const {
  std::vector<double> coordinates;
  coordinates.reserve(end - first);
  WELLSPACE_RETURN_IF_ERROR(
      ForParts(first, end, [&](const PointStore& part, uint64_t from, uint64_t to) -> absl::StatusOr<bool> {
        WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> copied, part.Copy(from, to, context));
        coordinates.insert(coordinates.end(), copied.begin(), copied.end());
        return true;
      }));
  return coordinates;
}

std::unique_ptr<PointStore> JoinPoints(const SessionPoints& points, const OpenPointsFile& open) {
  std::vector<store::v1::PointsFile> files = points.files;
  if (files.empty() || files.back().number() != points.next.number() || files.back().epoch() != points.next.epoch()) {
    files.push_back(points.next);
    const auto count = [](uint64_t sum, const store::v1::StepRecord::Points& step) { return sum + step.count(); };
    files.back().set_first(std::accumulate(points.committed.begin(), points.committed.end(), uint64_t{0}, count));
  }
  std::vector<std::unique_ptr<PointStore>> parts;
  auto piece = points.committed.begin();
  for (size_t i = 0; i < files.size(); ++i) {
    const bool is_last = i + 1 == files.size();
    std::vector<store::v1::StepRecord::Points> committed;
    for (; piece != points.committed.end() && (is_last || piece->first() < files[i + 1].first()); ++piece) {
      committed.push_back(*piece);
    }
    parts.push_back(open(files[i], is_last, std::move(committed)));
  }
  return parts.size() == 1 ? std::move(parts.front()) : std::make_unique<JoinedPoints>(std::move(parts));
}

}  // namespace wellspace::server
