// How large a mesh will be, before it is made.
#ifndef WELLSPACE_CORE_ESTIMATE_ESTIMATE_H_
#define WELLSPACE_CORE_ESTIMATE_ESTIMATE_H_

#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/refine/criteria.h"
#include "core/refine/plane/planar_domain.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

struct SizeEstimate {
  double vertices = 0;
  double simplices = 0;
  double bytes = 0;  // that meshing takes at its peak: structure, refinement, stars and the mesh itself
  // The standard error of `vertices`, as a share of it, that comes from not looking at every leaf; 0 where all were
  // looked at. The error of the model is not in it.
  double sampling_error = 0;
  // In a domain: segments that have been compared with places, or with parts of a leaf: the cost so far.
  uint64_t segments_compared = 0;
};

// How closely an estimate looks.
struct EstimateEffort {
  // Leaves are looked at until the standard error of the vertices is below this share of them, but so many at least of
  // those with vertices and of those without: few would not know their own spread.
  double sampling_error = 0.05;
  size_t least_leaves = 256;
  // Places looked at in one leaf, and in all where leaves are few, before cells are sampled too.
  uint64_t looks_per_leaf = 4096;
  uint64_t looks = uint64_t{1} << 17;
};

// Enough for a bar of progress, at about a hundredth of the cost of meshing.
inline constexpr EstimateEffort kGlance{0.15, 24, 64, uint64_t{1} << 11};
// The same where many leaves lie outside of the domain.
inline constexpr EstimateEffort kLongGlance{0.15, 64, 256, uint64_t{1} << 12};

// Enough for a reservation of memory, at a few hundredths of the cost of meshing: a run that is short asks for more.
inline constexpr EstimateEffort kForReservation{0.1, 32, 256, uint64_t{1} << 13};

// Predicts the size of the mesh that refinement of `structure` for `criteria` will make.
//
// Shapes:     structure: as QueryStructure::Initialize leaves it; nothing has been refined. domain: the faces that its
//             segments bound, in the plane; null: the box.
// Units:      counts and bytes.
// REQUIRES:   criteria.rho at least MinimumRho(D).
// Guarantees: (1) with the default effort, by the radius-edge criterion without sizes, each figure is right within a
//             factor of 1.5 at rho = sqrt(2) in 2-D and 2 in 3-D, and of 2 from rho = 1 in 2-D and 1.2 in 3-D, on the
//             clouds and with the exceptions that docs/design/estimate.md lists; for D > 3 an order of magnitude;
//             (2) deterministic; (3) vertices are never fewer than the structure has already.
// Complexity: O(n + L) for n points in L leaves, with small constants, and a number of looks for nearest points that
//             depends on the cloud's kind but not on n, of O(log n) each.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Threads:    thread-compatible.
// Source:     Ruppert 1995 (the size of a mesh is the integral of lfs^-D up to constants); docs/design/estimate.md.
template <int D>
absl::StatusOr<SizeEstimate> EstimateSize(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria,
                                          const RunContext& context, const EstimateEffort& effort = {},
                                          const PlanarDomain* domain = nullptr);

// The size of a small mesh of the box by numbers alone, for a reservation of memory: a look at any leaf would take
// longer than a part of the mesh. None where the mesh is large, or numbers say too little: above 3-D, by another
// criterion or a smaller rho than the default, with sizes in boxes or at samples.
//
// Units:      counts and bytes.
// Guarantees: bytes are at least those of even clouds; points that come ever closer to each other may take more.
// Complexity: O(1).
// Source:     docs/design/estimate.md, "For a reservation".
template <int D>
std::optional<SizeEstimate> TypicalSize(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_ESTIMATE_H_
