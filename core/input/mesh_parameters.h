// The demands on a mesh, and which of them can be met.
#ifndef WELLSPACE_CORE_INPUT_MESH_PARAMETERS_H_
#define WELLSPACE_CORE_INPUT_MESH_PARAMETERS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/base/dimensions.h"
#include "core/geometry/criterion.h"

namespace wellspace::core {

// How a domain in space is to meet its surface. Lengths are in the unit of the points.
struct SurfaceParameters {
  // Facets and the surface are nowhere farther apart, in either direction. 0 means kDefaultTolerance times the diagonal
  // of the surface's bounding box.
  double tolerance = 0;
  // The least angle of a facet, but where the input has smaller ones. 0 to kMostFacetAngle; none means
  // kDefaultFacetAngle. Unit: degrees.
  std::optional<double> min_facet_angle{};
  // The length that edges of facets and curves have on average; see MeshParameters::edge_length, which holds as well. 0
  // means no bound.
  double edge_length = 0;
  // No vertex is added to the surface for its shape nearer to another one than this. 0 means half the tolerance.
  double min_size = 0;
  // The bound of the criterion outside of all that is meshed, where simplices are not handed out. 0 means
  // kDefaultOutsideRho; at least rho's minimum.
  double outside_rho = 0;
  // Edges on a circle that is as curved as the surface, and edges across a solid, from one facet to the one that faces
  // it: lengths as `edge_length` has them, which grow by MeshParameters::gradation away from there. 0 means any number.
  // Radii and thicknesses below `min_size` ask for nothing.
  double curvature_elements = 0;
  double thickness_layers = 0;

  bool operator==(const SurfaceParameters&) const = default;
};

inline constexpr double kDefaultTolerance = 1e-3;
inline constexpr double kDefaultFacetAngle = 25;
inline constexpr double kMostFacetAngle = 30;
inline constexpr double kDefaultOutsideRho = 4;

struct MeshParameters {
  int dimension = 3;  // kMinDimension to kMaxDimension

  // The bound of the criterion. 0 means DefaultRho(dimension).
  double rho = 0;
  Criterion criterion = Criterion::kRadiusEdge;

  // No simplex has a larger circumradius. 0 means no bound.
  double max_circumradius = 0;
  // The same bound by the length that edges have on average where points ask for no shorter ones; see CircumradiusOf.
  // The smaller of the two holds. 0 means no bound.
  double edge_length = 0;
  // Boxes in which circumradii are smaller still. Away from a box, sizes grow no faster than the gradation times the
  // distance from it.
  std::vector<SizeBox> size_boxes{};
  // Points at which they are, in the domain or not: a simplex with circumcentre c has a circumradius of at most
  // size + gradation * (distance of c), for each of them. Null for none.
  std::shared_ptr<const SizeSamples> size_samples{};
  // How fast circumradii may grow with the distance. Above 0 and at most 1. 0 means 1 from boxes, and
  // kDefaultSampleGradation from samples.
  double gradation = 0;

  // Refine moves vertices, all but the given ones, and adds some, until no dihedral angle is smaller, in
  // degrees; slivers that cannot be repaired are counted in the statistics. 0 for none of that; none means
  // DefaultMinDihedral(dimension). Allowed in 3-D, up to kMostMinDihedral.
  std::optional<double> min_dihedral{};

  // Extract gives vertices weights, under which the regular triangulation has better simplices; with min_dihedral only
  // if slivers are left. From 3-D on.
  bool pump_weights = false;

  // Refine does not move vertices of the last mesh that was extracted: the repair of slivers adds vertices, and moves
  // those that are new since.
  bool keep_vertices = false;

  // Parameters of a domain in space alone.
  SurfaceParameters surface{};

  // Low and high corner of the box to be meshed, `dimension` numbers each. Both empty: the bounding box of the points,
  // grown on every side by `margin` times its longest side.
  std::vector<double> domain_low{};
  std::vector<double> domain_high{};
  double margin = 0.25;

  // Points no farther than this from another one become that one's vertex; docs/design/mesher.md says which. 0 for none
  // but equal ones. Unit: that of the points.
  double merge_distance = 0;

  // The axes along which the box is periodic, each once: a vertex on one of the two faces across such an axis has an
  // image on the other, whose other coordinates are the same, and the facets on both match. In 2-D and 3-D, for points
  // in a box, without pump_weights. Sizes are not mirrored: what they ask for on one face holds on the other as well.
  std::vector<int> periodic_axes{};

  // The run ends with RESOURCE_EXHAUSTED before the mesh has more vertices than this. 0 means kDefaultMaxVertices.
  uint64_t max_vertices = 0;

  // Worker threads of this run, at least 1.
  int threads = 1;
};

// Vertices have 32-bit numbers, of which the last is none.
inline constexpr uint64_t kMaxVertices = 0xffff'fffe;
// The vertices that a machine with 24 GiB of memory can make in 3-D.
inline constexpr uint64_t kDefaultMaxVertices = 50'000'000;
// Leaves that the tree may have for each vertex of the budget; around isolated close pairs balance costs up to about
// two.
inline constexpr uint64_t kLeavesPerVertex = 8;

// The number of vertices at which a run ends: max_vertices or its default.
uint64_t VertexBudget(const MeshParameters& parameters);

// The default of `rho`, for which refinement ends whatever the input: sqrt(2) in 2-D, 2 in 3-D, 2.9, 4.1 and 5.8 in 4-D
// to 6-D, 2^((D-1)/2) rounded up; and the smallest value that is accepted.
double DefaultRho(int dimension);
double MinimumRho(int dimension);

inline constexpr double kMostMinDihedral = 18;
// The default of `min_dihedral`: 12 in 3-D, 0 elsewhere.
double DefaultMinDihedral(int dimension);

// The largest dimension in which boxes may be periodic.
inline constexpr int kMostPeriodicDimension = 3;

// Refuses parameters that no cloud could make valid: dimension, rho, sizes, slivers, surface, domain, margin, periodic
// axes, threads.
//
// Complexity: O(1) for each box and sample.
// Errors:     INVALID_ARGUMENT, naming the field, its value and what would be accepted.
absl::Status ValidateParameters(const MeshParameters& parameters);

// The payload that marks the status of demands which no mesh of max_vertices can meet.
inline constexpr std::string_view kDemandsTooFine = "wellspace.core/DEMANDS_TOO_FINE";

// Refuses numbers of threads that no run could use.
//
// Errors:     INVALID_ARGUMENT, naming `threads`, its value and what would be accepted.
absl::Status CheckThreads(int threads);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_MESH_PARAMETERS_H_
