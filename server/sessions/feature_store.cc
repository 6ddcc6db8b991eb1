#include "server/sessions/feature_store.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

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

void SetFeatures(const FeatureSummary& summary, store::v1::SessionRecord& record) {
  record.set_segments(summary.segments);
  record.set_seeds(summary.seeds);
  record.set_has_rules(summary.has_rules);
  record.set_faces(summary.faces);
  record.set_crossings(summary.crossings);
}

absl::Status NotInThePlane(const char* field, int dimension) {
  return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                   absl::StrCat(field, " bound domains in 2-D alone, and parameters.dimension is ", dimension), field);
}

absl::Status CheckSegments(const v1::SegmentChunk& chunk, uint64_t first) {
  if (chunk.ends_size() % 2 != 0) {
    return MakeError(
        v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
        absl::StrCat("the chunk after segment ", first, " has ", chunk.ends_size(), " ends; expected a multiple of 2"),
        "segments.ends");
  }
  const int count = chunk.ends_size() / 2;
  if (chunk.markers_size() != 0 && chunk.markers_size() != count) {
    return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                     absl::StrCat("the chunk after segment ", first, " has ", chunk.markers_size(), " markers and ",
                                  count, " segments; expected one for each, or none"),
                     "segments.markers");
  }
  return absl::OkStatus();
}

absl::Status CheckFaces(const v1::FaceOptions& options, uint64_t first) {
  core::FaceRule rule;
  if (!RuleFromProto(options.faces(), &rule)) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("faces: ", static_cast<int>(options.faces()),
                                  " is not known; 1 (box), 2 (holes) and 3 (even-odd) are, and 0 for the default"),
                     "faces.faces");
  }
  if (options.crossings() < v1::CROSSING_RULE_UNSPECIFIED || options.crossings() > v1::CROSSING_RULE_SNAP) {
    return MakeError(v1::ERROR_REASON_INVALID_SEGMENTS,
                     absl::StrCat("crossings: ", static_cast<int>(options.crossings()),
                                  " is not known; 1 (refuse), 2 (split) and 3 (snap) are, and 0 for the default"),
                     "faces.crossings");
  }
  for (int i = 0; i < options.seeds_size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckSeed(options.seeds(i), first + i));
  }
  return absl::OkStatus();
}

void FeatureStore::Append(const v1::SegmentChunk& chunk, uint64_t known) {
  const auto skipped = static_cast<std::ptrdiff_t>(known);
  const size_t count = segment_count() + chunk.ends_size() / 2 - known;
  ends_.MakeRoom(2 * count);
  markers_.MakeRoom(count);
  is_open_.MakeRoom(count);
  ends_.Append(chunk.ends().begin() + 2 * skipped, chunk.ends().end());
  if (chunk.markers_size() != 0) {
    markers_.Append(chunk.markers().begin() + skipped, chunk.markers().end());
  }
  markers_.Resize(segment_count());
  is_open_.Resize(segment_count(), chunk.open() ? 1 : 0);
}

void FeatureStore::Append(const v1::FaceOptions& options, uint64_t known) {
  seeds_.MakeRoom(seed_count() + options.seeds_size() - known);
  has_rules_ = true;
  (void)RuleFromProto(options.faces(), &faces_);
  crossings_ = RuleFromProto(options.crossings());
  for (auto i = static_cast<int>(known); i < options.seeds_size(); ++i) {
    seeds_.Append(SeedFromProto(options.seeds(i)));
  }
}

uint64_t FeatureStore::CountEqual(uint64_t first, uint64_t count, const v1::SegmentChunk& chunk) const {
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t s = first + i;
    const auto at = static_cast<int>(i);
    const int32_t marker = chunk.markers_size() == 0 ? 0 : chunk.markers(at);
    if (ends_[2 * s] != chunk.ends(2 * at) || ends_[2 * s + 1] != chunk.ends(2 * at + 1) || markers_[s] != marker ||
        (is_open_[s] != 0) != chunk.open()) {
      return i;
    }
  }
  return count;
}

uint64_t FeatureStore::CountEqual(uint64_t first, uint64_t count, const v1::FaceOptions& options) const {
  for (uint64_t i = 0; i < count; ++i) {
    if (!IsSame(seeds_[first + i], SeedFromProto(options.seeds(static_cast<int>(i))))) {
      return i;
    }
  }
  return count;
}

bool FeatureStore::HasOtherRules(const v1::FaceOptions& options) const {
  core::FaceRule rule = core::FaceRule::kBox;
  (void)RuleFromProto(options.faces(), &rule);
  return IsEmpty() || rule != faces_ || RuleFromProto(options.crossings()) != crossings_;
}

void FeatureStore::TakeBack(const FeatureSummary& before) {
  ends_.Resize(2 * before.segments);
  markers_.Resize(before.segments);
  is_open_.Resize(before.segments);
  seeds_.Resize(before.seeds);
  has_rules_ = before.has_rules;
  (void)RuleFromProto(before.faces, &faces_);
  crossings_ = RuleFromProto(before.crossings);
}

FeatureSummary FeatureStore::Summary() const {
  return {.segments = segment_count(),
          .seeds = seed_count(),
          .has_rules = has_rules_,
          .faces = face_rule(),
          .crossings = crossing_rule()};
}

v1::FaceRule FeatureStore::face_rule() const {
  return IsEmpty()                            ? v1::FACE_RULE_UNSPECIFIED
         : faces_ == core::FaceRule::kHoles   ? v1::FACE_RULE_HOLES
         : faces_ == core::FaceRule::kEvenOdd ? v1::FACE_RULE_EVEN_ODD
                                              : v1::FACE_RULE_BOX;
}

v1::CrossingRule FeatureStore::crossing_rule() const {
  return IsEmpty()                                  ? v1::CROSSING_RULE_UNSPECIFIED
         : crossings_ == core::CrossingRule::kSplit ? v1::CROSSING_RULE_SPLIT
         : crossings_ == core::CrossingRule::kSnap  ? v1::CROSSING_RULE_SNAP
                                                    : v1::CROSSING_RULE_REFUSE;
}

std::optional<core::Features> FeatureStore::View() const {
  if (IsEmpty()) {
    return std::nullopt;
  }
  return core::Features{.ends = ends_,
                        .markers = markers_,
                        .is_open = is_open_,
                        .seeds = seeds_,
                        .faces = faces_,
                        .crossings = crossings_};
}

}  // namespace wellspace::server
