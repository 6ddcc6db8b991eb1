// The goal of the refinement: the bounds that every simplex has to meet.
#ifndef WELLSPACE_CORE_REFINE_CRITERIA_H_
#define WELLSPACE_CORE_REFINE_CRITERIA_H_

#include "core/geometry/criterion.h"
#include "core/refine/sizing.h"

namespace wellspace::core {

template <int D>
struct MeshCriteria {
  Criterion criterion = Criterion::kRadiusEdge;
  double rho = 0;
  SizeField<D> sizes{};

  bool operator==(const MeshCriteria&) const = default;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_CRITERIA_H_
