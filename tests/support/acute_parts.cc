#include "tests/support/acute_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/geometry/directions.h"
#include "core/geometry/vector_product.h"

namespace wellspace::test {

TestSurface Wedge(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  TestSurface wedge;
  for (const double z : {0.0, 1.0}) {
    wedge.AddPoint({0, 0, z});
    wedge.AddPoint({1, 0, z});
    wedge.AddPoint({std::cos(angle), std::sin(angle), z});
  }
  constexpr std::array<std::array<uint32_t, 3>, 8> kTriangles = {
      {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}, {3, 4, 5}, {0, 2, 1}}};
  for (const std::array<uint32_t, 3>& triangle : kTriangles) {
    wedge.AddTriangle(triangle);
  }
  return wedge;
}

TestSurface AcuteTetrahedron(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  TestSurface surface;
  surface.AddPoint({0, 0, 0});
  surface.AddPoint({1, 0, 0});
  surface.AddPoint({0.5, 1, 0});
  surface.AddPoint({0.5, std::cos(angle), std::sin(angle)});
  constexpr std::array<std::array<uint32_t, 3>, 4> kTriangles = {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  for (const std::array<uint32_t, 3>& triangle : kTriangles) {
    surface.AddTriangle(triangle);
  }
  return surface;
}

TestSurface Cone(int sides, double height) {
  TestSurface surface;
  std::vector<uint32_t> rim;
  for (int i = 0; i < sides; ++i) {
    const double turn = 2 * std::numbers::pi * i / sides;
    rim.push_back(surface.AddPoint({std::cos(turn), std::sin(turn), 0}));
  }
  const uint32_t tip = surface.AddPoint({0, 0, height});
  const uint32_t middle = surface.AddPoint({0, 0, 0});
  for (int i = 0; i < sides; ++i) {
    surface.AddTriangle({rim[i], rim[(i + 1) % sides], tip});
    surface.AddTriangle({rim[(i + 1) % sides], rim[i], middle});
  }
  return surface;
}

TestSurface LensBar(int sides) {
  constexpr double kRadius = 1 / std::numbers::sqrt3;
  TestSurface bar;
  for (const double y : {0.0, 2.0}) {
    for (int i = 0; i <= sides; ++i) {
      const double turn = std::numbers::pi * (2.0 * i / sides - 1) / 3;
      bar.AddPoint({0.5 + kRadius * std::sin(turn), y, kRadius * (std::cos(turn) - 0.5)});
    }
  }
  const auto end = static_cast<uint32_t>(sides + 1);  // the first point at the other end
  for (uint32_t i = 0; i + 1 < end; ++i) {
    bar.AddTriangle({i, end + i, end + i + 1});
    bar.AddTriangle({i, end + i + 1, i + 1});
    if (i > 0) {
      bar.AddTriangle({0, i, i + 1});
      bar.AddTriangle({end, end + i + 1, end + i});
    }
  }
  bar.AddTriangle({0, end - 1, 2 * end - 1});
  bar.AddTriangle({0, 2 * end - 1, end});
  return bar;
}

TestSurface Wing(int sides) {
  TestSurface wing;
  const auto count = static_cast<uint32_t>(2 * sides);  // around the section, from the back over the upper side
  for (const double z : {0.0, 1.0}) {
    for (uint32_t i = 0; i < count; ++i) {
      const double turn = std::numbers::pi * i / sides;
      const double x = 0.5 * (1 + std::cos(turn));
      // NACA 0012, closed at the back.
      const double y =
          0.6 * (0.2969 * std::sqrt(x) - 0.126 * x - 0.3516 * x * x + 0.2843 * x * x * x - 0.1036 * x * x * x * x);
      wing.AddPoint({x, i == 0 ? 0 : std::sin(turn) > 0 ? y : -y, z});
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t next = (i + 1) % count;
    wing.AddTriangle({i, next, count + next});
    wing.AddTriangle({i, count + next, count + i});
  }
  for (uint32_t i = 1; 2 * i < count; ++i) {  // from the upper side to the lower one
    const uint32_t below = count - i;
    wing.AddTriangle({i - 1, below, i});
    wing.AddTriangle({count + i - 1, count + i, count + below});
    if (i > 1) {
      wing.AddTriangle({i - 1, below + 1, below});
      wing.AddTriangle({count + i - 1, count + below, count + below + 1});
    }
  }
  const auto half = static_cast<uint32_t>(sides);
  wing.AddTriangle({half - 1, half + 1, half});
  wing.AddTriangle({count + half - 1, count + half, count + half + 1});
  return wing;
}

TestSurface SpiralBar(double height) {
  constexpr int kSteps = 108;  // of three turns
  constexpr double kHalfWidth = 0.06;
  std::vector<std::array<core::Point<3>, 2>> pairs;  // outside and inside
  for (int i = 0; i <= kSteps; ++i) {
    const double turn = 6 * std::numbers::pi * i / kSteps;
    const double middle = 0.25 + 0.75 * i / kSteps;
    pairs.push_back({});
    for (int k = 0; k < 2; ++k) {
      const double radius = middle + (k == 0 ? kHalfWidth : -kHalfWidth);
      pairs.back()[k] = {radius * std::cos(turn), radius * std::sin(turn), 0};
    }
  }
  for (int k = 1; k < 4; ++k) {  // the round end
    const double turn = std::numbers::pi * k / 8;
    const double y = kHalfWidth * std::sin(turn);
    pairs.push_back({{{1 + kHalfWidth * std::cos(turn), y, 0}, {1 - kHalfWidth * std::cos(turn), y, 0}}});
  }
  std::vector<core::Point<3>> ring = {{0.25, -kHalfWidth / std::tan(std::numbers::pi / 9), 0}};
  for (const std::array<core::Point<3>, 2>& pair : pairs) {
    ring.push_back(pair[0]);
  }
  ring.push_back({1, kHalfWidth, 0});
  for (auto pair = pairs.rbegin(); pair != pairs.rend(); ++pair) {
    ring.push_back((*pair)[1]);
  }
  TestSurface bar;
  for (const double z : {0.0, height}) {
    for (core::Point<3> p : ring) {
      p[2] = z;
      bar.AddPoint(p);
    }
  }
  const auto count = static_cast<uint32_t>(ring.size());
  const auto add_to_both_ends = [&](uint32_t a, uint32_t b, uint32_t c) {
    bar.AddTriangle({a, c, b});
    bar.AddTriangle({count + a, count + b, count + c});
  };
  for (uint32_t i = 1; 2 * i < count; ++i) {  // pairs are as far from both ends of the ring
    add_to_both_ends(i - 1, i, count - i);
    if (i > 1) {
      add_to_both_ends(i - 1, count - i, count - i + 1);
    }
  }
  add_to_both_ends(count / 2 - 1, count / 2, count / 2 + 1);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t next = (i + 1) % count;
    bar.AddTriangle({i, next, count + next});
    bar.AddTriangle({i, count + next, count + i});
  }
  return bar;
}

double LeastAngleOfTetrahedron(const TestSurface& tetrahedron) {
  double least = 180;
  for (size_t i = 0; i < 4; ++i) {
    for (size_t k = 0; k < 4; ++k) {
      if (k == i) {
        continue;
      }
      const core::Point<3> a = core::PointAt<3>(tetrahedron.points, i);
      const core::Point<3> along = core::Difference<3>(core::PointAt<3>(tetrahedron.points, k), a);
      std::vector<core::Point<3>> ways;  // to the other two
      for (size_t j = 0; j < 4; ++j) {
        if (j != i && j != k) {
          ways.push_back(core::Difference<3>(core::PointAt<3>(tetrahedron.points, j), a));
        }
      }
      least = std::min({least, core::AngleBetween(along, ways[0]),
                        core::AngleBetween(core::Across(ways[0], along), core::Across(ways[1], along))});
    }
  }
  return least;
}

double VolumeWithin(const TestSurface& surface) {
  double volume = 0;  // of tetrahedra to the origin
  for (size_t t = 0; t < surface.corners.size(); t += 3) {
    std::array<core::Point<3>, 3> p;
    for (size_t k = 0; k < 3; ++k) {
      p[k] = core::PointAt<3>(surface.points, surface.corners[t + k]);
    }
    volume += core::Dot<3>(p[0], core::Cross(p[1], p[2])) / 6;
  }
  return std::abs(volume);
}

}  // namespace wellspace::test
