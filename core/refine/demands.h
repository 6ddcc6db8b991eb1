// What refinement has to bring about.
#ifndef WELLSPACE_CORE_REFINE_DEMANDS_H_
#define WELLSPACE_CORE_REFINE_DEMANDS_H_

#include "core/geometry/criterion.h"
#include "core/refine/sizing.h"

namespace wellspace::core {

template <int D>
struct Demands {
  Criterion criterion = Criterion::kRadiusEdge;
  double rho = 0;
  SizeField<D> sizes{};

  bool operator==(const Demands&) const = default;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_DEMANDS_H_
