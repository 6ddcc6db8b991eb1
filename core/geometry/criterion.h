// What is asked of the simplices of a mesh.
#ifndef WELLSPACE_CORE_GEOMETRY_CRITERION_H_
#define WELLSPACE_CORE_GEOMETRY_CRITERION_H_

#include <vector>

namespace wellspace::core {

// What every simplex has to be.
enum class Criterion {
  kRadiusEdge,  // circumradius <= rho * (its shortest edge); what Ruppert, Shewchuk, Triangle and TetGen promise
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

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_CRITERION_H_
