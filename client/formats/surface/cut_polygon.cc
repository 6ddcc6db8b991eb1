#include "client/formats/surface/cut_polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

using Place = std::array<double, 2>;

// Twice the area of a triangle, above 0 if it is counterclockwise.
double Area(const Place& a, const Place& b, const Place& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// The corners in the projection along the axis that is nearest to the normal, from the side that sees them
// counterclockwise.
std::vector<Place> Project(std::span<const double> points, const std::vector<uint32_t>& corners) {
  const auto at = [&](size_t i, int axis) { return points[3 * size_t{corners[i]} + static_cast<size_t>(axis)]; };
  std::array<double, 3> normal{};  // Newell's
  for (size_t i = 1; i + 1 < corners.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      normal[static_cast<size_t>(axis)] +=
          (at(i, u) - at(0, u)) * (at(i + 1, v) - at(0, v)) - (at(i, v) - at(0, v)) * (at(i + 1, u) - at(0, u));
    }
  }
  int along = 0;
  for (int axis = 1; axis < 3; ++axis) {
    along = std::abs(normal[static_cast<size_t>(axis)]) > std::abs(normal[static_cast<size_t>(along)]) ? axis : along;
  }
  int u = (along + 1) % 3;
  int v = (along + 2) % 3;
  if (normal[static_cast<size_t>(along)] < 0) {
    std::swap(u, v);
  }
  std::vector<Place> places;
  places.reserve(corners.size());
  for (size_t i = 0; i < corners.size(); ++i) {
    places.push_back({at(i, u), at(i, v)});
  }
  return places;
}

bool IsConvex(const std::vector<Place>& places) {
  const size_t count = places.size();
  for (size_t i = 0; i < count; ++i) {
    if (!(Area(places[i], places[(i + 1) % count], places[(i + 2) % count]) > 0)) {
      return false;
    }
    if (i + 2 < count && !(Area(places[0], places[i + 1], places[i + 2]) > 0)) {
      return false;  // it goes around more than once
    }
  }
  return true;
}

// Whether a corner of the ring, other than those of the ear at `i`, is in the ear; on its border, too, if `closed`.
bool IsTaken(const std::vector<Place>& places, const std::vector<uint32_t>& ring, size_t i, bool closed) {
  const size_t count = ring.size();
  const Place& a = places[ring[(i + count - 1) % count]];
  const Place& b = places[ring[i]];
  const Place& c = places[ring[(i + 1) % count]];
  for (size_t k = 2; k + 1 < count; ++k) {
    const Place& p = places[ring[(i + k) % count]];
    if (p == a || p == b || p == c) {
      continue;
    }
    const double least = std::min({Area(a, b, p), Area(b, c, p), Area(c, a, p)});
    if (least > 0 || (closed && least == 0)) {
      return true;
    }
  }
  return false;
}

absl::Status CrossesError(size_t corners) {
  return absl::InvalidArgumentError(
      absl::StrCat("expected a polygon whose sides do not cross or touch each other, got "
                   "one of ",
                   corners, " corners whose sides do; cut it into triangles"));
}

// Cuts off one corner after the other whose triangle has no other corner in it, nor, as long as there is one, on its
// border.
absl::Status CutEars(const std::vector<uint32_t>& corners, const std::vector<Place>& places,
                     std::vector<uint32_t>& triangles) {
  std::vector<uint32_t> ring(corners.size());
  std::iota(ring.begin(), ring.end(), 0);
  const size_t before = triangles.size();
  bool closed = true;
  size_t i = 0;
  size_t tried = 0;
  while (ring.size() >= 3) {
    const size_t count = ring.size();
    i %= count;
    const uint32_t a = ring[(i + count - 1) % count];
    const uint32_t b = ring[i];
    const uint32_t c = ring[(i + 1) % count];
    if (Area(places[a], places[b], places[c]) > 0 && !IsTaken(places, ring, i, closed)) {
      triangles.insert(triangles.end(), {corners[a], corners[b], corners[c]});
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
      ++i;  // the next ear beside this one would make a fan of needles
      tried = 0;
      closed = true;
      continue;
    }
    ++i;
    if (++tried == count) {
      if (!closed) {
        triangles.resize(before);
        return CrossesError(corners.size());
      }
      tried = 0;
      closed = false;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CutPolygon(std::span<const double> points, std::span<const uint32_t> corners,
                        std::vector<uint32_t>& triangles) {
  std::vector<uint32_t> own;
  for (const uint32_t corner : corners) {
    if (own.empty() || own.back() != corner) {
      own.push_back(corner);
    }
  }
  while (own.size() > 1 && own.back() == own.front()) {
    own.pop_back();
  }
  if (own.size() <= 3) {
    // Without an area it is a triangle all the same, which is counted where triangles are cleaned.
    const auto corner = [&](size_t i) { return own[std::min(i, own.size() - 1)]; };
    triangles.insert(triangles.end(), {corner(0), corner(1), corner(2)});
    return absl::OkStatus();
  }
  const std::vector<Place> places = Project(points, own);
  if (IsConvex(places)) {
    for (size_t i = 1; i + 1 < own.size(); ++i) {
      triangles.insert(triangles.end(), {own[0], own[i], own[i + 1]});
    }
    return absl::OkStatus();
  }
  if (own.size() > kMostEars) {
    return absl::InvalidArgumentError(absl::StrCat("expected a polygon that is convex, or has at most ", kMostEars,
                                                   " corners, got one of ", own.size(), " that is not"));
  }
  return CutEars(own, places, triangles);
}

}  // namespace wellspace::formats
