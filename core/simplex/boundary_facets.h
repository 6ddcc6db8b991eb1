// The facets of a simplex that are on faces of a box: for FindBoxBoundary and UpdateBoxBoundary.
#ifndef WELLSPACE_CORE_SIMPLEX_BOUNDARY_FACETS_H_
#define WELLSPACE_CORE_SIMPLEX_BOUNDARY_FACETS_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/box.h"
#include "core/simplex/boundary.h"

namespace wellspace::core {

// A facet as it is found: that of `simplex` which is opposite to its vertex number `apex`.
struct FoundFacet {
  uint64_t simplex = 0;
  uint8_t apex = 0;
  uint8_t face = 0;
};

// Appends the facets of simplex number `simplex`, of whose vertices `faces` are those that they are on.
template <int D>
void AddFacets(size_t simplex, const std::array<FaceMask, D + 1>& faces, std::vector<FoundFacet>& found) {
  for (int apex = 0; apex <= D; ++apex) {
    FaceMask shared = static_cast<FaceMask>(~FaceMask{0});
    for (int k = 0; k <= D; ++k) {
      shared &= k == apex ? static_cast<FaceMask>(~FaceMask{0}) : faces[k];
    }
    if (shared != 0) {
      found.push_back({simplex, static_cast<uint8_t>(apex), static_cast<uint8_t>(std::countr_zero(shared))});
    }
  }
}

// Writes the vertices of a facet.
template <int D>
void PutFacet(std::span<const uint32_t> simplices, const FoundFacet& facet, uint32_t* out) {
  const uint32_t* corners = &simplices[facet.simplex * (D + 1)];
  for (int k = 0, at = 0; k <= D; ++k) {
    if (k != facet.apex) {
      out[at++] = corners[k];
    }
  }
  // The apex goes to the front by as many exchanges of neighbours as it has vertices before it.
  if (facet.apex % 2 == 1) {
    std::swap(out[D - 2], out[D - 1]);
  }
}

// The tag of a vertex on `faces`.
inline int32_t TagOf(FaceMask faces) { return faces == 0 ? kNoTag : FaceTag(std::countr_zero(faces)); }

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_BOUNDARY_FACETS_H_
