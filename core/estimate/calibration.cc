#include "core/estimate/calibration.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

// Vertices that refinement adds per unit of each integral, at one rho and by one criterion.
struct Calibration {
  double rho;
  Terms vertices;
};

// clang-format off
constexpr Calibration kRadiusEdge2[] = {
    {1.0,    {2.03, 2.54, 0.54, 0.00, 0.00}},
    {1.2,    {1.22, 1.73, 0.57, 0.00, 0.04}},
    {1.4142, {0.80, 1.48, 0.52, 0.00, 0.12}},
    {2.0,    {0.54, 1.00, 0.44, 0.12, 0.02}},
    {3.0,    {0.32, 0.46, 0.57, 0.02, 0.00}},
    {5.0,    {0.19, 0.29, 0.55, 0.33, 0.02}},
    {10.0,   {0.10, 0.20, 0.06, 0.52, 0.06}},
    {30.0,   {0.06, 0.08, 0.00, 0.85, 0.05}},
    {1000.0, {0.02, 0.00, 0.00, 0.85, 0.04}},
};
constexpr Calibration kRadiusEdge3[] = {
    {1.2,    {6.56, 10.96, 0.55, 1.09, 6.82}},
    {1.5,    {2.21,  2.97, 0.47, 0.29, 0.84}},
    {2.0,    {1.05,  1.23, 0.47, 0.53, 0.22}},
    {3.0,    {0.54,  0.49, 0.47, 0.77, 0.08}},
    {5.0,    {0.29,  0.34, 0.48, 0.73, 0.05}},
    {10.0,   {0.16,  0.20, 0.47, 0.77, 0.05}},
    {30.0,   {0.065, 0.08, 0.10, 0.98, 0.03}},
    {1000.0, {0.025, 0.00, 0.00, 0.95, 0.04}},
};
constexpr Calibration kWellSpaced2[] = {
    {1.2,    {9.35, 9.28, 0.70, 0.00, 13.1}},
    {1.4142, {3.48, 5.29, 0.60, 1.23, 6.10}},
    {2.0,    {1.71, 2.41, 0.47, 0.00, 0.79}},
    {3.0,    {0.84, 1.34, 0.56, 0.00, 0.41}},
    {5.0,    {0.43, 0.75, 0.64, 0.00, 0.00}},
    {10.0,   {0.23, 0.62, 0.64, 0.00, 0.13}},
    {100.0,  {0.07, 0.30, 0.00, 0.65, 0.04}},
    {1000.0, {0.02, 0.00, 0.00, 0.85, 0.04}},
};
constexpr Calibration kWellSpaced3[] = {
    {2.0,    {2.13, 3.00, 0.46, 0.00, 0.91}},
    {3.0,    {0.89, 1.51, 0.47, 0.16, 0.35}},
    {5.0,    {0.43, 0.85, 0.43, 0.43, 0.18}},
    {10.0,   {0.19, 0.48, 0.38, 0.57, 0.07}},
    {100.0,  {0.036, 0.12, 0.00, 1.08, 0.05}},
    {1000.0, {0.025, 0.00, 0.00, 0.95, 0.04}},
};
// clang-format on

template <int D>
std::span<const Calibration> CalibrationFor(Criterion criterion) {
  switch (criterion) {
    case Criterion::kWellSpaced:
      return D == 2 ? std::span<const Calibration>(kWellSpaced2) : std::span<const Calibration>(kWellSpaced3);
    case Criterion::kRadiusEdge:
      break;
  }
  return D == 2 ? std::span<const Calibration>(kRadiusEdge2) : std::span<const Calibration>(kRadiusEdge3);
}

}  // namespace

template <int D>
Terms VerticesPerTerm(const MeshCriteria<D>& criteria) {
  // For D > 3 by analogy: the multiple of the least rho for which refinement ends, and balls of the same volume.
  const double rho = D <= 3 ? criteria.rho : criteria.rho * std::exp2(-0.5 * (D - 3));
  const double scale = D <= 3 ? 1.0 : BallVolume<3>() / BallVolume<D>();
  const std::span<const Calibration> table = CalibrationFor<D>(criteria.criterion);
  size_t i = 1;
  while (i + 1 < table.size() && table[i].rho < rho) {
    ++i;
  }
  // Linear in log rho; below the table, where refinement may not end, by the first segment, above it the last entry.
  const double t = std::min(1.0, std::log(rho / table[i - 1].rho) / std::log(table[i].rho / table[i - 1].rho));
  Terms result;
  for (int k = 0; k < kTerms; ++k) {
    result[k] = scale * std::max(0.0, std::lerp(table[i - 1].vertices[k], table[i].vertices[k], t));
  }
  return result;
}

#define WELLSPACE_INSTANTIATE(D) template Terms VerticesPerTerm<D>(const MeshCriteria<D>&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
