// Slow, independent checks that triangles are the mesh of a domain in the plane.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_DOMAIN_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_DOMAIN_H_

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/geometry/box.h"
#include "core/validate/validate.h"
#include "core/validate/validate_boundary.h"

namespace wellspace::core {

// A domain, as its file has it.
struct DomainView {
  std::span<const double> points;  // n x 2, row-major
  Features features{};             // crossings and the snap distance are not looked at
  bool has_markers = true;         // if not, markers are not known, rather than 0
  bool has_regions = true;         // if not, regions are not known, rather than 0
  std::optional<Box<2>> box{};     // of FaceRule::kBox, if it is known
  double merge_distance = 0;       // of points; 0: equal ones alone, and corners of rings within the tolerance
};

// The parts of a mesh of a domain beside its triangles.
struct DomainParts {
  BoundaryView boundary;                          // `tags` may be none: they are not known
  std::span<const int32_t> regions{};             // of each triangle an id, or none: all are of one
  std::map<int32_t, std::string> region_names{};  // of ids, where they are known
};

// The findings of a check of a domain, beside violations.
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
//             dimension, or arrays that do not hold whole rows; CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<DomainReport> ValidateDomainMesh(const MeshView& mesh, std::span<const uint32_t> facets, double rho,
                                                const RunContext& context);

// Checks the mesh against its domain: facets lie along segments; the faces that these cut the plane into are meshed as
// a whole, or not at all, as the rule and the seeds have it; a point in a face that is meshed is a vertex; triangles
// have the region of their face, and are no larger than it allows; facets have the tags of their segments, as the
// proto's BoundaryPart says. Faces are found here once more, without the mesher's code. Each stretch of a segment is
// looked at by itself: one may bound a face that is meshed, and the next one nothing. Places are compared up to
// `tolerance`, by which a split segment is bent: of segments that are led through points a distance away, as
// much as that. Points that are merged are looked for where they are then.
//
// With FaceRule::kBox a box that is not known is taken for that of the mesh and the points, and for one that reaches
// beyond seeds outside of these: the part outside of its true sides may then be taken for missing. A face that is
// not meshed is not looked at if there are polygons that are holes: it may be in one.
//
// REQUIRES:   ValidateDomainMesh is OK; tolerance > 0.
// Complexity: O((m + n) log (m + n)) for most domains.
// Errors:     FAILED_PRECONDITION, naming segment, facet, triangle, point, seed or place; INVALID_ARGUMENT for tags or
//             regions of another number; CANCELLED, DEADLINE_EXCEEDED.
absl::Status ValidateConformity(const MeshView& mesh, const DomainParts& parts, const DomainView& domain,
                                double tolerance, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_DOMAIN_H_
