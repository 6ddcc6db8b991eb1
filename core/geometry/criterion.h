// The demands on the simplices of a mesh.
#ifndef WELLSPACE_CORE_GEOMETRY_CRITERION_H_
#define WELLSPACE_CORE_GEOMETRY_CRITERION_H_

#include <array>
#include <cstddef>
#include <vector>

#include "core/base/dimensions.h"

namespace wellspace::core {

// The property that every simplex has to have.
enum class Criterion {
  kRadiusEdge,  // circumradius <= rho * (its shortest edge); the promise of Ruppert, Shewchuk, Triangle and TetGen
  kWellSpaced,  // [HT08]'s: no node of a vertex's Voronoi cell is farther from it than rho * (distance to its nearest
                // neighbour); stronger, and about two and a half times as many vertices
};

// A box in which simplices are small.
struct SizeBox {
  std::vector<double> low;   // dimension
  std::vector<double> high;  // dimension
  // No simplex whose circumball meets the box has a larger circumradius.
  double max_circumradius = 0;
};

// The length that a size bounds.
enum class SizeMeasure {
  kCircumradius,  // no simplex has a larger one
  kEdgeLength,    // edges have about this length, on average
};

// Sizes at points, from which they grow no faster than a gradation times the distance.
struct SizeSamples {
  std::vector<double> points;  // n x dimension, row-major
  std::vector<double> sizes;   // n
  SizeMeasure measure = SizeMeasure::kCircumradius;

  bool operator==(const SizeSamples&) const = default;

  size_t bytes() const { return (points.size() + sizes.size()) * sizeof(double); }
};

// From samples at a gradation of 1, sizes would grow as fast as circumcentres may be away: a sample alone would ask for
// one vertex, not for small simplices about it.
inline constexpr double kDefaultSampleGradation = 0.3;

// The bound on circumradii under which edges have `edge_length` on average, as measured in empty boxes at the default
// rho.
//
// REQUIRES:   kMinDimension <= dimension <= kMaxDimension.
// Source:     docs/design/refine.md, sizes.
inline double CircumradiusOf(double edge_length, int dimension) {
  // A regular simplex has sqrt(d / (2 (d + 1))); simplices of a mesh are smaller than the bound allows, and have
  // shorter edges: 1.27 times as much in 2-D, 1.22 times in 3-D.
  constexpr std::array<double, kMaxDimension + 1> kPerEdge = {0, 0, 0.733, 0.747, 0.76, 0.83, 0.83};
  return kPerEdge[dimension] * edge_length;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_CRITERION_H_
