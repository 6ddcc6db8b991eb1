#include "server/inputs/space_features.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/inputs/part_names.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr RowWords kTriangleWords{.one = "triangle", .points = "corners", .points_field = "triangles.corners"};
constexpr double kMostCreaseAngle = 180;

absl::Status Refusal(const std::string& message, const char* field) {
  return MakeError(v1::ERROR_REASON_INVALID_TRIANGLES, message, field);
}

bool IsKnown(v1::SolidRule rule) {
  return rule == v1::SOLID_RULE_UNSPECIFIED || rule == v1::SOLID_RULE_BOX || rule == v1::SOLID_RULE_HOLES ||
         rule == v1::SOLID_RULE_EVEN_ODD || rule == v1::SOLID_RULE_WINDING;
}

core::SolidRule RuleFromProto(v1::SolidRule rule) {
  switch (rule) {
    case v1::SOLID_RULE_BOX:
      return core::SolidRule::kBox;
    case v1::SOLID_RULE_HOLES:
      return core::SolidRule::kHoles;
    case v1::SOLID_RULE_WINDING:
      return core::SolidRule::kWinding;
    default:
      return core::SolidRule::kEvenOdd;
  }
}

v1::SolidRule RuleToProto(core::SolidRule rule) {
  switch (rule) {
    case core::SolidRule::kBox:
      return v1::SOLID_RULE_BOX;
    case core::SolidRule::kHoles:
      return v1::SOLID_RULE_HOLES;
    case core::SolidRule::kWinding:
      return v1::SOLID_RULE_WINDING;
    case core::SolidRule::kEvenOdd:
      break;
  }
  return v1::SOLID_RULE_EVEN_ODD;
}

core::SolidSeed SeedFromProto(const v1::SolidSeed& seed) {
  return {.at = {seed.x(), seed.y(), seed.z()},
          .is_hole = seed.hole(),
          .region = seed.region(),
          .max_volume = seed.has_max_volume() ? seed.max_volume() : std::numeric_limits<double>::infinity()};
}

bool IsSame(const core::SolidSeed& a, const core::SolidSeed& b) {
  return std::memcmp(a.at.data(), b.at.data(), sizeof(a.at)) == 0 && a.is_hole == b.is_hole && a.region == b.region &&
         a.max_volume == b.max_volume;
}

// All but arrays and seeds.
core::SurfaceFeatures RulesFromProto(const v1::SurfaceOptions& options) {
  core::SurfaceFeatures rules;
  rules.solids = RuleFromProto(options.solids());
  rules.crease_angle = options.has_crease_angle() ? options.crease_angle() : rules.crease_angle;
  rules.weld = options.weld();
  rules.min_patch = options.min_patch();
  rules.resolution = options.resolution();
  rules.keeps_points = options.keep_points();
  if (options.box().low_size() == 3 && options.box().high_size() == 3) {
    rules.box.emplace();
    std::copy(options.box().low().begin(), options.box().low().end(), rules.box->low.begin());
    std::copy(options.box().high().begin(), options.box().high().end(), rules.box->high.begin());
  }
  return rules;
}

v1::SurfaceOptions RulesToProto(const core::SurfaceFeatures& rules) {
  v1::SurfaceOptions options;
  options.set_solids(RuleToProto(rules.solids));
  options.set_crease_angle(rules.crease_angle);
  if (rules.weld > 0) {
    options.set_weld(rules.weld);
  }
  if (rules.min_patch > 0) {
    options.set_min_patch(rules.min_patch);
  }
  if (rules.resolution > 0) {
    options.set_resolution(rules.resolution);
  }
  options.set_keep_points(rules.keeps_points);
  if (rules.box.has_value()) {
    options.mutable_box()->mutable_low()->Add(rules.box->low.begin(), rules.box->low.end());
    options.mutable_box()->mutable_high()->Add(rules.box->high.begin(), rules.box->high.end());
  }
  return options;
}

absl::Status CheckSeed(const v1::SolidSeed& seed, uint64_t number) {
  if (!std::isfinite(seed.x()) || !std::isfinite(seed.y()) || !std::isfinite(seed.z())) {
    return Refusal(absl::StrCat("seeds[", number, "]: it is at (", seed.x(), ", ", seed.y(), ", ", seed.z(),
                                "); three finite numbers are needed"),
                   "surface.seeds");
  }
  if (seed.has_max_volume() && (!(seed.max_volume() > 0) || !std::isfinite(seed.max_volume()))) {
    return Refusal(absl::StrCat("seeds[", number, "]: max_volume ", seed.max_volume(),
                                " is not a finite number above 0; leave it out for no bound"),
                   "surface.seeds");
  }
  return absl::OkStatus();
}

absl::Status CheckBox(const v1::SurfaceOptions& options) {
  if (options.has_box() != (options.solids() == v1::SOLID_RULE_BOX)) {
    return Refusal(options.has_box() ? "box: it is of SOLID_RULE_BOX alone; leave it out, or take this"
                                     : "box: SOLID_RULE_BOX needs one; expected three low and three high coordinates",
                   "surface.box");
  }
  const v1::Box& box = options.box();
  bool is_box = box.low_size() == 3 && box.high_size() == 3;
  for (int axis = 0; axis < 3 && is_box; ++axis) {
    is_box = std::isfinite(box.low(axis)) && std::isfinite(box.high(axis)) && box.low(axis) < box.high(axis);
  }
  return !options.has_box() || is_box
             ? absl::OkStatus()
             : Refusal(absl::StrCat("box: low has ", box.low_size(), " numbers and high ", box.high_size(),
                                    "; expected three finite ones each, every low one below its high one"),
                       "surface.box");
}

}  // namespace

