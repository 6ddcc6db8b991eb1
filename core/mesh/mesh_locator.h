// Points located in a mesh whose dimension is known at run time.
#ifndef WELLSPACE_CORE_MESH_MESH_LOCATOR_H_
#define WELLSPACE_CORE_MESH_MESH_LOCATOR_H_

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/mesh/mesh.h"

namespace wellspace::core {

// Where n points lie.
struct LocatedPoints {
  // n: the simplex that has the point; of several, the one with the lowest number. kNoSimplex: it is in none.
  std::vector<uint32_t> simplices;
  // n x (dimension + 1): the vertices of the simplex, as the mesh has them; 0 for a point in none.
  std::vector<uint32_t> vertices;
  // n x (dimension + 1): barycentric coordinates, by these vertices. At least 0, and 0 if and only if the point is on
  // the facet opposite to the vertex; the sum is 1 but for rounding. All 0 for a point in none.
  std::vector<double> coordinates;
};

// A mesh, of which it keeps points and simplices, and a locator over it.
//
// Thread safety: const functions are thread-safe.
class MeshLocator {
 public:
  virtual ~MeshLocator() = default;

  // Complexity: O(n log n) for n simplices.
  // Errors:     INVALID_ARGUMENT (a dimension that is not known); CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<std::unique_ptr<MeshLocator>> Create(Mesh mesh, const RunContext& context);

  // The memory that Create takes for this number of simplices, the mesh excepted. Unit: bytes.
  static uint64_t BytesFor(int dimension, uint64_t simplices);

  virtual int dimension() const = 0;

  // Shapes:     points: n x dimension, row-major.
  // Complexity: O(1) for each point, if many are asked for at once; else O(log n).
  // Errors:     INVALID_ARGUMENT, naming the first coordinate that is NaN or infinite; CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<LocatedPoints> Locate(std::span<const double> points, const RunContext& context) const = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_MESH_LOCATOR_H_
