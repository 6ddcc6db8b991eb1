// The figures of the tetrahedra of a mesh inside a surface: regions, volumes, angles, and exempt ones.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/vector_product.h"
#include "core/meshers/space_mesher.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// A ratio that exceeds rho by less, relatively, does so by rounding.
constexpr double kRatioTolerance = 1e-9;

}  // namespace

// Fills in the regions and volumes of a mesh, and which of its tetrahedra are exempt. `places`: of regions in the mesh.
absl::Status SpaceMesher::DescribeSimplices(Mesh& mesh, std::span<const uint32_t> faces,
                                            std::span<const int32_t> regions, const std::map<int32_t, size_t>& places,
                                            const RunContext& context) const {
  SurfaceStatistics& surface = *mesh.statistics.surface;
  surface.volumes.assign(mesh.regions.size(), 0);
  const std::vector<bool>& is_acute = spatial_->creases().is_acute;
  surface.acute_curves = static_cast<uint64_t>(std::count(is_acute.begin(), is_acute.end(), true));
  surface.min_angle_outside_deg = spatial_->creases().IsEmpty() ? mesh.statistics.min_angle_deg : 180;
  for (size_t s = 0; s < faces.size(); ++s) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(s, context));
    const int32_t region = regions[faces[s]];
    if (places.size() > 1) {
      mesh.simplex_regions.push_back(region);
    }
    Simplex<3> corners;
    Simplex<3> scaled;
    for (size_t k = 0; k < 4; ++k) {
      corners[k] = PointAt<3>(mesh.points, mesh.simplices[4 * s + k]);
      scaled[k] = frame_.Scaled(corners[k]);
    }
    const Point<3> normal = Cross(Difference<3>(corners[1], corners[0]), Difference<3>(corners[2], corners[0]));
    surface.volumes[places.at(region)] += Dot<3>(normal, Difference<3>(corners[3], corners[0])) / 6;
    if (spatial_->IsAtAcuteCrease(scaled)) {
      ++surface.tube_simplices;
    } else if (!spatial_->creases().IsEmpty()) {
      surface.min_angle_outside_deg = std::min(surface.min_angle_outside_deg, Angles<3>(corners).min_deg);
    }
    surface.exempt_simplices += RadiusEdgeRatio<3>(corners) > rho_ * (1 + kRatioTolerance) ? 1 : 0;
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
