// Points in, mesh out: the one face of the core that the server and the tools see.
#ifndef WELLSPACE_CORE_MESHERS_MESHER_H_
#define WELLSPACE_CORE_MESHERS_MESHER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/input/input.h"
#include "core/input/mesh_parameters.h"
#include "core/mesh/mesh.h"

namespace wellspace::core {

struct MovedRows;  // core/mesh/mesh_delta.h

// A mesh in the making and after: the query structure of [HT08] with its refinement. Vertices can be added to a refined
// mesh, and it be refined again, at the cost of the change.
//
// Vertices are named by their index in the mesh, which never changes. By default, in 3-D, Refine moves Steiner vertices
// to repair slivers, those of an earlier mesh among them; Mesh::moved_vertices has these, and
// MeshParameters::keep_vertices keeps them where they are. The mesh depends neither on the order of the points
// (but for the numbering of vertices), nor on the number of threads, nor on the machine.
//
// Thread safety: thread-compatible: const functions may run at once, others alone. A RunContext may be observed and
// cancelled from other threads.
class Mesher {
 public:
  virtual ~Mesher() = default;

  // Builds the tree over the points of `input`, in their box; or for the domain that its features make of them:
  // segments in the plane (docs/design/features.md), triangles in space (docs/design/surfaces.md). Only faces and
  // solids that are meshed are in the mesh: points of such a domain that touch none of it have no vertex.
  //
  // Shapes:     points: n x dimension, row-major; n may be 0 when a domain is given.
  // Units:      any length, the same on every axis.
  // Complexity: O(n log n + L) for L leaves, and with features that of MakeDomainCloud or MakeSpaceCloud. Reserves
  //             memory for them first.
  // Errors:     INVALID_ARGUMENT (parameters; NaN, infinite or outside coordinates; points closer than double
  //             arithmetic can serve; of MakePlanarGraph and FindFaces, and of MakeSpaceCloud; for parameters that the
  //             domain does not have, by ValidateDomainParameters and ValidateSpaceParameters), RESOURCE_EXHAUSTED
  //             (max_vertices, memory of the context), CANCELLED, DEADLINE_EXCEEDED.
  // Threads:    uses parameters.threads, at most as many as the machine has cores.
  // Source:     [HT08] Figure 3, INITIALIZE.
  static absl::StatusOr<std::unique_ptr<Mesher>> Create(const MeshParameters& parameters, const Input& input,
                                                        RunContext& context);

  virtual int dimension() const = 0;
  virtual uint64_t vertex_count() const = 0;
  // The memory that it holds, but for a few scratch buffers. Unit: bytes.
  virtual uint64_t memory_bytes() const = 0;

  // Refuses demands for which it is proved that they take more vertices than `parameters` allow.
  //
  // Errors:     INVALID_ARGUMENT (parameters); RESOURCE_EXHAUSTED with predicted number, limit, and a size that fits.
  virtual absl::Status CheckFeasible(const MeshParameters& /*parameters*/) const { return absl::OkStatus(); }

  // Adds Steiner vertices until criterion and sizes of `parameters` are met, then repairs slivers, for which these move
  // too; those of an earlier mesh unless keep_vertices. With pump_weights, Extract gives weights if slivers are left,
  // or none were to be repaired. All parameters count but dimension, domain, margin, merge_distance and periodic_axes:
  // the box is that of Create.
  //
  // Complexity: O(m) queries the first time and for other demands than the last; else in proportion to the vertices
  //             added since, and in a domain one pass over all.
  // Errors:     INVALID_ARGUMENT (parameters), RESOURCE_EXHAUSTED (max_vertices, smallest edge, memory of the
  //             context), CANCELLED, DEADLINE_EXCEEDED. Resumable: a later call goes on where this was left, and its
  //             mesh depends on it.
  // Threads:    uses parameters.threads, at most as many as the machine has cores.
  // Source:     [HT08] Figure 4; docs/design/sliver.md.
  virtual absl::Status Refine(const MeshParameters& parameters, RunContext& context) = 0;

  // Adds vertices at `points`, n x dimension: all of them or, on an error, none. Returns the vertex of each point; one
  // that is a vertex already is not added again. Then the mesh wants to be refined again.
  //
  // In a domain a point lies inside a face that is meshed, or on a segment, which it splits. It is on the segment if it
  // is no farther away than a quarter of the least separation, about 2^-46 of the largest coordinate: hardly any point
  // is on a segment exactly, since coordinates are rounded. The vertex is where the point is.
  //
  // Complexity: O(n (log n + depth of the tree)) and O(1) queries a point in a refined mesh.
  // Errors:     INVALID_ARGUMENT as in Create, naming the point, also when it is too close to a vertex, or in a domain
  //             to a segment that it is not on, or is not in the domain that is meshed; RESOURCE_EXHAUSTED when
  //             vertices can no longer be numbered; CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::vector<uint32_t>> AddPoints(std::span<const double> points, RunContext& context) {
    return AddPointsNear(points, {}, context);
  }

