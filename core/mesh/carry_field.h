// Fields that are carried from one mesh of a domain to another.
#ifndef WELLSPACE_CORE_MESH_CARRY_FIELD_H_
#define WELLSPACE_CORE_MESH_CARRY_FIELD_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/validate/validate.h"

namespace wellspace::core {

// Numbers at the vertices of a mesh, or at its simplices.
struct Field {
  std::span<const double> values;  // rows x components, row-major; finite
  size_t components = 1;           // at least 1
};

// The field on the other mesh.
struct CarriedField {
  std::vector<double> values{};  // rows x components, row-major; finite
  // Rows whose place is outside of the mesh before by more than rounding: they have the value at its nearest point, or
  // of its nearest simplex.
  uint64_t outside_count = 0;
};

// How a field is carried.
enum class Carrying {
  kLinear,    // values at vertices, linear in each simplex
  kConstant,  // values of simplices, at the centroid of each simplex of the other mesh
  kMeans,     // values of simplices, as means over each simplex of the other mesh; in 2-D and 3-D
};

// The run of a transfer.
struct CarryRun {
  const RunContext& context;
  uint64_t held_bytes = 0;  // that the run holds besides
  int threads = 1;
};

// The `field` on `from`, on `onto`.
//
// Guarantees: (1) kLinear is exact for linear functions, but for rounding; vertices that both meshes have, under their
//             numbers and with their bits, keep their values to the bit; (2) simplices that both meshes have, by such
//             vertices, keep their values; (3) no value is beyond those that it is made of; (4) kMeans: where both
//             meshes cover the same domain, the sum of all values, each times the volume of its simplex, is kept to
//             1e-12 of the sum of their sizes; a simplex that `from` covers in part has the mean over that part;
//             (5) the same bits on any number of threads.
// REQUIRES:   simplices of each mesh are positively oriented and do not overlap; both have the same dimension.
// Complexity: O(n), and O(log n) for each vertex or simplex that is not in both; of kMeans for each of its overlaps,
//             too.
// Errors:     INVALID_ARGUMENT, naming the number of values, or the first row with one that is NaN or infinite, or the
//             dimension; that of the memory; CANCELLED, DEADLINE_EXCEEDED.
// Source:     of kMeans: P. E. Farrell, M. D. Piggott, C. C. Pain, G. J. Gorman, C. R. Wilson, *Conservative
//             interpolation between unstructured meshes via supermesh construction*, 2009; simplices are cut by their
//             facets here, and no supermesh is made.
absl::StatusOr<CarriedField> CarryField(Carrying carrying, const Field& field, const MeshView& from,
                                        const MeshView& onto, const CarryRun& run);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_CARRY_FIELD_H_
