#include "client/grpc/feature_messages.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

namespace wellspace::client {
namespace {

// Segments or triangles, and seeds, of one message: about 256 KiB.
constexpr size_t kRowsOfARequest = 16'384;
constexpr size_t kSeedsOfARequest = 4'096;

constexpr std::pair<FaceRule, v1::FaceRule> kFaceRules[] = {{FaceRule::kBox, v1::FACE_RULE_BOX},
                                                            {FaceRule::kHoles, v1::FACE_RULE_HOLES},
                                                            {FaceRule::kEvenOdd, v1::FACE_RULE_EVEN_ODD},
                                                            {FaceRule::kUnion, v1::FACE_RULE_UNION}};
constexpr std::pair<CrossingRule, v1::CrossingRule> kCrossingRules[] = {
    {CrossingRule::kRefuse, v1::CROSSING_RULE_REFUSE},
    {CrossingRule::kSnap, v1::CROSSING_RULE_SNAP},
    {CrossingRule::kSplit, v1::CROSSING_RULE_SPLIT}};

// REQUIRES:   `rule` is in the table.
template <class Rule, class Message, size_t N>
Message ToProto(const std::pair<Rule, Message> (&table)[N], Rule rule) {
  return std::find_if(std::begin(table), std::end(table), [&](const auto& row) { return row.first == rule; })->second;
}

template <class Rule, class Message, size_t N>
std::optional<Rule> FromProto(const std::pair<Rule, Message> (&table)[N], Message message) {
  const auto* const row =
      std::find_if(std::begin(table), std::end(table), [&](const auto& one) { return one.second == message; });
  return row == std::end(table) ? std::nullopt : std::optional(row->first);
}

void FillNames(const PartNames& names, v1::PartNames& message) {
  message.mutable_markers()->insert(names.markers.begin(), names.markers.end());
  message.mutable_regions()->insert(names.regions.begin(), names.regions.end());
}

}  // namespace

std::optional<FaceRule> FaceRuleFromProto(v1::FaceRule rule) { return FromProto(kFaceRules, rule); }

CrossingRule CrossingRuleFromProto(v1::CrossingRule rule) {
  return FromProto(kCrossingRules, rule).value_or(CrossingRule::kRefuse);
}

size_t FillSegments(const Features& features, size_t first, v1::SegmentChunk& chunk) {
  const auto is_open = [&](size_t s) { return s < features.is_open.size() && features.is_open[s] != 0; };
  const size_t end = std::min(first + kRowsOfARequest, features.ends.size() / 2);
  chunk.Clear();
  chunk.set_open(is_open(first));
  for (; first < end && is_open(first) == chunk.open(); ++first) {
    chunk.add_ends(features.ends[2 * first]);
    chunk.add_ends(features.ends[2 * first + 1]);
    if (!features.markers.empty()) {
      chunk.add_markers(features.markers[first]);
    }
    if (!features.groups.empty()) {
      chunk.add_groups(features.groups[first]);
    }
  }
  return first;
}

size_t FillFaces(const Features& features, size_t first, v1::FaceOptions& options) {
  const size_t end = std::min(first + kSeedsOfARequest, features.seeds.size());
  options.Clear();
  options.set_faces(ToProto(kFaceRules, features.faces));
  options.set_crossings(ToProto(kCrossingRules, features.crossings));
  if (first == 0 && !features.names.IsEmpty()) {
    FillNames(features.names, *options.mutable_names());
  }
  if (features.snap_distance.has_value()) {
    options.set_snap_distance(*features.snap_distance);
  }
  for (; first < end; ++first) {
    const FaceSeed& seed = features.seeds[first];
    v1::FaceSeed& message = *options.add_seeds();
    message.set_x(seed.x);
    message.set_y(seed.y);
    message.set_hole(seed.is_hole);
    message.set_region(seed.region);
    if (seed.max_area.has_value()) {
      message.set_max_area(*seed.max_area);
    }
    if (seed.segment_count > 0) {
      message.mutable_polygon()->set_first(seed.first_segment);
      message.mutable_polygon()->set_count(seed.segment_count);
    }
  }
  return end;
}

size_t FillTriangles(const SurfaceFeatures& surface, size_t first, v1::TriangleChunk& chunk) {
  const size_t end = std::min(first + kRowsOfARequest, surface.corners.size() / 3);
  const auto rows = [first, end](const auto& values, size_t width) {
    return std::span(values).subspan(width * first, width * (end - first));
  };
  const auto corners = rows(surface.corners, 3);
  chunk.Clear();
  chunk.mutable_corners()->Assign(corners.begin(), corners.end());
  if (!surface.markers.empty()) {
    const auto markers = rows(surface.markers, 1);
    chunk.mutable_markers()->Assign(markers.begin(), markers.end());
  }
  return end;
}

size_t FillSurface(const SurfaceFeatures& surface, size_t first, v1::SurfaceOptions& options) {
  const auto set = [&options](const std::optional<double>& value, auto setter) {
    if (value.has_value()) {
      (options.*setter)(*value);
    }
  };
  const size_t end = std::min(first + kSeedsOfARequest, surface.seeds.size());
  options.Clear();
  options.set_solids(surface.solids == SolidRule::kBox       ? v1::SOLID_RULE_BOX
                     : surface.solids == SolidRule::kHoles   ? v1::SOLID_RULE_HOLES
                     : surface.solids == SolidRule::kWinding ? v1::SOLID_RULE_WINDING
                                                             : v1::SOLID_RULE_EVEN_ODD);
  set(surface.crease_angle, &v1::SurfaceOptions::set_crease_angle);
  set(surface.weld, &v1::SurfaceOptions::set_weld);
  set(surface.min_patch, &v1::SurfaceOptions::set_min_patch);
  set(surface.resolution, &v1::SurfaceOptions::set_resolution);
  options.set_keep_points(surface.keeps_points);
  if (surface.box.has_value()) {
    options.mutable_box()->mutable_low()->Add(surface.box->begin(), surface.box->begin() + 3);
    options.mutable_box()->mutable_high()->Add(surface.box->begin() + 3, surface.box->end());
  }
  if (first == 0 && !surface.names.IsEmpty()) {
    FillNames(surface.names, *options.mutable_names());
  }
  for (; first < end; ++first) {
    const SolidSeed& seed = surface.seeds[first];
    v1::SolidSeed& message = *options.add_seeds();
    message.set_x(seed.x);
    message.set_y(seed.y);
    message.set_z(seed.z);
    message.set_hole(seed.is_hole);
    message.set_region(seed.region);
    if (seed.max_volume.has_value()) {
      message.set_max_volume(*seed.max_volume);
    }
  }
  return end;
}

}  // namespace wellspace::client
