// Slow, independent checks that tetrahedra are the mesh of a domain in space.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_SOLID_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_SOLID_H_

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/validate/validate.h"
#include "core/validate/validate_domain.h"

namespace wellspace::core {

// The facts about a mesh of a domain in space beside its tetrahedra.
struct SolidParts {
  DomainParts domain;                     // facets are rows of 3 vertices
  std::span<const uint32_t> ridges = {};  // rows of 2 vertices, or none: they are not known
};

// The findings of a check of the mesh alone, beside violations.
struct SolidMeshReport {
  uint64_t pieces = 0;                // parts that hang together by facets of tetrahedra that are not on the boundary
  std::map<int32_t, double> volumes;  // by region; 0 stands for all tetrahedra where regions are not known
  std::map<int32_t, double> areas;    // of facets by tag; 0 likewise
  uint64_t branching_edges = 0;       // of three facets or more
  uint64_t open_edges = 0;            // of one facet: where a membrane ends
  uint64_t over_rho = 0;              // tetrahedra that break rho at acute edges of the boundary
};

// Checks the mesh alone: tetrahedra are positively oriented; a face of one belongs to another on its other side, of
// the same region, or it is a facet; facets are faces of tetrahedra, each there once, with the tetrahedron of the lower
// region on the inner side; ridges are edges of facets, each there once; and no vertex lies strictly inside a
// circumsphere, but by what is rounded: up to 2^-40 of the largest coordinate and 1e-10 of the radius. So the boundary
// of each region is closed, and tetrahedra overlap only if all their corners are on one sphere. With rho above 0 a
// tetrahedron may break it only if one of its vertices is on an edge at which two facets make less than 75 degrees.
//
// Shapes:     mesh: in 3-D.
// Complexity: O(m log m) for most meshes.
// Errors:     FAILED_PRECONDITION, naming the first violation (tetrahedron, facet, ridge, vertex); INVALID_ARGUMENT for
//             another dimension, arrays that do not hold whole rows, tags or regions of another number;
//             RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<SolidMeshReport> ValidateSolidMesh(const MeshView& mesh, const SolidParts& parts, double rho,
                                                  const RunContext& context);

// The facets of a mesh whose file has none: faces that one tetrahedron has alone, and those between two regions,
// oriented as ValidateSolidMesh wants them.
//
// REQUIRES:   ValidateIndices is OK; `regions`: one for each tetrahedron, or none.
// Complexity: O(m log m).
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<uint32_t>> FacetsOfRegions(const MeshView& mesh, std::span<const int32_t> regions,
                                                      const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_SOLID_H_
