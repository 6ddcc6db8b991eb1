#include "tests/support/surfaces.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>
#include <numeric>
#include <sstream>
#include <string>
#include <utility>

namespace wellspace::test {
namespace {

// Points by their places, each once.
class PointNumbers {
 public:
  explicit PointNumbers(TestSurface& surface) : surface_(surface) {}

  uint32_t operator()(const core::Point<3>& p) {
    const auto [at, is_new] = numbers_.try_emplace(p, 0);
    if (is_new) {
      at->second = surface_.AddPoint(p);
    }
    return at->second;
  }

 private:
  TestSurface& surface_;
  std::map<core::Point<3>, uint32_t> numbers_;
};

void AddFan(const std::vector<core::Point<3>>& polygon, int32_t marker, PointNumbers& number, TestSurface& surface) {
  for (size_t i = 2; i < polygon.size(); ++i) {
    surface.AddTriangle({number(polygon[0]), number(polygon[i - 1]), number(polygon[i])}, marker);
  }
}

core::Point<3> PointOf(const TestSurface& surface, uint32_t i) {
  return {surface.points[3 * size_t{i}], surface.points[3 * size_t{i} + 1], surface.points[3 * size_t{i} + 2]};
}

// A cube in whose walls two triangles end that are no part of it: a membrane from one side to half of its height.
TestSurface CubeWithWall() {
  TestSurface s;
  PointNumbers number(s);
  for (const double z : {0.0, 1.0}) {
    for (const double x : {0.0, 0.5}) {
      std::vector<core::Point<3>> ring = {{x, 0, z}, {x + 0.5, 0, z}, {x + 0.5, 1, z}, {x, 1, z}};
      AddFan(ring, z == 0 ? 1 : 2, number, s);
    }
  }
  for (const double y : {0.0, 1.0}) {
    for (const double x : {0.0, 0.5}) {
      const double middle = 0.5;
      const double far = x == 0 ? 0.0 : 1.0;
      AddFan({{far, y, 0}, {middle, y, 0}, {middle, y, 0.5}, {middle, y, 1}, {far, y, 1}}, 3, number, s);
    }
  }
  for (const double x : {0.0, 1.0}) {
    AddFan({{x, 0, 0}, {x, 1, 0}, {x, 1, 1}, {x, 0, 1}}, 3, number, s);
  }
  AddFan({{0.5, 0, 0}, {0.5, 1, 0}, {0.5, 1, 0.5}, {0.5, 0, 0.5}}, 99, number, s);
  return s;
}

}  // namespace

uint32_t TestSurface::AddPoint(const core::Point<3>& p) {
  points.insert(points.end(), p.begin(), p.end());
  return static_cast<uint32_t>(points.size() / 3 - 1);
}

void TestSurface::AddTriangle(const std::array<uint32_t, 3>& of, int32_t marker) {
  corners.insert(corners.end(), of.begin(), of.end());
  markers.push_back(marker);
}

void TestSurface::AddPolygon(const std::vector<core::Point<3>>& polygon, int32_t marker) {
  std::vector<uint32_t> own;
  for (const core::Point<3>& p : polygon) {
    own.push_back(AddPoint(p));
  }
  for (size_t i = 2; i < own.size(); ++i) {
    AddTriangle({own[0], own[i - 1], own[i]}, marker);
  }
}

void TestSurface::AddSheet(double low, double high, int steps, int32_t marker,
                           const std::function<double(double, double)>& height) {
  std::vector<uint32_t> numbers;
  for (int i = 0; i <= steps; ++i) {
    for (int k = 0; k <= steps; ++k) {
      const double x = low + (high - low) * i / steps;
      const double y = low + (high - low) * k / steps;
      numbers.push_back(AddPoint({x, y, height(x, y)}));
    }
  }
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < steps; ++k) {
      const auto at = [&](int di, int dk) { return numbers[static_cast<size_t>((i + di) * (steps + 1) + k + dk)]; };
      AddTriangle({at(0, 0), at(1, 0), at(1, 1)}, marker);
      AddTriangle({at(0, 0), at(1, 1), at(0, 1)}, marker);
    }
  }
}

TestSurface Sheet(double low, double high, int steps, const std::function<double(double, double)>& height) {
  TestSurface surface;
  surface.AddSheet(low, high, steps, 7, height);
  return surface;
}

core::SurfaceFeatures TestSurface::Features() const {
  core::SurfaceFeatures features;
  features.corners = corners;
  features.markers = markers;
  return features;
}

