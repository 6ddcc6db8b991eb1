// Clouds that are hard on refinement: features of all scales beside each other and beside the faces of the box.
#ifndef WELLSPACE_TESTS_SUPPORT_ADVERSARIAL_CLOUDS_H_
#define WELLSPACE_TESTS_SUPPORT_ADVERSARIAL_CLOUDS_H_

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::test {

// near-faces: 1e-1 to 1e-12 from a random face, evenly in the logarithm. near-corners: so far from D faces that meet.
// pairs: two points each, that far apart. closest: pairs, and points beside faces and corners, as close as input may
// be. diagonals: exactly on the diagonals of the box. wedge: on two segments that meet at an angle of 1e-3. sheets: on
// two parallel lines or planes 1e-4 apart. moment: on the moment curve. skew: on two skew lines (2-D: parallel ones).
// cospherical: exactly on one circle or sphere. perturbed: a grid, one point of which is moved by 1e-9 of its spacing.
// kinds: a few points of each of the others.
inline constexpr std::array<std::string_view, 12> kAdversarialKinds = {
    "near-faces", "near-corners", "pairs", "closest",     "diagonals", "wedge",
    "sheets",     "moment",       "skew",  "cospherical", "perturbed", "kinds"};

// About n points of the unit box, others for another seed.
//
// REQUIRES:   kind is one of the above or of clouds.h.
template <int D>
std::vector<core::Point<D>> AdversarialCloud(std::string_view kind, size_t n, uint64_t seed);

// The least distance at which the mesher accepts two points in `box`, or a point and a face that it does not lie on.
template <int D>
double LeastSeparation(const core::Box<D>& box);

// The bounding box of the points, grown on every side by `margin` times its longest side; where it is flatter than a
// hundredth of that, by half of it.
template <int D>
core::Box<D> BoxAround(const std::vector<core::Point<D>>& points, double margin);

// The points that the mesher would accept in `box`, as QueryStructure wants them: sorted, and those left out that are
// outside or too close to an earlier one, to a corner, or to a face that they do not lie on.
template <int D>
std::vector<core::Point<D>> Accepted(const core::Box<D>& box, const std::vector<core::Point<D>>& points);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_ADVERSARIAL_CLOUDS_H_
