// The common part of the two ways of finding the triangles of a domain: listed stars, and cells.
#ifndef WELLSPACE_CORE_SIMPLEX_DOMAIN_ROW_H_
#define WELLSPACE_CORE_SIMPLEX_DOMAIN_ROW_H_

#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/ids.h"
#include "core/refine/plane/planar_domain.h"

namespace wellspace::core {

// Vertices that make a block, or a few more.
inline constexpr size_t kVerticesInBlock = 512;

// A triangle of a vertex, by the others.
struct DomainRow {
  VertexId first = kNoVertex;  // counterclockwise
  VertexId second = kNoVertex;
  uint32_t face = 0;

  auto operator<=>(const DomainRow&) const = default;
};

// The place of each vertex on a segment in its chain; 0 of other vertices.
//
// Complexity: O(vertices).
std::vector<uint32_t> PlacesIn(const PlanarDomain::Chains& chains, uint32_t segments, uint32_t vertices);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_DOMAIN_ROW_H_
