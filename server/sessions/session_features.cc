// Methods of Session about the features that bound its domain: segments or triangles, seeds and rules.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/sessions/session.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The place at which a request goes on with one kind of feature.
struct Place {
  const char* what;          // of several
  const char* offset_field;  // of the request
  const char* field;         // that has them
  uint64_t offset;           // as the request says
  uint64_t count;            // that come with it
  uint64_t committed;        // that the session has

  uint64_t known() const { return std::min(committed - offset, count); }
};

absl::Status CheckPlace(const Place& place, const std::string& session) {
  return place.offset <= place.committed
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_GAP,
                         absl::StrCat(place.offset_field, " is ", place.offset, ", but ", session, " has ",
                                      place.committed, " ", place.what, "; go on at ", place.committed, " or before"),
                         place.offset_field);
}

// `equal`: how many of those that are known are those that the session has.
absl::Status CheckEqual(const Place& place, uint64_t equal, const std::string& session) {
  return equal == place.known()
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_MISMATCH,
                         absl::StrCat(place.what, "[", place.offset + equal, "]: ", session,
                                      " has another there; send the same again, or add others at ", place.committed),
                         place.field);
}

// Refuses features whose numbers begin with `offset` and leave a gap, or which are others than `features` of `session`
// are. `*known` becomes how many of them it has already.
absl::Status CheckRepeated(const FeaturePart& part, const FeatureCounts& offset, const FeatureStore& features,
                           const std::string& session, FeatureCounts* known) {
  const FeatureCounts count = CountsOf(part);
  const FeatureCounts committed = features.counts();
  const Place segments{"segments",      "segment_offset", "segments.ends",
                       offset.segments, count.segments,   committed.segments};
  const Place triangles{"triangles",      "triangle_offset", "triangles.corners",
                        offset.triangles, count.triangles,   committed.triangles};
  const Place seeds{"seeds",      "seed_offset", part.has_surface() ? "surface.seeds" : "faces.seeds",
                    offset.seeds, count.seeds,   committed.seeds};
  for (const Place& place : {segments, triangles, seeds}) {
    WELLSPACE_RETURN_IF_ERROR(CheckPlace(place, session));
  }
  *known = {.segments = segments.known(), .triangles = triangles.known(), .seeds = seeds.known()};
  const FeatureCounts equal = features.CountEqual(offset, *known, part);
  WELLSPACE_RETURN_IF_ERROR(CheckEqual(segments, equal.segments, session));
  WELLSPACE_RETURN_IF_ERROR(CheckEqual(triangles, equal.triangles, session));
  return CheckEqual(seeds, equal.seeds, session);
}

}  // namespace

absl::Status Session::AddFeatures(const FeaturePart& part, const FeatureCounts& offset, uint64_t expected_revision) {
  WELLSPACE_RETURN_IF_ERROR(CheckFeatures(part, offset, dimension()));
  absl::MutexLock change_lock(&change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  FeatureCounts known;
  FeatureCounts added;
  FeatureSummary before;
  {
    absl::MutexLock lock(&mutex_);
    const FeatureStore& features = *stores_.features;
    WELLSPACE_RETURN_IF_ERROR(CheckReady(occupancy_, *state_, stores_.point_count(), expected_revision));
    if (part.has_triangles() && !state_->parameters->periodic_axes.empty()) {
      return MakeError(v1::ERROR_REASON_INVALID_TRIANGLES,
                       absl::StrCat("triangles: ", name(),
                                    " has periodic_axes, which a domain with a surface does not have; create another "
                                    "session without them for this domain"),
                       "triangles");
    }
    WELLSPACE_RETURN_IF_ERROR(CheckRepeated(part, offset, features, name(), &known));
    added = CountsOf(part) - known;
    if (added.all() == 0 && !features.HasOtherRules(part)) {
      return absl::OkStatus();
    }
    if (CheckMesh(*state_).ok()) {
      return MakeError(v1::ERROR_REASON_DOMAIN_FIXED,
                       absl::StrCat(name(),
                                    " has been refined; what bounds a domain can be added only before the "
                                    "first refinement: create another session for this domain"));
    }
    WELLSPACE_RETURN_IF_ERROR(account_.TakeFeatures(added));
    before = features.Summary();
  }
  absl::Status status = RunGuarded([&] {
    FeatureSummary after;
    {
      absl::MutexLock lock(&mutex_);
      FeatureStore& features = *stores_.features;
      features.Append(part, known);
      after = features.Summary();
    }
    SessionChange change = FeaturesChange(*state(), part, known, after);
    change_mutex_.AssertHeld();
    return Make(change, [] {});
  });
  if (!status.ok()) {
    absl::MutexLock lock(&mutex_);
    stores_.features->TakeBack(before);
    account_.ReturnFeatures(added);
  }
  return status;
}

}  // namespace wellspace::server
