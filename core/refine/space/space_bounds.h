// The bounds of nodes of cells in a domain in space. Private to core/refine/space.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SPACE_BOUNDS_H_
#define WELLSPACE_CORE_REFINE_SPACE_SPACE_BOUNDS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/geometry/vector_product.h"
#include "core/refine/sizing.h"
#include "core/refine/space/spatial_domain.h"
#include "core/refine/space/tetrahedron_name.h"

namespace wellspace::core {

// The squared circumradius of a regular tetrahedron of that volume.
inline double RadiusSqOfVolume(double volume) {
  constexpr double kVolumeOfEdge = 0.11785113019775793;  // of a regular tetrahedron with edges of length 1
  constexpr double kRadiusSqOfEdge = 0.375;
  const double edge = std::cbrt(volume / kVolumeOfEdge);
  return kRadiusSqOfEdge * edge * edge;
}

// The bounds of nodes by the solids that they lie in.
struct SpaceBounds {
  const SpatialDomain& domain;
  const Polytope<3>& cell;
  const SizeField<3>& sizes;
  std::span<const uint32_t> solids;  // by node, or none: then all are in `solid`
  uint32_t solid = 0;
  double rho_sq = 0;
  bool has_sizes = false;
  bool has_volumes = false;
  std::span<const TetrahedronName> passed_over{};
  SizeHint hint{};

  uint32_t SolidOf(const CellNode<3>& node) const {
    return solids.empty() ? solid : solids[static_cast<size_t>(&node - cell.nodes().data())];
  }
  bool IsPassedOver(const CellNode<3>& node) const {
    return !passed_over.empty() &&
           std::find(passed_over.begin(), passed_over.end(), NameOf(cell, node)) != passed_over.end();
  }
  double RhoSq(const CellNode<3>& node) const {
    if (IsPassedOver(node)) {
      return std::numeric_limits<double>::infinity();
    }
    const double outside = domain.criteria().outside_rho;
    return domain.IsMeshed(SolidOf(node)) ? rho_sq : outside * outside;
  }
  bool HasSizes(const CellNode<3>& node) const {
    return (has_sizes || has_volumes) && domain.IsMeshed(SolidOf(node)) && !IsPassedOver(node);
  }
  double SizeSq(const CellNode<3>& node, const Point<3>& x, double most) {
    double size_sq = has_sizes ? sizes.AtSq(x, most, &hint) : most;
    const double max_volume = domain.roles()[SolidOf(node)].max_volume;
    if (std::isinf(max_volume)) {
      return size_sq;
    }
    std::array<const Plane<3>*, 3> planes;
    for (size_t k = 0; k < 3; ++k) {
      planes[k] = &cell.plane(node.planes[k]);
      if (planes[k]->kind != PlaneKind::kBisector) {
        return size_sq;
      }
    }
    const double volume = std::abs(Dot<3>(planes[0]->normal, Cross(planes[1]->normal, planes[2]->normal))) / 6;
    return volume > max_volume ? std::min(size_sq, RadiusSqOfVolume(max_volume)) : size_sq;
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SPACE_BOUNDS_H_