absl::Status NotInSpace(const char* field, int dimension) {
  return Refusal(absl::StrCat(field, " bounds domains in 3-D alone, and parameters.dimension is ", dimension), field);
}

absl::Status CheckTriangles(const v1::TriangleChunk& chunk, uint64_t first) {
  WELLSPACE_RETURN_IF_ERROR(CheckWholeRows<3>(kTriangleWords, first, chunk.corners_size()));
  return CheckOneForEach(kTriangleWords, first, chunk.corners_size() / 3, chunk.markers_size(), "markers",
                         "triangles.markers");
}

absl::Status CheckSurface(const v1::SurfaceOptions& options, uint64_t first) {
  if (!IsKnown(options.solids())) {
    return Refusal(
        absl::StrCat("solids: ", static_cast<int>(options.solids()),
                     " is not known; 1 (box), 2 (holes), 3 (even-odd) and 4 (winding) are, and 0 for the default"),
        "surface.solids");
  }
  const double angle = options.crease_angle();
  if (options.has_crease_angle() && !(angle >= 0 && angle <= kMostCreaseAngle)) {
    return Refusal(absl::StrCat("crease_angle: ", angle, " is not allowed; 0 to ", kMostCreaseAngle,
                                " degrees are, or nothing for the default"),
                   "surface.crease_angle");
  }
  if (options.has_weld() && !(options.weld() >= 0 && std::isfinite(options.weld()))) {
    return Refusal(absl::StrCat("weld: ", options.weld(), " is not a finite number of at least 0"), "surface.weld");
  }
  for (const auto& [name, field, is_sent, length] :
       {std::tuple("min_patch", "surface.min_patch", options.has_min_patch(), options.min_patch()),
        {"resolution", "surface.resolution", options.has_resolution(), options.resolution()}}) {
    if (is_sent && !(length > 0 && std::isfinite(length))) {
      return Refusal(absl::StrCat(name, ": ", length, " is not a finite number above 0; leave it out for the default"),
                     field);
    }
  }
  WELLSPACE_RETURN_IF_ERROR(CheckBox(options));
  for (int i = 0; i < options.seeds_size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckSeed(options.seeds(i), first + i));
  }
  return CheckNames(options.names(), v1::ERROR_REASON_INVALID_TRIANGLES, "surface.names");
}

void SpaceFeatures::Append(const v1::TriangleChunk& chunk, uint64_t known) {
  triangles_.Append(chunk.corners(), chunk.markers(), known);
}

void SpaceFeatures::Append(const v1::SurfaceOptions& options, uint64_t known) {
  seeds_.MakeRoom(seed_count() + options.seeds_size() - known);
  has_rules_ = true;
  rules_ = RulesFromProto(options);
  if (options.has_names()) {
    names_ = NamesFromProto(options.names());
  }
  for (auto i = static_cast<int>(known); i < options.seeds_size(); ++i) {
    seeds_.Append(SeedFromProto(options.seeds(i)));
  }
}

void SpaceFeatures::TakeBack(const FeatureSummary& before) {
  triangles_.TakeBack(before.counts.triangles);
  seeds_.Resize(before.surface.has_value() ? before.counts.seeds : 0);
  has_rules_ = before.has_rules && before.surface.has_value();
  rules_ = RulesFromProto(before.surface.value_or(v1::SurfaceOptions()));
  names_ = NamesFromProto(before.names);
}

uint64_t SpaceFeatures::CountEqual(uint64_t first, uint64_t count, const v1::TriangleChunk& chunk) const {
  for (uint64_t i = 0; i < count; ++i) {
    if (!triangles_.IsEqual(first + i, chunk.corners(), chunk.markers(), static_cast<int>(i))) {
      return i;
    }
  }
  return count;
}

uint64_t SpaceFeatures::CountEqual(uint64_t first, uint64_t count, const v1::SurfaceOptions& options) const {
  for (uint64_t i = 0; i < count; ++i) {
    if (!IsSame(seeds_[first + i], SeedFromProto(options.seeds(static_cast<int>(i))))) {
      return i;
    }
  }
  return count;
}

bool SpaceFeatures::HasOtherRules(const v1::SurfaceOptions& options) const {
  const core::SurfaceFeatures rules = RulesFromProto(options);
  return IsEmpty() || rules.solids != rules_.solids || rules.crease_angle != rules_.crease_angle ||
         rules.weld != rules_.weld || rules.min_patch != rules_.min_patch || rules.resolution != rules_.resolution ||
         rules.keeps_points != rules_.keeps_points || rules.box != rules_.box ||
         (options.has_names() && NamesFromProto(options.names()) != names_);
}

FeatureSummary SpaceFeatures::Summary() const {
  FeatureSummary summary;
  summary.counts = {.triangles = triangle_count(), .seeds = seed_count()};
  summary.has_rules = has_rules_;
  if (!IsEmpty()) {
    summary.surface = RulesToProto(rules_);
  }
  summary.names = NamesToProto(names_);
  return summary;
}

core::SurfaceFeatures SpaceFeatures::View() const {
  core::SurfaceFeatures features = rules_;
  features.corners = triangles_.points();
  features.markers = triangles_.markers();
  features.seeds = seeds_;
  features.names = &names_;
  return features;
}

}  // namespace wellspace::server
