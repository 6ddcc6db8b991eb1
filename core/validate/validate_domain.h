// Slow, independent checks that triangles are the mesh of a domain in the plane.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_DOMAIN_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_DOMAIN_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/validate/validate.h"

namespace wellspace::core {

// A domain, as its file has it.
struct DomainView {
  std::span<const double> points;      // n x 2, row-major
  std::span<const uint32_t> segments;  // m x 2, indices of points
  std::span<const uint8_t> is_open;    // m, or none: 1 for a segment of no ring
  std::span<const double> holes;       // h x 2: points in faces that are not meshed
  bool is_even_odd = false;            // a face is meshed if an odd number of ring segments separates it from infinity
};

// What a check of a domain found, beside violations.
struct DomainReport {
  uint64_t exempt = 0;  // triangles that break rho at a small angle of the input
};

// Checks the mesh alone: triangles are positively oriented; an edge has two triangles, one on each side, or one and is
// a facet; facets are edges, each there once; and no vertex lies strictly inside a circumcircle, so that no two
// triangles overlap. With rho above 0 a triangle may break it only at a small angle: if both ends of its shortest edge
// are on facets; or up to sqrt(2), if near it is a line of facets that meets another at less than 60 degrees.
//
// Shapes:     facets: rows of 2 vertices.
// Complexity: O(m log m) for most meshes.
// Errors:     FAILED_PRECONDITION, naming the first violation (triangle, edge, vertex); INVALID_ARGUMENT for another
//             dimension, or arrays that do not hold whole rows.
absl::StatusOr<DomainReport> ValidateDomainMesh(const MeshView& mesh, std::span<const uint32_t> facets, double rho);

// Checks the mesh against its domain: facets lead from each end of a segment to the other, along it, if it bounds a
// face that is meshed; no triangle holds a hole; and by even and odd, a count of the rings to the left of its centroid
// has each triangle inside. Places are compared up to `tolerance`, which is what a split segment is bent by.
//
// REQUIRES:   ValidateDomainMesh is OK.
// Complexity: O(m (segments + holes)) at worst.
// Errors:     FAILED_PRECONDITION, naming segment, hole or triangle.
absl::Status ValidateConformity(const MeshView& mesh, std::span<const uint32_t> facets, const DomainView& domain,
                                double tolerance);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_DOMAIN_H_
