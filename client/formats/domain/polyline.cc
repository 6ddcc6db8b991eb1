#include "client/formats/domain/polyline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"
#include "client/formats/orientation.h"

namespace wellspace::formats {
namespace {

bool AreEqual(std::span<const double> positions, size_t a, size_t b) {
  return positions[2 * a] == positions[2 * b] && positions[2 * a + 1] == positions[2 * b + 1];
}

bool AreOnALine(std::span<const double> positions) {
  size_t second = 1;
  while (AreEqual(positions, 0, second)) {
    ++second;
  }
  for (size_t i = second + 1; i < positions.size() / 2; ++i) {
    const std::array<double, 6> corners = {positions[0],          positions[1],
                                           positions[2 * second], positions[2 * second + 1],
                                           positions[2 * i],      positions[2 * i + 1]};
    if (OrientationSign(corners) != 0) {
      return false;
    }
  }
  return true;
}

// Whether a path there and back is all of a ring.
bool AreEdgesEven(std::span<const double> positions) {
  using Position = std::array<double, 2>;
  std::vector<std::pair<Position, Position>> edges;
  const size_t count = positions.size() / 2;
  for (size_t i = 0; i < count; ++i) {
    const size_t j = i + 1 == count ? 0 : i + 1;
    const Position from = {positions[2 * i], positions[2 * i + 1]};
    const Position to = {positions[2 * j], positions[2 * j + 1]};
    if (from != to) {
      edges.emplace_back(std::min(from, to), std::max(from, to));
    }
  }
  std::sort(edges.begin(), edges.end());
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end] == edges[begin]) {
      ++end;
    }
    if ((end - begin) % 2 != 0) {
      return false;
    }
  }
  return true;
}

}  // namespace

int CountDifferent(std::span<const double> positions) {
  const size_t count = positions.size() / 2;
  size_t second = 0;
  while (second < count && AreEqual(positions, 0, second)) {
    ++second;
  }
  for (size_t i = second + 1; i < count; ++i) {
    if (!AreEqual(positions, 0, i) && !AreEqual(positions, second, i)) {
      return 3;
    }
  }
  return second < count ? 2 : static_cast<int>(second > 0);
}

bool IsFlat(std::span<const double> positions) {
  if (CountDifferent(positions) < 3) {
    return true;
  }
  const size_t count = positions.size() / 2;
  const auto next = [&](size_t i) { return i + 1 == count ? 0 : i + 1; };
  double sum = 0;
  double magnitude = 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t j = next(i);
    const double term = (positions[2 * i] - positions[0]) * (positions[2 * j + 1] - positions[1]) -
                        (positions[2 * i + 1] - positions[1]) * (positions[2 * j] - positions[0]);
    sum += term;
    magnitude += std::abs(term);
  }
  constexpr double kSurelyNotFlat = 1e-6;
  if (std::abs(sum) > kSurelyNotFlat * magnitude && std::isfinite(sum)) {
    return false;
  }
  return AreOnALine(positions) || AreEdgesEven(positions);
}

absl::Status AddPolyline(std::span<const double> positions, const LineIndex* lines, bool is_ring,
                         PlanarDomain& domain) {
  const size_t count = positions.size() / 2;
  const uint64_t first = domain.point_count();
  if (count > kMaxCount - first) {
    return absl::InvalidArgumentError(absl::StrCat("expected at most ", kMaxCount, " points, got more"));
  }
  size_t end = count;
  while (end > 1 && AreEqual(positions, 0, end - 1)) {
    --end;
  }
  const bool is_closed = end < count;
  domain.repeated_points += is_closed ? count - end - 1 : 0;
  domain.unclosed_rings += is_ring && !is_closed ? 1 : 0;
  uint64_t line = 0;
  for (size_t i = 0; i < end; ++i) {
    if (i > 0 && AreEqual(positions, i - 1, i)) {
      ++domain.repeated_points;
      continue;
    }
    domain.points.push_back(positions[2 * i]);
    domain.points.push_back(positions[2 * i + 1]);
    const auto last = static_cast<uint32_t>(domain.point_count() - 1);
    if (i > 0) {
      domain.segments.insert(domain.segments.end(), {last - 1, last});
      domain.segment_lines.Add(line);
    }
    line = lines == nullptr ? i : lines->LineOf(i);
    domain.point_lines.Add(line);
  }
  const auto last = static_cast<uint32_t>(domain.point_count() - 1);
  if ((is_ring || is_closed) && last > first) {
    domain.segments.insert(domain.segments.end(), {last, static_cast<uint32_t>(first)});
    domain.segment_lines.Add(line);
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
