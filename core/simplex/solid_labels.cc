#include "core/simplex/solid_labels.h"

#include <algorithm>
#include <cstddef>

#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// Tetrahedra that one thread labels at a time, and between two looks at the context.
constexpr size_t kLabelledTogether = size_t{1} << 10;
constexpr size_t kLabelledBetweenChecks = 256;

}  // namespace

Point<3> LabelledPoint(Simplex<3> corners) {
  std::sort(corners.begin(), corners.end());
  Point<3> centre = CircumcentreOffset<3>(corners);
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] += corners[0][axis];
  }
  return centre;
}

absl::StatusOr<HugeVector<uint32_t>> LabelSimplices(const SurfaceIndex& index, std::span<const double> points,
                                                    std::span<const uint32_t> simplices, int threads,
                                                    const RunContext& context) {
  const size_t count = simplices.size() / 4;
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(index.MemoryBytes() + points.size_bytes() + simplices.size_bytes() +
                                                count * sizeof(uint32_t)));
  HugeVector<uint32_t> labels(count);
  const auto label = [&](size_t block) -> absl::Status {
    const size_t end = std::min(count, (block + 1) * kLabelledTogether);
    for (size_t s = block * kLabelledTogether; s < end; ++s) {
      if (s % kLabelledBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      Simplex<3> corners;
      for (size_t k = 0; k < 4; ++k) {
        corners[k] = PointAt<3>(points, simplices[4 * s + k]);
      }
      labels[s] = index.SolidAt(LabelledPoint(corners));
    }
    return absl::OkStatus();
  };
  WELLSPACE_RETURN_IF_ERROR(ThreadTeam(threads).TryForEach((count + kLabelledTogether - 1) / kLabelledTogether, label));
  return labels;
}

}  // namespace wellspace::core