TestSurface Boxes(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z,
                  const std::function<int(int, int, int)>& material) {
  const std::array<const std::vector<double>*, 3> grid = {&x, &y, &z};
  const std::array<int, 3> count = {static_cast<int>(x.size()) - 1, static_cast<int>(y.size()) - 1,
                                    static_cast<int>(z.size()) - 1};
  const auto at = [&](const std::array<int, 3>& box) {
    for (size_t axis = 0; axis < 3; ++axis) {
      if (box[axis] < 0 || box[axis] >= count[axis]) {
        return 0;
      }
    }
    return material(box[0], box[1], box[2]);
  };
  TestSurface surface;
  PointNumbers number(surface);
  for (size_t axis = 0; axis < 3; ++axis) {
    std::array<int, 3> end = count;
    ++end[axis];
    for (int i = 0; i < end[0]; ++i) {
      for (int j = 0; j < end[1]; ++j) {
        for (int k = 0; k < end[2]; ++k) {
          const std::array<int, 3> box = {i, j, k};
          std::array<int, 3> lower = box;
          --lower[axis];
          const int a = at(lower);
          const int b = at(box);
          if (a == b) {
            continue;
          }
          const size_t u = (axis + 1) % 3;
          const size_t v = (axis + 2) % 3;
          std::vector<core::Point<3>> ring;
          for (const auto& [du, dv] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
            core::Point<3> p;
            for (size_t t = 0; t < 3; ++t) {
              p[t] = (*grid[t])[static_cast<size_t>(box[t] + (t == u ? du : t == v ? dv : 0))];
            }
            ring.push_back(p);
          }
          if (a == 0) {
            std::reverse(ring.begin(), ring.end());
          }
          AddFan(ring, 10 * std::min(a, b) + std::max(a, b), number, surface);
        }
      }
    }
  }
  return surface;
}

TestSurface Cube() {
  return Boxes({0, 1}, {0, 1}, {0, 1}, [](int, int, int) { return 1; });
}

TestSurface Sphere(int depth, const core::Point<3>& centre, double radius) {
  const double golden = std::numbers::phi;
  TestSurface unit;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-golden, golden}) {
      unit.AddPoint({0, a, b});
      unit.AddPoint({a, b, 0});
      unit.AddPoint({b, 0, a});
    }
  }
  // The corners of a triangle are all at the shortest distance from each other.
  for (uint32_t i = 0; i < 12; ++i) {
    for (uint32_t j = 0; j < 12; ++j) {
      for (uint32_t k = 0; k < 12; ++k) {
        const auto near = [&](uint32_t s, uint32_t t) {
          return std::abs(core::DistanceSq<3>(PointOf(unit, s), PointOf(unit, t)) - 4) < 0.1;
        };
        const core::Point<3> a = PointOf(unit, i);
        const core::Point<3> b = PointOf(unit, j);
        const core::Point<3> c = PointOf(unit, k);
        const double turn = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                            a[2] * (b[0] * c[1] - b[1] * c[0]);
        if (i < j && i < k && near(i, j) && near(j, k) && near(k, i) && turn > 0) {
          unit.AddTriangle({i, j, k});
        }
      }
    }
  }
  for (int level = 0; level < depth; ++level) {
    unit = Subdivided(unit);
  }
  for (size_t i = 0; i < unit.points.size(); i += 3) {
    const double length = std::hypot(unit.points[i], unit.points[i + 1], unit.points[i + 2]);
    for (size_t axis = 0; axis < 3; ++axis) {
      unit.points[i + axis] = centre[axis] + radius * unit.points[i + axis] / length;
    }
  }
  return unit;
}

