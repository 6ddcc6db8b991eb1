// Slow, independent checks that a set of simplices is the mesh that the mesher promises.
//
// ValidateOrientation, ValidateTopology and ValidateVolume together prove a decomposition of the box: the facets pair
// up, so every point of the box off the facets is covered equally often; all simplices count positive; and the volumes
// allow for once only.
#ifndef WELLSPACE_CORE_SIMPLEX_VALIDATE_H_
#define WELLSPACE_CORE_SIMPLEX_VALIDATE_H_

#include <array>
#include <cstdint>
#include <span>

#include "absl/status/status.h"

namespace wellspace::core {

// A mesh as anybody may have written it.
struct MeshView {
  int dimension = 0;
  std::span<const double> points;       // vertex_count x dimension, row-major
  std::span<const uint32_t> simplices;  // simplex_count x (dimension + 1), row-major
};

inline constexpr int kHistogramBins = 18;

struct QualityReport {
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  double max_radius_edge = 0;  // largest circumradius / shortest edge; infinite if a simplex is flat
  double min_angle_deg = 0;    // 2-D: smallest angle; 3-D: smallest dihedral angle
  double max_angle_deg = 0;
  // Simplices by their smallest angle: bin i holds [i, i + 1) * w degrees, w = 60 / kHistogramBins (2-D), 70.53 /
  // kHistogramBins (3-D).
  std::array<uint64_t, kHistogramBins> angle_histogram{};
};

// Measures every simplex.
//
// Complexity: O(simplices).
// Errors:     none; of a mesh whose dimension, indices or coordinates ValidateIndices refuses, only the two counts are
//             set.
// Threads:    thread-safe, as everything here.
QualityReport MeasureQuality(const MeshView& mesh);

// Each check returns OK, or FAILED_PRECONDITION naming the first violation (simplex, vertex, value, bound). Anything
// may be passed in: INVALID_ARGUMENT for a dimension other than 2 and 3 or arrays that do not hold whole rows; indices
// out of range and coordinates that are not finite or beyond 2^1000 are found by every check. The box is the bounding
// box of the mesh's points.
//
// Signs are decided exactly, by a floating-point filter with integers of any size behind it
// (core/geometry/exact_measure.h). Memory is O(vertices + simplices); time is O(simplices), where a facet table or an
// order of points is needed times a logarithm.

// Indices in range, no vertex twice in a simplex, every vertex used, every coordinate finite, no two vertices equal.
absl::Status ValidateIndices(const MeshView& mesh);
// Every simplex has positive orientation.
absl::Status ValidateOrientation(const MeshView& mesh);
// Every facet belongs to exactly two simplices, on opposite sides, or to one and lies on a face of the box.
absl::Status ValidateTopology(const MeshView& mesh);
// The volumes of the simplices sum exactly to the volume of the box.
absl::Status ValidateVolume(const MeshView& mesh);
// No vertex lies strictly inside a circumsphere, by Delaunay's lemma: it is enough that none of two simplices with a
// common facet contains the other's apex.
//
// REQUIRES:   ValidateOrientation, ValidateTopology and ValidateVolume are OK.
absl::Status ValidateDelaunay(const MeshView& mesh);
// Every simplex has circumradius <= rho * shortest edge * (1 + 1e-9). INVALID_ARGUMENT unless rho is positive and
// finite.
absl::Status ValidateRadiusEdge(const MeshView& mesh, double rho);
// Every circumcentre lies in the box, up to 1e-9 times its longest side.
absl::Status ValidateCircumcentres(const MeshView& mesh);
// The distinct points of `cloud` (n x dimension), in order of first appearance, are the first vertices of the mesh, to
// the bit. INVALID_ARGUMENT for a cloud that does not hold whole rows of finite numbers.
absl::Status ValidateCloud(const MeshView& mesh, std::span<const double> cloud);

struct ValidationOptions {
  double rho = 0;                 // 0: not checked
  std::span<const double> cloud;  // empty: not checked
};

// All of the above in this order.
absl::Status ValidateMesh(const MeshView& mesh, const ValidationOptions& options);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_VALIDATE_H_
