#include "client/files/domain_features.h"

#include <cstddef>
#include <cstdint>

#include "client/files/region_numbers.h"

namespace wellspace::client {
namespace {

FaceRule RuleOf(formats::PlanarDomain::FaceRule of_file) {
  using FileRule = formats::PlanarDomain::FaceRule;
  switch (of_file) {
    case FileRule::kHoles:
      return FaceRule::kHoles;
    case FileRule::kEvenOdd:
      return FaceRule::kEvenOdd;
    case FileRule::kUnion:
      return FaceRule::kUnion;
    case FileRule::kBox:
      break;
  }
  return FaceRule::kBox;
}

}  // namespace

Features FeaturesOf(const formats::PlanarDomain& domain, const std::optional<FaceRule>& faces,
                    std::vector<std::string>& notes) {
  Features features;
  features.ends = domain.segments;
  features.markers = domain.markers;
  features.is_open = domain.is_line;
  features.faces = faces.value_or(RuleOf(domain.faces));
  if (features.faces == FaceRule::kUnion) {
    features.groups = domain.groups;
  }
  const std::vector<int32_t> regions = NumberRegions(domain.name, domain.seeds, notes);
  for (size_t i = 0; i < domain.seeds.size(); ++i) {
    const formats::PlanarDomain::Seed& seed = domain.seeds[i];
    features.seeds.push_back({.x = seed.x,
                              .y = seed.y,
                              .is_hole = seed.is_hole,
                              .region = regions[i],
                              .max_area = seed.max_area > 0 ? std::optional(seed.max_area) : std::nullopt,
                              .first_segment = seed.first_segment,
                              .segment_count = seed.segment_count});
  }
  return features;
}

}  // namespace wellspace::client
