#include "core/input/separation.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/ids.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/input/mesh_parameters.h"

namespace wellspace::core {
namespace {

// Points that one thread looks at at a time.
constexpr size_t kBlock = kStepsBetweenChecks;

// A query takes less than a microsecond.
constexpr uint32_t kQueriesBetweenChecks = 256;

}  // namespace

template <int D>
absl::Status CheckSeparation(const Frame<D>& frame, const QueryStructure<D>& structure, uint32_t first,
                             std::span<const uint32_t> first_input, int threads, const RunContext& context) {
  const double least = frame.MinSeparation();
  const auto count = static_cast<uint32_t>(first_input.size());
  tbb::enumerable_thread_specific<Workspace<D>> workspaces;
  const auto check = [&](size_t block) {
    Workspace<D>& workspace = workspaces.local();
    const auto end = static_cast<uint32_t>(std::min<size_t>(count, (block + 1) * kBlock));
    for (auto i = static_cast<uint32_t>(block * kBlock); i < end; ++i) {
      if (i % kQueriesBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const VertexId v{first + i};
      if (structure.LeastSeparation(v) >= least) {
        continue;
      }
      const size_t input = first_input[i];
      const auto [nearest, nearest_sq] = structure.NearestWithin(v, least * least, workspace);
      // A distance of 0 is that of a point on a corner, which is one vertex with it in the mesh.
      if (nearest != kNoVertex && nearest_sq > 0) {
        const uint32_t other = Index(nearest) - first;  // a corner before them wraps around
        const bool is_input = other < count;
        return TooCloseError<D>(frame, structure.point(v), input, std::sqrt(nearest_sq),
                                is_input ? absl::StrCat("points[", first_input[other], "]") : "a corner of the domain");
      }
    }
    return absl::OkStatus();
  };
  return ThreadTeam(threads).TryForEach((count + kBlock - 1) / kBlock, check);
}

template <int D>
absl::Status CheckApart(const Frame<D>& frame, const SortedCloud<D>& cloud, const RunContext& context) {
  QueryStructure<D> apart;
  WELLSPACE_RETURN_IF_ERROR(apart.Initialize(cloud.grid, {}, kLeavesPerVertex * kDefaultMaxVertices, 1, context));
  const uint32_t corners = apart.vertex_count();
  for (const Point<D>& p : cloud.points) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    apart.AddVertex(kNoVertex, p);
  }
  return CheckSeparation<D>(frame, apart, corners, cloud.first_input, 1, context);
}

#define WELLSPACE_INSTANTIATE(D)                                                                \
  template absl::Status CheckSeparation<D>(const Frame<D>&, const QueryStructure<D>&, uint32_t, \
                                           std::span<const uint32_t>, int, const RunContext&);  \
  template absl::Status CheckApart<D>(const Frame<D>&, const SortedCloud<D>&, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