  // As AddPoints, for points of which each is in the cell of its vertex of `near`, or not far: found by a walk from
  // leaf to leaf. `near` has n vertices, or none.
  //
  // Complexity: O(1) a point there, besides sorting.
  // Errors:     as AddPoints; OUT_OF_RANGE, naming the first vertex that does not exist; INVALID_ARGUMENT for another
  //             number of vertices than points.
  // Source:     [HT08] Figure 3, ADDVERTEX.
  virtual absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points,
                                                              std::span<const uint32_t> near, RunContext& context) = 0;

  // As AddPoints, for one point that is in the cell of vertex `near`, or not far: found by a walk from leaf to leaf.
  //
  // Complexity: O(1) there.
  // Errors:     as AddPoints; OUT_OF_RANGE when there is no vertex `near`.
  // Source:     [HT08] Figure 3, ADDVERTEX.
  virtual absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point) = 0;

  // The distance from each of `vertices` to its nearest other vertex, over segments and holes too; exact, where the
  // paper asks for a constant factor.
  //
  // Complexity: O(1) each in a refined mesh or bottom-up.
  // Errors:     OUT_OF_RANGE, naming the first vertex that does not exist.
  // Source:     [HT08] Figure 3, APPROXIMATENN.
  virtual absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const = 0;

  // The Voronoi cells of `vertices` in the box, each clipped at beta times the distance to the vertex' nearest
  // neighbour; whole ones when beta is infinite.
  //
  // In a domain the box is that of the meshed faces, and segments cut nothing off: cells are convex, and fill the box,
  // holes too. In a refined mesh no cell reaches over a segment that its vertex is not on. So the cell of a vertex on
  // no segment lies in its face; that of a vertex on a segment is on both sides, be they meshed or not.
  //
  // Complexity: O(1) each in a refined mesh or bottom-up.
  // Errors:     OUT_OF_RANGE as above; INVALID_ARGUMENT unless beta is a number of at least 1; FAILED_PRECONDITION,
  //             naming a vertex whose cell has more nodes than 2^14, in 5-D and 6-D 2^18, as only an unrefined mesh's
  //             can.
  // Source:     [HT08] Figure 3, CLIPPEDVORONOI.
  virtual absl::StatusOr<std::vector<Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const = 0;

  // The refined mesh.
  //
  // Guarantees: (1) the simplices are a Delaunay triangulation of the vertices and decompose exactly the box; (2) the
  //             criterion holds for each; (3) no circumcentre lies outside the box. With weights they are the regular
  //             triangulation, and (2) and (3) are those of the Delaunay triangulation before. Those of a domain are
  //             in docs/design/features.md and surfaces.md.
  // Complexity: O(m) time and memory.
  // Errors:     FAILED_PRECONDITION unless refined since vertices were last added; RESOURCE_EXHAUSTED (memory of the
  //             context); CANCELLED, DEADLINE_EXCEEDED.
  // Threads:    uses `threads`, at most as many as the machine has cores.
  virtual absl::StatusOr<Mesh> Extract(int threads, RunContext& context) = 0;

  // Brings `mesh`, the last that Extract or Update made, up to date: replaces the simplices around the vertices added
  // since, and moves those that have moved. The simplices are those that Extract would give: in its order where
  // slivers are repaired, elsewhere first those that have stayed, in their order. A mesh that has points, weights,
  // simplices and statistics alone gets the rest anew.
  //
  // Complexity: O(1) for each vertex added or moved, a move of the rows behind the first that changes, and a look at
  //             the facets of the box. One pass over the simplices besides, where slivers are not repaired: the first
  //             time, and if the worst simplex has gone. With pump_weights, and in a domain, as Extract.
  // `simplices`, if not null, becomes the runs of rows that make the simplices of the mesh before those of this one;
  // nothing where the mesh was made anew.
  //
  // Errors:     as Extract; INVALID_ARGUMENT for another mesh. On an error `mesh` is unchanged.
  virtual absl::Status Update(Mesh& mesh, int threads, RunContext& context, std::optional<MovedRows>* simplices) = 0;
  absl::Status Update(Mesh& mesh, int threads, RunContext& context) { return Update(mesh, threads, context, nullptr); }

  // The size that the mesh would have with these parameters, from the tree as Create left it.
  //
  // Errors:     INVALID_ARGUMENT (parameters); FAILED_PRECONDITION once vertices have been inserted; CANCELLED,
  //             DEADLINE_EXCEEDED.
  // Source:     docs/design/estimate.md.
  virtual absl::StatusOr<MeshEstimate> Estimate(const MeshParameters& parameters, const RunContext& context) const = 0;

  // The same for a reservation of memory: it may be farther from the truth, and for small meshes of clouds goes by
  // numbers alone, with room for uneven ones.
  //
  // Complexity: a few hundredths of the time of the mesh of a cloud.
  // Errors:     as Estimate.
  virtual absl::StatusOr<MeshEstimate> EstimateToReserve(const MeshParameters& parameters,
                                                         const RunContext& context) const {
    return Estimate(parameters, context);
  }
};

// Checks that the demands are feasible, and reserves the memory that Refine and Extract are estimated to take, of that
// which the context lends: all of the estimate, and a quarter more, but no more than max_vertices allows; Refine
// then need not estimate again. Reserves nothing without a lender.
//
// Errors:     as of CheckFeasible and EstimateToReserve; RESOURCE_EXHAUSTED, or another of the lender.
absl::Status ReserveMemory(const Mesher& mesher, const MeshParameters& parameters, RunContext& context);

// Meshes `input`: Create, ReserveMemory, Refine, Extract.
//
// Complexity: O(n log n + m) time for m output vertices, O(m) memory.
// Errors:     as of its parts.
absl::StatusOr<Mesh> MeshPoints(const MeshParameters& parameters, const Input& input, RunContext& context);

// Estimates the mesh that MeshPoints would make, without making it.
//
// Errors:     as of MeshPoints about parameters, input and the context.
// Threads:    thread-safe, as MeshPoints.
absl::StatusOr<MeshEstimate> EstimateMesh(const MeshParameters& parameters, const Input& input, RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_MESHER_H_
