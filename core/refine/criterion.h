// What refinement has to bring about.
#ifndef WELLSPACE_CORE_REFINE_CRITERION_H_
#define WELLSPACE_CORE_REFINE_CRITERION_H_

#include "core/refine/sizing.h"

namespace wellspace::core {

// What every simplex, or every vertex, has to be.
enum class Criterion {
  kRadiusEdge,  // circumradius <= rho * (its shortest edge); what Ruppert, Shewchuk, Triangle and TetGen promise
  kWellSpaced,  // [HT08]'s: no node of a vertex's Voronoi cell is farther from it than rho * (distance to its nearest
                // neighbour); stronger, and three to four times as many vertices
};

template <int D>
struct Demands {
  Criterion criterion = Criterion::kRadiusEdge;
  double rho = 0;
  SizeField<D> sizes{};

  bool operator==(const Demands&) const = default;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_CRITERION_H_
