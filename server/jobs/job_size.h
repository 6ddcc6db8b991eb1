// The sizes of jobs, small or not, as far as can be known before they begin.
#ifndef WELLSPACE_SERVER_JOBS_JOB_SIZE_H_
#define WELLSPACE_SERVER_JOBS_JOB_SIZE_H_

#include <cstdint>
#include <span>

#include "core/input/mesh_parameters.h"

namespace wellspace::server {

// No mesh of more points is small, nor one with more sizes at points.
inline constexpr uint64_t kMostSmallPoints = 40'000;

// Whether a mesh is expected within about a second: by the number of points, and by the sizes that are wanted in the
// box. Above kMostSmallPoints it never is, and the points need not be given.
//
// Shapes:     points: n x parameters.dimension, row-major.
// Guarantees: from above for even clouds; points that come ever closer to each other may take ten times as long.
// Complexity: O(n), and not much for jobs that may be small.
bool IsSmallMesh(const core::MeshParameters& parameters, std::span<const double> points);

// As above, of a refinement of a mesh that is there, which may have to be built first, by `steps` steps.
bool IsSmallRefinement(const core::MeshParameters& parameters, std::span<const double> points, uint64_t vertices,
                       uint64_t steps);

// As above, of an estimate, which needs the tree alone, and of vertices that are added.
bool IsSmallEstimate(int dimension, uint64_t points);
bool IsSmallAddition(uint64_t points, uint64_t vertices, uint64_t steps);

// As above, of a part of a mesh that is taken out of it, which may have to be cut first.
bool IsSmallPart(bool is_cut, uint64_t simplices);

// As above, of values, so many by vertex or simplex, that are carried between meshes of at most so many simplices.
bool IsSmallTransfer(uint64_t simplices, uint64_t components);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_JOB_SIZE_H_
