#include "server/inputs/feature_store.h"

#include <algorithm>

#include "core/base/status_macros.h"

namespace wellspace::server {

FeatureCounts CountsOf(const FeaturePart& part) {
  return {.segments = static_cast<uint64_t>(part.segments().ends_size()) / 2,
          .triangles = static_cast<uint64_t>(part.triangles().corners_size()) / 3,
          .seeds = static_cast<uint64_t>(part.faces().seeds_size()) + part.surface().seeds_size()};
}

uint64_t FeatureBytes(const FeatureCounts& counts) {
  return counts.segments * PlaneFeatures::kSegmentBytes + counts.triangles * SpaceFeatures::kTriangleBytes +
         counts.seeds * std::max(PlaneFeatures::kSeedBytes, SpaceFeatures::kSeedBytes);
}

absl::Status CheckFeatures(const FeaturePart& part, const FeatureCounts& first, int dimension) {
  if ((part.has_segments() || part.has_faces()) && dimension != 2) {
    return NotInThePlane(part.has_segments() ? "segments" : "faces", dimension);
  }
  if ((part.has_triangles() || part.has_surface()) && dimension != 3) {
    return NotInSpace(part.has_triangles() ? "triangles" : "surface", dimension);
  }
  WELLSPACE_RETURN_IF_ERROR(CheckSegments(part.segments(), first.segments));
  WELLSPACE_RETURN_IF_ERROR(CheckFaces(part.faces(), first.seeds));
  WELLSPACE_RETURN_IF_ERROR(CheckTriangles(part.triangles(), first.triangles));
  return CheckSurface(part.surface(), first.seeds);
}

void DropKnown(const FeatureCounts& known, FeaturePart& part) {
  const auto drop = [](auto* numbers, uint64_t count) {
    numbers->ExtractSubrange(0, std::min(static_cast<int>(count), numbers->size()), nullptr);
  };
  if (part.has_segments()) {
    drop(part.mutable_segments()->mutable_ends(), 2 * known.segments);
    drop(part.mutable_segments()->mutable_markers(), known.segments);
    drop(part.mutable_segments()->mutable_groups(), known.segments);
  }
  if (part.has_faces()) {
    part.mutable_faces()->mutable_seeds()->DeleteSubrange(0, static_cast<int>(known.seeds));
  }
  if (part.has_triangles()) {
    drop(part.mutable_triangles()->mutable_corners(), 3 * known.triangles);
    drop(part.mutable_triangles()->mutable_markers(), known.triangles);
  }
  if (part.has_surface()) {
    part.mutable_surface()->mutable_seeds()->DeleteSubrange(0, static_cast<int>(known.seeds));
  }
}

void SetFeatures(const FeatureSummary& summary, store::v1::SessionRecord& record) {
  record.set_segments(summary.counts.segments);
  record.set_triangles(summary.counts.triangles);
  record.set_seeds(summary.counts.seeds);
  record.set_has_rules(summary.has_rules);
  record.set_faces(summary.faces);
  record.set_crossings(summary.crossings);
  record.set_snap_distance(summary.snap_distance);
  record.clear_names();
  if (summary.names.markers_size() + summary.names.regions_size() > 0) {
    *record.mutable_names() = summary.names;
  }
  record.clear_surface();
  if (summary.surface.has_value()) {
    *record.mutable_surface() = *summary.surface;
  }
}

void FeatureStore::Append(const FeaturePart& part, const FeatureCounts& known) {
  plane_.Append(part.segments(), known.segments);
  if (part.has_faces()) {
    plane_.Append(part.faces(), known.seeds);
  }
  space_.Append(part.triangles(), known.triangles);
  if (part.has_surface()) {
    space_.Append(part.surface(), known.seeds);
  }
}

void FeatureStore::TakeBack(const FeatureSummary& before) {
  plane_.TakeBack(before);
  space_.TakeBack(before);
}

FeatureCounts FeatureStore::CountEqual(const FeatureCounts& first, const FeatureCounts& count,
                                       const FeaturePart& part) const {
  return {.segments = plane_.CountEqual(first.segments, count.segments, part.segments()),
          .triangles = space_.CountEqual(first.triangles, count.triangles, part.triangles()),
          .seeds = part.has_surface() ? space_.CountEqual(first.seeds, count.seeds, part.surface())
                                      : plane_.CountEqual(first.seeds, count.seeds, part.faces())};
}

bool FeatureStore::HasOtherRules(const FeaturePart& part) const {
  return (part.has_faces() && plane_.HasOtherRules(part.faces())) ||
         (part.has_surface() && space_.HasOtherRules(part.surface()));
}

core::Input FeatureStore::InputOf(std::span<const double> points) const {
  return !plane_.IsEmpty()   ? core::Input(points, plane_.View())
         : !space_.IsEmpty() ? core::Input(points, space_.View())
                             : core::Input(points);
}

}  // namespace wellspace::server
