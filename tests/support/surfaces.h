// Surfaces in space for tests: boxes that share facets, spheres, fans, sheets, and all of them in other orders.
#ifndef WELLSPACE_TESTS_SUPPORT_SURFACES_H_
#define WELLSPACE_TESTS_SUPPORT_SURFACES_H_

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/features/surface_features.h"
#include "core/geometry/point.h"
#include "tests/support/clouds.h"

namespace wellspace::test {

struct TestSurface {
  std::vector<double> points = {};     // n x 3
  std::vector<uint32_t> corners = {};  // m x 3
  std::vector<int32_t> markers = {};   // m, or none

  uint32_t AddPoint(const core::Point<3>& p);
  void AddTriangle(const std::array<uint32_t, 3>& of, int32_t marker = 0);
  // A fan from the first corner.
  void AddPolygon(const std::vector<core::Point<3>>& polygon, int32_t marker = 0);
  // A sheet of steps x steps squares, of two triangles each, over a square from `low` to `high`, at a height.
  void AddSheet(double low, double high, int steps, int32_t marker,
                const std::function<double(double, double)>& height);
  uint64_t triangle_count() const { return corners.size() / 3; }
  // REQUIRES:   this outlives the result.
  core::SurfaceFeatures Features() const;
};

// A grid of boxes of materials, 0 for none: facets between boxes of different materials alone, over common points, with
// the marker 10 a + b for materials a < b.
TestSurface Boxes(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z,
                  const std::function<int(int, int, int)>& material);
// The unit cube.
TestSurface Cube();
// A sphere of 20 * 4^depth triangles.
TestSurface Sphere(int depth, const core::Point<3>& centre = {0, 0, 0}, double radius = 1);
// A sheet with the marker 7.
TestSurface Sheet(double low, double high, int steps, const std::function<double(double, double)>& height);
// The part `name` of tests/data/surfaces; its faces have fourth numbers for markers, or none.
TestSurface SurfaceOf(const std::string& name);
// Every triangle as four.
TestSurface Subdivided(const TestSurface& surface);
// Both, over points of their own.
TestSurface Joined(const TestSurface& one, const TestSurface& other);
// Each triangle over points of its own.
TestSurface Loose(const TestSurface& surface);
// The same with points and triangles in another order, and triangles that begin with another corner.
TestSurface Shuffled(const TestSurface& surface, SplitMix64& random);

// The seven complexes of materials and membranes, and the volumes of their bounded solids, ascending.
struct NamedComplex {
  const char* name;
  TestSurface surface;
  std::vector<double> volumes;
};
std::vector<NamedComplex> SevenComplexes();

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_SURFACES_H_
