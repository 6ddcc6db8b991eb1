// Slow, independent checks that a set of simplices is the mesh that the mesher promises.
//
// ValidateOrientation, ValidateTopology and ValidateVolume together prove a decomposition of the box: the facets pair
// up, so every point of the box off the facets is covered equally often; all simplices count positive; and the volumes
// allow for once only.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_H_

#include <array>
#include <cstdint>
#include <numeric>
#include <span>

#include "absl/status/status.h"
#include "core/geometry/criterion.h"
#include "core/validate/validate_sizes.h"

namespace wellspace::core {

// A mesh from any source, perhaps wrong.
struct MeshView {
  int dimension = 0;
  std::span<const double> points;       // vertex_count x dimension, row-major
  std::span<const uint32_t> simplices;  // simplex_count x (dimension + 1), row-major
  std::span<const double> weights{};    // vertex_count squared lengths, or empty: all zero
};

inline constexpr int kHistogramBins = 18;
inline constexpr int kDegrees = 180;
inline constexpr int kRatioBins = 80;
inline constexpr double kRatioWidth = 0.05;

struct QualityReport {
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  double max_radius_edge = 0;  // largest circumradius / shortest edge; infinite if a simplex is flat
  double min_angle_deg = 0;    // 2-D: smallest angle; else smallest angle between two facets of a simplex
  double max_angle_deg = 0;
  // Simplices by their smallest angle: bin i holds [i, i + 1) * w degrees, w = LargestSmallestAngle / kHistogramBins.
  std::array<uint64_t, kHistogramBins> angle_histogram{};
  // Simplices by their smallest and by their largest angle, bin i for [i, i + 1) degrees.
  std::array<uint64_t, kDegrees> min_angles{};
  std::array<uint64_t, kDegrees> max_angles{};
  // Simplices by radius-edge ratio, bin i for [i, i + 1) * kRatioWidth, the last one for all above.
  std::array<uint64_t, kRatioBins> radius_edge_ratios{};

  // Simplices with an angle below `degrees`. REQUIRES: 0 <= degrees <= kDegrees.
  uint64_t CountBelow(int degrees) const {
    return std::accumulate(min_angles.begin(), min_angles.begin() + degrees, uint64_t{0});
  }
};

// The smallest angle of a regular simplex in degrees, which no simplex exceeds: acos(1 / dimension). 60 in 2-D, 70.53
// in 3-D.
double LargestSmallestAngle(int dimension);

// Measures every simplex.
//
// Complexity: O(simplices).
// Errors:     none; of a mesh whose dimension, indices or coordinates ValidateIndices refuses, only the two counts are
//             set.
// Threads:    thread-safe, as everything here.
QualityReport MeasureQuality(const MeshView& mesh);

// Each check returns OK, or FAILED_PRECONDITION naming the first violation (simplex, vertex, value, bound). Anything
// may be passed in: INVALID_ARGUMENT for a dimension out of 2 to 6 or arrays that do not hold whole rows; indices
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
// common facet contains the other's apex. With weights: no vertex has a negative power to the sphere that is orthogonal
// to a simplex' weighted vertices, so that the mesh is their regular triangulation; every weight is finite and not
// negative.
//
// REQUIRES:   ValidateOrientation, ValidateTopology and ValidateVolume are OK.
absl::Status ValidateDelaunay(const MeshView& mesh);
// Every simplex has circumradius <= rho * shortest edge * (1 + 1e-9). INVALID_ARGUMENT unless rho is positive and
// finite.
absl::Status ValidateRadiusEdge(const MeshView& mesh, double rho);
// Every vertex v has circumradius <= rho * (its shortest edge) * (1 + 1e-9) for each of its simplices. INVALID_ARGUMENT
// unless rho is positive and finite.
//
// That is R(v) <= rho NN(v), R(v) the distance from v to the farthest node of its Voronoi cell in the box: in a
// Delaunay triangulation the nearest neighbour is at the end of an edge. When all circumcentres lie in the box, a node
// of the cell is either one of them, or lies on faces of the box, where the dual of a boundary facet (or of an edge,
// triangle, ... of several) leaves it: at the circumcentre of that facet, whose circumradius is at most that of the
// simplex.
//
// REQUIRES:   ValidateDelaunay and ValidateCircumcentres are OK.
absl::Status ValidateWellSpaced(const MeshView& mesh, double rho);
// Every simplex has circumradius R <= max_circumradius, where that is not 0; R <= max(H, G dist(circumcentre, box)) for
// each box, H its bound and G the gradation: no circumball that meets the box is larger; and R <= H + G dist(
// circumcentre, point) for each sample. Each times 1 + 1e-9. INVALID_ARGUMENT for bounds that are negative or not
// finite, of a box or a sample also 0, and for boxes and points that are none.
absl::Status ValidateSizing(const MeshView& mesh, const SizeBounds& bounds);
// Every circumcentre lies in the box, up to 1e-9 times its longest side.
absl::Status ValidateCircumcentres(const MeshView& mesh);
// The distinct points of `cloud` (n x dimension), in order of first appearance, are the first vertices of the mesh, to
// the bit; with a merge_distance above 0 some of them are, and the others no farther than that from one of these, times
// 1 + 1e-9. INVALID_ARGUMENT for a cloud that does not hold whole rows of finite numbers, and for a distance that is
// negative or not finite.
absl::Status ValidateCloud(const MeshView& mesh, std::span<const double> cloud, double merge_distance = 0);

struct ValidationOptions {
  double rho = 0;  // bound of the criterion; 0: not checked
  Criterion criterion = Criterion::kRadiusEdge;
  double max_circumradius = 0;                // 0: not checked
  std::span<const SizeBox> size_boxes{};      // empty: not checked
  const SizeSamples* size_samples = nullptr;  // null: not checked
  double gradation = 0;                       // 0: that of each kind of size
  std::span<const double> cloud{};            // empty: not checked
  double merge_distance = 0;                  // of the points of the cloud
  // No angle between two facets of a simplex (in 2-D, of a triangle) is below min_angle_deg * (1 - 1e-9).
  // INVALID_ARGUMENT unless that is from 0 to LargestSmallestAngle; 0: not checked.
  double min_angle_deg = 0;
};

// All of the above, in the order Indices, Orientation, Topology, Volume, Delaunay, RadiusEdge or WellSpaced,
// Circumcentres, Sizing, Angles, Cloud. Of a mesh with weights RadiusEdge, WellSpaced, Circumcentres and Sizing are not
// checked: they are promises about Delaunay simplices.
absl::Status ValidateMesh(const MeshView& mesh, const ValidationOptions& options);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_H_
