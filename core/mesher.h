// Points in, mesh out: the one face of the core that the server and the tools see.
#ifndef WELLSPACE_CORE_MESHER_H_
#define WELLSPACE_CORE_MESHER_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/dimensions.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// What every simplex has to be.
enum class Criterion {
  kRadiusEdge,  // circumradius <= rho * (its shortest edge); what Ruppert, Shewchuk, Triangle and TetGen promise
  kWellSpaced,  // [HT08]'s: no node of a vertex's Voronoi cell is farther from it than rho * (distance to its nearest
                // neighbour); stronger, and three to four times as many vertices
};

// A box in which simplices are small.
struct SizeBox {
  std::vector<double> low;   // dimension
  std::vector<double> high;  // dimension
  // No simplex whose circumball meets the box has a larger circumradius.
  double max_circumradius = 0;
};

struct MeshParameters {
  int dimension = 3;  // kMinDimension to kMaxDimension

  // The bound of the criterion. 0 means DefaultRho(dimension).
  double rho = 0;
  Criterion criterion = Criterion::kRadiusEdge;

  // No simplex has a larger circumradius. 0 means no bound.
  double max_circumradius = 0;
  // Boxes in which it is smaller still. Away from a box, sizes grow no faster than the distance from it.
  std::vector<SizeBox> size_boxes;

  // Low and high corner of the box to be meshed, `dimension` numbers each. Both empty: the bounding box of the points,
  // grown on every side by `margin` times its longest side.
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  double margin = 0.25;

  // The run ends with RESOURCE_EXHAUSTED before the mesh has more vertices than this. 0 means kDefaultMaxVertices.
  uint64_t max_vertices = 0;

  // Worker threads of this run, at least 1.
  int threads = 1;
};

// Vertices have 32-bit numbers, of which the last is none.
inline constexpr uint64_t kMaxVertices = 0xffff'fffe;
// What a machine with 24 GiB of memory can mesh in 3-D.
inline constexpr uint64_t kDefaultMaxVertices = 50'000'000;

// The default of `rho` in dimension D; the smallest value that is accepted.
double DefaultRho(int dimension);
double MinimumRho(int dimension);

// What a run did: counts of the paper's operations, by which its O(1) claims are tested, and the figures of the mesh.
struct MeshStatistics {
  uint64_t input_points = 0;
  uint64_t duplicates = 0;  // input points equal to an earlier one
  uint64_t vertices = 0;
  uint64_t simplices = 0;

  double max_radius_edge = 0;
  double min_angle_deg = 0;  // 2-D: smallest angle of a triangle; 3-D: smallest dihedral angle of a tetrahedron

  double tree_seconds = 0;
  double refinement_seconds = 0;
  double simplices_seconds = 0;
  double total_seconds = 0;
  uint64_t peak_memory_bytes = 0;  // of the whole process

  uint64_t tree_leaves = 0;     // when the mesh was done
  uint64_t cells_computed = 0;  // ClippedVoronoi queries of the refinement
  uint64_t leaves_visited = 0;  // by them
  uint64_t vertices_visited = 0;
  uint64_t cuts = 0;
  uint64_t max_leaves_visited = 0;  // by a single one
  uint64_t stars_computed = 0;      // Voronoi queries of the simplices
  uint64_t star_leaves_visited = 0;
  uint64_t star_vertices_visited = 0;
  uint64_t star_cuts = 0;
  uint64_t max_star_leaves_visited = 0;
  uint64_t exact_predicates = 0;      // decisions that the floating-point filter could not take
  uint64_t perturbed_predicates = 0;  // of these, exact zeros, decided by the perturbation
};

struct Mesh {
  int dimension = 0;
  std::vector<double> domain_low;   // dimension
  std::vector<double> domain_high;  // dimension
  // vertex_count x dimension, row-major. The distinct input points come first, in the order of their first appearance
  // and with their bits unchanged; then the corners of the box that are not input points; then the Steiner vertices.
  std::vector<double> points;
  // simplex_count x (dimension + 1) indices of vertices, row-major; each simplex positively oriented, its lowest vertex
  // first.
  std::vector<uint32_t> simplices;
  // input_points entries: the vertex that each input point became.
  std::vector<uint32_t> input_vertex;
  MeshStatistics statistics;

  uint64_t vertex_count() const { return dimension == 0 ? 0 : points.size() / dimension; }
  uint64_t simplex_count() const { return dimension == 0 ? 0 : simplices.size() / (dimension + 1); }
};

// Refuses parameters that no cloud could make valid: dimension, rho, domain, margin, threads.
//
// Errors:     INVALID_ARGUMENT, naming the field, its value and what would be accepted.
absl::Status ValidateParameters(const MeshParameters& parameters);

// Meshes `points` in their box: every simplex has circumradius <= rho * (its shortest edge), every input point is a
// vertex.
//
// Shapes:     points: n x dimension, row-major; n may be 0 when a domain is given.
// Units:      any length, the same on every axis.
// Guarantees: (1) the simplices are a Delaunay triangulation of the vertices and decompose exactly the box; (2) rho
//             holds for each; (3) no circumcentre lies outside the box; (4) the mesh depends neither on `threads` nor
//             on the machine.
// Complexity: O(n log n + m) time for m output vertices, O(m) memory.
// Errors:     INVALID_ARGUMENT (parameters; NaN, infinite or outside coordinates; points closer than double arithmetic
//             can serve), RESOURCE_EXHAUSTED (max_vertices, smallest edge), CANCELLED and DEADLINE_EXCEEDED (context).
// Threads:    thread-safe; `context` may be observed and cancelled from other threads.
// Source:     [HT08] Figure 4.
absl::StatusOr<Mesh> MeshPoints(const MeshParameters& parameters, std::span<const double> points, RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHER_H_
