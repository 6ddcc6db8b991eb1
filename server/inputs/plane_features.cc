#include "server/inputs/plane_features.h"

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/inputs/part_names.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr RowWords kSegmentWords{.one = "segment", .points = "ends", .points_field = "segments.ends"};

bool RuleFromProto(v1::FaceRule rule, core::FaceRule* out) {
  switch (rule) {
    case v1::FACE_RULE_UNSPECIFIED:
    case v1::FACE_RULE_BOX:
      *out = core::FaceRule::kBox;
      return true;
    case v1::FACE_RULE_HOLES:
      *out = core::FaceRule::kHoles;
      return true;
    case v1::FACE_RULE_EVEN_ODD:
      *out = core::FaceRule::kEvenOdd;
      return true;
    case v1::FACE_RULE_UNION:
      *out = core::FaceRule::kUnion;
      return true;
    default:
      return false;
  }
}

core::CrossingRule RuleFromProto(v1::CrossingRule rule) {
  return rule == v1::CROSSING_RULE_SPLIT  ? core::CrossingRule::kSplit
         : rule == v1::CROSSING_RULE_SNAP ? core::CrossingRule::kSnap
                                          : core::CrossingRule::kRefuse;
}

core::FaceSeed SeedFromProto(const v1::FaceSeed& seed) {
  return {.at = {seed.x(), seed.y()},
          .is_hole = seed.hole(),
          .region = seed.region(),
          .max_area = seed.has_max_area() ? seed.max_area() : std::numeric_limits<double>::infinity(),
          .first_segment = static_cast<uint32_t>(seed.polygon().first()),
          .segment_count = static_cast<uint32_t>(seed.polygon().count())};
}

bool IsSame(const core::FaceSeed& a, const core::FaceSeed& b) {
  return std::memcmp(a.at.data(), b.at.data(), sizeof(a.at)) == 0 && a.SaysTheSameAs(b) &&
         a.first_segment == b.first_segment && a.segment_count == b.segment_count;
}

absl::Status CheckSeed(const v1::FaceSeed& seed, uint64_t number) {
  if (!std::isfinite(seed.x()) || !std::isfinite(seed.y())) {
    return MakeError(
        v1::ERROR_REASON_INVALID_SEGMENTS,
        absl::StrCat("seeds[", number, "]: it is at (", seed.x(), ", ", seed.y(), "); two finite numbers are needed"),
        "faces.seeds");
  }
  if (seed.has_max_area() && (!(seed.max_area() > 0) || !std::isfinite(seed.max_area()))) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("seeds[", number, "]: max_area ", seed.max_area(),
                                  " is not a finite number above 0; leave it out for no bound"),
                     "faces.seeds");
  }
  constexpr uint64_t kMostSegments = std::numeric_limits<uint32_t>::max();
  if (const v1::SegmentRange& polygon = seed.polygon();
      seed.has_polygon() &&
      (polygon.count() == 0 || polygon.count() > kMostSegments || polygon.first() > kMostSegments - polygon.count())) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("seeds[", number, "]: its polygon has ", polygon.count(), " segments from number ",
                                  polygon.first(), " on; expected at least 1, with numbers below 2^32 - 1"),
                     "faces.seeds");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status NotInThePlane(const char* field, int dimension) {
  return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                   absl::StrCat(field, " bound domains in 2-D alone, and parameters.dimension is ", dimension), field);
}

absl::Status CheckSegments(const v1::SegmentChunk& chunk, uint64_t first) {
  WELLSPACE_RETURN_IF_ERROR(CheckWholeRows<2>(kSegmentWords, first, chunk.ends_size()));
  const int count = chunk.ends_size() / 2;
  WELLSPACE_RETURN_IF_ERROR(
      CheckOneForEach(kSegmentWords, first, count, chunk.markers_size(), "markers", "segments.markers"));
  return CheckOneForEach(kSegmentWords, first, count, chunk.groups_size(), "groups", "segments.groups");
}

absl::Status CheckFaces(const v1::FaceOptions& options, uint64_t first) {
  core::FaceRule rule;
  if (!RuleFromProto(options.faces(), &rule)) {
    return MakeError(
        v1::ERROR_REASON_INVALID_SEGMENTS,
        absl::StrCat("faces: ", static_cast<int>(options.faces()),
                     " is not known; 1 (box), 2 (holes), 3 (even-odd) and 4 (union) are, and 0 for the default"),
        "faces.faces");
  }
  if (options.crossings() < v1::CROSSING_RULE_UNSPECIFIED || options.crossings() > v1::CROSSING_RULE_SNAP) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("crossings: ", static_cast<int>(options.crossings()),
                                  " is not known; 1 (refuse), 2 (split) and 3 (snap) are, and 0 for the default"),
                     "faces.crossings");
  }
  if (options.has_snap_distance() && !(options.snap_distance() >= 0 && std::isfinite(options.snap_distance()))) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("snap_distance: ", options.snap_distance(), " is not a finite number of at least 0"),
                     "faces.snap_distance");
  }
  if (options.snap_distance() > 0 && RuleFromProto(options.crossings()) == core::CrossingRule::kRefuse) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("snap_distance: it is ", options.snap_distance(),
                                  ", and crossings 1 (refuse) leads no segment through a point; take 3 (snap) or 2 "
                                  "(split), or leave it out"),
                     "faces.snap_distance");
  }
  for (int i = 0; i < options.seeds_size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckSeed(options.seeds(i), first + i));
  }
  return CheckNames(options.names(), v1::ERROR_REASON_INVALID_SEGMENTS, "faces.names");
}

