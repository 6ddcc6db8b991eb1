// CGAL's Delaunay triangulations and exact predicates, as an oracle that shares no code with the core.
#ifndef WELLSPACE_TESTS_SUPPORT_CGAL_ORACLE_H_
#define WELLSPACE_TESTS_SUPPORT_CGAL_ORACLE_H_

#include <span>

#include "core/geometry/exact_measure.h"
#include "tests/support/meshes.h"

namespace wellspace::test {

// The Delaunay triangulation of distinct points (n x dimension, not all in one hyperplane), positively oriented, with
// the points numbered as given.
TestMesh CgalDelaunay(int dimension, std::span<const double> points);

// The regular triangulation of weighted points in 3-D (weights squared lengths, one a point), likewise.
TestMesh CgalRegular(std::span<const double> points, std::span<const double> weights);

// As core::Orientation and core::InSphere.
template <int D>
core::Sign CgalOrientation(const core::Simplex<D>& simplex);
template <int D>
core::Sign CgalInSphere(const core::Simplex<D>& simplex, const core::Point<D>& q);

extern template core::Sign CgalOrientation<2>(const core::Simplex<2>&);
extern template core::Sign CgalOrientation<3>(const core::Simplex<3>&);
extern template core::Sign CgalInSphere<2>(const core::Simplex<2>&, const core::Point<2>&);
extern template core::Sign CgalInSphere<3>(const core::Simplex<3>&, const core::Point<3>&);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_CGAL_ORACLE_H_
