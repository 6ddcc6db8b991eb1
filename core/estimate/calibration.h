// The expected number of vertices that refinement adds, by integrals of the local feature size: the model of
// docs/design/estimate.md.
#ifndef WELLSPACE_CORE_ESTIMATE_CALIBRATION_H_
#define WELLSPACE_CORE_ESTIMATE_CALIBRATION_H_

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/refine/criteria.h"

namespace wellspace::core {

// The integrals that vertices are counted by. Integrals over the box are of lfs^-D times Grading, those over its faces
// of (distance to the second nearest point)^-(D-1).
enum Term {
  kPoints,      // where two points decide about lfs
  kNearFace,    // where a point and a face of the box do
  kOpposite,    // where two opposite faces do: long or flat boxes
  kEncroached,  // of the faces, where the nearest vertex does not lie on the face
  kOnFace,      // of the faces, where it does
  kTerms,
};

using Terms = std::array<double, kTerms>;

inline double Sum(const Terms& terms) { return std::accumulate(terms.begin(), terms.end(), 0.0); }

// The volume of the unit ball; 1 / it is the number of uniformly random points per unit of the integral of lfs^-D.
template <int D>
double BallVolume() {
  return std::pow(std::numbers::pi, 0.5 * D) / std::tgamma(0.5 * D + 1);
}

// Vertices per unit of each integral, for these criteria. Above 3-D by analogy.
template <int D>
Terms VerticesPerTerm(const MeshCriteria<D>& criteria);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_CALIBRATION_H_
