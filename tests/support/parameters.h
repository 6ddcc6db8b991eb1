// Parameters as tests want them.
#ifndef WELLSPACE_TESTS_SUPPORT_PARAMETERS_H_
#define WELLSPACE_TESTS_SUPPORT_PARAMETERS_H_

#include "core/input/mesh_parameters.h"
#include "tests/support/clouds.h"

namespace wellspace::test {

// The defaults, in the unit box.
inline core::MeshParameters InUnitBox(int dimension) {
  core::MeshParameters parameters;
  parameters.dimension = dimension;
  parameters.domain_low = UnitLow(dimension);
  parameters.domain_high = UnitHigh(dimension);
  return parameters;
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_PARAMETERS_H_
