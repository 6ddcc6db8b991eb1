// Surfaces with creases at small angles, for tests.
#ifndef WELLSPACE_TESTS_SUPPORT_ACUTE_PARTS_H_
#define WELLSPACE_TESTS_SUPPORT_ACUTE_PARTS_H_

#include "tests/support/surfaces.h"

namespace wellspace::test {

// A prism of length 1 over a triangle with two sides of length 1 that make this angle.
TestSurface Wedge(double degrees);
// A tetrahedron with that angle at one of its edges, which has length 1.
TestSurface AcuteTetrahedron(double degrees);
// A cone over a regular polygon with so many corners on a circle of radius 1, of that height.
TestSurface Cone(int sides, double height);
// A bar of length 2 whose section is a chord of length 1 under an arc of so many sides: they meet at 60 degrees.
TestSurface LensBar(int sides);
// A wing of length 1: a section of length 1, round in front and sharp at the back, of so many sides above and below.
TestSurface Wing(int sides);
// A bar so high whose section winds around its end at the middle, a cusp of 40 degrees.
TestSurface SpiralBar(double height);

// The smallest angle of a tetrahedron, between two of its faces or two sides of one. Unit: degrees.
double LeastAngleOfTetrahedron(const TestSurface& tetrahedron);

// The volume within a closed surface.
double VolumeWithin(const TestSurface& surface);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_ACUTE_PARTS_H_
