#include "client/point_source.h"

#include <algorithm>

namespace wellspace::client {

absl::Status SpanSource::Seek(uint64_t first) {
  next_ = std::min<uint64_t>(first, points_.size() / dimension_) * dimension_;
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> SpanSource::Read(std::span<double> rows) {
  const std::span<const double> part = points_.subspan(next_, std::min<uint64_t>(rows.size(), points_.size() - next_));
  std::copy(part.begin(), part.end(), rows.begin());
  next_ += part.size();
  return part.size() / dimension_;
}

}  // namespace wellspace::client