TestSurface Subdivided(const TestSurface& surface) {
  TestSurface out;
  out.points = surface.points;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [at, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)}, 0);
    if (is_new) {
      core::Point<3> p;
      for (size_t axis = 0; axis < 3; ++axis) {
        p[axis] = 0.5 * (PointOf(surface, a)[axis] + PointOf(surface, b)[axis]);
      }
      at->second = out.AddPoint(p);
    }
    return at->second;
  };
  for (size_t t = 0; t < surface.triangle_count(); ++t) {
    const uint32_t a = surface.corners[3 * t];
    const uint32_t b = surface.corners[3 * t + 1];
    const uint32_t c = surface.corners[3 * t + 2];
    const uint32_t ab = middle(a, b);
    const uint32_t bc = middle(b, c);
    const uint32_t ca = middle(c, a);
    for (const std::array<uint32_t, 3>& part :
         {std::array<uint32_t, 3>{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
      out.AddTriangle(part, surface.markers[t]);
    }
  }
  return out;
}

TestSurface Joined(const TestSurface& one, const TestSurface& other) {
  TestSurface out = one;
  const auto before = static_cast<uint32_t>(one.points.size() / 3);
  out.points.insert(out.points.end(), other.points.begin(), other.points.end());
  for (const uint32_t corner : other.corners) {
    out.corners.push_back(before + corner);
  }
  out.markers.insert(out.markers.end(), other.markers.begin(), other.markers.end());
  return out;
}

TestSurface Loose(const TestSurface& surface) {
  TestSurface out;
  for (const uint32_t corner : surface.corners) {
    out.corners.push_back(out.AddPoint(PointOf(surface, corner)));
  }
  out.markers = surface.markers;
  return out;
}

TestSurface Shuffled(const TestSurface& surface, SplitMix64& random) {
  const auto order_of = [&random](size_t count) {
    std::vector<uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    for (size_t i = count; i > 1; --i) {
      std::swap(order[i - 1], order[random.Below(i)]);
    }
    return order;
  };
  TestSurface out;
  std::vector<uint32_t> number(surface.points.size() / 3);
  for (const uint32_t point : order_of(number.size())) {
    number[point] = out.AddPoint(PointOf(surface, point));
  }
  for (const uint32_t t : order_of(surface.triangle_count())) {
    std::array<uint32_t, 3> corners;
    const uint64_t turn = random.Below(3);
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = number[surface.corners[3 * size_t{t} + (k + turn) % 3]];
    }
    out.AddTriangle(corners, surface.markers[t]);
  }
  return out;
}

std::vector<NamedComplex> SevenComplexes() {
  std::vector<NamedComplex> all;
  all.push_back({"twocubes", Boxes({0, 1, 2}, {0, 1}, {0, 1}, [](int i, int, int) { return i + 1; }), {1, 1}});
  const std::vector<double> third = {0, .35, .65, 1};
  all.push_back({"cube_in_cube",
                 Boxes(third, third, third, [](int i, int j, int k) { return i == 1 && j == 1 && k == 1 ? 2 : 1; }),
                 {0.027, 0.973}});
  all.push_back(
      {"layers3", Boxes({0, 1}, {0, 1}, {0, .3, .45, 1}, [](int, int, int k) { return k + 1; }), {0.15, 0.3, 0.55}});
  const std::vector<double> half = {0, .5, 1};
  all.push_back({"junctions4",
                 Boxes(half, half, half, [](int i, int j, int k) { return k == 0   ? 1
                                                                          : j == 0 ? 2
                                                                          : i == 0 ? 3
                                                                                   : 4; }),
                 {0.125, 0.125, 0.25, 0.5}});
  all.push_back({"checker",
                 Boxes(half, half, half, [](int i, int j, int k) { return (i + j + k) % 2; }),
                 {0.125, 0.125, 0.125, 0.125}});
  TestSurface fin = Cube();
  fin.AddPolygon({{.3, .3, .5}, {.7, .3, .5}, {.7, .7, .5}, {.3, .7, .5}}, 99);
  all.push_back({"fin_free", fin, {1}});
  all.push_back({"fin_wall", CubeWithWall(), {1}});
  return all;
}

TestSurface SurfaceOf(const std::string& name) {
  const char* const folder = std::getenv("WELLSPACE_DATA_DIR");
  std::ifstream file((folder == nullptr ? std::string("tests/data") : folder) + "/surfaces/" + name + ".off");
  std::string word;
  size_t points = 0;
  size_t faces = 0;
  size_t edges = 0;
  file >> word >> points >> faces >> edges;
  TestSurface surface;
  surface.points.resize(3 * points);
  for (double& x : surface.points) {
    file >> x;
  }
  std::getline(file, word);
  for (size_t f = 0; f < faces; ++f) {
    std::getline(file, word);
    std::istringstream row(word);
    int count = 0;
    std::array<uint32_t, 3> of{};
    int32_t marker = 0;
    row >> count >> of[0] >> of[1] >> of[2];
    row >> marker;
    surface.AddTriangle(of, marker);
  }
  return surface;
}

}  // namespace wellspace::test
