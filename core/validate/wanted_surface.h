// The demands of a surface on its mesh: which of its triangles bound it, which solids are meshed, where curves run.
#ifndef WELLSPACE_CORE_VALIDATE_WANTED_SURFACE_H_
#define WELLSPACE_CORE_VALIDATE_WANTED_SURFACE_H_

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/features/surface_curves.h"
#include "core/geometry/point.h"
#include "core/validate/triangle_tree.h"
#include "core/validate/validate_fidelity.h"

namespace wellspace::core {

struct WantedSurface {
  SurfaceComplex complex;
  Solids solids;
  double diagonal = 0;
  TriangleTree all;                                  // triangles of the complex
  std::vector<bool> is_meshed;                       // by solid
  std::vector<uint32_t> bounding;                    // the triangles of which a side is meshed
  TriangleTree around;                               // these, in that order
  std::vector<std::array<uint32_t, 2>> curve_edges;  // of curves at such triangles; points of the complex
  std::vector<uint32_t> corners;                     // likewise
  std::vector<std::array<uint32_t, 2>> odd_edges;    // with another number of such triangles than two
  std::map<int32_t, int32_t> marker_of;              // by tag, of those around

  // The solid that `p` lies in, by a ray; none if every ray meets an edge.
  std::optional<uint32_t> SolidAt(const Point<3>& p) const;

  // REQUIRES:   `surface` outlives the call.
  // Errors:     as CompareWithSurface.
  static absl::StatusOr<WantedSurface> Of(const SurfaceView& surface, const RunContext& context);
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_WANTED_SURFACE_H_