void PlaneFeatures::Append(const v1::SegmentChunk& chunk, uint64_t known) {
  const uint64_t count = segment_count() + chunk.ends_size() / 2 - known;
  is_open_.MakeRoom(count);
  groups_.MakeRoom(count);
  segments_.Append(chunk.ends(), chunk.markers(), known);
  if (chunk.groups_size() != 0) {
    groups_.Append(chunk.groups().begin() + static_cast<std::ptrdiff_t>(known), chunk.groups().end());
  }
  is_open_.Resize(segment_count(), chunk.open() ? 1 : 0);
  groups_.Resize(segment_count());
}

void PlaneFeatures::Append(const v1::FaceOptions& options, uint64_t known) {
  seeds_.MakeRoom(seed_count() + options.seeds_size() - known);
  has_rules_ = true;
  (void)RuleFromProto(options.faces(), &faces_);
  crossings_ = RuleFromProto(options.crossings());
  snap_distance_ = options.snap_distance();
  if (options.has_names()) {
    names_ = NamesFromProto(options.names());
  }
  for (auto i = static_cast<int>(known); i < options.seeds_size(); ++i) {
    seeds_.Append(SeedFromProto(options.seeds(i)));
  }
}

uint64_t PlaneFeatures::CountEqual(uint64_t first, uint64_t count, const v1::SegmentChunk& chunk) const {
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t s = first + i;
    const auto at = static_cast<int>(i);
    const uint32_t group = chunk.groups_size() == 0 ? 0 : chunk.groups(at);
    if (!segments_.IsEqual(s, chunk.ends(), chunk.markers(), at) || groups_[s] != group ||
        (is_open_[s] != 0) != chunk.open()) {
      return i;
    }
  }
  return count;
}

uint64_t PlaneFeatures::CountEqual(uint64_t first, uint64_t count, const v1::FaceOptions& options) const {
  for (uint64_t i = 0; i < count; ++i) {
    if (!IsSame(seeds_[first + i], SeedFromProto(options.seeds(static_cast<int>(i))))) {
      return i;
    }
  }
  return count;
}

bool PlaneFeatures::HasOtherRules(const v1::FaceOptions& options) const {
  core::FaceRule rule = core::FaceRule::kBox;
  (void)RuleFromProto(options.faces(), &rule);
  return IsEmpty() || rule != faces_ || RuleFromProto(options.crossings()) != crossings_ ||
         options.snap_distance() != snap_distance_ ||
         (options.has_names() && NamesFromProto(options.names()) != names_);
}

void PlaneFeatures::TakeBack(const FeatureSummary& before) {
  const bool is_of_plane = !before.surface.has_value();
  segments_.TakeBack(before.counts.segments);
  is_open_.Resize(before.counts.segments);
  groups_.Resize(before.counts.segments);
  seeds_.Resize(is_of_plane ? before.counts.seeds : 0);
  has_rules_ = is_of_plane && before.has_rules;
  (void)RuleFromProto(before.faces, &faces_);
  crossings_ = RuleFromProto(before.crossings);
  snap_distance_ = before.snap_distance;
  names_ = NamesFromProto(before.names);
}

FeatureSummary PlaneFeatures::Summary() const {
  return {.counts = {.segments = segment_count(), .seeds = seed_count()},
          .has_rules = has_rules_,
          .faces = face_rule(),
          .crossings = crossing_rule(),
          .snap_distance = snap_distance_,
          .names = NamesToProto(names_)};
}

v1::FaceRule PlaneFeatures::face_rule() const {
  return IsEmpty()                            ? v1::FACE_RULE_UNSPECIFIED
         : faces_ == core::FaceRule::kHoles   ? v1::FACE_RULE_HOLES
         : faces_ == core::FaceRule::kEvenOdd ? v1::FACE_RULE_EVEN_ODD
         : faces_ == core::FaceRule::kUnion   ? v1::FACE_RULE_UNION
                                              : v1::FACE_RULE_BOX;
}

v1::CrossingRule PlaneFeatures::crossing_rule() const {
  return IsEmpty()                                  ? v1::CROSSING_RULE_UNSPECIFIED
         : crossings_ == core::CrossingRule::kSplit ? v1::CROSSING_RULE_SPLIT
         : crossings_ == core::CrossingRule::kSnap  ? v1::CROSSING_RULE_SNAP
                                                    : v1::CROSSING_RULE_REFUSE;
}

core::Features PlaneFeatures::View() const {
  return core::Features{.ends = segments_.points(),
                        .markers = segments_.markers(),
                        .is_open = is_open_,
                        .groups = groups_,
                        .seeds = seeds_,
                        .faces = faces_,
                        .crossings = crossings_,
                        .snap_distance = snap_distance_,
                        .names = &names_};
}

}  // namespace wellspace::server
