#include "client/files/surface_features.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "client/files/region_numbers.h"
#include "client/formats/cloud.h"

namespace wellspace::client {

double DefaultWeld(const formats::Surface& surface) {
  if (surface.names_points) {
    return 0;
  }
  double diagonal = 0;
  for (const double side : formats::BoxSides(surface.points, 3)) {
    diagonal = std::hypot(diagonal, side);
  }
  return kWeldShare * diagonal;
}

SurfaceFeatures FeaturesOf(const formats::Surface& surface, std::span<const formats::Surface::Seed> more_seeds,
                           std::vector<std::string>& notes) {
  SurfaceFeatures features;
  features.corners = surface.corners;
  features.markers = surface.markers;
  features.solids = surface.solids == formats::Surface::SolidRule::kHoles ? SolidRule::kHoles : SolidRule::kEvenOdd;
  features.weld = DefaultWeld(surface);
  std::vector<formats::Surface::Seed> seeds = surface.seeds;
  seeds.insert(seeds.end(), more_seeds.begin(), more_seeds.end());
  const std::vector<int32_t> regions = NumberRegions(surface.name, seeds, notes);
  for (size_t i = 0; i < seeds.size(); ++i) {
    const formats::Surface::Seed& seed = seeds[i];
    features.seeds.push_back({.x = seed.x,
                              .y = seed.y,
                              .z = seed.z,
                              .is_hole = seed.is_hole,
                              .region = regions[i],
                              .max_volume = seed.max_volume > 0 ? std::optional(seed.max_volume) : std::nullopt});
  }
  return features;
}

}  // namespace wellspace::client
