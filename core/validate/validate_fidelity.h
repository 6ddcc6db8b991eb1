// Slow, independent checks that a mesh in space is the mesh of its surface.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_FIDELITY_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_FIDELITY_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_features.h"
#include "core/geometry/point.h"
#include "core/validate/validate.h"
#include "core/validate/validate_solid.h"

namespace wellspace::core {

// A surface, as its file has it.
struct SurfaceView {
  std::span<const double> points;  // n x 3, row-major
  SurfaceFeatures features{};
};

struct FidelityOptions {
  double tolerance = 0;        // of both deviations, and of curves; a length, above 0
  bool checks_tags = true;     // if not, markers are not known, rather than 0
  bool checks_regions = true;  // if not, regions of seeds are not known
};

// The largest distance of a point of some triangles to the nearest of others.
struct Deviation {
  double found = 0;       // at a point of them
  double at_most = 0;     // nowhere is it larger, up to rounding
  Point<3> at{};          // where it was found
  uint32_t triangle = 0;  // of which one the point is
};

// The findings of a comparison with the surface.
struct FidelityReport {
  double diagonal = 0;         // of the surface's bounding box
  uint64_t triangles = 0;      // around the meshed solids
  uint64_t solids = 0;         // that are meshed
  Deviation of_facets;         // from the surface; `triangle` is a facet
  Deviation of_surface;        // from the facets; `triangle` is given by its number
  double worst_volume = 0;     // of one solid: by how much the mesh of it differs
  double curves = 0;           // the length of all curves around the meshed solids
  double lost_curves = 0;      // of those, how much no ridge runs along
  Point<3> lost_at{};          // somewhere on them
  uint64_t tested_points = 0;  // of which it was asked whether they are meshed
  absl::Status verdict;        // OK, or FAILED_PRECONDITION naming the first violation
};

// Compares a mesh with its surface. The promises there, in this order:
//
// 1. Points are in one tetrahedron, if they are in a solid that is meshed, and else in none: points beside triangles,
//    and some by chance, all of them farther from the surface than any facet is. Holes are in none, and points of
//    regions in tetrahedra of that region.
// 2. Facets are no farther than the tolerance from the surface, nor it from them; the sides that bound nothing which is
//    meshed are not looked at.
// 3. Each solid has its volume in tetrahedra, up to its area times the deviation.
// 4. A facet has the tag of triangles that its vertices and its middle are no farther from than facets are.
// 5. An edge with another number of facets than two lies within the tolerance of an edge with another number of
//    triangles than two.
// 6. Along all curves run edges where facets make an angle, have several tags, or are not two: the ridges, if they are
//    known; and corners of curves are vertices, with `keeps_points` those of all triangles around meshed solids.
// 7. With a box, what ValidateBoxedMesh says.
//
// Triangles of the surface are made clean, and their solids and curves are found by the code that a mesher prepares
// them with, which is the reference. The mesh itself is measured without it: distances by a tree of boxes, insides
// by rays, volumes by tetrahedra.
//
// REQUIRES:   ValidateSolidMesh is OK; InspectSurface finds no faults.
// Complexity: O((n + m) log (n + m)) for most.
// Errors:     INVALID_ARGUMENT for a surface without any area, and for a tolerance that is none; RESOURCE_EXHAUSTED of
//             the context's memory; CANCELLED, DEADLINE_EXCEEDED. A mesh that is wrong is no error: see `verdict`.
// Source:     docs/adr/0042-fidelity-is-measured-both-ways.md.
absl::StatusOr<FidelityReport> CompareWithSurface(const MeshView& mesh, const SolidParts& parts,
                                                  const SurfaceView& surface, const FidelityOptions& options,
                                                  const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_FIDELITY_H_
